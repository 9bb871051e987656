"""How far a computation is: one line in a terminal that moves, else lines on standard error.

A job of several stages says how much time is left of all of them, from how long they usually last beside the first.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Final

from rich.console import Console
from rich.progress import BarColumn, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.text import Text

from physid_drake.progress import Progress

AGAIN = 60.0  # s: a stage that lasts so long says how far it is
SOON: Final = 2.0
"""s: a stage that just began tells nothing of its end."""
LATE: Final = 0.1
"""Of a stage that lasts longer than it usually does, so much is left."""

IDENTIFICATION_STAGES: Final[Mapping[str, float]] = {"theta": 1.0, "in the Drake cell": 0.8}
DIAGNOSIS_STAGES: Final[Mapping[str, float]] = {
    **IDENTIFICATION_STAGES, "is anything missing?": 0.5, "effects, one at a time": 3.0, "pairs of effects": 5.0,
    "physics without a name": 1.1, "what was found, in the Drake cell": 0.8, "the missing wrench": 0.05,
    "the next push": 0.1,
}  # fmt: skip
"""How long a diagnosis' stages last beside its first, about; `benchmarks/diagnosis_time.py` prints those of one."""


class Forecast:
    """How much of a job is left."""

    def __init__(self, stages: Mapping[str, float]) -> None:
        """``stages``: in their order, how long each lasts beside the first; those that are left out take no time."""
        self._names, self._lasts = list(stages), list(stages.values())
        self._stage, self._began = "", time.monotonic()
        self._unit: float | None = None
        self._done, self._total = 0, 0

    def tell(self, stage: str, done: int, total: int) -> None:
        """A stage has begun, or gone on."""
        if stage != self._stage:
            if self._unit is None and self._names and self._stage == self._names[0]:
                self._unit = time.monotonic() - self._began
            self._stage, self._began = stage, time.monotonic()
        self._done, self._total = done, total

    def left(self) -> float | None:
        """Seconds until all stages are done, at most: some may be left out; None where nobody knows."""
        here = time.monotonic() - self._began
        if self._stage not in self._names:
            # A stage that says how far it is knows its own end.
            told = 0 < self._done <= self._total and here >= SOON
            return here * (self._total - self._done) / self._done if told else None
        if self._unit is None:
            return None
        k = self._names.index(self._stage)
        usual = self._unit * self._lasts[k]
        return max(usual - here, LATE * usual) + self._unit * sum(self._lasts[k + 1 :])

    def words(self) -> str:
        """What is left, for a person."""
        left = self.left()
        if left is None:
            return ""
        rounded = _rounded(left)
        about = f"{rounded} s" if rounded < 120 else f"{round(rounded / 60)} min"
        return f"at most {about} left" if self._stage in self._names else f"{about} left"


def _rounded(seconds: float) -> int:
    """To 5 s and above a minute to 10 s: it is no better known."""
    step = 5 if seconds < 60.0 else 10
    return max(step, step * round(seconds / step))


class _Left(ProgressColumn):
    """What is left, again with every refreshment of the line."""

    def __init__(self, forecast: Forecast) -> None:
        super().__init__()
        self._forecast = forecast

    def render(self, task: Task) -> Text:
        return Text(self._forecast.words())


@contextmanager
def progress_bar(console: Console, stages: Mapping[str, float] | None = None) -> Iterator[Progress]:
    """Show how far it is while the block runs; the function it gives takes stage, done and total (0 if unknown).

    Args:
        console: where.
        stages: of the job, how long each lasts beside the first.
    """
    forecast = Forecast(stages or {})
    if not console.is_terminal:
        yield _in_lines(forecast)
        return
    columns = (
        SpinnerColumn(), TextColumn("{task.description}", markup=False), BarColumn(bar_width=16), TimeElapsedColumn(),
        _Left(forecast),
    )  # fmt: skip
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("starting", total=None)

        def show(stage: str, done: int, total: int) -> None:
            forecast.tell(stage, done, total)
            bar.update(task, description=stage, completed=done, total=total or None)

        yield show


def _in_lines(forecast: Forecast) -> Progress:
    """For a log, where a line cannot be redrawn; results stay alone on standard output."""
    since, said, last = time.monotonic(), 0.0, ""

    def show(stage: str, done: int, total: int) -> None:
        nonlocal said, last
        forecast.tell(stage, done, total)
        after = time.monotonic() - since
        if stage == last and (not total or after - said < AGAIN):
            return
        how_far = f", {done} of {total}" if stage == last else ""
        left = forecast.words()
        said, last = after, stage
        print(f"{after:5.0f} s  {stage}{how_far}{f' ({left})' if left else ''}", file=sys.stderr, flush=True)

    return show
