"""An effect in the model, fitted: whether pushes that were left out confirm it, and what is as good."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.linear import left_out_scores
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.screen import Score

Array = NDArray[np.float64]

SURE = 2.0  # standard errors
LEAST = 4.0  # nats of held-out gain
CERTAIN = 40.0  # nats of held-out gain, the best push not counted
UNLIKELY = 0.05  # of the signed-rank test of held-out gains
BOUND = 10.0  # nats: no push counts more, for or against
SCORE_ERROR = 2.0  # nats: of a difference of gains, beside its standard error
EXPLAINED = 1.5  # cost per degree of freedom above which something is still missing
A_COORDINATE = 2.0  # nats of held-out gain that one more coordinate must be worth
A_LAW = 0.01  # of the gain: two honest implementations of one effect differ by more
FAR_OFF = 3.0  # cost per degree of freedom from which the pushes' unknowns would imitate what is missing


@dc.dataclass(frozen=True, kw_only=True)
class Candidate:
    """One effect in the model, fitted.

    Attributes:
        score: its score test.
        fitted: the model with it.
        gains: (n,) log predictive density of each push, left out, over that without the effect.
        degenerate: whether an amplitude ran to its null, so that it is another effect or none.
        coordinates: how many numbers of the effect were fitted.
    """

    score: Score
    fitted: Fitted
    gains: Array
    degenerate: bool
    coordinates: int = 1

    @property
    def name(self) -> str:
        """The effect's."""
        return self.score.kind.name

    @property
    def gain(self) -> float:
        """Total."""
        return float(self.gains.sum())

    @property
    def standard_error(self) -> float:
        """Of the total."""
        return standard_error(self.gains)

    @property
    def accepted(self) -> bool:
        """Whether held-out pushes confirm the effect.

        Either most of them do, or, for what only a few pushes feel (a patch, a magnet), more than one does far beyond
        what the simulator's own error explains. Pushes differ in what they feel of an effect, so that the sum of
        their gains is as unsure as the largest of them; gains are bounded before they are compared with their spread.

        Or their frictions follow what the effect does to them beyond chance. Whole pushes' frictions differ anyway:
        an effect that orders them makes the first and last pushes likelier by far and those between hardly, so that
        gains spread as widely as they are large.
        """
        if self.degenerate or self.gain < LEAST:
            return False
        if self.score.in_order:
            return True
        bounded = np.clip(self.gains, -BOUND, BOUND)
        some = np.sort(self.gains)[:-1]
        local = some.sum() > CERTAIN and (self.gains > CERTAIN / 4.0).sum() >= 2
        return bool((bounded.sum() > SURE * standard_error(bounded) and self._most_gain()) or local)

    def _most_gain(self) -> bool:
        """Whether gains outweigh losses in number and size; one large gain does not make an effect."""
        return len(self.gains) < 5 or float(stats.wilcoxon(self.gains, alternative="greater").pvalue) < UNLIKELY


def standard_error(values: Array) -> float:
    """Of the sum of values (n,) over pushes; infinite for one push."""
    return float(np.std(values, ddof=1) * np.sqrt(len(values))) if len(values) > 1 else np.inf


def push_scores(fitted: Fitted, folds: Sequence[Sequence[int]] | None = None) -> Array:
    """Log predictive density (n,) of each push, fitted without it; each bears its part of the tolerances' use.

    Args:
        fitted: the model.
        folds: indices of pushes that are left out together; None leaves out one at a time.

    A model may claim that all pushes share an error of the simulator or of a caliper. The others then predict the
    push that is left out with that very error, at no cost: a centre of mass off by ten tolerances would be predicted
    as well as by the effect.
    """
    scores, _ = left_out_scores(
        fitted.pushes, fitted.state.scatter, fitted.prior_mean, fitted.prior_std, folds, fitted.bounds
    )
    return scores - fitted.tolerance_cost / len(scores)


def rejudged(candidates: Sequence[Candidate], plain: Fitted) -> tuple[Candidate, ...]:
    """The candidates with their gains over another model."""
    before = push_scores(plain)
    return tuple(ranked([dc.replace(c, gains=push_scores(c.fitted) - before) for c in candidates]))


def ranked(candidates: Sequence[Candidate]) -> list[Candidate]:
    """Best held-out gain first; before it the simplest that does as well: a far-off spring is a tilted table."""
    ordered = sorted(candidates, key=lambda c: (c.degenerate, -c.gain))
    if not ordered:
        return []
    best = ordered[0]
    as_good = [c for c in ordered if c is best or (c.accepted and _does_as_well(c, best))]
    first = min(as_good, key=lambda c: c.coordinates)
    return [first, *(c for c in ordered if c is not first)]


def _does_as_well(simple: Candidate, best: Candidate) -> bool:
    spared = best.coordinates - simple.coordinates
    return spared > 0 and best.gain - simple.gain < A_COORDINATE * spared + A_LAW * best.gain


def rivals(best: Candidate, others: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Accepted candidates whose held-out gain is not surely below the best one's."""
    close = []
    for other in others:
        if other is best or not other.accepted or out_of_question(best, other):
            continue
        if not surely_better(best, other, SURE):
            close.append(other)
    return tuple(close)


def out_of_question(best: Candidate, other: Candidate) -> bool:
    """Whether a candidate ran to nothing, or leaves pushes far from explained that the best one explains.

    One push in which an effect shows a hundredfold makes the difference of two gains unsure, and yet tells them
    apart.
    """
    explains = best.fitted.reduced_chi2 <= EXPLAINED
    return other.degenerate or (explains and other.fitted.reduced_chi2 > FAR_OFF)


def surely_better(best: Candidate, other: Candidate, errors: float) -> bool:
    """Whether a candidate gains more than another by so many standard errors, the scores' own error included."""
    difference = best.gains - other.gains
    return float(difference.sum()) >= errors * spread(difference)


def spread(difference: Array) -> float:
    """Standard error of the sum of differences (n,) of two candidates' gains; few pushes do not make sure."""
    return float(np.hypot(standard_error(difference), SCORE_ERROR))
