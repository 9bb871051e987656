"""What a rollout says of a recorded push."""

from types import SimpleNamespace

import numpy as np
import pytest

from physid_drake.cell import Outcome, Start
from physid_drake.errors import WorkerError
from physid_drake.pushes import rollouts

TURN = 2.0 * np.pi


@pytest.mark.parametrize(
    ("yaws", "recorded", "want"),
    [
        ([3.5], [3.5 - TURN], [3.5 - TURN]),  # an end point: by how many turns nobody saw
        ([-9.0], [-9.0 + 2 * TURN], [-9.0 + 2 * TURN]),
        ([0.0, 3.5], [0.0, 3.5 - TURN], [0.0, 3.5]),  # on its way it was seen: this is another motion
    ],
)
def test_an_end_point_is_compared_with_the_nearest_turn(monkeypatch, yaws, recorded, want):
    monkeypatch.setattr(rollouts, "simulate", lambda *_: SimpleNamespace(outcome=Outcome.COMPLETED))

    def tracked(motion, times, effects):
        return np.column_stack([np.zeros((len(times), 2)), yaws if times[0] > 0.0 else [0.0]])

    monkeypatch.setattr(rollouts, "tracked", tracked)
    problem = SimpleNamespace(
        times=1.0 + np.arange(len(yaws)), begin=0.0, start=Start(pose=(0.0, 0.0, 0.0)), force_times=np.zeros(0),
        poses=np.column_stack([np.zeros((len(yaws), 2)), recorded]),
    )  # fmt: skip
    task = SimpleNamespace(problem=problem, effects=())
    assert rollouts.predict(None, None, task).poses[:, 2] == pytest.approx(want)


@pytest.fixture
def falling(monkeypatch):
    """Processes of which one is ended after a number of pieces, each time that work is given to them."""
    lasts = []

    class Falling:
        def __init__(self, **words):
            self.left = lasts.pop(0)

        def __call__(self, calls):
            for _, (_, _, piece), _ in calls:
                if self.left == 0:
                    raise rollouts.TerminatedWorkerError("killed")
                self.left -= 1
                yield piece

    monkeypatch.setattr(rollouts, "Parallel", Falling)
    return lasts


def test_a_process_that_the_system_ends_is_replaced_and_nothing_is_lost_or_made_twice(falling):
    pool = rollouts.RolloutPool(None, None, jobs=2)
    falling += [1, 2, 9]
    assert list(pool._in_processes([["a"], ["b"], ["c"], ["d"]])) == [["a"], ["b"], ["c"], ["d"]]
    falling += [1, 0]
    with pytest.raises(WorkerError, match="want of memory"):
        list(pool._in_processes([["a"], ["b"]]))
