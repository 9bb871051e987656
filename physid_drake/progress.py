"""How long computations say how far they are."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""Told a stage, steps done, and steps in all; both 0 where nobody knows."""
