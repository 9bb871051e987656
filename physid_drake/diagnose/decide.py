"""The decision: from hypotheses that were fitted to what is said, by a few constants.

All comparisons are of pushes that were left out, and no push decides alone: the one that speaks most for a
hypothesis does not count for it. docs/diagnosis.md shows what each constant does on opened worlds.
"""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.search import Found, Weighed
from physid_drake.effects import Effect
from physid_drake.pushes.tracker_noise import TrackerNoise

Array = NDArray[np.float64]

CONFIRMED = 12.0  # nats: by which a hypothesis is better than the baseline, its best push not counted
MARGIN = 8.0  # nats: by which one is surely better than another, likewise
FEWEST_PUSHES = 3  # less cannot confirm anything on pushes that are left out
ADEQUATE = 1e-3  # p-value of what a hypothesis leaves: of the catalogue beside it, of the scatter of frictions
LITTLE = 0.02  # of the gain of a hypothesis: two honest implementations of one effect differ by a tenth of it or more
LOUD = 1.25  # times the noise: more is not noise
DOUBTS = 1.5  # times the doubt about the noise's variance: three deviations of its root


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Decision:
    """What is said.

    Attributes:
        verdict: ``consistent``, ``explained``, ``ambiguous`` or ``unexplained``; ``underpowered`` of few pushes.
        best: the hypothesis that explains the pushes; where none of the catalogue does, one without a name that
            predicts them better than the baseline. None where nothing is missing, or nothing helps.
        rivals: hypotheses that these pushes cannot tell from it, best first; each differs in one effect.
        partly: effects that take a part of what nothing explains away.
    """

    verdict: str
    best: Weighed | None = None
    rivals: tuple[Weighed, ...] = ()
    partly: Weighed | None = None

    @property
    def effects(self) -> tuple[type[Effect], ...]:
        """The best hypothesis's."""
        return () if self.best is None else kinds_of(self.best)

    def classes(self) -> tuple[tuple[str, ...], ...]:
        """Per effect, the names that may stand in its place."""
        mine = self.effects
        found: list[list[str]] = [[] for _ in mine]
        for rival in self.rivals:
            others = [kind for kind in kinds_of(rival) if kind not in mine]
            for k, kind in enumerate(mine):
                if kind not in kinds_of(rival) and others and others[0].name not in found[k]:
                    found[k].append(others[0].name)
        return tuple(map(tuple, found))


def loudest(noise: TrackerNoise) -> float:
    """Times the noise that errors may be and still be noise; of one that short rests told, a little more."""
    return LOUD * math.exp(DOUBTS * noise.doubt) if noise.known else math.inf


def decided(found: Found, *, most: float) -> Decision:
    """The verdict.

    Args:
        found: all hypotheses.
        most: times the noise that errors may be and still be noise.
    """
    if len(found.plain.pushes) < FEWEST_PUSHES:
        return Decision(verdict="underpowered")
    every = [*found.named, *found.unnamed]
    missing = found.odd and any(confirmed(one) for one in every)
    quiet = found.plain.loudness <= most and found.alike >= ADEQUATE
    if not missing and quiet:
        return Decision(verdict="consistent")
    nameless = next((one for one in found.unnamed if confirmed(one)), None)
    best = simplest(found.named)
    if best is None or not confirmed(best):
        return Decision(verdict="unexplained", best=nameless)
    beaten = any(surely_better(one.gains - best.gains) for one in found.unnamed)
    little = found.left >= ADEQUATE or found.left_gain < LITTLE * best.gain
    enough = little and best.fit.loudness <= most and best.alike >= ADEQUATE
    if beaten or not enough:
        return Decision(verdict="unexplained", best=nameless, partly=best)
    alike = tuple(one for one in found.named if _in_class(one, best))
    return Decision(verdict="ambiguous" if alike else "explained", best=best, rivals=alike)


def without_best(gains: Array) -> float:
    """Sum of gains (n,) over another hypothesis, without the largest [nats]."""
    return float(gains.sum() - gains.max())


def confirmed(one: Weighed) -> bool:
    """Whether pushes that were left out confirm that something is missing that a hypothesis has."""
    return without_best(one.gains) > CONFIRMED


def surely_better(gains: Array) -> bool:
    """Whether gains (n,) over another hypothesis do not rest on one push."""
    return without_best(gains) > MARGIN


def kinds_of(one: Weighed) -> tuple[type[Effect], ...]:
    """A hypothesis's effects."""
    return tuple(part.kind for part in one.fit.hypothesis.parts)


def simplest(named: Sequence[Weighed]) -> Weighed | None:
    """The hypothesis with the fewest effects, and then the fewest numbers, that the best one is not surely above."""
    if not named:
        return None
    close = [one for one in named if not surely_better(named[0].gains - one.gains)]
    fewest = min(len(kinds_of(one)) for one in close)
    few = [one for one in close if len(kinds_of(one)) == fewest]
    limits = [one for one in few if any(_is_limit(one, other) for other in few)]
    return (limits or few)[0]


def _is_limit(one: Weighed, other: Weighed) -> bool:
    """Whether a hypothesis is another one's in a limit: a tether far away is a tilt."""
    mine, its = set(kinds_of(one)), set(kinds_of(other))
    return any(k.name in o.limits for k in mine - its for o in its - mine) and len(mine - its) == 1


def _in_class(one: Weighed, best: Weighed) -> bool:
    """Whether pushes do not tell a hypothesis from the best, and it is not merely what that is a limit of."""
    mine, its = kinds_of(best), kinds_of(one)
    if one is best or len(its) != len(mine) or len(set(mine) - set(its)) != 1:
        return False
    return not surely_better(best.gains - one.gains) and not _is_limit(best, one)


def probability(decision: Decision, k: int) -> float:
    """That the name of effect k is right, among those of the catalogue: odds of the rivals from their deficits."""
    best = decision.best
    assert best is not None
    mine = kinds_of(best)[k]
    total = 1.0
    for rival in decision.rivals:
        if mine not in kinds_of(rival):
            total += math.exp(min(0.0, float(np.sum(rival.gains - best.gains))))
    return 1.0 / total
