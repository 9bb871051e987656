"""Small sums over arrays and vectors of the plane: without arrays of their own, and without a library."""

from __future__ import annotations

import math

from physid_drake.twin.compiled import compiled, compiled_inside


@compiled_inside
def length(x, y):
    """Of a vector; `math.hypot` looks after sizes that do not occur here, and takes five times as long."""
    return math.sqrt(x * x + y * y)


@compiled_inside
def turned_back(c, s, x, y):
    """A vector of W in B, which is turned by the angle with the cosine ``c`` and the sine ``s``."""
    return c * x + s * y, c * y - s * x


@compiled_inside
def within(value, last):
    """A place between 0 and ``last``; 0 of what is no number, so that no table is read beyond its end."""
    return min(value, last) if value > 0.0 else 0.0


@compiled
def copied(values, into):
    """Copy (n,) values."""
    for i in range(len(values)):
        into[i] = values[i]


@compiled
def differ(one, other):
    """Whether any of (n,) values do."""
    found = False
    for i in range(len(one)):
        found = found or one[i] != other[i]
    return found


@compiled
def product(one, other):
    """Sum of the products of (n,) values."""
    total = 0.0
    for i in range(len(one)):
        total += one[i] * other[i]
    return total


@compiled
def largest(values):
    """Largest size of (n,) values."""
    most = 0.0
    for i in range(len(values)):
        most = max(most, abs(values[i]))
    return most
