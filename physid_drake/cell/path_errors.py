"""What the path of a hand may be off by where its stream is noisy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.hand_curves import Curve, StraightFit
from physid_drake.cell.hand_path import PathError

Array = NDArray[np.float64]

NUDGE = 1e-5  # s: of a knot, for differences
FARTHEST = 0.4  # of the smallest gap between knots: so far one may be moved
SMALLEST = 0.05  # standard deviations: a way on which samples go elsewhere sooner is none
ASIDE = 0.5  # of a step: so far samples may end from where it should lead them
UNSEEN = 1e-7  # of the largest singular value: ways of which a stream says nothing, as of two knots in one place


class _Way(NamedTuple):
    """One standard deviation: what k knots do, (k,) [s], and the n samples, (n, 2), in their own deviations."""

    knots: Array
    samples: Array


def path_errors(fit: StraightFit, origin: float, least: float) -> tuple[PathError, ...]:
    """The independent errors of a path that move the hand by at least so much.

    The linearised fit, its samples in units of their noise, is off by one standard deviation along each of its right
    singular vectors, and these are independent. A knot that may stand nearly anywhere, since the hand goes straight
    on there, moves the hand by less than its noise, but along no tangent: such a way is left out.

    Args:
        fit: of one stream.
        origin: the time of the stream's first sample [s].
        least: of the hand, at the samples [m].
    """
    curve, gap = fit.curve(), np.diff(fit.knots).min(initial=np.inf)
    found = []
    for way in _ways(fit, curve):
        farthest = FARTHEST * gap / max(np.abs(way.knots).max(initial=0.0), 1e-12)
        error = _step(fit, curve, way, float(min(1.0, farthest)), origin)
        if error is None:
            continue
        moved = error.path.positions(origin + fit.times) - fit.path(origin).positions(origin + fit.times)
        if np.linalg.norm(moved, axis=1).max() >= error.stds * least:
            found.append(error)
    return tuple(found)


def _step(fit: StraightFit, curve: Curve, way: _Way, stds: float, origin: float) -> PathError | None:
    """So many standard deviations along a way, or less where samples end elsewhere; None if far less."""
    if stds < SMALLEST:
        return None
    knots = fit.knots + stds * way.knots
    design, space = fit.design(knots), fit.at_rest(knots) if curve.rests else curve.space
    # The knots' own step is what is not linear: the coefficients make up for it, and the hand still comes to rest.
    asked = fit.design(fit.knots) @ curve.coefficients + stds * way.samples
    inner, *_ = np.linalg.lstsq(design @ space, asked, rcond=1e-13)
    if np.linalg.norm(design @ space @ inner - asked) > ASIDE * stds:
        return _step(fit, curve, way, 0.5 * stds, origin)
    return PathError(path=fit.as_path(knots, space @ inner, origin), stds=stds)


def _ways(fit: StraightFit, curve: Curve) -> list[_Way]:
    """The singular vectors of what knots and coefficients do to the samples."""
    of_knots, tangent = _tangent(fit, curve)
    scales = np.linalg.norm(tangent, axis=1)
    felt = scales > 0.0
    _, values, vectors = np.linalg.svd((tangent[felt] / scales[felt, None]).T, full_matrices=False)
    seen = values > UNSEEN * values[0]
    shares = vectors[seen] / values[seen, None] / scales[felt]
    return [_Way(share @ of_knots[felt], (share @ tangent[felt]).reshape(-1, 2)) for share in shares]


def _tangent(fit: StraightFit, curve: Curve) -> tuple[Array, Array]:
    """What may change: p coefficients and knots, by what it moves k knots (p, k), and the n samples (p, 2 n)."""
    still, places = np.zeros(len(fit.knots)), np.eye(len(fit.knots))
    design = fit.design(fit.knots)
    fitted = design @ curve.coefficients
    of_knots = [still for _ in curve.space.T for _ in range(2)]
    tangent = [np.outer(column, axis).ravel() for column in (design @ curve.space).T for axis in np.eye(2)]
    for place in places:
        nudged = fit.knots + NUDGE * place
        other, space = fit.design(nudged), fit.at_rest(nudged) if curve.rests else curve.space
        # The coefficients follow the knot: what is left is what the stream can tell of it.
        inner, *_ = np.linalg.lstsq(other @ space, fitted, rcond=1e-13)
        of_knots.append(place)
        tangent.append((other @ space @ inner - fitted).ravel() / NUDGE)
    return np.array(of_knots), np.array(tangent)
