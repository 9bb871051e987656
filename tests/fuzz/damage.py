"""Damage to the bytes of a file, whatever is in it."""

from __future__ import annotations

import os
from pathlib import Path
from random import Random

ODD = (b"\0", b"\x80", b"\xff\xfe", b"\x1b[2J", b"\xe2\x80\xa8", b"\xed\xa0\x80", b"\xef\xbb\xbf", b"\r", b"\t",
       b"\v",
       b'"', b"'", b",", b"%", b"&", b"*", b"{", b"[", b"\\", b"9" * 400, b"\xc2\xa0", b"\xd9\xa1", b"nan",
       b"-")  # fmt: skip

LARGEST = 20_000_000  # bytes of a damaged file


def damaged(rng: Random, content: bytes) -> bytes:
    """The content with one to three kinds of damage."""
    for _ in range(rng.choice((1, 1, 2, 3))):
        content = rng.choice(DAMAGES)(rng, content)[:LARGEST]
    return content


def _place(rng: Random, content: bytes) -> int:
    return rng.randrange(len(content) + 1)


def truncated(rng: Random, content: bytes) -> bytes:
    return content[: _place(rng, content)]


def flipped(rng: Random, content: bytes) -> bytes:
    changed = bytearray(content)
    for _ in range(rng.choice((1, 1, 4, 32)) if content else 0):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def inserted(rng: Random, content: bytes) -> bytes:
    at = _place(rng, content)
    return content[:at] + rng.choice(ODD) * rng.choice((1, 1, 2, 30)) + content[at:]


def without_a_span(rng: Random, content: bytes) -> bytes:
    at = _place(rng, content)
    return content[:at] + content[at + rng.choice((1, 2, 10, 100, 1000)) :]


def with_a_copy(rng: Random, content: bytes) -> bytes:
    at, to = _place(rng, content), _place(rng, content)
    return content[:to] + content[at : at + rng.choice((1, 10, 100, 1000))] + content[to:]


def lines_mixed(rng: Random, content: bytes) -> bytes:
    lines = content.split(b"\n")
    for _ in range(rng.choice((1, 3))):
        a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
        lines[a], lines[b] = lines[b], lines[a]
    return b"\n".join(lines)


def line_repeated(rng: Random, content: bytes) -> bytes:
    lines = content.split(b"\n")
    at = rng.randrange(len(lines))
    times = min(rng.choice((2, 2, 50, 1000)), 1 + LARGEST // (1 + len(lines[at])))
    return b"\n".join(lines[:at] + lines[at : at + 1] * times + lines[at:])


def other_ends(rng: Random, content: bytes) -> bytes:
    return content.replace(b"\n", rng.choice((b"\r\n", b"\r", b"\n\n", b"\x0b", b"\x0c", b"\xc2\x85", b"")))


def other_code(rng: Random, content: bytes) -> bytes:
    text = content.decode("utf-8", "replace")
    return text.encode(rng.choice(("utf-16", "utf-16-le", "utf-32", "utf-8-sig", "utf-7", "cp037")), "replace")


def long_word(rng: Random, content: bytes) -> bytes:
    at = _place(rng, content)
    return content[:at] + rng.choice((b"1", b"x", b" ", b"[", b"-", b",", b"\n")) * 1_000_000 + content[at:]


def emptied(rng: Random, content: bytes) -> bytes:
    return rng.choice((b"", b"\n", b" ", b"\0", b"\xef\xbb\xbf", b"null", b"---\n---\n", b"{}", b"[]"))


DAMAGES = (truncated, flipped, flipped, inserted, inserted, inserted, without_a_span, with_a_copy, lines_mixed,
           line_repeated, other_ends, other_code, long_word, emptied)  # fmt: skip


def replaced(rng: Random, file: Path, *, secret: Path | None = None) -> None:
    """Put what is no plain file in a file's place; with ``secret``, also a link to that."""
    content = file.read_bytes() if file.is_file() else b""
    kinds = ["pipe", "folder", "loop", "zeros", "nothing", "moved", "unfilled", "missing"]
    kind = rng.choice(kinds if secret is None else [*kinds, "secret", "secret", "secret"])
    file.unlink(missing_ok=True)
    match kind:
        case "pipe":
            os.mkfifo(file)
        case "folder":
            file.mkdir()
        case "loop":
            file.symlink_to(file.name)
        case "zeros":
            file.symlink_to("/dev/zero")
        case "nothing":
            file.symlink_to("not there")
        case "moved":
            file.with_name("moved here").write_bytes(content)
            file.symlink_to("moved here")
        case "unfilled":  # a hole of 4 GB takes no space
            with file.open("wb") as stream:
                stream.truncate(2**32)
        case "secret" if secret is not None:
            file.symlink_to(secret)
        case _:
            pass
