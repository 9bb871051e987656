"""Effects of the object itself: pressure, centre of mass, inertia, size, bounce."""

from __future__ import annotations

import dataclasses as dc
import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body
from physid_drake.cell.support import PressureGrid
from physid_drake.effects.effect import (
    Coordinate,
    Effect,
    Family,
    PushFacts,
    Surroundings,
    families_of_sizes,
    parameter,
)
from physid_drake.ranges import COEFFICIENT, POSITIVE
from physid_drake.recording import Box, Cylinder, MeshShape, Prism, Shape

Array = NDArray[np.float64]
GRID = 3  # weights along a side
# Of the grid's cells along a side, from -1 to 1.
_MIDDLES = (np.arange(GRID) - 0.5 * (GRID - 1)) / (0.5 * (GRID - 1))


@dc.dataclass(frozen=True, kw_only=True)
class UnevenSupport(Effect):
    """The pressure under the object is not even: a regular grid of weights, rows along x of B, columns along y.

    The support is a bed of springs whose stiffness follows the weights, so that the pressure still balances the
    centre of mass: of a weight that is larger on one side only the part that balance leaves is seen.
    """

    name: ClassVar[str] = "uneven_support"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "the object does not press evenly on the table"
    frame: ClassVar[str] = "object"
    amplitudes: ClassVar[tuple[str, ...]] = ("weights",)

    weights: tuple[tuple[float, ...], ...] = parameter(((1.0,),), "-")

    @property
    def is_null(self) -> bool:
        """Whether all weights are equal."""
        values = [w for row in self.weights for w in row]
        return max(values) == min(values)

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """Not under a lying cylinder, which stands on a line."""
        return not around.rolls

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Three second moments of the log pressure, then the log weight of each grid cell beside them."""
        del around
        moments = tuple(
            Coordinate(name=name, step=0.15, lower=-6.0, upper=6.0, std=1.5, tolerance=0.03)
            for name in ("ends_x", "ends_y", "corners")
        )
        cells = tuple(
            Coordinate(name=f"log_weight_{i}_{j}", step=0.2, lower=-4.0, upper=4.0, std=0.7)
            for i in range(GRID)
            for j in range(GRID)
        )
        return moments + cells

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """The three moments."""
        del around
        return (Family(point=(0.0,) * (3 + GRID * GRID), free=(0, 1, 2), central=True),)

    @classmethod
    def leading(cls, around: Surroundings) -> tuple[int, ...]:
        """The moments: friction and torque feel little of the rest."""
        del around
        return (0, 1, 2)

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> UnevenSupport:
        """From moments and log weights."""
        del around
        if not np.any(point):
            return cls()
        x, y = np.meshgrid(_MIDDLES, _MIDDLES, indexing="ij")
        log = point[0] * x * x + point[1] * y * y + point[2] * x * y + point[3:].reshape(GRID, GRID)
        weights = np.exp(log - log.mean())
        weights /= weights.mean()
        return cls(weights=tuple(tuple(row) for row in weights.tolist()))

    def pressure(self) -> PressureGrid | None:
        """The grid."""
        if self.is_null:
            return None
        return PressureGrid(weights=self.weights)


@dc.dataclass(frozen=True, kw_only=True)
class ComOffset(Effect):
    """The centre of mass is not the centre of the shape; the pressure moves with it."""

    name: ClassVar[str] = "com_offset"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "the centre of mass is not the centre of the shape"
    frame: ClassVar[str] = "object"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y")

    x: float = parameter(0.0, "m")
    y: float = parameter(0.0, "m")

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The offsets."""
        return tuple(
            Coordinate(name=name, step=0.005 * size, lower=-0.4 * size, upper=0.4 * size, tolerance=1e-4)
            for name, size in zip(("x", "y"), around.size.tolist(), strict=True)
        )

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """A cylinder that rolls would rock about such a centre, which the cell does not model."""
        return not around.rolls

    def body(self, body: Body, facts: PushFacts) -> Body:
        """The body with its centre moved."""
        del facts
        return dc.replace(body, p_BBcm=body.p_BBcm + np.array([self.x, self.y]))


@dc.dataclass(frozen=True, kw_only=True)
class RotationalInertia(Effect):
    """Mass nearer to or further from the centre than uniform density says."""

    name: ClassVar[str] = "rotational_inertia"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "the object resists turning more or less than its shape says"
    frame: ClassVar[str] = "object"
    amplitudes: ClassVar[tuple[str, ...]] = ("ratio",)

    ratio: float = parameter(1.0, "-", values=POSITIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Log ratio."""
        del around
        return (
            Coordinate(name="ratio", log=True, step=0.05, lower=math.log(0.1), upper=math.log(5.0), tolerance=0.01),
        )

    def body(self, body: Body, facts: PushFacts) -> Body:
        """The body with its inertia scaled."""
        del facts
        return dc.replace(body, inertia_ratio=self.ratio * body.inertia_ratio)


@dc.dataclass(frozen=True, kw_only=True)
class Restitution(Effect):
    """The object bounces off the tip at first contact (Poisson's coefficient)."""

    name: ClassVar[str] = "restitution"
    element: ClassVar[str] = "hand"
    statement: ClassVar[str] = "the object bounces off the tip when it is first touched"
    frame: ClassVar[str] = "contact"
    amplitudes: ClassVar[tuple[str, ...]] = ("coefficient",)

    coefficient: float = parameter(0.0, "-", values=COEFFICIENT)

    @classmethod
    def applies(cls, around: Surroundings) -> bool:
        """With a hand."""
        return around.has_hand

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """The coefficient's square: a bounce is caught up by the hand, and what is seen of it grows with that."""
        del around
        return (Coordinate(name="square", step=0.01, lower=0.0, upper=0.9),)

    @classmethod
    def at(cls, point: Array, around: Surroundings) -> Restitution:
        """From the square."""
        del around
        return cls(coefficient=math.sqrt(max(0.0, float(point[0]))))

    @classmethod
    def families(cls, around: Surroundings) -> tuple[Family, ...]:
        """Small and large: coefficients of 0.1 and 0.4."""
        del around
        return families_of_sizes(1.0, 16.0)

    def body(self, body: Body, facts: PushFacts) -> Body:
        """The body with its bounce."""
        del facts
        return dc.replace(body, restitution=min(1.0, body.restitution + self.coefficient))


@dc.dataclass(frozen=True, kw_only=True)
class SizeError(Effect):
    """The object is ``ratio`` times as large as its model, in all directions."""

    name: ClassVar[str] = "size_error"
    element: ClassVar[str] = "object"
    statement: ClassVar[str] = "the object is larger or smaller than its model"
    frame: ClassVar[str] = "object"
    amplitudes: ClassVar[tuple[str, ...]] = ("ratio",)

    ratio: float = parameter(1.0, "-", values=POSITIVE)

    @classmethod
    def chart(cls, around: Surroundings) -> tuple[Coordinate, ...]:
        """Log ratio."""
        most = math.log(2.0)
        return (
            Coordinate(name="ratio", log=True, step=0.006, lower=-most, upper=most, tolerance=1e-4 / around.radius),
        )

    def reshaped(self, shape: Shape) -> Shape:
        """The shape, scaled."""
        r = self.ratio
        match shape:
            case Box():
                x, y, z = shape.size
                return dc.replace(shape, size=(r * x, r * y, r * z))
            case Cylinder():
                return dc.replace(shape, radius=r * shape.radius, length=r * shape.length)
            case Prism():
                corners = tuple((r * x, r * y) for x, y in shape.polygon)
                return dc.replace(shape, polygon=corners, height=r * shape.height)
            case MeshShape():
                return dc.replace(shape, scale=r * shape.scale)
        raise TypeError(f"no size for a shape of type {type(shape).__name__}")
