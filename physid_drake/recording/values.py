"""What was measured: pushes with times, poses and forces, and the cell they were made in; all of it frozen.

Frames: ``W`` world (z up, table top at z = 0), ``B`` object (geometric centre), ``P`` hand tip (centre of its
shape). Lengths in m, times in s, forces in N, masses in kg, angles in rad, quaternions (w, x, y, z).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Final, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.recording.checks import check_choice, check_not_negative, check_positive, check_times, frozen
from physid_drake.recording.limits import (
    LOUDEST_FORCE,
    LOUDEST_POSITION,
    LOUDEST_ROTATION,
    check_forces,
    check_lengths,
    check_loudness,
    check_places,
    check_table,
    check_text,
)
from physid_drake.recording.object_model import ObjectModel
from physid_drake.recording.turns import unwrapped
from physid_drake.wording import shown

Array: TypeAlias = npt.NDArray[np.float64]
TipShape = Literal["cylinder", "sphere", "capsule", "reflex_sf"]
HandStream = Literal["measured", "commanded"]
RotationKind = Literal["full", "yaw", "none"]

QUATERNION_TOLERANCE: Final = 1e-3
"""A quaternion whose norm is further from 1 than this is refused."""

REFLEX_SF_TIP_RADIUS: Final = 0.010
"""Radius in m of the ReFlex SF fingertip's pad, used where a recording with that hand does not give one."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseStream:
    """Poses of one body in W against time.

    Attributes:
        times: (n,) in s, strictly increasing.
        positions: (n, 3) in m.
        quaternions: (n, 4) as w, x, y, z, of norm 1 within 1e-3.
        rotation: how much of the rotation was measured: all of it, the yaw, or nothing. What was not is upright in
            the quaternions, and aligned with W.
    """

    times: Array
    positions: Array
    quaternions: Array
    rotation: RotationKind = "full"

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", frozen(self.times, "times", None))
        object.__setattr__(self, "positions", frozen(self.positions, "positions", 3))
        object.__setattr__(self, "quaternions", frozen(self.quaternions, "quaternions", 4))
        check_times(self.times)
        check_choice("rotation", self.rotation, get_args(RotationKind))
        if not len(self.times) == len(self.positions) == len(self.quaternions):
            lengths = f"{len(self.times)}, {len(self.positions)} and {len(self.quaternions)}"
            raise RecordingError(f"times, positions and quaternions must be equally long, but got {lengths} rows.")
        check_places(self.positions)
        with np.errstate(over="ignore"):
            norms = np.linalg.norm(self.quaternions, axis=1)
        worst = int(np.argmax(np.abs(norms - 1.0)))
        if abs(norms[worst] - 1.0) > QUATERNION_TOLERANCE:
            raise RecordingError(
                f"quaternions must have norm 1 within {QUATERNION_TOLERANCE}, but row {worst} has norm "
                f"{norms[worst]:.6g}; normalise them."
            )

    def __len__(self) -> int:
        return len(self.times)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PoseStream):
            return NotImplemented
        return (
            np.array_equal(self.times, other.times)
            and np.array_equal(self.positions, other.positions)
            and np.array_equal(self.quaternions, other.quaternions)
            and self.rotation == other.rotation
        )

    __hash__ = None  # type: ignore[assignment]

    @property
    def headings(self) -> Array:
        """(n,) the yaw within one turn, in rad: that of the object's y axis, which a cylinder that rolls keeps."""
        w, x, y, z = self.quaternions.T
        return np.asarray(np.arctan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z)))

    @cached_property
    def planar(self) -> Array:
        """(n, 3), read-only: x and y in m, and the yaw in rad, unwrapped so that it has no steps of a full turn."""
        planar = np.column_stack([self.positions[:, :2], unwrapped(self.times, self.headings)])
        planar.setflags(write=False)
        return planar


@dataclass(frozen=True, kw_only=True, eq=False)
class ForceStream:
    """Force of the hand ON the object, in W.

    Attributes:
        times: (n,) in s, strictly increasing.
        forces: (n, 3) in N.
    """

    times: Array
    forces: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "times", frozen(self.times, "times", None))
        object.__setattr__(self, "forces", frozen(self.forces, "forces", 3))
        check_times(self.times)
        if len(self.times) != len(self.forces):
            raise RecordingError(
                f"times and forces must be equally long, but got {len(self.times)} and {len(self.forces)} rows."
            )
        check_forces(self.forces)

    def __len__(self) -> int:
        return len(self.times)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, ForceStream):
            return NotImplemented
        return np.array_equal(self.times, other.times) and np.array_equal(self.forces, other.forces)

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True, kw_only=True)
class Push:
    """One push; its streams may be sampled at different times.

    Attributes:
        name: the table's file within the recording's folder, such as ``pushes/003.csv``.
        object: poses X_WB, at least two.
        hand: poses X_WP of the tip, or None where nothing pushes.
        force: force of the hand on the object, or None where it was not measured.
        note: free text.
        warnings: what a reader or converter left out or found odd, one line each.
    """

    name: str
    object: PoseStream
    hand: PoseStream | None = None
    force: ForceStream | None = None
    note: str = ""
    warnings: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        check_text("a push's name", self.name)
        check_text(f"push {shown(self.name)}: note", self.note, lines=True)
        if len(self.object) < 2:
            raise RecordingError(
                f"push {shown(self.name)}: at least two object poses are needed, but got {len(self.object)}; "
                "record the pose before and after the push."
            )
        if self.hand is not None and len(self.hand) < 2:
            raise RecordingError(
                f"push {shown(self.name)}: a hand's path needs at least two samples, but there is {len(self.hand)}; "
                "record where it was before and after the push."
            )
        if self.force is not None and self.hand is None:
            raise RecordingError(f"push {shown(self.name)}: a hand force needs a hand; add the hand's path.")

    def _streams(self) -> list[PoseStream | ForceStream]:
        return [stream for stream in (self.object, self.hand, self.force) if stream is not None]

    @property
    def start_time(self) -> float:
        """First time in s over all streams."""
        return float(min(stream.times[0] for stream in self._streams()))

    @property
    def end_time(self) -> float:
        """Last time in s over all streams."""
        return float(max(stream.times[-1] for stream in self._streams()))

    @property
    def duration(self) -> float:
        """Time in s from the first sample of any stream to the last."""
        return self.end_time - self.start_time

    @property
    def endpoint_only(self) -> bool:
        """Whether only the object's first and last pose are known."""
        return len(self.object) == 2


@dataclass(frozen=True, kw_only=True)
class Table:
    """The table's top face, at z = 0: ``size`` along x and y of W, and its ``centre``, in m."""

    size: tuple[float, float]
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_positive("size_m", "m", *self.size)
        check_table(self.size, self.centre)

    @property
    def corners(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lower and upper corner [m]."""
        (sx, sy), (cx, cy) = self.size, self.centre
        return (cx - 0.5 * sx, cy - 0.5 * sy), (cx + 0.5 * sx, cy + 0.5 * sy)


@dataclass(frozen=True, kw_only=True)
class Hand:
    """The hand's tip: its shape, radius and (cylinder, capsule) length in m, and what its stream is."""

    tip: TipShape
    radius: float = REFLEX_SF_TIP_RADIUS
    length: float | None = None
    stream: HandStream = "measured"

    def __post_init__(self) -> None:
        check_choice("tip", self.tip, get_args(TipShape))
        check_choice("stream", self.stream, get_args(HandStream))
        check_positive("radius_m", "m", self.radius)
        check_positive("length_m", "m", self.length)
        check_lengths("radius_m", self.radius)
        check_lengths("length_m", self.length)
        long = self.tip in ("cylinder", "capsule")
        if long and self.length is None:
            raise RecordingError(f"a {self.tip} tip needs length_m, but there is none; add it.")
        if not long and self.length is not None:
            raise RecordingError(f"a {self.tip} tip has no length_m, but got {shown(self.length)} m; remove it.")


@dataclass(frozen=True, kw_only=True)
class Sensors:
    """One standard deviation of each sensor, in m, rad, m and N; None is unknown."""

    object_position_std: float | None = None
    object_rotation_std: float | None = None
    hand_position_std: float | None = None
    force_std: float | None = None

    def __post_init__(self) -> None:
        check_not_negative("object_position_std_m", "m", self.object_position_std)
        check_not_negative("object_rotation_std_rad", "rad", self.object_rotation_std)
        check_not_negative("hand_position_std_m", "m", self.hand_position_std)
        check_not_negative("force_std_n", "N", self.force_std)
        check_loudness("object_position_std_m", "m", self.object_position_std, LOUDEST_POSITION)
        check_loudness("object_rotation_std_rad", "rad", self.object_rotation_std, LOUDEST_ROTATION)
        check_loudness("hand_position_std_m", "m", self.hand_position_std, LOUDEST_POSITION)
        check_loudness("force_std_n", "N", self.force_std, LOUDEST_FORCE)

    @property
    def object_std(self) -> Array:
        """Of x, y, yaw (3,) of the object [m, m, rad]; what is unknown counts as none."""
        place, turn = self.object_position_std or 0.0, self.object_rotation_std or 0.0
        return np.array([place, place, turn])


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """What a recording was converted from.

    Attributes:
        source: name of the file or folder.
        source_sha256: of its bytes; of several files, of their hashes.
        map: the map's text.
        map_sha256: of it.
    """

    source: str
    source_sha256: str
    map: str
    map_sha256: str

    def __post_init__(self) -> None:
        for name in ("source", "source_sha256", "map_sha256"):
            check_text(name, getattr(self, name))
        check_text("map", self.map, lines=True)


@dataclass(frozen=True, kw_only=True)
class Recording:
    """Pushes of one object on one table with one hand, in the order in which they were made.

    ``folder`` is where it was read from, or None, and ``conversion`` what it was made of; two recordings are equal
    whatever these are.
    """

    name: str
    description: str = ""
    object: ObjectModel
    table: Table
    hand: Hand | None = None
    sensors: Sensors = field(default_factory=Sensors)
    pushes: tuple[Push, ...]
    folder: Path | None = field(default=None, compare=False)
    conversion: Conversion | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        check_text("name", self.name)
        check_text("description", self.description, lines=True)
        if not self.pushes:
            raise RecordingError(f"recording {shown(self.name)}: pushes must not be empty; add at least one push.")
        names = [push.name for push in self.pushes]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise RecordingError(f"recording {shown(self.name)}: two pushes are named {shown(twice)}; rename one.")
        for push in self.pushes:
            if (push.hand is None) != (self.hand is None):
                what = "has no hand path" if push.hand is None else "has a hand path"
                rule = "describes no hand" if self.hand is None else "describes one"
                raise RecordingError(
                    f"push {shown(push.name)} {what} but recording {shown(self.name)} {rule}; give both or neither."
                )

    def subset(self, names_or_indices: Iterable[str | int]) -> Recording:
        """The same recording with only some of its pushes, in the order asked for.

        Args:
            names_or_indices: names of pushes, or their indices in ``pushes`` (negative counts from the end).

        Raises:
            RecordingError: if there is no such push, or none is asked for, or one twice.
        """
        by_name = {push.name: push for push in self.pushes}
        chosen: list[Push] = []
        for key in names_or_indices:
            if isinstance(key, str) and key in by_name:
                chosen.append(by_name[key])
            elif not isinstance(key, str) and -len(self.pushes) <= key < len(self.pushes):
                chosen.append(self.pushes[key])
            else:
                raise RecordingError(
                    f"recording {shown(self.name)} has no push {shown(key)}; it has {len(self.pushes)}, "
                    f"from {shown(self.pushes[0].name)} to {shown(self.pushes[-1].name)}."
                )
        return replace(self, pushes=tuple(chosen))
