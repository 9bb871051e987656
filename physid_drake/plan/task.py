"""A task made from a goal: which way and how far the hand goes, unless it is told."""

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
    """What a person may fix; None leaves it to the task.

    Attributes:
        speed: of ``push_direction`` [m/s].
        direction: of ``push_speed``, else the middle of the directions searched [rad].
        travel: of the hand from the touch to the brake [m].
    """

    speed: float | None = None
    direction: float | None = None
    travel: float | None = None


def policy_for(name: str, model: Model, start: Pose, goal: Point, choices: Choices | None = None) -> Policy:
    """The policy of a name, towards a goal.

    The hand goes half the way, or as far as leaves a slide that half the greatest speed's energy makes, if that is
    further; ``push_direction`` carries the object all the way but for its slide.

    Args:
        name: in ``POLICIES``.
        model: for the friction, which says how far an object slides.
        start: of the object.
        goal: x, y [m].
        choices: what is fixed.

    Raises:
        ConfigError: if the policy is unknown, does not take a choice, or start or goal is not on the table.
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
    """Refuse a start or a goal that is not on the table, and a goal where the object is already.

    Raises:
        ConfigError: saying which.
    """
    check_place("goal", goal, table)
    check_place("start", start[:2], table)
    distance = math.dist(start[:2], goal)
    if distance < NEAREST:
        raise ConfigError(f"goal: the object is {1e3 * distance:.1f} mm from it already; choose one further away.")


def check_place(what: str, place: Point, table: Corners) -> None:
    """Refuse a place that is not on the table.

    Raises:
        ConfigError: if it is not finite or beyond an edge.
    """
    (x0, y0), (x1, y1) = table
    x, y = place
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ConfigError(f"{what}: must be two finite numbers in m, but is {x:g}, {y:g}.")
    if not (x0 <= x <= x1 and y0 <= y <= y1):
        reach = f"from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m"
        raise ConfigError(f"{what}: ({x:g}, {y:g}) m is not on the table, which reaches {reach}.")


def default_goal(start: Pose, table: Corners) -> Point:
    """A goal 0.3 m ahead of the object along +x, or as fits on the table; the roomiest way where +x has none."""
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
