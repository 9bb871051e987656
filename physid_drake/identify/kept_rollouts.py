"""What rollouts said, by what they were made of: none is made twice, and what was interrupted repeats only sums."""

from __future__ import annotations

import hashlib
import pickle
import struct
from pathlib import Path

import numpy as np

from physid_drake.errors import OutputError
from physid_drake.identify.prediction import Prediction

MAGIC = b"physid-rollouts/1\n"
KEY = 16  # bytes
_HEAD = struct.Struct(f"<{KEY}s??2I")  # key, whether it ended well, whether it fell, numbers of poses and of forces


def key_of(made_of: object) -> bytes:
    """A key of 16 bytes. Equal things that were built in other ways may differ in it, different ones do not agree."""
    return hashlib.blake2b(pickle.dumps(made_of, protocol=5), digest_size=KEY).digest()


class KeptRollouts:
    """Predictions by key; in a file, too, where one is given."""

    def __init__(self, path: Path | None = None) -> None:
        """Read what the file holds; of one that was cut off, what is whole."""
        self._path = path
        self._kept: dict[bytes, Prediction | None] = {}
        content = path.read_bytes() if path is not None and path.is_file() else b""
        whole = self._read(content) if content.startswith(MAGIC) else 0
        if path is not None and content:
            self._write(content[:whole], "wb")

    def __len__(self) -> int:
        return len(self._kept)

    def __contains__(self, key: bytes) -> bool:
        return key in self._kept

    def __getitem__(self, key: bytes) -> Prediction | None:
        """What the rollout said; None if it diverged."""
        return self._kept[key]

    def keep(self, predictions: dict[bytes, Prediction | None]) -> None:
        """Keep what rollouts said.

        Raises:
            OutputError: if the file cannot be written.
        """
        start = b"" if self._kept or self._path is None else MAGIC
        self._kept |= predictions
        self._write(start + b"".join(_record(k, p) for k, p in predictions.items()), "ab")

    def _write(self, content: bytes, mode: str) -> None:
        if self._path is None:
            return
        try:
            with self._path.open(mode) as file:
                file.write(content)
        except OSError as error:
            raise OutputError(f"'{self._path}': cannot be written: {error}.") from error

    def _read(self, content: bytes) -> int:
        """Take up all whole records; where they end, 0 without any."""
        at = len(MAGIC)
        while len(content) >= at + _HEAD.size:
            key, well, fell, poses, forces = _HEAD.unpack_from(content, at)
            end = at + _HEAD.size + 8 * (3 * poses + 2 * forces)
            if len(content) < end:
                break
            numbers = np.frombuffer(content[at + _HEAD.size : end]).copy()
            said = Prediction(
                poses=numbers[: 3 * poses].reshape(-1, 3), forces=numbers[3 * poses :].reshape(-1, 2), fell=fell
            )
            self._kept[key] = said if well else None
            at = end
        return at if self._kept else 0


def _record(key: bytes, said: Prediction | None) -> bytes:
    if said is None:
        return _HEAD.pack(key, False, False, 0, 0)
    numbers = np.concatenate([said.poses.ravel(), said.forces.ravel()]).astype("<f8")
    return _HEAD.pack(key, True, said.fell, len(said.poses), len(said.forces)) + numbers.tobytes()
