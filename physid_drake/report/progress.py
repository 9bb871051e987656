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
"""Of a stage that lasts longer than it usually does, so much is left at least; and as long again as it is late."""

IDENTIFICATION_STAGES: Final[Mapping[str, float]] = {"parameter fit": 5.0, "refit in the Drake cell": 4.0}
DIAGNOSIS_STAGES: Final[Mapping[str, float]] = {
    **IDENTIFICATION_STAGES, "test for missing physics": 2.5, "single effects": 15.0, "pairs of effects": 25.0,
    "unnamed force": 5.5, "effects in the Drake cell": 4.0, "missing wrench": 0.3,
    "next push": 0.5,
}  # fmt: skip
HINDSIGHT: Final = "planning with the baseline model"
PLANNING_STAGES: Final[Mapping[str, float]] = {"policy search": 6.0, "sweep": 19.0, HINDSIGHT: 24.0}
JOB_STAGES: Final[Mapping[str, float]] = {"parameter search": 4.0, **DIAGNOSIS_STAGES, **PLANNING_STAGES}
"""How long the stages last beside one another; `benchmarks/diagnosis_time.py` prints those of a diagnosis."""


class Forecast:
    """How much of a job is left, by how long those of its stages that are over have lasted."""

    def __init__(self, stages: Mapping[str, float]) -> None:
        """``stages``: in their order, how long each lasts beside the others; those that are left out take no time."""
        self._lasts = dict(stages)
        self._over: dict[str, float] = {}  # how long they have lasted [s]
        self._stage, self._began = "", time.monotonic()
        self._done, self._total = 0, 0

    def tell(self, stage: str, done: int, total: int) -> None:
        """A stage has begun, or gone on."""
        if stage != self._stage:
            now = time.monotonic()
            if self._stage in self._lasts:
                self._over[self._stage] = self._over.get(self._stage, 0.0) + now - self._began
            self._stage, self._began = stage, now
        self._done, self._total = done, total

    def left(self) -> float | None:
        """Seconds until all stages are done, at most: some may be left out; None where nobody knows."""
        here = time.monotonic() - self._began
        if self._stage not in self._lasts:
            # A stage that says how far it is knows its own end.
            told = 0 < self._done <= self._total and here >= SOON
            return here * (self._total - self._done) / self._done if told else None
        over = [name for name in self._over if name != self._stage]
        if not over:
            return None
        lasted, parts = (sum(of[name] for name in over) for of in (self._over, self._lasts))
        unit, own = lasted / parts, self._lasts[self._stage]
        usual = unit * own
        rest = max(usual - here, LATE * usual, here - usual)
        if here > usual:
            # What is slow here, such as a law that Drake has to roll out, is slow in what comes, too.
            unit = (lasted + here + rest) / (parts + own)
        names = list(self._lasts)
        return rest + unit * sum(self._lasts[name] for name in names[names.index(self._stage) + 1 :])

    def words(self) -> str:
        """What is left, for a person."""
        left = self.left()
        if left is None:
            return ""
        rounded = _rounded(left)
        about = f"{rounded} s" if rounded < 120 else f"{round(rounded / 60)} min"
        return f"at most {about} left" if self._stage in self._lasts else f"{about} left"


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
