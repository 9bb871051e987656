"""Bags of ROS 1 and 2."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from foreign.common import DESCRIPTION, EPOCH, HAND, rotations, take
from physid_drake.recording import Recording

CAMERA = np.round(np.roll(Rotation.from_euler("ZYX", [1.2, 0.1, np.pi - 0.2]).as_quat(), 1), 9)
"""R_WC of a camera that looks down, somewhat aside."""
CAMERA_PLACE = np.array([0.1, -0.2, 1.1])


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


def odometry(recording: Recording, file: Path) -> str:
    """A bag of ROS 1 whose tracker sends odometry and leaves the stamps zero; the hand's pose is a transform."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    times, body, hand = take(recording, rate=100.0)
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    none = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    still = types["geometry_msgs/msg/TwistWithCovariance"](
        twist=types["geometry_msgs/msg/Twist"](linear=none, angular=none), covariance=np.zeros(36)
    )
    with Writer(file) as bag:
        tracker = bag.add_connection("/mug/odom", "nav_msgs/msg/Odometry", typestore=store)
        tip = bag.add_connection("/tip", "geometry_msgs/msg/TransformStamped", typestore=store)
        for k, time in enumerate(times.tolist()):
            header = types["std_msgs/msg/Header"](seq=k, stamp=stamp, frame_id="world")
            pose = types["geometry_msgs/msg/Pose"](
                position=types["geometry_msgs/msg/Point"](*map(float, body.positions[k])),
                orientation=types["geometry_msgs/msg/Quaternion"](*map(float, np.roll(body.quaternions[k], -1))),
            )
            seen = types["nav_msgs/msg/Odometry"](
                header=header,
                child_frame_id="mug",
                pose=types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.zeros(36)),
                twist=still,
            )
            moved = types["geometry_msgs/msg/TransformStamped"](
                header=header,
                child_frame_id="tip",
                transform=types["geometry_msgs/msg/Transform"](
                    translation=types["geometry_msgs/msg/Vector3"](*map(float, hand.positions[k])),
                    rotation=types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
                ),
            )
            for connection, message in ((tracker, seen), (tip, moved)):
                bag.write(connection, int(1e9 * (EPOCH + time)), store.serialize_ros1(message, connection.msgtype))
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
source: {stamp: receive}
object: {topic: /mug/odom}
hand: {topic: /tip, frame: tip}
pushes: {cut: rest}
"""
    )


def only_pushes(recording: Recording, folder: Path) -> str:
    """A bag of ROS 2 in SQLite that was stopped between the pushes; the tracker's clock is 40 ms late."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types = store.types
    with Writer(folder, version=9, storage_plugin=StoragePlugin.SQLITE3) as bag:
        mug, tip = (
            bag.add_connection(name, "geometry_msgs/msg/PoseStamped", typestore=store) for name in ("/mug", "/tip")
        )
        begin = EPOCH
        for push in recording.pushes:
            assert push.hand is not None
            rows = []
            for connection, stream, late in ((mug, push.object, 0.04), (tip, push.hand, 0.0)):
                turns = np.roll(stream.quaternions, -1, axis=1)
                for time, place, turn in zip(stream.times, stream.positions, turns, strict=True):
                    now = begin + float(time)
                    stamp = now + late
                    header = types["std_msgs/msg/Header"](
                        stamp=types["builtin_interfaces/msg/Time"](
                            sec=int(stamp), nanosec=round((stamp % 1.0) * 1e9) % 10**9
                        ),
                        frame_id="world",
                    )
                    pose = types["geometry_msgs/msg/Pose"](
                        position=types["geometry_msgs/msg/Point"](*map(float, place)),
                        orientation=types["geometry_msgs/msg/Quaternion"](*map(float, turn)),
                    )
                    message = types["geometry_msgs/msg/PoseStamped"](header=header, pose=pose)
                    rows.append((int(1e9 * now), connection, message))
            for arrival, connection, message in sorted(rows, key=lambda row: row[0]):
                bag.write(connection, arrival, store.serialize_cdr(message, connection.msgtype))
            begin += push.end_time + 4.0
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
object: {topic: /mug, time: {offset_s: -0.04}}
hand: {topic: /tip}
pushes: {cut: gap, gap_s: 1.0}
"""
    )
