"""What a proof's worlds are drawn from, and what their names are made of: sealed until they are opened.

A world is a function of seed and index. Its name is one of index and a salt that is drawn once, so that the name does
not tell which world it is, even to who guesses the seed.
"""

from __future__ import annotations

import dataclasses as dc
import hashlib
import json
import secrets
from pathlib import Path
from typing import Any, Final

from physid_drake.errors import ConfigError, OutputError, ProofError
from physid_drake.validation.sealing.seal import LINES, SEALED, shut_error
from physid_drake.validation.sealing.written import broken, read_object
from physid_drake.whole_files import write_whole
from physid_drake.wording import cause_of

SECRET: Final = "secret.json"
_BITS: Final = 64  # of a seed that is drawn
_LOST: Final = "put it back, or choose another --out"


@dc.dataclass(frozen=True, kw_only=True)
class Secret:
    """What a proof keeps to itself until it is opened.

    Attributes:
        salt: of the worlds' names; None: names are by seed, as those of opened worlds once were.
        seed: of all worlds.
        kind: of all worlds; None for the mix.
        effect: of all worlds; None: in turn.
    """

    salt: str | None
    seed: int
    kind: str | None = None
    effect: str | None = None

    def name_of(self, index: int) -> str:
        """Eight hex digits that tell nothing of a world, unless it is named by its seed."""
        return name_by_seed(index, self.seed) if self.salt is None else _digits(f"{self.salt} {index}")

    def names(self, worlds: int) -> list[str]:
        """Of the first so many worlds."""
        return [self.name_of(index) for index in range(worlds)]


def name_by_seed(index: int, seed: int) -> str:
    """The name that a world of a seed had before names were salted: such are in ``docs/archive/answers``."""
    return _digits(f"world {seed} {index}")


def read_secret(out: Path) -> Secret | None:
    """What a proof is made of; None where it has not begun.

    Args:
        out: folder that holds ``sealed``.

    Raises:
        ProofError: if it cannot be read, or is missing although worlds were sealed.
    """
    file = out / SEALED / SECRET
    try:
        there = file.exists()
    except PermissionError as error:
        raise shut_error(file) from error
    if not there:
        if (out / LINES).exists() or any((out / SEALED).glob("*.json")):
            raise broken(file, "there is no such file, but worlds are sealed beside it", _LOST)
        return None
    content = read_object(file, _LOST)
    if not _is_secret(content):
        raise broken(file, "it must have a salt, a seed and a kind", _LOST)
    return Secret(**{field.name: content[field.name] for field in dc.fields(Secret)})


def keep_secret(
    out: Path, seed: int | None, kind: str | None = None, effect: str | None = None, *, by_seed: bool = False
) -> Secret:
    """What a proof is made of: as it was kept, or drawn and kept now.

    Args:
        out: folder of the proof.
        seed: of the worlds; None: the one that was kept, or any.
        kind: of the worlds; None for the mix.
        effect: of the worlds; None: in turn.
        by_seed: whether they are named by their seed.

    Raises:
        ConfigError: if the folder holds worlds of another seed, kind or effect.
        ProofError: if what was kept cannot be read.
        OutputError: if it cannot be written.
    """
    kept = read_secret(out)
    if kept is None:
        salt = None if by_seed else secrets.token_hex(32)
        drawn = secrets.randbits(_BITS) if seed is None else seed
        kept = Secret(salt=salt, seed=drawn, kind=kind, effect=effect)
        try:
            (out / SEALED).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"'{out / SEALED}': cannot be written: {cause_of(error)}.") from error
        write_whole(out / SEALED / SECRET, (json.dumps(dc.asdict(kept), indent=2) + "\n").encode("utf-8"))
    if (kind, effect) != (kept.kind, kept.effect) or seed not in (None, kept.seed) or (by_seed and kept.salt):
        raise _other(out)
    return kept


def settled_secret(out: Path, seed: int | None, kind: str | None) -> Secret:
    """What a proof that has worlds is made of.

    Args:
        out: folder of the proof.
        seed: that it shall have; None: any.
        kind: that it shall have; None: any.

    Raises:
        ConfigError: if the folder holds worlds of another seed or kind.
        ProofError: if it cannot be read, or there is none.
    """
    kept = read_secret(out)
    if kept is None:
        raise ProofError(f"'{out}' holds no sealed worlds: run the command without --open first.")
    if seed not in (None, kept.seed) or kind not in (None, kept.kind):
        raise _other(out)
    return kept


def _other(out: Path) -> ConfigError:
    return ConfigError(
        f"'{out}' holds another proof, of another seed or kind, which are sealed; choose another --out, or the same"
        " settings."
    )


def _is_secret(content: dict[str, Any]) -> bool:
    seed = content.get("seed")
    words = [content.get(name, 0) for name in ("salt", "kind", "effect")]
    whole = isinstance(seed, int) and not isinstance(seed, bool) and seed >= 0
    return whole and all(word is None or isinstance(word, str) for word in words)


def _digits(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:8]
