"""Values that several parts of a map have: units, rotations that stay, numbers of a range."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from physid_drake.convert.mapping import NORM_TOLERANCE
from physid_drake.convert.units import factor, symbol_of
from physid_drake.recording.description import Section


def unit_of(section: Section, kind: Mapping[str, float], what: str) -> str | None:
    """The unit that a section states, one of a kind; None where it states none."""
    if not section.has("unit"):
        return None
    unit = section.text("unit")
    with section.naming("unit"):
        factor(unit, kind, what)
    return symbol_of(unit)


def size_of_unit(section: Section, kind: Mapping[str, float], default: str) -> float:
    """How large a section's unit is: one of a kind, or a number."""
    if isinstance(section.values.get("unit"), int | float):
        return positive(section, "unit", 1.0)
    return kind[unit_of(section, kind, "it") or default]


def rotation_from(section: Section) -> tuple[float, float, float, float]:
    """A rotation that stays, as a quaternion or as an angle about the vertical."""
    if section.has("rotation_wxyz") and section.has("yaw_deg"):
        raise section.refuse("yaw_deg", "stands beside rotation_wxyz; give one of them.")
    if section.has("yaw_deg"):
        half = 0.5 * np.deg2rad(section.number("yaw_deg"))
        return float(np.cos(half)), 0.0, 0.0, float(np.sin(half))
    if not section.has("rotation_wxyz"):
        return 1.0, 0.0, 0.0, 0.0
    w, x, y, z = section.numbers("rotation_wxyz", 4)
    norm = float(np.linalg.norm([w, x, y, z]))
    if abs(norm - 1.0) > NORM_TOLERANCE:
        raise section.refuse("rotation_wxyz", f"must have norm 1 within {NORM_TOLERANCE:g}, but got {norm:.4g}.")
    return w / norm, x / norm, y / norm, z / norm


def truth(section: Section, key: str) -> bool:
    """A key that is true or false; false where it is not there."""
    if not section.has(key):
        return False
    return section.get(key, "true or false", lambda value: (value,) if isinstance(value, bool) else None)[0]


def positive(section: Section, key: str, default: float) -> float:
    """A key's positive number."""
    value = section.maybe_number(key)
    if value is not None and value <= 0.0:
        raise section.refuse(key, f"must be positive, but got {value:g}.")
    return default if value is None else value


def not_negative(section: Section, key: str, default: float) -> float:
    """A key's number that is 0 or more."""
    value = section.maybe_number(key)
    if value is not None and value < 0.0:
        raise section.refuse(key, f"must not be negative, but got {value:g}.")
    return default if value is None else value
