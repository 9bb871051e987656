"""Bags whose messages name their frames, and trees of transforms between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from foreign.common import DESCRIPTION, EPOCH, HAND, rotations, take
from physid_drake.recording import Recording

Pose = tuple[np.ndarray, Rotation]
CAMERA: Pose = (np.array([0.1, -0.2, 1.2]), Rotation.from_euler("xyz", [178, 3, 30], degrees=True))
OPTICAL = Rotation.from_euler("xyz", [-90, 0, -90], degrees=True)


@dataclass
class Writing:
    """A bag that is written with rosbags: of ROS 2 in a folder, or of ROS 1 in a file."""

    path: Path
    options: dict[str, Any] = field(default_factory=dict)
    rows: list[tuple[float, str, str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        self.is_first = self.path.suffix == ".bag"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is_first else Stores.ROS2_HUMBLE)
        if self.is_first:
            for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
                self.store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms\n", name))

    def __enter__(self) -> Writing:
        return self

    def __exit__(self, *_: object) -> None:
        from rosbags import rosbag1, rosbag2

        if self.is_first:
            bag: Any = rosbag1.Writer(self.path)
        else:
            bag = rosbag2.Writer(self.path, version=8, storage_plugin=rosbag2.StoragePlugin.SQLITE3)
            if self.options:
                bag.set_compression(**self.options)
        kinds = {topic: kind for _, topic, kind, _ in self.rows}
        write = self.store.serialize_ros1 if self.is_first else self.store.serialize_cdr
        with bag:
            links = {topic: bag.add_connection(topic, kind, typestore=self.store) for topic, kind in kinds.items()}
            for time, topic, kind, message in sorted(self.rows, key=lambda row: row[0]):
                bag.write(links[topic], round(1e9 * (EPOCH + time)), bytes(write(message, kind)))

    def header(self, time: float, frame: str) -> Any:
        now = EPOCH + time
        stamp = self.make("builtin_interfaces/msg/Time", sec=int(now), nanosec=round((now % 1.0) * 1e9) % 10**9)
        return self.make("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **({"seq": 0} if self.is_first else {}))

    def make(self, kind: str, *values: Any, **named: Any) -> Any:
        return self.store.types[kind](*values, **named)

    def pose(self, topic: str, time: float, frame: str, *poses: Pose) -> None:
        """A PoseStamped; a PoseArray of several."""
        made = [
            self.make(
                "geometry_msgs/msg/Pose",
                position=self.make("geometry_msgs/msg/Point", *map(float, place)),
                orientation=self.make("geometry_msgs/msg/Quaternion", *map(float, turn.as_quat())),
            )
            for place, turn in poses
        ]
        header = self.header(time, frame)
        if len(made) == 1:
            kind, message = "PoseStamped", self.make("geometry_msgs/msg/PoseStamped", header=header, pose=made[0])
        else:
            kind, message = "PoseArray", self.make("geometry_msgs/msg/PoseArray", header=header, poses=made)
        self.rows.append((time, topic, f"geometry_msgs/msg/{kind}", message))

    def transform(self, topic: str, time: float, parent: str, child: str, pose: Pose, kind: str = "tf2_msgs") -> None:
        place, turn = pose
        moved = self.make(
            "geometry_msgs/msg/Transform",
            translation=self.make("geometry_msgs/msg/Vector3", *map(float, place)),
            rotation=self.make("geometry_msgs/msg/Quaternion", *map(float, turn.as_quat())),
        )
        one = self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(time, parent), child_frame_id=child, transform=moved,
        )  # fmt: skip
        name = "tf/msg/tfMessage" if kind == "tf" else "tf2_msgs/msg/TFMessage"
        self.rows.append((time, topic, name, self.make(name, transforms=[one])))

    def force(self, topic: str, time: float, frame: str, force: Sequence[float]) -> None:
        felt = self.make(
            "geometry_msgs/msg/Wrench",
            force=self.make("geometry_msgs/msg/Vector3", *map(float, force)),
            torque=self.make("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0),
        )
        message = self.make("geometry_msgs/msg/WrenchStamped", header=self.header(time, frame), wrench=felt)
        self.rows.append((time, topic, "geometry_msgs/msg/WrenchStamped", message))


def inside(frame: Pose, pose: Pose) -> Pose:
    """A pose in W as one in a frame of which the pose in W is known."""
    place, turn = frame
    return turn.inv().apply(pose[0] - place), turn.inv() * pose[1]


def tree(recording: Recording, path: Path, *, wrong: bool = False) -> str:
    """A bag whose object hangs from a camera that is bolted to the world, and whose hand from a slide that moves.

    Where it is ``wrong``, the map follows a frame in a loop, and another has two parents.
    """
    times, body, hand = take(recording, rate=50.0)
    still = np.array([0.0, 0.0, 0.3]), Rotation.identity()
    with Writing(path) as bag:
        bag.transform("/tf_static", 0.0, "world", "camera", (CAMERA[0], CAMERA[1] * OPTICAL.inv()))
        bag.transform("/tf_static", 0.0, "camera", "optical", (np.zeros(3), OPTICAL))
        bag.transform("/tf_static", 0.0, "slide", "tip", (-still[0], still[1]))
        for time, *poses in zip(
            times.tolist(), body.positions, rotations(body), hand.positions, rotations(hand), strict=True
        ):
            bag.transform("/tf", time, "optical", "mug", inside(CAMERA, (poses[0], poses[1])))
            bag.transform("/tf", time, "world", "slide", (poses[2] + poses[3].apply(still[0]), poses[3]))
            if wrong:
                for parent, child in (("a", "b"), ("b", "a"), ("a", "two"), ("world", "two")):
                    bag.transform("/tf", time, parent, child, still)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
object: {{topic: /tf, frame: {"a" if wrong else "mug"}}}
hand: {{topic: /tf, frame: tip}}
pushes: {{cut: rest}}
"""
    )
