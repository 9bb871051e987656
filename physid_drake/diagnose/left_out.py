"""Pushes that were left out of a fit, simulated: their errors, and whether a model comes nearer to them."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.case import Case
from physid_drake.diagnose.estimates import rms

Array = NDArray[np.float64]

BETTER = 1.2  # times: as much nearer has a model to simulate pushes that were left out than the plain one
MOSTLY = 0.05  # p-value of the sign test over pushes: most come nearer
A_LITTLE = 1.1  # times: as much nearer have the others to come then


@dc.dataclass(frozen=True, kw_only=True)
class Errors:
    """Of pushes left out: root mean squares in standard deviations (of each push too), of place and yaw [m, rad]."""

    rms: float
    per_push: tuple[float, ...]
    position: float
    rotation: float


def errors_of(case: Case, residuals: Sequence[Array]) -> Errors:
    """Of pushes that were left out, from what was recorded less what was simulated of each (m_i,)."""
    poses = [f.poses(r) for f, r in zip(case.features, residuals, strict=True)]
    scaled = [p / f.sigmas for p, f in zip(poses, case.features, strict=True)]
    every = np.concatenate(poses)
    return Errors(
        rms=rms(np.concatenate(scaled)), per_push=tuple(rms(s) for s in scaled),
        position=math.sqrt(2.0) * rms(every[:, :2]), rotation=rms(every[:, 2]),
    )  # fmt: skip


def comes_nearer(case: Case, before: Sequence[Array], after: Sequence[Array]) -> bool:
    """Whether errors (m_i,) of pushes that were left out, simulated, are visibly smaller than before.

    Each push may be likelier than before and yet come out of the simulation no nearer to where it was: effects and a
    friction that scatters share what is missing, or an effect took up the cell's own error. The push that speaks most
    against the model is left out: an object that is about to slip off the hand goes one way or the other for next to
    nothing.
    """
    old, new = (np.square(errors_of(case, errors).per_push) for errors in (before, after))
    return _nearer_without(int(np.argmax(new - old)), old, new)


def least_motion(case: Case, errors: Sequence[Array]) -> float:
    """How far an effect must move left-out pushes for a model with it to come visibly nearer [standard deviations].

    Args:
        case: the pushes.
        errors: (m_i,) of each, simulated by a model that explains them: what is left beside the effect.
    """
    squares = np.sort(np.square(errors_of(case, errors).per_push))
    others = squares[:-1] if len(squares) > 1 else squares
    return math.sqrt((BETTER**2 - 1.0) * float(others.mean()))


def _nearer_without(push: int, old: Array, new: Array, times: float = BETTER) -> bool:
    """Whether squared errors (n,) of the other pushes are visibly smaller."""
    others = np.arange(len(old)) != push
    return times**2 * float(new[others].sum()) <= float(old[others].sum())


def shown_by_several(case: Case, before: Sequence[Array], after: Sequence[Array]) -> bool:
    """Whether more than one of the pushes that were left out comes visibly nearer.

    A law that is not the right one may be bent until it fits the push that is furthest off, while the others are
    simulated as badly as before. A little nearer will do where most pushes come nearer.
    """
    old, new = (np.square(errors_of(case, errors).per_push) for errors in (before, after))
    most = stats.binomtest(int((new < old).sum()), len(old), alternative="greater")
    enough = A_LITTLE if float(most.pvalue) < MOSTLY else BETTER
    return _nearer_without(int(np.argmax(old - new)), old, new, enough)
