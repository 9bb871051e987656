"""A live Meshcat while a job works: what it does, what it has found, a button that stops it; then what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydrake.math import RigidTransform, RotationMatrix

from physid_drake.progress import Progress
from physid_drake.recording import Recording
from physid_drake.report.acts import first_act, setting_of_recording
from physid_drake.report.meshcat_server import served
from physid_drake.report.sign import sign
from physid_drake.report.stage import CAMERA, Act, Setting, Stage

STOP: Final = "STOP the job"
HINT: Final = "To stop the job: Open Controls, at the upper right."
BESIDE, ABOVE = 0.22, 0.10  # m: where the sign stands, seen from the object


class Live:
    """A sign beside the object says what goes on, and a button among Meshcat's controls stops the job."""

    def __init__(self, recording: Recording, host: str) -> None:
        """Show a recording's first push, before anything is known.

        Args:
            recording: the pushes.
            host: address to listen on; ``*`` is every network of this machine.

        Raises:
            ConfigError: if there is no such address here.
        """
        self._meshcat = served(host)
        self._title = recording.name
        self.lines: list[str] = []
        """What was found."""
        self.now = ""
        """What goes on."""
        act = first_act(recording)
        Stage(setting_of_recording(recording), self._meshcat).show_start(act)
        self._meshcat.SetTransform("sign", _facing(next(iter(act.bodies.values())).poses[0, 4:6]))
        self._meshcat.AddButton(STOP)
        self._say("starting")

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
            self._say(stage)

        return tell

    def found(self, line: str) -> None:
        """Add a line that stays."""
        self.lines.append(line)
        self._write()

    def play(self, setting: Setting, acts: Sequence[Act], unit_force: float) -> None:
        """Play what came of it; there is nothing to stop any more."""
        self._meshcat.DeleteButton(STOP)
        self._say("")
        Stage(setting, self._meshcat).play(acts, unit_force)

    def _say(self, stage: str) -> None:
        if stage != self.now:
            self.now = stage
            self._write()

    def _write(self) -> None:
        doing = [f"now: {self.now}", HINT] if self.now else []
        self._meshcat.SetObject("sign", sign([self._title, *self.lines, *doing]))


def _facing(place: NDArray[np.float64]) -> RigidTransform:
    """The sign's pose to the right of a place (2,), turned to who looks at that from where the camera is."""
    x, y, z = CAMERA
    yaw = RotationMatrix.MakeZRotation(np.arctan2(-y, -x) - 0.5 * np.pi)
    back = RotationMatrix.MakeXRotation(-np.arctan2(z, np.hypot(x, y)))
    return RigidTransform(yaw @ back, np.array([*place, ABOVE]) + yaw.multiply(np.array([BESIDE, 0.0, 0.0])))
