"""The twin of a cell: many rollouts of one object in one call of the compiled integrator."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body, HandPath, Outcome, Start
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.laws import Law
from physid_drake.cell.outline import Disc, Outline, Polygon
from physid_drake.cell.soft_tip import Mount
from physid_drake.cell.solid import Solid
from physid_drake.cell.support import FrictionGrid, PressureGrid, Support, support_of
from physid_drake.effects.liquid import Swing
from physid_drake.errors import CellError
from physid_drake.twin.batch import roll_all
from physid_drake.twin.records import BODY
from physid_drake.twin.rollout import COUNTS, DIVERGED, STUCK
from physid_drake.twin.support import TURNS_WITHIN
from physid_drake.twin.vocabulary import by_place, records_of

Array = NDArray[np.float64]

LIGHTEST_TIP = 1e-6  # kg
POINTS, POINTS_BY_PLACE = 36, 144
"""Under the object; more where friction depends on the place: its edges cross the base point by point."""


@dataclass(frozen=True, kw_only=True)
class TwinPush:
    """One rollout to make.

    Attributes:
        body: the physical parameters.
        start: the object's state at ``begin``.
        path: the hand's; None without a hand.
        begin, end: s.
        times: (n,) at which poses are asked for, increasing [s].
        hand_height: of the contact above the table [m]; half the object's height if None.
        laws: of the vocabulary: forces and frictions.
        swing: what swings inside; None where nothing does.
        mount: what holds a tip that gives way; None for one that is moved as the path says.
    """

    body: Body
    start: Start
    path: HandPath | None
    begin: float
    end: float
    times: Array
    hand_height: float | None = None
    laws: Sequence[Law] = ()
    swing: Swing | None = None
    mount: Mount | None = None


@dataclass(frozen=True, kw_only=True)
class Trace:
    """What a rollout says at the times that were asked for.

    Attributes:
        poses: (n, 3) x, y, yaw of B in W [m, rad].
        forces: (n, 2) of the hand on the object in W [N]; without the impulses of blows.
        outcome: how it ended; an object never falls here.
        tips: in how many stages nothing balanced the object: the cell has to be asked.
        lifts: in how many stages a part of the base carried nothing.
    """

    poses: Array
    forces: Array
    outcome: Outcome
    tips: int
    lifts: int


@dataclass(frozen=True, kw_only=True)
class Twin:
    """An object on an endless table, pushed by a round tip, as the compiled integrator sees it.

    Attributes:
        solid: the object's shape; it must not roll.
        hand_radius: of the tip [m]; None without a hand.
        grid: friction cells of ``body.support_friction``.
        pressure: under the object, where it is not even.
        gravity: m/s^2.
        points: support points, about; None takes what the laws need.
    """

    solid: Solid
    hand_radius: float | None
    grid: FrictionGrid = field(default_factory=FrictionGrid)
    pressure: PressureGrid | None = None
    gravity: float = GRAVITY
    points: int | None = None
    _supports: dict[int, Support] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.solid.rolling_radius is not None:
            raise CellError("the twin does not roll: a lying cylinder is the cell's.")

    @property
    def polar(self) -> float:
        """Mean square distance of the underside from Bo [m^2]."""
        return self._support(False).polar

    def rollouts(self, pushes: Sequence[TwinPush]) -> list[Trace]:
        """Simulate all pushes, each as if it were alone."""
        if not pushes:
            return []
        support = self._support(any(by_place(law) for push in pushes for law in push.laws))
        ends = np.cumsum([0, *(len(push.times) for push in pushes)])
        poses, forces = np.zeros((int(ends[-1]), 3)), np.zeros((int(ends[-1]), 2))
        counts = np.zeros(len(pushes), COUNTS)
        bodies = np.concatenate([self._record(push, support) for push in pushes])
        friction = np.array([push.body.support_friction[support.cells] for push in pushes])
        laws, law_ends, tables = records_of([(push.laws, push.body.mass * self.gravity) for push in pushes])
        knots, knot_ends = _knots(pushes)
        starts = np.array([(*push.start.pose, *push.start.velocity) for push in pushes])
        roll_all(  # type: ignore[no-untyped-call]
            bodies, (np.ascontiguousarray(support.points), support.weights, support.radii), friction,
            _edges(self.solid.outline), knots, knot_ends, starts, laws, law_ends, tables,
            np.concatenate([push.times for push in pushes]).astype(np.float64), ends, poses, forces, counts,
        )  # fmt: skip
        return [
            _trace(poses[ends[k] : ends[k + 1]], forces[ends[k] : ends[k + 1]], counts[k]) for k in range(len(pushes))
        ]

    def _support(self, needs_many: bool) -> Support:
        count = self.points or (POINTS_BY_PLACE if needs_many else POINTS)
        if count not in self._supports:
            self._supports[count] = support_of(self.solid.underside, self.grid, count, pressure=self.pressure)
        return self._supports[count]

    def _record(self, push: TwinPush, support: Support) -> NDArray[np.void]:
        body, solid = push.body, self.solid
        record = np.zeros(1, BODY)
        com_x, com_y = (float(value) for value in body.p_BBcm)
        height = 0.5 * solid.height if push.hand_height is None else push.hand_height
        away = np.hypot(*(support.points - body.p_BBcm).T)
        values = {
            "mass": body.mass, "inertia": body.mass * body.inertia_ratio * solid.gyration[2],
            "weight": body.mass * self.gravity, "com_x": com_x, "com_y": com_y, "com_height": 0.5 * solid.height,
            "outline_radius": solid.outline.radius if isinstance(solid.outline, Disc) else 0.0,
            "tip_radius": self.hand_radius or 0.0, "tip_arm": height - 0.5 * solid.height,
            "hand_friction": body.hand_friction, "restitution": body.restitution,
            "reach": float((away + TURNS_WITHIN * support.radii).max()), "begin": push.begin, "end": push.end,
            **_tip_of(push.mount), **_swing_of(push.swing),
        }  # fmt: skip
        for name, value in values.items():
            record[name] = value
        return record


def _tip_of(mount: Mount | None) -> dict[str, float]:
    if mount is None:
        return {}
    return {
        "tip_mass": max(mount.mass, LIGHTEST_TIP), "tip_stiffness": mount.stiffness, "tip_damping": mount.damping,
    }  # fmt: skip


def _swing_of(swing: Swing | None) -> dict[str, float]:
    if swing is None:
        return {}
    return {
        "swing_mass": swing.mass, "swing_stiffness": swing.mass * swing.frequency**2,
        "swing_damping": 2.0 * swing.damping * swing.mass * swing.frequency, "swing_load": swing.load,
    }  # fmt: skip


def _edges(outline: Outline) -> Array:
    """The outline's edges (k, 5): corner, direction, length; none of a disc.

    Raises:
        CellError: if it is neither a disc nor a polygon.
    """
    if isinstance(outline, Disc):
        return np.zeros((0, 5))
    if not isinstance(outline, Polygon):
        raise CellError(f"the twin knows no outline of type {type(outline).__name__}.")
    corners = np.array(outline.vertices)
    along = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(along, axis=1, keepdims=True)
    return np.hstack([corners, along / lengths, lengths])


def _knots(pushes: Sequence[TwinPush]) -> tuple[Array, NDArray[np.int64]]:
    """All hand paths (k, 5): time, place, velocity at each knot; and where each push's end."""
    rows = [
        np.zeros((0, 5)) if push.path is None
        else np.column_stack([push.path.times, push.path.knot_positions(), push.path.velocities])
        for push in pushes
    ]  # fmt: skip
    return np.ascontiguousarray(np.concatenate(rows)), np.cumsum([0, *map(len, rows)])


def _trace(poses: Array, forces: Array, counts: NDArray[np.void]) -> Trace:
    lost = int(counts["outcome"]) in (DIVERGED, STUCK)
    return Trace(
        poses=poses, forces=forces, outcome=Outcome.DIVERGED if lost else Outcome.COMPLETED,
        tips=int(counts["tipped"]), lifts=int(counts["lifted"]),
    )  # fmt: skip
