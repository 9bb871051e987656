"""Tables of arrays: npz, HDF5, MATLAB and Parquet, in the layouts in which robots' logs are kept.

An array (n, k) becomes k columns ``name[0]`` to ``name[k-1]``; one of three axes (pushes, n, k) becomes the same with
its pushes one after the other, counted in ``[push]``. So do groups of an HDF5 file that hold the same, one each.
Matrices (n, 3, 3), (n, 3, 4) or (n, 4, 4) become ``name[row,column]``.
"""

from __future__ import annotations

import importlib
import io
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import scipy.io

from physid_drake.convert.columns import Array, Columns
from physid_drake.errors import RecordingError
from physid_drake.files import FileError, read_bytes
from physid_drake.npz import read_arrays
from physid_drake.wording import named, one_line

PUSH: Final = "[push]"
MOST_BYTES: Final = 1_000_000_000
MOST_NUMBERS: Final = 40_000_000
MOST_COLUMNS: Final = 64
"""Of one array: an image is no column."""

_PACKED: Final = 15
"""MATLAB's code of an element that is packed by zlib."""
_PIECE: Final = 1 << 20

_BROKEN: Final = (
    OSError, ValueError, TypeError, RuntimeError, MemoryError, OverflowError, AttributeError, LookupError,
    zlib.error, scipy.io.matlab.MatReadError,
)  # fmt: skip


def read_array_table(path: Path) -> Columns:
    """The columns of an npz, HDF5, MATLAB or Parquet file; what is no number and no text is passed over.

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
    for name, array in arrays.items():
        if array.dtype.kind in "UO" and array.ndim == 1:
            texts[name] = [str(value) for value in array[:MOST_NUMBERS]]
        elif array.dtype.kind in "biuf" and 1 <= array.ndim <= 4:
            numbers |= _columns(name, array)
    if not numbers:
        raise RecordingError(f"{named(path)}: holds no columns of numbers; its arrays are {_shapes(arrays)}.")
    if sum(map(len, numbers.values())) > MOST_NUMBERS:
        raise RecordingError(f"{named(path)}: has more than {MOST_NUMBERS:,} numbers; cut the pushes out of it.")
    return Columns(source=named(path.name), numbers=_without_empty_rows(numbers), texts=texts)


def _without_empty_rows(numbers: Mapping[str, Array]) -> dict[str, Array]:
    """The columns without rows in which all of their length are empty, as a text's empty lines are passed over."""
    kept = {}
    for length in {len(column) for column in numbers.values()}:
        table = np.array([column for column in numbers.values() if len(column) == length])
        kept[length] = ~np.isnan(table).all(axis=0)
    return {name: column[kept[len(column)]] for name, column in numbers.items()}


def _why(error: Exception) -> str:
    return "it claims more than it holds" if isinstance(error, MemoryError) else one_line(error)


def _columns(name: str, array: Any) -> dict[str, Array]:
    if array.ndim == 1:
        return {name: _floats(array)}
    if array.shape[-1] > MOST_COLUMNS:
        return {}
    if _holds_matrices(array):
        return _matrices(name, array)
    if array.ndim == 2:
        return {f"{name}[{k}]": _floats(array[:, k]) for k in range(array.shape[1])}
    if array.ndim != 3:
        return {}
    pushes, rows, count = array.shape
    columns = {f"{name}[{k}]": _floats(array[:, :, k].ravel()) for k in range(count)}
    return columns | {PUSH: np.repeat(np.arange(pushes, dtype=np.float64), rows)}


def _holds_matrices(array: Any) -> bool:
    return array.ndim >= 3 and array.shape[-2:] in ((3, 3), (3, 4), (4, 4))


def _matrices(name: str, array: Any) -> dict[str, Array]:
    """Rotations or homogeneous transforms, entry by entry."""
    rows, columns = array.shape[-2:]
    found = {f"{name}[{i},{j}]": _floats(array[..., i, j].ravel()) for i in range(rows) for j in range(columns)}
    if array.ndim == 3:
        return found
    return found | {PUSH: np.repeat(np.arange(len(array), dtype=np.float64), array.shape[1])}


def _floats(array: Any) -> Array:
    values: Array = np.array(array, dtype=np.float64)
    values[~np.isfinite(values)] = np.nan
    return values


def _shapes(arrays: Mapping[str, Any]) -> str:
    said = ", ".join(f"{named(name)} {array.shape}" for name, array in list(arrays.items())[:8])
    return said or "none"


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
    return _joined({name: array.T.squeeze() for name, array in found.items()} if turned else found)


def _collect(h5py: Any, group: Any, prefix: str, found: dict[str, Any], depth: int) -> None:
    """Plain arrays of this very file: links are not followed, so that nothing is read from elsewhere."""
    if depth > 8 or len(found) > 10_000:
        raise RecordingError("it nests deeper, or holds more arrays, than a log does")
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        item = group[name]
        if isinstance(item, h5py.Group):
            _collect(h5py, item, f"{prefix}{name}/", found, depth + 1)
        elif isinstance(item, h5py.Dataset) and _is_plain(item):
            found[f"{prefix}{name}"] = item[()]


def _is_plain(item: Any) -> bool:
    plain = item.dtype.kind in "biuf" and item.shape is not None and 1 <= len(item.shape) <= 4
    return plain and item.external is None and not item.is_virtual and item.size <= MOST_NUMBERS


def _joined(found: dict[str, Any]) -> dict[str, Any]:
    """Groups at the top that hold the same arrays, one after the other: robots' logs keep one for each push."""
    groups: dict[str, dict[str, Any]] = {}
    for name, array in found.items():
        head, _, rest = name.partition("/")
        groups.setdefault(head, {})[rest] = array
    sets = {frozenset(arrays) for arrays in groups.values()}
    if len(groups) < 2 or len(sets) != 1 or "" in next(iter(sets)):
        return found
    lengths = [{len(array) for array in arrays.values()} for arrays in groups.values()]
    if any(len(one) != 1 for one in lengths):
        return found
    heads = sorted(groups, key=lambda head: (len(head), head))
    joined = {name: np.concatenate([groups[head][name] for head in heads]) for name in groups[heads[0]]}
    counts = [len(next(iter(groups[head].values()))) for head in heads]
    return joined | {PUSH: np.repeat(np.arange(len(heads), dtype=np.float64), counts)}


def _read_matlab(path: Path) -> dict[str, Any]:
    """Variables and fields of structures; of 7.3, which is HDF5 with the axes the other way round."""
    content = read_bytes(path, most=MOST_BYTES)
    if b"MATLAB 7.3" in content[:128]:
        return _read_hdf5(path, turned=True)
    _check_unpacked(content)
    found: dict[str, Any] = {}
    # It reads streams, too; the stubs know of paths alone.
    stream: Any = io.BytesIO(content)
    for name, value in scipy.io.loadmat(stream, squeeze_me=True, struct_as_record=True).items():
        if not name.startswith("__"):
            _fields(name, value, found, depth=0)
    return _joined(found)


def _fields(name: str, value: Any, found: dict[str, Any], depth: int) -> None:
    if depth > 8 or len(found) > 10_000:
        raise RecordingError("it nests deeper, or holds more arrays, than a log does")
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.names is None:
        if value.dtype.kind in "biufU" and value.ndim >= 1:
            found[name] = value
        return
    # One structure, or an array of them: one for each push.
    for k, one in enumerate(np.atleast_1d(value)[:1000]):
        for field in value.dtype.names:
            prefix = name if value.ndim == 0 else f"{name}[{k}]"
            _fields(f"{prefix}/{field}", one[field], found, depth + 1)


def _check_unpacked(content: bytes) -> None:
    """Of MATLAB's elements that are packed, each is unpacked in pieces: none may be more than a log is."""
    order: Literal["little", "big"] = "little" if content[126:128] == b"IM" else "big"
    at, total = 128, 0
    while at + 8 <= len(content):
        kind = int.from_bytes(content[at : at + 4], order)
        size = int.from_bytes(content[at + 4 : at + 8], order)
        if kind == _PACKED:
            unpack, packed = zlib.decompressobj(), content[at + 8 : at + 8 + size]
            while packed and not unpack.eof:
                total += len(unpack.decompress(packed, _PIECE))
                packed = unpack.unconsumed_tail
                if total > MOST_BYTES:
                    raise RecordingError(f"it unpacks to more than {MOST_BYTES / 1e6:g} MB")
        at += 8 + size


def _read_parquet(path: Path) -> dict[str, Any]:
    parquet = _needs("pyarrow.parquet", path, "tables")
    table = parquet.read_table(io.BytesIO(read_bytes(path, most=MOST_BYTES)))
    found: dict[str, Any] = {}
    for name in dict.fromkeys(table.column_names):
        column = table.column(name)
        kind = str(column.type)
        if kind.startswith(("list", "fixed_size_list", "large_list")):
            rows = column.to_pylist()
            width = len(rows[0]) if rows and rows[0] is not None else 0
            if 0 < width <= MOST_COLUMNS and all(row is not None and len(row) == width for row in rows):
                found[name] = np.array(rows)
        elif kind.startswith(("int", "uint", "float", "double", "half", "bool", "string")):
            found[name] = column.to_numpy()
    return found


READERS: Final[Mapping[str, Callable[[Path], dict[str, Any]]]] = {
    ".npz": read_arrays, ".h5": _read_hdf5, ".hdf5": _read_hdf5, ".mat": _read_matlab, ".parquet": _read_parquet,
}  # fmt: skip
