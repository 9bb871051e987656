import json

import numpy as np
import pytest
from scipy.stats import norm

from physid_drake.belief import (
    Belief,
    BeliefSettings,
    GaussianProcess,
    Hyperparameters,
    entropy,
    estimate_p_min,
)
from physid_drake.belief.gaussian_process import fit, matern32
from physid_drake.belief.p_min import weigh_p_min
from physid_drake.errors import ParameterError
from physid_drake.space import Parameter, ParameterSpace


def unit_space(d: int) -> ParameterSpace:
    return ParameterSpace(
        parameters=tuple(Parameter(name=f"p{i}", unit="-", lower=0.0, upper=1.0, prior_mean=0.5) for i in range(d))
    )


def process_with_trials(d: int = 2, m: int = 6, noise: float = 1e-6) -> GaussianProcess:
    rng = np.random.default_rng(5)
    u = rng.random((m, d))
    hyper = Hyperparameters(amplitude=1.5, lengths=np.full(d, 0.4), noise=noise)
    return GaussianProcess(u=u, targets=10.0 + 3.0 * np.sin(5.0 * u.sum(axis=1)), hyperparameters=hyper)


def test_p_min_of_two_candidates_is_the_closed_form_of_their_difference():
    process = process_with_trials()
    u = np.array([[0.2, 0.3], [0.6, 0.7]])
    mean, _ = process.predict(u)
    c = process.covariance(u, u)
    expected = norm.cdf((mean[1] - mean[0]) / np.sqrt(c[0, 0] + c[1, 1] - 2.0 * c[0, 1]))
    assert 0.05 < expected < 0.95
    samples = process.sample_exact(u, 40_000, np.random.default_rng(0))
    assert estimate_p_min(samples)[0] == pytest.approx(expected, abs=0.01)


def test_p_min_of_independent_equal_candidates_is_uniform():
    samples = np.random.default_rng(1).standard_normal((50_000, 5))
    np.testing.assert_allclose(estimate_p_min(samples), 0.2, atol=0.01)


def test_p_min_counts_where_each_sample_is_lowest():
    samples = np.array([[1.0, 0.0, 2.0], [3.0, 1.0, 2.0], [0.0, 1.0, 2.0], [5.0, -1.0, 2.0]])
    np.testing.assert_array_equal(estimate_p_min(samples), [0.25, 0.75, 0.0])


def test_entropy_is_zero_when_certain_log_n_when_equal_and_between_otherwise():
    assert entropy(np.array([0.0, 1.0, 0.0])) == 0.0
    assert entropy(np.full(7, 1 / 7)) == pytest.approx(np.log(7))
    p = np.random.default_rng(2).dirichlet(np.ones(7))
    assert 0.0 < entropy(p) < np.log(7)


def test_kernel_is_the_matern_of_the_textbook_with_one_length_per_dimension():
    hyper = Hyperparameters(amplitude=2.0, lengths=np.array([0.5, 2.0]), noise=0.0)
    r = np.sqrt(3.0) * np.hypot(0.3 / 0.5, 0.8 / 2.0)
    value = matern32(np.array([[0.1, 0.1]]), np.array([[0.4, 0.9]]), hyper)
    assert value[0, 0] == pytest.approx(2.0 * (1.0 + r) * np.exp(-r))


def test_gaussian_process_interpolates_its_trials_and_is_unsure_far_away():
    process = process_with_trials(noise=1e-9)
    mean, std = process.predict(process.u)
    np.testing.assert_allclose(mean, process.targets, atol=1e-4)
    assert std.max() < 1e-3
    far = GaussianProcess(u=process.u, targets=process.targets, hyperparameters=process.hyperparameters)
    assert far.predict(np.array([[30.0, 30.0]]))[1][0] == pytest.approx(np.sqrt(1.5) * process.scale)


def test_fit_finds_which_parameter_does_not_matter():
    rng = np.random.default_rng(3)
    u = rng.random((40, 2))
    lengths = fit(u, (u[:, 0] - 0.3) ** 2, rng).hyperparameters.lengths
    assert lengths[1] > 3.0 * lengths[0]


def test_fit_predicts_points_it_has_not_seen():
    rng = np.random.default_rng(4)
    u = rng.random((60, 2))
    f = np.sum((u - 0.4) ** 2, axis=1)
    mean, _ = fit(u[:40], f[:40], rng).predict(u[40:])
    assert np.sqrt(np.mean((mean - f[40:]) ** 2)) < 0.1 * f.std()


@pytest.mark.parametrize("way", ["exact", "pathwise"])
def test_samples_have_the_mean_and_covariance_of_the_posterior(way):
    process = process_with_trials()
    u = np.random.default_rng(6).random((8, 2))
    rng = np.random.default_rng(7)
    if way == "exact":
        samples = process.sample_exact(u, 20_000, rng)
    else:  # the features are drawn afresh in every call, so their error averages out
        samples = np.concatenate([process.sample_pathwise(u, 400, rng) for _ in range(50)])
    mean, std = process.predict(u)
    covariance = process.covariance(u, u)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), std, rtol=1e-6)
    np.testing.assert_allclose(samples.mean(axis=0), mean, atol=0.04 * std.max())
    np.testing.assert_allclose(np.cov(samples.T), covariance, atol=0.04 * covariance.max())


def test_pathwise_samples_pass_through_the_trials():
    process = process_with_trials()
    samples = process.sample_pathwise(process.u, 50, np.random.default_rng(8))
    np.testing.assert_allclose(samples, np.tile(process.targets, (50, 1)), atol=0.02 * process.scale)


def test_pathwise_and_exact_samples_give_the_same_p_min():
    process = process_with_trials()
    u = np.random.default_rng(9).random((12, 2))
    exact = estimate_p_min(process.sample_exact(u, 20_000, np.random.default_rng(0)))
    rng = np.random.default_rng(1)
    pathwise = np.mean([estimate_p_min(process.sample_pathwise(u, 400, rng)) for _ in range(50)], axis=0)
    np.testing.assert_allclose(pathwise, exact, atol=0.02)


def test_probability_below_the_best_is_the_closed_form_of_their_difference():
    process = process_with_trials()
    u = np.random.default_rng(20).random((5, 2))
    mean, _ = process.predict(u)
    c, best = process.covariance(u, u), int(np.argmin(mean))
    variance = np.diag(c) + c[best, best] - 2.0 * c[best]
    below = process.probability_below_best(u)
    others = np.arange(5) != best
    np.testing.assert_allclose(below[others], norm.cdf((mean[best] - mean) / np.sqrt(variance + 1e-12))[others])
    assert below[best] == 0.5


def test_points_left_out_as_impossible_minima_are_never_the_minimum():
    process = process_with_trials(m=30)
    u = np.random.default_rng(10).random((300, 2))
    possible = process.possible_minima(u, 1e-4)
    p = estimate_p_min(process.sample_exact(u, 5000, np.random.default_rng(2)))
    assert len(possible) < 200
    assert np.delete(p, possible).sum() < 1e-3


def test_targets_that_are_all_equal_do_not_divide_by_zero():
    u = np.random.default_rng(11).random((6, 2))
    mean, std = fit(u, np.full(6, 3.0), np.random.default_rng(0)).predict(np.array([[0.5, 0.5]]))
    assert mean[0] == pytest.approx(3.0)
    assert np.isfinite(std[0])


def test_equal_prior_weights_are_exactly_the_paper():
    candidates = unit_space(2).sample(np.random.default_rng(12), 40, from_prior=False)
    beliefs = [
        Belief.start(unit_space(2), candidates, np.random.default_rng(0), prior_weights=weights)
        for weights in (None, np.full(40, 7.0))
    ]
    np.testing.assert_array_equal(beliefs[0].p_min, beliefs[1].p_min)
    assert beliefs[1].prior_power == 1.0


def test_prior_weights_multiply_p_min():
    weighted, power = weigh_p_min(np.array([0.5, 0.3, 0.2, 0.0]), np.log([1.0, 2.0, 1.0, 50.0]))
    np.testing.assert_allclose(weighted, np.array([0.5, 0.6, 0.2, 0.0]) / 1.3)
    assert power == 1.0


def test_a_prior_too_narrow_for_the_samples_is_tempered_to_a_tenth_of_them():
    p = np.full(100, 0.01)
    weighted, power = weigh_p_min(p, -0.5 * np.arange(100.0))
    assert 0.0 < power < 1.0
    assert 1.0 / np.sum(weighted**2) == pytest.approx(10.0, rel=1e-3)


def test_p_min_as_the_next_prior_is_positive_and_sums_to_one():
    candidates = unit_space(2).sample(np.random.default_rng(13), 64, from_prior=False)
    belief = Belief.start(unit_space(2), candidates, np.random.default_rng(0))
    belief = belief.update(candidates[:8], np.sum(candidates[:8], axis=1), np.random.default_rng(1))
    prior = belief.as_prior()
    assert np.all(prior > 0.0)
    assert prior.sum() == pytest.approx(1.0)
    again = Belief.start(unit_space(2), candidates, np.random.default_rng(0), prior_weights=prior)
    assert np.argmax(again.p_min) == np.argmax(prior)


def test_a_belief_with_no_prior_weight_for_a_candidate_is_refused():
    with pytest.raises(ParameterError, match="positive"):
        Belief.start(unit_space(1), [[0.1], [0.9]], np.random.default_rng(0), prior_weights=[1.0, 0.0])


def test_update_returns_a_new_belief_and_leaves_the_old_one():
    candidates = unit_space(2).sample(np.random.default_rng(14), 32, from_prior=False)
    old = Belief.start(unit_space(2), candidates, np.random.default_rng(0))
    new = old.update(candidates[3], 1.0, np.random.default_rng(1))
    assert (old.n_trials, new.n_trials) == (0, 1)
    assert not old.tried.any()
    np.testing.assert_array_equal(np.flatnonzero(new.tried), [3])
    assert new.p_min.sum() == pytest.approx(1.0)


def test_many_low_trials_around_the_minimum_make_p_min_point_at_it():
    candidates = unit_space(2).sample(np.random.default_rng(15), 200, from_prior=False)
    f = np.sum((candidates - [0.3, 0.6]) ** 2, axis=1)
    belief = Belief.start(unit_space(2), candidates, np.random.default_rng(0))
    before = belief.entropy
    belief = belief.update(candidates[:60], f[:60], np.random.default_rng(1))
    assert belief.entropy < 0.5 * before
    assert np.linalg.norm(belief.most_likely - [0.3, 0.6]) < 0.1


@pytest.mark.parametrize("failure", [np.inf, np.nan, -np.inf])
def test_a_failed_trial_is_kept_counted_and_seen_as_the_worst(failure):
    candidates = unit_space(1).sample(np.random.default_rng(16), 16, from_prior=False)
    belief = Belief.start(unit_space(1), candidates, np.random.default_rng(0))
    belief = belief.update(candidates[:4], [2.0, failure, 5.0, 1.0], np.random.default_rng(1))
    assert (belief.n_trials, belief.n_failed) == (4, 1)
    assert belief.errors[1] == np.inf
    np.testing.assert_array_equal(belief.gaussian_process.targets, [2.0, 5.0, 5.0, 1.0])
    assert belief.best[1] == 1.0


def test_hyperparameters_are_fitted_again_only_when_the_trials_grew():
    candidates = unit_space(1).sample(np.random.default_rng(17), 64, from_prior=False)
    settings = BeliefSettings(refit_growth=1.5, n_restarts=0)
    belief = Belief.start(unit_space(1), candidates, np.random.default_rng(0), settings=settings)
    fits = []
    for theta in candidates[:14]:
        belief = belief.update(theta, float(np.sin(6 * theta[0])), np.random.default_rng(1))
        fits.append(belief.gaussian_process.n_at_fit)
    assert fits == [0, 0, 0, 4, 4, 6, 6, 6, 9, 9, 9, 9, 9, 14]


def test_an_entropy_that_the_samples_cannot_resolve_is_said_to_be_so():
    candidates = unit_space(6).sample(np.random.default_rng(18), 4000, from_prior=False)
    belief = Belief.start(unit_space(6), candidates, np.random.default_rng(0))
    assert not belief.resolved
    assert belief.entropy <= np.log(belief.settings.n_samples)
    assert Belief.start(unit_space(6), candidates[:50], np.random.default_rng(0)).resolved


def test_npz_round_trip_gives_the_same_belief_and_the_same_future(tmp_path):
    space = ParameterSpace(
        parameters=(
            Parameter(name="mass", unit="kg", lower=0.1, upper=2.0, prior_mean=0.5, scale="log"),
            Parameter(name="friction", unit="-", lower=0.1, upper=1.0, prior_mean=0.3, prior_std=0.1),
        )
    )
    candidates = space.sample(np.random.default_rng(19), 50, from_prior=False)
    weights = np.linspace(1.0, 2.0, 50)
    old = Belief.start(space, candidates, np.random.default_rng(0), prior_weights=weights)
    old = old.update(candidates[:7], [*np.sum(candidates[:6], axis=1), np.inf], np.random.default_rng(1))
    old.to_npz(tmp_path / "belief.npz")
    new = Belief.from_npz(tmp_path / "belief.npz")
    assert (new.space, new.settings, new.n_failed) == (old.space, old.settings, 1)
    for name in ("candidates", "log_weights", "tried", "thetas", "errors", "p_min", "entropies"):
        np.testing.assert_array_equal(getattr(new, name), getattr(old, name))
    futures = [b.update(candidates[9], 0.2, np.random.default_rng(2)) for b in (old, new)]
    np.testing.assert_array_equal(futures[0].p_min, futures[1].p_min)


def test_a_file_that_is_not_a_belief_is_refused(tmp_path):
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    np.save(tmp_path / "array.npz", np.zeros(3))
    with pytest.raises(ParameterError, match="cannot be read"):
        Belief.from_npz(tmp_path / "array.npz.npy")
    with pytest.raises(ParameterError, match="physid-belief/1"):
        Belief.from_npz(tmp_path / "other.npz")
    np.savez(tmp_path / "half.npz", header=np.array('{"format": "physid-belief/1"}'))
    np.savez(tmp_path / "torn.npz", header=np.array('{"format": "physid-be'))
    for name in ("half", "torn"):
        with pytest.raises(ParameterError, match=r"cannot be read.* delete it"):
            Belief.from_npz(tmp_path / f"{name}.npz")


def saved(tmp_path):
    """The arrays and the header of a belief with three trials."""
    space = unit_space(2)
    candidates = space.sample(np.random.default_rng(3), 20, from_prior=False)
    belief = Belief.start(space, candidates, np.random.default_rng(0))
    belief.update(candidates[:3], [1.0, 2.0, 3.0], np.random.default_rng(1)).to_npz(tmp_path / "belief.npz")
    with np.load(tmp_path / "belief.npz") as file:
        arrays = dict(file)
    return arrays, json.loads(str(arrays.pop("header")))


def loading(tmp_path, arrays, header):
    text = header if isinstance(header, str) else json.dumps(header)
    np.savez(tmp_path / "other.npz", header=np.array(text), **arrays)
    return Belief.from_npz(tmp_path / "other.npz")


def refusal(tmp_path, arrays, header):
    with pytest.raises(ParameterError, match=r"other\.npz") as caught:
        loading(tmp_path, arrays, header)
    message = str(caught.value)
    assert message.isprintable() and len(message) < 600 + len(str(tmp_path))


WRONG = {
    "null": None, "list": [], "number": 3, "text": "x" * 70_000, "truth": True, "nan": float("nan"), "many": 10**30,
    "lists": [[1.0]], "mapping": {"a": 1}, "negative": -1,
}  # fmt: skip


@pytest.mark.parametrize("value", WRONG.values(), ids=WRONG)
def test_a_header_with_anything_in_the_place_of_a_value_is_one_line(tmp_path, value):
    arrays, header = saved(tmp_path)
    assert loading(tmp_path, arrays, header).n_trials == 3
    refusal(tmp_path, arrays, value)
    for key in ("format", "parameters", "settings", "n_at_fit"):
        if not (key == "n_at_fit" and value == 3):
            refusal(tmp_path, arrays, {**header, key: value})
            refusal(tmp_path, arrays, {k: v for k, v in header.items() if k != key})
    for key in ("n_samples", "n_restarts"):
        if value != 3:
            refusal(tmp_path, arrays, {**header, "settings": {**header["settings"], key: value}})
    if value is not True and value != 3:
        refusal(tmp_path, arrays, {**header, "parameters": [{**header["parameters"][0], "lower": value}] * 2})


@pytest.mark.parametrize(
    "header", ["", "{", "[" * 100_000, "1" * 70_000, "null", '{"format": "physid-belief/1"}', "\ud800"]
)
def test_a_header_that_is_no_json_of_a_belief_is_one_line(tmp_path, header):
    refusal(tmp_path, saved(tmp_path)[0], header)


@pytest.mark.parametrize(
    "name", ["candidates", "log_weights", "tried", "thetas", "errors", "p_min", "lengths", "variances"]
)
def test_an_array_that_does_not_fit_the_others_is_one_line(tmp_path, name):
    arrays, header = saved(tmp_path)
    array = arrays[name]
    refusal(tmp_path, {k: v for k, v in arrays.items() if k != name}, header)
    for other in (array[:-1], array[None], array.astype(str), np.zeros(()), np.zeros((0, 3)), np.array("x")):
        if name != "tried" or other.dtype.kind != "U":
            refusal(tmp_path, {**arrays, name: other}, header)
    if name not in ("errors", "tried"):
        refusal(tmp_path, {**arrays, name: np.full(array.shape, np.nan)}, header)
    if name in ("lengths", "variances"):
        for value in (0.0, -1.0, 1e-320, 1e300):
            refusal(tmp_path, {**arrays, name: np.full(array.shape, value)}, header)
