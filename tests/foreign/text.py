"""Tables of text: motion capture, spreadsheets, game engines, rulers, videos, robots' own logs."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from foreign.common import DESCRIPTION, HAND, at, rotations, take
from physid_drake.recording import Recording

AXES_Y_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The recording's x, y, z are z, x, y of Motive's world, whose y is up."""
LEFT_HANDED = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""The recording's x, y, z are x, z, y of Unity's world, which is left-handed with y up."""


def motive(recording: Recording, file: Path) -> str:
    """A take of Motive: a preamble, five header lines, a byte-order mark, y up, quaternions x, y, z, w; its map."""
    times, body, hand = take(recording)
    rows = [
        ["Format Version", "1.23", "Take Name", "Take 2026-03-01", "Capture Frame Rate", "120.000000",
         "Length Units", "Meters", "Coordinate Space", "Global"],
        [],
        ["", "Type", *["Rigid Body"] * 16],
        ["", "Name", *["Mug"] * 8, *["Tip"] * 8],
        ["", "ID", *["9AC01F"] * 8, *["9AC020"] * 8],
        ["", "", *([*["Rotation"] * 4, *["Position"] * 3, "Mean Marker Error"] * 2)],
        ["Frame", "Time (Seconds)", *(["X", "Y", "Z", "W", "X", "Y", "Z", ""] * 2)],
    ]  # fmt: skip
    columns = []
    for stream in (body, hand):
        turned = Rotation.from_matrix(AXES_Y_UP.T @ rotations(stream).as_matrix() @ AXES_Y_UP)
        columns += [turned.as_quat(), stream.positions @ AXES_Y_UP, np.full((len(times), 1), 1e-4)]
    values = np.column_stack([times, *columns])
    for k, row in enumerate(values):
        lost = k % 97 == 5
        rows.append([str(k), f"{row[0]:.6f}", *(["" for _ in row[1:]] if lost else [f"{v:.6f}" for v in row[1:]])])
    with file.open("w", encoding="utf-8-sig", newline="") as stream:
        csv.writer(stream).writerows(rows)
    mug, tip = "Rigid Body/Mug/9AC01F", "Rigid Body/Tip/9AC020"
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
world: {{axes: [z, x, y]}}
time: {{column: Time (Seconds)}}
object:
  position: {{columns: [{mug}/Position/X, {mug}/Position/Y, {mug}/Position/Z]}}
  rotation: {{columns: [{mug}/Rotation/X, {mug}/Rotation/Y, {mug}/Rotation/Z, {mug}/Rotation/W], as: xyzw}}
hand:
  position: {{columns: [{tip}/Position/X, {tip}/Position/Y, {tip}/Position/Z]}}
  rotation: none
pushes: {{cut: rest}}
"""
    )


def vicon(recording: Recording, file: Path) -> str:
    """Vicon's table of objects: names over each body's first column, units below, mm and rotation vectors."""
    _, body, hand = take(recording, rate=100.0)
    rows = [["Objects"], ["100"], ["", "", "Mug:Mug", *[""] * 5, "Tip:Tip", *[""] * 5],
            ["Frame", "Sub Frame", *(["RX", "RY", "RZ", "TX", "TY", "TZ"] * 2)],
            ["", "", *(["rad"] * 3 + ["mm"] * 3) * 2]]  # fmt: skip
    values = np.column_stack(
        [rotations(body).as_rotvec(), 1e3 * body.positions, rotations(hand).as_rotvec(), 1e3 * hand.positions]
    )
    rows += [[str(k + 1), "0", *[f"{v:.7g}" for v in row]] for k, row in enumerate(values)]
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(rows)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: Frame, rate_hz: 100}
object:
  position: {columns: [Mug:Mug/TX, Mug:Mug/TY, Mug:Mug/TZ]}
  rotation: {columns: [Mug:Mug/RX, Mug:Mug/RY, Mug:Mug/RZ], as: rotation_vector}
hand:
  position: {columns: [Tip:Tip/TX, Tip:Tip/TY, Tip:Tip/TZ]}
  rotation: none
pushes: {cut: rest}
"""
    )


def german(recording: Recording, file: Path) -> str:
    """A spreadsheet's table: semicolons, decimal commas, ms, cm, Euler angles in degrees, a column of the push."""
    names = ["t [ms]", "Versuch", "x", "y", "z", "roll", "pitch", "yaw", "tool x", "tool y", "tool z"]
    rows = [names]
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        hand = at(push.object.times, push.hand.times, push.hand.positions)
        angles = rotations(push.object).as_euler("ZYX", degrees=True)[:, ::-1]
        values = np.column_stack([100.0 * push.object.positions, angles, 100.0 * hand])
        for time, row in zip(1e3 * push.object.times, values, strict=True):
            rows.append([f"{v:.6g}".replace(".", ",") for v in (time, k + 1, *row)])
    with file.open("w", encoding="latin-1", newline="") as stream:
        csv.writer(stream, delimiter=";").writerows(rows)
    return (
        DESCRIPTION.format(name="Becher")
        + HAND
        + """\
time: {column: "t [ms]", unit: ms}
object:
  position: {columns: [x, y, z], unit: cm}
  rotation: {columns: [yaw, pitch, roll], as: euler, order: ZYX, unit: deg}
hand:
  position: {columns: [tool x, tool y, tool z], unit: cm}
  rotation: none
pushes: {cut: column, column: Versuch}
"""
    )


def unity(recording: Recording, folder: Path) -> str:
    """A folder with a file for each push, by a game engine: left-handed, y up, quaternions x, y, z, w, no header."""
    folder.mkdir()
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        turned = Rotation.from_matrix(LEFT_HANDED.T @ rotations(push.object).as_matrix() @ LEFT_HANDED)
        hand = at(push.object.times, push.hand.times, push.hand.positions)
        table = np.array([0.0, 0.0, 0.74])
        places = (push.object.positions + table) @ LEFT_HANDED, (hand + table) @ LEFT_HANDED
        values = np.column_stack([push.object.times, places[0], turned.as_quat(), places[1]])
        np.savetxt(folder / f"push_{k:02d}.txt", values, fmt="%.8f")
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
world: {axes: [x, z, y], left_handed: true, origin: [0, 0.74, 0]}
time: {column: column 1}
object:
  position: {columns: [column 2, column 3, column 4]}
  rotation: {columns: [column 5, column 6, column 7, column 8], as: xyzw}
hand:
  position: {columns: [column 9, column 10, column 11]}
  rotation: none
pushes: {cut: whole}
"""
    )


def rulers(recording: Recording, file: Path) -> str:
    """A row for each push, as somebody wrote it down: end poses in mm and degrees, the hand's ends and speed."""
    rows = [["No", "x0", "y0", "phi0", "x1", "y1", "phi1", "hx0", "hy0", "hx1", "hy1", "v"]]
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        first, last = push.object.planar[0], push.object.planar[-1]
        hand, times = push.hand.positions, push.hand.times
        speed = np.linalg.norm(np.diff(hand[:, :2], axis=0), axis=1) / np.diff(times)
        values = [*1e3 * first[:2], np.rad2deg(first[2]), *1e3 * last[:2], np.rad2deg(last[2])]
        values += [*1e3 * hand[0, :2], *1e3 * hand[-1, :2], 1e3 * np.quantile(speed, 0.9)]
        rows.append([str(k + 1), *[f"{v:.2f}" for v in values]])
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(rows)
    return (
        DESCRIPTION.format(name="mug")
        + HAND.replace("measured", "commanded")
        + """\
object:
  start: {position: {columns: [x0, y0], unit: mm}, rotation: {columns: phi0, as: yaw, unit: deg}, height_m: 0.023}
  end: {position: {columns: [x1, y1], unit: mm}, rotation: {columns: phi1, as: yaw, unit: deg}, height_m: 0.023}
hand:
  start: {position: {columns: [hx0, hy0], unit: mm}, rotation: none, height_m: 0.023}
  end: {position: {columns: [hx1, hy1], unit: mm}, rotation: none, height_m: 0.023}
  speed: {columns: v, unit: mm/s}
pushes: {cut: rows}
"""
    )


def video(recording: Recording, folder: Path) -> str:
    """A folder of tracks from a video: pixels' places in cm at 30 Hz, no rotation, beside a robot's log in seconds.

    The camera's clock is 12.5 s ahead of the robot's.
    """
    folder.mkdir()
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        frames = np.arange(push.start_time, push.end_time, 1.0 / 30.0)
        places = 100.0 * at(frames, push.object.times, push.object.positions[:, :2])
        robot = push.hand.times
        stamps = np.full((max(len(frames), len(robot)), 6), np.nan)
        stamps[: len(frames), 0], stamps[: len(frames), 1:3] = frames + 12.5, places
        stamps[: len(robot), 3], stamps[: len(robot), 4:6] = robot, push.hand.positions[:, :2]
        rows = [["video s", "cx", "cy", "robot s", "tcp_x", "tcp_y"]]
        rows += [["" if np.isnan(v) else f"{v:.6f}" for v in row] for row in stamps]
        with (folder / f"{k:02d}.csv").open("w", encoding="utf-8", newline="") as stream:
            csv.writer(stream, delimiter="\t").writerows(rows)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
object:
  time: {column: video s, offset_s: -12.5}
  position: {columns: [cx, cy], unit: cm}
  rotation: none
  height_m: 0.023
hand:
  time: {column: robot s}
  position: {columns: [tcp_x, tcp_y]}
  rotation: none
  height_m: 0.023
"""
    )


def motive_euler(recording: Recording, file: Path) -> str:
    """Motive in mm and degrees, with the markers of the body beside it; somebody wrote down the pushes' times."""
    times, body, hand = take(recording, rate=100.0)
    rows = [
        ["Format Version", "1.21", "Take Name", "Take 7", "Capture Frame Rate", "100.000000", "Rotation Type", "XYZ",
         "Length Units", "Millimeters", "Coordinate Space", "Global"],
        [],
        ["", "Type", *["Rigid Body"] * 6, *["Rigid Body Marker"] * 3, *["Marker"] * 3],
        ["", "Name", *["Mug"] * 6, *["Mug:Marker1"] * 3, *["Unlabeled 17"] * 3],
        ["", "ID", *["1"] * 6, *["0"] * 3, *["0"] * 3],
        ["", "", *["Rotation"] * 3, *["Position"] * 3, *["Position"] * 6],
        ["Frame", "Time (Seconds)", *["X", "Y", "Z"] * 4],
    ]  # fmt: skip
    turned = Rotation.from_matrix(AXES_Y_UP.T @ rotations(body).as_matrix() @ AXES_Y_UP)
    place = 1e3 * body.positions @ AXES_Y_UP
    values = np.column_stack(
        [
            times,
            turned.as_euler("XYZ", degrees=True),
            place,
            place + np.array([0.0, 23.0, 0.0]),
            1e3 * hand.positions @ AXES_Y_UP,
        ]
    )
    rows += [[str(k), *[f"{v:.5f}" for v in row]] for k, row in enumerate(values)]
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream).writerows(rows)
    mug, tip = "Rigid Body/Mug/1", "Marker/Unlabeled 17/0"
    spans, begin = [], 0.0
    for push in recording.pushes:
        spans.append([round(begin + 0.2, 3), round(begin + 1.6 + push.end_time - push.start_time, 3)])
        begin += 2.6 + np.arange(push.start_time, push.end_time, 0.01).size / 100.0
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
world: {{axes: [z, x, y]}}
time: {{column: Time (Seconds)}}
object:
  position: {{columns: [{mug}/Position/X, {mug}/Position/Y, {mug}/Position/Z]}}
  rotation: {{columns: [{mug}/Rotation/X, {mug}/Rotation/Y, {mug}/Rotation/Z], as: euler, order: XYZ, unit: deg}}
hand:
  position: {{columns: [{tip}/Position/X, {tip}/Position/Y, {tip}/Position/Z]}}
  rotation: none
pushes: {{cut: times, times_s: {spans}}}
"""
    )


def qualisys(recording: Recording, file: Path) -> str:
    """Qualisys' table of bodies: tabs, a preamble of keys, mm, rotation matrices column by column."""
    times, body, hand = take(recording, rate=100.0)
    axes = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *[f"Rot[{k}]" for k in range(9)]]
    rows = [["NO_OF_FRAMES", str(len(times))], ["NO_OF_CAMERAS", "8"], ["FREQUENCY", "100"], ["TIME_STAMP", "x"],
            ["DATA_INCLUDED", "6D"], ["BODY_NAMES", "mug", "tip"],
            ["Frame", "Time", *[f"{name} {axis}" for name in ("mug", "tip") for axis in axes]]]  # fmt: skip
    columns = []
    for stream in (body, hand):
        matrices = rotations(stream).as_matrix().transpose(0, 2, 1).reshape(-1, 9)
        angles = rotations(stream).as_euler("xyz", degrees=True)
        columns += [1e3 * stream.positions, angles, np.full((len(times), 1), 0.3), matrices]
    for k, row in enumerate(np.column_stack([times, *columns])):
        rows.append([str(k + 1), *[f"{v:.6f}" for v in row]])
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, delimiter="\t").writerows(rows)
    turned = [f"mug Rot[{k}]" for k in (0, 3, 6, 1, 4, 7, 2, 5, 8)]
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
time: {{column: Time}}
object:
  position: {{columns: [mug X, mug Y, mug Z], unit: mm}}
  rotation: {{columns: {turned}, as: matrix}}
hand:
  position: {{columns: [tip X, tip Y, tip Z], unit: mm}}
  rotation: none
pushes: {{cut: rest}}
"""
    )


def markers(recording: Recording, file: Path) -> str:
    """A TRC file: one marker on the object's top, one on the tip, mm, y up; nothing turns."""
    times, body, hand = take(recording, rate=100.0)
    rows = [["PathFileType", "4", "(X/Y/Z)", "trial1.trc"],
            ["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate"],
            ["100.00", "100.00", str(len(times)), "2", "mm", "100.00"],
            ["Frame#", "Time", "MugTop", "", "", "Tip", "", ""],
            ["", "", "X1", "Y1", "Z1", "X2", "Y2", "Z2"],
            []]  # fmt: skip
    values = np.column_stack(
        [times, 1e3 * (body.positions + np.array([0.0, 0.0, 0.03])) @ AXES_Y_UP, 1e3 * hand.positions @ AXES_Y_UP]
    )
    rows += [[str(k + 1), *[f"{v:.5f}" for v in row]] for k, row in enumerate(values)]
    with file.open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, delimiter="\t").writerows(rows)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
world: {axes: [z, x, y]}
time: {column: Time}
object:
  position: {columns: [X1, Y1, Z1], unit: mm}
  rotation: none
  offset: {translation: [0, 0, -0.03]}
hand:
  position: {columns: [X2, Y2, Z2], unit: mm}
  rotation: none
pushes: {cut: rest}
"""
    )


BASE = np.array([0.6, -0.1, -0.05])
"""p_WR of a robot's base, which is turned by half a turn."""
STICK = 0.12
"""m from the flange to the tip, along the flange's z, which points down."""


def rtde(recording: Recording, file: Path) -> str:
    """A Universal Robot's own log beside a tracker's columns: spaces, base frame, flange poses, force of the hand."""
    turn = Rotation.from_euler("z", np.pi)
    down = Rotation.from_rotvec([np.pi, 0.0, 0.0])
    names = ["timestamp", *[f"actual_TCP_pose_{k}" for k in range(6)], *[f"actual_TCP_force_{k}" for k in range(6)],
             "ox", "oy", "oz", "o_yaw", "run"]  # fmt: skip
    lines = [" ".join(names)]
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        times = push.object.times
        tip = turn.inv().apply(at(times, push.hand.times, push.hand.positions) - BASE)
        flange = tip + np.array([0.0, 0.0, STICK])
        force = np.tile([0.3, -0.4, 0.0, 0.0, 0.0, 0.0], (len(times), 1))
        object_place = turn.inv().apply(push.object.positions - BASE)
        yaw = push.object.planar[:, 2] - np.pi
        rotation = np.tile(down.as_rotvec(), (len(times), 1))
        values = np.column_stack(
            [1e4 + 50.0 * k + times, flange, rotation, force, object_place, yaw, np.full(len(times), k)]
        )
        lines += [" ".join(f"{v:.7g}" if j else f"{v:.4f}" for j, v in enumerate(row)) for row in values]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
world: {{pose: {{translation: {BASE.tolist()}, yaw_deg: 180}}}}
time: {{column: timestamp}}
object:
  position: {{columns: [ox, oy, oz]}}
  rotation: {{columns: o_yaw, as: yaw, unit: rad}}
hand:
  position: {{columns: [actual_TCP_pose_0, actual_TCP_pose_1, actual_TCP_pose_2]}}
  rotation:
    columns: [actual_TCP_pose_3, actual_TCP_pose_4, actual_TCP_pose_5]
    as: rotation_vector
    unit: rad
  offset: {{translation: [0, 0, {STICK}]}}
force: {{columns: [actual_TCP_force_0, actual_TCP_force_1, actual_TCP_force_2], acts_on: hand}}
pushes: {{cut: column, column: run}}
"""
    )
