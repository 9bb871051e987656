"""The twin of a cell: many rollouts of one object in one call of the compiled integrator."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from typing import Any

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
from physid_drake.twin.compiled import drop_cache
from physid_drake.twin.records import BODY
from physid_drake.twin.rollout import COUNTS, DIVERGED, STUCK
from physid_drake.twin.vocabulary import records_of

Array = NDArray[np.float64]

LIGHTEST_TIP = 1e-6  # kg
POINTS = 100
"""Under the object, about: the edge of a patch crosses the base point by point."""
PIECE = 32  # rollouts at least that are worth a thread
AT_ONCE = 8  # numbers in a vector of the machine
NO_TIMES, NO_VELOCITIES, NOWHERE = np.zeros(0), np.zeros((0, 2)), np.zeros(2)


@dataclass(frozen=True, kw_only=True)
class Wander:
    """Frictions and forces that differ for a while: a hat over time, a unit of what they do along their way.

    Attributes:
        middle: when they differ most [s].
        width: how long before and after at all [s].
        support, hand: by which share of friction then, with the table and at the tip.
        force: at the centre of mass, along x and y of W [N].
        torque: about it [N m].
    """

    middle: float
    width: float
    support: float = 0.0
    hand: float = 0.0
    force: tuple[float, float] = (0.0, 0.0)
    torque: float = 0.0


STEADY = Wander(middle=0.0, width=1.0)


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
        wander: frictions and forces that differ for a while.
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
    wander: Wander = STEADY


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
class _Base:
    """A `Support` as loops like it: points of no weight fill the last of their vectors."""

    points: Array
    weights: Array
    radii: Array
    cells: NDArray[np.intp]
    polar: float


@dataclass(frozen=True, kw_only=True)
class Twin:
    """An object on an endless table, pushed by a round tip, as the compiled integrator sees it.

    Attributes:
        solid: the object's shape; it must not roll.
        hand_radius: of the tip [m]; None without a hand.
        grid: friction cells of ``body.support_friction``.
        pressure: under the object, where it is not even.
        gravity: m/s^2.
        points: support points, about.
    """

    solid: Solid
    hand_radius: float | None
    grid: FrictionGrid = field(default_factory=FrictionGrid)
    pressure: PressureGrid | None = None
    gravity: float = GRAVITY
    points: int = POINTS

    def __post_init__(self) -> None:
        if self.solid.rolling_radius is not None:
            raise CellError("the twin does not roll: a lying cylinder is the cell's.")

    @property
    def polar(self) -> float:
        """Mean square distance of the underside from Bo [m^2]."""
        return self._base.polar

    def rollouts(self, pushes: Sequence[TwinPush], threads: int = 1) -> list[Trace]:
        """Simulate all pushes, each as if it were alone, in so many threads."""
        base = self._base
        ends = _ends([len(push.times) for push in pushes])
        poses, forces = np.zeros((ends[-1], 3)), np.zeros((ends[-1], 2))
        counts = np.zeros(len(pushes), COUNTS)
        laws, law_ends, tables = records_of([(push.laws, push.body.mass * self.gravity) for push in pushes])
        bodies = np.array([self._record(push) for push in pushes], dtype=BODY)
        friction = np.array([push.body.support_friction[base.cells] for push in pushes])
        starts = np.array([(*push.start.pose, *push.start.velocity) for push in pushes])
        knots, velocities, paths, knot_ends = _hands(pushes)
        times, sample_ends = np.concatenate([push.times for push in pushes], dtype=np.float64), np.array(ends)

        def some(first: int, last: int) -> None:
            own, bounds = slice(first, last), slice(first, last + 1)
            _roll_all(
                bodies[own], (base.points, base.weights, base.radii), friction[own], self._edges, knots, velocities,
                paths[own], knot_ends[bounds], starts[own], laws, law_ends[bounds], tables, times,
                sample_ends[bounds], poses, forces, counts[own],
            )  # fmt: skip

        _in_threads(some, len(pushes), threads)
        outcomes, tips, lifts = (counts[name].tolist() for name in ("outcome", "tipped", "lifted"))
        return [
            Trace(
                poses=poses[ends[k] : ends[k + 1]], forces=forces[ends[k] : ends[k + 1]],
                outcome=Outcome.DIVERGED if outcomes[k] in (DIVERGED, STUCK) else Outcome.COMPLETED,
                tips=tips[k], lifts=lifts[k],
            )
            for k in range(len(pushes))
        ]  # fmt: skip

    @cached_property
    def _base(self) -> _Base:
        return _base_of(support_of(self.solid.underside, self.grid, self.points, pressure=self.pressure))

    @cached_property
    def _edges(self) -> Array:
        return _edges(self.solid.outline)

    def _record(self, push: TwinPush) -> tuple[float, ...]:
        """The numbers of `BODY`, in their order."""
        body, solid, wander = push.body, self.solid, push.wander
        com_x, com_y = body.p_BBcm.tolist()
        height = 0.5 * solid.height if push.hand_height is None else push.hand_height
        return (
            body.mass, body.mass * body.inertia_ratio * solid.gyration[2], body.mass * self.gravity,
            com_x, com_y, 0.5 * solid.height, solid.outline.radius if isinstance(solid.outline, Disc) else 0.0,
            1.0 if isinstance(solid.outline, Polygon) and not solid.outline.convex else 0.0,
            self.hand_radius or 0.0, height - 0.5 * solid.height, body.hand_friction, body.restitution,
            *_tip_of(push.mount), *_swing_of(push.swing), 0.0, push.begin, push.end,
            wander.middle, wander.width, wander.support, wander.hand, *wander.force, wander.torque,
            1.0, 1.0, 0.0, 0.0, 0.0,
        )  # fmt: skip


def _in_threads(some: Callable[[int, int], None], count: int, threads: int) -> None:
    """All of so many, in pieces: from which to which."""
    pieces = max(1, min(threads, count // PIECE))
    edges = [count * k // pieces for k in range(pieces + 1)]
    if pieces == 1:
        some(0, count)
        return
    with ThreadPoolExecutor(pieces) as pool:
        list(pool.map(some, edges[:-1], edges[1:]))


def _roll_all(*arrays: Any) -> None:
    """`roll_all`, and once more where the machine code that was kept cannot be read, or none can be kept."""
    try:
        roll_all(*arrays)  # type: ignore[no-untyped-call]
    except (OSError, EOFError, ValueError, pickle.UnpicklingError):
        drop_cache()
        roll_all(*arrays)  # type: ignore[no-untyped-call]


def _base_of(support: Support) -> _Base:
    missing = -len(support.weights) % AT_ONCE
    return _Base(
        points=np.pad(support.points, ((0, missing), (0, 0))), weights=np.pad(support.weights, (0, missing)),
        radii=np.pad(support.radii, (0, missing)), cells=np.pad(support.cells, (0, missing)), polar=support.polar,
    )  # fmt: skip


def _tip_of(mount: Mount | None) -> tuple[float, float, float]:
    return (0.0, 0.0, 0.0) if mount is None else (max(mount.mass, LIGHTEST_TIP), mount.stiffness, mount.damping)


def _swing_of(swing: Swing | None) -> tuple[float, float, float, float]:
    if swing is None:
        return 0.0, 0.0, 0.0, 0.0
    rate = swing.mass * swing.frequency
    return swing.mass, rate * swing.frequency, 2.0 * swing.damping * rate, swing.load


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


def _hands(pushes: Sequence[TwinPush]) -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """All hand paths: times (k,) of their knots, velocities (k, 2) there, starts (n, 2); where each push's end."""
    paths = [push.path for push in pushes]
    there = [path for path in paths if path is not None]
    return (
        np.concatenate([NO_TIMES, *(path.times for path in there)]),
        np.concatenate([NO_VELOCITIES, *(path.velocities for path in there)]),
        np.array([NOWHERE if path is None else path.start for path in paths]),
        np.array(_ends([0 if path is None else len(path.times) for path in paths])),
    )


def _ends(counts: Sequence[int]) -> list[int]:
    """Where each one's begin, and the last one's end."""
    return list(accumulate(counts, initial=0))
