"""A recorded push as the fit sees it: noise, start, height of the contact."""

from dataclasses import replace

import numpy as np
import pytest
from problems import QUIET, ends, first, with_pushes
from runs import shipped_pushes

from physid_drake.errors import RecordingError
from physid_drake.pushes.noise import noise_of
from physid_drake.pushes.problem import problems_of, spec_of
from physid_drake.recording import (
    Cylinder,
    Hand,
    ObjectModel,
    PoseStream,
    Push,
    Recording,
    Sensors,
    Table,
    rest_segments,
)


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(3)


def at_height(stream, z):
    return PoseStream(times=stream.times, positions=stream.positions * [1, 1, 0] + [0, 0, z],
                      quaternions=stream.quaternions)  # fmt: skip


# Noise.


def test_what_the_sensors_state_is_believed(recording):
    noise = noise_of(recording)
    assert (noise.position, noise.rotation, noise.hand) == (3e-4, 3e-3, 5e-5)
    assert noise.source == {"position": "stated", "rotation": "stated", "hand": "stated", "force": "assumed"}


def test_what_is_not_stated_is_seen_at_rest(recording):
    noise = noise_of(replace(recording, sensors=Sensors()))
    assert noise.source == {"position": "seen", "rotation": "seen", "hand": "seen", "force": "assumed"}
    # Truth 0.3 mm, 3 mrad, 0.05 mm, from some hundred samples.
    assert noise.position == pytest.approx(3e-4, rel=0.2)
    assert noise.rotation == pytest.approx(3e-3, rel=0.2)
    assert noise.hand == pytest.approx(5e-5, rel=0.3)


def test_what_is_neither_stated_nor_seen_is_assumed(recording):
    def ends(push):
        rows = [0, len(push.object) - 1]
        s = push.object
        stream = PoseStream(times=s.times[rows], positions=s.positions[rows], quaternions=s.quaternions[rows])
        return replace(push, object=stream)

    noise = noise_of(replace(with_pushes(recording, ends), sensors=Sensors()))
    assert noise.source["position"] == noise.source["rotation"] == noise.source["force"] == "assumed"
    assert min(noise.position, noise.rotation, noise.force) > 0.0
    assert not noise.correlations.any()


def test_an_assumed_noise_is_no_finer_than_the_rounding(recording):
    rng = np.random.default_rng(0)

    def coarse_ends(push):
        rows, s = [0, len(push.object) - 1], push.object
        places = np.round(rng.uniform(-0.3, 0.3, (2, 3)), 2)
        return replace(
            push, object=PoseStream(times=s.times[rows], positions=places, quaternions=s.quaternions[rows])
        )

    several = tuple(replace(push, name=f"{k}") for k, push in enumerate(4 * recording.pushes))
    noise = noise_of(with_pushes(replace(recording, pushes=several, sensors=Sensors()), coarse_ends))
    assert noise.source["position"] == "assumed"
    assert noise.position == pytest.approx(0.01 / 12.0**0.5, rel=1e-6)


def test_a_recording_without_noise_is_not_believed_to_be_exact(recording):
    def exact(push):
        s = push.object
        return replace(push, object=PoseStream(times=s.times, positions=np.tile(s.positions[0], (len(s), 1)),
                                               quaternions=np.tile(s.quaternions[0], (len(s), 1))))  # fmt: skip

    noise = noise_of(replace(with_pushes(recording, exact), sensors=Sensors()))
    assert noise.source["position"] == "assumed"
    assert noise.position > 1e-4


def test_white_noise_has_no_correlation_and_correlated_noise_has_in_its_own_channel(recording):
    assert noise_of(recording).correlations.max() < 0.2

    def smear(push):
        rng, s = np.random.default_rng(0), push.object
        e = rng.standard_normal((len(s), 3)) * 3e-4
        for k in range(1, len(e)):
            e[k, 2] = 0.7 * e[k - 1, 2] + np.sqrt(0.51) * e[k, 2]
        place = np.tile(s.positions[0], (len(s), 1)) + e * [1, 1, 0]
        half = 0.5 * e[:, 2] * 10
        q = np.column_stack([np.cos(half), 0 * half, 0 * half, np.sin(half)])
        return replace(push, object=PoseStream(times=s.times, positions=place, quaternions=q))

    place, _, turn = noise_of(with_pushes(recording, smear)).correlations
    assert place < 0.2 and turn == pytest.approx(0.7, abs=0.2)


# The contact's height.


@pytest.mark.parametrize(
    ("hand", "z", "want"),
    [
        (Hand(tip="sphere", radius=0.01), 0.012, 0.012),
        (Hand(tip="cylinder", radius=0.01, length=0.06), 0.040, 0.020),  # 10 to 70 mm against 0 to 30 mm
        (Hand(tip="cylinder", radius=0.01, length=0.10), 0.040, 0.015),
        (Hand(tip="capsule", radius=0.01, length=0.02), 0.010, 0.010),
        (Hand(tip="capsule", radius=0.01, length=0.02), 0.005, 0.0075),
    ],
)
def test_the_contact_is_in_the_middle_of_what_tip_and_object_share(recording, hand, z, want):
    changed = with_pushes(recording, lambda p: replace(p, hand=at_height(p.hand, z)))
    assert first(replace(changed, hand=hand)).hand_height == pytest.approx(want)


def test_a_round_tip_just_above_the_edge_touches_the_edge(recording):
    changed = with_pushes(recording, lambda p: replace(p, hand=at_height(p.hand, 0.033)))
    assert first(changed).hand_height == 0.03


def test_a_tip_that_lies_has_the_axes_of_the_world(recording):
    def lay(push):
        q = np.tile([np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0], (len(push.hand), 1))
        return replace(push, hand=replace(push.hand, quaternions=q))

    assert np.array_equal(first(with_pushes(recording, lay)).hand_axes, np.eye(2))


def test_the_axes_of_the_tip_are_those_of_its_quaternions(recording):
    assert np.array_equal(first(recording).hand_axes, np.eye(2))

    def turn(push):  # by 0.6 rad, pointing down
        q = np.tile([0.0, np.cos(0.3), np.sin(0.3), 0.0], (len(push.hand), 1))
        return replace(push, hand=replace(push.hand, quaternions=q))

    c, s = np.cos(0.6), np.sin(0.6)
    assert first(with_pushes(recording, turn)).hand_axes == pytest.approx(np.array([[c, s], [s, -c]]))


def test_an_object_on_another_face_is_refused(recording):
    def topple(push):
        q = np.tile([np.cos(np.pi / 4), np.sin(np.pi / 4), 0.0, 0.0], (len(push.object), 1))
        return replace(push, object=replace(push.object, quaternions=q))

    with pytest.raises(RecordingError, match="z axis is 90 degrees from the vertical"):
        first(with_pushes(recording, topple))


def test_an_object_that_tips_on_its_way_is_refused(recording):
    def tip_over(push):
        half = 0.5 * np.linspace(0.0, np.pi / 2, len(push.object))
        q = np.column_stack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half])
        return replace(push, object=replace(push.object, quaternions=q))

    with pytest.raises(RecordingError, match="the object tips by 90 degrees, from"):
        first(with_pushes(recording, tip_over))


def test_an_object_that_has_tipped_by_its_last_pose_is_refused(recording):
    def tipped(push):
        seen = ends(push).object
        over = np.array([[1.0, 0.0, 0.0, 0.0], [np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0]])
        return replace(push, object=replace(seen, quaternions=over))

    with pytest.raises(RecordingError, match="the object tips by 90 degrees, from"):
        first(with_pushes(recording, tipped))


def test_streams_of_different_clocks_are_refused(recording):
    def later(push):
        return replace(push, hand=replace(push.hand, times=push.hand.times + 1000.0))

    with pytest.raises(RecordingError, match="same clock"):
        first(with_pushes(recording, later))


def test_times_in_milliseconds_are_refused(recording):
    def slower(push):
        streams = (replace(stream, times=1e3 * stream.times) for stream in (push.object, push.hand))
        return replace(push, **dict(zip(("object", "hand"), streams, strict=True)))

    with pytest.raises(RecordingError, match="look to be in milliseconds; give seconds"):
        first(with_pushes(recording, slower))


@pytest.mark.parametrize(("mass", "said"), [(50.0, "denser than any metal"), (1e-6, "lighter than air")])
def test_a_mass_that_no_such_object_has_is_refused(recording, mass, said):
    heavy = replace(recording, object=replace(recording.object, mass=mass, mass_std=None))
    with pytest.raises(RecordingError, match=f"{said}.*in kg"):
        first(heavy)


def test_an_object_that_stands_beside_the_table_is_refused(recording):
    elsewhere = replace(recording, table=replace(recording.table, centre=(9.0, 0.0)))
    with pytest.raises(RecordingError, match=r"beside the table.*same frame"):
        first(elsewhere)


def test_a_hand_that_never_comes_near_what_moves_is_refused(recording):
    def away(push):
        return replace(push, hand=replace(push.hand, positions=push.hand.positions + np.array([0.5, 0.0, 0.0])))

    with pytest.raises(RecordingError, match=r"stays [0-9]+ mm or more away from it.* same frame"):
        first(with_pushes(recording, away))
    one, *others = recording.pushes
    first(replace(recording, pushes=(away(one), *others)))  # a push that misses


def test_a_tip_that_is_larger_than_its_distance_is_refused(recording):
    def with_radius(radius):
        return replace(recording, hand=replace(recording.hand, radius=radius))

    with pytest.raises(RecordingError, match=r"tip, of radius 10 m, is 9[0-9]{3} mm or more inside.* in m\?"):
        first(with_radius(1e3 * recording.hand.radius))
    first(with_radius(recording.hand.radius + 0.02))  # a wrong radius is for the diagnosis to find


@pytest.mark.parametrize(("said", "believed"), [(5e-5, True), (5e-6, False)])
def test_a_hand_that_is_louder_than_it_is_said_is_not_believed(recording, said, believed):
    rng = np.random.default_rng(0)

    def shaken(push):
        noise = 5e-5 * rng.standard_normal(push.hand.positions.shape)
        return replace(push, hand=replace(push.hand, positions=push.hand.positions + noise))

    stated = replace(recording, sensors=replace(recording.sensors, hand_position_std=said))
    noise = noise_of(with_pushes(stated, shaken))
    assert (noise.source["hand"] == "stated") is believed
    assert noise.hand == pytest.approx(5e-5, rel=0.6) and noise.hand > 2e-5


def test_a_rolling_cylinder_is_touched_at_its_axis(recording):
    can = ObjectModel(shape=Cylinder(radius=0.033, length=0.1, axis="y"))
    assert first(replace(recording, object=can), height=0.066).hand_height == 0.033


# The start.


def test_a_push_starts_at_the_mean_of_the_rest_before_it(recording):
    push = recording.pushes[0]
    problem = first(recording)
    assert problem.begin == push.object.times[0]
    assert problem.end == push.end_time
    still = push.object.planar[:15]  # the hand comes after 0.2 s
    np.testing.assert_allclose(problem.start.pose, still.mean(axis=0), atol=3 * 3e-3 / np.sqrt(15))
    assert (problem.start_std < 0.5 * QUIET.sigmas).all()
    assert (problem.start_std > QUIET.sigmas / np.sqrt(len(push.object))).all()


def test_what_made_the_start_is_not_compared_again(recording):
    stream, problem = recording.pushes[0].object, first(recording)
    rest = rest_segments(recording.pushes[0])[0]
    np.testing.assert_array_equal(problem.times, stream.times[rest.stop - 1 :])
    np.testing.assert_array_equal(problem.poses, stream.planar[rest.stop - 1 :])


def test_noise_of_a_rest_is_no_motion(recording):
    begins = [problem.moving[0] for problem in problems_of(recording, QUIET, 0.03)]

    def louder(push):  # one sample of the rest is off, by more than a twentieth of the way
        s = push.object
        positions = s.positions.copy()
        positions[3, :2] += 0.06 * np.linalg.norm(positions[-1, :2] - positions[0, :2]) + 5.0 * QUIET.position
        return replace(push, object=PoseStream(times=s.times, positions=positions, quaternions=s.quaternions))

    changed = problems_of(with_pushes(recording, louder), QUIET, 0.03)
    np.testing.assert_allclose([problem.moving[0] for problem in changed], begins, atol=0.021)
    assert (np.array(begins) > [p.begin + 0.1 for p in changed]).all()


def test_correlated_noise_makes_the_start_less_sure(recording):
    sure, unsure = (first(recording, replace(QUIET, rotation_correlation=c)).start_std for c in (0.0, 0.9))
    np.testing.assert_allclose(unsure / sure, [1.0, 1.0, np.sqrt(19.0)], rtol=0.35)


def test_without_a_rest_the_first_pose_is_the_start(recording):
    def cut(push):
        s = push.object
        moving = np.flatnonzero(np.linalg.norm(s.planar[:, :2] - s.planar[0, :2], axis=1) > 5e-3)[0]
        keep = slice(moving, moving + 8)
        stream = PoseStream(times=s.times[keep], positions=s.positions[keep], quaternions=s.quaternions[keep])
        return replace(push, object=stream)

    changed = with_pushes(recording, cut)
    problem = first(changed)
    np.testing.assert_array_equal(problem.start.pose, changed.pushes[0].object.planar[0])
    np.testing.assert_array_equal(problem.start_std, QUIET.sigmas)


def test_of_two_poses_the_first_is_the_start_and_the_last_is_compared(recording):
    changed = with_pushes(recording, ends)
    problem = first(changed)
    np.testing.assert_array_equal(problem.start.pose, changed.pushes[0].object.planar[0])
    np.testing.assert_array_equal(problem.poses, changed.pushes[0].object.planar[1:])
    np.testing.assert_array_equal(problem.times, changed.pushes[0].object.times[1:])


def slide(poses=40):
    """A free slide: 0.5 m/s along x, slowing by 2 m/s^2, turning at 3 rad/s, without noise."""
    t = 0.01 * np.arange(poses)
    half = 0.5 * 3.0 * t
    zeros = np.zeros(poses)
    stream = PoseStream(
        times=t + 7.0,
        positions=np.column_stack([0.5 * t - t**2, zeros, zeros + 0.015]),
        quaternions=np.column_stack([np.cos(half), zeros, zeros, np.sin(half)]),
    )
    recording = shipped_pushes(1)
    push = Push(name="slide", object=stream, hand=None, force=None)
    return Recording(
        name="slide", description="", object=recording.object, table=Table(size=(2.0, 2.0)), hand=None,
        sensors=Sensors(), pushes=(push,),
    )  # fmt: skip


def test_a_free_slide_starts_with_the_velocity_of_its_first_samples():
    problem = first(slide())
    assert problem.path is None
    np.testing.assert_allclose(problem.start.velocity, [0.5, 0.0, 3.0], atol=1e-9)
    np.testing.assert_allclose(problem.start.pose, 0.0, atol=1e-9)
    assert problem.start_std.shape == (6,)
    assert (problem.start_std > 0.0).all()
    assert spec_of(slide(), None).hand_radius is None


@pytest.mark.parametrize("poses", [20, 30, 80])
def test_the_first_samples_of_a_free_slide_count_once(poses):
    """By linear algebra: a deceleration's deviation with the start's and all samples, over that of samples alone."""
    problem = first(slide(poses))
    assert problem.times[0] == problem.begin and len(problem.poses) == poses
    t = problem.times - problem.begin
    design = np.column_stack([np.ones(poses), t, 0.5 * t**2]) / QUIET.position
    known = np.diag([*problem.start_std[[0, 3]] ** -2.0, 0.0])
    alone, both = (np.sqrt(np.linalg.inv(design.T @ design + more)[2, 2]) for more in (0.0, known))
    assert 0.96 < both / alone < 1.0


@pytest.mark.slow
@pytest.mark.parametrize(("rate", "correlation"), [(500, 0.0), (500, 0.9), (120, 0.8)])
def test_a_free_slides_start_is_a_third_as_sure_as_its_noise_allows(rate, correlation):
    times, rng, off = np.arange(0.0, 0.3, 1.0 / rate), np.random.default_rng(0), []
    noise = replace(QUIET, position_correlation=correlation)
    for _ in range(200):
        e = rng.standard_normal((len(times), 2))
        for k in range(1, len(e)):
            e[k] = correlation * e[k - 1] + np.sqrt(1.0 - correlation**2) * e[k]
        places = np.column_stack([0.5 * times + 3e-4 * e[:, 0], 3e-4 * e[:, 1], 0.0 * times])
        yaw = 0.5 * 3e-3 * rng.standard_normal(len(times))
        turned = np.column_stack([np.cos(yaw), 0 * yaw, 0 * yaw, np.sin(yaw)])
        push = Push(name="slide", hand=None, force=None,
                    object=PoseStream(times=times, positions=places, quaternions=turned))  # fmt: skip
        problem = problems_of(replace(slide(), pushes=(push,)), noise, 0.03)[0]
        start = np.array([*problem.start.pose, *problem.start.velocity])
        off.append((start - [0.0, 0.0, 0.0, 0.5, 0.0, 0.0]) / problem.start_std)
    # Three standard errors of 200 slides; 2.1 to 2.6 thirds where the noise counts as white.
    np.testing.assert_allclose(3.0 * np.sqrt(np.mean(np.square(off), axis=0)), 1.0, atol=0.16)


def test_a_free_slide_of_two_poses_has_no_velocity_and_is_refused():
    with pytest.raises(RecordingError, match=r"'slide'.*at least 3 poses"):
        first(slide(2))


def test_the_table_of_the_cell_is_the_recorded_one(recording):
    moved = replace(recording, table=Table(size=(1.0, 0.4), centre=(0.2, -0.1)))
    np.testing.assert_allclose(spec_of(moved, None).table, [[-0.3, -0.3], [0.7, 0.1]])
