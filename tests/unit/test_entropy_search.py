"""Entropy search against closed forms, and what greedy entropy search does once a favourite has passed 1/e."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ndtr

from physid_drake.belief import Belief, BeliefSettings, GaussianProcess, Hyperparameters, entropy
from physid_drake.errors import ConfigError, ParameterError
from physid_drake.search import EntropySearch, GreedyEntropySearch, RandomSearch, search_minimum, search_named
from physid_drake.space import Parameter, ParameterSpace

FINE = EntropySearch(n_samples=6000, n_outcomes=24)
FAST = BeliefSettings(n_samples=200, n_restarts=0)


def space(d=1):
    return ParameterSpace(
        parameters=tuple(Parameter(name=f"p{i}", unit="-", lower=0.0, upper=1.0, prior_mean=0.5) for i in range(d))
    )


def belief_over(candidates, *, trials=(), targets=(), length=0.05, noise=1e-6, settings=None):
    """A belief with stated hyperparameters."""
    candidates = np.atleast_2d(np.asarray(candidates, dtype=float)).T
    belief = Belief.start(space(), candidates, np.random.default_rng(0), settings=settings)
    hyper = Hyperparameters(amplitude=1.0, lengths=np.array([length]), noise=noise)
    points = np.reshape(np.asarray(trials, dtype=float), (-1, 1))
    process = GaussianProcess(u=points, targets=np.asarray(targets, dtype=float), hyperparameters=hyper)
    told = replace(belief, gaussian_process=process, tried=np.isin(candidates[:, 0], trials))
    return told._with_p_min(np.random.default_rng(1))


def coin_entropy(p):
    return -p * np.log(p) - (1.0 - p) * np.log1p(-p)


def test_one_of_two_equal_unknowns_is_expected_to_leave_half_a_nat():
    # P(B < A) is uniform once A is known, and the entropy of a coin of uniform bias is 1/2 on average.
    belief = belief_over([0.0, 1.0])
    expected = FINE.expected_entropies(belief, np.array([0, 1]), np.random.default_rng(2))
    assert entropy(belief.p_min) == pytest.approx(np.log(2.0), abs=0.01)
    np.testing.assert_allclose(expected, 0.5, atol=0.015)


def test_a_trial_under_noise_tells_less():
    # With noise of the function's own variance A is known to half of it: P(B < A) = Phi(x), x of variance 1/3.
    belief = belief_over([0.0, 1.0], noise=1.0)
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    chances = np.clip(ndtr(nodes / np.sqrt(3.0)), 1e-12, 1.0 - 1e-12)
    wanted = float(weights @ coin_entropy(chances) / weights.sum())
    expected = FINE.expected_entropies(belief, np.array([0, 1]), np.random.default_rng(3))
    assert wanted > 0.59
    np.testing.assert_allclose(expected, wanted, atol=0.015)


def test_a_point_that_is_known_already_tells_nothing():
    belief = belief_over(np.linspace(0.0, 1.0, 21), trials=[0.0, 0.5, 1.0], targets=[1.0, -1.0, 0.5], length=0.3)
    before = FINE.expected_entropies(belief, np.array([10]), np.random.default_rng(4))[0]
    others = FINE.expected_entropies(belief, np.array([7, 8, 12, 13]), np.random.default_rng(4))
    assert before == pytest.approx(belief.entropy, abs=0.12)
    assert np.all(others < before)


def test_a_trial_is_not_expected_to_add_entropy():
    rng = np.random.default_rng(5)
    candidates = space(2).sample(rng, 120, from_prior=False)
    belief = Belief.start(space(2), candidates, rng, settings=FAST)
    belief = belief.update(candidates[:8], np.sum((candidates[:8] - 0.4) ** 2, axis=1), rng)
    chooser = EntropySearch(n_samples=2000)
    expected = chooser.expected_entropies(belief, np.arange(8, 60), rng)
    known = chooser.expected_entropies(belief, np.array([0]), rng)[0]
    assert np.all(expected < known + 0.15)
    assert expected.min() < known - 0.15  # 0.23


def test_the_prior_weights_count_in_what_is_expected():
    # The coin of uniform bias q, its sides weighted 1 and 0.11.
    belief = belief_over([0.0, 1.0])
    weighted = replace(belief, log_weights=np.log([1.0, 0.11]))
    bias = (np.arange(10_000) + 0.5) / 10_000
    wanted = np.mean(coin_entropy(bias / (bias + 0.11 * (1.0 - bias))))
    expected = FINE.expected_entropies(weighted, np.array([0, 1]), np.random.default_rng(7))
    np.testing.assert_allclose(expected, wanted, atol=0.015)


def test_proposals_are_untried_and_distinct():
    rng = np.random.default_rng(8)
    candidates = space(2).sample(rng, 60, from_prior=False)
    belief = Belief.start(space(2), candidates, rng, settings=FAST)
    belief = belief.update(candidates[:10], np.sum((candidates[:10] - 0.4) ** 2, axis=1), rng)
    picks = EntropySearch(shortlist=8).propose(belief, rng, batch=7)
    assert len(set(picks.tolist())) == 7
    assert not np.any(belief.tried[picks])
    everything = replace(belief, tried=np.ones(60, dtype=bool))
    assert len(EntropySearch().propose(everything, rng)) == 0


def log_bowl(d, seed):
    middle = np.random.default_rng([100, seed]).uniform(0.2, 0.8, d)
    return lambda u: 0.5 * np.log(1e-4 + ((u - middle) ** 2).sum(1))


class Watched:
    """Counts the trials before which an untried favourite above 1/e was passed over, and those with it tried."""

    def __init__(self, search):
        self.search, self.passed, self.with_it_tried = search, 0, 0

    def propose(self, belief, rng, batch=1):
        picks = self.search.propose(belief, rng, batch)
        favourite = np.argmax(belief.p_min)
        if belief.p_min[favourite] > 1.0 / np.e:
            self.with_it_tried += bool(belief.tried[favourite])
            self.passed += bool(not belief.tried[favourite] and picks[0] != favourite)
        return picks


def searched(search, seed, d=3, budget=24):
    candidates = space(d).sample(np.random.default_rng([50, seed]), 200, from_prior=False)
    objective = log_bowl(d, seed)
    result = search_minimum(
        objective, space(d), candidates, search, budget=budget, rng=np.random.default_rng(seed),
        entropy_tolerance=0.0, settings=FAST,
    )  # fmt: skip
    hits = np.flatnonzero(result.belief.errors <= objective(candidates).min())
    return hits[0] + 1 if len(hits) else budget + 1


def test_greedy_does_not_waste_rollouts_on_runners_up_of_an_untried_favourite():
    """A favourite is tried on its way past 1/e: to be passed over it must leap there within one trial."""
    watched = [Watched(GreedyEntropySearch()) for _ in range(6)]
    for seed, search in enumerate(watched):
        searched(search, seed)
    assert sum(w.with_it_tried for w in watched) > 20  # so there were favourites
    assert sum(w.passed for w in watched) <= 1


def test_both_entropy_searches_find_the_best_candidate_long_before_random_search():
    hits = {
        type(search).__name__: np.mean([searched(search, seed) for seed in range(3)])
        for search in (GreedyEntropySearch(), EntropySearch(shortlist=12, n_samples=150), RandomSearch())
    }
    assert hits["GreedyEntropySearch"] < 0.75 * hits["RandomSearch"]
    assert hits["EntropySearch"] < 0.75 * hits["RandomSearch"]


def test_searches_have_names():
    assert isinstance(search_named("entropy_search"), EntropySearch)
    assert isinstance(search_named("greedy_entropy"), GreedyEntropySearch)
    with pytest.raises(ConfigError, match="known are greedy_entropy, entropy_search, random"):
        search_named("annealing")


def test_numbers_that_make_no_sense_are_refused():
    with pytest.raises(ParameterError, match="at least 2"):
        EntropySearch(shortlist=1)


def test_more_candidates_than_the_limit_leave_out_the_unlikely_ones():
    rng = np.random.default_rng(9)
    candidates = space(2).sample(rng, 800, from_prior=False)
    tried, errors = candidates[:12], np.sum((candidates[:12] - 0.4) ** 2, axis=1)
    few, all_ = (
        Belief.start(space(2), candidates, np.random.default_rng(1),
                     settings=BeliefSettings(n_samples=4000, n_restarts=0, sample_limit=limit))
        .update(tried, errors, np.random.default_rng(2))
        for limit in (200, 800)
    )  # fmt: skip
    assert np.count_nonzero(few.p_min) <= 200
    # Half the total variation between the two: the share of functions whose minimum is another.
    assert 0.5 * np.abs(few.p_min - all_.p_min).sum() < 0.25
    assert few.entropy < all_.entropy + 0.05


@pytest.mark.parametrize(
    ("proposed", "said"),
    [
        ([0.5], "must return at most 1 indices"), ([400], "must return at most 1"), ([3, 4], "must return at most 1"),
        (None, "distinct candidates that were not tried"),
    ],
)  # fmt: skip
def test_a_search_that_does_not_keep_to_the_protocol_is_refused(proposed, said):
    class Own:
        def propose(self, belief, rng, batch=1):
            return np.array(np.flatnonzero(belief.tried)[:1] if proposed is None else proposed)

    candidates = np.linspace(0.0, 1.0, 20)[:, None]
    with pytest.raises(ParameterError, match=said):
        search_minimum(
            lambda thetas: thetas[:, 0], space(), candidates, Own(), budget=12, rng=np.random.default_rng(0)
        )
