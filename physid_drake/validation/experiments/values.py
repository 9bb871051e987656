"""What an experiment is and what comes out of it: tables and curves of plain numbers."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import ConfigError
from physid_drake.progress import Progress

Array = NDArray[np.float64]
Record = dict[str, Any]
"""What one repetition found: names to numbers, texts, lists and further records, as JSON has them."""

Entry = str | float | int | None


@dc.dataclass(frozen=True, kw_only=True)
class Series:
    """A curve with its spread.

    Attributes:
        name: as in the legend.
        x: (n) places, increasing.
        mean, deviation: (n) over repetitions; the deviation is nan where there is one repetition.
    """

    name: str
    x: tuple[float, ...]
    mean: tuple[float, ...]
    deviation: tuple[float, ...]


@dc.dataclass(frozen=True, kw_only=True)
class Panel:
    """One part of a figure; ``level`` draws a dashed line at a height, with its name."""

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    level: tuple[str, float] | None = None


@dc.dataclass(frozen=True, kw_only=True)
class Table:
    """Rows under columns; ``name`` is that of its CSV file."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Entry, ...], ...]

    def __post_init__(self) -> None:
        wrong = next((row for row in self.rows if len(row) != len(self.columns)), None)
        if wrong is not None:
            raise ConfigError(f"table '{self.name}': {len(self.columns)} columns, but a row of {len(wrong)}.")


@dc.dataclass(frozen=True, kw_only=True)
class Result:
    """An experiment's outcome.

    Attributes:
        setting: what was done, in sentences.
        tables: at least one.
        panels: of the figure, side by side.
        skipped: what was left out, and why.
    """

    setting: str
    tables: tuple[Table, ...]
    panels: tuple[Panel, ...]
    skipped: tuple[str, ...] = ()


class Experiment(Protocol):
    """A frozen dataclass of sizes; the same sizes and seed give the same records."""

    @property
    def seed(self) -> int:
        """Of everything random."""
        ...

    @property
    def repetitions(self) -> int:
        """How many independent parts there are."""
        ...

    def repeat(self, index: int, progress: Progress) -> Record:
        """Make one repetition."""
        ...

    def result(self, records: Sequence[Record]) -> Result:
        """Tables and curves of the records, in the order of the repetitions."""
        ...


def mean_and_deviation(values: Sequence[float]) -> tuple[float, float]:
    """Mean and sample standard deviation; the latter is nan for one value.

    Raises:
        ConfigError: if there is no value.
    """
    if not len(values):
        raise ConfigError("mean and deviation: at least one value is needed, but got none.")
    array = np.asarray(values, dtype=np.float64)
    return float(array.mean()), float(array.std(ddof=1)) if len(array) > 1 else math.nan


def series_of(name: str, x: Sequence[float], rows: Sequence[Sequence[float]]) -> Series:
    """A curve from one row (n) for each repetition.

    Raises:
        ConfigError: if a row is not as long as ``x``.
    """
    if any(len(row) != len(x) for row in rows):
        raise ConfigError(f"series '{name}': every repetition needs {len(x)} values.")
    pairs = [mean_and_deviation(column) for column in zip(*rows, strict=True)]
    return Series(
        name=name, x=tuple(float(v) for v in x), mean=tuple(m for m, _ in pairs), deviation=tuple(d for _, d in pairs)
    )
