"""The data doctor where some of the pushes are none, streams are exchanged, or a yaw has another unit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import foreign
import numpy as np
import pytest

from physid_drake.convert import convert_table
from physid_drake.doctor import examined
from physid_drake.doctor.conventions import conventions_of
from physid_drake.doctor.gaps import NEAR, elsewhere, gaps_of, reading_by_most
from physid_drake.doctor.rough_fit import left_by
from physid_drake.recording import Push, Recording, planar_poses, read_recording


@pytest.fixture(scope="module")
def eraser() -> Recording:
    return read_recording("eraser_reference")


def each(recording: Recording, change) -> Recording:
    return replace(recording, pushes=tuple(map(change, recording.pushes)))


def carried(push: Push) -> Push:
    """The object goes back to where it was, at a height that nobody measured, and the hand waits beside it."""
    assert push.hand is not None
    stream, ends = push.object, push.object.positions[[-1, 0]]
    share = 0.5 - 0.5 * np.cos(np.pi * np.clip((stream.times - stream.times[0] - 0.4) / 0.6, 0.0, 1.0))
    away = push.hand.positions[-1] + [0.08, 0.08, 0.0]
    return replace(
        push,
        name=push.name.replace("pushes/", "pushes/back_"),
        object=replace(stream, positions=ends[0] + share[:, None] * (ends[1] - ends[0])),
        hand=replace(push.hand, positions=np.tile(away, (len(push.hand), 1))),
    )


def with_carrying(recording: Recording) -> Recording:
    pairs = [(push, carried(push)) for push in recording.pushes]
    return replace(recording, pushes=tuple(one for pair in pairs for one in pair)[:-1])


def in_cm(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, hand=replace(push.hand, positions=100.0 * push.hand.positions))


def dragged(push: Push) -> Push:
    """The tip is at it, but it turns the other way."""
    stream, planar = push.object, push.object.planar.copy()
    planar[:, 2] = planar[0, 2] + 0.2 * (planar[:, 2] - planar[0, 2])
    return replace(push, object=planar_poses(stream.times, planar, 0.015))


def test_the_tip_drives_pushes_and_not_what_is_carried(eraser: Recording) -> None:
    mixed = with_carrying(eraser)
    assert (gaps_of(mixed) < NEAR).tolist() == [k % 2 == 0 for k in range(len(mixed.pushes))]
    wrong = each(mixed, in_cm)
    readings = [wrong, *(one.recording for one in conventions_of(wrong))]
    assert gaps_of(reading_by_most(readings)) == pytest.approx(gaps_of(mixed))
    assert [elsewhere(mixed, push) for push in mixed.pushes] == [k % 2 == 1 for k in range(len(mixed.pushes))]


def test_what_is_struck_and_slides_on_was_pushed() -> None:
    """Half of the time it moves without the tip, but that was there at first."""
    sealed = read_recording("sealed_01")
    assert gaps_of(sealed).max() > NEAR and not any(elsewhere(sealed, push) for push in sealed.pushes)


def test_what_is_carried_does_not_condemn_conventions(eraser: Recording) -> None:
    finding = examined(with_carrying(eraser))
    assert finding.before is not None and finding.before < 2.0 and not finding.better
    (line,) = finding.lines()
    assert line.startswith("in 11 of 23 pushes the object moves while the tip is not at it; were they pushes? ")
    assert all("back_" in name for name in finding.elsewhere) and "sigma" in finding.sentence()


def test_what_is_carried_does_not_condemn_a_yaw(eraser: Recording) -> None:
    """Whole turns that are free in each push would bring the tip to any object: they are, if that spins."""
    mixed = each(with_carrying(eraser), lambda push: replace(push, object=replace(push.object, rotation="yaw")))
    assert not any("yaw is in degrees" in one.says for one in conventions_of(mixed))
    readings = [mixed, *(one.recording for one in conventions_of(mixed))]
    assert reading_by_most(readings) is mixed


@pytest.mark.slow
def test_a_wrong_convention_is_named_beside_what_is_carried(eraser: Recording) -> None:
    finding = examined(each(with_carrying(eraser), in_cm))
    assert [one.says for one in finding.better] == ["the hand's places are 100 times too large (cm for m)"]
    assert finding.after is not None and finding.after < 2.0 and len(finding.elsewhere) == 11


@pytest.mark.slow
def test_one_push_of_many_that_fits_nothing_does_not_condemn_conventions(eraser: Recording) -> None:
    """It is among the four that are fitted, and what most of them say is right."""
    odd = replace(eraser, pushes=(dragged(eraser.pushes[0]), *eraser.pushes[1:]))
    finding = examined(odd)
    assert finding.before is not None and finding.before < 5.0 and finding.lines() == []
    assert finding.odd == (eraser.pushes[0].name,)
    assert f"{eraser.pushes[0].name} fit far worse than the others" in finding.sentence()
    named = examined(each(odd, in_cm))
    assert [one.says for one in named.better] == ["the hand's places are 100 times too large (cm for m)"]


def test_most_pushes_are_more_than_half(eraser: Recording) -> None:
    few = eraser.subset([0, 3, 6, 9])
    left, refused = left_by(replace(few, pushes=(dragged(few.pushes[0]), *few.pushes[1:])))
    assert left is not None and refused == ""
    assert left.of_all > 5.0 > left.of_most and int(np.argmax(left.each)) == 0


def exchanged(push: Push) -> Push:
    assert push.hand is not None
    return replace(push, object=push.hand, hand=push.object)


def test_an_exchange_is_asked_about_where_the_object_moves_first(eraser: Recording) -> None:
    says = "object and hand are exchanged"
    assert not any(one.says == says for one in conventions_of(eraser))
    wrong = each(eraser, exchanged)
    (found,) = [one for one in conventions_of(wrong) if one.says == says]
    assert found.recording == eraser


@pytest.mark.slow
@pytest.mark.parametrize("rotation", ["full", "none"])
def test_exchanged_streams_are_named(eraser: Recording, rotation: str) -> None:
    def unturned(push: Push) -> Push:
        stream = push.object
        level = planar_poses(stream.times, np.column_stack([stream.positions[:, :2], 0.0 * stream.times]), 0.015)
        return push if rotation == "full" else replace(push, object=replace(level, rotation="none"))

    some = eraser if rotation == "full" else each(eraser, unturned)
    finding = examined(each(some, exchanged))
    assert "object and hand are exchanged" in [one.says for one in finding.better], finding.lines()


@pytest.mark.parametrize("world", ["{origin: [0.4, -0.3, 0.75]}", "{axes: [z, x, y], yaw_deg: 30}"])
@pytest.mark.parametrize(("true", "wrong", "says"), [("rad", "deg", "in rad"), ("deg", "rad", "in degrees")])
def test_a_yaw_in_another_unit(
    eraser: Recording, true: str, wrong: str, says: str, world: str, tmp_path: Path
) -> None:
    """Also of headings whose whole turns, by the wrong unit, are not in the recording."""

    def level(push: Push) -> Push:
        return replace(push, object=planar_poses(push.object.times, push.object.planar, 0.015))

    some = each(eraser.subset([0, 5]), level)
    said = {"world": world, "rotation": f"{{columns: [q0], as: yaw, unit: {true}}}"}
    foreign.by_map(some, tmp_path / "log.csv", foreign.map_of(some, **said))
    (tmp_path / "map.yaml").write_text(foreign.map_of(some, **said).replace(f"unit: {true}", f"unit: {wrong}"))
    found = convert_table(tmp_path / "log.csv", tmp_path / "out", tmp_path / "map.yaml")
    assert found.pushes[0].object.rotation == "yaw"
    (one,) = [one for one in conventions_of(found) if one.says == f"the object's yaw is {says}"]
    assert one.remedy == f"map line 6: object.rotation: unit: {true}"
    for push, other in zip(some.pushes, one.recording.pushes, strict=True):
        off = np.degrees(np.remainder(other.object.headings - push.object.headings + 0.5, np.pi) - 0.5)
        # Half a turn, at which the box is the same, is no whole number of turns in rad: the tip hardly tells.
        assert np.abs(off).max() < (1e-3 if true == "rad" else 5.0)
