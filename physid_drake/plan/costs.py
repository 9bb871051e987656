"""Costs of a trajectory, which a plan minimises."""

from __future__ import annotations

import dataclasses as dc
import itertools
import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import ConfigError
from physid_drake.plan.trajectory import Ending, Trajectory

Array = NDArray[np.float64]
Corners = tuple[tuple[float, float], tuple[float, float]]

LOSS = 1.1  # times the worst cost on the table


class Cost(Protocol):
    """How far from its goal an object comes to rest."""

    def at(self, place: Array) -> float:
        """Cost [m] of resting at a place, x, y (2,) [m]; 0 is best.

        On a rectangle its maximum must be at a corner, as that of a convex function is: ``loss_of`` relies on it.
        """
        ...


@dc.dataclass(frozen=True, kw_only=True)
class DistanceToGoal:
    """Distance from a point.

    Attributes:
        goal: x, y [m].
    """

    goal: tuple[float, float]

    def at(self, place: Array) -> float:
        """The distance [m] of a place, x, y (2,) [m]."""
        return math.hypot(float(place[0]) - self.goal[0], float(place[1]) - self.goal[1])


@dc.dataclass(frozen=True, kw_only=True)
class InsideRegion:
    """Zero in a rectangle; outside, about the distance from it, and smooth at its edge.

    Attributes:
        lower: corner, x, y [m].
        upper: opposite corner, x, y [m].
        softness: distance over which the slope of the cost rises from 0 to 1 [m].

    Raises:
        ConfigError: if ``lower`` is not below ``upper``, or ``softness`` not above 0.
    """

    lower: tuple[float, float]
    upper: tuple[float, float]
    softness: float = 0.01

    def __post_init__(self) -> None:
        if not (self.lower[0] < self.upper[0] and self.lower[1] < self.upper[1] and self.softness > 0.0):
            raise ConfigError(f"region: needs lower < upper and a softness above 0 m, but got {self}.")

    def at(self, place: Array) -> float:
        """The smoothed distance [m] of a place, x, y (2,) [m]."""
        outside = [
            max(a - float(v), float(v) - b, 0.0) for a, b, v in zip(self.lower, self.upper, place, strict=True)
        ]
        return math.hypot(*outside, self.softness) - self.softness


@dc.dataclass(frozen=True, kw_only=True)
class WithinDisc:
    """Zero in a disc, such as the reach of a robot; outside, about the distance from it, and smooth at its edge.

    Attributes:
        centre: x, y [m].
        radius: [m].
        softness: distance over which the slope of the cost rises from 0 to 1 [m].
    """

    centre: tuple[float, float]
    radius: float
    softness: float = 0.01

    def at(self, place: Array) -> float:
        """The smoothed distance [m] of a place, x, y (2,) [m]."""
        away = math.hypot(float(place[0]) - self.centre[0], float(place[1]) - self.centre[1])
        return math.hypot(max(0.0, away - self.radius), self.softness) - self.softness


def loss_of(cost: Cost, table: Corners) -> float:
    """The cost [m] of an object that falls, topples or does not stop: more than of resting anywhere on the table.

    It is at least ``LOSS`` times half the table's diagonal, for a cost that is zero on the whole table.

    Args:
        cost: of a resting object.
        table: lower and upper corner of its top [m].
    """
    (x0, y0), (x1, y1) = table
    corners = [cost.at(np.array(corner)) for corner in itertools.product((x0, x1), (y0, y1))]
    return LOSS * max(*corners, 0.5 * math.hypot(x1 - x0, y1 - y0))


def cost_of(cost: Cost, trajectory: Trajectory, table: Corners) -> float:
    """The cost of a trajectory [m]; infinite where the rollout diverged.

    Args:
        cost: of a resting object.
        trajectory: the prediction.
        table: lower and upper corner of its top [m], for the cost of a lost object.
    """
    if trajectory.ending is Ending.DIVERGED:
        return math.inf
    loss = loss_of(cost, table)
    # Where a moving object is when the rollout ends does not say where it will stop.
    return min(loss, cost.at(trajectory.end[:2])) if trajectory.ending is Ending.AT_REST else loss
