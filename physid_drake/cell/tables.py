"""Numbers over places, speeds and headings, and what is between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Row: TypeAlias = tuple[float, ...]
Rows: TypeAlias = tuple[Row, ...]
Numbers = TypeVar("Numbers", Array, Complex)


@dataclass(frozen=True)
class Places:
    """Where on the table the numbers of rows and columns stand.

    Attributes:
        x, y: of the first number of the first row [m].
        step_x: from row to row, along x [m].
        step_y: from number to number in a row, along y [m].
    """

    x: float
    y: float
    step_x: float
    step_y: float

    def between(self, rows: Numbers, places: Complex) -> Numbers:
        """Bilinear between the numbers around each place (n,), x + iy [m], and constant beyond the table's edge."""
        u = np.clip((places.real - self.x) / self.step_x, 0.0, len(rows) - 1.0)
        v = np.clip((places.imag - self.y) / self.step_y, 0.0, rows.shape[1] - 1.0)
        i, j = u.astype(np.intp), v.astype(np.intp)
        i1, j1 = np.minimum(i + 1, len(rows) - 1), np.minimum(j + 1, rows.shape[1] - 1)
        low = rows[i, j] + (v - j) * (rows[i, j1] - rows[i, j])
        high = rows[i1, j] + (v - j) * (rows[i1, j1] - rows[i1, j])
        return np.asarray(low + (u - i) * (high - low))


@dataclass(frozen=True)
class Speeds:
    """Numbers at speeds in equal steps of their logarithm: linear over it, and constant beyond both ends.

    Attributes:
        slowest, fastest: of the first and of the last number [m/s].
    """

    slowest: float
    fastest: float

    def step(self, count: int) -> float:
        """From number to number, of ``count``, in the logarithm of the speed."""
        return math.log(self.fastest / self.slowest) / (count - 1) if count > 1 else 1.0

    def between(self, numbers: Numbers, speeds: Array) -> Numbers:
        """At speeds (n,) [m/s]."""
        logs = np.log(np.maximum(speeds, self.slowest))
        known = math.log(self.slowest) + self.step(len(numbers)) * np.arange(len(numbers))
        return np.asarray(np.interp(logs, known, numbers))


def around(numbers: Numbers, angles: Array) -> Numbers:
    """At angles (n,) [rad], of numbers at equal angles from 0 on: periodic, and linear between them."""
    closed = np.append(numbers, numbers[0])
    known = np.linspace(0.0, 2.0 * math.pi, len(closed))
    return np.asarray(np.interp(angles % (2.0 * math.pi), known, closed))


def slopes_around(numbers: Sequence[float]) -> Row:
    """Derivative [1/rad] at each of the numbers at equal angles: from its neighbours on either side."""
    ahead, behind = np.roll(numbers, -1), np.roll(numbers, 1)
    return tuple((0.25 * len(numbers) / math.pi * (ahead - behind)).tolist())
