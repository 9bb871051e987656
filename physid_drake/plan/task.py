"""Policies for a goal: in which direction and how far the hand moves, unless these are given."""

from __future__ import annotations

import dataclasses as dc
import math

import numpy as np

from physid_drake.cell.diagram import GRAVITY
from physid_drake.errors import ConfigError
from physid_drake.model import Model
from physid_drake.plan.costs import Corners
from physid_drake.plan.trajectory import true_solid
from physid_drake.policies import POLICIES, Policy, policy_named
from physid_drake.policies.policy import CARRYING_SPEED, SPEEDS, Reach

Pose = tuple[float, float, float]
Point = tuple[float, float]

NEAREST = 5e-3  # m: a goal nearer than this needs no push
LEAST_TRAVEL = 5e-3  # m
LEAST_RADIUS = 1e-3  # m: the middle of a mesh may lie on its outline
DEFAULT_DISTANCE = 0.3  # m
ROOM_SHARE = 0.6  # of the way to the table's edge


@dc.dataclass(frozen=True, kw_only=True)
class Choices:
    """Settings that a person fixes; None leaves them to the policy.

    Attributes:
        speed: of the hand, for ``push_direction`` [m/s].
        direction: of the hand in W, for ``push_speed``; otherwise the middle of the directions that are searched
            [rad].
        travel: of the hand from the touch to the brake [m].
    """

    speed: float | None = None
    direction: float | None = None
    travel: float | None = None


def policy_for(name: str, model: Model, start: Pose, goal: Point, choices: Choices | None = None) -> Policy:
    """A policy towards a goal.

    Unless it is given, the hand's travel is half the distance to the goal; it is longer if half of the kinetic energy
    at the greatest speed would not slide the object the rest of the way. In ``push_direction`` it is the whole
    distance less the slide from the given speed.

    Args:
        name: in ``POLICIES``.
        model: its friction says how far the object slides.
        start: of the object, x, y [m], yaw [rad].
        goal: x, y [m].
        choices: settings that are fixed.

    Raises:
        ConfigError: if the policy is unknown or does not take a choice, or start or goal is not on the table.
    """
    choices = choices or Choices()
    check_task(start, goal, model.table)
    _check_choices(name, choices, model.table)
    way = np.subtract(goal, start[:2])
    distance = float(np.hypot(*way))
    speed = CARRYING_SPEED if choices.speed is None else choices.speed
    heading = math.atan2(way[1], way[0]) if choices.direction is None else choices.direction
    travel = _travel(name, model, distance, speed) if choices.travel is None else choices.travel
    inner = max(LEAST_RADIUS, -true_solid(model).outline.nearest(0.0, 0.0)[0])
    reach = Reach(heading=heading, travel=travel, inner_radius=inner, speed=speed)
    return policy_named(name, reach)


def check_task(start: Pose, goal: Point, table: Corners) -> None:
    """Refuse a start or goal that is not on the table, and a goal closer than ``NEAREST`` to the start.

    Args:
        start: of the object, x, y [m], yaw [rad].
        goal: x, y [m].
        table: lower and upper corner of its top [m].

    Raises:
        ConfigError: if one of these is so; it says which.
    """
    check_place("goal", goal, table)
    check_place("start", start[:2], table)
    distance = math.dist(start[:2], goal)
    if distance < NEAREST:
        raise ConfigError(f"goal: the object is {1e3 * distance:.1f} mm from it already; choose one further away.")


def check_place(what: str, place: Point, table: Corners) -> None:
    """Refuse a place that is not on the table.

    Args:
        what: the name of the place, for the message.
        place: x, y [m].
        table: lower and upper corner of its top [m].

    Raises:
        ConfigError: if it is not finite or not on the table.
    """
    (x0, y0), (x1, y1) = table
    x, y = place
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ConfigError(f"{what}: must be two finite numbers in m, but is {x:g}, {y:g}.")
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        reach = f"from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"
        raise ConfigError(f"{what}: ({x:g}, {y:g}) m is not on the table, which reaches {reach}.")


def default_goal(start: Pose, table: Corners) -> Point:
    """A goal [m] for an object at ``start``: 0.3 m ahead along +x, or less if the table ends.

    Where there is hardly room along +x, it lies along the axis with the most room.
    """
    (x0, y0), (x1, y1) = table
    x, y = start[:2]
    rooms = {(1.0, 0.0): x1 - x, (-1.0, 0.0): x - x0, (0.0, 1.0): y1 - y, (0.0, -1.0): y - y0}
    ahead = (1.0, 0.0)
    if ROOM_SHARE * rooms[ahead] < 0.5 * DEFAULT_DISTANCE:
        ahead = max(rooms, key=lambda way: rooms[way])
    distance = min(DEFAULT_DISTANCE, ROOM_SHARE * rooms[ahead])
    return x + distance * ahead[0], y + distance * ahead[1]


def _check_choices(name: str, choices: Choices, table: Corners) -> None:
    if name not in POLICIES:
        raise ConfigError(f"policy '{name}' is unknown; known are {', '.join(POLICIES)}.")
    if choices.speed is not None and name != "push_direction":
        raise ConfigError(f"policy '{name}': plans the speed itself; a fixed speed is for push_direction.")
    if choices.direction is not None and name == "push_direction":
        raise ConfigError("policy 'push_direction': plans the direction itself; a fixed one is for push_speed.")
    longest = math.dist(*table)
    if choices.travel is not None and not 0.0 < choices.travel <= longest:
        raise ConfigError(
            f"policy: the travel must be above 0 m and no longer than the table, {longest:g} m, but is"
            f" {choices.travel:g} m."
        )
    low, high = SPEEDS
    if choices.speed is not None and not low <= choices.speed <= high:
        raise ConfigError(
            f"policy: the speed must lie between {low:g} and {high:g} m/s, but is {choices.speed:g} m/s."
        )


def _travel(name: str, model: Model, distance: float, speed: float) -> float:
    friction = float(np.mean(model.body.support_friction))
    if name == "push_direction":
        return max(LEAST_TRAVEL, distance - speed**2 / (2.0 * friction * GRAVITY))
    slide = 0.5 * SPEEDS[1] ** 2 / (2.0 * friction * GRAVITY)
    return max(LEAST_TRAVEL, 0.5 * distance, distance - slide)
