"""Pushes that were left out of a fit, simulated: their errors, and whether a model comes nearer to them."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.estimates import rms
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]

BETTER = 1.2  # times: as much nearer has a model to simulate pushes that were left out than the plain one
MOSTLY = 0.05  # p-value of the sign test over pushes: most come nearer
A_LITTLE = 1.1  # times: as much nearer have the others to come then


@dc.dataclass(frozen=True, kw_only=True)
class Errors:
    """Root mean square errors of pushes that were left out.

    Attributes:
        rms: of their poses, in standard deviations.
        per_push: the same of each.
        position, rotation: of place and yaw [m, rad].
        force: of the hand's force [N]; NaN where none was compared.
        force_per_push: of the force of each, in standard deviations; NaN of those without.
    """

    rms: float
    per_push: tuple[float, ...]
    position: float
    rotation: float
    force: float
    force_per_push: tuple[float, ...]


def errors_of(case: Case, residuals: Sequence[Array]) -> Errors:
    """Of pushes that were left out, from what was recorded less what was simulated of each (m_i,)."""
    poses = [f.poses(r) for f, r in zip(case.features, residuals, strict=True)]
    forces = [f.forces(r) for f, r in zip(case.features, residuals, strict=True)]
    scaled = [p / f.sigmas for p, f in zip(poses, case.features, strict=True)]
    scaled_forces = [p / f.force_sigmas for p, f in zip(forces, case.features, strict=True)]
    every = np.concatenate(poses)
    return Errors(
        rms=rms(np.concatenate(scaled)), per_push=tuple(rms(s) for s in scaled),
        position=math.sqrt(2.0) * rms(every[:, :2]), rotation=rms(every[:, 2]),
        force=math.sqrt(2.0) * rms(np.concatenate(forces)), force_per_push=tuple(rms(s) for s in scaled_forces),
    )  # fmt: skip


def comes_nearer(case: Case, before: Sequence[Array], after: Sequence[Array]) -> bool:
    """Whether errors (m_i,) of pushes that were left out, simulated, are visibly smaller than before.

    Each push may be likelier than before and yet come out of the simulation no nearer to where it was: effects and a
    friction that scatters share what is missing, or an effect took up the cell's own error. The push that speaks most
    against "visibly" is left out: an object that is about to slip off the hand goes one way or the other for next to
    nothing, and as far off with either model.
    """
    streams = _streams(case, before, after)
    return any(_nearer_without(int(np.argmax(BETTER**2 * new - old)), old, new) for old, new in streams)


def least_motion(case: Case, errors: Sequence[Array]) -> float:
    """How far an effect must move left-out pushes for a model with it to come visibly nearer [standard deviations].

    Args:
        case: the pushes.
        errors: (m_i,) of each, simulated by a model that explains them: what is left beside the effect.
    """
    squares = np.sort(np.square(errors_of(case, errors).per_push))
    others = squares[:-1] if len(squares) > 1 else squares
    return math.sqrt((BETTER**2 - 1.0) * float(others.mean()))


def _streams(case: Case, before: Sequence[Array], after: Sequence[Array]) -> list[tuple[Array, Array]]:
    """Squared errors (n,) of pushes before and after, of what may come nearer: poses, and perhaps forces.

    Slow pushes by a hand that goes where it is told tell friction by the force alone: the object goes where the hand
    is, whatever the friction. Forces count where poses leave nothing to come nearer to, with the effect or without;
    elsewhere a law that is not the right one may take their errors up. Poses whose noise is not known always seem to
    leave nothing: it is taken to be what the plain cell leaves of them.
    """
    old, new = errors_of(case, before), errors_of(case, after)
    streams = [(np.square(old.per_push), np.square(new.per_push))]
    forced = np.isfinite(old.force_per_push)
    if case.noise.known and max(old.rms, new.rms) < BETTER and forced.sum() > 1:  # one is left out
        streams.append((np.square(old.force_per_push)[forced], np.square(new.force_per_push)[forced]))
    return streams


def _nearer_without(push: int, old: Array, new: Array, times: float = BETTER) -> bool:
    """Whether squared errors (n,) of the other pushes are visibly smaller."""
    others = np.arange(len(old)) != push
    return times**2 * float(new[others].sum()) <= float(old[others].sum())


def shown_by_several(case: Case, before: Sequence[Array], after: Sequence[Array]) -> bool:
    """Whether more than one of the pushes that were left out comes visibly nearer.

    A law that is not the right one may be bent until it fits the push that is furthest off, while the others are
    simulated as badly as before. A little nearer will do where most pushes come nearer.
    """
    return any(_several_nearer(old, new) for old, new in _streams(case, before, after))


def _several_nearer(old: Array, new: Array) -> bool:
    most = stats.binomtest(int((new < old).sum()), len(old), alternative="greater")
    enough = A_LITTLE if float(most.pvalue) < MOSTLY else BETTER
    return _nearer_without(int(np.argmax(old - new)), old, new, enough)
