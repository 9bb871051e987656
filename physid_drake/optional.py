"""What a port or a state of a diagram holds where there may be nothing: Drake 1.58 takes no None in a value."""

from __future__ import annotations

from typing import Any


def boxed(value: Any) -> tuple[Any, ...]:
    """A tuple of the value; an empty one of None."""
    return () if value is None else (value,)


def unboxed(box: tuple[Any, ...]) -> Any:
    """The value in a tuple of ``boxed``; None where there is none."""
    return box[0] if box else None
