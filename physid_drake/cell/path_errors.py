"""What the path of a hand may be off by where its stream is noisy."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.hand_curves import Curve, StraightFit
from physid_drake.cell.hand_path import PathError

Array = NDArray[np.float64]

NUDGE = 1e-5  # s: of a knot, for differences
FARTHEST = 0.4  # of the smallest gap between knots: so far one may be moved
SMALLEST = 0.05  # standard deviations: a way that leaves its tangent sooner is none
CROOKED = 1.25  # times as far as its tangent: a step that is shortened
UNSEEN = 1e-7  # of the largest singular value: ways of which a stream says nothing, as of two knots in one place


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
        farthest = FARTHEST * gap / max(np.abs(way[curve.coefficients.size :]).max(initial=0.0), 1e-12)
        error = _step(fit, curve, way, float(min(1.0, farthest)), origin)
        if error is None:
            continue
        moved = error.path.positions(origin + fit.times) - fit.path(origin).positions(origin + fit.times)
        if np.linalg.norm(moved, axis=1).max() >= error.stds * least:
            found.append(error)
    return tuple(found)


def _step(fit: StraightFit, curve: Curve, way: Array, stds: float, origin: float) -> PathError | None:
    """So many standard deviations along a way, or less where samples would leave its tangent; None if far less."""
    if stds < SMALLEST:
        return None
    of_coefficients, of_knots = np.split(way, [curve.coefficients.size])
    coefficients, knots = curve.coefficients + stds * of_coefficients.reshape(-1, 2), fit.knots + stds * of_knots
    moved = fit.design(knots) @ coefficients - fit.design(fit.knots) @ curve.coefficients
    if np.linalg.norm(moved) > CROOKED * stds:
        return _step(fit, curve, way, 0.5 * stds, origin)
    return PathError(path=fit.as_path(knots, coefficients, origin), stds=stds)


def _ways(fit: StraightFit, curve: Curve) -> Array:
    """Changes (w, 2 m + k) of m coefficients along x and y and of k knots, by one standard deviation each."""
    changes, tangent = _tangent(fit, curve)
    scales = np.linalg.norm(tangent, axis=1)
    felt = scales > 0.0
    _, values, vectors = np.linalg.svd((tangent[felt] / scales[felt, None]).T, full_matrices=False)
    seen = values > UNSEEN * values[0]
    ways: Array = (vectors[seen] / values[seen, None] / scales[felt]) @ changes[felt]
    return ways


def _tangent(fit: StraightFit, curve: Curve) -> tuple[Array, Array]:
    """What may change: coefficients and knots (p, 2 m + k), and what the n samples of the curve do then (p, 2 n)."""
    design = fit.design(fit.knots)
    fitted = design @ curve.coefficients
    changes, tangent = [], []
    for column in curve.space.T:
        for axis in np.eye(2):
            changes.append(np.append(np.outer(column, axis), np.zeros(len(fit.knots))))
            tangent.append(np.outer(design @ column, axis).ravel())
    for place in np.eye(len(fit.knots)):
        nudged = fit.knots + NUDGE * place
        other, space = fit.design(nudged), fit.at_rest(nudged) if curve.rests else curve.space
        # The coefficients follow the knot: what is left is what the stream can tell of it.
        inner, *_ = np.linalg.lstsq(other @ space, fitted, rcond=1e-13)
        changes.append(np.append((space @ inner - curve.coefficients) / NUDGE, place))
        tangent.append((other @ space @ inner - fitted).ravel() / NUDGE)
    return np.array(changes), np.array(tangent)
