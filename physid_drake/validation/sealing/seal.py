"""The seal on the truth: hashes that are written down before a diagnosis begins, and a folder that stays shut.

``seal.txt`` is what ``sha256sum -c`` reads, one line for each sealed file; ``seal.sha256`` is one hash over all. Each
sealed file has the hash of its recording, so that the seal is over the recordings, too.
"""

from __future__ import annotations

import hashlib
import re
import stat
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from physid_drake.errors import ProofError
from physid_drake.files import FileError, MissingFileError, read_bytes, read_text
from physid_drake.validation.sealing.written import broken, read_object
from physid_drake.whole_files import write_whole
from physid_drake.wording import shown

SEALED: Final = "sealed"
LINES: Final = "seal.txt"
TOTAL: Final = "seal.sha256"
RECORDING: Final = "recording_sha256"
"""Key, in the truth, of `files_digest` of the recording."""
REMEDY: Final = "put it back as it was, or choose another --out"
"""What to do about a file that was sealed."""
_LINE: Final = re.compile(rf"([0-9a-f]{{64}})  {SEALED}/([\w-]+)\.json")


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
    return _total(_digests(folder, identities))


def write_seal(out: Path, identities: Sequence[str]) -> str:
    """Write down the hashes of sealed files, and return the one over all, those of an earlier seal included.

    Files of an earlier seal must be as they were then.

    Args:
        out: folder that holds ``sealed``.
        identities: of the worlds.

    Raises:
        ProofError: if a file is missing, or is not as it was when it was sealed.
        OutputError: if the seal cannot be written.
    """
    digests = _digests(out / SEALED, identities)
    earlier = _read_lines(out / LINES)
    changed = sorted(name for name, digest in digests.items() if earlier.get(name, digest) != digest)
    if changed:
        raise ProofError(
            f"'{out / SEALED / changed[0]}.json' has changed since it was sealed in '{out / LINES}';"
            " choose another --out."
        )
    everything = {**earlier, **digests}
    lines = [f"{digest}  {SEALED}/{name}.json\n" for name, digest in sorted(everything.items())]
    total = seal_of(out / SEALED, list(everything))
    # Whoever is killed between the two begins again from the first, which says all that the second does.
    write_whole(out / LINES, "".join(lines).encode("utf-8"))
    write_whole(out / TOTAL, f"{total}\n".encode())
    return total


def read_seal(out: Path) -> str:
    """The hash over all that was written down.

    Raises:
        ProofError: if nothing was sealed here, or what was written down is no such hash.
    """
    try:
        written = read_text(out / TOTAL).strip()
    except MissingFileError as error:
        raise ProofError(f"'{out}' holds no sealed worlds: run the command without --open first.") from error
    except FileError as error:
        raise ProofError(f"'{out / TOTAL}' {error}; {REMEDY}.") from error
    if re.fullmatch(r"[0-9a-f]{64}", written) is None:
        raise broken(out / TOTAL, f"it must be 64 hex digits, but is {shown(written)}", REMEDY)
    return written


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
    lines = _read_lines(out / LINES)
    if _total(lines) != written:
        raise ProofError(
            f"the seal is broken: '{out / LINES}' has other hashes than {written}, which was written down over them;"
            " nothing is scored. If sealing was interrupted, the command without --open ends it."
        )
    identities = sorted(lines)
    now = seal_of(out / SEALED, identities)
    if now != written:
        raise ProofError(
            f"the seal is broken: sha256 of '{out / SEALED}' is {now}, but {written} was written down before the"
            " diagnosis; nothing is scored."
        )
    for identity in identities:
        sealed = read_object(out / SEALED / f"{identity}.json", REMEDY).get(RECORDING)
        if sealed is not None and files_digest(out / "recordings" / identity) != sealed:
            raise ProofError(
                f"the seal is broken: '{out / 'recordings' / identity}' is not the recording that was sealed; nothing"
                " is scored."
            )


@contextmanager
def shut(folder: Path) -> Iterator[None]:
    """Take all permissions off a folder while the block runs, and give them back whatever ends it.

    It stops any user but root. Where the system allows it, the folder is hidden from a diagnosis altogether
    (`hiding`); where not, there is the `blindfold` against root.
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


def shut_error(file: Path) -> ProofError:
    """What to raise where a sealed file may not be read."""
    return ProofError(
        f"sealed truth '{file}': is shut, as while worlds are diagnosed; where nothing runs any more, the command"
        " without --open gives it back."
    )


def _digests(folder: Path, identities: Sequence[str]) -> dict[str, str]:
    digests = {}
    for identity in identities:
        file = folder / f"{identity}.json"
        try:
            digests[identity] = hashlib.sha256(read_bytes(file)).hexdigest()
        except FileError as error:
            if isinstance(error.__cause__, PermissionError):
                raise shut_error(file) from error
            raise ProofError(f"sealed truth '{file}': cannot be read: {error}; {REMEDY}.") from error
    return digests


def _total(digests: Mapping[str, str]) -> str:
    total = hashlib.sha256()
    for identity, digest in sorted(digests.items()):
        total.update(f"{identity} {digest}\n".encode())
    return total.hexdigest()


def _read_lines(file: Path) -> dict[str, str]:
    """Hashes that were written down, by the world's name; none where there is no such file."""
    try:
        text = read_text(file)
    except MissingFileError:
        return {}
    except FileError as error:
        raise ProofError(f"'{file}' {error}; {REMEDY}.") from error
    digests = {}
    for number, line in enumerate(text.splitlines(), start=1):
        found = _LINE.fullmatch(line)
        if found is None:
            rule = f"line {number} must be '<sha256>  {SEALED}/<world>.json', but is {shown(line)}"
            raise broken(file, rule, REMEDY)
        digests[found[2]] = found[1]
    return digests
