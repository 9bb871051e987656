"""Reads files of plain arrays with a header of JSON text, no pickles."""

import json
import zlib
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from physid_drake.errors import ParameterError
from physid_drake.space import Array


def read_npz(path: str | Path, form: str) -> tuple[dict[str, Array], dict[str, Any]]:
    """All arrays of a file, and its header: one that is damaged may open, and fail where it is read.

    Args:
        path: Of the file.
        form: The format that the header must state.

    Raises:
        ParameterError: When the file is damaged, or of another format.
        FileNotFoundError: When there is no file.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(str(arrays["header"])) if "header" in arrays else {}
    except FileNotFoundError:
        raise
    except (OSError, ValueError, TypeError, AttributeError, EOFError, BadZipFile, zlib.error) as error:
        raise ParameterError(f"belief '{path}': cannot be read ({error}); delete it to begin anew.") from error
    if header.get("format") != form:
        raise ParameterError(
            f"belief '{path}': the file must say format '{form}', but says '{header.get('format')}';"
            " was it written by Belief.to_npz of this version?"
        )
    return arrays, dict(header)
