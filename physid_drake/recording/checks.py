"""What a value of a recording must be: finite, positive, increasing; refused in one line where it is not."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from physid_drake.errors import RecordingError
from physid_drake.wording import shown

Array: TypeAlias = npt.NDArray[np.float64]


def frozen(value: npt.ArrayLike, name: str, columns: int | None) -> Array:
    """An array that cannot be written: (n,), or (n, columns) where columns are asked for.

    Raises:
        RecordingError: if it has another shape, or holds what is not finite.
    """
    array = np.array(value, dtype=np.float64)
    wanted = 1 if columns is None else 2
    if array.ndim != wanted or (columns is not None and array.shape[1] != columns):
        shape = "(n,)" if columns is None else f"(n, {columns})"
        raise RecordingError(f"{name} must have shape {shape}, but got {array.shape}; reshape it.")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0][0])
        raise RecordingError(f"{name} must be finite, but row {row} is {array[row]}; leave that row out.")
    array.setflags(write=False)
    return array


def check_times(times: Array) -> None:
    """Refuses times (n,) [s] that are none, or do not increase.

    Raises:
        RecordingError: if they are or do not.
    """
    if len(times) == 0:
        raise RecordingError("a stream needs at least one sample, but got none; leave the stream out.")
    late = np.flatnonzero(np.diff(times) <= 0.0)
    if len(late):
        k = int(late[0]) + 1
        raise RecordingError(
            f"times must increase, but times[{k}] = {float(times[k])!r} s follows {float(times[k - 1])!r} s; "
            "sort the samples and drop repeated times."
        )


def check_positive(name: str, unit: str, *values: float | None) -> None:
    """Refuses a length, mass or rate that is not a positive, finite number.

    Args:
        name: what the values are, for the message.
        unit: their unit, for the message.
        values: the numbers; None is passed over.

    Raises:
        RecordingError: if one of them is not positive and finite.
    """
    for value in values:
        if value is not None and not (np.isfinite(value) and value > 0.0):
            raise RecordingError(f"{name} must be positive, but got {shown(value)} {unit}; correct it.")


def check_not_negative(name: str, unit: str, value: float | None) -> None:
    """Refuses a standard deviation that is negative or not finite; 0 is an exact one.

    Raises:
        RecordingError: if it is.
    """
    if value is not None and not (np.isfinite(value) and value >= 0.0):
        raise RecordingError(f"{name} must not be negative, but got {shown(value)} {unit}; correct it.")


def check_choice(name: str, got: str, choices: tuple[str, ...]) -> None:
    """Refuses a word that is not one of the choices.

    Raises:
        RecordingError: if it is not.
    """
    if got not in choices:
        raise RecordingError(f"{name} must be one of {', '.join(choices)}, but got {shown(got)}; choose one of them.")
