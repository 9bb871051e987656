"""Diagnoses opened worlds of a proof again, which counts for nothing: again.py PROOF WORLD [WORLD ...] [--jobs 2].

Per world what was put in, what was said of it then and what now, and where time goes: rollouts per push and seconds
of each stage. ``--effects`` looks for these only. Seconds are worth nothing beside other work; rollouts are the same
everywhere.
"""

import argparse
import json
import time
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from physid_drake.diagnose import diagnose
from physid_drake.errors import PhysidError
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.rollouts import RolloutPool
from physid_drake.recording import read_recording
from physid_drake.report.diagnosis import diagnosis_json
from physid_drake.validation.sealing.diagnosing import RESULT
from physid_drake.validation.sealing.seal import SEALED


class Stages:
    """Rollouts and seconds of each stage of a diagnosis, in the order in which stages begin."""

    def __init__(self):
        self.rollouts, self.seconds = Counter(), Counter()
        self._stage, self._since = "ready", time.perf_counter()

    def progress(self, stage, done, total):
        """As diagnoses tell how far they are."""
        now = time.perf_counter()
        self.seconds[self._stage] += now - self._since
        self._stage, self._since = stage.split(",")[0], now

    def counting(self, run):
        """``RolloutPool.run`` that counts for the stage under way."""

        def counted(pool, tasks, progress=None):
            before = len(pool.kept)
            made = run(pool, tasks, progress)
            self.rollouts[self._stage] += len(pool.kept) - before
            return made

        return counted


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proof", type=Path)
    parser.add_argument("worlds", nargs="+", metavar="WORLD")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--effects", nargs="+", metavar="NAME")
    given = parser.parse_args()
    console = Console(width=140, markup=False, highlight=False)
    try:
        for world in given.worlds:
            console.print(f"{world}: put in {put_in(given.proof / SEALED / f'{world}.json')}")
            console.print(f"  then: {said_then(given.proof / 'diagnoses' / world / RESULT)}")
            answer, pushes, motion, stages = diagnosed(given.proof / "recordings" / world, given.jobs, given.effects)
            seconds = sum(stages.seconds.values())
            console.print(f"  now:  {said(answer)}; {pushes} pushes, {motion:.1f} s of motion, in {seconds:.0f} s")
            console.print(table(stages, pushes))
    except (PhysidError, OSError) as error:
        parser.error(str(error))


def diagnosed(folder, jobs, effects):
    """The answer as in ``diagnosis.json``, pushes, seconds of motion, and the stages."""
    recording = read_recording(folder)
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=jobs)
    stages, run = Stages(), RolloutPool.run
    RolloutPool.run = stages.counting(run)
    try:
        diagnosis, _ = diagnose(case, effects=effects, progress=stages.progress)
    finally:
        RolloutPool.run = run
    stages.progress("done", 0, 0)
    motion = sum(problem.end - problem.begin for problem in case.problems)
    return json.loads(diagnosis_json(diagnosis)), len(case.problems), motion, stages


def put_in(seal):
    truth = json.loads(seal.read_text())
    effects = ", ".join(f"{e['name']} {numbers(e['parameters'])}" for e in truth["effects"])
    return f"{effects or 'nothing'} ({truth['kind']}, {truth['size_sigma'] or 0.0:.1f} sigma)"


def numbers(parameters):
    return {k: round(v, 4) if isinstance(v, float) else v for k, v in parameters.items()}


def said_then(path):
    return said(json.loads(path.read_text())) if path.is_file() else "no diagnosis"


def said(answer):
    """Verdict, p-value, what is left, and the names with their numbers and intervals."""
    effects = [
        f"{' or '.join([e['name'], *e['indistinguishable_from']])} {intervals(e['parameters'])}"
        for e in answer["effects"]
    ]
    fit = (
        f"p = {answer['p_value']:.2g}, chi2 {answer['reduced_chi2_before']:.2f} -> {answer['reduced_chi2_after']:.2f}"
    )
    return f"{answer['verdict']}, {fit}" + "".join(f"; {e}" for e in effects)


def intervals(parameters):
    return ", ".join(f"{k} {number(p['value'])} ({number(p['ci90'][0])} to {number(p['ci90'][1])})"
                     for k, p in parameters.items() if isinstance(p["value"], float))  # fmt: skip


def number(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def table(stages, pushes):
    made = Table("stage", "rollouts/push", "s")
    for stage, seconds in stages.seconds.items():
        made.add_row(stage, f"{stages.rollouts[stage] / pushes:.1f}", f"{seconds:.1f}")
    made.add_section()
    made.add_row("all", f"{sum(stages.rollouts.values()) / pushes:.0f}", f"{sum(stages.seconds.values()):.0f}")
    return made


if __name__ == "__main__":
    main()
