"""What became of each effect of the catalogue, and why."""

from __future__ import annotations

from collections.abc import Sequence

from physid_drake.diagnose.decide import confirmed, kinds_of
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.regimes import standard_error
from physid_drake.diagnose.search import Weighed
from physid_drake.diagnose.values import Ranked
from physid_drake.inference.replicates import p_value
from physid_drake.inference.scores import scores


def ranking_of(evidence: Evidence, classes: Sequence[Sequence[str]]) -> tuple[Ranked, ...]:
    """All effects, best first, fitted alone: what each gains, and why it was found or not.

    Args:
        evidence: what was fitted.
        classes: of each effect that is named, those that may stand in its place.
    """
    found = evidence.found
    alone = {kinds_of(one)[0].name: one for one in found.named if len(kinds_of(one)) == 1}
    linear = {score.kind.name: score.gain for score in reversed(scores(found.fitter, found.plain, found.columns))}
    named = {kind.name for kind in evidence.decision.effects} if evidence.named else set()
    alike = {name for names in classes for name in names}
    rows = []
    for name in [*alone, *(name for name in linear if name not in alone)]:
        one = alone.get(name)
        rows.append(
            Ranked(
                name=name,
                gain=2.0 * linear[name],
                p_value=1.0 if one is None else p_value(one.gain, found.by_chance),
                held_out_gain=None if one is None else one.gain,
                held_out_se=None if one is None else standard_error(one.gains),
                why=_why(name, one, named, alike, evidence),
            )
        )
    return tuple(rows)


def _why(name: str, one: Weighed | None, named: set[str], alike: set[str], evidence: Evidence) -> str:
    if name in named:
        return "found"
    if name in alike:
        return "these pushes cannot tell it from what was found"
    if one is None:
        return "the twin cannot roll it out"
    if not confirmed(one):
        return "pushes that were left out do not confirm it"
    if named:
        return "predicts pushes that were left out worse"
    return "pushes that were left out confirm it, but it leaves more than noise"
