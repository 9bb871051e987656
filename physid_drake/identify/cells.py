"""Friction that differs between cells of the underside: which combinations of the cells are identifiable."""

from __future__ import annotations

import dataclasses as dc
import itertools
import math

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from physid_drake.identify.estimates import MOST_PRIOR_LEFT
from physid_drake.pushes.theta import ThetaMap, friction_names

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True)
class Combination:
    """A linear combination of the cells' ln frictions.

    Attributes:
        weights: (n,) of the cells; their magnitudes sum to 1.
        strength: singular value of the whitened Jacobian relative to the prior, with the other parameters projected
            out [-].
        left: posterior over prior standard deviation of the combination [-]: (1 + strength^2)^(-1/2).
    """

    weights: Array
    strength: float
    left: float

    @property
    def identifiable(self) -> bool:
        """Whether the pushes leave less than ``MOST_PRIOR_LEFT`` of the prior's standard deviation."""
        return self.left < MOST_PRIOR_LEFT


@dc.dataclass(frozen=True, kw_only=True)
class IdentifiableCells:
    """What pushes say about the friction of the cells.

    Attributes:
        grid: number of cells along x and y of B.
        names: (n,) of the cells whose friction is a parameter.
        friction: (n,) estimates [-].
        left: (n,) posterior over prior standard deviation of each cell's ln friction [-].
        combinations: n of them, uncorrelated in prior and posterior, the best identified first.
        apart: names of neighbouring cells whose ratio of frictions is identifiable.
        not_apart: names of neighbouring cells whose ratio is not.
    """

    grid: tuple[int, int]
    names: tuple[str, ...]
    friction: Array
    left: Array
    combinations: tuple[Combination, ...]
    apart: tuple[tuple[str, str], ...]
    not_apart: tuple[tuple[str, str], ...]

    @property
    def identifiable(self) -> int:
        """Number of combinations that are identifiable."""
        return sum(c.identifiable for c in self.combinations)


def identifiable_cells(thetas: ThetaMap, theta: Array, prior: Array, posterior: Array) -> IdentifiableCells | None:
    """Which combinations of the cells' frictions a fit identifies; None without a grid of cells.

    They are the generalised eigenvectors of posterior against prior covariance of ln friction.

    Args:
        thetas: the parameters.
        theta: (d,) the estimate, each entry in its unit.
        prior: covariance (d, d) of theta before any push, in the unit cube.
        posterior: covariance (d, d) of theta given the pushes, in the unit cube.

    Source: A. Spantini et al., "Optimal low-rank approximations of Bayesian linear inverse problems", SIAM J. Sci.
        Comput. 37, 2015.
    """
    space = thetas.space
    grid = [name for name in friction_names(thetas.cells) if name in space.names]
    if thetas.cells == (1, 1) or not grid:
        return None
    at = [space.index(name) for name in grid]
    # In ln friction: the cube's coordinate is linear in it, over widths that bounds may make unequal.
    widths = np.array([math.log(space.upper[k] / space.lower[k]) for k in at])
    prior, posterior = (widths[:, None] * c[np.ix_(at, at)] * widths for c in (prior, posterior))
    shares, vectors = eigh(posterior, prior)
    left = np.sqrt(np.clip(shares, 1e-16, 1.0))
    apart: list[tuple[str, str]] = []
    not_apart: list[tuple[str, str]] = []
    for a, b in itertools.combinations(range(len(grid)), 2):
        if _neighbours(grid[a], grid[b]):
            way = np.zeros(len(grid))
            way[a], way[b] = 1.0, -1.0
            identifiable = math.sqrt((way @ posterior @ way) / (way @ prior @ way)) < MOST_PRIOR_LEFT
            (apart if identifiable else not_apart).append((grid[a], grid[b]))
    return IdentifiableCells(
        grid=thetas.cells,
        names=tuple(grid),
        friction=np.asarray(theta[at]),
        left=np.sqrt(np.diag(posterior) / np.diag(prior)),
        combinations=tuple(
            Combination(weights=_signed(v), strength=math.sqrt(1.0 / s**2 - 1.0), left=float(s))
            for s, v in zip(left, vectors.T, strict=True)
        ),
        apart=tuple(apart),
        not_apart=tuple(not_apart),
    )


def _signed(vector: Array) -> Array:
    """Scaled to magnitudes that sum to 1, mostly positive."""
    return np.asarray(vector / np.abs(vector).sum() * (1.0 if vector.sum() >= 0.0 else -1.0))


def _neighbours(first: str, second: str) -> bool:
    """Whether two cells share a side."""
    (i, j), (k, m) = ((int(v) for v in name.split("_")[-2:]) for name in (first, second))
    return abs(i - k) + abs(j - m) == 1
