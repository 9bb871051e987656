"""A live Meshcat while a job works: what it does, what it has found, a button that stops it; then what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from physid_drake.progress import Progress
from physid_drake.recording import Recording
from physid_drake.report.acts import first_act, setting_of_recording
from physid_drake.report.meshcat_server import served
from physid_drake.report.stage import Act, Setting, Stage

STOP: Final = "STOP the job"


class Live:
    """Meshcat's controls, which are buttons, say what goes on: Drake's Meshcat has no text of its own."""

    def __init__(self, recording: Recording, host: str) -> None:
        """Show a recording's first push, before anything is known.

        Args:
            recording: the pushes.
            host: address to listen on; ``*`` is every network of this machine.

        Raises:
            ConfigError: if there is no such address here.
        """
        self._meshcat = served(host)
        self._labels: list[str] = []
        self._now = ""
        stage = Stage(setting_of_recording(recording), self._meshcat)
        stage.show_start(first_act(recording))
        self._meshcat.AddButton(STOP)
        self._label("starting")

    @property
    def url(self) -> str:
        """Where it is seen."""
        return str(self._meshcat.web_url())

    def watching(self, progress: Progress) -> Progress:
        """A progress that shows its stage here, too, and stops the job where the button was pressed."""

        def tell(stage: str, done: int, total: int) -> None:
            if self._meshcat.GetButtonClicks(STOP):
                raise KeyboardInterrupt
            progress(stage, done, total)
            self._label(stage)

        return tell

    def found(self, line: str) -> None:
        """Add a line that stays."""
        self._label("")
        self._add(line)

    def play(self, setting: Setting, acts: Sequence[Act], unit_force: float) -> None:
        """Play what came of it; there is nothing to stop any more."""
        self._label("")
        self._meshcat.DeleteButton(STOP)
        Stage(setting, self._meshcat).play(acts, unit_force)

    def _label(self, stage: str) -> None:
        """The line of what goes on: "now: ..."."""
        line = f"now: {stage}" if stage else ""
        if line == self._now:
            return
        if self._now:
            self._meshcat.DeleteButton(self._now)
        self._now = line
        if line:
            self._meshcat.AddButton(line)

    def _add(self, line: str) -> None:
        if line not in self._labels:  # buttons of one name are one
            self._labels.append(line)
            self._meshcat.AddButton(line)
