"""The ranking: what each effect of the catalogue gains, and why it was found or not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physid_drake.diagnose.decide import confirmed, kinds_of
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.regimes import standard_error
from physid_drake.diagnose.search import Scored
from physid_drake.diagnose.values import Ranked
from physid_drake.inference.replicates import surprise, without_best
from physid_drake.inference.scores import scores


def ranking_of(evidence: Evidence, classes: Sequence[Sequence[str]]) -> tuple[Ranked, ...]:
    """All effects, each alone beside the baseline, best first.

    Args:
        evidence: all that was fitted.
        classes: of each effect that is named, names of the effects that cannot be distinguished from it.
    """
    found = evidence.found
    alone = {kinds_of(one)[0].name: one for one in found.named if len(kinds_of(one)) == 1}
    scored = {score.kind.name: score.gain for score in reversed(scores(found.fitter, found.baseline, found.columns))}
    named = {kind.name for kind in evidence.decision.effects} if evidence.named else set()
    alike = {name for names in classes for name in names}
    gains = found.linearly | {name: one.gain for name, one in alone.items()}
    sure = found.linearly | {name: float(without_best(one.gains)) for name, one in alone.items()}
    return tuple(
        Ranked(
            name=name,
            gain=max(0.0, scored[name]),
            p_value=float(np.exp(-surprise(np.array([sure[name]]), found.by_chance[name])[0])),
            held_out_gain=gains[name] if np.isfinite(gains[name]) else None,
            held_out_se=standard_error(alone[name].gains) if name in alone else None,
            why=_why(name, alone.get(name), named, alike, evidence),
        )
        for name in sorted(gains, key=lambda name: -gains[name])
    )


def _why(name: str, one: Scored | None, named: set[str], alike: set[str], evidence: Evidence) -> str:
    if name in named:
        return "found"
    if name in alike:
        return "indistinguishable from the effect found"
    if one is None:
        return "cannot be simulated" if evidence.found.odd else "no larger gain than by chance"
    if not confirmed(evidence.found, one):
        return "not confirmed by held-out pushes"
    return _why_confirmed(name, named, evidence.decision.refuted)


def _why_confirmed(name: str, named: set[str], refuted: Scored | None) -> str:
    if refuted is not None and name in {kind.name for kind in kinds_of(refuted)}:
        return "held-out pushes are likelier with it, but not predicted better"
    if named or refuted is not None:
        return "smaller gain on held-out pushes"
    return "confirmed by held-out pushes, but more than noise remains"
