"""Reads JSON objects that a proof wrote, and that somebody may have changed since then."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

from physid_drake.errors import ProofError
from physid_drake.files import FileError, MissingFileError, read_text
from physid_drake.wording import one_line, shown

AGAIN: Final = "delete it to diagnose this world again"
"""What to do about what a diagnosis wrote."""


def read_object(file: Path, remedy: str) -> dict[str, Any]:
    """The object in a JSON file.

    Args:
        file: to read.
        remedy: what to do where it cannot be read.

    Raises:
        ProofError: if it is not there, or is no JSON object.
    """
    try:
        content = json.loads(read_text(file))
    except MissingFileError as error:
        raise broken(file, "there is no such file", remedy) from error
    except FileError as error:
        raise broken(file, str(error).removeprefix("cannot be read: "), remedy) from error
    except (ValueError, RecursionError) as error:
        raise broken(file, f"it is no JSON ({one_line(error)})", remedy) from error
    if not isinstance(content, dict):
        raise broken(file, f"it must be a JSON object, but is {shown(content)}", remedy)
    return content


def broken(file: Path, why: str, remedy: str) -> ProofError:
    """What to raise of a file that is not as it was written."""
    return ProofError(f"'{file}' cannot be read: {why}; {remedy}.")


def is_number(value: object) -> bool:
    """Whether a value of a JSON file is a number; it may be no finite one, but no whole one beyond all floats."""
    whole = isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**1023
    return whole or isinstance(value, float)
