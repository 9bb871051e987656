"""For scripts and notebooks: recordings from arrays, and a diagnosis with its page, in a few lines.

``docs/from_python.md`` has examples.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from physid_drake.convert import convert_bag, convert_table, guess_map, pushes_of_take
from physid_drake.diagnose import Diagnosis, Evidence, case_of, cell_config
from physid_drake.diagnose import diagnose as diagnose_case
from physid_drake.model import Model
from physid_drake.model_reading import load_model
from physid_drake.progress import Progress
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import (
    Box,
    Cylinder,
    ForceStream,
    Hand,
    ObjectModel,
    PoseStream,
    Prism,
    Push,
    Recording,
    Sensors,
    Table,
    planar_poses,
    read_recording,
    write_recording,
)
from physid_drake.report.diagnosis import diagnosis_json
from physid_drake.report.diagnosis_page import diagnosis_page, shown_pushes
from physid_drake.report.progress import DIAGNOSIS_STAGES, progress_bar
from physid_drake.report.terminal import terminal
from physid_drake.run_diagnose import COMMAND, write
from physid_drake.run_folder import RunFolder
from physid_drake.whole_files import write_whole

__all__ = [
    "Answer",
    "Box",
    "Cylinder",
    "ForceStream",
    "Hand",
    "Model",
    "ObjectModel",
    "PoseStream",
    "Prism",
    "Push",
    "Recording",
    "Sensors",
    "Table",
    "convert_bag",
    "convert_table",
    "diagnose",
    "guess_map",
    "load_model",
    "planar_poses",
    "pushes_of_take",
    "read_recording",
    "write_recording",
]


@dataclass(frozen=True, kw_only=True, eq=False)
class Answer:
    """The result of a diagnosis.

    Attributes:
        diagnosis: verdict, effects with intervals, errors before and after, and all else in ``diagnosis.json``.
        evidence: the fits and hypotheses on which it rests.
    """

    diagnosis: Diagnosis
    evidence: Evidence

    def __str__(self) -> str:
        """The verdict, and a sentence about it."""
        return f"{self.diagnosis.verdict}: {self.diagnosis.sentence}"

    def json(self) -> str:
        """The text of ``diagnosis.json``."""
        return diagnosis_json(self.diagnosis)

    def save_page(self, file: str | Path) -> None:
        """Write the page that shows the diagnosis; any browser opens it, without a network.

        Args:
            file: name of the page; an existing file is replaced.

        Raises:
            OutputError: if it cannot be written.
        """
        pushes = shown_pushes(self.diagnosis, self.evidence)
        page = diagnosis_page(self.diagnosis, self.evidence.case.recording, pushes, self.evidence.wrenches)
        write_whole(Path(file), page.encode())

    def save(self, folder: str | Path) -> None:
        """Write what the ``diagnose`` command writes: ``diagnosis.json``, the pages, the scene and ``model.yaml``.

        Args:
            folder: new, empty, or of an earlier diagnosis.

        Raises:
            ConfigError: if it holds anything else.
            OutputError: if it cannot be written.
        """
        RunFolder.check(Path(folder), COMMAND)
        write(RunFolder.begin(Path(folder), COMMAND), self.diagnosis, self.evidence)


def diagnose(
    recording: Recording,
    *,
    seed: int = 0,
    alpha: float = 0.01,
    effects: Sequence[str] | None = None,
    jobs: int = 0,
    progress: Progress | None = None,
) -> Answer:
    """Find the physics in a recording that the simulation leaves out.

    Args:
        recording: the pushes.
        seed: random seed.
        alpha: false-alarm rate of the detection.
        effects: names of effects of the catalogue to look for; None for all.
        jobs: processes; 0 takes the machine's cores.
        progress: called with the stage, steps done and steps in all; None shows a bar, or lines where there is no
            terminal.

    Raises:
        RecordingError: if the recording cannot be compared with a simulation; one line that says why.
        ConfigError: if an effect's name is unknown, or none of them can be in such a recording.
    """
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=jobs)
    shown = progress_bar(terminal(), DIAGNOSIS_STAGES) if progress is None else nullcontext(progress)
    with shown as called:
        diagnosis, evidence = diagnose_case(case, seed=seed, alpha=alpha, effects=effects, progress=called)
    return Answer(diagnosis=diagnosis, evidence=evidence)
