"""What came of an input: read, refused in words that a person can use, or a fault."""

from __future__ import annotations

import re
import traceback
import warnings
from dataclasses import dataclass
from types import TracebackType
from typing import Final

from fuzz.case import Case, RefusedError
from physid_drake.errors import PhysidError
from physid_drake.wording import in_one_line

LONGEST: Final = 1600
FOREIGN: Final = re.compile(
    r"drake::|std::|\.cc:\d|\.cc\b|Failure at |condition '.*' failed|incompatible (function|constructor) arguments"
    r"|object at 0x|pybind11|pydrake\.|Traceback|<unicode string>|in \"<|MemoryError|not enough memory"
)
"""Words of Drake, of the YAML library or of the system that tell a user nothing."""


@dataclass(frozen=True)
class Verdict:
    """How it ended.

    Attributes:
        outcome: ``read``, ``refused``, ``fault`` or ``warning`` (Python's own, beside whatever else).
        group: faults of the same kind have the same.
        text: one line.
        traceback: of a fault, for those who repeat it.
    """

    outcome: str
    group: str = ""
    text: str = ""
    traceback: str = ""


def judged(case: Case) -> Verdict:
    """Run a case and say how it ended."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        verdict = _ran(case)
    if verdict.outcome == "fault":
        return verdict
    for one in said:
        if issubclass(one.category, UserWarning):
            problem = _problem(str(one.message))
            if problem:
                return Verdict("fault", f"a warning {problem}", str(one.message)[:300])
        else:
            where = "/".join(one.filename.split("/")[-3:])
            return Verdict("warning", f"{one.category.__name__} {where}:{one.lineno}", str(one.message)[:300])
    return verdict


def _ran(case: Case) -> Verdict:
    try:
        case.run()
    except (PhysidError, RefusedError) as error:
        text = str(error)
        problem = _problem(text)
        if problem:
            return Verdict("fault", f"a refusal {problem}", text[:2000], _trace(error))
        return Verdict("refused", text=in_one_line(text))
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        group = f"{type(error).__name__} {_innermost(error.__traceback__)}"
        return Verdict("fault", group, f"{type(error).__name__}: {error!s:.300}", _trace(error))
    return Verdict("read")


def _problem(text: str) -> str:
    """What is wrong with the words of a refusal; empty if nothing."""
    line = in_one_line(text)
    if not line.strip():
        return "says nothing"
    if len(line) >= LONGEST or not line.isprintable():
        return "is no printable line"
    found = FOREIGN.search(text)
    return f"has foreign words: {found[0]}" if found else ""


def _innermost(traced: TracebackType | None) -> str:
    """File, line and function of the last frame that is this package's; else of the very last."""
    frames = traceback.extract_tb(traced)
    ours = [frame for frame in frames if "/physid_drake/" in frame.filename] or frames
    if not ours:
        return ""
    last = ours[-1]
    return f"{last.filename.rpartition('/physid_drake/')[2]}:{last.lineno} {last.name}"


def _trace(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))[-6000:]
