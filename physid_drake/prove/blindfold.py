"""Runs the command line blind to some folders: ``python -m physid_drake.prove.blindfold FOLDERS WORDS``.

FOLDERS is a JSON list of paths.

Permissions do not stop root, so Python itself refuses: every opening or listing of what lies in the folders, in this
interpreter, raises an error that ends the command. Nothing is hidden from what runs outside of Python's own file
functions (Drake's C++, other programs).
"""

from __future__ import annotations

import errno
import json
import os
import runpy
import sys
from typing import Final

LOOKS: Final = frozenset({
    "open", "os.listdir", "os.scandir", "os.rename", "os.link", "os.symlink", "os.chdir", "os.chmod", "os.remove",
    "glob.glob", "pathlib.Path.glob", "shutil.copyfile", "shutil.copytree", "shutil.move", "shutil.rmtree",
})  # fmt: skip
"""Audit events whose first argument (or the first two) is a path that is looked at or moved."""
_TWO_PATHS: Final = 2


class SealedError(PermissionError):
    """Something that must not be seen was asked for."""


def blind_to(*folders: str) -> None:
    """From now on refuse every look into folders; it cannot be undone in this interpreter.

    Args:
        folders: their paths.
    """
    hidden = tuple(os.path.realpath(folder) for folder in folders)

    def refuse(event: str, arguments: tuple[object, ...]) -> None:
        if event not in LOOKS:
            return
        for path in arguments[:_TWO_PATHS]:
            if isinstance(path, str | bytes | os.PathLike) and _lies_in(os.fsdecode(path), hidden):
                raise SealedError(errno.EACCES, f"is sealed ({event})", os.fsdecode(path))

    sys.addaudithook(refuse)


def _lies_in(path: str, folders: tuple[str, ...]) -> bool:
    real = os.path.realpath(path)
    return any(real == folder or real.startswith(folder + os.sep) for folder in folders)


def main() -> None:
    """Run ``physid_drake`` with the words after the first, blind to the folders that the first names."""
    folders, *words = sys.argv[1:]
    blind_to(*json.loads(folders))
    sys.argv = ["physid_drake", *words]
    runpy.run_module("physid_drake", run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
