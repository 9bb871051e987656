"""The push that teaches most, against random ones: as expected, and as learned on the planar integrator."""

import numpy as np
import pytest
from reference.planar import HandPath
from reference.scenes import OBJECTS, PlanarPush, Theta
from runs import COARSE
from worlds import recorded

from physid_drake.cell.solid import solid_of
from physid_drake.errors import ConfigError
from physid_drake.identify import OnlineIdentifier, SearchConfig
from physid_drake.identify.baseline import baseline_hypothesis
from physid_drake.plan import most_informative_push, teaching
from physid_drake.policies import PlannedPush
from physid_drake.pushes.config import ThetaConfig

pytestmark = pytest.mark.slow

BOX = OBJECTS["box"]
TRUTH = Theta(support_friction=0.27, hand_friction=0.22)
RADIUS = 0.010
START = (0.0, 0.0, 0.0)


def drawn(count, seed):
    rng = np.random.default_rng(seed)
    return [
        PlannedPush(
            direction=float(rng.uniform(-np.pi, np.pi)), speed=float(rng.uniform(0.05, 0.5)),
            travel=float(rng.uniform(0.03, 0.1)), contact_offset=float(rng.uniform(-0.02, 0.02)),
        )
        for _ in range(count)
    ]  # fmt: skip


def made(push):
    """The push in the planar integrator's world."""
    path = push.path(START, solid_of(recording_shape()).outline, RADIUS)
    reference = HandPath(times=path.times, p0=path.start, velocities=path.velocities)
    planar = PlanarPush(pose=START, path=reference, tip_radius=RADIUS, tip_height=0.5 * BOX.height)
    return recorded(BOX, TRUTH, [planar], seed=5)


def recording_shape():
    from twin import shape_of

    return shape_of(BOX)


@pytest.fixture(scope="module")
def taught():
    pushes = drawn(7, seed=2)
    recording = made(pushes[0])
    one = OnlineIdentifier(
        recording, cell=COARSE, theta=ThetaConfig(parameters=["hand_friction", "support_friction"]),
        search=SearchConfig(jobs=1), seed=0, budget=4,
    )  # fmt: skip
    case = one.case(recording.pushes)
    lesson = most_informative_push(pushes, case=case, start=START, thetas=np.array([0.22, 0.27]))
    return one, case, pushes, lesson


def test_the_gain_is_half_the_rise_of_the_log_determinant(taught):
    _, case, _, lesson = taught
    prior = baseline_hypothesis(case).precision
    np.testing.assert_allclose(prior, 12.0 * np.eye(2), rtol=1e-6)
    wanted = [0.5 * np.log(np.linalg.det(prior + told) / np.linalg.det(prior)) for told in lesson.informations]
    np.testing.assert_allclose(lesson.gains, wanted, rtol=1e-6)
    assert lesson.best == np.argmax(lesson.gains)
    assert np.all(lesson.gains > 0.0)
    assert np.all(lesson.stds < 12**-0.5 + 1e-9)  # a tip that sticks tells nothing of its friction


def test_a_push_teaches_less_to_who_knows_it(taught):
    _, case, pushes, lesson = taught
    told = lesson.informations[lesson.best]
    again = most_informative_push(
        [pushes[lesson.best]], case=case, start=START, thetas=np.array([0.22, 0.27]),
        information=12.0 * np.eye(2) + told,
    )  # fmt: skip
    # Twice the same information, prior aside: half of ln 4 for two parameters.
    assert again.gains[0] < 0.5 * np.log(4.0) + 1e-6
    assert again.gains[0] < 0.7 * lesson.gains[lesson.best]


def test_the_chosen_push_leaves_less_open_than_random_ones_when_they_are_made(taught, monkeypatch):
    """Made in the planar integrator's world, and learned from without knowing the truth.

    A push that is only planned has no noisy stream: its hand's path is exact, and so it is in what is learned here.
    """
    monkeypatch.setattr("physid_drake.pushes.problem.NOTABLE_ERROR", np.inf)
    one, _, pushes, lesson = taught
    order = np.argsort(-lesson.gains)
    some = [int(order[0]), int(order[3]), int(order[-1])]
    gained = {}
    for k in some:
        belief = one.learn(one.start(), made(pushes[k]).pushes[0])
        gained[k] = 0.5 * (np.linalg.slogdet(belief.information)[1] - np.linalg.slogdet(12.0 * np.eye(2))[1])
    random = np.mean([gained[k] for k in some[1:]])
    assert gained[lesson.best] > random + 0.3
    # The expectation was made at the truth; what was learned agrees with it to 0.7 nats.
    np.testing.assert_allclose([gained[k] for k in some], lesson.gains[some], atol=1.0)
    variance = [np.trace(np.linalg.inv(12.0 * np.eye(2) + told)) for told in lesson.informations]
    assert variance[lesson.best] < 0.5 * np.mean(variance)


def test_the_rest_before_a_push_is_no_motion(taught):
    """Else the cell's own error would be known from it, as if it were the same at rest and in motion."""
    _, case, pushes, _ = taught
    problem = teaching._problem("next", pushes[1], case, START)
    poses = np.column_stack([0.05 * np.clip(problem.times - 0.3, 0.0, None), *np.zeros((2, len(problem.times)))])
    begin, end = teaching._foreseen(problem, poses, case).moving
    assert 0.28 <= begin <= 0.4 and end == np.inf


def test_there_must_be_a_push_and_a_hand(taught):
    _, case, _, _ = taught
    with pytest.raises(ConfigError, match="at least one"):
        most_informative_push([], case=case, start=START, thetas=np.array([0.2, 0.3]))


def test_an_object_that_would_be_lost_teaches_nothing(taught):
    """Its last pose, held until the recording ends, would count as many measurements of where it fell."""
    _, case, _, _ = taught
    x1 = case.pool.spec.table[1][0]
    ways = [PlannedPush(direction=d, speed=0.5, travel=0.1, contact_offset=0.0) for d in (0.0, np.pi)]
    lesson = most_informative_push(
        ways, case=case, start=(x1 - 0.06, 0.0, 0.0), thetas=np.array([0.22, 0.27])
    )  # fmt: skip
    assert lesson.best == 1 and lesson.gains[0] == 0.0 < lesson.gains[1]
    np.testing.assert_array_equal(lesson.informations[0], 0.0)
