"""PoWER on problems whose optimum is known."""

import numpy as np
import pytest

from physid_drake.errors import ParameterError
from physid_drake.search import search_by_power
from physid_drake.space import Parameter, ParameterSpace

SPACE = ParameterSpace(
    parameters=tuple(
        Parameter(name=name, unit="m", lower=-1.0, upper=3.0, prior_mean=1.0) for name in ("x", "y")
    )
)  # fmt: skip
OPTIMUM = np.array([0.2, 1.7])


def distance(thetas):
    return np.linalg.norm(thetas - OPTIMUM, axis=1)


def run(seed=0, objective=distance, **changes):
    return search_by_power(objective, SPACE, rng=np.random.default_rng(seed), **changes)


def test_it_comes_near_a_known_optimum():
    ends = [np.linalg.norm(run(seed, updates=40).means[-1] - OPTIMUM) for seed in range(10)]
    start = np.linalg.norm(SPACE.nominal - OPTIMUM)
    assert np.median(ends) < 0.15 * start
    assert max(ends) < 0.5 * start


def test_the_paper_s_ten_updates_of_five_rollouts_get_half_the_way():
    results = [run(seed) for seed in range(20)]
    assert all(len(r.errors) == 50 and r.means.shape == (11, 2) for r in results)
    start = np.linalg.norm(SPACE.nominal - OPTIMUM)
    assert np.median([np.linalg.norm(r.means[-1] - OPTIMUM) for r in results]) < 0.5 * start


def test_one_update_is_the_average_weighted_by_reward():
    result = run(updates=1, sharpness=2.0)
    rewards = np.exp(-2.0 * result.errors)
    assert result.means[1] == pytest.approx(rewards @ result.thetas / rewards.sum())


def test_a_sharper_reward_follows_the_best_trial_more():
    result = run(updates=1, sharpness=500.0)
    assert result.means[1] == pytest.approx(result.thetas[np.argmin(result.errors)], abs=1e-3)


def test_failed_rollouts_have_no_say():
    def half_failing(thetas):
        return np.where(thetas[:, 0] > SPACE.nominal[0], np.inf, distance(thetas))

    result = run(objective=half_failing)
    assert np.isinf(result.errors).any()
    assert np.all(np.isfinite(result.means))
    assert result.means[-1][0] < SPACE.nominal[0]


def test_where_everything_fails_the_settings_stay():
    result = run(objective=lambda thetas: np.full(len(thetas), np.inf))
    assert np.all(result.means == SPACE.nominal)


def test_trials_stay_inside_the_bounds_and_the_seed_decides():
    result = run(exploration=5.0)
    SPACE.check(result.thetas)
    assert np.array_equal(result.thetas, run(exploration=5.0).thetas)
    assert not np.array_equal(result.thetas, run(1, exploration=5.0).thetas)


@pytest.mark.parametrize(
    "changes", [{"rollouts": 0}, {"updates": 0}, {"reused": 0}, {"sharpness": 0.0}, {"exploration": -1.0}]
)
def test_numbers_out_of_range_are_refused(changes):
    with pytest.raises(ParameterError, match="search_by_power"):
        run(**changes)
