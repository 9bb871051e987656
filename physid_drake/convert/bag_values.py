"""What is taken from a message of a bag: a pose, a point or a force, of which frame, and by which clock."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

POSE: Final = ("x", "y", "z", "qx", "qy", "qz", "qw")
POINT: Final = POSE[:3]
WRENCH: Final = ("x", "y", "z", "tx", "ty", "tz")
"""Names of the numbers; poses in m, wrenches in N and N m."""

_PACKAGES: Final = ("geometry_msgs", "nav_msgs", "tf2_msgs", "tf")


class Taken(NamedTuple):
    """What a message says.

    Attributes:
        child: which of several it is of: the child frame of a transform, the index of a pose; None of the only one.
        frame: that it is measured in; empty where the message does not say.
        stamp: [s] in its header; NaN without one.
        values: named by ``POSE``, ``POINT`` or ``WRENCH``.
    """

    child: str | None
    frame: str
    stamp: float
    values: tuple[float, ...]


def holds_numbers(kind: str) -> bool:
    """Whether messages of a type hold a pose, a point or a force."""
    return kind.partition("/")[0] in _PACKAGES and kind.rpartition("/")[2] in _TAKEN


def holds_transforms(kind: str) -> bool:
    """Whether messages of a type hold transforms of a tree of frames."""
    return kind.rpartition("/")[2].lower() == "tfmessage"


def holds_poses(kind: str) -> bool:
    """Whether messages of a type hold poses one after another, told apart by their index."""
    return kind.rpartition("/")[2] == "PoseArray"


def taken_from(message: Any, kind: str) -> Iterator[Taken]:
    """What is taken from a message of one of the types that hold numbers."""
    return _TAKEN[kind.rpartition("/")[2]](message)


def frame_name(frame: str) -> str:
    """A frame's name, which in ROS 1 may have a slash in front."""
    return frame.lstrip("/")


def _heading(message: Any) -> tuple[str, float]:
    """Frame and stamp [s] of a header."""
    header = getattr(message, "header", None)
    if header is None:
        return "", np.nan
    return frame_name(str(header.frame_id)), float(header.stamp.sec) + 1e-9 * float(header.stamp.nanosec)


def _place(point: Any) -> tuple[float, ...]:
    return float(point.x), float(point.y), float(point.z)


def _turn(quaternion: Any) -> tuple[float, ...]:
    return float(quaternion.x), float(quaternion.y), float(quaternion.z), float(quaternion.w)


def _of_pose(message: Any) -> Iterator[Taken]:
    pose = getattr(message, "pose", message)
    pose = getattr(pose, "pose", pose)  # with a covariance
    yield Taken(None, *_heading(message), _place(pose.position) + _turn(pose.orientation))


def _of_poses(message: Any) -> Iterator[Taken]:
    heading = _heading(message)
    for index, pose in enumerate(message.poses):
        yield Taken(f"[{index}]", *heading, _place(pose.position) + _turn(pose.orientation))


def _of_transform(message: Any) -> Iterator[Taken]:
    transform = getattr(message, "transform", message)
    child = getattr(message, "child_frame_id", None)
    values = _place(transform.translation) + _turn(transform.rotation)
    yield Taken(None if child is None else frame_name(str(child)), *_heading(message), values)


def _of_transforms(message: Any) -> Iterator[Taken]:
    for one in message.transforms:
        yield from _of_transform(one)


def _of_point(message: Any) -> Iterator[Taken]:
    yield Taken(None, *_heading(message), _place(getattr(message, "point", getattr(message, "vector", message))))


def _of_wrench(message: Any) -> Iterator[Taken]:
    wrench = getattr(message, "wrench", message)
    yield Taken(None, *_heading(message), _place(wrench.force) + _place(wrench.torque))


def _of_twist(message: Any) -> Iterator[Taken]:
    twist = getattr(message, "twist", message)
    yield Taken(None, *_heading(message), _place(twist.linear) + _place(twist.angular))


_TAKEN: Final[Mapping[str, Callable[[Any], Iterator[Taken]]]] = {
    "Pose": _of_pose, "PoseStamped": _of_pose, "PoseWithCovarianceStamped": _of_pose, "Odometry": _of_pose,
    "PoseArray": _of_poses,
    "Transform": _of_transform, "TransformStamped": _of_transform,
    "TFMessage": _of_transforms, "tfMessage": _of_transforms,
    "Point": _of_point, "PointStamped": _of_point, "Vector3": _of_point, "Vector3Stamped": _of_point,
    "Wrench": _of_wrench, "WrenchStamped": _of_wrench,
    "Twist": _of_twist, "TwistStamped": _of_twist,
}  # fmt: skip
"""By the name of a message's type."""
