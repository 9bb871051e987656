"""Where simulation and recording differ: the missing force and torque in short windows of every push.

A small pulse of force along and across the motion, and of torque, is simulated in each window. Least squares with
these responses gives the wrench that is missing in each window, with its covariance. The covariance is large for what
the hand imposes: a force along the motion changes little while the hand pushes.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.solid import solid_of
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import NO_TAIL, weighed
from physid_drake.inference.rollouts import Ask
from physid_drake.inference.slopes import slope
from physid_drake.pushes.case import Case
from physid_drake.twin.twin import Wander

Array = NDArray[np.float64]

WINDOWS = 6  # per push, over its motion
STEP = 4.0  # standard deviations of the tracker: what the object moves in a window at least
PULSE = 0.05  # of the friction force: the size of a pulse
LARGEST = 1.0  # of the friction force: prior standard deviation of what is missing


@dc.dataclass(frozen=True, kw_only=True)
class MissingWrench:
    """The wrench that the model lacks in one window of one push.

    Attributes:
        push: index of the push.
        start: of the window [s].
        end: of the window [s].
        wrench: (3,) force along the object's motion and to the left of it [N], torque about the vertical [N m].
        std: (3,) their standard deviations.
        phase: ``contact`` or ``free_slide``.
        speed: mean speed of the object [m/s].
        heading: direction of its motion in W [rad].
        yaw: of B [rad].
        place: (2,) of B in W [m].
        spin: mean yaw rate [rad/s].
        columns: (m, 3) change of the push's whitened features per N, N and N m of the wrench.
    """

    push: int
    start: float
    end: float
    wrench: Array
    std: Array
    phase: str
    speed: float
    heading: float
    yaw: float
    place: Array
    spin: float
    columns: Array

    @property
    def stands_out(self) -> bool:
        """Whether the force along or across is more than two standard deviations from zero."""
        return bool((np.abs(self.wrench[:2]) > 2.0 * self.std[:2]).any())


def missing_wrenches(fitter: Fitter, plain: Fit) -> tuple[MissingWrench, ...]:
    """The missing wrench in all windows of the pushes that the model can roll out."""
    case, h, point = fitter.case, plain.hypothesis, plain.point
    force = case.around.friction * case.around.weight
    units = np.array([force, force, force * 0.5 * case.around.radius])
    windows = [_windows(case, i) for i in range(len(case.problems))]
    physics = h.physics(point.z)
    asks = [Ask(i, physics, point.nuisance[i]) for i in range(len(windows))]
    for i, mine in enumerate(windows):
        for spell in mine:
            c, s = PULSE * math.cos(spell.heading), PULSE * math.sin(spell.heading)
            while_ = Wander(middle=0.5 * (spell.start + spell.end), width=spell.end - spell.start)
            pulses = (
                dc.replace(while_, force=(c * units[0], s * units[0])),
                dc.replace(while_, force=(-s * units[1], c * units[1])),
                dc.replace(while_, torque=PULSE * units[2]),
            )  # fmt: skip
            asks += [dc.replace(asks[i], wander=pulse) for pulse in pulses]
    vectors = fitter.predictor.vectors(asks)
    after = iter(vectors[len(windows) :])
    found: list[MissingWrench] = []
    for i, mine in enumerate(windows):
        base = vectors[i]
        moved = [next(after) for _ in range(3 * len(mine))]
        if mine and base is not None:
            found += _solved(fitter, plain, i, mine, np.column_stack([slope(base, m, PULSE) for m in moved]), units)
    return tuple(found)


@dc.dataclass(frozen=True, kw_only=True)
class _Spell:
    """The motion of a push in a window, as recorded; names as in ``MissingWrench``."""

    start: float
    end: float
    speed: float
    heading: float
    yaw: float
    place: Array
    spin: float


def _windows(case: Case, i: int) -> list[_Spell]:
    """Windows of equal length over the motion of a push, so long that the tracker tells where they head."""
    middles = case.features[i].middles
    poses = case.features[i].poses(case.features[i].recorded)
    if len(middles) < 4:
        return []
    least = STEP * case.noise.position
    way = float(np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum())
    edges = np.linspace(middles[0], middles[-2], int(np.clip(way / least, 1, min(WINDOWS, len(middles) // 2))) + 1)
    spells = []
    for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        at = [np.interp(t, middles, poses[:, k]) for k in range(3) for t in (start, end)]
        dx, dy = at[1] - at[0], at[3] - at[2]
        distance = math.hypot(dx, dy)
        if distance < least:
            continue
        place = np.array([0.5 * (at[0] + at[1]), 0.5 * (at[2] + at[3])])
        spells.append(
            _Spell(
                start=start, end=end, speed=distance / (end - start), heading=math.atan2(dy, dx),
                yaw=0.5 * float(at[4] + at[5]), place=place, spin=float(at[5] - at[4]) / (end - start),
            )
        )  # fmt: skip
    return spells


def _solved(
    fitter: Fitter, plain: Fit, i: int, windows: Sequence[_Spell], columns: Array, units: Array
) -> list[MissingWrench]:
    """Least squares with a wide prior, the push's nuisance parameters integrated out, theta held.

    Errors are what is missing, and not as loud as the model leaves them.
    """
    push, prior = plain.pushes[i], fitter.priors(plain.scatter)[i]
    one = weighed(push.residual, columns, push.nuisance, prior, 1.0, NO_TAIL)
    covariance = np.linalg.inv(one.precision + np.eye(columns.shape[1]) / LARGEST**2)
    values = covariance @ one.right
    stds = np.sqrt(np.diag(covariance))
    found = []
    for k, spell in enumerate(windows):
        part = slice(3 * k, 3 * k + 3)
        found.append(
            MissingWrench(
                push=i, wrench=values[part] * units, std=stds[part] * units, columns=columns[:, part] / units,
                phase="contact", **vars(spell),
            )
        )  # fmt: skip
    return found


def with_phases(case: Case, wrenches: Sequence[MissingWrench]) -> tuple[MissingWrench, ...]:
    """The wrenches with their phases: after the recorded tip last touches the object's outline, it slides freely."""
    released = {i: _released(case, i) for i in {w.push for w in wrenches}}
    return tuple(
        dc.replace(w, phase="contact" if 0.5 * (w.start + w.end) <= released[w.push] else "free_slide")
        for w in wrenches
    )


def _released(case: Case, i: int) -> float:
    """When the tip was last within a millimetre, and the tracker's noise, of the object's outline [s]."""
    problem, radius = case.problems[i], case.pool.spec.hand_radius
    if problem.path is None or radius is None or len(problem.times) < 2:
        return -np.inf
    outline = solid_of(case.recording.object.shape).outline
    near = 1e-3 + 4.0 * case.noise.position
    last = -np.inf
    for time, (x, y, yaw), hand in zip(
        problem.times, problem.poses, problem.path.positions(problem.times), strict=True
    ):
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = hand[0] - x, hand[1] - y
        if outline.nearest(c * dx + s * dy, c * dy - s * dx)[0] - radius < near:
            last = float(time)
    return last
