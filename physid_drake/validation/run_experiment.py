"""The ``experiment`` command: the paper's experiments, with table, figure and command in a folder."""

from __future__ import annotations

import argparse
import io
import shlex
from pathlib import Path

from rich.console import Console

from physid_drake.errors import ConfigError
from physid_drake.report.progress import progress_bar
from physid_drake.report.svg import drawn
from physid_drake.report.terminal import terminal
from physid_drake.run_folder import RunFolder
from physid_drake.validation.experiments.catalogue import Wish, experiment_named
from physid_drake.validation.experiments.repetitions import claim, run_all
from physid_drake.validation.experiments.values import Result
from physid_drake.validation.report.experiment import (
    result_figure,
    result_json,
    result_markdown,
    rich_table,
    table_csv,
)
from physid_drake.validation.run_prove import ended_softly
from physid_drake.versions import versions


def run(arguments: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        PhysidError: one line that says what is wrong.
        KeyboardInterrupt: when interrupted; the repetitions that are done are kept.
    """
    for name, value, least in (("seed", arguments.seed, 0), ("jobs", arguments.jobs, 1)):
        if value < least:
            raise ConfigError(f"--{name} must be at least {least}, but is {value}.")
    experiment = experiment_named(
        arguments.name, Wish(seed=arguments.seed, quick=arguments.quick, pushes=arguments.data)
    )
    out: Path = arguments.out or Path("experiments") / (arguments.name + ("_quick" if arguments.quick else ""))
    console = terminal()
    with claim(arguments.name, experiment, out) as folder:
        with ended_softly(), progress_bar(console) as progress:
            records = run_all(experiment, folder, jobs=arguments.jobs, progress=progress)
        result = experiment.result(records)
        write(folder, result, arguments.name, command_of(arguments))
    _show(console, result, out)
    return 0


def command_of(arguments: argparse.Namespace) -> str:
    """The command that makes the same numbers again; a folder of pushes by its name alone."""
    words = ["physid_drake", "experiment", arguments.name]
    words += ["--quick"] if arguments.quick else []
    words += ["--seed", str(arguments.seed)]
    words += ["--data", arguments.data.name or "FOLDER"] if arguments.data is not None else []
    return shlex.join(words)


def write(folder: RunFolder, result: Result, name: str, command: str) -> None:
    """Write ``command.txt``, ``result.md``, ``result.json``, one CSV for each table, and ``figure.svg``.

    Raises:
        OutputError: if one cannot be written.
    """
    folder.write("command.txt", command + "\n")
    folder.write("result.md", result_markdown(result, name, command))
    folder.write("result.json", result_json(result, name, command, versions()))
    for table in result.tables:
        folder.write(f"{table.name}.csv", table_csv(table))
    with drawn():
        file = io.BytesIO()
        result_figure(result).savefig(file, format="svg", metadata={"Date": None})
    folder.write_bytes("figure.svg", file.getvalue())


def _show(console: Console, result: Result, out: Path) -> None:
    console.print(result.setting, highlight=False)
    for table in result.tables:
        console.print(rich_table(table))
    for reason in result.skipped:
        console.print(f"skipped: {reason}", markup=False)
    names = [f"{table.name}.csv" for table in result.tables]
    console.print(
        f"written: {', '.join(['result.md', 'result.json', *names, 'figure.svg'])} in {out}", soft_wrap=True
    )
