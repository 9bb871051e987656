"""Proposals: hypotheses with starts for their fits, from score tests and from small effects."""

from __future__ import annotations

import dataclasses as dc
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects import Effect, Surroundings
from physid_drake.inference.fit import Fit
from physid_drake.inference.hypothesis import Hypothesis, Part
from physid_drake.inference.scores import Score

Array = NDArray[np.float64]

STARTS = 4  # of an effect, from its best score tests
NUDGES = (4.0, 16.0)  # steps from the null: starts where score tests lead nowhere
MOST_THETA_MOVE = 0.25  # of the unit cube


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Proposal:
    """A hypothesis, and z (n,) where its fit starts."""

    hypothesis: Hypothesis
    z: Array


def with_part(base: Hypothesis, kind: type[Effect], point: Array) -> Hypothesis:
    """The hypothesis with one more effect, whose coordinates have the prior mean ``point`` (k,) in its chart."""
    part = Part(kind=kind, point=tuple(point.tolist()), free=kind.leading(base.around))
    return dc.replace(base, parts=(*base.parts, part))


def proposals(fit: Fit, scores: Sequence[Score]) -> list[Proposal]:
    """Starts of fits with one more effect: where score tests lead, and small effects in the same direction.

    Args:
        fit: the model to which effects are added.
        scores: of families of effects, best first.
    """
    made, times = [], Counter[str]()
    for score in scores:
        if times[score.kind.name] < STARTS:
            times[score.kind.name] += 1
            made.append(_proposal(fit, score.kind, score.point, score.dz))
            if times[score.kind.name] == 1:
                made += [_proposal(fit, score.kind, point) for point in _nudged(score, fit.hypothesis.around)]
    return made


def _proposal(fit: Fit, kind: type[Effect], point: Array, dz: Array | None = None) -> Proposal:
    hypothesis = with_part(fit.hypothesis, kind, point)
    z, n = fit.point.z.copy(), fit.hypothesis.simulated
    if dz is not None:
        reach = np.full(len(z), np.inf)
        reach[: fit.hypothesis.space.dimension] = MOST_THETA_MOVE
        z = np.clip(z + np.clip(dz, -reach, reach), *fit.hypothesis.bounds)
    added = [point[j] for j in hypothesis.parts[-1].free]
    return Proposal(hypothesis=hypothesis, z=np.concatenate([z[:n], added, z[n:]]))


def _nudged(score: Score, around: Surroundings) -> list[Array]:
    """Points of the chart a few steps from the null of the best family, the way that its score test leads."""
    chart, points = score.kind.chart(around), []
    for size in NUDGES:
        point = np.array(score.family.point)
        for j in score.family.free:
            way = float(np.sign(score.point[j] - point[j])) or 1.0
            point[j] = np.clip(point[j] + way * size * chart[j].step, chart[j].lower, chart[j].upper)
        points.append(point)
    return points
