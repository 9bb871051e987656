"""The map: a text in which a person says what a foreign log's columns or topics are, and in which conventions.

Every key and its default is listed in ``docs/bring_your_data.md``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.convert.text_table import Dialect
from physid_drake.recording import Hand, ObjectModel, Sensors, Table

Array = NDArray[np.float64]

FORMAT: Final = "physid-map/1"
NORM_TOLERANCE: Final = 0.02
"""A written quaternion is rounded; one whose norm is further from 1 is none."""

ROTATIONS: Final = ("wxyz", "xyzw", "euler", "rotation_vector", "matrix", "yaw")
"""How a rotation is written; the quaternions by the order of their columns, a matrix row by row."""

CUTS: Final = ("rest", "gap", "column", "times", "whole", "sections", "rows")
COUNTS: Final[Mapping[str, tuple[int, ...]]] = {
    "wxyz": (4,), "xyzw": (4,), "euler": (3,), "rotation_vector": (3,), "matrix": (9,),
    "yaw": (1,),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """Columns of one kind, and what turns them into SI units: a unit's name, or the size of one that has none."""

    columns: tuple[str, ...] = ()
    unit: str | None = None
    size: float | None = None


@dataclass(frozen=True, kw_only=True)
class Rows:
    """Which rows of a source's tables are a stream's.

    Attributes:
        file: name or pattern of its file, or files, in the source's folder; None where each file holds every stream.
        section: which of several tables in one text; None: the one that the dialect says.
        where: names of columns, and the number or text that they must hold.
    """

    file: str | None = None
    section: int | None = None
    where: tuple[tuple[str, float | str], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Of one stream.

    Attributes:
        column: of its times, or of its frames' numbers; None where rows come at ``rate``.
        fine: column of nanoseconds beside one of seconds.
        unit: of the times.
        rate: of the frames [Hz], where they are numbered.
        offset: what is added [s] to get the common clock.
    """

    column: str | None = None
    fine: str | None = None
    unit: str | None = None
    rate: float | None = None
    offset: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Turn:
    """How a rotation is written.

    Attributes:
        columns: nine, four, three or one.
        kind: one of ``ROTATIONS``.
        unit: of angles.
        order: of Euler angles: capital letters about the body's own axes, small ones about the world's.
        inverse: whether it turns the world's axes into the body's coordinates, R_BW instead of R_WB.
    """

    columns: tuple[str, ...] = ()
    kind: str = "wxyz"
    unit: str | None = None
    order: str = "XYZ"
    inverse: bool = False


@dataclass(frozen=True, kw_only=True)
class Offset:
    """A pose that stays: of the frame that is wanted in the frame that was measured."""

    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class MeshFrame:
    """How an object's mesh, or its boxes, lie.

    Attributes:
        axes: (3, 3) turns the mesh's coordinates into some whose z is up.
        translation: of the tracked frame's origin, in the mesh's coordinates, in its unit.
        rotation: of the tracked frame beside the mesh's axes, z up, w first.
    """

    axes: Array = field(default_factory=lambda: np.eye(3))
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class BoxPart:
    """One of the boxes that an object is made of: sizes and centre (x, y, z) in their unit, and its yaw [rad]."""

    size: tuple[float, float, float]
    centre: tuple[float, float, float]
    yaw: float


@dataclass(frozen=True, kw_only=True)
class SolidMap:
    """An object that is given by a mesh or by boxes.

    Attributes:
        parts: the mesh's file, or the boxes.
        scale: size of their unit [m].
        frame: how they lie, and where the tracked frame is in them.
        mass: [kg], and its standard deviation; None where nobody weighed it.
    """

    parts: Path | tuple[BoxPart, ...]
    scale: float
    frame: MeshFrame
    mass: float | None
    mass_std: float | None


@dataclass(frozen=True, kw_only=True)
class PoseMap:
    """One body's stream: the object's, or the hand's.

    Attributes:
        topic: of a bag.
        frame: of a bag's transforms: the child frame that is followed.
        rows: of tables.
        clock: of its own, where it has one.
        position: columns of x, y and z, or of x and y.
        turn: None where the rotation was not measured.
        offset: of B, or P, in the tracked frame.
        height: z [m] of the body's origin, where nothing measured it.
        end: of a table with a row for each push: the same columns of where the body is at last.
        speed: of the hand there: its column, or the number [m/s].
        world: where W lies in the frame that this body is measured in, if that is not the source's.
    """

    topic: str | None = None
    frame: str | None = None
    rows: Rows = field(default_factory=Rows)
    clock: Clock = field(default_factory=Clock)
    position: Quantity = field(default_factory=Quantity)
    turn: Turn | None = None
    offset: Offset = field(default_factory=Offset)
    height: float | None = None
    end: PoseMap | None = None
    speed: Quantity | float | None = None
    world: World | None = None


@dataclass(frozen=True, kw_only=True)
class ForceMap:
    """The force's stream.

    Attributes:
        topic: of a bag.
        rows: of tables.
        clock: of its own, where it has one.
        force: columns of x, y and z, or of x and y.
        in_hand: whether its axes turn with the hand.
        offset: of the sensor in the hand's frame; its rotation is what counts.
        on_hand: whether it is the force of the object on the hand.
        weight: of the tool below the sensor [N], which it feels too.
        tare: so long [s] from a push's begin nothing is touched, and the mean is taken away.
        world: where W lies in the frame that it is measured in, if that is not the source's.
    """

    topic: str | None = None
    rows: Rows = field(default_factory=Rows)
    clock: Clock = field(default_factory=Clock)
    force: Quantity = field(default_factory=Quantity)
    in_hand: bool = False
    offset: Offset = field(default_factory=Offset)
    on_hand: bool = False
    weight: float = 0.0
    tare: float = 0.0
    world: World | None = None


@dataclass(frozen=True, kw_only=True)
class World:
    """Where the recording's world W lies in the source's.

    Attributes:
        axes: (3, 3) A, turns the source's coordinates into some like W's; of determinant -1 where it is left-handed.
        origin: o, of W in the source's coordinates [m].
        rotation: R as a quaternion, w first: turns the source's axes, once they are relabelled, into W's.
    """

    axes: Array = field(default_factory=lambda: np.eye(3))
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Cut:
    """How a log is cut into pushes.

    Attributes:
        by: one of ``CUTS``.
        column: of ``column``: a push lasts as long as its value stays.
        gap: of ``gap`` [s]: longer than this, nothing was recorded between two pushes.
        still: of ``rest`` [s]: the object rests for so long between two pushes.
        lead: of ``rest`` [s]: what is kept of the rest before the object moves.
        tail: of ``rest`` [s]: and after it has come to rest.
        times: of ``times`` [s]: begin and end of each push, by the source's clock.
    """

    by: str = "whole"
    column: str | None = None
    gap: float = 0.5
    still: float = 0.5
    lead: float = 1.5
    tail: float = 0.5
    times: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Map:
    """What a log is, in the words of the person who made it.

    Attributes:
        file: of the map.
        name, description, model, table, hand, sensors: of the recording, as in ``recording.yaml``; the object may
            be a mesh, or boxes.
        dialect: how a table is written.
        by_receive: of a bag: whether times are those of arrival, instead of those in the messages' headers.
        world: where W lies.
        clock: of all streams that have none of their own.
        object, hand_path, force: the streams; the hand and its force may be missing.
        cut: into pushes.
    """

    file: Path
    name: str
    description: str
    model: ObjectModel | SolidMap
    table: Table
    hand: Hand | None
    sensors: Sensors
    dialect: Dialect
    by_receive: bool
    world: World
    clock: Clock
    object: PoseMap
    hand_path: PoseMap | None
    force: ForceMap | None
    cut: Cut

    def world_of(self, stream: PoseMap | ForceMap) -> World:
        """Where W lies in the frame that a stream is measured in."""
        return stream.world or self.world


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What the map of a recording that was converted says of its streams.

    Attributes:
        world, object, hand, force: as in ``Map``.
        lines: of the map's keys.
    """

    world: World
    object: PoseMap
    hand: PoseMap | None
    force: ForceMap | None
    lines: Mapping[str, int]

    def world_of(self, stream: PoseMap | ForceMap) -> World:
        """Where W lies in the frame that a stream is measured in."""
        return stream.world or self.world

    def place(self, *keys: str) -> str:
        """Where somebody who corrects some keys has to look: in which lines, or in those of what they belong to."""
        lines = [str(line) for line in map(self._line, keys) if line is not None]
        where = f" line{'s' if len(lines) > 1 else ''} {listed(lines)}" if lines else ""
        return f"map{where}: {listed(keys)}"

    def _line(self, key: str) -> int | None:
        parts = key.split(".")
        above = (".".join(parts[:count]) for count in range(len(parts), 0, -1))
        return next((self.lines[one] for one in above if one in self.lines), None)


def listed(words: Sequence[str]) -> str:
    """Words as people write them after one another."""
    return " and ".join([*([", ".join(words[:-1])] if len(words) > 1 else []), *words[-1:]])
