"""A diagnosis from the first fit to the answer."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.conclude import conclude
from physid_drake.diagnose.decide import Decision, decided, kinds_of, loudest
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.hypotheses import baseline, freed
from physid_drake.diagnose.judge import Judge
from physid_drake.diagnose.left_out import errors_of, is_own_error
from physid_drake.diagnose.localise import missing_wrenches, with_phases
from physid_drake.diagnose.next_push import next_push
from physid_drake.diagnose.search import Weighed, searched
from physid_drake.diagnose.values import Diagnosis
from physid_drake.effects import applicable
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.inference.predictions import Ask, Physics, Predictor
from physid_drake.inference.unknown_noise import as_loud_as_left
from physid_drake.progress import Progress
from physid_drake.pushes.case import Case
from physid_drake.pushes.kept_rollouts import KeptRollouts

Array = NDArray[np.float64]

TRIED = 8  # thetas, and the nominal one, at which a push must fail to be left to the cell, or out
RIVALS = 3  # at most, that a push is looked for which tells them apart


def diagnose(
    case: Case,
    *,
    seed: int = 0,
    alpha: float = 0.01,
    effects: Sequence[str] | None = None,
    tick: Progress | None = None,
    kept: KeptRollouts | None = None,
) -> tuple[Diagnosis, Evidence]:
    """Diagnose a recording.

    Args:
        case: the recording, ready.
        seed: of everything random.
        alpha: false-alarm rate of the detection.
        effects: names of the catalogue to look at; None for all.
        tick: told the stage, steps done, steps in all.
        kept: rollouts of a run that was interrupted, which goes on from there to the same answer.
    """
    say = tick or (lambda stage, done, total: None)
    case.pool.kept = KeptRollouts() if kept is None else kept
    evidence = gathered(case, seed=seed, alpha=alpha, effects=effects, tick=say)
    return conclude(evidence, seed=seed, alpha=alpha), evidence


def gathered(case: Case, *, seed: int, alpha: float, effects: Sequence[str] | None, tick: Progress) -> Evidence:
    """All that needs rollouts. Arguments as of ``diagnose``."""
    kinds = applicable(case.around, effects)
    case, by_cell = _rolled_by(case)
    fitter = Fitter(case, Predictor(case, by_cell))
    if not case.noise.known:
        tick("how loud the noise is", 0, 0)
        h = Hypothesis(space=case.thetas.space, around=case.around)
        case = as_loud_as_left(fitter, baseline(fitter, h, np.random.default_rng(seed)))
        fitter = Fitter(case, Predictor(case, by_cell))
    found = searched(fitter, kinds, seed=seed, alpha=alpha, tick=tick)
    decision = decided(found, most=loudest(case.noise))
    tick("in the Drake cell", 0, 0)
    judge = Judge(found.fitter)
    plain = judge.judged(found.plain)
    tick("pushes left out", 0, 0)
    before = judge.left_out(plain)
    if decision.verdict != "underpowered" and is_own_error(errors_of(case, before)):
        decision = Decision(verdict="consistent")
    best = None if decision.best is None else judge.judged(freed(found.fitter, decision.best.fit))
    after = before if best is None else judge.left_out(best)
    if decision.verdict == "unexplained" and errors_of(case, after).rms > errors_of(case, before).rms:
        best, after = None, before  # likelier, and yet no nearer
    evidence = Evidence(
        case=case, found=found, decision=decision, fitter=judge.fitter, plain=plain, best=best,
        errors_before=before, errors_after=after,
        errors_partly=None if decision.partly is None else judge.left_out(judge.judged(decision.partly.fit)),
    )  # fmt: skip
    if decision.verdict in ("consistent", "underpowered"):
        return evidence
    tick("the missing wrench", 0, 0)
    wrenches = with_phases(case, missing_wrenches(found.fitter, plain))
    tick("the next push", 0, 0)
    return dc.replace(evidence, wrenches=wrenches, next_push=next_push(case, _rivals(found.named, decision)))


def _rolled_by(case: Case) -> tuple[Case, tuple[int, ...]]:
    """The case without pushes that nothing can roll out, and those that only the cell can."""
    space = case.thetas.space
    thetas = [space.nominal, *space.sample(np.random.default_rng(0), TRIED, from_prior=True)]

    def lost(predictor: Predictor, pushes: Sequence[int]) -> list[int]:
        for theta in thetas:
            own = [np.zeros(len(n.names)) for n in case.nuisances]
            asks = [Ask(i, Physics(np.asarray(theta)), own[i]) for i in pushes]
            pushes = [i for i, vector in zip(pushes, predictor.vectors(asks), strict=True) if vector is None]
        return list(pushes)

    every = range(len(case.problems))
    by_cell = lost(Predictor(case), every)
    gone = lost(Predictor(case, every), by_cell)
    names = [case.problems[i].name for i in by_cell if i not in gone]
    case = case.without(gone) if gone else case
    return case, tuple(i for i, problem in enumerate(case.problems) if problem.name in names)


def _rivals(named: Sequence[Weighed], decision: Decision) -> list[Physics]:
    """The models in question: what was decided on and those it cannot be told from, or the next best instead."""
    best = decision.best
    if best is None or decision.verdict == "unexplained":
        return []
    others = [one for one in named if one is not best and len(kinds_of(one)) == len(kinds_of(best))]
    return [physics_of(one.fit) for one in (best, *(decision.rivals[:RIVALS] or others[:1]))]


def physics_of(fit: Fit) -> Physics:
    """Theta and effects of a fit."""
    return Physics(fit.hypothesis.theta(fit.point.z), fit.hypothesis.effects(fit.point.z))
