"""What is done with a recording that was read: all that ``inspect`` does, and writing it again."""

from __future__ import annotations

import io
from pathlib import Path

from rich.console import Console

from fuzz.case import WrongError
from fuzz.judge import LONGEST
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.push_checks import refusals
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import Recording, digest_of, read_recording, write_recording
from physid_drake.report.inspection import draw_pushes, inspection_table, warning_lines
from physid_drake.report.picture import write_picture
from physid_drake.wording import in_one_line


def inspect(folder: Path, out: Path, *, picture: bool = False, prepared: bool = False) -> Recording:
    """Read, look at, write and read again.

    Args:
        folder: of the recording.
        out: where it is written.
        picture: whether it is drawn, too, which takes a fifth of a second.
        prepared: whether it is made ready for a diagnosis, too, which takes as long.
    """
    recording = read_recording(folder)
    look_at(recording, out, picture=picture)
    if prepared:
        case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
    return recording


def look_at(recording: Recording, out: Path, *, picture: bool = False) -> None:
    """All that ``inspect`` shows of a recording, and whether it is the same when it is written and read again."""
    console = Console(file=io.StringIO(), width=120)
    console.print(inspection_table(recording))
    for line in (*warning_lines(recording), *doubts(recording), *refusals(recording)):
        if not in_one_line(line).strip() or len(in_one_line(line)) >= LONGEST or "\n" in line.strip():
            raise WrongError(f"a warning is no line: {line[:200]!r}")
    if picture:
        write_picture(draw_pushes(recording), out.with_name("pushes.png"))
    before = digest_of(recording)
    write_recording(recording, out)
    again = read_recording(out)
    if any(
        push.warnings for push in recording.pushes
    ):  # what is left out once is gone, and its neighbours may follow
        return
    if digest_of(again) != before:
        raise WrongError("what is written is not what was read")
