"""Score tests: what each effect would change at a fitted model, and how much of the misfit that explains, linearised.

Source: C. R. Rao, Proc. Camb. Phil. Soc. 44, 1948.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects import Coordinate, Effect, Family
from physid_drake.inference.bounded import bounded
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.push import ridged, weighed
from physid_drake.inference.rollouts import Ask, Physics
from physid_drake.inference.scatter import log_prior_of_scatter, scatters_beside
from physid_drake.inference.slopes import slope

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Column:
    """The change of all pushes with one coordinate of an effect, at a point of its chart where the effect is null.

    Attributes:
        kind: the effect's class.
        family: gives the point of its chart, and which coordinates leave it.
        index: of the coordinate in the chart.
        coordinate: its description.
        pushes: derivative (m_i,) of each push's prediction with respect to the coordinate, in units of the noise.
    """

    kind: type[Effect]
    family: Family
    index: int
    coordinate: Coordinate
    pushes: tuple[Array, ...]

    @property
    def null(self) -> float:
        """The coordinate's value at the family's point, where the effect is null."""
        return self.family.point[self.index]


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Score:
    """How much one family of an effect explains.

    Attributes:
        kind: the effect's class.
        family: of its score tests.
        gain: of log likelihood, linearised.
        point: (k,) in the effect's chart, where the linearised fit ends.
        dz: (n,), change of the fitted model's own coordinates in that fit.
    """

    kind: type[Effect]
    family: Family
    gain: float
    point: Array
    dz: Array


def columns(fitter: Fitter, fit: Fit, kinds: Sequence[type[Effect]]) -> list[Column]:
    """Columns of all families of some effects at a fitted model, whose own effects stay in the rollouts."""
    around = fitter.case.around
    blank = [
        Column(kind=kind, family=family, index=j, coordinate=kind.chart(around)[j], pushes=())
        for kind in kinds
        for family in kind.families(around)
        for j in family.free
    ]
    simulated = _simulated(fitter, fit, [c for c in blank if not c.family.shares])
    made = []
    for c in blank:
        parts = [s for s in simulated if s.kind is c.kind]
        made.append(_added_up(c, parts) if c.family.shares else next(s for s in parts if _same(s, c)))
    return made


def _same(first: Column, second: Column) -> bool:
    return first.family == second.family and first.index == second.index


def _simulated(fitter: Fitter, fit: Fit, blank: Sequence[Column]) -> list[Column]:
    h, point, around = fit.hypothesis, fit.point, fitter.case.around
    theta, present = h.theta(point.z), h.effects(point.z)

    def stepped(c: Column, sign: float) -> Physics:
        at = np.array(c.family.point)
        at[c.index] += sign * c.family.size * c.coordinate.step
        return Physics(theta, (*present, c.kind.at(at, around)))

    sides = [[stepped(c, sign) for sign in ((1.0, -1.0) if c.family.central else (1.0,))] for c in blank]
    asks = [
        Ask(i, physics, point.nuisance[i]) for both in sides for physics in both for i in range(fitter.count)
    ]  # fmt: skip
    vectors = iter(fitter.predictor.vectors(asks))
    plain: list[Array | None] = [
        p - more @ point.z[h.simulated :] for p, more in zip(point.predicted, fitter.tolerances, strict=True)
    ]
    made = []
    for c, both in zip(blank, sides, strict=True):
        after = [next(vectors) for _ in range(fitter.count)]
        before = [next(vectors) for _ in range(fitter.count)] if len(both) == 2 else plain
        width = len(both) * c.family.size * c.coordinate.step
        slopes = tuple(
            np.zeros_like(point.predicted[i]) if b is None else slope(b, a, width)
            for i, (b, a) in enumerate(zip(before, after, strict=True))
        )
        made.append(dc.replace(c, pushes=slopes))
    return made


def _added_up(blank: Column, parts: Sequence[Column]) -> Column:
    """So much of each of an effect's simulated columns (small effects add up)."""
    shares = np.array(blank.family.shares)
    pushes = tuple(
        np.column_stack([part.pushes[i] for part in parts]) @ shares for i in range(len(parts[0].pushes))
    )  # fmt: skip
    return dc.replace(blank, pushes=pushes)


def by_family(found: Sequence[Column]) -> list[list[int]]:
    """Indices of the columns that belong to the same family of an effect, family by family."""
    families: dict[tuple[str, Family], list[int]] = {}
    for k, c in enumerate(found):
        families.setdefault((c.kind.name, c.family), []).append(k)
    return list(families.values())


def scores(fitter: Fitter, fit: Fit, found: Sequence[Column]) -> list[Score]:
    """The score test of each family, best first: the gain of log likelihood if it is added and all else is refitted.

    Refits are linear: of z, the family's coordinates (within their bounds), all nuisance parameters and the scatter.

    Args:
        fitter: of the recording.
        fit: the model to which families are added.
        found: its columns.
    """
    n, families = fit.hypothesis.dimension, by_family(found)
    best: list[tuple[float, Array]] = [(-math.inf, np.zeros(0))] * (1 + len(families))
    for scatter in scatters_beside(fit.scatter):
        value, precision, right = _equations(fitter, fit, found, scatter)
        for k, members in enumerate([[], *families]):
            gain, beta = _solved(
                precision, right, [*range(n), *(n + m for m in members)], [found[m] for m in members]
            )
            if value + gain > best[k][0]:
                best[k] = value + gain, beta
    made = []
    for members, (reached, beta) in zip(families, best[1:], strict=True):
        first = found[members[0]]
        point = np.array(first.family.point)
        point[[found[m].index for m in members]] += beta[n:]
        made.append(
            Score(kind=first.kind, family=first.family, gain=reached - best[0][0], point=point, dz=beta[:n])
        )  # fmt: skip
    return sorted(made, key=lambda s: -s.gain)


def _equations(fitter: Fitter, fit: Fit, found: Sequence[Column], scatter: float) -> tuple[float, Array, Array]:
    """Log likelihood where the fit is, precision and precision times estimate of all that may move from there."""
    h = fit.hypothesis
    n, value = h.dimension, log_prior_of_scatter(scatter)
    precision, right = np.zeros((n + len(found),) * 2), np.zeros(n + len(found))
    precision[:n, :n], right[:n] = h.precision, h.precision @ (h.mean - fit.point.z)
    for i, (push, prior) in enumerate(zip(fit.pushes, fitter.priors(scatter), strict=True)):
        shared = np.column_stack([push.shared, *(c.pushes[i] for c in found)])
        one = weighed(push.residual, shared, push.nuisance, prior, fit.noise_scale, fit.tail)
        precision += one.precision
        right += one.right
        value += one.log_density
    precision += np.diag(np.concatenate([np.zeros(n), [c.coordinate.std**-2.0 for c in found]]))
    return value, precision, right


def _solved(precision: Array, right: Array, index: list[int], some: Sequence[Column]) -> tuple[float, Array]:
    """Gain in log likelihood of some coordinates, the last of which are those of columns, and where they end."""
    block, r = ridged(precision[np.ix_(index, index)]), right[index]
    free = [np.inf] * (len(index) - len(some))
    least = [-one for one in free] + [c.coordinate.lower - c.null for c in some]
    most = free + [c.coordinate.upper - c.null for c in some]
    beta = bounded(block, r, (np.array(least), np.array(most)))
    return float(r @ beta - 0.5 * beta @ block @ beta), beta
