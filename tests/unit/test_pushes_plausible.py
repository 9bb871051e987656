"""What no refusal catches and hardly any recording has is said in one line, and nothing of what ships has it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.diagnose.sentence import sentence
from physid_drake.pushes.plausible import FEW_NAMES, implausible
from physid_drake.pushes.push_warnings import doubts
from physid_drake.pushes.stated import MANY_TIMES, quieter_by, too_loud
from physid_drake.recording import Box, Cylinder, ForceStream, ObjectModel, Sensors, Table, read_recording
from physid_drake.report.tables import verdict
from physid_drake.resources import shipped


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(6)


def with_objects(recording, change):
    return replace(recording, pushes=tuple(replace(p, object=change(p.object)) for p in recording.pushes))


def pushed_with(recording, newtons):
    """A force along the object's motion while it moves."""

    def forced(push):
        times = push.object.times
        velocities = np.gradient(push.object.positions, times, axis=0)
        speeds = np.linalg.norm(velocities, axis=1, keepdims=True)
        forces = np.where(speeds > 0.05, newtons * velocities / np.maximum(speeds, 1e-9), 0.0)
        return replace(push, force=ForceStream(times=times, forces=forces))

    return replace(recording, pushes=tuple(forced(push) for push in recording.pushes))


@pytest.mark.parametrize("name", ["eraser_reference", "sealed_01"])
def test_nothing_that_ships_is_doubted(name):
    assert doubts(read_recording(shipped("recordings") / name)) == ()


@pytest.mark.parametrize(
    ("size", "said"), [((25.0, 25.0), "25 m by 25 m; is its size in m"), ((0.03, 0.8), "is smaller than the object")]
)
def test_a_table_like_a_hall_or_a_coin_is_doubted(recording, size, said):
    (doubt,) = implausible(replace(recording, table=Table(size=size)))
    assert said in doubt


@pytest.mark.parametrize(("mass", "said"), [(3.0, "heavier than lead"), (5e-4, "lighter than foam")])
def test_a_mass_in_pounds_or_grams_is_doubted(recording, mass, said):
    (doubt,) = implausible(replace(recording, object=replace(recording.object, mass=mass, mass_std=None)))
    assert said in doubt and "in kg" in doubt
    beyond = replace(recording, object=replace(recording.object, mass=1e3 * mass, mass_std=None))
    assert mass < 1.0 or implausible(beyond) == ()  # which is refused


@pytest.mark.parametrize("weighed", [True, False])
@pytest.mark.parametrize(("newtons", "doubted"), [(0.16, False), (160.0, True), (1.6e-4, True), (1.0, False)])
def test_forces_in_mn_or_kn_are_doubted(recording, newtons, doubted, weighed):
    if not weighed:
        recording = replace(recording, object=ObjectModel(shape=recording.object.shape))
    found = [said for said in implausible(pushed_with(recording, newtons)) if "are forces in N" in said]
    # What nobody weighed may be of any density: only what none explains is doubted.
    assert bool(found) == (doubted and (weighed or newtons < 1.0 or newtons > 20.0 * 9.81 * 8000.0 * 1.94e-4))


def test_a_recording_without_a_touch_of_force_is_not_doubted_for_it(recording):
    assert implausible(pushed_with(recording, 0.0)) == ()


@pytest.mark.parametrize(("lift", "said"), [(0.5, "500 mm above"), (-0.5, "500 mm below"), (-0.015, "15 mm below")])
def test_an_object_that_hovers_or_is_seen_at_its_foot_is_doubted(recording, lift, said):
    wrong = with_objects(recording, lambda s: replace(s, positions=s.positions + np.array([0.0, 0.0, lift])))
    (doubt,) = implausible(wrong)
    assert said in doubt and "and 1 more" in doubt and doubt.count("pushes/") == FEW_NAMES


def test_a_lying_cylinder_is_as_high_as_its_radius(recording):
    def lying(radius):
        shape = Cylinder(radius=radius, length=0.05, axis="y")
        return implausible(replace(recording, object=ObjectModel(shape=shape)))

    assert lying(0.015) == ()
    (doubt,) = lying(0.05)
    assert "35 mm below" in doubt


def test_a_rotation_that_was_filled_in_is_doubted(recording):
    def filled(stream):
        return replace(stream, quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (len(stream), 1)))

    (doubt,) = implausible(with_objects(recording, filled))
    assert "was it measured" in doubt
    first, *others = recording.pushes
    alone = replace(recording, pushes=(replace(first, object=filled(first.object)), *others))
    assert implausible(alone) == ()


def test_the_same_push_twice_is_doubted_whatever_its_times(recording):
    first, *others = recording.pushes
    streams = {k: replace(getattr(first, k), times=getattr(first, k).times + 5.0) for k in ("object", "hand")}
    twin = replace(first, name="twin.csv", **streams)
    (doubt,) = implausible(replace(recording, pushes=(first, *others, twin)))
    assert f"same samples: {first.name}, twin.csv" in doubt


def test_times_in_minutes_are_doubted(recording):
    (doubt,) = implausible(with_objects(recording, lambda s: replace(s, times=s.times / 60.0)))
    assert "0.17 ms apart" in doubt


@pytest.mark.parametrize(
    ("sensor", "std", "said"),
    [("object_position_std", 3e-3, "object_position_std_m states 0.003 m, 10 times"),
     ("object_rotation_std", 0.1, "object_rotation_std_rad states 0.1 rad"),
     ("hand_position_std", 0.03, "hand_position_std_m states 0.03 m")],
)  # fmt: skip
def test_a_noise_stated_many_times_too_large_is_doubted(recording, sensor, std, said):
    (doubt,) = too_loud(replace(recording, sensors=replace(recording.sensors, **{sensor: std})))
    assert said in doubt and "that the stream shows" in doubt
    assert doubt in doubts(replace(recording, sensors=replace(recording.sensors, **{sensor: std})))


def test_a_tracker_that_smooths_is_not_doubted(recording):
    """A mean of sixteen samples shows a quarter."""
    louder = Sensors(object_position_std=4.0 * 3e-4, object_rotation_std=4.0 * 3e-3, hand_position_std=4.0 * 5e-5)
    assert MANY_TIMES > 4.0 and too_loud(replace(recording, sensors=louder)) == ()


def test_a_stream_that_shows_no_noise_contradicts_none(recording):
    """A simulation, or a tracker that is coarser than its noise."""

    def exact(stream):
        smooth = np.linspace(0.0, 0.1, len(stream))[:, None] * np.array([1.0, 0.0, 0.0])
        turns = np.tile(stream.quaternions[0], (len(stream), 1))
        return replace(stream, positions=stream.positions[0] + smooth, quaternions=turns)

    hands = tuple(replace(p, hand=exact(p.hand)) for p in recording.pushes)
    assert too_loud(with_objects(replace(recording, pushes=hands), exact)) == ()


def test_a_noise_in_which_the_object_hardly_moves_is_doubted(recording):
    def shorter(stream):
        turns = np.tile(stream.quaternions[0], (len(stream), 1))
        places = stream.positions[0] + 1e-2 * (stream.positions - stream.positions[0])
        return replace(stream, positions=places, quaternions=turns)

    said = too_loud(replace(with_objects(recording, shorter), sensors=Sensors(object_position_std=5e-3)))
    assert any("Such noise hides what the object does" in doubt for doubt in said)


def test_noise_far_above_what_is_left_is_no_explanation():
    assert quieter_by(1e-4, 500) == pytest.approx(100.0)
    assert quieter_by(0.2, 4) is None  # by chance
    assert quieter_by(0.5, 500) is None and quieter_by(1.0, 500) is None and quieter_by(0.0, 0) is None
    said = sentence("consistent", (), None, quieter=quieter_by(1e-4, 500))
    assert "100 times the remaining errors, and effects smaller than it cannot be detected" in said
    result = SimpleNamespace(reduced_chi2=1e-4, explains=True, degrees=500)
    assert "smaller effects cannot be detected" in verdict(result) and "explains" not in verdict(result)


def test_an_object_in_a_box_of_another_height_is_doubted(recording):
    tall = replace(recording.object, shape=Box(size=(0.127, 0.051, 0.3)))
    (doubt,) = implausible(replace(recording, object=replace(tall, mass=None, mass_std=None)))
    assert "135 mm below" in doubt


def with_offset(recording, newtons):
    """A sensor that was not tared: the same force in all samples, that of the push upon it."""

    def shifted(push):
        assert push.force is not None
        return replace(push, force=replace(push.force, forces=push.force.forces + np.array([newtons, 0.0, 0.0])))

    return replace(recording, pushes=tuple(shifted(push) for push in recording.pushes))


def test_a_force_where_nothing_is_touched(recording):
    friction = pushed_with(recording, 0.5)
    assert not any("while the tip is" in line for line in doubts(friction))
    (line,) = [line for line in doubts(with_offset(friction, 0.4)) if "while the tip is" in line]
    assert "forces are 0.4" in line and "tare_s" in line


def test_a_force_that_never_changes(recording):
    still = with_offset(pushed_with(recording, 0.0), 0.3)
    assert any("the force is the same in all samples" in line for line in doubts(still))
