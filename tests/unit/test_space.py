import numpy as np
import pytest
from scipy.stats import kstest, lognorm, norm

from physid_drake.errors import ParameterError
from physid_drake.space import Parameter, ParameterSpace


def pushed_box() -> ParameterSpace:
    return ParameterSpace(
        parameters=(
            Parameter(name="mass", unit="kg", lower=0.01, upper=10.0, prior_mean=0.5, prior_std=0.4, scale="log"),
            Parameter(name="support_friction", unit="-", lower=0.05, upper=1.2, prior_mean=0.3, prior_std=0.1),
            Parameter(name="com_offset", unit="m", lower=-0.02, upper=0.03, prior_mean=0.0),
        )
    )


def test_unit_cube_corners_are_the_bounds():
    space = pushed_box()
    np.testing.assert_allclose(space.from_unit(np.zeros(3)), [0.01, 0.05, -0.02])
    np.testing.assert_allclose(space.from_unit(np.ones(3)), [10.0, 1.2, 0.03])


def test_unit_cube_corners_are_never_outside_by_round_off():
    for lower in np.linspace(0.001, 0.1, 50):
        p = Parameter(name="a", unit="-", lower=lower, upper=7 * lower, prior_mean=lower, scale="log")
        space = ParameterSpace(parameters=(p,))
        space.check(space.from_unit([[0.0], [1.0]]))


def test_middle_of_a_log_scale_is_the_geometric_mean():
    np.testing.assert_allclose(pushed_box().from_unit(np.full(3, 0.5)), [np.sqrt(0.1), 0.625, 0.005])


def test_unit_cube_there_and_back_is_the_same_point():
    space = pushed_box()
    thetas = space.sample(np.random.default_rng(0), 100, from_prior=False)
    np.testing.assert_allclose(space.from_unit(space.to_unit(thetas)), thetas, rtol=1e-12)


def test_a_point_outside_is_refused_by_name_bounds_value_and_unit():
    with pytest.raises(ParameterError, match=r"'mass'.*\[0.01, 10\] kg.*20 kg.*widen"):
        pushed_box().check([20.0, 0.3, 0.0])


def test_nan_is_outside_every_bound():
    with pytest.raises(ParameterError, match="support_friction"):
        pushed_box().check([1.0, np.nan, 0.0])


def test_a_point_of_wrong_length_is_refused():
    with pytest.raises(ParameterError, match="3 entries"):
        pushed_box().check([1.0, 0.3])


def test_a_name_that_occurs_twice_is_refused():
    p = Parameter(name="mass", unit="kg", lower=0.1, upper=1.0, prior_mean=0.5)
    with pytest.raises(ParameterError, match="unique"):
        ParameterSpace(parameters=(p, p))


@pytest.mark.parametrize(
    "wrong",
    [
        {"lower": 2.0},
        {"lower": 0.0, "scale": "log"},
        {"prior_mean": 3.0},
        {"prior_std": 0.0},
        {"upper": np.inf},
        {"scale": "cubic"},
        {"name": "my mass"},
    ],
)
def test_a_parameter_that_breaks_a_rule_is_refused(wrong):
    right = {"name": "mass", "unit": "kg", "lower": 0.1, "upper": 1.0, "prior_mean": 0.5}
    Parameter(**right)
    with pytest.raises(ParameterError):
        Parameter(**{**right, **wrong})


def test_uniform_samples_are_uniform_on_the_scale_and_prior_samples_follow_the_prior():
    space = pushed_box()
    flat = space.to_unit(space.sample(np.random.default_rng(1), 1024, from_prior=False))
    assert max(kstest(flat[:, i], "uniform").statistic for i in range(3)) < 0.01
    drawn = space.sample(np.random.default_rng(1), 1024, from_prior=True)
    assert kstest(drawn[:, 0], lognorm(s=0.4, scale=0.5).cdf).statistic < 0.01
    assert kstest(drawn[:, 1], norm(0.3, 0.1).cdf).statistic < 0.02
    space.check(drawn)


def test_the_same_seed_samples_the_same_points_and_a_second_call_others():
    space = pushed_box()
    rng = np.random.default_rng(2)
    first, second = (space.sample(rng, 10, from_prior=True) for _ in range(2))
    np.testing.assert_array_equal(first, space.sample(np.random.default_rng(2), 10, from_prior=True))
    assert not np.any(first == second)


def test_a_prior_deviation_in_the_unit_cube_is_that_of_its_scale():
    space = pushed_box()
    for j, p in enumerate(space.parameters):
        if p.prior_std is None:
            assert space.prior_std_unit[j] == pytest.approx(1.0 / np.sqrt(12.0))
            continue
        u = space.to_unit(space.nominal)
        u[j] -= space.prior_std_unit[j]
        moved = p.to_scale(space.from_unit(u)[j]) - p.to_scale(p.prior_mean)
        assert moved == pytest.approx(-p.prior_std)


def test_a_point_becomes_a_mapping_by_name():
    assert pushed_box().as_dict([1.0, 0.4, 0.01]) == {"mass": 1.0, "support_friction": 0.4, "com_offset": 0.01}


def test_the_nominal_point_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        pushed_box().nominal[0] = 1.0
