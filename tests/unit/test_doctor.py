"""The data doctor: conventions that are wrong are told by the pushes, and right ones are left alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from physid_drake.doctor import examined
from physid_drake.doctor.conventions import conventions_of, gap_of, pairs_of
from physid_drake.doctor.forces import conventions_of_forces
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


WRONG = {
    "xyzw": (xyzw, "the object's quaternions are x, y, z, w"),
    "inverted": (inverted, "the object's rotations turn the other way"),
    "mirrored hand": (mirrored_hand, "of the hand, y is mirrored"),
    "late": (late, "the hand's times are 100 ms too late"),
    "shifted": (shifted, "the hand's frame is off by (-7.8, 4.9) mm"),
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
            assert other.object.quaternions == pytest.approx(push.object.quaternions, abs=1e-9)
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
