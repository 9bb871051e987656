"""Logs in the layouts that programs of others write, made of a recording, so that the way back can be compared."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from physid_drake.recording import PoseStream, Recording

AXES_Y_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""The recording's x, y, z are z, x, y of Motive's world, whose y is up."""

DESCRIPTION = """\
format: physid-map/1
recording:
  name: {name}
  object: {{shape: cylinder, radius_m: 0.0356, length_m: 0.0459, axis: z, mass_kg: 0.90393}}
  table: {{size_m: [1.6, 1.4], centre_m: [0.0, 0.0]}}
"""
HAND = "  hand: {tip: sphere, radius_m: 0.0112, stream: measured}\n"


def rotations(stream: PoseStream) -> Rotation:
    return Rotation.from_quat(np.roll(stream.quaternions, -1, axis=1))


def take(recording: Recording, rate: float = 120.0, rest: float = 0.8) -> tuple[np.ndarray, PoseStream, PoseStream]:
    """One log of all pushes: rests before and after each, and the object carried to where the next begins."""
    body_places, hand_places, turns = [], [], []
    for push in recording.pushes:
        assert push.hand is not None
        times = np.arange(push.start_time, push.end_time, 1.0 / rate)
        held = int(rest * rate)
        body = _at(times, push.object.times, push.object.positions)
        hand = _at(times, push.hand.times, push.hand.positions)
        turn = _at(times, push.object.times, push.object.quaternions)
        if body_places:
            carried = np.linspace(0.0, 1.0, int(rate))[:, None]
            way = body_places[-1][-1] * (1.0 - carried) + body[0] * carried
            way[:, 2] += 0.1 * np.sin(np.pi * carried[:, 0])
            body_places.append(way)
            turns.append(turns[-1][-1] * (1.0 - carried) + turn[0] * carried)
            hand_places.append(hand_places[-1][-1] * (1.0 - carried) + hand[0] * carried + [0.0, 0.0, 0.3])
        body_places += [np.repeat(body[:1], held, axis=0), body, np.repeat(body[-1:], held, axis=0)]
        turns += [np.repeat(turn[:1], held, axis=0), turn, np.repeat(turn[-1:], held, axis=0)]
        hand_places += [np.repeat(hand[:1], held, axis=0), hand, np.repeat(hand[-1:], held, axis=0)]
    quaternions = np.vstack(turns)
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    count = len(quaternions)
    times = np.arange(count) / rate
    rng = np.random.default_rng(0)
    noise = 1e-4 * rng.normal(size=(count, 3))
    body_stream = PoseStream(times=times, positions=np.vstack(body_places) + noise, quaternions=quaternions)
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    return times, body_stream, PoseStream(times=times, positions=np.vstack(hand_places), quaternions=identity)


def _at(times: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(times, known, column) for column in values.T])


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
        hand = _at(push.object.times, push.hand.times, push.hand.positions)
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


LEFT_HANDED = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]])
"""The recording's x, y, z are x, z, y of Unity's world, which is left-handed with y up."""


def unity(recording: Recording, folder: Path) -> str:
    """A folder with a file for each push, by a game engine: left-handed, y up, quaternions x, y, z, w, no header."""
    folder.mkdir()
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        turned = Rotation.from_matrix(LEFT_HANDED.T @ rotations(push.object).as_matrix() @ LEFT_HANDED)
        hand = _at(push.object.times, push.hand.times, push.hand.positions)
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


def padded_npz(recording: Recording, file: Path) -> str:
    """Arrays (pushes, n, k) filled up with NaN, in which the finger is not always seen, and forces on the hand."""
    most = max(len(push.object) for push in recording.pushes)
    pose, finger = (np.full((len(recording.pushes), most, k), np.nan) for k in (7, 3))
    stamp, force = (
        np.full((len(recording.pushes), most, 1), np.nan),
        np.full((len(recording.pushes), most, 3), np.nan),
    )
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        n = len(push.object)
        stamp[k, :n, 0] = 1.7e9 + 100.0 * k + push.object.times
        pose[k, :n] = np.column_stack([push.object.positions, push.object.quaternions])
        finger[k, :n] = _at(push.object.times, push.hand.times, push.hand.positions)
        finger[k, 3:n:7] = np.nan
        force[k, :n] = [-1.0, 2.0, 0.5]
    np.savez(file, pose=pose, finger=finger, stamp=stamp, force=force)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: "stamp[0]"}
object:
  position: {columns: ["pose[0]", "pose[1]", "pose[2]"]}
  rotation: {columns: ["pose[3]", "pose[4]", "pose[5]", "pose[6]"], as: wxyz}
hand:
  position: {columns: ["finger[0]", "finger[1]", "finger[2]"]}
  rotation: none
force: {columns: ["force[0]", "force[1]", "force[2]"], acts_on: hand}
pushes: {cut: column, column: "[push]"}
"""
    )


def lerobot(recording: Recording, file: Path) -> str:
    """LeRobot's table of frames: lists of numbers, an episode's index, times that begin anew with every episode."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    states, actions, stamps, episodes = [], [], [], []
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        hand = _at(push.object.times, push.hand.times, push.hand.positions)
        states += np.column_stack([hand, push.object.positions, push.object.planar[:, 2]]).tolist()
        actions += hand[:, :2].tolist()
        stamps += (push.object.times - push.object.times[0]).tolist()
        episodes += [k] * len(push.object)
    table = pa.table(
        {
            "observation.state": pa.array(states, type=pa.list_(pa.float64(), 7)),
            "action": pa.array(actions),
            "timestamp": pa.array(stamps, type=pa.float64()),
            "episode_index": pa.array(episodes, type=pa.int64()),
            "task": pa.array(["push"] * len(stamps)),
        }
    )
    pq.write_table(table, file)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: timestamp}
object:
  position: {columns: ["observation.state[3]", "observation.state[4]", "observation.state[5]"]}
  rotation: {columns: "observation.state[6]", as: yaw, unit: rad}
hand:
  position: {columns: ["observation.state[0]", "observation.state[1]", "observation.state[2]"]}
  rotation: none
pushes: {cut: column, column: episode_index}
"""
    )


def demonstrations(recording: Recording, file: Path) -> str:
    """An HDF5 file with a group for each push."""
    import h5py

    with h5py.File(file, "w") as opened:
        for k, push in enumerate(recording.pushes):
            assert push.hand is not None
            group = opened.create_group(f"demo_{k}/obs")
            group["time"] = push.object.times
            group["object"] = np.column_stack([push.object.positions, np.roll(push.object.quaternions, -1, axis=1)])
            group["eef_pos"] = _at(push.object.times, push.hand.times, push.hand.positions)
            group["image"] = np.zeros((len(push.object), 2, 2, 3), dtype=np.uint8)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: obs/time}
object:
  position: {columns: ["obs/object[0]", "obs/object[1]", "obs/object[2]"]}
  rotation: {columns: ["obs/object[3]", "obs/object[4]", "obs/object[5]", "obs/object[6]"], as: xyzw}
hand:
  position: {columns: ["obs/eef_pos[0]", "obs/eef_pos[1]", "obs/eef_pos[2]"]}
  rotation: none
pushes: {cut: column, column: "[push]"}
"""
    )


def mcap(recording: Recording, folder: Path, storage: str = "mcap") -> str:
    """A bag of ROS 2: transforms of a camera that looks down, a wrench at 500 Hz, arrivals that come in bursts."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    times, body, hand = take(recording, rate=100.0)
    camera = Rotation.from_quat(np.roll(CAMERA, -1))
    with Writer(folder, version=9, storage_plugin=StoragePlugin[storage.upper()]) as bag:
        tf = bag.add_connection("/tf", "tf2_msgs/msg/TFMessage", typestore=store)
        wrench = bag.add_connection("/ft/wrench", "geometry_msgs/msg/WrenchStamped", typestore=store)
        bag.add_connection("/silent", "geometry_msgs/msg/PoseStamped", typestore=store)

        def header(time: float) -> object:
            stamp = types["builtin_interfaces/msg/Time"](sec=int(time), nanosec=round((time % 1.0) * 1e9) % 10**9)
            return types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")

        def vector(values: np.ndarray) -> object:
            return types["geometry_msgs/msg/Vector3"](*map(float, values))

        rows = []
        for stream, child in ((body, "mug"), (hand, "finger")):
            places = camera.inv().apply(stream.positions - CAMERA_PLACE)
            turns = (camera.inv() * rotations(stream)).as_quat()
            for time, place, turn in zip(times, places, turns, strict=True):
                pose = types["geometry_msgs/msg/Transform"](
                    translation=vector(place), rotation=types["geometry_msgs/msg/Quaternion"](*map(float, turn))
                )
                one = types["geometry_msgs/msg/TransformStamped"](
                    header=header(EPOCH + time), child_frame_id=child, transform=pose
                )
                rows.append((time, tf, types["tf2_msgs/msg/TFMessage"](transforms=[one])))
        for time in np.arange(times[0], times[-1], 0.002):
            felt = types["geometry_msgs/msg/Wrench"](
                force=vector(np.array([0.0, 0.0, -2.0])), torque=vector(np.zeros(3))
            )
            rows.append(
                (time, wrench, types["geometry_msgs/msg/WrenchStamped"](header=header(EPOCH + time), wrench=felt))
            )
        for time, connection, message in sorted(rows, key=lambda row: row[0]):
            arrival = int(1e9 * (EPOCH + 0.05 * np.ceil(time / 0.05)))
            bag.write(connection, arrival, store.serialize_cdr(message, connection.msgtype))
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
world: {{pose: {{translation: {CAMERA_PLACE.tolist()}, rotation_wxyz: {CAMERA.tolist()}}}}}
object: {{topic: /tf, frame: mug}}
hand: {{topic: /tf, frame: finger}}
force: {{topic: /ft/wrench, axes: hand, acts_on: hand, weight_n: 2.0}}
pushes: {{cut: rest}}
"""
    )


CAMERA = np.round(np.roll(Rotation.from_euler("ZYX", [1.2, 0.1, np.pi - 0.2]).as_quat(), 1), 9)
"""R_WC of a camera that looks down, somewhat aside."""
CAMERA_PLACE = np.array([0.1, -0.2, 1.1])
EPOCH = 1.75e9
WEIGHT = np.array([0.0, 0.0, -2.0])


def ros1(recording: Recording, file: Path) -> str:
    """A bag of ROS 1: poses with headers, and a wrench that somebody sent as a twist without one."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    times, body, hand = take(recording, rate=100.0)
    with Writer(file) as bag:
        topics = {
            name: bag.add_connection(name, kind, typestore=store)
            for name, kind in (
                ("/mocap/mug", "geometry_msgs/msg/PoseStamped"),
                ("/tip", "geometry_msgs/msg/PointStamped"),
                ("/ft", "geometry_msgs/msg/Twist"),
            )
        }
        for k, time in enumerate(times.tolist()):
            now = EPOCH + time
            stamp = types["builtin_interfaces/msg/Time"](sec=int(now), nanosec=round((now % 1.0) * 1e9) % 10**9)
            header = types["std_msgs/msg/Header"](seq=k, stamp=stamp, frame_id="world")
            turn = np.roll(body.quaternions[k], -1)
            pose = types["geometry_msgs/msg/Pose"](
                position=types["geometry_msgs/msg/Point"](*map(float, body.positions[k])),
                orientation=types["geometry_msgs/msg/Quaternion"](*map(float, turn)),
            )
            point = types["geometry_msgs/msg/Point"](*map(float, hand.positions[k]))
            force, none = (types["geometry_msgs/msg/Vector3"](*v) for v in ((0.5, 0.0, 0.0), (0.0, 0.0, 0.0)))
            messages = {
                "/mocap/mug": types["geometry_msgs/msg/PoseStamped"](header=header, pose=pose),
                "/tip": types["geometry_msgs/msg/PointStamped"](header=header, point=point),
                "/ft": types["geometry_msgs/msg/Twist"](linear=force, angular=none),
            }
            for name, message in messages.items():
                raw = store.serialize_ros1(message, topics[name].msgtype)
                bag.write(topics[name], int(1e9 * now), raw)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
object: {topic: /mocap/mug}
hand: {topic: /tip, rotation: none}
force: {topic: /ft}
pushes: {cut: rest}
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
        places = 100.0 * _at(frames, push.object.times, push.object.positions[:, :2])
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
