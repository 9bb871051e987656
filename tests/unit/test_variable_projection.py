"""Least squares that are linear in some unknowns: the residual and its Jacobian beside differences."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from physid_drake.cell.variable_projection import VariableProjection

TIMES = np.linspace(0.0, 1.0, 40)
DATA = np.column_stack([np.sin(5.0 * TIMES), np.exp(TIMES)])
KNOTS = np.array([0.7, 0.2, 0.45])


def columns(knots: np.ndarray) -> np.ndarray:
    return np.column_stack([np.ones_like(TIMES), *(np.maximum(TIMES - k, 0.0) ** 2 for k in knots)])


def without_slope_at_last(knots: np.ndarray) -> np.ndarray:
    """An orthonormal basis of the coefficients whose curve has no slope at the end; its signs are not steady."""
    row = np.array([[0.0, *(2.0 * (1.0 - knots))]])
    return np.asarray(np.linalg.svd(row)[2][1:].T)


@pytest.mark.parametrize("space", [None, without_slope_at_last])
def test_residual_and_jacobian(space) -> None:  # type: ignore[no-untyped-def]
    projection = VariableProjection(DATA, columns, space)
    design = columns(np.sort(KNOTS))
    design = design if space is None else design @ space(np.sort(KNOTS))
    left = DATA - design @ np.linalg.lstsq(design, DATA, rcond=None)[0]
    assert projection.residual(KNOTS) == pytest.approx(left.ravel(), abs=1e-12)
    by_differences = approx_fprime(KNOTS, VariableProjection(DATA, columns, space).residual, 1e-7)
    assert projection.jacobian(KNOTS) == pytest.approx(by_differences, abs=3e-5)
