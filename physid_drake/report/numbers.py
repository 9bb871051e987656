"""Numbers and units as a page writes them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

TIMES = ("start_s", "end_s")
DIGITS = 6


def rounded(value: Any) -> Any:
    """What a file of answers has: six significant digits, since what comes after them is not knowledge.

    Times have four decimals, whose origin may be far. JSON has no infinity.
    """
    if isinstance(value, dict):
        return {k: round(v, 4) if k in TIMES else rounded(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [rounded(v) for v in value]
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
    return value


def number(value: float | None, digits: int = 3) -> str:
    """A number for reading: significant digits, a true minus sign, powers of ten; a dash where there is none."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, power = text.split("e")
        if -5 < int(power) < 7:
            text = f"{value:.{max(0, digits - 1 - int(power))}f}"
        else:
            raised = str(int(power)).translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))
            text = f"{mantissa} × 10{raised}"
    return text.replace("-", "−")


def digits_between(value: float, others: Sequence[float]) -> int:
    """Significant digits, three to eight, with which a value is told from others: a scale of 1.0005 is not 1."""
    apart = [abs(value - other) for other in others if other != value and math.isfinite(other)]
    if not apart or value == 0.0 or not math.isfinite(value):
        return 3
    return min(8, max(3, 1 + math.ceil(math.log10(3.0 * abs(value) / min(apart)))))


def fixed(value: float) -> str:
    """Two decimals, so that the numbers of a column are alike."""
    return f"{value:.2f}".replace("-", "−") if abs(value) < 1e4 else number(value)


def tenths(value: float | None) -> str:
    """One decimal; a dash where there is no number."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.1f}".replace("-", "−")


def tiny(value: float) -> str:
    """A probability that may be too small for a float."""
    return "< 10⁻³⁰⁰" if value < 1e-300 else number(value, 2)


def chance(value: float) -> str:
    """A probability that something is so; never quite certain."""
    return "> 0.99" if value > 0.99 else fixed(value)


def _unit(unit: str) -> str:
    return "" if unit == "-" else unit.replace("*", "·").replace("^2", "²")


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A number with its unit; angles in degrees too."""
    text = f"{number(value, digits)} {_unit(unit)}".strip()
    if unit == "rad" and value is not None and math.isfinite(value):
        text += f" ({number(math.degrees(value), digits)}°)"
    return text


def interval(ends: Sequence[float] | None, unit: str, digits: int = 3) -> str:
    """From one end to the other, angles in degrees too; a dash where there is none."""
    if ends is None:
        return "–"
    low, high = (number(end, digits) for end in ends)
    turned = [number(math.degrees(end), digits) for end in ends]
    scale = f" ({turned[0]}° to {turned[1]}°)" if unit == "rad" else ""
    return f"{low} to {high} {_unit(unit)}".strip() + scale


def share(value: float, longest: float) -> float:
    """Of the longest: the length of a bar [%]."""
    return 100.0 * min(1.0, max(0.0, value / longest)) if math.isfinite(value) else 0.0
