"""Foils: laws that the catalogue does not have, tried in the place of what was found.

Pushes that were left out tell effects apart that look alike. What is not in the catalogue is no candidate there, and
its nearest neighbour gets the name. Where a foil predicts such pushes better, that name is wrong.
"""

from __future__ import annotations

import dataclasses as dc

from physid_drake.diagnose.candidate import SCORE_ERROR, push_scores
from physid_drake.diagnose.confirm import fit_with
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.screen import best_family, score, signatures
from physid_drake.effects.foils import FOILS
from physid_drake.progress import Progress

PROMISES = 0.5  # of what the effect gained: a foil whose score tests promise less is not fitted


@dc.dataclass(frozen=True, kw_only=True)
class Foil:
    """A law beside the catalogue that does better than an effect that was found.

    Attributes:
        statement: what it says.
        instead_of: name of the effect.
        gain: nats of held-out log predictive density over the model with the effect.
    """

    statement: str
    instead_of: str
    gain: float


def better_foil(fitter: Fitter, without: Fitted, model: Fitted, name: str, tick: Progress) -> Foil | None:
    """The foil that predicts left-out pushes better than an effect of a model, beside the model's other effects.

    Args:
        fitter: that of both models.
        without: the model without the effect.
        model: with it.
        name: the effect's.
        tick: told the stage.
    """
    kinds = [kind for kind in FOILS if kind.applies(fitter.case.around)]
    found = signatures(fitter, without, kinds)
    for kind in kinds:
        best = best_family([score(without, one) for one in found if one.kind is kind])
        if best.gain < PROMISES * 2.0 * (model.score - without.score):
            continue
        tick(f"a law beside the catalogue in place of {name}", 0, 0)
        gain = float((push_scores(fit_with(fitter, without, best)) - push_scores(model)).sum())
        if gain > SCORE_ERROR:
            return Foil(statement=kind.statement, instead_of=name, gain=gain)
    return None
