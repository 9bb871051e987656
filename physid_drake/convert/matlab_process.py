"""Reads a MATLAB file (up to version 7) from its standard input, and writes its arrays as npz: run as a program.

The first array holds the names of the others, and of what holds no numbers with the reason, as JSON.

SciPy reads these files by compiled code that trusts what a file says of itself: a damaged one can end the program.
Nothing of this package is imported here, so that it starts as fast as SciPy does.
"""

import io
import json
import sys
from typing import Any

import numpy as np
import scipy.io

MOST_ARRAYS = 50_000
"""Of hundreds of pushes with dozens of arrays each."""
MOST_STRUCTURES = 1000
DEEPEST = 8
TOO_DEEP = 3
"""The exit status of what nests deeper, or holds more arrays, than a log does."""


def main() -> None:
    """Variables by name, and fields of structures by ``name/field``, in the order of the file."""
    content: Any = io.BytesIO(sys.stdin.buffer.read())  # streams are read, too; SciPy's stubs know of paths alone
    found: dict[str, np.ndarray] = {}
    unread: dict[str, str] = {}
    for name, value in scipy.io.loadmat(content, squeeze_me=True, struct_as_record=True).items():
        if not name.startswith("__"):
            _collect(name, value, found, unread, depth=0)
    written = io.BytesIO()
    # By number: a name may be anything.
    np.savez(written, np.array(json.dumps([list(found), unread])), *found.values())
    sys.stdout.buffer.write(written.getvalue())


def _collect(name: str, value: object, found: dict[str, np.ndarray], unread: dict[str, str], depth: int) -> None:
    if depth > DEEPEST or len(found) > MOST_ARRAYS:
        sys.exit(TOO_DEEP)
    if not isinstance(value, np.ndarray):
        return
    if value.dtype.names is None:
        if value.ndim >= 1:
            if value.dtype.kind in "biufU":
                found[name] = value
            else:
                unread[name] = "it holds cells or objects, which are no numbers"
        return
    # One structure, or an array of them: one for each push.
    for k, one in enumerate(np.atleast_1d(value)[:MOST_STRUCTURES]):
        for field in value.dtype.names:
            prefix = name if value.ndim == 0 else f"{name}[{k}]"
            _collect(f"{prefix}/{field}", one[field], found, unread, depth + 1)


if __name__ == "__main__":
    main()
