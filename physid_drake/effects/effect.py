"""What an effect is: one piece of physics, its parameters, and the seams of the rollout at which it acts."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body, HandPath
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.forces import ForceLaw, FrictionLaw
from physid_drake.cell.soft_tip import Mount
from physid_drake.cell.support import PressureGrid
from physid_drake.ranges import ANY, Range
from physid_drake.recording import Shape

Array = NDArray[np.float64]
Pose = tuple[float, float, float]


def parameter(null: Any, unit: str, *, period: float | None = None, values: Range = ANY) -> Any:
    """A field of an effect: its null value, which is its default; its unit, period (pi for an axis) and range."""
    return dc.field(default=null, metadata={"unit": unit, "period": period, "values": values})


@dc.dataclass(frozen=True, kw_only=True)
class Surroundings:
    """What sets the scale of an effect in a recording: object, table, speeds.

    Attributes:
        mass: about, kg.
        friction: about, with the table [-].
        size: (2,) extent of the underside along x and y of B [m].
        height: of the object [m].
        region: (2, 2) lower and upper corner of where the object was [m].
        top_speed: of the object [m/s].
        pushes: how many.
        has_hand: whether something pushes.
        rolls: whether the object is a lying cylinder.
    """

    mass: float
    friction: float
    size: Array
    height: float
    region: Array
    top_speed: float
    pushes: int
    has_hand: bool
    rolls: bool

    @property
    def weight(self) -> float:
        """N."""
        return GRAVITY * self.mass

    @property
    def radius(self) -> float:
        """Half the object's mean extent [m]."""
        return float(0.25 * self.size.sum())

    @property
    def slight(self) -> float:
        """A slight force: 1.5 % of the friction with the table [N]; moves a push's end by about a millimetre."""
        return 0.015 * self.friction * self.weight


@dc.dataclass(frozen=True, kw_only=True)
class Coordinate:
    """One coordinate of an effect's chart.

    Attributes:
        name: of the coordinate; where the chart's are the effect's parameters, of the parameter.
        log: whether it is the logarithm of the parameter.
        step: for differences: moves an object by about a millimetre.
        lower, upper: bounds.
        std: prior standard deviation about the chart point where a fit starts; inf where nothing is known.
        tolerance: what a model is not expected to be better than: the simulator's own geometry and the caliper's. A
            mismatch that small is not missing physics.
    """

    name: str
    log: bool = False
    step: float
    lower: float = -np.inf
    upper: float = np.inf
    std: float = np.inf
    tolerance: float = 0.0

    def parameter_at(self, value: float) -> float:
        """The parameter at a value of the coordinate."""
        return math.exp(value) if self.log else float(value)


@dc.dataclass(frozen=True, kw_only=True)
class Family:
    """Small versions of an effect whose signatures are combined linearly in a score test.

    Attributes:
        point: (k,) chart point at which the effect is null.
        free: indices of the coordinates that leave it.
        central: take central differences, since the effect builds another cell, whose quadrature differs by more
            than a step does.
        size: steps to take: more than one where a large effect looks different from a small one.
        shares: of the effect's simulated families, in their order: so much of each, added up, is this one, which then
            needs no rollouts of its own; empty where it is simulated.
    """

    point: tuple[float, ...]
    free: tuple[int, ...]
    central: bool = False
    size: float = 1.0
    shares: tuple[float, ...] = ()


def families_of_sizes(*sizes: float) -> tuple[Family, ...]:
    """Families of a chart with one coordinate: small and large amplitudes."""
    return tuple(Family(point=(0.0,), free=(0,), size=size) for size in sizes)


@dc.dataclass(frozen=True, kw_only=True)
class PushFacts:
    """What an effect may know of the push that is simulated.

    Attributes:
        order: number of the push in the recording, from 0.
        mass: of the object [kg].
        polar: mean square distance of the underside's points from its centre [m^2].
        rolling_radius: of a lying cylinder, else None [m].
        region: (2, 2) lower and upper corner of where the object may come [m].
        hand_axes: (2, 2) the axes of P, as columns, along x and y of W.
    """

    order: int
    mass: float
    polar: float
    rolling_radius: float | None = None
    region: Array = dc.field(default_factory=lambda: np.array([[-1.0, -1.0], [1.0, 1.0]]))
    hand_axes: Array = dc.field(default_factory=lambda: np.eye(2))


@dc.dataclass(frozen=True, kw_only=True)
class Effect:
    """One piece of physics. Fields are its parameters; the defaults are null values, at which it does nothing.

    A subclass overrides one or two of the seams, whose defaults do nothing, and describes its chart: coordinates
    without bounds trouble in which fits and score tests move (an angle is a bad one where the ratio is 1).

    Attributes:
        name: as in the catalogue.
        element: what it belongs to: table, object, hand, sensor or world.
        statement: one sentence for a person.
        frame: in which the missing physics is constant.
    """

    name: ClassVar[str]
    element: ClassVar[str]
    statement: ClassVar[str]
    frame: ClassVar[str]
    # Of which parameters the null values make the effect vanish.
    amplitudes: ClassVar[tuple[str, ...]]
    # Parameters that the catalogue does not have.
    beyond: ClassVar[tuple[str, ...]] = ()
    # Names of effects that it is the same as in a limit: a tether far away is a tilt.
    limits: ClassVar[tuple[str, ...]] = ()

    @property
    def is_null(self) -> bool:
        """Whether the effect does nothing."""
        return all(getattr(self, name) == null for name, null in self.nulls().items() if null is not None)

    @classmethod
    def units(cls) -> dict[str, str]:
        """Unit of each parameter."""
        return {f.name: f.metadata["unit"] for f in dc.fields(cls)}

    @classmethod
    def nulls(cls) -> dict[str, Any]:
        """Null value of each amplitude; None for what shapes the effect."""
        return {f.name: f.default if f.name in cls.amplitudes else None for f in dc.fields(cls)}

    @classmethod
    def periods(cls) -> dict[str, float | None]:
        """Period of each parameter; None for what is not periodic."""
        return {f.name: f.metadata["period"] for f in dc.fields(cls)}

    @classmethod
    def ranges(cls) -> dict[str, Range]:
        """Which values each parameter can have."""
        return {f.name: f.metadata["values"] for f in dc.fields(cls)}

    # Chart.

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """Whether the effect can be in such a recording."""
        del around
        return True

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coordinates."""
        raise NotImplementedError

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Where score tests leave the null; the default is the origin, in all coordinates."""
        count = len(cls.chart(around))
        return (Family(point=(0.0,) * count, free=tuple(range(count))),)

    @classmethod
    def leading(cls, around: Surroundings) -> tuple[int, ...]:
        """Indices of the coordinates that a first fit moves; the others follow once the effect is accepted."""
        return tuple(range(len(cls.chart(around))))

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> Self:
        """The effect at a chart point (k,); the default takes the coordinates for the parameters or their logs."""
        return cls(**{c.name: c.parameter_at(value) for c, value in zip(cls.chart(around), point, strict=True)})

    # Seams.

    def reshaped(self, shape: Shape) -> Shape:
        """The object's shape."""
        return shape

    def pressure(self) -> PressureGrid | None:
        """The pressure under the object, or None for an even one."""
        return None

    def heaviness(self) -> float:
        """Weight of all that stands on the table over the weight of what moves as one with the object."""
        return 1.0

    def body(self, body: Body, facts: PushFacts) -> Body:
        """Body and contact parameters."""
        del facts
        return body

    def laws(self, facts: PushFacts) -> Sequence[ForceLaw]:
        """Forces."""
        del facts
        return ()

    def frictions(self, facts: PushFacts) -> Sequence[FrictionLaw]:
        """Friction laws."""
        del facts
        return ()

    def hand(self, path: HandPath, facts: PushFacts) -> HandPath:
        """The path of the tip, or of its mount where it gives way."""
        del facts
        return path

    def mount(self, facts: PushFacts) -> Mount | None:
        """What holds a tip that gives way, or None for a rigid one."""
        del facts
        return None

    def true_pose(self, pose: Pose) -> Pose:
        """Pose of B for a pose that the tracker reports."""
        return pose

    def lateness(self) -> float:
        """By how much the tracker is late [s]."""
        return 0.0

    def tracked(self, poses: Array) -> Array:
        """What the tracker reports (n, 3) for poses (n, 3) x, y, yaw of B."""
        return poses
