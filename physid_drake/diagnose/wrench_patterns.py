"""The pattern of the missing wrench: in which frame it is constant, what it depends on, and in which phase it acts.

A pattern is a wrench over all windows of all pushes, with a few coefficients. It is judged like an effect, by how
much of the baseline model's errors it explains, with theta and the nuisance parameters projected out. Random sign
flips of whole pushes give the distribution of the best of all patterns by chance.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.location import windows_in_words
from physid_drake.diagnose.values import Location, Window
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import LinearPush
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]

FLIPS = 999
WINDOWS = 6  # named as those in which most is missing
CHANCE = 0.05  # of the best of all looks
SURE = 2.5  # standard deviations of a window's wrench
PHASES = ("contact", "free_slide")
DOFS = ("along_motion", "across_motion", "rotation")
FEWEST_PUSHES = 6  # with fewer, sign flips cannot be significant: two of 2^5 patterns are 6 %
LOUDEST = 3.0  # standard deviations that one push may speak with
AS_GOOD = 0.8  # of the gain in one phase: the pattern holds in both
IMITATED = 1e-9  # of a pattern's columns: what is left without theta is rounding below this
DIGITS = 6  # of gains that are compared: of looks that theta makes the same, the first, whatever the rounding
A_PART = 0.25  # of the most that a phase or a degree of freedom has
SAID = {"contact": "contact", "free_slide": "free sliding"}


@dc.dataclass(frozen=True, kw_only=True)
class Look:
    """A pattern of the wrench.

    Attributes:
        frame: in which it is constant, as in ``diagnosis.json``.
        dof: degrees of freedom in which it has components.
        words: describes it, given its coefficients (k,).
        weights: (n, 3, k) force along and across the motion, and torque, in each of n windows, per coefficient.
    """

    frame: str
    dof: tuple[str, ...]
    words: Callable[[Array], str]
    weights: Array


@dc.dataclass(frozen=True, kw_only=True)
class _Seen:
    """A look in some phases, with what it explains and its coefficients; its ``number`` is the same in all phases."""

    number: int
    look: Look
    phases: tuple[str, ...]
    gain: float
    coefficients: Array


NOWHERE = Location(
    statement="at the ends of the pushes; too few poses in between to say more", phase=(), dof=(),
    frame="none", windows=(),
)  # fmt: skip


def locate(
    fitter: Fitter,
    plain: Fit,
    wrenches: Sequence[MissingWrench],
    rng: np.random.Generator,
    frame: str | None = None,
) -> Location:
    """The location of the mismatch, with the pattern that explains most.

    No pattern is named where the best explains no more than the best does by chance.

    Args:
        fitter: of the fit.
        plain: the model that lacks something.
        wrenches: what it lacks, window by window.
        rng: draws sign flips.
        frame: of the effect that was found; only patterns in this frame are considered, if there are any. None
            considers all.
    """
    if not wrenches:
        return NOWHERE
    case = fitter.case
    order = np.array([case.problems[w.push].order for w in wrenches], dtype=np.float64)
    there = tuple(p for p in PHASES if any(w.phase == p for w in wrenches))
    split = [
        (number, look, phases)
        for phases in {there: None} | {(p,): None for p in there}
        for number, look in enumerate(looks_at(wrenches, order, phases))
    ]
    gains, solutions, best_by_chance = _explained(fitter, plain, wrenches, [look for _, look, _ in split], rng)
    seen = [
        _Seen(number=number, look=look, phases=phases, gain=gain, coefficients=solution)
        for (number, look, phases), gain, solution in zip(split, gains, solutions, strict=True)
    ]
    best = max([one for one in seen if one.look.frame == frame] or seen, key=lambda one: round(one.gain, DIGITS))
    surely = (best_by_chance >= best.gain).mean() < CHANCE
    return _location(case, wrenches, seen, best if surely else None)


def looks_at(wrenches: Sequence[MissingWrench], order: Array, phases: Sequence[str] = PHASES) -> list[Look]:
    """All patterns over the windows.

    Args:
        wrenches: n windows.
        order: (n,) number of each window's push.
        phases: in which patterns act; their weights are zero elsewhere.
    """
    heading, yaw, speed, spin = (np.array([getattr(w, name) for w in wrenches]) for name in
                                 ("heading", "yaw", "speed", "spin"))  # fmt: skip
    place = np.array([w.place for w in wrenches])
    every = np.ones(len(wrenches))
    over = _Patterns(acting=np.array([w.phase in phases for w in wrenches]), heading=heading)
    along, across, torque = range(3)
    force, motion, turn = DOFS[:2], DOFS[:1], DOFS[2:]
    return [
        Look(frame="object_velocity", dof=motion, weights=over.component(along, every),
             words=lambda c: f"{_sense(c)} the motion, for all headings"),
        Look(frame="object_velocity", dof=motion, weights=over.component(along, over.centred(speed)),
             words=lambda c: f"{_sense(c)} the motion, stronger at higher speed"),
        Look(frame="object_velocity", dof=DOFS[1:2], weights=over.component(across, every),
             words=lambda c: f"to the {_side(c)} of the motion, for all headings"),
        Look(frame="object_velocity", dof=turn, weights=over.component(torque, spin),
             words=lambda c: f"{_sense(c)} the rotation"),
        Look(frame="world", dof=force, weights=over.fixed(np.zeros_like(yaw)),
             words=lambda c: f"towards {_degrees(c)} deg on the table"),
        Look(frame="world", dof=force, weights=over.grain(heading),
             words=lambda c: f"mainly against the motion, strongest for motion at {_axis(-c)} deg"),
        Look(frame="world", dof=motion, weights=over.component(along, *over.centred(place).T),
             words=lambda c: f"along the motion, increasing towards {_degrees(c)} deg on the table"),
        Look(frame="object", dof=force, weights=over.fixed(yaw),
             words=lambda c: f"towards {_degrees(c)} deg of the object"),
        Look(frame="object", dof=force, weights=over.grain(heading - yaw),
             words=lambda c: f"mainly against the motion, strongest for motion at {_axis(-c)} deg of the object"),
        Look(frame="object", dof=turn, weights=over.component(torque, every),
             words=lambda c: f"a {_turn(c)} torque"),
        Look(frame="object", dof=turn, weights=over.component(torque, *_circle(heading - yaw)),
             words=lambda c: "a torque that depends on the direction of motion in the object frame"),
        Look(frame="hand", dof=turn, weights=over.component(torque, *_circle(heading)),
             words=lambda c: "a torque that depends on the heading of the push"),
        Look(frame="push_order", dof=motion, weights=over.component(along, over.centred(order)),
             words=lambda c: "along the motion, changing between pushes"),
    ]  # fmt: skip


@dc.dataclass(frozen=True, kw_only=True)
class _Patterns:
    """Patterns (n, 3, k) over n windows: along the motion, across it, and about the vertical.

    Attributes:
        acting: (n,) whether a pattern acts in a window.
        heading: (n,) of the motion [rad].
    """

    acting: NDArray[np.bool_]
    heading: Array

    def centred(self, values: Array) -> Array:
        """Less their mean where the pattern acts, so that it is no constant force."""
        return np.asarray(values - values[self.acting].mean(axis=0))

    def component(self, row: int, *values: Array) -> Array:
        """One degree of freedom, in proportion to each of the values (n,)."""
        weights = self._blank(len(values))
        for k, value in enumerate(values):
            weights[:, row, k] = value * self.acting
        return weights

    def fixed(self, angle: Array) -> Array:
        """Forces along a direction that turns with ``angle`` (n,), and across it."""
        weights = self._blank(2)
        for k, direction in enumerate((angle, angle + 0.5 * math.pi)):
            weights[:, 0, k] = self.acting * np.cos(direction - self.heading)
            weights[:, 1, k] = self.acting * np.sin(direction - self.heading)
        return weights

    def grain(self, angle: Array) -> Array:
        """What a friction that is larger along one axis is more than its mean: it holds back, and draws aside."""
        weights, (cosine, sine) = self._blank(2), _circle(2.0 * angle)
        weights[:, 0, 0], weights[:, 1, 0] = self.acting * cosine, self.acting * -sine
        weights[:, 0, 1], weights[:, 1, 1] = self.acting * sine, self.acting * cosine
        return weights

    def _blank(self, count: int) -> Array:
        return np.zeros((len(self.heading), 3, count))


def _circle(angle: Array) -> tuple[Array, Array]:
    return np.cos(angle), np.sin(angle)


def _side(coefficients: Array) -> str:
    return "left" if coefficients[0] > 0.0 else "right"


def _turn(coefficients: Array) -> str:
    return "counter-clockwise" if coefficients[0] > 0.0 else "clockwise"


def _sense(coefficients: Array) -> str:
    return "with" if coefficients[0] > 0.0 else "against"


def _degrees(coefficients: Array) -> str:
    """Of a direction, 0 to 360."""
    return f"{round(math.degrees(math.atan2(coefficients[1], coefficients[0]))) % 360}"


def _axis(coefficients: Array) -> str:
    """Of an axis, 0 to 180, from the coefficients of twice its angle."""
    return f"{round(0.5 * math.degrees(math.atan2(coefficients[1], coefficients[0]))) % 180}"


def _explained(
    fitter: Fitter, plain: Fit, wrenches: Sequence[MissingWrench], looks: Sequence[Look], rng: np.random.Generator
) -> tuple[list[float], list[Array], Array]:
    """Gains (minus logs of a chi-square's p) and coefficients of looks, and (f,) the best gain of flipped pushes."""
    # A large scatter of friction may be the missing physics; it must not absorb it here.
    roots = [
        _root(push, prior) for push, prior in zip(plain.pushes, fitter.priors(min(plain.scatter, 1.0)), strict=True)
    ]
    d, signatures = plain.hypothesis.space.dimension, [_signature(plain, wrenches, look.weights) for look in looks]
    y = np.concatenate([root @ push.residual for root, push in zip(roots, plain.pushes, strict=True)])
    theta = np.vstack([root @ push.shared[:, :d] for root, push in zip(roots, plain.pushes, strict=True)])
    basis, _ = np.linalg.qr(theta)
    stacked = [np.vstack([root @ s for root, s in zip(roots, signature, strict=True)]) for signature in signatures]
    blocks = [_without(basis, block) for block in stacked]
    edges = np.cumsum([len(push.residual) for push in plain.pushes])[:-1]
    left = np.split(y - basis @ (basis.T @ y), edges)
    signs = np.vstack([np.ones(len(left)), rng.choice([-1.0, 1.0], size=(FLIPS, len(left)))])
    gains, solutions = [], []
    for block in blocks:
        pieces = np.split(block, edges)
        shares = [_share(x, r) for x, r in zip(pieces, left, strict=True)]
        told = np.array([share * (x.T @ r) for share, x, r in zip(shares, pieces, left, strict=True)])  # (pushes, k)
        inverse = np.linalg.pinv(block.T @ block)
        sums = signs @ told
        gains.append(-stats.chi2.logsf(np.einsum("fk,kl,fl->f", sums, inverse, sums), block.shape[1]))
        heard = sum((share * (x.T @ x) for share, x in zip(shares, pieces, strict=True)), np.zeros_like(inverse))
        solutions.append(np.asarray(np.linalg.pinv(heard) @ sums[0]))
    every = np.array(gains)
    return every[:, 0].tolist(), solutions, every[:, 1:].max(axis=0)


def _without(basis: Array, block: Array) -> Array:
    """A look's columns (M, k) without what theta imitates; nothing of those that it imitates but for rounding."""
    rest = block - basis @ (basis.T @ block)
    told = np.linalg.norm(rest, axis=0) > IMITATED * np.linalg.norm(block, axis=0)
    return np.asarray(rest * told)


def _share(x: Array, left: Array) -> float:
    """Times what a push says of coefficients, so that it is no louder than ``LOUDEST`` deviations."""
    told = x.T @ left
    noise_scale = math.sqrt(max(0.0, float(told @ np.linalg.pinv(x.T @ x) @ told)))
    return min(1.0, LOUDEST / max(noise_scale, 1e-12))


def _root(push: LinearPush, prior: Array) -> Array:
    """Takes what is left of a push (m,) to white noise: as noisy as it is far from explained."""
    nuisance = push.nuisance * prior
    covariance = np.eye(len(nuisance)) + nuisance @ nuisance.T
    white = np.linalg.solve(np.linalg.cholesky(covariance), push.residual)
    noise_scale = max(1.0, float(np.mean(white**2)))
    return np.linalg.inv(np.linalg.cholesky(noise_scale * covariance))


def _signature(plain: Fit, wrenches: Sequence[MissingWrench], weights: Array) -> list[Array]:
    """What a pattern (n, 3, k) of the wrench would change, per push (m, k)."""
    columns = [np.zeros((len(push.residual), weights.shape[2])) for push in plain.pushes]
    for wrench, here in zip(wrenches, weights, strict=True):
        columns[wrench.push] += wrench.columns @ here
    return columns


def _location(case: Case, wrenches: Sequence[MissingWrench], seen: Sequence[_Seen], best: _Seen | None) -> Location:
    """The statement: the best look if there is one, and the windows in which most is missing."""
    values = np.array([w.wrench / w.std for w in wrenches])
    size = np.sqrt((values**2).sum(axis=1))
    if best is not None:
        phase, dof, frame = _phases(best, seen), best.look.dof, best.look.frame
        detail = best.look.words(best.coefficients)
    else:
        energy = {p: float(np.mean([s**2 for s, w in zip(size, wrenches, strict=True) if w.phase == p] or [0.0]))
                  for p in PHASES}  # fmt: skip
        there = {w.phase for w in wrenches}
        phase = tuple(p for p in PHASES if p in there and energy[p] >= A_PART * max(energy.values()))
        power = (values**2).mean(axis=0)
        dof = tuple(d for d, p in zip(DOFS, power.tolist(), strict=True) if p >= A_PART * power.max())
        few = len({w.push for w in wrenches}) < FEWEST_PUSHES
        frame, detail = "none", "too few pushes to find a direction" if few else "no direction stands out"
    in_question = [k for k, w in enumerate(wrenches) if w.phase in phase]
    much = np.sqrt((values[in_question] ** 2) @ [name in dof for name in DOFS])
    windows = tuple(_window(case, wrenches[k]) for k in (in_question[i] for i in np.argsort(-much)[:WINDOWS]))
    where = "during " + " and ".join(SAID[p] for p in phase)
    amount = _amount([w for w in wrenches if w.phase in phase], dof)
    statement = f"{where}{amount}; {detail}" + ("" if amount else "; not in any single window")
    if windows:
        statement += f"; {windows_in_words(windows)}"
    return Location(statement=statement, phase=phase, dof=dof, frame=frame, windows=windows)


def _window(case: Case, wrench: MissingWrench) -> Window:
    x, y = wrench.place.tolist()
    return Window(
        push=case.problems[wrench.push].name, start=wrench.start, end=wrench.end, place=(x, y),
        heading=wrench.heading, speed=wrench.speed, phase=wrench.phase,
    )  # fmt: skip


def _phases(best: _Seen, seen: Sequence[_Seen]) -> tuple[str, ...]:
    """Those in which the pattern explains a good part of what it explains; all if it is weak in each."""
    gains = {one.phases: one.gain for one in seen if one.number == best.number}
    every = max(gains, key=len)
    if gains[every] < AS_GOOD * best.gain:
        return best.phases
    return tuple(p for p in every if gains.get((p,), 0.0) > A_PART * best.gain) or every


def _amount(wrenches: Sequence[MissingWrench], dof: Sequence[str]) -> str:
    """How much is missing in some degrees of freedom, where it stands out of its standard deviation; else empty."""
    sure = [np.where(np.abs(w.wrench) > SURE * w.std, np.abs(w.wrench), 0.0) for w in wrenches]
    amounts = np.array(sure) * [name in dof for name in DOFS]
    forces, torques = amounts[:, :2].max(axis=1), amounts[:, 2]
    parts = [f"{np.median(forces[forces > 0.0]):.2g} N"] if (forces > 0.0).any() else []
    parts += [f"{1e3 * np.median(torques[torques > 0.0]):.2g} N mm"] if (torques > 0.0).any() else []
    return f", about {' and '.join(parts)} where it is clear" if parts else ""
