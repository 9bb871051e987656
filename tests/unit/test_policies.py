"""Policies: settings in, hand paths out."""

import math

import numpy as np
import pytest
from twin import body_of

from physid_drake.cell import Cell, Outcome, Start
from physid_drake.cell.outline import Disc, rectangle
from physid_drake.errors import ConfigError, ParameterError
from physid_drake.policies import POLICIES, PlannedPush, hand_samples, policy_named, push_csv
from physid_drake.policies.planned_push import ACCELERATION, LEAD, STEADY
from physid_drake.policies.policy import Reach
from physid_drake.recording import Box

RADIUS = 0.01
OUTLINE = rectangle(0.127, 0.051)


def reach(**changes):
    return Reach(**({"heading": 0.4, "travel": 0.1, "inner_radius": 0.0255} | changes))


@pytest.mark.parametrize("name", POLICIES)
def test_the_nominal_settings_of_every_policy_point_along_the_heading(name):
    policy = policy_named(name, reach())
    pushes = policy.pushes(policy.space.nominal)
    assert policy.name == name
    assert policy.swept in policy.space.names
    assert [p.direction for p in pushes] == pytest.approx([0.4] * len(pushes))
    assert sum(p.travel for p in pushes) == pytest.approx(0.1)
    assert all(p.contact_offset == 0.0 for p in pushes)


def test_a_policy_puts_its_settings_into_its_pushes():
    (push,) = policy_named("push", reach()).pushes(np.array([0.1, 0.3, 0.005]))
    assert (push.direction, push.speed, push.contact_offset) == (0.1, 0.3, 0.005)
    first, second = policy_named("two_pushes", reach()).pushes(np.array([0.1, 0.3, 0.2, 0.5]))
    assert (first.direction, first.speed, second.direction, second.speed) == (0.1, 0.3, 0.2, 0.5)
    (push,) = policy_named("push_direction", reach(speed=0.07)).pushes(np.array([0.9]))
    assert (push.direction, push.speed) == (0.9, 0.07)


def test_settings_outside_the_bounds_are_refused():
    with pytest.raises(ParameterError, match="speed"):
        policy_named("push_speed", reach()).pushes(np.array([1.5]))


def test_the_contact_offset_stays_within_the_face():
    space = policy_named("push", reach()).space
    bound = space.parameters[space.index("contact_offset")].upper
    assert 0.5 * 0.0255 < bound < 0.0255


@pytest.mark.parametrize(
    "changes",
    [{"heading": math.nan}, {"travel": 0.0}, {"speed": 2.0}, {"speeds": (0.5, 0.1)}, {"inner_radius": -1.0}],
)
def test_a_reach_that_no_hand_has_is_refused(changes):
    with pytest.raises(ConfigError):
        reach(**changes)


def test_an_unknown_policy_is_refused_by_name():
    with pytest.raises(ConfigError, match="'throw'"):
        policy_named("throw", reach())


@pytest.mark.parametrize("changes", [{"speed": 0.0}, {"travel": -0.1}, {"direction": math.inf}])
def test_a_planned_push_that_cannot_be_made_is_refused(changes):
    with pytest.raises(ConfigError, match="planned push"):
        PlannedPush(**({"direction": 0.0, "speed": 0.1, "travel": 0.1} | changes))


@pytest.mark.parametrize("speed", [0.02, 0.3, 1.0])
@pytest.mark.parametrize("pose", [(0.0, 0.0, 0.0), (0.1, -0.2, 0.7)])
def test_the_hand_touches_at_full_speed_and_brakes_after_the_travel(speed, pose):
    push = PlannedPush(direction=0.5, speed=speed, travel=0.1, contact_offset=0.006)
    path = push.path(pose, OUTLINE, RADIUS)

    def gap(time):
        x, y = path.positions(np.array([time]))[0] - pose[:2]
        c, s = math.cos(pose[2]), math.sin(pose[2])
        return OUTLINE.nearest(c * x + s * y, c * y - s * x)[0] - RADIUS

    touch = path.times[1] + STEADY / speed
    assert gap(touch) == pytest.approx(0.0, abs=1e-9)
    assert gap(touch - 0.2 * STEADY / speed) > 1e-4
    positions = path.positions(np.array([touch, path.times[2]]))
    assert np.linalg.norm(positions[1] - positions[0]) == pytest.approx(0.1)
    assert np.all(
        np.linalg.norm(np.diff(path.velocities, axis=0), axis=1) / np.diff(path.times) <= 2.01 * ACCELERATION
    )
    assert path.times[0] == LEAD and not path.velocities[0].any() and not path.velocities[-1].any()


def test_the_hand_s_line_is_left_of_the_middle_by_the_offset():
    path = PlannedPush(direction=0.0, speed=0.1, travel=0.1, contact_offset=0.01).path(
        (0.0, 0.0, 0.0), OUTLINE, RADIUS
    )
    assert path.knot_positions()[:, 1] == pytest.approx([0.01] * 4)


def test_an_offset_that_passes_the_object_is_refused():
    push = PlannedPush(direction=0.0, speed=0.1, travel=0.1, contact_offset=0.05)
    with pytest.raises(ConfigError, match="passes the object"):
        push.path((0.0, 0.0, 0.0), Disc(radius=0.03), RADIUS)


def test_a_slow_push_moves_a_simulated_object_by_its_travel():
    cell = Cell(Box(size=(0.127, 0.051, 0.03)), hand_radius=RADIUS)
    body = body_of(0.054, 0.27)
    path = PlannedPush(direction=math.pi / 2, speed=0.1, travel=0.05).path((0.0, 0.0, 0.0), OUTLINE, RADIUS)
    motion = cell.rollout(
        body, start=Start(pose=(0.0, 0.0, 0.0)), path=path, begin=0.0, end=float(path.times[-1]) + 1
    )
    assert motion.outcome is Outcome.COMPLETED
    # The brake adds half its time at full speed: a hand slower than friction stops the object carries it along.
    assert motion.planar_at(motion.times[-1:])[0] == pytest.approx([0.0, 0.0525, 0.0], abs=1e-3)


def test_the_file_holds_what_the_samples_say():
    path = PlannedPush(direction=0.3, speed=0.2, travel=0.1).path((0.0, 0.0, 0.0), OUTLINE, RADIUS)
    lines = push_csv(path, 0.015).splitlines()
    samples = hand_samples(path, 0.015)
    table = np.array([[float(v) for v in line.split(",")] for line in lines[1:]])
    assert lines[0] == "time_s,hand_x_m,hand_y_m,hand_z_m"
    assert table[:, 0] == pytest.approx(samples.times, abs=1e-6) and table[:, 1:] == pytest.approx(
        samples.positions, abs=1e-6
    )
    assert np.all(np.diff(table[:, 0]) == pytest.approx(0.004))
    assert table[0, 1:3] == pytest.approx(path.start, abs=1e-6)
    assert table[-1, 1:] == pytest.approx([*path.knot_positions()[-1], 0.015], abs=1e-6)
