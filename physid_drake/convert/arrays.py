"""Tables of arrays: npz, npy, HDF5, MATLAB, Parquet and JSON, in the layouts in which robots' logs are kept.

An array (n, k) becomes k columns ``name[0]`` to ``name[k-1]``; one of three axes (pushes, n, k) becomes the same with
its pushes one after the other, counted in ``[push]``. So do groups of a file that hold the same, one each.
Matrices (n, 3, 3), (n, 3, 4) or (n, 4, 4) become ``name[row,column]``. Dates and durations become seconds.
"""

from __future__ import annotations

import importlib
import io
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from physid_drake.convert.columns import Array, Columns, seconds_of, without_marks
from physid_drake.convert.groups import MATRICES, PUSH, Unread, joined
from physid_drake.convert.json_table import read_json, read_json_lines
from physid_drake.convert.matlab import read_matlab
from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_bytes
from physid_drake.npz import read_array, read_arrays
from physid_drake.wording import named, one_line

MOST_BYTES: Final = 1_000_000_000
MOST_NUMBERS: Final = 40_000_000
MOST_COLUMNS: Final = 64
"""Of one array: an image is no column."""
MOST_BODIES: Final = 16
"""Side by side in one array of a log."""
MOST_ARRAYS: Final = 50_000
"""Of hundreds of pushes with dozens of arrays each."""
MOST_AXES: Final = 4
"""Of pushes of matrices."""

_SECONDS: Final = {
    "W": 604800.0, "D": 86400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "ps": 1e-12,
}  # fmt: skip
"""Of NumPy's units of dates and durations; a month has no length."""

_BROKEN: Final = (
    OSError, ValueError, TypeError, RuntimeError, MemoryError, ArithmeticError, AttributeError, LookupError,
    zlib.error,
)  # fmt: skip


def read_array_table(path: Path) -> Columns:
    """The columns of a file of arrays; what is no number, no time and no text is passed over.

    Args:
        path: of the file; its ending says what it is.

    Raises:
        RecordingError: if it cannot be read, or what reads it is not installed; one line that names the file.
    """
    read = READERS[path.suffix.lower()]
    try:
        arrays = read(path)
    except RecordingError:
        raise
    except FileError as error:
        raise RecordingError(f"{named(path)}: {error}.") from error
    except _BROKEN as error:
        raise RecordingError(
            f"{named(path)}: cannot be read: damaged, or of another kind ({_why(error)})."
        ) from error
    numbers: dict[str, Array] = {}
    texts: dict[str, list[str]] = {}
    unread: dict[str, str] = {}
    units: dict[str, str] = {}
    clocks = {len(one) for one in arrays.values() if not isinstance(one, Unread) and one.ndim == 1}
    for name, array in arrays.items():
        if not isinstance(array, Unread) and array.dtype.kind in "UO" and array.ndim == 1:
            words = [str(value) for value in array[:MOST_NUMBERS]]
            times = seconds_of(words)
            if times is None:
                texts[name] = words
            else:
                numbers[name], units[name] = times, "s"
            continue
        found = _by_body(name, array) if _holds_bodies(array, clocks) else _columns(name, array)
        if isinstance(found, Unread):
            unread[name] = found.why
            continue
        numbers |= found
        if array.dtype.kind in "mM":
            units |= dict.fromkeys(found.keys() - {PUSH}, "s")
    if not numbers:
        raise RecordingError(f"{named(path)}: holds no columns of numbers; its arrays are {_shapes(arrays)}.")
    if sum(map(len, numbers.values())) > MOST_NUMBERS:
        raise RecordingError(f"{named(path)}: has more than {MOST_NUMBERS:,} numbers; cut the pushes out of it.")
    numbers = _without_empty_rows(without_marks(named(path.name), numbers))
    return Columns(source=named(path.name), numbers=numbers, texts=texts, units=units, unread=unread)


def _without_empty_rows(numbers: Mapping[str, Array]) -> dict[str, Array]:
    """The columns without rows in which all of their length are empty, as a text's empty lines are passed over."""
    kept = {}
    for length in {len(column) for column in numbers.values()}:
        table = np.array([column for column in numbers.values() if len(column) == length])
        kept[length] = ~np.isnan(table).all(axis=0)
    return {name: column[kept[len(column)]] for name, column in numbers.items()}


def _why(error: Exception) -> str:
    return "it claims more than it holds" if isinstance(error, MemoryError) else one_line(error)


def _columns(name: str, array: Any) -> dict[str, Array] | Unread:
    """What an array's columns are, or why it has none."""
    if not isinstance(array, Unread) and array.dtype.kind in "mM":
        array = _seconds(array)
    if isinstance(array, Unread):
        return array
    why = _no_columns(array)
    return Unread(why=why) if why else _columns_of_numbers(name, array)


def _no_columns(array: Any) -> str:
    """Why an array has no columns; nothing where it has some."""
    if array.dtype.kind not in "biuf":
        return f"it holds {array.dtype}, which is no number"
    if array.ndim == 0:
        return "it is a single number"
    if array.ndim > 1 and array.shape[-1] > MOST_COLUMNS:
        return _is_turned(array.shape) or _too_wide(array.shape[-1])
    if array.ndim > MOST_AXES or (array.ndim == MOST_AXES and not _holds_matrices(array)):
        return f"it has {array.ndim} axes, as images have"
    return ""


def _is_turned(shape: tuple[int, ...]) -> str:
    """What to do about an array whose samples lie along its second axis; nothing where they do not."""
    if len(shape) != 2 or not 1 < shape[0] <= MOST_COLUMNS:
        return ""
    return f"its shape is {shape}: transposed? A column needs the samples along the first axis; save it as array.T"


def _too_wide(width: int) -> str:
    return f"it has {width} numbers in a row, and a column at most {MOST_COLUMNS}"


def _columns_of_numbers(name: str, array: Any) -> dict[str, Array]:
    if array.ndim == 1:
        return {name: _floats(array)}
    if _holds_matrices(array):
        return _matrices(name, array)
    if array.ndim == 2:
        return {f"{name}[{k}]": _floats(array[:, k]) for k in range(array.shape[1])}
    pushes, rows, count = array.shape
    columns = {f"{name}[{k}]": _floats(array[:, :, k].ravel()) for k in range(count)}
    return columns | {PUSH: np.repeat(np.arange(pushes, dtype=np.float64), rows)}


def _holds_bodies(array: Any, clocks: set[int]) -> bool:
    """Whether the middle axis of an array counts bodies: it is short, and a plain array is as long as the first."""
    if isinstance(array, Unread) or array.ndim != 3 or array.dtype.kind not in "biuf" or _holds_matrices(array):
        return False
    samples, bodies, width = array.shape
    return samples in clocks and bodies <= MOST_BODIES < samples and width <= MOST_COLUMNS


def _by_body(name: str, array: Any) -> dict[str, Array]:
    """Columns of each body: ``name[body,k]``."""
    _, bodies, width = array.shape
    return {f"{name}[{j},{k}]": _floats(array[:, j, k]) for j in range(bodies) for k in range(width)}


def _holds_matrices(array: Any) -> bool:
    return array.ndim >= 3 and array.shape[-2:] in MATRICES


def _matrices(name: str, array: Any) -> dict[str, Array]:
    """Rotations or homogeneous transforms, entry by entry."""
    rows, columns = array.shape[-2:]
    found = {f"{name}[{i},{j}]": _floats(array[..., i, j].ravel()) for i in range(rows) for j in range(columns)}
    if array.ndim == 3:
        return found
    return found | {PUSH: np.repeat(np.arange(len(array), dtype=np.float64), array.shape[1])}


def _seconds(array: Any) -> Any:
    """Dates as seconds since 1970, durations as seconds; NaN where there is none."""
    unit, count = np.datetime_data(array.dtype)
    if unit not in _SECONDS:
        return Unread(why=f"it holds {array.dtype}, which is no time in seconds")
    return np.where(np.isnat(array), np.nan, array.astype(np.int64) * (count * _SECONDS[unit]))


def _floats(array: Any) -> Array:
    values: Array = np.array(array, dtype=np.float64)
    values[~np.isfinite(values)] = np.nan
    return values


def _shapes(arrays: Mapping[str, Any]) -> str:
    def said(array: Any) -> str:
        return f"({array.why})" if isinstance(array, Unread) else str(array.shape)

    return ", ".join(f"{named(name)} {said(array)}" for name, array in list(arrays.items())[:8]) or "none"


def _needs(module: str, path: Path, extra: str) -> Any:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.split(".", maxsplit=1)[0]
        raise RecordingError(
            f"{named(path)}: reading {path.suffix} needs {package}, which is not installed; run"
            f" `pip install physid_drake[{extra}]`."
        ) from error


def _read_hdf5(path: Path, *, turned: bool = False) -> dict[str, Any]:
    """Plain arrays; ``turned`` if their axes are the other way round."""
    h5py = _needs("h5py", path, "tables")
    # From memory: what took the file's place since then could be a pipe, which hangs.
    with h5py.File(io.BytesIO(read_bytes(path, most=MOST_BYTES)), "r") as opened:
        found: dict[str, Any] = {}
        _collect(h5py, opened, "", found, depth=0)
    if turned:
        found = {n: array if isinstance(array, Unread) else array.T.squeeze() for n, array in found.items()}
    return joined(_columns_only(found))


def _collect(h5py: Any, group: Any, prefix: str, found: dict[str, Any], depth: int) -> None:
    """Plain arrays of this very file: links are not followed, so that nothing is read from elsewhere."""
    if depth > 8 or len(found) > MOST_ARRAYS:
        raise FileError("it nests deeper, or holds more arrays, than a log does")
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            _collect(h5py, item, f"{prefix}{name}/", found, depth + 1)
        elif isinstance(item, h5py.Dataset):
            found[f"{prefix}{name}"] = item[()] if _is_plain(item) else Unread(why=_no_plain(item))


def _columns_only(found: Mapping[str, Any]) -> dict[str, Any]:
    """Arrays, but why there are no columns where there are none: images of all pushes are not joined."""

    def column(array: Any) -> Any:
        if isinstance(array, Unread) or (array.dtype.kind in "UO" and array.ndim == 1):
            return array
        why = _no_columns(array)
        return Unread(why=why) if why else array

    return {name: column(array) for name, array in found.items()}


def _is_plain(item: Any) -> bool:
    plain = item.dtype.kind in "biuf" and item.shape is not None and 1 <= len(item.shape) <= 4
    return plain and item.external is None and not item.is_virtual and item.size <= MOST_NUMBERS


def _no_plain(item: Any) -> str:
    """Why a dataset is none that is read."""
    if item.dtype.kind not in "biuf":
        return f"it holds {item.dtype}, which is no number"
    if item.external is not None or item.is_virtual:
        return "it lies in another file"
    return f"it has the shape {item.shape}, which is no column's"


def _read_matlab(path: Path) -> dict[str, Any]:
    """Variables and fields of structures; of 7.3, which is HDF5 with the axes the other way round."""
    content = read_bytes(path, most=MOST_BYTES)
    if b"MATLAB 7.3" in content[:128]:
        return _read_hdf5(path, turned=True)
    return joined(_columns_only(read_matlab(content)))


def _read_parquet(path: Path) -> dict[str, Any]:
    parquet = _needs("pyarrow.parquet", path, "tables")
    table = parquet.read_table(io.BytesIO(read_bytes(path, most=MOST_BYTES)))
    return {name: _of_arrow(table.column(name)) for name in dict.fromkeys(table.column_names)}


def _of_arrow(column: Any) -> Any:
    """An array of a column of Arrow: numbers, lists of equally many, dates, times of the day, durations, text."""
    arrow = importlib.import_module("pyarrow")
    types, kind = arrow.types, column.type
    if types.is_dictionary(kind):
        column, kind = column.cast(kind.value_type), kind.value_type
    if types.is_list(kind) or types.is_large_list(kind) or types.is_fixed_size_list(kind):
        return _of_lists(column)
    if types.is_decimal(kind):
        return column.cast(arrow.float64()).to_numpy()
    if types.is_time(kind):
        whole = column.cast(arrow.int32() if types.is_time32(kind) else arrow.int64())
        return whole.cast(arrow.int64()).cast(arrow.duration(kind.unit)).to_numpy()
    if (
        types.is_integer(kind) or types.is_floating(kind) or types.is_boolean(kind) or types.is_temporal(kind)
        or types.is_string(kind) or types.is_large_string(kind)
    ):  # fmt: skip
        return column.to_numpy()
    return Unread(why=f"it holds {named(kind)}, which is no number")


def _of_lists(column: Any) -> Any:
    rows = column.to_pylist()
    widths = {0 if row is None else len(row) for row in rows}
    width = min(widths, default=0)
    if width == 0 or len(widths) > 1:
        return Unread(why="its lists are not equally long")
    return np.array(rows) if width <= MOST_COLUMNS else Unread(why=_too_wide(width))


def _read_npy(path: Path) -> dict[str, Any]:
    """One array, which has no name, or the fields of a structured one."""
    found: dict[str, Any] = {}
    _structure("", read_array(path), found, depth=0)
    return found


def _structure(name: str, array: Any, found: dict[str, Any], depth: int) -> None:
    if depth > 8 or len(found) > MOST_ARRAYS:
        raise FileError("it nests deeper, or holds more arrays, than a log does")
    if array.dtype.names is None:
        found[name or "array"] = array
        return
    for field in array.dtype.names:
        _structure(f"{name}/{field}" if name else field, array[field], found, depth + 1)


def _joined(read: Callable[[Path], dict[str, Any]]) -> Callable[[Path], dict[str, Any]]:
    """A reader that joins groups as well."""
    return lambda path: joined(_columns_only(read(path)))


READERS: Final[Mapping[str, Callable[[Path], dict[str, Any]]]] = {
    ".npz": read_arrays, ".npy": _read_npy, ".h5": _read_hdf5, ".hdf5": _read_hdf5, ".mat": _read_matlab,
    ".parquet": _read_parquet, ".json": _joined(read_json), ".jsonl": _joined(read_json_lines),
}  # fmt: skip
