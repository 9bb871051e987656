"""The ``model export`` command: a model in, files for Drake's parser and for MuJoCo out."""

from __future__ import annotations

import argparse
from pathlib import Path

from physid_drake.export import exported
from physid_drake.model_reading import load_model
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import SETTINGS, RunFolder, named_after_model, settings_text

COMMAND = "model export"


def run_export(arguments: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        PhysidError: one line that says what is wrong.
    """
    model = load_model(arguments.model)
    out = arguments.out or Path("exports") / named_after_model(arguments.model)
    inputs = [arguments.model if arguments.model.is_dir() else arguments.model.parent]
    RunFolder.check(out, COMMAND, inputs=inputs)
    files = exported(model)
    with RunFolder.open(
        out, COMMAND, settings_text(COMMAND, {"model": str(arguments.model)}), name=SETTINGS
    ) as folder:
        for name, text in files.items():
            folder.write(name, text)
    console = terminal()
    console.print(files["README.txt"].strip().rpartition("\n\n")[2], markup=False)  # what is not in the files
    console.print(f"written: {', '.join(name for name in files if not name.endswith('.obj'))} and meshes in {out}")
    return 0
