"""The identifier: how it goes on after an interrupt, and the pool that rolls out for it."""

from dataclasses import replace

import numpy as np
import pytest
from runs import coarse_identifier, shipped_pushes

from physid_drake.belief import Belief
from physid_drake.diagnose import Examined
from physid_drake.identify import SearchConfig, theta_search
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.nuisance import nuisance_of
from physid_drake.pushes.task import Task
from physid_drake.report.result import result_json

FRICTION = ThetaConfig(parameters=["support_friction"])
SEARCH = SearchConfig(candidates=32, budget=6, entropy_tolerance_nats=0.0, jobs=1)


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(2)


def identifier(recording, **more):
    return coarse_identifier(recording, **({"theta": FRICTION, "search": SEARCH} | more))


# Interrupts.


class Trials:
    """Counts the trials of the search, and interrupts one of them."""

    def __init__(self, patch, stop_at=None):
        self.thetas = []
        misfits = theta_search.log_misfits

        def counted(predictor, pushes, nuisances, thetas):
            if len(self.thetas) + 1 == stop_at:
                raise KeyboardInterrupt
            self.thetas.append(thetas)
            return misfits(predictor, pushes, nuisances, thetas)

        patch.setattr(theta_search, "log_misfits", counted)


@pytest.fixture(scope="module")
def uninterrupted(recording):
    with pytest.MonkeyPatch.context() as patch:
        trials = Trials(patch)
        result = identifier(recording).run()
    return trials.thetas, result_json(Examined(known=result), recording, 0, {})


@pytest.mark.parametrize("stop_at", [2, 5])
def test_an_interrupted_search_goes_on_with_the_trials_that_it_would_have_made(
    recording, tmp_path, monkeypatch, uninterrupted, stop_at
):
    want, text = uninterrupted
    state = tmp_path / "belief.npz"
    with monkeypatch.context() as patch:
        first = Trials(patch, stop_at)
        with pytest.raises(KeyboardInterrupt):
            identifier(recording, state=state).run()
    assert Belief.from_npz(state).n_trials == stop_at - 1
    assert [path.name for path in tmp_path.iterdir()] == ["belief.npz"]
    with monkeypatch.context() as patch:
        second = Trials(patch)
        result = identifier(recording, state=state).run()
    np.testing.assert_array_equal(np.concatenate(first.thetas + second.thetas), np.concatenate(want))
    assert result_json(Examined(known=result), recording, 0, {}) == text


def test_an_interrupt_before_the_first_trial_leaves_nothing(recording, tmp_path, monkeypatch):
    Trials(monkeypatch, stop_at=1)
    with pytest.raises(KeyboardInterrupt):
        identifier(recording, state=tmp_path / "belief.npz").run()
    assert not list(tmp_path.iterdir())


def test_the_state_of_another_search_is_not_taken(recording, tmp_path, monkeypatch):
    state = tmp_path / "belief.npz"
    identifier(recording, state=state).run()
    trials = Trials(monkeypatch)
    identifier(recording, state=state, seed=1).run()
    assert len(trials.thetas) == 6


def test_a_finished_search_is_not_repeated(recording, tmp_path, monkeypatch):
    state = tmp_path / "belief.npz"
    before = identifier(recording, state=state).run().search
    trials = Trials(monkeypatch)
    after = identifier(recording, state=state).run().search
    assert trials.thetas == []
    np.testing.assert_array_equal(after.belief.p_min, before.belief.p_min)


# Rollouts.


def tasks_of(one, thetas):
    tasks = []
    for theta in thetas:
        for problem in one.case.problems:
            nuisance = nuisance_of(problem, 0.02)
            tasks.append(
                Task(
                    problem=problem, theta=np.array([theta]), nuisance=nuisance, values=np.zeros(len(nuisance.names))
                )
            )
    return tasks


def test_predictions_come_in_the_order_of_the_tasks_whatever_was_simulated_before(recording):
    one = identifier(recording)
    tasks = tasks_of(one, [0.2, 0.3, 0.4])
    forward = one.case.pool.run(tasks)
    backward = one.case.pool.run(tasks[::-1])[::-1]
    for a, b in zip(forward, backward, strict=True):
        np.testing.assert_array_equal(a.poses, b.poses)
    assert one.case.pool.count == 12
    assert one.case.pool.diverged == 0


def test_the_pool_says_how_far_it_is(recording):
    one, done = identifier(recording), []
    one.case.pool.run(tasks_of(one, [0.2, 0.3]), progress=done.append)
    assert sum(done) == 4


def test_more_friction_shortens_the_way(recording):
    one = identifier(recording)
    low, _, high, _ = one.case.pool.run(tasks_of(one, [0.15, 0.5]))
    way = [np.linalg.norm(p.poses[-1, :2] - p.poses[0, :2]) for p in (low, high)]
    assert way[0] > 1.1 * way[1]


def test_a_prediction_keeps_the_turn_in_which_the_yaw_was_recorded(recording):
    one = identifier(recording)
    task = tasks_of(one, [0.3])[0]
    start = task.problem.start
    turned = replace(start, pose=(start.pose[0], start.pose[1], start.pose[2] + 4.0 * np.pi))
    plain, more = one.case.pool.run([task, replace(task, problem=replace(task.problem, start=turned))])
    # Stick and slip magnify the rounding of a yaw that is 4 pi larger, to 8e-6 rad on some processors.
    np.testing.assert_allclose(more.poses - plain.poses, np.tile([0, 0, 4 * np.pi], (len(plain.poses), 1)), atol=1e-4)
