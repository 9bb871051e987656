"""An object stands on the table and turns about its normal; else the reading by which it would is named."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import foreign
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from physid_drake.convert import convert_table
from physid_drake.errors import RecordingError
from physid_drake.pushes.push_checks import refusals, refuse
from physid_drake.pushes.push_warnings import doubts
from physid_drake.pushes.standing import likelier_reading, mirrored, misread, read_as, standing_of
from physid_drake.recording import Cylinder, PoseStream, Prism, Recording, read_recording

ORIGIN = "origin: [0.4, 0.75, -0.3]"
# True map, what of it is wrong, what is said, and where.
MISREAD = {
    "y up": ({"world": "{axes: [z, x, y]}"}, {"world": ""}, "the log's y axis is up", "map: world: axes: [z, x, y]"),
    "y up, far from zero": (
        {"world": f"{{axes: [z, x, y], {ORIGIN}}}", "order": "xyzw"}, {"world": f"{{{ORIGIN}}}"},
        "the log's y axis is up", "map line 10: world: axes: [z, x, y]",
    ),
    "x up": ({"world": "{axes: [y, z, x]}"}, {"world": ""}, "the log's x axis is up", "axes: [y, z, x]"),
    "y down": ({"world": "{axes: [x, z, -y]}"}, {"world": ""}, "the log's -y axis is up", "axes: [x, z, -y]"),
    "z up, not y": ({}, {"world": "{axes: [z, x, y]}"}, "the log's z axis is up", "world: axes: [x, y, z]"),
    "left-handed": (
        {"world": "{axes: [x, z, y], left_handed: true}"}, {"world": "{axes: [y, x, z], left_handed: true}"},
        "the log's y axis is up", "axes: [x, z, y]",
    ),
    "w last": (
        {"order": "xyzw"}, {"order": "wxyz"},
        "the object's quaternions are x, y, z, w", "map line 6: object.rotation: as: xyzw",
    ),
    "w first": (
        {"order": "wxyz"}, {"order": "xyzw"},
        "the object's quaternions are w, x, y, z", "map line 6: object.rotation: as: wxyz",
    ),
    "Euler angles in reverse": (
        {"rotation": "{columns: [q0, q1, q2], as: euler, order: ZYX, unit: deg}"},
        {"rotation": "{columns: [q0, q1, q2], as: euler, order: XYZ, unit: deg}"},
        "the columns of the object's Euler angles are about z, y, x", "map line 6: object.rotation: order: ZYX",
    ),
    "a pose": (
        {"world": "{axes: [z, x, y], yaw_deg: 90}"}, {"world": "{pose: {translation: [0, 0, 0], yaw_deg: 90}}"},
        "the log's y axis is up", "map line 10: world: instead of pose, axes: [z, x, y]",
    ),
    "no rotation": (
        {"world": "{axes: [z, x, y]}", "rotation": "none"}, {"world": "", "rotation": "none"},
        "the log's y axis is up", "map: world: axes: [z, x, y]",
    ),
}  # fmt: skip


@pytest.fixture(scope="module")
def eraser() -> Recording:
    return read_recording("eraser_reference").subset([0, 3, 6, 9])


def by_wrong_map(recording: Recording, true: dict[str, str], wrong: dict[str, str], folder: Path) -> Recording:
    """A log by one map, converted by another; what is empty is left out."""
    rotation = f"{{columns: [q0, q1, q2, q3], as: {true.get('order', 'wxyz')}}}"
    kept = true["rotation"] if "euler" in true.get("rotation", "") else rotation
    foreign.by_map(recording, folder / "log.csv", foreign.map_of(recording, **true | {"rotation": kept}))
    said = {key: value for key, value in (true | wrong).items() if value}
    (folder / "map.yaml").write_text(foreign.map_of(recording, **said))
    return convert_table(folder / "log.csv", folder / "out", folder / "map.yaml")


def with_turns(recording: Recording, change: Callable[[PoseStream], np.ndarray]) -> Recording:
    pushes = (replace(p, object=replace(p.object, quaternions=change(p.object))) for p in recording.pushes)
    return replace(recording, pushes=tuple(pushes))


@pytest.mark.parametrize("name", ["eraser_reference", "sealed_01"])
def test_what_stands_is_left_alone(name: str) -> None:
    recording = read_recording(name)
    standing = standing_of(recording)
    assert standing.stands.all() and not standing.seldom and not standing.upside_down
    assert standing.off < 1e-3 and likelier_reading(recording) is None and misread(recording) == ""


@pytest.mark.parametrize("case", MISREAD)
@pytest.mark.parametrize("name", ["eraser_reference", "sealed_01"])
def test_what_is_misread_is_named_in_one_line(name: str, case: str, tmp_path: Path) -> None:
    true, wrong, says, remedy = MISREAD[case]
    recording = read_recording(name).subset([0, 3, 6, 9])
    found = by_wrong_map(recording, true, wrong, tmp_path)
    line = misread(found)
    assert says in line and remedy in line and "\n" not in line
    reading = likelier_reading(found)
    assert reading is not None
    right = read_as(found, reading)
    for push, other in zip(recording.pushes, right.pushes, strict=True):
        # Where the axes lie in the plane is another matter: the map does not say it.
        way, same = (np.linalg.norm(p.object.positions - p.object.positions[0], axis=1) for p in (push, other))
        assert same == pytest.approx(way, abs=1e-9)
        assert other.object.positions[:, 2] == pytest.approx(push.object.positions[:, 2], abs=0.5)
    assert standing_of(right).stands.all()
    # It is refused by this line alone, or doubted by it, where it is not seen to tip.
    if standing_of(found).tipped:
        assert refusals(found) == (f"recording 'log': {line}.",) and doubts(found) == ()
        with pytest.raises(RecordingError, match=r"is up|quaternions are|angles are about"):
            refuse(found)
    else:
        assert doubts(found) == (line,)


def test_both_at_once(eraser: Recording, tmp_path: Path) -> None:
    """Of a prism, which does not stand on its head."""
    corners = ((0.06, 0.025), (-0.06, 0.025), (-0.06, -0.025), (0.06, -0.025))
    prism = replace(eraser, object=replace(eraser.object, shape=Prism(polygon=corners, height=0.03)))
    true = {"world": "{axes: [z, x, y]}", "order": "xyzw"}
    found = by_wrong_map(eraser, true, {"world": "", "order": "wxyz"}, tmp_path)
    line = misread(replace(found, object=prism.object))
    assert "the log's y axis is up, and the object's quaternions are x, y, z, w" in line
    assert "(map: world: axes: [z, x, y]; map line 6: object.rotation: as: xyzw)" in line


def test_without_a_map_it_is_the_recordings_axes(eraser: Recording) -> None:
    def fallen(push):
        return replace(push, object=replace(push.object, positions=push.object.positions[:, [0, 2, 1]] * [1, 1, -1]))

    bare = with_turns(eraser, lambda stream: stream.quaternions[:, [0, 1, 3, 2]] * [1, 1, 1, -1])
    line = misread(replace(bare, pushes=tuple(map(fallen, bare.pushes))))
    assert "the recording's y axis is up (map: world: axes: [z, x, y])" in line


def test_axes_of_the_other_hand(eraser: Recording, tmp_path: Path) -> None:
    found = by_wrong_map(eraser, *MISREAD["y up"][:2], tmp_path)
    reading = likelier_reading(found)
    assert reading is not None
    other = mirrored(reading)
    assert other is not None and np.linalg.det(other.axes) < 0.0
    assert other.says.endswith("y axis is up, and its axes are left-handed")
    assert other.remedy == "map: world: axes: [x, z, y], left_handed: true"
    assert standing_of(read_as(found, other)).stands.all()


def test_an_object_on_its_head_is_asked_about_unless_it_turns(eraser: Recording) -> None:
    """A box looks the same; one that turns shows which way is up."""
    head = Rotation.from_euler("x", np.pi)

    def over(yaws: np.ndarray) -> np.ndarray:
        return np.roll((Rotation.from_rotvec(np.outer(yaws, [0.0, 0.0, 1.0])) * head).as_quat(), 1, axis=1)

    turning = with_turns(eraser, lambda stream: over(stream.planar[:, 2]))
    assert standing_of(turning).upside_down and misread(turning) == "" and doubts(turning) == ()
    still = with_turns(eraser, lambda stream: over(1e-3 * stream.planar[:, 2]))
    line = misread(still)
    assert line.startswith("the object stands on its head; it stands on its feet if the object's")
    assert "quaternions are w, x, y, z (map: object.rotation: as: wxyz)" in line
    assert not any("head" in one for one in refusals(still))


def test_a_log_whose_y_is_up_puts_an_object_on_its_head_by_the_other_order(eraser: Recording, tmp_path: Path) -> None:
    """There it turns about the vertical by either order, as far as it really does."""
    world = "{axes: [z, x, y]}"
    found = by_wrong_map(eraser, {"world": world, "order": "xyzw"}, {"order": "wxyz"}, tmp_path)
    standing = standing_of(found)
    assert standing.stands.all() and standing.upside_down
    assert max(float(np.ptp(push.object.planar[:, 2])) for push in found.pushes) > 0.5
    line = "the object stands on its head; it stands on its feet if the object's quaternions are x, y, z, w"
    assert doubts(found) == (f"{line} (map line 6: object.rotation: as: xyzw)",) and refusals(found) == ()


def test_one_that_tips_over_in_a_push_is_no_other_reading(eraser: Recording) -> None:
    def tip(push):
        half = 0.5 * np.linspace(0.0, np.pi / 2, len(push.object))
        turns = np.column_stack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half])
        return replace(push, object=replace(push.object, quaternions=turns))

    one = replace(eraser, pushes=(tip(eraser.pushes[0]), *eraser.pushes[1:]))
    assert misread(one) == "" and any("tips by 90 degrees" in said for said in refusals(one))
    # Nor where none of the others turns.
    still = with_turns(eraser, lambda stream: np.tile([1.0, 0.0, 0.0, 0.0], (len(stream), 1)))
    one = replace(still, pushes=(tip(still.pushes[0]), *still.pushes[1:]))
    assert misread(one) == ""


def test_one_that_is_carried_is_no_other_reading(eraser: Recording) -> None:
    def carried(push):
        up = 0.3 * np.clip(push.object.times - push.object.times[-1] + 0.2, 0.0, None)
        return replace(
            push, object=replace(push.object, positions=push.object.positions + np.outer(up, [0.0, 0.0, 1.0]))
        )

    one = replace(eraser, pushes=(carried(eraser.pushes[0]), *eraser.pushes[1:]))
    assert misread(one) == "" and any("height changes" in said for said in doubts(one))


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", ["take.csv", "trial1.trc"])
def test_objects_that_were_carried_back_do_not_hide_an_axis(name: str, tmp_path: Path) -> None:
    """By the wrong axis they are not seen to be lifted, and stay: ten of twenty-one pieces."""
    text = foreign.TABLES[name].write(read_recording("sealed_01"), tmp_path / name)
    assert "world: {axes: [z, x, y]}" in text
    (tmp_path / "map.yaml").write_text(text.replace("world: {axes: [z, x, y]}\n", ""))
    found = convert_table(tmp_path / name, tmp_path / "out", tmp_path / "map.yaml")
    assert len(found.pushes) == 21 and not standing_of(found).stands[1::2].all()
    assert "the log's y axis is up (map: world: axes: [z, x, y])" in misread(found)


def test_carrying_along_the_one_axis_of_all_pushes_is_no_other_axis(eraser: Recording) -> None:
    """Of an object without rotation: from the side, what goes up and along moves in a plane, too."""

    def along(push, up):
        stream = push.object
        way = np.linalg.norm(stream.positions - stream.positions[0], axis=1)
        height = 0.015 + up * np.sin(np.pi * np.linspace(0.0, 1.0, len(way)))
        places = np.column_stack([way, 0.0 * way, height])
        return replace(push, object=replace(stream, positions=places, rotation="none"))

    ups = [0.1, 0.0, 0.1, 0.0]
    line = replace(eraser, pushes=tuple(along(p, up) for p, up in zip(eraser.pushes, ups, strict=True)))
    assert standing_of(line).seldom and misread(line) == ""


def test_a_lying_cylinder_rolls(eraser: Recording) -> None:
    lying = replace(eraser.object, shape=Cylinder(radius=0.015, length=0.1, axis="y"))

    def rolling(stream: PoseStream) -> np.ndarray:
        angles = np.linspace(0.0, 6.0, len(stream))
        return np.roll(Rotation.from_rotvec(np.outer(angles, [0.0, 1.0, 0.0])).as_quat(), 1, axis=1)

    rolled = with_turns(eraser, rolling)
    assert misread(replace(rolled, object=lying)) == ""
