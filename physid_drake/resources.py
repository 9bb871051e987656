"""Where the models, configurations and recordings that ship with the project lie, installed or not."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def shipped(folder: str) -> Path:
    """A folder that ships with the project: ``models``, ``configs`` or ``recordings``.

    In a wheel they lie inside the package, in a checkout beside it.

    Raises:
        FileNotFoundError: if the installation lacks it.
    """
    for root in (_PACKAGE, _PACKAGE.parent):
        if (root / folder).is_dir():
            return root / folder
    raise FileNotFoundError(f"the installation lacks the folder '{folder}': install physid_drake again.")
