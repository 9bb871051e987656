"""Which values a number can have."""

from __future__ import annotations

import dataclasses as dc
import math

SHORT_OF = 1e-3  # how near a drawn value comes to an end that it must not reach


@dc.dataclass(frozen=True, kw_only=True)
class Range:
    """An interval of the real numbers; ``above`` and ``below`` do not belong to it, ``least`` and ``most`` do."""

    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf

    def holds(self, value: float) -> bool:
        """Whether a value is in it."""
        return self.above < value < self.below and self.least <= value <= self.most

    def nearest(self, value: float) -> float:
        """The value, or the nearest one in it, ``SHORT_OF`` from an end that does not belong to it."""
        low, high = max(self.least, self.above + SHORT_OF), min(self.most, self.below - SHORT_OF)
        return value if self.holds(value) else min(max(value, low), high)

    @property
    def rule(self) -> str:
        """In words, to follow "a number"; empty where every number will do."""
        words = (("above", self.above), ("of at least", self.least), ("of at most", self.most), ("below", self.below))
        return " and ".join(f"{word} {end:g}" for word, end in words if math.isfinite(end))


def is_whole(value: object) -> bool:
    """Whether a value of a file is a whole number; Python takes a truth value for one."""
    return isinstance(value, int) and not isinstance(value, bool)


ANY = Range()
POSITIVE = Range(above=0.0)
NOT_NEGATIVE = Range(least=0.0)
SHARE = Range(least=0.0, below=1.0)  # of a whole of which something must be left
COEFFICIENT = Range(least=0.0, most=1.0)  # of restitution
