"""The ``inspect`` command: what is in a recording, what is odd about it, whether its conventions are as it says."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

from physid_drake.command import say_error
from physid_drake.doctor import examined
from physid_drake.errors import RecordingError
from physid_drake.pushes.push_checks import refusals
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import Recording, read_recording, recording_folder
from physid_drake.report.inspection import alike_as_one, draw_pushes, inspection_table, warnings_by_kind
from physid_drake.report.picture import check_picture, write_picture
from physid_drake.report.progress import progress_bar
from physid_drake.report.terminal import terminal


def run(arguments: argparse.Namespace) -> int:
    """Run the command.

    Raises:
        RecordingError: if it cannot be read, or a diagnosis would refuse it; one line that says why.
    """
    picture: Path | None = arguments.out
    if picture is not None:
        check_picture(picture)
    recording = read_recording(recording_folder(arguments.recording))
    console = terminal()
    console.print(inspection_table(recording))
    if picture is not None:
        write_picture(draw_pushes(recording), picture)
        print(f"drawn: {picture}")
    refused = look(recording)
    if not arguments.no_fit:
        with progress_bar(console) as progress:
            finding = examined(recording, progress)
        for line in finding.lines():
            warnings.warn(line, UserWarning, stacklevel=1)
        console.print(f"{finding.sentence()}.")
    if refused:
        raise RecordingError(refused[0])
    return 0


def look(recording: Recording) -> tuple[str, ...]:
    """Print warnings, and as ERROR lines all but the first reason for which a diagnosis refuses the recording.

    Returns:
        The reasons, those that are alike as one.
    """
    pushes = [push.name for push in recording.pushes]
    refused = alike_as_one(refusals(recording), pushes)
    for line in (*warnings_by_kind(recording), *doubts(recording)):
        warnings.warn(line, UserWarning, stacklevel=2)
    for line in refused[1:]:
        say_error(line)
    return tuple(refused)
