from dataclasses import replace

import numpy as np
import pytest

from physid_drake.belief import Belief, BeliefSettings
from physid_drake.cli import main
from physid_drake.errors import ParameterError
from physid_drake.search import (
    SEARCHES,
    GreedyEntropySearch,
    RandomSearch,
    initial_design,
    refine_candidates,
    search_minimum,
)
from physid_drake.space import Parameter, ParameterSpace

FAST = BeliefSettings(n_samples=200, n_restarts=0)


def unit_space(d: int) -> ParameterSpace:
    return ParameterSpace(
        parameters=tuple(Parameter(name=f"p{i}", unit="-", lower=0.0, upper=1.0, prior_mean=0.5) for i in range(d))
    )


def quadratic(target):
    return lambda thetas: np.sum((thetas - np.asarray(target)) ** 2, axis=1)


def candidates_in(d: int, n: int, seed: int = 0):
    return unit_space(d).sample(np.random.default_rng(seed), n, from_prior=False)


def run(objective, d=2, n=150, seed=0, **changes):
    settings = {"budget": 14, "settings": FAST, "entropy_tolerance": 0.0, **changes}
    search = settings.pop("search", GreedyEntropySearch())
    rng = np.random.default_rng(seed)
    return search_minimum(objective, unit_space(d), candidates_in(d, n), search, rng=rng, **settings)


def belief_with(p_min, tried=()):
    n = len(p_min)
    belief = Belief.start(unit_space(1), np.linspace(0.0, 1.0, n)[:, None], np.random.default_rng(0))
    mask = np.zeros(n, dtype=np.bool_)
    mask[list(tried)] = True
    return replace(belief, p_min=np.array(p_min, dtype=float), tried=mask)


def test_help_of_a_plan_lists_the_searches_of_the_registry(monkeypatch, capsys):
    monkeypatch.setitem(SEARCHES, "most_likely", RandomSearch)
    with pytest.raises(SystemExit):
        main(["plan", "--help"])
    shown = " ".join(capsys.readouterr().out.split())
    assert ", ".join(SEARCHES).replace("greedy_entropy", "greedy_entropy (default)") in shown


def test_greedy_pick_equals_the_hand_computation():
    # -p log p: 0.6 -> 0.306, 0.25 -> 0.347, 0.1 -> 0.230, 0.05 -> 0.150
    belief = belief_with([0.6, 0.05, 0.25, 0.1])
    picks = GreedyEntropySearch().propose(belief, np.random.default_rng(0), batch=4)
    np.testing.assert_array_equal(picks, [2, 0, 3, 1])


def test_greedy_pick_leaves_out_what_was_tried():
    belief = belief_with([0.6, 0.05, 0.25, 0.1], tried=[2, 3])
    picks = GreedyEntropySearch().propose(belief, np.random.default_rng(0), batch=4)
    np.testing.assert_array_equal(picks, [0, 1])


def test_greedy_prefers_the_favourite_below_one_over_e_and_runners_up_above():
    below = belief_with([0.36, 0.34, 0.30])
    above = belief_with([0.90, 0.05, 0.05])
    search, rng = GreedyEntropySearch(), np.random.default_rng(0)
    assert search.propose(below, rng)[0] == 0
    assert search.propose(above, rng)[0] != 0
    np.testing.assert_array_equal(above.most_likely, [0.0])


def test_where_no_sample_has_its_minimum_greedy_takes_the_likelier_candidate():
    space, candidates = unit_space(1), np.linspace(0.0, 1.0, 11)[:, None]
    belief = Belief.start(space, candidates, np.random.default_rng(0))
    belief = belief.update(candidates[[0, 5, 10]], [1.0, 0.0, 3.0], np.random.default_rng(1))
    belief = replace(belief, p_min=np.eye(11)[5])
    assert GreedyEntropySearch().propose(belief, np.random.default_rng(2))[0] == 4


def test_random_search_draws_by_prior_weight_and_never_twice():
    belief = replace(belief_with(np.full(4, 0.25), tried=[0]), log_weights=np.log([1.0, 1.0, 1.0, 8.0]))
    rng = np.random.default_rng(0)
    first = [RandomSearch().propose(belief, rng)[0] for _ in range(2000)]
    np.testing.assert_allclose(np.bincount(first, minlength=4) / 2000, [0.0, 0.1, 0.1, 0.8], atol=0.03)
    assert sorted(RandomSearch().propose(belief, rng, batch=9)) == [1, 2, 3]


def test_initial_design_starts_at_the_nominal_point_and_has_no_doubles():
    belief = Belief.start(unit_space(2), candidates_in(2, 100), np.random.default_rng(0))
    design = initial_design(belief, np.random.default_rng(1), 20)
    assert len(set(design)) == 20
    distances = np.linalg.norm(belief.candidates - 0.5, axis=1)
    assert design[0] == np.argmin(distances)


@pytest.mark.parametrize(("d", "n", "budget"), [(2, 200, 15), (6, 400, 30)])
def test_greedy_needs_fewer_trials_than_random_for_a_quadratic(d, n, budget):
    trials = []
    for seed in range(4):
        objective = quadratic(np.random.default_rng(seed).uniform(0.2, 0.8, d))
        good = np.sort(objective(candidates_in(d, n)))[2]
        hits = np.flatnonzero(run(objective, d, n, seed, budget=budget).belief.errors <= good)
        assert len(hits), "not one of the three best candidates was tried"
        trials.append(hits[0] + 1)
    # A random order meets the first of k good ones among n after (n + 1) / (k + 1) trials on average.
    assert np.mean(trials) < 0.5 * (n + 1) / 4


def test_the_same_seed_gives_the_same_trials_and_another_seed_others():
    results = [run(quadratic([0.3, 0.7]), seed=seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(results[0].belief.thetas, results[1].belief.thetas)
    np.testing.assert_array_equal(results[0].entropies, results[1].entropies)
    assert not np.array_equal(results[0].belief.thetas, results[2].belief.thetas)


def test_no_candidate_is_tried_twice_and_the_budget_is_kept():
    result = run(quadratic([0.3, 0.7]), budget=17, batch=4)
    assert result.stop_reason == "budget spent"
    assert len(np.unique(result.belief.thetas, axis=0)) == result.belief.n_trials == 17


def test_failed_trials_do_not_end_a_search_and_are_counted():
    def objective(thetas):
        errors = quadratic([0.3, 0.7])(thetas)
        return np.where(thetas[:, 0] > 0.6, np.inf, errors)

    result = run(objective, budget=25)
    assert result.stop_reason == "budget spent"
    assert result.n_failed == np.count_nonzero(result.belief.thetas[:, 0] > 0.6) > 0
    assert result.error_best < 0.01


def test_a_search_whose_every_trial_fails_still_returns():
    result = run(lambda thetas: np.full(len(thetas), np.nan), budget=8)
    assert (result.n_failed, result.error_best) == (8, np.inf)
    assert result.theta_best.shape == (2,)


def test_an_interrupt_passes_through_and_the_callback_has_had_the_trials_made():
    calls, beliefs = [], []

    def objective(thetas):
        calls.append(thetas)
        if len(calls) == 8:
            raise KeyboardInterrupt
        return quadratic([0.3, 0.7])(thetas)

    with pytest.raises(KeyboardInterrupt):
        run(objective, on_trial=beliefs.append)
    assert beliefs[-1].n_trials == 7
    np.testing.assert_array_equal(beliefs[-1].thetas, np.concatenate(calls[:7]))


@pytest.mark.parametrize("refine_every", [0, 5])
@pytest.mark.parametrize("cut", [2, 10])
def test_a_search_resumed_from_its_file_makes_the_trials_it_would_have_made(tmp_path, cut, refine_every):
    whole = run(quadratic([0.3, 0.7]), refine_every=refine_every)
    path = tmp_path / "belief.npz"

    def stop_after_cut(belief):
        if belief.n_trials == cut:
            belief.to_npz(path)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(quadratic([0.3, 0.7]), on_trial=stop_after_cut, refine_every=refine_every)
    rest = run(quadratic([0.3, 0.7]), resume_from=Belief.from_npz(path), refine_every=refine_every)
    np.testing.assert_array_equal(rest.belief.thetas, whole.belief.thetas)
    np.testing.assert_array_equal(rest.entropies, whole.entropies)


def test_a_search_stops_when_the_entropy_settles():
    result = run(quadratic([0.3, 0.7]), n=60, budget=60, entropy_tolerance=0.1, patience=4)
    assert result.stop_reason == "entropy settled"
    assert result.belief.n_trials < 40
    assert np.ptp(result.entropies[-5:]) < 0.1
    np.testing.assert_array_equal(
        result.theta_best, candidates_in(2, 60)[np.argmin(quadratic([0.3, 0.7])(candidates_in(2, 60)))]
    )


def test_an_entropy_the_samples_cannot_resolve_does_not_stop_a_search():
    few = BeliefSettings(n_samples=4, n_restarts=0)
    rough = np.random.default_rng(0)
    result = run(
        lambda t: rough.random(len(t)), d=6, n=500, budget=16, settings=few, entropy_tolerance=9.0, patience=1
    )
    assert result.belief.n_trials > 7
    settled = run(
        lambda t: rough.random(len(t)), d=6, n=20, budget=16, entropy_tolerance=9.0, patience=1, n_initial=5
    )
    assert (settled.stop_reason, settled.belief.n_trials) == ("entropy settled", 6)


def test_a_search_ends_when_every_candidate_was_tried():
    result = run(quadratic([0.3, 0.7]), n=9, budget=20)
    assert (result.stop_reason, result.belief.n_trials) == ("candidates exhausted", 9)


def test_a_search_without_time_makes_no_trial():
    result = run(quadratic([0.3, 0.7]), time_limit=0.0)
    assert (result.stop_reason, result.belief.n_trials) == ("time spent", 0)


def test_refined_candidates_keep_the_best_and_gather_where_p_min_is():
    belief = run(quadratic([0.3, 0.7]), budget=20).belief
    refined = refine_candidates(belief, np.random.default_rng(0), 300, keep=30)
    belief.space.check(refined)
    assert refined.shape == (300, 2)
    assert np.any(np.all(refined == belief.best[0], axis=1))
    near = [np.mean(np.linalg.norm(c - [0.3, 0.7], axis=1) < 0.1) for c in (refined, belief.candidates)]
    assert near[0] > 5.0 * near[1]


def test_refined_candidates_fill_the_gap_around_a_certain_candidate_and_reach_no_further():
    belief = belief_with(np.eye(11)[4])
    refined = refine_candidates(belief, np.random.default_rng(0), 500, keep=1)
    distances = np.abs(refined[1:400, 0] - 0.4)
    assert 0.08 < np.quantile(distances, 0.99) < 0.3
    assert np.median(distances) < 0.03


def test_refining_finds_a_lower_error_than_any_candidate():
    objective = quadratic([0.3, 0.7])
    result = run(objective, n=60, budget=25, refine_every=5)
    assert result.error_best < 0.2 * objective(candidates_in(2, 60)).min()


@pytest.mark.parametrize("wrong", [{"budget": 0}, {"batch": 0}, {"patience": 0}, {"entropy_tolerance": -1.0}])
def test_a_number_that_makes_no_sense_is_refused(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        run(quadratic([0.3, 0.7]), **wrong)


def test_an_objective_of_wrong_shape_is_refused():
    with pytest.raises(ParameterError, match="one error per theta"):
        run(lambda thetas: np.zeros((len(thetas), 2)))
