"""The story: fit, screen, grow, locate. What needs rollouts is here and in `grow`; conclusions in `conclude`."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.candidate import EXPLAINED, Candidate
from physid_drake.diagnose.classes import class_beside
from physid_drake.diagnose.conclude import conclude
from physid_drake.diagnose.confirm import WORTH_A_TRY
from physid_drake.diagnose.evidence import MOST_OF_UNKNOWN, Evidence, confirmed, unexplained
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.foils import Foil, better_foil
from physid_drake.diagnose.grow import HOPELESS, Grown, Growth, Looked
from physid_drake.diagnose.localise import missing_wrenches, with_phases
from physid_drake.diagnose.loudness import as_loud_as_left, quieter
from physid_drake.diagnose.model import Fitted, State
from physid_drake.diagnose.next_push import next_push
from physid_drake.diagnose.plain import coarse, fit_plain, lost_pushes, nearest, numerics, path_errors
from physid_drake.diagnose.screen import (
    Screening,
    Signature,
    signatures,
    tolerances,
)
from physid_drake.diagnose.values import Diagnosis
from physid_drake.effects import Effect, applicable, tolerated
from physid_drake.progress import Progress
from physid_drake.pushes.case import Case
from physid_drake.pushes.kept_rollouts import KeptRollouts

Array = NDArray[np.float64]


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
    evidence = gather(case, seed=seed, alpha=alpha, effects=effects, tick=say)
    evidence = _located(evidence, say)
    return conclude(evidence, seed=seed, alpha=alpha), evidence


def gather(case: Case, *, seed: int, alpha: float, effects: Sequence[str] | None, tick: Progress) -> Evidence:
    """Fit, screen, confirm: all that needs rollouts. Arguments as of ``diagnose``.

    All but the last look is done on ticks twice as long, whose error is one of the guard's directions.
    """
    search_rng, screen_rng = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
    look = _Search(kinds=applicable(case.around, effects), alpha=alpha, rng=screen_rng, tick=tick)
    rough = coarse(case)
    lost = lost_pushes(rough)
    if lost:
        case, rough = case.without(lost), rough.without(lost)
    first = _first(rough, search_rng, tick)
    answer = (look.answer if case.noise.known else look.answer_by_ratios)(case, rough, first)
    return _on_short_ticks(answer, tick)


def _on_short_ticks(answer: _Answer, tick: Progress) -> Evidence:
    """The evidence of an answer, both models taken to the case's own ticks."""
    case, grown, fitter = answer.case, answer.grown, answer.fitter
    plain, model = grown.base.fitted, grown.last.fitted
    fine = Fitter(case, fitter.extra, fitter.tolerances)
    # Shorter ticks make no difference to a model that explains nothing.
    model_fitter = fine if grown.steps and model.reduced_chi2 <= HOPELESS else fitter
    tick("on short ticks", 0, 0)
    refined = fine.refine(plain)
    final = fine.refine(model) if model_fitter is fine else model if grown.steps else refined
    closest = nearest(fitter.case, case, plain)
    tick("pushes left out", 0, 0)
    before = after = fine.left_out(closest or refined)
    best = confirmed(grown.steps, grown.rejected, final)
    if best is not None:
        after = model_fitter.left_out(best[1])
    case.pool.count += fitter.case.pool.count
    return Evidence(
        case=case, fitter=fine, plain=refined, nearest=closest or refined, errors_before=before, errors_after=after,
        screening=grown.base.screening, signatures=grown.base.signatures,
        steps=grown.steps, rejected=grown.rejected, superfluous=grown.superfluous, final=final,
        remaining=grown.last.screening, noise_share=answer.noise_share, loud=answer.loud, foil=answer.foil,
    )  # fmt: skip


@dc.dataclass(frozen=True, kw_only=True)
class _Answer:
    """A grown model with the case it belongs to; ``fitter`` is on longer ticks. The rest as in ``Evidence``."""

    case: Case
    fitter: Fitter
    grown: Grown
    noise_share: float = 1.0
    loud: tuple[Fitted, Screening] | None = None
    foil: Foil | None = None


def _better_foil(growth: Growth, grown: Grown) -> Foil | None:
    """A law beside the catalogue that does better than an effect of a model that explains the pushes, or nearly."""
    plain, model = grown.base.fitted, grown.last.fitted
    # On short ticks, which come later, a model may leave a little less.
    if not grown.steps or (unexplained(plain, model) and model.reduced_chi2 > EXPLAINED):
        return None
    for step in grown.steps:
        name = step[0].name
        alone = len(grown.steps) == 1
        without = plain if alone else grown.without.get(name) or growth.without(name, model)
        foil = better_foil(growth.fitter, without, model, name, growth.tick)
        if foil is not None:
            return foil
    return None


def _names(grown: Grown) -> set[str]:
    return {step[0].name for step in grown.steps}


def _in_question(grown: Grown) -> list[type[Effect]]:
    """The effects that were found, and those whose score tests came near enough to be tried."""
    scores = grown.base.screening.scores
    least = WORTH_A_TRY * max(s.gain for s in scores)
    found = _names(grown)
    return [s.kind for s in scores if s.gain >= least or s.kind.name in found]


@dc.dataclass(frozen=True, kw_only=True)
class _Search:
    """How a model is grown from a plain fit."""

    kinds: Sequence[type[Effect]]
    alpha: float
    rng: np.random.Generator
    tick: Progress

    def answer(self, case: Case, rough: Case, first: Fitted) -> _Answer:
        """Look at the whole catalogue, add effects, and take out what became superfluous."""
        # What pushes may share without its being physics does not depend on what is looked for.
        unasked = [kind for kind in tolerated(rough.around) if kind not in self.kinds]
        guard, found = _looks(rough, first, [*self.kinds, *unasked], self.tick)
        fitter = Fitter(rough, guard, tolerances(rough, found))
        asked = [s for s in found if s.kind in self.kinds]
        looked = Looked.at(fitter.guard(first), asked, self.rng)
        growth = Growth(fitter=fitter, kinds=self.kinds, alpha=self.alpha, rng=self.rng, tick=self.tick)
        grown = growth.grow(looked)
        return _Answer(case=case, fitter=fitter, grown=grown, foil=_better_foil(growth, grown))

    def answer_by_ratios(self, case: Case, rough: Case, first: Fitted) -> _Answer:
        """The same where the noise is not known: as loud as the plain cell leaves, then as what was found leaves."""
        loud = self.answer(*as_loud_as_left(case, rough, first))
        if not loud.grown.steps:
            return loud

        def left_by(model: Fitted) -> tuple[Case, Case, float]:
            """Both cases with the noise that a model leaves, and its share of what the plain cell leaves."""
            quiet, quiet_rough, _ = as_loud_as_left(case, rough, Fitter(rough).linearise(model.state))
            return quiet, quiet_rough, quieter(loud.case, quiet)

        quiet, quiet_rough, share = left_by(loud.grown.last.fitted)
        base = (loud.grown.base.fitted, loud.grown.base.screening)
        if share > MOST_OF_UNKNOWN:
            return dc.replace(loud, noise_share=share, loud=base)
        # What was noise so far was missing physics: with less noise the pushes tell more.
        self.tick("plain fit with less noise", 0, 0)
        first = Fitter(quiet_rough).fit(loud.grown.base.fitted.state, renew=True)
        again = dc.replace(self, kinds=_in_question(loud.grown)).answer(quiet, quiet_rough, first)
        if again.grown.steps and _names(again.grown) != _names(loud.grown):
            share = left_by(again.grown.last.fitted)[2]
        return dc.replace(again, noise_share=share, loud=base)


def _first(case: Case, rng: np.random.Generator, tick: Progress) -> Fitted:
    """The plain fit, with all derivatives where it ended."""
    return Fitter(case).linearise(fit_plain(case, rng, tick).state)


def _looks(
    case: Case, first: Fitted, kinds: Sequence[type[Effect]], tick: Progress
) -> tuple[tuple[Array, ...], list[Signature]]:
    """The guard's directions and the catalogue's signatures."""
    tick("numerics guard", 0, 0)
    own, of_path = numerics(case, first.state), path_errors(case, first.state, tick)
    guard = tuple(np.column_stack(pair) for pair in zip(own, of_path, strict=True))
    return guard, signatures(Fitter(case), first, kinds, lambda done, total: tick("score tests", done, total))


def _located(evidence: Evidence, tick: Progress) -> Evidence:
    """With the missing wrench, and the push that would tell rivals apart."""
    rough = Fitter(coarse(evidence.case))
    tick("the missing wrench", 0, 0)
    wrenches = with_phases(evidence.case, missing_wrenches(rough, evidence.plain))
    tick("the next push", 0, 0)
    push = next_push(rough.case, _rival_states(evidence))
    evidence.case.pool.count += rough.case.pool.count
    return dc.replace(evidence, wrenches=wrenches, next_push=push)


def _rival_states(evidence: Evidence) -> list[State]:
    """The models in question: the final one, and those with another effect in the place of one of its own.

    That is the first effect which these pushes cannot tell from others, else the last one and what came next to it;
    none where the final model explains nothing.
    """
    steps, final = evidence.steps, evidence.final.state
    if not steps or evidence.final.reduced_chi2 > HOPELESS:
        return []
    k = next((j for j in range(len(steps)) if class_beside(evidence, j)), len(steps) - 1)
    alike = class_beside(evidence, k)
    present = {step[0].name for step in steps}
    rest = [c for c in steps[k][1:] if c.name not in present]
    others = [c for c in rest if c.name in alike] or [c for c in rest if not c.degenerate][:1]

    def in_place(c: Candidate) -> State:
        point = next(e for e in c.fitted.state.effects if e.kind.name == c.name)
        return dc.replace(c.fitted.state, effects=(*final.effects[:k], point, *final.effects[k + 1 :]))

    return [final, *(in_place(c) for c in others)]
