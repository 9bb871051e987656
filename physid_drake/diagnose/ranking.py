"""What became of each effect of the catalogue, and why."""

from __future__ import annotations

import math
from collections.abc import Sequence

from physid_drake.diagnose.candidate import Candidate
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.values import EffectFinding, Partly, Ranked
from physid_drake.diagnose.verdict import by_several, is_own_error, predicts

CHANCE = 0.05  # of all looks: what explains no more is not worth a word


def ranking_of(evidence: Evidence, findings: Sequence[EffectFinding], partly: Partly | None) -> tuple[Ranked, ...]:
    """All effects, best first, as they were screened: what each would gain, and why it was found or not."""
    named = {f.name for f in findings}
    some = set() if partly is None else set(partly.effects)
    classes = {name for f in findings for name in f.indistinguishable_from}
    steps = (*evidence.steps, evidence.rejected, *evidence.superfluous)
    fitted = {c.name: c for step in reversed(steps) for c in step}
    rows = []
    for one in evidence.screening.scores:
        candidate = fitted.get(one.kind.name)
        rows.append(
            Ranked(
                name=one.kind.name,
                gain=one.gain,
                p_value=float(min(1.0, evidence.screening.looks * math.exp(one.log_p))),
                held_out_gain=None if candidate is None else candidate.gain,
                held_out_se=None if candidate is None else candidate.standard_error,
                why=_why_partly(evidence)
                if one.kind.name in some
                else _why(one.kind.name, candidate, named, classes, evidence),
            )
        )
    return tuple(rows)


def _why(name: str, candidate: Candidate | None, named: set[str], classes: set[str], evidence: Evidence) -> str:
    if name in named:
        return "found"
    if name in classes:
        return "these pushes cannot tell it from what was found"
    if any(name == step[0].name for step in evidence.superfluous):
        return "was taken back: without it the others do as well"
    return _why_not_fitted(name, evidence) if candidate is None else _why_fitted_in_vain(candidate, named, evidence)


def _why_fitted_in_vain(candidate: Candidate, named: set[str], evidence: Evidence) -> str:
    if candidate.degenerate:
        return "its fit ran to nothing"
    if not candidate.accepted:
        return "pushes that were left out do not confirm it"
    if is_own_error(evidence):
        return "smaller than the cell's own error"
    if named:
        return "predicts pushes that were left out worse"
    return _why_not_named(evidence)


def _why_not_named(evidence: Evidence) -> str:
    if evidence.foil is not None:
        return "a law that the catalogue does not have predicts pushes that were left out better"
    if not predicts(evidence):
        return "pushes that were left out are simulated hardly better with it"
    if not by_several(evidence):
        return "one push that was left out is simulated better with it, the others hardly"
    return f"pushes that were left out confirm it, but it {_too_much(evidence)}"


def _why_partly(evidence: Evidence) -> str:
    return f"takes a part away, and {_too_much(evidence)}"


def _too_much(evidence: Evidence) -> str:
    if evidence.case.noise.known:
        return "leaves more than noise"
    return "leaves more than half of the noise that the plain cell needs and nobody states"


def _why_not_fitted(name: str, evidence: Evidence) -> str:
    score = evidence.screening.score_of(name)
    if score is None or not score.kept:
        return "would have to act the other way round"
    chance = evidence.screening.looks * math.exp(score.log_p) > CHANCE
    return "explains no more than chance would" if chance else "explains far less"
