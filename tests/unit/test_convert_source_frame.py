"""The way back from W to the frame of the log, and where in its map somebody has to look."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import foreign
import numpy as np
import pytest

from physid_drake.convert import convert_table
from physid_drake.convert.map_reading import stated_in
from physid_drake.convert.source_frame import SourceFrame, source_frame
from physid_drake.recording import Conversion, Recording, read_recording, write_recording

OFFSET = "{translation: [10, -20, -50], unit: mm, yaw_deg: 40}"
POSE = "{pose: {translation: [0.1, -0.2, 1.1], rotation_wxyz: [0.1, 0.9, 0.4, 0.141421356]}}"
MAPS = {
    "plain": {},
    "origin and yaw": {"world": "{origin: [0.4, -0.3, 0.75], yaw_deg: 30}", "unit": "mm", "offset": OFFSET},
    "y up": {"world": "{axes: [z, x, y], origin: [0.4, 0.75, -0.3]}", "order": "xyzw", "offset": OFFSET},
    "left-handed": {"world": "{axes: [x, z, y], left_handed: true, origin: [0, 1, 0]}", "hand_unit": "inch"},
    "a camera": {"world": POSE, "offset": OFFSET},
    "a robot beside it": {"world": POSE, "hand_world": "{origin: [1, 2, 3], axes: [y, z, x]}", "offset": OFFSET},
    "inverse": {
        "world": "{axes: [z, x, y], yaw_deg: -20}", "offset": OFFSET,
        "rotation": "{columns: [q0, q1, q2, q3], as: wxyz, inverse: true}",
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def eraser() -> Recording:
    return read_recording("eraser_reference").subset([0, 5])


def converted(recording: Recording, folder: Path, said: dict[str, str]) -> Recording:
    text = foreign.map_of(recording, **said)
    foreign.by_map(recording, folder / "log.csv", text)
    (folder / "map.yaml").write_text(text)
    return convert_table(folder / "log.csv", folder / "out", folder / "map.yaml")


@pytest.mark.parametrize("name", MAPS)
def test_there_and_back(name: str, eraser: Recording, tmp_path: Path) -> None:
    found = converted(eraser, tmp_path, MAPS[name])
    stated = stated_in(found.conversion)
    assert stated is not None
    for push, other in zip(eraser.pushes, found.pushes, strict=True):
        assert other.object.positions == pytest.approx(push.object.positions, abs=1e-9)
        assert np.abs((other.object.quaternions * push.object.quaternions).sum(axis=1)) == pytest.approx(1.0)
        frame = source_frame(stated, stated.object)
        for again in (
            frame.with_places(other.object, frame.places(other.object)),
            frame.with_rotations(other.object, frame.rotations(other.object)),
        ):
            assert again.positions == pytest.approx(other.object.positions, abs=1e-12)
            assert np.abs((again.quaternions * other.object.quaternions).sum(axis=1)) == pytest.approx(1.0)


def test_without_a_map_the_log_is_in_w(eraser: Recording) -> None:
    stream, frame = eraser.pushes[0].object, source_frame(None, None)
    assert frame.places(stream) == pytest.approx(stream.positions)
    written = np.roll(frame.rotations(stream).as_quat(), 1, axis=1)
    assert np.abs((written * stream.quaternions).sum(axis=1)) == pytest.approx(1.0)


def test_a_height_that_nobody_measured_stays(eraser: Recording) -> None:
    stream = replace(eraser.pushes[0].object, rotation="none")
    other = SourceFrame(height=0.02).with_places(stream, 2.0 * stream.positions)
    assert (other.positions[:, 2] == 0.02).all()
    assert other.positions[:, :2] == pytest.approx(2.0 * stream.positions[:, :2])


def test_the_lines_of_a_map(eraser: Recording, tmp_path: Path) -> None:
    found = converted(eraser, tmp_path, {"offset": OFFSET})
    stated = stated_in(found.conversion)
    assert stated is not None
    lines = (tmp_path / "map.yaml").read_text().splitlines()
    assert lines[5].startswith("  rotation:") and stated.place("object.rotation") == "map line 6: object.rotation"
    both = stated.place("object.position", "hand.position")
    assert both == "map lines 5 and 9: object.position and hand.position"
    assert stated.place("world") == "map: world"
    assert stated.place("hand.height_m") == "map line 8: hand.height_m"
    assert stated.place("a", "b", "c") == "map: a, b and c"


def test_a_map_that_cannot_be_read_is_none(eraser: Recording, tmp_path: Path) -> None:
    for text in ("", "{", "format: physid-map/9", "format: physid-map/1\nobject: 3"):
        conversion = Conversion(source="log", source_sha256="0", map=text, map_sha256="0")
        assert stated_in(conversion) is None
    write_recording(replace(eraser, conversion=conversion), tmp_path / "out")
    assert stated_in(read_recording(tmp_path / "out").conversion) is None
    assert stated_in(None) is None
