"""The whole diagnosis, from the first fit to the answer."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.conclude import conclude
from physid_drake.diagnose.decide import (
    FEWEST_PUSHES,
    Decision,
    decided,
    is_own_error,
    kinds_of,
    most_noise_scale,
    refuted,
)
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.hypotheses import freed
from physid_drake.diagnose.localise import missing_wrenches, with_phases
from physid_drake.diagnose.next_push import next_push
from physid_drake.diagnose.search import Found, Scored, searched
from physid_drake.diagnose.values import Diagnosis
from physid_drake.effects import applicable
from physid_drake.identify import Identification, identified, identified_with
from physid_drake.identify.accuracy import accuracy_of
from physid_drake.identify.judge import Judge
from physid_drake.inference.process_noise import learned
from physid_drake.inference.rollouts import Physics
from physid_drake.progress import Progress
from physid_drake.pushes.case import Case
from physid_drake.pushes.kept_rollouts import KeptRollouts

Array = NDArray[np.float64]

RIVALS = 3  # most rivals that the next push is to distinguish


def diagnose(
    case: Case,
    *,
    seed: int = 0,
    alpha: float = 0.01,
    effects: Sequence[str] | None = None,
    progress: Progress | None = None,
    kept: KeptRollouts | None = None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose a recording.

    Args:
        case: the recording, made ready.
        seed: random seed.
        alpha: false-alarm rate of the detection.
        effects: names of the catalogue to look for; None for all.
        progress: called with the stage, steps done and steps in all.
        kept: rollouts that an interrupted run has kept; with them the answer is the same, to the last digit.

    Raises:
        ConfigError: if an effect's name is unknown, or none of them can be in such a recording.
        RecordingError: if no push can be rolled out.
    """
    case.pool.kept = KeptRollouts() if kept is None else kept
    applicable(case.around, effects)  # an unknown name is refused before anything is simulated
    return diagnose_from(
        identified(case, seed=seed, progress=progress), seed=seed, alpha=alpha, effects=effects, progress=progress
    )


def diagnose_from(
    known: Identification,
    *,
    seed: int = 0,
    alpha: float = 0.01,
    effects: Sequence[str] | None = None,
    progress: Progress | None = None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose what an identification leaves unexplained.

    Args:
        known: the identification.
        seed: random seed.
        alpha: false-alarm rate of the detection.
        effects: names of the catalogue to look for; None for all.
        progress: called with the stage, steps done and steps in all.

    Raises:
        ConfigError: if an effect's name is unknown, or none of them can be in such a recording.
    """
    say: Progress = progress or (lambda stage, done, total: None)
    evidence = gathered(known, seed=seed, alpha=alpha, effects=effects, progress=say)
    return conclude(evidence, seed=seed, alpha=alpha), evidence


def gathered(
    known: Identification, *, seed: int, alpha: float, effects: Sequence[str] | None, progress: Progress
) -> Evidence:
    """All parts of a diagnosis that need rollouts; arguments as of ``diagnose_from``."""
    kinds = applicable(known.case.around, effects)
    found = searched(known.finder, known.found, kinds, seed=seed, alpha=alpha, progress=progress)
    if found.odd and not known.case.noise.known:  # an unknown noise may be process noise
        progress("process noise", 0, 0)
        rough, added = learned(found.fitter, found.richest)
        if not rough.is_none:
            known = identified_with(known, rough, added, seed=seed, progress=progress)
            found = searched(known.finder, known.found, kinds, seed=seed, alpha=alpha, progress=progress)
    progress("effects in the Drake cell", 0, 0)
    evidence = judged(known, found)
    case, plain, decision = known.case, known.fit, evidence.decision
    if decision.verdict in ("consistent", "underpowered"):
        return evidence
    progress("missing wrench", 0, 0)
    wrenches = with_phases(case, missing_wrenches(found.fitter, plain))
    progress("next push", 0, 0)
    return dc.replace(evidence, wrenches=wrenches, next_push=next_push(case, _rivals(found.named, decision)))


def judged(known: Identification, found: Found) -> Evidence:
    """The decision, with its hypotheses refined in the Drake cell.

    Effects and unnamed forces are claimed only if they predict held-out pushes nearer than the baseline.

    Args:
        known: the identification.
        found: all hypotheses, fitted on the twin.
    """
    case, before, judge, most = known.case, known.errors, Judge(known.finder), most_noise_scale(known.case.noise)
    decision = decided(found, most=most)
    if len(case.problems) >= FEWEST_PUSHES and is_own_error(accuracy_of(case, before)):
        decision = Decision(verdict="consistent")
    partly = None if decision.partly is None else judge.left_out(decision.partly.fit)
    best = None if decision.best is None else judge.judged(freed(found.fitter, decision.best.fit))
    after = before if best is None else judge.left_out(best)
    if best is not None and not _nearer(case, after, before):
        best, after = None, before
        decision = refuted(found, decision, most=most, partly=partly is not None and _nearer(case, partly, before))
    return Evidence(
        known=known, found=found, decision=decision, fitter=judge.fitter, best=best, errors_after=after,
        errors_partly=None if decision.partly is None else partly,
    )  # fmt: skip


def _nearer(case: Case, after: Sequence[Array], before: Sequence[Array]) -> bool:
    """Whether the object's motion in held-out pushes is predicted nearer; with the hand's force alone it is not."""
    return accuracy_of(case, after).rms <= accuracy_of(case, before).rms


def _rivals(named: Sequence[Scored], decision: Decision) -> list[Physics]:
    """The models in question: what was decided on and those it cannot be told from, or the next best instead."""
    best = decision.best
    if best is None or decision.verdict == "unexplained":
        return []
    others = [one for one in named if one is not best and len(kinds_of(one)) == len(kinds_of(best))]
    fits = [one.fit for one in (best, *(decision.rivals[:RIVALS] or others[:1]))]
    return [fit.hypothesis.physics(fit.point.z) for fit in fits]
