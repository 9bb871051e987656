"""Repetitions that are kept: what is done is read back, so that an interrupted experiment goes on."""

from __future__ import annotations

import dataclasses as dc
import functools
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from physid_drake.errors import OutputError
from physid_drake.files import FileError, read_json
from physid_drake.processes import in_processes
from physid_drake.progress import Progress
from physid_drake.run_folder import SETTINGS, RunFolder, settings_text
from physid_drake.validation.experiments.values import Experiment, Record

COMMAND = "experiment"
KEPT = "repetitions"


@contextmanager
def claim(name: str, experiment: Experiment, out: Path) -> Iterator[RunFolder]:
    """The folder of an experiment, refused where it holds another or the same with other sizes.

    Raises:
        ConfigError: if it does, or another run writes to it.
        OutputError: if it cannot be written.
    """
    text = settings_text(COMMAND, {"experiment": name, **settings_of(experiment)})
    with RunFolder.claim(out, COMMAND, text, name=SETTINGS) as folder:
        folder.own(f"{KEPT}/")
        yield folder


def settings_of(experiment: Experiment) -> dict[str, Any]:
    """The sizes of an experiment as JSON has them; where its pushes lie is not among them."""
    assert dc.is_dataclass(experiment) and not isinstance(experiment, type)
    values = dc.asdict(experiment)
    return {k: list(v) if isinstance(v, tuple) else v for k, v in values.items() if not isinstance(v, Path)}


def run_all(experiment: Experiment, folder: RunFolder, *, jobs: int, progress: Progress) -> list[Record]:
    """All records in their order; those that are kept are not made again.

    Args:
        experiment: what is repeated.
        folder: from ``claim``.
        jobs: processes; the records do not depend on it.
        progress: told what is going on.

    Raises:
        KeyboardInterrupt: when interrupted; what is done is kept.
    """
    missing = [k for k in range(experiment.repetitions) if _kept(folder, k) is None]
    done = experiment.repetitions - len(missing)
    for index, record in _made(experiment, missing, jobs, progress):
        folder.write(_name(index), json.dumps(record, indent=1) + "\n")
        done += 1
        progress(f"repetition {done} of {experiment.repetitions}", done, experiment.repetitions)
    records = [_kept(folder, k) for k in range(experiment.repetitions)]
    return [record for record in records if record is not None]


def _name(index: int) -> str:
    return f"{KEPT}/{index:03d}.json"


def _kept(folder: RunFolder, index: int) -> Record | None:
    file = folder.path / _name(index)
    if not file.exists():
        return None
    try:
        record: Record = read_json(file)
    except FileError as error:
        raise OutputError(f"'{file}': {error}; delete it to make it again.") from error
    return record


def _made(
    experiment: Experiment, indices: Sequence[int], jobs: int, progress: Progress
) -> Iterator[tuple[int, Record]]:
    if jobs <= 1 or len(indices) <= 1:
        for index in indices:
            yield index, _through_json(experiment.repeat(index, _told(progress, index, experiment.repetitions)))
        return
    progress("first repetitions", 0, experiment.repetitions)
    yield from in_processes(functools.partial(_repeat, experiment), indices, jobs)


def _repeat(experiment: Experiment, index: int) -> Record:
    return _through_json(experiment.repeat(index, lambda stage, done, total: None))


def _through_json(record: Record) -> Record:
    """As it will be read back, so that a resumed experiment has the same numbers."""
    result: Record = json.loads(json.dumps(record))
    return result


def _told(progress: Progress, index: int, count: int) -> Progress:
    return lambda stage, done, total: progress(f"repetition {index + 1} of {count}: {stage}", done, total)
