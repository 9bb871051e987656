"""The reach of robots on a table: discs about their bases, which stand behind edges as in the shipped cell."""

from __future__ import annotations

import dataclasses as dc
from functools import cache

import numpy as np
import yaml
from numpy.typing import NDArray

from physid_drake.errors import ConfigError
from physid_drake.plan.costs import Corners, WithinDisc
from physid_drake.resources import shipped
from physid_drake.wording import shown

Array = NDArray[np.float64]

NAMES = {"motoman_sda10f": "motoman", "baxter": "baxter"}
CHORDS = 80  # of a drawing
SHIPPED_TABLE = (1.20, 0.80)  # m
INSIDE = 0.05  # m: so far within a robot's reach an object is to stop


@dc.dataclass(frozen=True, kw_only=True)
class RobotReach:
    """The reach of a robot on the table: a disc.

    Attributes:
        base: x, y of its centre in W [m].
        radius: at the table's height [m]. It neglects the hand's orientation, and is therefore an upper bound.
    """

    base: tuple[float, float]
    radius: float

    def beyond(self, places: Array) -> Array:
        """Distance (n,) of places (n, 2) from the disc [m]; 0 inside it."""
        away = np.atleast_2d(places) - np.array(self.base)
        distance: Array = np.hypot(away[:, 0], away[:, 1])
        return np.asarray(np.maximum(0.0, distance - self.radius), dtype=np.float64)

    def chords(self, table: Corners) -> Array:
        """The part of the disc that is on a table, for drawing: rows (n, 3) of x, and of y from and to [m].

        There are no rows where no part is on the table.
        """
        (x0, y0), (x1, y1) = table
        x = np.linspace(max(x0, self.base[0] - self.radius), min(x1, self.base[0] + self.radius), CHORDS)
        half = np.sqrt(np.maximum(0.0, self.radius**2 - (x - self.base[0]) ** 2))
        low, high = np.maximum(y0, self.base[1] - half), np.minimum(y1, self.base[1] + half)
        there = (low < high) & (x[0] < x[-1])
        rows: Array = np.column_stack([x, low, high])[there]
        return rows


def reaches(table: Corners) -> dict[str, RobotReach]:
    """The reach of ``motoman`` and ``baxter``, by these names.

    Each stands as far behind the middle of its edge of the table (-x, +x) as in the shipped cell.

    Args:
        table: lower and upper corner of its top [m].
    """
    (x0, y0), (x1, y1) = table
    shift = {"motoman": x0, "baxter": x1}
    return {
        name: RobotReach(base=(shift[name] + behind, 0.5 * (y0 + y1)), radius=radius)
        for name, (behind, radius) in _shipped().items()
    }


def goal_within(name: str, table: Corners, start: tuple[float, float]) -> tuple[WithinDisc, tuple[float, float]]:
    """The cost of resting where a robot reaches, and the place [m] well inside its reach nearest to the start.

    Args:
        name: of the robot.
        table: lower and upper corner of its top [m].
        start: of the object, x, y [m].

    Raises:
        ConfigError: if there is no such robot, it reaches no place on the table, or it reaches the object already.
    """
    robots = reaches(table)
    if name not in robots:
        raise ConfigError(f"reach: the robots are {' and '.join(sorted(robots))}, but got {shown(name)}.")
    reach = robots[name]
    if not len(reach.chords(table)):
        raise ConfigError(f"reach: the {name} does not reach this table.")
    way = np.subtract(start, reach.base)
    distance = float(np.hypot(*way))
    if distance <= reach.radius:
        raise ConfigError(f"reach: the {name} reaches the object already; choose another start or goal.")
    x, y = (np.array(reach.base) + (reach.radius - INSIDE) / distance * way).tolist()
    return WithinDisc(centre=reach.base, radius=reach.radius - INSIDE), (x, y)


def beyond_reach(table: Corners, hand: Array, end: Array) -> list[str]:
    """Parts of a plan that the robots of the shipped cell cannot reach, one line each.

    There is no line for a table of another size.

    Args:
        table: lower and upper corner of its top [m].
        hand: (n, 2) the hand's way [m].
        end: (2,) where the object stops [m].
    """
    low, high = np.array(table)
    if not (np.allclose(high - low, SHIPPED_TABLE) and np.allclose(low + high, 0.0)):
        return []
    robots, lines = reaches(table), []
    far = float(robots["motoman"].beyond(hand).max())
    if far > 0.0:
        lines.append(f"the hand goes {1e3 * far:.0f} mm beyond where the Motoman reaches")
    far = float(robots["baxter"].beyond(end)[0])
    if far > 0.0:
        lines.append(f"the object stops {1e3 * far:.0f} mm beyond where the Baxter reaches")
    return lines


@cache
def _shipped() -> dict[str, tuple[float, float]]:
    """Of each robot: x of its base beyond its edge of the table, and its reach [m]."""
    content = yaml.safe_load((shipped("models") / "robots" / "reach.yaml").read_text("utf-8"))
    half = 0.5 * content["table"]["size_m"][0]
    found = {}
    for key, name in NAMES.items():
        robot = content["robots"][key]
        x = robot["base_m"][0]
        found[name] = (x + half if x < 0.0 else x - half, robot["reach_m"])
    return found
