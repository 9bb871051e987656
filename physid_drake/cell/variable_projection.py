"""Least squares that are linear in some unknowns and not in others, with the exact Jacobian of the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DERIVATIVE: Final = 1e-7
"""By which an unknown is moved to see what that changes of the columns."""

ROUND_OFF_SHARE: Final = 1e-13
"""Of the largest singular value: what is less is none."""


class VariableProjection:
    """What the best coefficients leave of the data, as a function of the unknowns that the columns depend on.

    Golub and Pereyra (1973): the residual is r = (1 - M M^+) y, M being the columns, and
    dr = -(1 - M M^+) dM M^+ y - (dM M^+)^T r.
    """

    def __init__(
        self, data: Array, columns: Callable[[Array], Array], space: Callable[[Array], Array] | None = None
    ) -> None:
        """Take the data (n, c).

        Args:
            data: one column for each set of coefficients.
            columns: (n, m) of sorted unknowns (k,).
            space: (m, f) orthonormal, of the coefficients that are allowed; None allows all.
        """
        self._data, self._columns_of, self._space_of = data, columns, space
        self._at = np.empty(0)

    def residual(self, unknowns: Array) -> Array:
        """What is left of the data (n c,) with unknowns (k,) in any order."""
        self._look(unknowns)
        return self._left.ravel()

    def jacobian(self, unknowns: Array) -> Array:
        """Of the residual (n c, k)."""
        self._look(unknowns)
        slopes = np.empty((*self._left.shape, len(unknowns)))
        for k in range(len(unknowns)):
            moved = np.array(unknowns)
            moved[k] += DERIVATIVE
            columns, space = self._within(np.sort(moved))
            # The basis of the space may be another one: of it, the combinations nearest to those here.
            change = (columns @ (space.T @ self._space) - self._columns) / DERIVATIVE
            along = change @ self._coefficients
            beside = self._v.T @ (change.T @ self._left) / self._s[:, None]
            slopes[:, :, k] = -(along - self._u @ (self._u.T @ along) + self._u @ beside)
        return slopes.reshape(-1, len(unknowns))

    def _look(self, unknowns: Array) -> None:
        if np.array_equal(unknowns, self._at):
            return
        self._at = np.array(unknowns)
        self._columns, self._space = self._within(np.sort(unknowns))
        u, s, vt = np.linalg.svd(self._columns, full_matrices=False)
        sound = s > ROUND_OFF_SHARE * s[0]
        self._u, self._s, self._v = u[:, sound], s[sound], vt[sound].T
        known = self._u.T @ self._data
        self._coefficients = self._v @ (known / self._s[:, None])
        self._left = self._data - self._u @ known

    def _within(self, unknowns: Array) -> tuple[Array, Array]:
        columns = self._columns_of(unknowns)
        space = np.eye(columns.shape[1]) if self._space_of is None else self._space_of(unknowns)
        return columns @ space, space
