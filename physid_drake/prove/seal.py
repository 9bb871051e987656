"""The seal on the truth: hashes that are written down before a diagnosis begins, and a folder that stays shut.

``seal.txt`` is what ``sha256sum -c`` reads, one line for each sealed file; ``seal.sha256`` is one hash over all. Each
sealed file has the hash of its recording, so that the seal is over the recordings, too.
"""

from __future__ import annotations

import hashlib
import json
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from physid_drake.errors import ProofError

SEALED: Final = "sealed"
LINES: Final = "seal.txt"
TOTAL: Final = "seal.sha256"
RECORDING: Final = "recording_sha256"
"""Key, in the truth, of `files_digest` of the recording."""


def files_digest(folder: Path) -> str:
    """SHA-256 over names and contents of all files of a folder, sorted by name."""
    total = hashlib.sha256()
    for file in sorted(path for path in folder.rglob("*") if path.is_file()):
        total.update(
            f"{file.relative_to(folder).as_posix()} {hashlib.sha256(file.read_bytes()).hexdigest()}\n".encode()
        )
    return total.hexdigest()


def seal_of(folder: Path, identities: Sequence[str]) -> str:
    """SHA-256 over names and contents of the sealed files, sorted by name.

    Args:
        folder: that holds ``<identity>.json``.
        identities: of the worlds.

    Raises:
        ProofError: if one is missing.
    """
    total = hashlib.sha256()
    for identity, digest in sorted(_digests(folder, identities).items()):
        total.update(f"{identity} {digest}\n".encode())
    return total.hexdigest()


def write_seal(out: Path, identities: Sequence[str]) -> str:
    """Write down the hashes of sealed files, and return the one over all, those of an earlier seal included.

    Files of an earlier seal must be as they were then.

    Args:
        out: folder that holds ``sealed``.
        identities: of the worlds.

    Raises:
        ProofError: if a file is missing, or is not as it was when it was sealed.
    """
    digests = _digests(out / SEALED, identities)
    earlier = _read_lines(out / LINES)
    changed = sorted(name for name, digest in digests.items() if earlier.get(name, digest) != digest)
    if changed:
        raise ProofError(
            f"'{out / SEALED / changed[0]}.json' has changed since it was sealed in '{out / LINES}';"
            " choose another --out."
        )
    lines = [f"{digest}  {SEALED}/{name}.json\n" for name, digest in sorted({**earlier, **digests}.items())]
    (out / LINES).write_text("".join(lines), encoding="utf-8")
    total = seal_of(out / SEALED, sealed_names(out))
    (out / TOTAL).write_text(f"{total}\n", encoding="utf-8")
    return total


def read_seal(out: Path) -> str:
    """The hash over all that was written down.

    Raises:
        ProofError: if nothing was sealed here.
    """
    try:
        return (out / TOTAL).read_text(encoding="utf-8").strip()
    except OSError as error:
        raise ProofError(f"'{out}' holds no sealed worlds: run the command without --open first.") from error


def sealed_names(out: Path) -> list[str]:
    """The worlds whose hashes were written down, sorted; none where there is no seal."""
    return sorted(_read_lines(out / LINES))


def check_seal(out: Path, written: str) -> None:
    """Refuse a truth, or a recording, that is not the one that was sealed.

    Args:
        out: folder that holds ``sealed`` and ``recordings``.
        written: the hash that was written down before.

    Raises:
        ProofError: if a hash is another now.
    """
    identities = sealed_names(out)
    now = seal_of(out / SEALED, identities)
    if now != written:
        raise ProofError(
            f"the seal is broken: sha256 of '{out / SEALED}' is {now}, but {written} was written down before the"
            " diagnosis; nothing is scored."
        )
    for identity in identities:
        sealed = json.loads((out / SEALED / f"{identity}.json").read_text(encoding="utf-8")).get(RECORDING)
        if sealed is not None and files_digest(out / "recordings" / identity) != sealed:
            raise ProofError(
                f"the seal is broken: '{out / 'recordings' / identity}' is not the recording that was sealed; nothing"
                " is scored."
            )


@contextmanager
def shut(folder: Path) -> Iterator[None]:
    """Take all permissions off a folder while the block runs, and give them back whatever ends it.

    It stops any user but root; against root there is the blindfold (`physid_drake.prove.blindfold`).
    """
    unlock(folder)
    before = stat.S_IMODE(folder.stat().st_mode)
    folder.chmod(0o000)
    try:
        yield
    finally:
        folder.chmod(before)


def unlock(folder: Path) -> None:
    """Give a folder back its permissions where a run that was killed could not."""
    if folder.is_dir() and stat.S_IMODE(folder.stat().st_mode) == 0:
        folder.chmod(0o755)


def _digests(folder: Path, identities: Sequence[str]) -> dict[str, str]:
    digests = {}
    for identity in identities:
        file = folder / f"{identity}.json"
        try:
            digests[identity] = hashlib.sha256(file.read_bytes()).hexdigest()
        except PermissionError as error:
            raise ProofError(
                f"sealed truth '{file}': is shut, as while worlds are diagnosed; where nothing runs any more, the"
                " command without --open gives it back."
            ) from error
        except OSError as error:
            raise ProofError(f"sealed truth '{file}': cannot be read: {error.strerror or error}.") from error
    return digests


def _read_lines(file: Path) -> dict[str, str]:
    if not file.is_file():
        return {}
    rows = [line.split(maxsplit=1) for line in file.read_text(encoding="utf-8").splitlines() if line.strip()]
    return {Path(name).stem: digest for digest, name in rows}
