"""Where simulation and recording part: the missing wrench in short windows, and the frame in which it is constant.

Small pulses of force and torque in every window of every push show what each would change; least squares then says
which wrench is missing there, with its covariance. What the hand prescribes (the motion along its push) these pushes
cannot tell: its covariance is large.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from physid_drake.cell.forces import ForceLaw, ObjectState, Wrench
from physid_drake.cell.solid import solid_of
from physid_drake.diagnose.case import Case
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.values import Location, Window
from physid_drake.effects import Effect, PushFacts

Array = NDArray[np.float64]

WINDOWS = 6  # per push, over its motion
PULSE = 0.05  # of the friction force: the size of a pulse
LARGEST = 1.0  # of the friction force: prior standard deviation of what is missing
FLIPS = 999
SURE = 2.5  # standard deviations


@dc.dataclass(frozen=True, kw_only=True)
class _Pulse(Effect):
    """A constant wrench in W between two times: not physics, a question."""

    name: ClassVar[str] = "pulse"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = ""
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("fx", "fy", "torque")

    fx: float = 0.0
    fy: float = 0.0
    torque: float = 0.0
    start: float = 0.0
    end: float = 0.0

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        del facts
        return (_PulseLaw(self),)


@dc.dataclass(frozen=True)
class _PulseLaw:
    pulse: _Pulse

    def wrench(self, state: ObjectState) -> Wrench:
        p = self.pulse
        on = p.start <= state.time < p.end
        return Wrench(fx=p.fx * on, fy=p.fy * on, torque=p.torque * on)


@dc.dataclass(frozen=True, kw_only=True)
class MissingWrench:
    """What is missing in one window of one push.

    Attributes:
        push: index of the push.
        start, end: of the window [s].
        wrench: (3,) along the motion, across it (to its left) [N], torque [N m].
        std: (3,) standard deviations.
        phase: ``contact`` or ``free_slide``.
        speed: mean of the object's [m/s].
        heading: of its motion in W [rad].
        yaw: of B [rad].
        place: (2,) in W [m].
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

    @property
    def stands_out(self) -> bool:
        """Whether the force along or across is more than two standard deviations from nothing."""
        return bool((np.abs(self.wrench[:2]) > 2.0 * self.std[:2]).any())


def missing_wrenches(fitter: Fitter, plain: Fitted) -> tuple[MissingWrench, ...]:
    """The missing wrench in all windows; ``fitter`` may be of a coarse case."""
    case, state = fitter.case, plain.state
    force = case.around.friction * case.around.weight
    units = np.array([force, force, force * 0.5 * case.around.radius])
    windows = [_windows(case, i) for i in range(len(case.problems))]
    tasks = [fitter.task(state, i) for i in range(len(case.problems))]
    for i, mine in enumerate(windows):
        begin = case.problems[i].begin
        for start, end, _, heading, *_ in mine:
            c, s = math.cos(heading), math.sin(heading)
            for fx, fy, torque in ((c, s, 0.0), (-s, c, 0.0), (0.0, 0.0, 1.0)):
                pulse = _Pulse(
                    fx=PULSE * units[0] * fx, fy=PULSE * units[1] * fy, torque=PULSE * units[2] * torque,
                    start=start - begin, end=end - begin,
                )  # fmt: skip
                tasks.append(fitter.task(state, i, effects=[pulse]))
    vectors = fitter.vectors(tasks)
    base, pulses = vectors[: len(case.problems)], vectors[len(case.problems) :]
    found: list[MissingWrench] = []
    for i, mine in enumerate(windows):
        columns = [(pulses.pop(0) - base[i]) / PULSE for _ in range(3 * len(mine))]
        found += _solved(plain, i, mine, np.column_stack(columns), units) if mine else []
    return tuple(found)


_Spell = tuple[float, float, float, float, float, Array]  # start, end, speed, heading, yaw, place


def _windows(case: Case, i: int) -> list[_Spell]:
    """Windows of equal length over the motion of a push."""
    middles = case.features[i].middles
    poses = case.features[i].poses(case.features[i].recorded)
    if len(middles) < 4:
        return []
    edges = np.linspace(middles[0], middles[-2], min(WINDOWS, len(middles) // 2) + 1)
    spells = []
    for start, end in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        at = [np.interp(t, middles, poses[:, k]) for k in range(3) for t in (start, end)]
        dx, dy = at[1] - at[0], at[3] - at[2]
        distance = math.hypot(dx, dy)
        if distance < 4.0 * case.noise.position:
            continue
        place = np.array([0.5 * (at[0] + at[1]), 0.5 * (at[2] + at[3])])
        spells.append((start, end, distance / (end - start), math.atan2(dy, dx), 0.5 * float(at[4] + at[5]), place))
    return spells


def _solved(plain: Fitted, i: int, windows: Sequence[_Spell], columns: Array, units: Array) -> list[MissingWrench]:
    """Least squares with a wide prior, the push's own unknowns integrated out, theta held."""
    push = plain.pushes[i]
    factor = cho_factor(push.covariance(plain.state.scatter))
    left = push.residual - push.shared @ plain.solution.beta
    precision = columns.T @ cho_solve(factor, columns) + np.eye(columns.shape[1]) / LARGEST**2
    covariance = np.linalg.inv(precision)
    values = covariance @ (columns.T @ cho_solve(factor, left))
    stds = np.sqrt(np.diag(covariance))
    found = []
    for k, (start, end, speed, heading, yaw, place) in enumerate(windows):
        part = slice(3 * k, 3 * k + 3)
        found.append(
            MissingWrench(
                push=i,
                start=start,
                end=end,
                wrench=values[part] * units,
                std=stds[part] * units,
                phase="contact",
                speed=speed,
                heading=heading,
                yaw=yaw,
                place=place,
            )
        )
    return found


def with_phases(case: Case, wrenches: Sequence[MissingWrench]) -> tuple[MissingWrench, ...]:
    """The phase of each window: a free slide begins when the recorded tip is last at the object's outline."""
    released = {i: _released(case, i) for i in {w.push for w in wrenches}}
    return tuple(
        dc.replace(w, phase="contact" if 0.5 * (w.start + w.end) <= released[w.push] else "free_slide")
        for w in wrenches
    )


def _released(case: Case, i: int) -> float:
    """When the tip was last within a millimetre, and the tracker's noise, of the object's outline [s]."""
    problem, radius = case.problems[i], 0.0 if case.recording.hand is None else case.recording.hand.radius
    if problem.path is None or len(problem.times) < 2:
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


def locate(case: Case, wrenches: Sequence[MissingWrench], rng: np.random.Generator) -> Location | None:
    """Where the missing wrench lives; None where no look stands out of all looks (sign flips of whole pushes)."""
    if not wrenches:
        return None
    looks = _looks(case, wrenches)
    names = list(looks)
    values = np.array([w.wrench / w.std for w in wrenches])  # (n, 3)
    owners = np.array([w.push for w in wrenches])
    weights = np.array([looks[n] for n in names])  # (looks, n, 3)
    statistics = _statistics(weights, values, owners)
    signs = rng.choice([-1.0, 1.0], size=(FLIPS, int(owners.max()) + 1))
    null = np.array([np.abs(_statistics(weights, values * s[owners][:, None], owners)).max() for s in signs])
    told = [
        (abs(t), n) for t, n in zip(statistics.tolist(), names, strict=True) if (null >= abs(t)).mean() < 0.05
    ]  # fmt: skip
    told.sort(reverse=True)
    return _location(case, wrenches, values, told)


def _statistics(weights: Array, values: Array, owners: NDArray[np.intp]) -> Array:
    """For each look, the mean over pushes over its standard error, pushes being the unit."""
    terms = np.einsum("lnk,nk->ln", weights, values)
    sums = np.zeros((len(weights), int(owners.max()) + 1))
    np.add.at(sums.T, owners, terms.T)
    scale = np.sqrt((sums**2).sum(axis=1))
    return np.asarray(sums.sum(axis=1) / np.maximum(scale, 1e-12))


def _looks(case: Case, wrenches: Sequence[MissingWrench]) -> dict[str, Array]:
    """Weights (n, 3) of every look: a direction in a frame, in a phase, growing with something or not."""
    n = len(wrenches)
    heading = np.array([w.heading for w in wrenches])
    yaw = np.array([w.yaw for w in wrenches])
    speed = np.array([w.speed for w in wrenches])
    order = np.array([case.problems[w.push].order for w in wrenches], dtype=np.float64)
    phases = {p: np.array([w.phase == p for w in wrenches], dtype=np.float64) for p in ("contact", "free_slide")}
    inverse = 1.0 / np.array([w.std for w in wrenches])
    along, across, turn = (np.zeros((n, 3)) for _ in range(3))
    along[:, 0], across[:, 1], turn[:, 2] = 1.0, 1.0, 1.0
    looks: dict[str, Array] = {}

    def fixed(angle: Array) -> Array:
        return np.column_stack([np.cos(angle - heading), np.sin(angle - heading), np.zeros(n)])

    base = {
        "object_velocity|along_motion": along,
        "object_velocity|across_motion": across,
        "object_velocity|rotation": turn,
        "world|x": fixed(np.zeros(n)),
        "world|y": fixed(np.full(n, 0.5 * math.pi)),
        "object|x": fixed(yaw),
        "object|y": fixed(yaw + 0.5 * math.pi),
        "push_order|along_motion": along * (order - order.mean())[:, None],
        "speed|along_motion": along * (speed - speed.mean())[:, None],
    }
    for name, weights in base.items():
        for phase, mask in phases.items():
            if mask.sum() >= 3:
                looks[f"{name}|{phase}"] = weights * inverse * mask[:, None]
        looks[f"{name}|both"] = weights * inverse
    return looks


def _amount(wrenches: Sequence[MissingWrench]) -> str:
    """How much is missing, where it stands out of its standard deviation."""
    forces = [float(np.abs(w.wrench[:2]).max()) for w in wrenches if (np.abs(w.wrench[:2]) > SURE * w.std[:2]).any()]
    torques = [abs(float(w.wrench[2])) for w in wrenches if abs(w.wrench[2]) > SURE * w.std[2]]
    parts = [f"{np.median(forces):.2g} N"] if forces else []
    parts += [f"{1e3 * np.median(torques):.2g} N mm"] if torques else []
    return f": about {' and '.join(parts)} missing" if parts else ", too little in any one window to be seen there"


def _direction(look: str) -> tuple[str, str]:
    """The frame of a look, and its direction in words."""
    frame, direction, _ = look.split("|")
    match frame:
        case "object_velocity":
            return frame, f"{_SAID[direction]}, wherever the object heads"
        case "push_order":
            return frame, "along the motion, changing from push to push"
        case "speed":
            return "object_velocity", "along the motion, growing with speed"
    return frame, f"along {direction} of the {'table' if frame == 'world' else 'object'}"


_SAID = {"along_motion": "along the motion", "across_motion": "across the motion", "rotation": "as a torque"}


def _location(
    case: Case, wrenches: Sequence[MissingWrench], values: Array, told: Sequence[tuple[float, str]]
) -> Location:
    """The statement: the strongest look, and the windows in which most is missing."""
    size = np.sqrt((values**2).sum(axis=1))
    worst = np.argsort(-size)[: min(6, len(size))]
    windows = tuple(
        Window(push=case.problems[wrenches[k].push].name, start=wrenches[k].start, end=wrenches[k].end) for k in worst
    )
    energy = {p: float(np.mean([s**2 for s, w in zip(size, wrenches, strict=True) if w.phase == p] or [0.0]))
              for p in ("contact", "free_slide")}  # fmt: skip
    phase = tuple(p for p, e in energy.items() if e > 0.25 * max(energy.values()))
    dofs = ("along_motion", "across_motion", "rotation")
    power = (values**2).mean(axis=0)
    dof = tuple(d for d, p in zip(dofs, power.tolist(), strict=True) if p > 0.4 * power.max())
    frame, detail = ("none", "in no one direction") if not told else _direction(told[0][1])
    where = " and ".join({"contact": "while it is pushed", "free_slide": "in its free slide"}[p] for p in phase)
    statement = f"{where}{_amount(wrenches)}, {detail}"
    return Location(statement=statement, phase=phase, dof=dof, frame=frame, windows=windows)
