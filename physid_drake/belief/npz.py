"""Reads files of plain arrays with a header of JSON text, no pickles."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from physid_drake.errors import ParameterError
from physid_drake.files import FileError, MissingFileError
from physid_drake.npz import read_arrays
from physid_drake.space import Array
from physid_drake.wording import named, one_line, shown

MOST_COUNT = 1_000_000
SMALLEST = 1e-9
"""Of a hyperparameter, on the unit cube; the largest is its reciprocal. Their squares are ordinary numbers."""


def read_npz(path: str | Path, form: str) -> tuple[dict[str, Array], dict[str, Any]]:
    """All arrays of a file, and its header.

    Args:
        path: Of the file.
        form: The format that the header must state.

    Raises:
        ParameterError: When the file is damaged, holds what is no plain array, or is of another format.
        FileNotFoundError: When there is no file.
    """
    try:
        arrays = read_arrays(path)
        header = json.loads(str(arrays["header"])) if "header" in arrays else {}
    except MissingFileError:
        raise
    except FileError as error:
        raise ParameterError(f"belief '{named(path)}': {error}; delete it to begin anew.") from error
    except (ValueError, TypeError, RecursionError) as error:
        raise ParameterError(
            f"belief '{named(path)}': cannot be read: no header of JSON ({one_line(error)}); delete it to begin anew."
        ) from error
    said = header.get("format") if isinstance(header, dict) else header
    if said != form:
        raise ParameterError(
            f"belief '{named(path)}': the file must say format '{form}', but says {shown(said)};"
            " was it written by Belief.to_npz of this version?"
        )
    arrays.pop("header")
    wrong = next((name for name, array in arrays.items() if array.dtype.kind not in "biuf"), None)
    if wrong is not None:
        raise ParameterError(
            f"belief '{named(path)}': cannot be read: '{named(wrong)}' holds no numbers; delete it to begin anew."
        )
    return arrays, {str(key): value for key, value in header.items()}


def check_trials(arrays: Mapping[str, Array], dimension: int) -> None:
    """Refuse arrays of a belief that do not fit each other.

    Args:
        arrays: By name, as they were read.
        dimension: Of the space.

    Raises:
        ParameterError: When one is missing, has another shape, or holds what is not finite.
    """
    n, m = (len(np.atleast_1d(arrays[name])) for name in ("candidates", "thetas"))
    shapes = {
        "candidates": (n, dimension), "log_weights": (n,), "tried": (n,), "p_min": (n,), "thetas": (m, dimension),
        "errors": (m,), "lengths": (dimension,), "variances": (2,), "entropies": arrays["entropies"].shape[:1],
    }  # fmt: skip
    for name, shape in shapes.items():
        if arrays[name].shape != shape:
            raise ParameterError(f"'{name}' must have shape {shape}, but has {arrays[name].shape}")
        # A failed trial's error is infinite, or none at all.
        if name != "errors" and not np.isfinite(arrays[name]).all():
            raise ParameterError(f"'{name}' must be finite")
    for name in ("lengths", "variances"):
        if not ((arrays[name] > SMALLEST) & (arrays[name] < 1.0 / SMALLEST)).all():
            raise ParameterError(f"'{name}' must be between {SMALLEST:g} and {1.0 / SMALLEST:g}")
    if not n:
        raise ParameterError("there must be candidates")


def check_whole(what: str, value: object) -> None:
    """Refuse a count that is none, or absurd.

    Raises:
        ParameterError: When it is.
    """
    if not (isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_COUNT):
        raise ParameterError(f"{what} must be a whole number from 0 to {MOST_COUNT}, but is {shown(value)}")
