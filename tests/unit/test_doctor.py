"""The data doctor: conventions that are wrong are told by the pushes, and right ones are left alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import foreign
import numpy as np
import pytest

from physid_drake.convert import convert_table
from physid_drake.doctor import examined
from physid_drake.doctor.convention import Convention
from physid_drake.doctor.conventions import conventions_of, pairs_of
from physid_drake.doctor.examination import _simplest
from physid_drake.doctor.forces import conventions_of_forces
from physid_drake.doctor.gaps import gap_of
from physid_drake.recording import Box, Cylinder, ForceStream, Push, Recording, read_recording

RECORDINGS = Path(__file__).parents[2] / "recordings"
MIRROR = np.array([1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def eraser() -> Recording:
    return read_recording(RECORDINGS / "eraser_reference")


def each(recording: Recording, change) -> Recording:
    return replace(recording, pushes=tuple(map(change, recording.pushes)))


def with_turns(push: Push, quaternions: np.ndarray) -> Push:
    return replace(push, object=replace(push.object, quaternions=quaternions))


def xyzw(push: Push) -> Push:
    return with_turns(push, np.roll(push.object.quaternions, -1, axis=1))


def inverted(push: Push) -> Push:
    return with_turns(push, push.object.quaternions * [1.0, -1.0, -1.0, -1.0])


def mirrored_hand(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, hand=replace(push.hand, positions=push.hand.positions * MIRROR))


def late(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, hand=replace(push.hand, times=push.hand.times + 0.1))


def shifted(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, hand=replace(push.hand, positions=push.hand.positions + np.array([0.008, -0.005, 0.0])))


def swapped(push: Push) -> Push:
    assert push.hand is not None
    order = [1, 0, 2]
    return replace(
        push,
        hand=replace(push.hand, positions=push.hand.positions[:, order]),
        object=replace(push.object, positions=push.object.positions[:, order]),
    )


def swapped_object(push: Push) -> Push:
    return replace(push, object=swapped(push).object)


WRONG = {
    "xyzw": (xyzw, "the object's quaternions are x, y, z, w"),
    "inverted": (inverted, "the object's rotations turn the other way"),
    "mirrored hand": (mirrored_hand, "of the hand, y is mirrored"),
    "late": (late, "the hand's times are 100 ms too late"),
    "shifted": (shifted, "the hand's frame is off by (-7.8, 4.9) mm"),
    "swapped object": (swapped_object, "of the object's places, but not of its rotations, x and y are swapped"),
    "swapped": (swapped, "of both places, but not of the rotations, x and y are swapped"),
}


def test_what_is_right_is_left_alone(eraser: Recording) -> None:
    finding = examined(eraser)
    assert finding.before is not None and finding.before < 1.5
    assert finding.lines() == [] and finding.refused == ""


@pytest.mark.slow
@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_convention_is_named(name: str, eraser: Recording) -> None:
    change, says = WRONG[name]
    finding = examined(each(eraser, change))
    assert finding.after is not None and finding.after < 1.5
    assert any(one.says.startswith(says) for one in finding.better), finding.lines()
    assert len(finding.better) <= 2


@pytest.mark.slow
def test_sizes_are_told_as_well(eraser: Recording) -> None:
    assert eraser.hand is not None and isinstance(eraser.object.shape, Box)
    wide = replace(eraser, hand=replace(eraser.hand, radius=2.0 * eraser.hand.radius))
    assert [one.says for one in examined(wide).better] == ["the tip's radius is a diameter"]
    x, y, z = eraser.object.shape.size
    turned = replace(eraser, object=replace(eraser.object, shape=Box(size=(y, x, z))))
    said = [one.says for one in examined(turned).better]
    assert "the object's sizes along x and y are swapped" in said


@pytest.mark.slow
def test_physics_that_is_missing_is_no_wrong_convention() -> None:
    finding = examined(read_recording(RECORDINGS / "sealed_01"))
    assert finding.lines() == []


def test_every_convention_is_another_recording(eraser: Recording) -> None:
    forced = each(eraser, with_forces)
    weighed = replace(forced, object=replace(forced.object, mass=0.05, mass_std=0.001))
    found = [*conventions_of(weighed), *conventions_of_forces(weighed)]
    assert len({one.says for one in found}) == len(found) > 25
    assert all(one.recording != forced and one.remedy for one in found)
    assert {one.says for one in found} >= {
        "forces are in mN",
        "the mass is in lb",
        "the object's size_m are half sizes",
    }


@pytest.mark.slow
def test_a_force_of_the_other_sign_is_told_from_a_mirror(eraser: Recording) -> None:
    """A mirrored world would turn the force's work as well: places are asked without forces."""
    forces = each(eraser, with_friction)
    assert examined(forces).lines() == []
    (one,) = examined(each(forces, pulled)).better
    assert one.says == "the force is that of the object on the hand"
    said = [one.says for one in examined(each(forces, lambda push: pulled(inverted(push)))).better]
    assert any(one.startswith("the object's rotations turn the other way") for one in said)


def with_friction(push: Push) -> Push:
    """What it takes to push it steadily: friction along its way."""
    times = push.object.times
    velocity = np.gradient(push.object.positions, times, axis=0)
    speed = np.linalg.norm(velocity, axis=1, keepdims=True)
    forces = 0.27 * 0.054 * 9.81 * velocity / np.maximum(speed, 0.02)
    return replace(push, force=ForceStream(times=times, forces=forces))


def pulled(push: Push) -> Push:
    assert push.force is not None
    return replace(push, force=replace(push.force, forces=-push.force.forces))


def with_forces(push: Push) -> Push:
    assert push.hand is not None
    forces = np.tile([0.1, 0.0, 0.0], (len(push.hand), 1))
    return replace(push, force=ForceStream(times=push.hand.times, forces=forces))


def test_what_is_right_undoes_what_is_wrong(eraser: Recording) -> None:
    for change, says in WRONG.values():
        wrong = each(eraser, change)
        right = next(one.recording for one in conventions_of(wrong) if one.says.startswith(says.partition("(")[0]))
        for push, other in zip(eraser.pushes, right.pushes, strict=True):
            assert push.hand is not None and other.hand is not None
            assert np.abs((other.object.quaternions * push.object.quaternions).sum(axis=1)) == pytest.approx(1.0)
            assert other.hand.times == pytest.approx(push.hand.times, abs=0.011)
            assert other.hand.positions == pytest.approx(push.hand.positions, abs=6e-4)
            assert other.object.positions == pytest.approx(push.object.positions, abs=1e-9)


def in_cm(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, hand=replace(push.hand, positions=100.0 * push.hand.positions))


def test_units_of_places(eraser: Recording) -> None:
    """Refused as it is: the hand never comes near."""
    finding = examined(each(eraser, in_cm))
    assert finding.before is None and "never" not in finding.refused and finding.refused
    assert [one.says for one in finding.better] == ["the hand's places are 100 times too large (cm for m)"]


@pytest.mark.slow
def test_two_at_once(eraser: Recording) -> None:
    (line, *_) = examined(each(each(eraser, late), mirrored_hand)).lines()
    assert "of the hand, y is mirrored, and the hand's times are 100 ms too late" in line


def test_pairs_are_of_different_kinds(eraser: Recording) -> None:
    said = [pair.says for pair in pairs_of(eraser.subset([0, 4]))]
    assert len(set(said)) == len(said) > 300
    assert not any(one.count("quaternions") > 1 or one.count("the hand's places") > 1 for one in said)


def test_a_tip_is_at_what_it_pushes(eraser: Recording) -> None:
    assert gap_of(eraser) < 1e-3
    assert gap_of(each(eraser, shifted)) > 5e-3


def test_a_round_objects_other_sizes() -> None:
    sealed = read_recording(RECORDINGS / "sealed_01")
    assert isinstance(sealed.object.shape, Cylinder)
    radii = {
        one.recording.object.shape.radius / sealed.object.shape.radius
        for one in conventions_of(sealed)
        if isinstance(one.recording.object.shape, Cylinder)
    }
    assert radii == {0.5, 1.0, 2.0}


ORIGIN = "origin: [0.4, -0.3, 0.75]"
OFFSET = "{translation: [0.01, -0.02, -0.05], yaw_deg: 40}"
POSE = "{pose: {translation: [0.1, -0.2, 0.6], rotation_wxyz: [0.1, 0.9, 0.4, 0.141421356]}}"
UP = "{axes: [z, x, y], origin: [0.4, 0.75, -0.3], yaw_deg: 30}"
# True map, what of it is wrong, what is said, and where.
BY_MAP = {
    "both in mm": (
        {"world": f"{{{ORIGIN}}}", "unit": "mm", "hand_unit": "mm"}, {"unit": "m", "hand_unit": "m"},
        "the places of object and hand are 1000 times too large (mm for m)",
        "map lines 5 and 8: object.position and hand.position: unit: mm",
    ),
    "both in inches": (
        {"world": POSE, "unit": "inch", "hand_unit": "inch", "offset": OFFSET}, {"unit": "cm", "hand_unit": "cm"},
        "the places of object and hand are 2.54 times too small (inch for cm)",
        "map lines 5 and 9: object.position and hand.position: unit: inch",
    ),
    "the object in cm": (
        {"world": UP, "unit": "cm", "offset": OFFSET}, {"unit": "m"},
        "the object's places are 100 times too large (cm for m)", "map line 5: object.position: unit: cm",
    ),
    "the hand in m": (
        {"world": f"{{{ORIGIN}}}", "hand_world": "{origin: [1, 2, 3], yaw_deg: -50}"}, {"hand_unit": "mm"},
        "the hand's places are 1000 times too small (m for mm)", "map line 8: hand.position: unit: m",
    ),
    "all in mm": (
        {"world": "{origin: [400, -300, 750], unit: mm}", "unit": "mm", "hand_unit": "mm"},
        {"world": "{origin: [400, -300, 750]}", "unit": "m", "hand_unit": "m"},
        "the places of object and hand are 1000 times too large (mm for m), and so is W's origin",
        "map lines 5, 8 and 10: object.position, hand.position and world: unit of each",
    ),
    "the origin in mm": (
        {"world": "{origin: [400, -300, 750], unit: mm}"}, {"world": "{origin: [400, -300, 750]}"},
        "W's origin is 1000 times too large (mm for m)", "map line 10: world: unit",
    ),
    "the hand's origin in cm": (
        {"hand_world": "{origin: [40, -30, 75], unit: cm}"}, {"hand_world": "{origin: [40, -30, 75]}"},
        "the origin of the hand's frame is 100 times too large (cm for m)", "map line 10: hand.world: unit",
    ),
    "w last, y up": (
        {"world": UP, "order": "xyzw", "offset": OFFSET}, {"order": "wxyz"},
        "the object's quaternions are x, y, z, w", "map line 6: object.rotation: as: xyzw",
    ),
    "inverse": (
        {"world": UP, "offset": OFFSET, "rotation": "{columns: [q0, q1, q2, q3], as: wxyz, inverse: true}"},
        {"rotation": "{columns: [q0, q1, q2, q3], as: wxyz}"},
        "the object's rotations turn the other way", "map line 6: object.rotation: inverse: true",
    ),
    "y up": (
        {"world": "{axes: [z, x, y], origin: [0.4, 0.75, -0.3]}", "order": "xyzw"},
        {"world": "{origin: [0.4, 0.75, -0.3]}"},
        "the log's y axis is up", "map line 10: world: axes: [z, x, y]",
    ),
    "Euler angles in rad": (
        {"world": UP, "offset": OFFSET, "rotation": "{columns: [q0, q1, q2], as: euler, order: ZYX, unit: rad}"},
        {"rotation": "{columns: [q0, q1, q2], as: euler, order: ZYX, unit: deg}"},
        "the object's Euler angles are in rad", "map line 6: object.rotation: unit: rad",
    ),
    "rotation vectors in rad": (
        {"world": POSE, "rotation": "{columns: [q0, q1, q2], as: rotation_vector, unit: rad}"},
        {"rotation": "{columns: [q0, q1, q2], as: rotation_vector, unit: deg}"},
        "the object's rotation vectors are in rad", "map line 6: object.rotation: unit: rad",
    ),
    "Euler angles in another order": (
        {"world": f"{{{ORIGIN}}}", "rotation": "{columns: [q0, q1, q2], as: euler, order: ZYX, unit: deg}"},
        {"rotation": "{columns: [q0, q1, q2], as: euler, order: XYZ, unit: deg}"},
        "the columns of the object's Euler angles are about z, y, x", "map line 6: object.rotation: order: ZYX",
    ),
    "left-handed": (
        {"world": "{axes: [x, z, y], left_handed: true}"}, {"world": "{axes: [x, y, z]}"},
        "the log's y axis is up, and its axes are left-handed",
        "map line 10: world: axes: [x, z, y], left_handed: true",
    ),
}  # fmt: skip


def by_wrong_map(recording: Recording, case: str, folder: Path) -> Recording:
    true, wrong, _, _ = BY_MAP[case]
    foreign.by_map(recording, folder / "log.csv", foreign.map_of(recording, **true))
    (folder / "map.yaml").write_text(foreign.map_of(recording, **true | wrong))
    return convert_table(folder / "log.csv", folder / "out", folder / "map.yaml")


@pytest.mark.parametrize("case", BY_MAP)
def test_what_a_map_got_wrong_is_put_right_in_the_frame_of_the_log(
    case: str, eraser: Recording, tmp_path: Path
) -> None:
    some = eraser.subset([0, 5])
    _, _, says, remedy = BY_MAP[case]
    (found,) = [
        one for one in conventions_of(by_wrong_map(some, case, tmp_path)) if one.says.partition(" (R_BW")[0] == says
    ]
    assert remedy in found.remedy
    for push, other in zip(some.pushes, found.recording.pushes, strict=True):
        assert other.object.positions == pytest.approx(push.object.positions, abs=1e-7)
        assert np.abs((other.object.quaternions * push.object.quaternions).sum(axis=1)) == pytest.approx(1.0)
        assert push.hand is not None and other.hand is not None
        there = np.column_stack([np.interp(other.hand.times, push.hand.times, c) for c in push.hand.positions.T])
        assert other.hand.positions == pytest.approx(there, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("case", BY_MAP)
def test_what_a_map_got_wrong_is_named(case: str, eraser: Recording, tmp_path: Path) -> None:
    finding = examined(by_wrong_map(eraser, case, tmp_path))
    assert finding.after is not None and finding.after < 1.5
    (line,) = finding.lines()
    assert BY_MAP[case][2] in line and BY_MAP[case][3] in line


@pytest.mark.slow
def test_a_unit_and_an_axis_at_once(eraser: Recording, tmp_path: Path) -> None:
    true = {"world": "{axes: [z, x, y], origin: [0.4, 0.75, -0.3]}", "unit": "mm", "hand_unit": "mm"}
    wrong = {"world": "{origin: [0.4, 0.75, -0.3]}", "unit": "m", "hand_unit": "m"}
    foreign.by_map(eraser, tmp_path / "log.csv", foreign.map_of(eraser, **true))
    (tmp_path / "map.yaml").write_text(foreign.map_of(eraser, **true | wrong))
    (line,) = examined(convert_table(tmp_path / "log.csv", tmp_path / "out", tmp_path / "map.yaml")).lines()
    assert "1000 times too large (mm for m), and the log's y axis is up (map lines 5 and 8: object.position" in line


def test_what_says_more_for_no_better_fit_is_left_out(eraser: Recording) -> None:
    both = [
        Convention(says=says, remedy="", recording=eraser) for says in ("a", "b is so", "a, and b", "a, and c", "ab")
    ]
    assert [one.says for one in _simplest(both)] == ["a", "b is so", "ab"]


def test_a_right_map_leaves_nothing_to_say(eraser: Recording, tmp_path: Path) -> None:
    said = {"world": UP, "order": "xyzw", "offset": OFFSET, "unit": "mm", "hand_unit": "cm"}
    said["hand_world"] = "{origin: [1, 2, 3], yaw_deg: -50}"
    foreign.by_map(eraser, tmp_path / "log.csv", foreign.map_of(eraser, **said))
    (tmp_path / "map.yaml").write_text(foreign.map_of(eraser, **said))
    finding = examined(convert_table(tmp_path / "log.csv", tmp_path / "out", tmp_path / "map.yaml"))
    assert finding.before is not None and finding.before < 1.5 and finding.lines() == []
