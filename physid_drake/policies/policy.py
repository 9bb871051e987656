"""Policies: families of pushes, each with a parameter space of settings."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Mapping
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import ConfigError
from physid_drake.policies.planned_push import PlannedPush
from physid_drake.space import Parameter, ParameterSpace

Array = NDArray[np.float64]

SPEEDS = (0.02, 1.0)  # m/s
SECTOR = 0.5 * math.pi  # rad to each side of the heading
CARRYING_SPEED = 0.05  # m/s: at this speed an object stops about where the hand does
FACE_SHARE = 0.8  # of the outline's inner radius, so that the tip meets the face and not its corner


@dc.dataclass(frozen=True, kw_only=True)
class Reach:
    """What bounds a policy's settings.

    Attributes:
        heading: the middle of all directions [rad], where the goal lies from the object.
        travel: of the hand from the touch to the brake [m].
        inner_radius: of the largest circle about the object's middle inside its outline [m].
        speeds: least and greatest speed of the hand [m/s].
        speed: where a policy holds it [m/s].
    """

    heading: float
    travel: float
    inner_radius: float
    speeds: tuple[float, float] = SPEEDS
    speed: float = CARRYING_SPEED

    def __post_init__(self) -> None:
        low, high = self.speeds
        numbers = (self.heading, self.travel, self.inner_radius, low, high, self.speed)
        if not all(math.isfinite(v) for v in numbers) or not (self.travel > 0.0 and self.inner_radius > 0.0):
            raise ConfigError(f"policy: needs a finite heading and a travel above 0 m, but got {self}.")
        if not (0.0 < low < high and low <= self.speed <= high):
            raise ConfigError(
                f"policy: the speed must lie between {low:g} and {high:g} m/s, but is {self.speed:g} m/s."
            )


class Policy(Protocol):
    """A family of pushes."""

    @property
    def name(self) -> str:
        """As in ``POLICIES``."""
        ...

    @property
    def space(self) -> ParameterSpace:
        """The settings."""
        ...

    @property
    def swept(self) -> str:
        """The setting that a sweep goes over."""
        ...

    def pushes(self, settings: Array) -> tuple[PlannedPush, ...]:
        """The pushes of settings (d,) in their order; each begins where the object of the one before stopped."""
        ...


@dc.dataclass(frozen=True, kw_only=True)
class PushSpeed:
    """One push straight along the heading; the speed is free."""

    reach: Reach
    name: str = "push_speed"
    swept: str = "speed"

    @cached_property
    def space(self) -> ParameterSpace:
        """Speed [m/s]."""
        return ParameterSpace(parameters=(_speed(self.reach),))

    def pushes(self, settings: Array) -> tuple[PlannedPush, ...]:
        """The push of settings (1,)."""
        (speed,) = _checked(self.space, settings)
        return (PlannedPush(direction=self.reach.heading, speed=speed, travel=self.reach.travel),)


@dc.dataclass(frozen=True, kw_only=True)
class PushDirection:
    """One push at a fixed speed through the object's middle; the direction is free."""

    reach: Reach
    name: str = "push_direction"
    swept: str = "direction"

    @cached_property
    def space(self) -> ParameterSpace:
        """Direction [rad]."""
        return ParameterSpace(parameters=(_direction(self.reach),))

    def pushes(self, settings: Array) -> tuple[PlannedPush, ...]:
        """The push of settings (1,)."""
        (direction,) = _checked(self.space, settings)
        return (PlannedPush(direction=direction, speed=self.reach.speed, travel=self.reach.travel),)


@dc.dataclass(frozen=True, kw_only=True)
class PushAnywhere:
    """One push; direction, speed and the place of the contact on the face are free."""

    reach: Reach
    name: str = "push"
    swept: str = "speed"

    @cached_property
    def space(self) -> ParameterSpace:
        """Direction [rad], speed [m/s], contact offset [m]."""
        most = FACE_SHARE * self.reach.inner_radius
        offset = Parameter(
            name="contact_offset", unit="m", lower=-most, upper=most, prior_mean=0.0,
            description="of the hand's line from the object's middle, to the left of the motion",
        )  # fmt: skip
        return ParameterSpace(parameters=(_direction(self.reach), _speed(self.reach), offset))

    def pushes(self, settings: Array) -> tuple[PlannedPush, ...]:
        """The push of settings (3,)."""
        direction, speed, offset = _checked(self.space, settings)
        return (PlannedPush(direction=direction, speed=speed, travel=self.reach.travel, contact_offset=offset),)


@dc.dataclass(frozen=True, kw_only=True)
class TwoPushes:
    """Two pushes through the object's middle, each over half the travel; directions and speeds are free."""

    reach: Reach
    name: str = "two_pushes"
    swept: str = "speed_2"

    @cached_property
    def space(self) -> ParameterSpace:
        """Direction [rad] and speed [m/s] of the first and of the second push."""
        both = (_direction(self.reach), _speed(self.reach))
        return ParameterSpace(parameters=tuple(dc.replace(p, name=f"{p.name}_{k}") for k in (1, 2) for p in both))

    def pushes(self, settings: Array) -> tuple[PlannedPush, ...]:
        """The pushes of settings (4,)."""
        values = _checked(self.space, settings)
        half = 0.5 * self.reach.travel
        return tuple(
            PlannedPush(direction=values[k], speed=values[k + 1], travel=half) for k in (0, 2)
        )  # fmt: skip


POLICIES: Mapping[str, type[PushSpeed] | type[PushDirection] | type[PushAnywhere] | type[TwoPushes]] = {
    "push_speed": PushSpeed,
    "push_direction": PushDirection,
    "push": PushAnywhere,
    "two_pushes": TwoPushes,
}


def policy_named(name: str, reach: Reach) -> Policy:
    """The policy of a name.

    Raises:
        ConfigError: if there is none.
    """
    if name not in POLICIES:
        raise ConfigError(f"policy '{name}' is unknown; known are {', '.join(POLICIES)}.")
    return POLICIES[name](reach=reach)


def _speed(reach: Reach) -> Parameter:
    low, high = reach.speeds
    return Parameter(name="speed", unit="m/s", lower=low, upper=high, prior_mean=0.5 * (low + high),
                     description="of the hand from the touch to the brake")  # fmt: skip


def _direction(reach: Reach) -> Parameter:
    return Parameter(name="direction", unit="rad", lower=reach.heading - SECTOR, upper=reach.heading + SECTOR,
                     prior_mean=reach.heading, description="of the hand's motion, 0 along x")  # fmt: skip


def _checked(space: ParameterSpace, settings: Array) -> list[float]:
    space.check(settings)
    return [float(v) for v in settings]
