"""What a diagnosis has found so far, kept in a file, so that an interrupted one goes on from there."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import OutputError

Array = NDArray[np.float64]


class Memory:
    """Named lists of arrays; in a file where one is given. No pickles."""

    def __init__(self, path: Path | None = None) -> None:
        self._path = path
        self._kept: dict[str, Array] = {}
        if path is not None and path.exists():
            try:
                with np.load(path, allow_pickle=False) as stored:
                    self._kept = {name: stored[name] for name in stored.files}
            except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile):
                self._kept = {}  # cut off while it was written: begin again

    @property
    def stages(self) -> list[str]:
        """Names under which something is kept."""
        return [name.removesuffix("/count") for name in self._kept if name.endswith("/count")]

    def recall(self, name: str) -> list[Array] | None:
        """The arrays of a name, or None."""
        count = self._kept.get(f"{name}/count")
        return None if count is None else [self._kept[f"{name}/{k}"] for k in range(int(count))]

    def keep(self, name: str, arrays: list[Array]) -> None:
        """Keep arrays under a name.

        Raises:
            OutputError: if the file cannot be written.
        """
        self._kept[f"{name}/count"] = np.array(float(len(arrays)))
        self._kept.update({f"{name}/{k}": np.asarray(a) for k, a in enumerate(arrays)})
        if self._path is None:
            return
        part = self._path.with_suffix(".part.npz")
        try:
            np.savez(part, allow_pickle=False, **self._kept)
            part.replace(self._path)
        except OSError as error:
            raise OutputError(f"'{self._path}': cannot be written: {error}.") from error
