"""Logs whose streams lie apart: in files of their own, in one table row after row, or at another rate."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from foreign.common import DESCRIPTION, EPOCH, HAND, at, rotations, take
from physid_drake.recording import Recording

POSE = [f"field.pose.position.{axis}" for axis in "xyz"] + [f"field.pose.orientation.{axis}" for axis in "xyzw"]


def rostopic(recording: Recording, folder: Path) -> str:
    """One file for each topic of a take, as `rostopic echo -p` prints it: stamps in ns since 1970."""
    times, body, hand = take(recording)
    folder.mkdir()
    for name, stream, late in (("mug_pose.csv", body, 0.0), ("tip_pose.csv", hand, 0.002)):
        values = np.column_stack([stream.positions, rotations(stream).as_quat()])
        rows = (
            [f"{(time + EPOCH + late + 0.01) * 1e9:.0f}", k, f"{(time + EPOCH + late) * 1e9:.0f}", "world",
             *(f"{v:.7f}" for v in row)]
            for k, (time, row) in enumerate(zip(times, values, strict=True))
        )  # fmt: skip
        _table(
            folder / name, ["%time", "field.header.seq", "field.header.stamp", "field.header.frame_id", *POSE], rows
        )
    named = "position: {{columns: [{}]}}\n  rotation: {{columns: [{}], as: xyzw}}".format(
        ", ".join(POSE[:3]), ", ".join(POSE[3:])
    )
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
time: {{column: field.header.stamp, unit: ns}}
object:
  file: mug_pose.csv
  {named}
hand:
  file: tip_pose.csv
  {named}
pushes: {{cut: rest}}
"""
    )


def trials(recording: Recording, folder: Path) -> str:
    """Two files for each push, of tracker and robot, beside notes that are no stream."""
    folder.mkdir()
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        for name, stream in ((f"{k:02d}_mug.csv", push.object), (f"{k:02d}_robot.csv", push.hand)):
            values = np.column_stack([stream.times, stream.positions, stream.planar[:, 2]])
            _table(folder / name, ["t", "x", "y", "z", "yaw"], ([f"{v:.7g}" for v in row] for row in values))
    (folder / "notes.csv").write_text("temperature,humidity\n21,40\n22,41\n", encoding="utf-8")
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: t}
object: {file: "*_mug.csv", position: {columns: [x, y, z]}, rotation: {columns: yaw, as: yaw, unit: rad}}
hand: {file: "*_robot.csv", position: {columns: [x, y, z]}, rotation: none}
"""
    )


def detections(recording: Recording, file: Path) -> str:
    """One row for each marker in each image, with its number; now and then, one is not seen."""
    times, body, hand = take(recording, rate=100.0)
    rng = np.random.default_rng(0)
    rows = []
    for k, time in enumerate(times):
        for number, stream in ((3, body), (7, hand)):
            if rng.random() > 0.05:
                turn = rotations(stream)[k].as_rotvec()
                numbers = [*stream.positions[k], *turn]
                rows.append([f"{(time + EPOCH) * 1e9:.0f}", number, *(f"{v:.7f}" for v in numbers)])
    _table(file, ["t_ns", "marker_id", "tvec_x", "tvec_y", "tvec_z", "rvec_x", "rvec_y", "rvec_z"], rows)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: t_ns, unit: ns}
object:
  where: {marker_id: 3}
  position: {columns: [tvec_x, tvec_y, tvec_z]}
  rotation: {columns: [rvec_x, rvec_y, rvec_z], as: rotation_vector, unit: rad}
hand: {where: {marker_id: 7}, position: {columns: [tvec_x, tvec_y, tvec_z]}, rotation: none}
pushes: {cut: rest}
"""
    )


def control(recording: Recording, file: Path) -> str:
    """A robot's log at 500 Hz, with seconds and nanoseconds, which holds each pose of a tracker at 100 Hz."""
    slow, body, hand = take(recording, rate=100.0)
    times = np.arange(slow[0], slow[-1], 0.002)
    held = np.searchsorted(slow, times + 1e-9, side="right") - 1
    tip = at(times, hand.times, hand.positions)
    whole = np.floor(times + EPOCH)
    values = np.column_stack([body.positions[held], body.planar[held, 2], tip])
    rows = (
        [f"{second:.0f}", f"{1e9 * (time + EPOCH - second):.0f}", *(f"{v:.7f}" for v in row)]
        for time, second, row in zip(times, whole, values, strict=True)
    )
    _table(file, ["sec", "nanosec", "mug_x", "mug_y", "mug_z", "mug_yaw", "tip_x", "tip_y", "tip_z"], rows)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {columns: [sec, nanosec]}
object: {position: {columns: [mug_x, mug_y, mug_z]}, rotation: {columns: mug_yaw, as: yaw, unit: rad}}
hand: {position: {columns: [tip_x, tip_y, tip_z]}, rotation: none}
pushes: {cut: rest}
"""
    )


def frames(recording: Recording, folder: Path) -> str:
    """A file of 6D poses for each push, a row for each frame and no times; markers in a table below."""
    folder.mkdir()
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        times = np.arange(push.object.times[0], push.object.times[-1], 0.005)
        both = [at(times, stream.times, stream.positions) for stream in (push.object, push.hand)]
        yaw = np.degrees(np.interp(times, push.object.times, push.object.planar[:, 2]))
        upper = [["Segments"], ["mug X", "mug Y", "mug Z", "mug heading"]]
        upper += [[f"{v:.5f}" for v in row] for row in np.column_stack([1e3 * both[0], yaw])]
        lower = [
            [],
            ["Trajectories"],
            ["tip X", "tip Y", "tip Z"],
            *[[f"{v:.5f}" for v in row] for row in 1e3 * both[1]],
        ]
        _table(folder / f"push{k:04d}.csv", upper[0], [*upper[1:], *lower])
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {rate_hz: 200}
object:
  position: {columns: [mug X, mug Y, mug Z], unit: mm}
  rotation: {columns: mug heading, as: yaw, unit: deg}
hand: {section: 2, position: {columns: [tip X, tip Y, tip Z], unit: mm}, rotation: none}
"""
    )


def _table(file: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows([header, *rows])
