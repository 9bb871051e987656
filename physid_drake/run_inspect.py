"""The ``inspect`` command: what is in a recording, what is odd about it, whether its conventions are as it says."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

from physid_drake.doctor import examined
from physid_drake.errors import RecordingError
from physid_drake.pushes.doubts import doubts
from physid_drake.pushes.refusals import refusals
from physid_drake.recording import read_recording, recording_folder
from physid_drake.report.inspection import draw_pushes, inspection_table, warnings_by_kind
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
    refused = refusals(recording)
    said = [*warnings_by_kind(recording), *doubts(recording), *(f"would be refused: {why}" for why in refused[1:])]
    for line in said:
        warnings.warn(line, UserWarning, stacklevel=1)
    if not arguments.no_fit:
        with progress_bar(console) as tick:
            finding = examined(recording, tick)
        for line in finding.lines():
            warnings.warn(line, UserWarning, stacklevel=1)
        if finding.before is not None and not finding.lines():
            console.print(f"the plain cell, fitted roughly to some of the pushes, leaves {finding.before:.2g} sigma")
    if refused:
        raise RecordingError(refused[0])
    return 0
