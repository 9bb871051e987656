"""What rollouts said, by what they were made of: what is kept is not made again.

A diagnosis that was interrupted repeats only the sums, since it draws from one seed.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import struct
import warnings
import zlib
from functools import cache
from pathlib import Path

import numpy as np

from physid_drake.effects.catalogue import sources_of_effects
from physid_drake.files import MissingFileError, read_bytes
from physid_drake.pushes.prediction import Prediction
from physid_drake.wording import cause_of

KEY = 16  # bytes
MOST_BYTES = 400_000_000  # in memory and in the file; what is beyond is made again
# Key, whether it ended well, whether it fell, numbers of poses and of forces, checksum of the numbers.
_HEAD = struct.Struct(f"<{KEY}s??3I")


def key_of(made_of: object, cell: str = "") -> bytes:
    """A key of 16 bytes; different things do not agree in it.

    Args:
        made_of: what the rollout is made of, pickled.
        cell: in which it was, in words.
    """
    content = cell.encode() + pickle.dumps(made_of, protocol=5)
    return hashlib.blake2b(content, digest_size=KEY).digest()


@cache
def magic() -> bytes:
    """How a file begins: rollouts of other sources, of this package or of installed effects, are others."""
    sources = sorted({*Path(__file__).resolve().parents[1].rglob("*.py"), *sources_of_effects()})
    digest = hashlib.blake2b(b"".join(file.read_bytes() for file in sources), digest_size=KEY)
    return b"physid-rollouts/1 " + digest.hexdigest().encode() + b"\n"


class KeptRollouts:
    """Predictions by key, as many as ``most`` bytes hold; in a file, too, where one is given."""

    def __init__(self, path: Path | None = None, *, most: int = MOST_BYTES) -> None:
        """Read what the file holds; of one that was cut off, what is whole; of one that cannot be read, nothing."""
        self._path, self._most, self._size = path, most, 0
        self._kept: dict[bytes, Prediction | None] = {}
        if path is None:
            return
        try:
            content = read_bytes(path, most=most + len(magic()))
            whole = self._read(content) if content.startswith(magic()) else 0
            if whole < len(content):
                os.truncate(path, whole)
        except MissingFileError:
            return
        except OSError as error:
            self._give_up(error)

    def __len__(self) -> int:
        return len(self._kept)

    def __contains__(self, key: bytes) -> bool:
        return key in self._kept

    def __getitem__(self, key: bytes) -> Prediction | None:
        """What the rollout said; None if it diverged."""
        return self._kept[key]

    def keep(self, predictions: dict[bytes, Prediction | None]) -> None:
        """Keep what rollouts said, as long as there is room; what a full disk does not take is kept in memory."""
        records = {key: _record(key, said) for key, said in predictions.items()}
        content = b"".join(records.values())
        if self._size + len(content) > self._most:
            return
        self._size += len(content)
        self._kept |= predictions
        if self._path is None:
            return
        try:
            with self._path.open("ab") as file:
                file.write(content if file.tell() else magic() + content)
        except OSError as error:
            self._give_up(error)

    def _give_up(self, error: OSError) -> None:
        """Without the file: it spares time where a run is interrupted, and no result depends on it."""
        warnings.warn(
            f"'{self._path}': rollouts are no longer kept, so that an interrupted run makes them again:"
            f" {cause_of(error)}",
            stacklevel=3,
        )
        self._path = None

    def _read(self, content: bytes) -> int:
        """Take up all records up to one that is not whole; where they end."""
        at = len(magic())
        while len(content) >= at + _HEAD.size:
            key, well, fell, poses, forces, check = _HEAD.unpack_from(content, at)
            end = at + _HEAD.size + 8 * (3 * poses + 2 * forces)
            body = content[at + _HEAD.size : end]
            if len(content) < end or zlib.crc32(body) != check:
                break
            numbers = np.frombuffer(body, dtype="<f8").copy()
            self._kept[key] = (
                Prediction(
                    poses=numbers[: 3 * poses].reshape(-1, 3),
                    forces=numbers[3 * poses :].reshape(-1, 2),
                    fell=fell,
                )
                if well
                else None
            )
            at = end
        self._size = at
        return at


def _record(key: bytes, said: Prediction | None) -> bytes:
    if said is None:
        return _HEAD.pack(key, False, False, 0, 0, zlib.crc32(b""))
    body = np.concatenate([said.poses.ravel(), said.forces.ravel()]).astype("<f8").tobytes()
    return _HEAD.pack(key, True, said.fell, len(said.poses), len(said.forces), zlib.crc32(body)) + body
