"""How a value that somebody else wrote is put into a message of one line."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

MOST = 60  # characters of a value
MOST_LINE = 1500  # characters of a message
MOST_CAUSE = 200  # characters of another library's words


def shown(value: object) -> str:
    """A value as Python writes it: at most 60 characters, none of which can move a terminal's cursor."""
    try:
        text = repr(value[: MOST + 1] if isinstance(value, str | bytes) else value)
    except (ValueError, RecursionError):  # a whole number of thousands of digits; lists in lists in lists
        text = f"a {type(value).__name__} too large to show"
    return _cut(_printable(text), MOST)


def named(name: object) -> str:
    """A path or a word, to stand in a message's own quotes: whole, unless it is longer than any that people give."""
    return _cut(_printable(str(name)), MOST_CAUSE)


def one_line(error: BaseException) -> str:
    """What another library says of an error, in one line without its full stop; its kind if that is nothing."""
    text = " ".join(str(error)[: 20 * MOST_CAUSE].split()).rstrip(".")
    return _cut(_printable(text), MOST_CAUSE) or type(error).__name__


def cause_of(error: BaseException) -> str:
    """Why something failed, in the system's words, without the file's name, which the message has already."""
    return str(getattr(error, "strerror", None) or error)


def in_one_line(message: str) -> str:
    """A whole message for a terminal: one line, not longer than can be read, without control characters."""
    if len(message) > 20 * MOST_LINE:
        message = f"{message[: 10 * MOST_LINE]} {message[-10 * MOST_LINE :]}"
    text = _printable(" ".join(message.split()))
    return text if len(text) <= MOST_LINE else f"{text[: MOST_LINE - 203]}...{text[-200:]}"


def alike(lines: Iterable[str], but_for: Sequence[str] = ()) -> list[list[str]]:
    """Lines that differ by numbers only, together, in the order of the first of each kind.

    Args:
        lines: of messages.
        but_for: words by which they may differ, too.
    """
    kinds: dict[str, list[str]] = {}
    for line in lines:
        general = line
        for word in but_for:
            general = general.replace(word, "")
        kinds.setdefault(re.sub(r"[-+.\d]+(e[-+]\d+)?", "", general), []).append(line)
    return list(kinds.values())


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def _cut(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 3] + "..."
