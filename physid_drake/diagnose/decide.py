"""The decision: from fitted hypotheses to a verdict, by a few constants.

All comparisons use the gains of held-out pushes, without the largest of them, so that no push decides alone.
docs/method.md lists the constants; `benchmarks/decisions.py` shows what each of them changes.
"""

from __future__ import annotations

import dataclasses as dc
import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.search import Found, Scored
from physid_drake.effects import Effect
from physid_drake.identify import Accuracy
from physid_drake.inference.replicates import surprise, without_best
from physid_drake.pushes.tracker_noise import TrackerNoise

Array = NDArray[np.float64]

CONFIRMED = 1e-4  # probability of such a gain by chance, the largest push's not counted
MARGIN = 8.0  # nats: gain by which one is clearly better, the largest push's not counted
FEWEST_PUSHES = 3  # with fewer, held-out pushes confirm nothing
ADEQUATE = 0.01  # p-value of what a hypothesis leaves: of the catalogue beside it, of the scatter of frictions
LITTLE = 0.03  # of the gain of a hypothesis: two honest implementations of one effect differ by a tenth of it or more
MOST_NOISE_SCALE = 1.25  # times the noise: more is not noise
OWN_ERROR = (2e-4, 2e-3)  # m, rad: of held-out pushes, as large as the difference between two simulators
DOUBTS = 1.5  # times the std of the variance's logarithm: three standard deviations of the noise's


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Decision:
    """The verdict, with the hypotheses that it rests on.

    Attributes:
        verdict: ``consistent``, ``explained``, ``ambiguous``, ``unexplained`` or ``underpowered``.
        best: the hypothesis that explains the pushes. Where no effect of the catalogue does, a model with an unnamed
            force that predicts held-out pushes better than the baseline; None where there is none, or nothing is
            missing.
        rivals: hypotheses that these pushes cannot distinguish from it, best first; each differs in one effect.
        partly: where the verdict is ``unexplained``, effects that explain a part of the mismatch.
        refuted: a hypothesis with a higher likelihood of held-out pushes, whose predictions are no nearer; None where
            there is none.
    """

    verdict: str
    best: Scored | None = None
    rivals: tuple[Scored, ...] = ()
    partly: Scored | None = None
    refuted: Scored | None = None

    @property
    def effects(self) -> tuple[type[Effect], ...]:
        """Classes of the best hypothesis's effects."""
        return () if self.best is None else kinds_of(self.best)

    def classes(self) -> tuple[tuple[str, ...], ...]:
        """For each of these effects, names of the effects that rivals have in its place."""
        mine = self.effects
        found: list[list[str]] = [[] for _ in mine]
        for rival in self.rivals:
            others = [kind for kind in kinds_of(rival) if kind not in mine]
            for k, kind in enumerate(mine):
                if kind not in kinds_of(rival) and others and others[0].name not in found[k]:
                    found[k].append(others[0].name)
        return tuple(map(tuple, found))


def most_noise_scale(noise: TrackerNoise) -> float:
    """The largest noise scale [-] at which errors still count as noise.

    It is infinite where the noise is not known, and larger where short rests leave it uncertain.
    """
    return MOST_NOISE_SCALE * math.exp(DOUBTS * noise.doubt) if noise.known else math.inf


def decided(found: Found, *, most: float) -> Decision:
    """The verdict on fitted hypotheses.

    Args:
        found: all hypotheses.
        most: largest noise scale [-] at which errors count as noise (``most_noise_scale``).
    """
    if len(found.baseline.pushes) < FEWEST_PUSHES:
        return Decision(verdict="underpowered")
    every = [*found.named, *found.unnamed]
    missing = found.odd and any(confirmed(found, one) for one in every)
    if not missing and _is_noise(found, most):
        return _nothing_claimed(found, most)
    nameless = next((one for one in found.unnamed if confirmed(found, one)), None)
    best = simplest(found)
    if best is None:
        return Decision(verdict="unexplained", best=nameless)
    beaten = any(surely_better(one.gains - best.gains) for one in found.unnamed)
    little = found.left >= ADEQUATE or found.left_gain < LITTLE * best.gain
    enough = little and best.fit.noise_scale <= most and best.alike >= ADEQUATE
    if beaten or not enough:
        return Decision(verdict="unexplained", best=nameless, partly=best)
    alike = tuple(one for one in found.named if _in_class(one, best))
    return Decision(verdict="ambiguous" if alike else "explained", best=best, rivals=alike)


def refuted(found: Found, decision: Decision, *, most: float, partly: bool) -> Decision:
    """The decision where the best hypothesis raises the likelihood of held-out pushes, but predicts them no nearer.

    Args:
        found: all hypotheses.
        decision: of ``decided``.
        most: largest noise scale [-] at which errors count as noise.
        partly: whether the effects that explain a part of the mismatch predict held-out pushes nearer.
    """
    if partly:
        return dc.replace(decision, best=None, refuted=decision.best)
    return dc.replace(_nothing_claimed(found, most), refuted=decision.best)


def _is_noise(found: Found, most: float) -> bool:
    """Whether what the baseline leaves is noise, and frictions differ by no more than those of surfaces do."""
    return found.baseline.noise_scale <= most and found.alike >= ADEQUATE


def _nothing_claimed(found: Found, most: float) -> Decision:
    """What is said where no hypothesis is confirmed."""
    if not _is_noise(found, most):
        return Decision(verdict="unexplained")
    # The p-value is below what was asked for, but held-out pushes confirm no effect.
    return Decision(verdict="underpowered" if found.rare else "consistent")


def is_own_error(left_out: Accuracy) -> bool:
    """Whether held-out errors are no larger than the difference between two simulators: no missing physics."""
    # A yaw that was not measured is left out of it.
    return left_out.position < OWN_ERROR[0] and not left_out.rotation >= OWN_ERROR[1]


def confirmed(found: Found, one: Scored, beside: Scored | None = None) -> bool:
    """Whether held-out pushes confirm a hypothesis.

    Its gain must be one that the same effect has by chance with a probability below ``CONFIRMED``. The gain of a
    model with an unnamed force is compared with the effect that gains most by chance. Two effects gain more by chance
    than one: of a pair, one effect alone has to be confirmed as well.

    Args:
        found: all hypotheses, with the distribution of gains by chance.
        one: the hypothesis in question.
        beside: what it is compared with; None for the baseline.
    """
    if beside is None and len(kinds_of(one)) > 1:
        alone = [
            single for single in found.named if len(kinds_of(single)) == 1 and kinds_of(single)[0] in kinds_of(one)
        ]
        if not any(confirmed(found, single) for single in alone):
            return False
    gained = without_best(one.gains if beside is None else one.gains - beside.gains)[None]
    present = () if beside is None else kinds_of(beside)
    names = [kind.name for kind in kinds_of(one) if kind not in present and kind.name in found.by_chance]
    least = min(float(surprise(gained, found.by_chance[name])[0]) for name in names or found.by_chance)
    return least > -math.log(CONFIRMED)


def surely_better(gains: Array) -> bool:
    """Whether gains (n,) of pushes sum to more than ``MARGIN``, the largest not counted."""
    return bool(without_best(gains) > MARGIN)


def kinds_of(one: Scored) -> tuple[type[Effect], ...]:
    """Classes of a hypothesis's effects."""
    return tuple(part.kind for part in one.fit.hypothesis.parts)


def simplest(found: Found) -> Scored | None:
    """The hypothesis to report: of those that the best one is not clearly better than, one with the fewest effects.

    All must be confirmed. A hypothesis with more effects is clearly better only if they are confirmed and their gain
    is not small. Among those left, one whose effect is a limit of another's is preferred: a tilt to a tether with a
    far anchor. None where no hypothesis is confirmed.
    """
    named = [one for one in found.named if confirmed(found, one)]
    if not named:
        return None
    best = named[0]
    close = [one for one in named if not _worth(found, best, one)]
    fewest = min(len(kinds_of(one)) for one in close)
    few = [one for one in close if len(kinds_of(one)) == fewest]
    limits = [one for one in few if any(_is_limit(one, other) for other in few)]
    return (limits or few)[0]


def _worth(found: Found, best: Scored, other: Scored) -> bool:
    """Whether a hypothesis is surely better than another; an effect more has to be confirmed, and no little one."""
    if len(kinds_of(best)) > len(kinds_of(other)):
        return confirmed(found, best, other) and best.gain - other.gain > LITTLE * other.gain
    return surely_better(best.gains - other.gains)


def _is_limit(one: Scored, other: Scored) -> bool:
    """Whether a hypothesis is another one's in a limit: a tether far away is a tilt."""
    mine, its = set(kinds_of(one)), set(kinds_of(other))
    return any(k.name in o.limits for k in mine - its for o in its - mine) and len(mine - its) == 1


def _in_class(one: Scored, best: Scored) -> bool:
    """Whether pushes do not tell a hypothesis from the best, and it is not merely what that is a limit of."""
    mine, its = kinds_of(best), kinds_of(one)
    if one is best or len(its) != len(mine) or len(set(mine) - set(its)) != 1:
        return False
    return not surely_better(best.gains - one.gains) and not _is_limit(best, one)


def probability(decision: Decision, k: int) -> float:
    """Probability that the name of effect ``k`` is right, if the effect is in the catalogue.

    Each rival without that effect has odds of exp(its gain - the best gain), at most 1.
    """
    best = decision.best
    assert best is not None
    mine = kinds_of(best)[k]
    total = 1.0
    for rival in decision.rivals:
        if mine not in kinds_of(rival):
            total += math.exp(min(0.0, float(np.sum(rival.gains - best.gains))))
    return 1.0 / total
