"""All hypotheses about a recording, fitted on the twin: what a decision rests on."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.diagnose.hypotheses import each_alone, freed, unnamed, with_one_more, with_two
from physid_drake.effects import Effect
from physid_drake.identify.baseline import settled
from physid_drake.identify.identify import MOST_SCATTER
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.replicates import gains_by_chance, p_value
from physid_drake.inference.scores import Column, columns
from physid_drake.progress import Progress
from physid_drake.pushes.case import UNIT_SCATTER

Array = NDArray[np.float64]

SCATTER = MOST_SCATTER / UNIT_SCATTER
ODD_SCATTER = 0.5 * SCATTER  # of a model beside which more is looked for: what orders frictions looks like scatter
SINGLES = 4  # effects, beside each of which a second one is looked for


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Weighed:
    """A fitted hypothesis and how likely it makes pushes that were left out.

    Attributes:
        fit: at its best.
        alike: p-value of "the pushes' own frictions differ by no more than those of surfaces do".
        gains: (n,) log predictive density of each push, given the others, over that of the baseline [nats].
    """

    fit: Fit
    gains: Array
    alike: float

    @property
    def name(self) -> str:
        """Of the hypothesis."""
        return self.fit.hypothesis.name

    @property
    def gain(self) -> float:
        """Of all pushes [nats]."""
        return float(self.gains.sum())


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """What was fitted.

    Attributes:
        fitter: that did it.
        plain: the baseline, with tolerances.
        alike: of the baseline, as of ``Weighed``.
        columns: of the catalogue beside it.
        linearly: what each effect gains by these columns, its best push not counted, by its name [nats].
        p_value: that the best gain of the catalogue over the baseline is chance.
        by_chance: (r,) the same in replicates of this recording in which the baseline is true, by name.
        odd: whether the p-value is below what was asked for, or friction scatters by much.
        named: hypotheses of the catalogue, best first; empty where none was looked for.
        left: that the best gain of the catalogue over the first of them is chance; 1 where none was looked for.
        left_gain: that gain, linearly, its best push not counted [nats].
        unnamed: hypotheses of smooth forces and frictions without a name, best first.
    """

    fitter: Fitter
    plain: Fit
    alike: float
    columns: tuple[Column, ...]
    linearly: dict[str, float]
    p_value: float
    by_chance: dict[str, Array]
    odd: bool
    named: tuple[Weighed, ...]
    left: float
    left_gain: float
    unnamed: tuple[Weighed, ...]

    @property
    def richest(self) -> Fit:
        """The likeliest fit of all that was looked at."""
        return max(
            [self.plain, *(one.fit for one in (*self.named, *self.unnamed))], key=lambda fit: fit.log_likelihood
        )


def searched(
    fitter: Fitter, plain: Fit, kinds: Sequence[type[Effect]], *, seed: int, alpha: float, tick: Progress
) -> Found:
    """Fit effects, pairs of them where one leaves something, and physics without a name.

    Args:
        fitter: of the recording.
        plain: the baseline.
        kinds: of effects that may be in it.
        seed: of all that is drawn.
        alpha: a p-value below which something is missing.
        tick: told the stage.
    """
    rng = np.random.default_rng(seed)

    def polished(fit: Fit) -> Fit:
        return settled(fitter, freed(fitter, fit), rng)

    tick("is anything missing?", 0, 0)
    found = columns(fitter, plain, kinds)
    seen, by_chance = gains_by_chance(fitter, plain, found, rng)
    p = p_value(seen, by_chance)
    before = fitter.held_out(plain)

    def ranked(fits: Sequence[Fit]) -> tuple[Weighed, ...]:
        made = [Weighed(fit=fit, gains=fitter.held_out(fit) - before, alike=_alike(fitter, fit)) for fit in fits]
        return tuple(sorted(made, key=lambda one: -one.gain))

    named, left, without = tuple[Weighed, ...](), (1.0, 0.0), tuple[Weighed, ...]()
    odd = p < alpha or plain.scatter > ODD_SCATTER
    if odd or plain.loudness > 1.0:
        tick("effects, one at a time", 0, 0)
        named = ranked(with_one_more(fitter, plain, found))
    if odd and named:
        named = ranked([polished(named[0].fit), *(one.fit for one in named[1:])])
        left = _left(fitter, named[0].fit, kinds, rng)
        if left[0] < alpha or named[0].fit.scatter > ODD_SCATTER:
            tick("pairs of effects", 0, 0)
            singles = [one.fit for one in named]
            pairs = [one.fit for one in ranked(with_two(fitter, singles[:SINGLES], kinds))]
            pairs[:1] = map(polished, pairs[:1])
            named = ranked([*better_of(singles, each_alone(fitter, pairs[0]) if pairs else ()), *pairs])
            left = _left(fitter, named[0].fit, kinds, rng)
        tick("physics without a name", 0, 0)
        without = ranked(unnamed(fitter, plain))
    return Found(
        fitter=fitter, plain=plain, alike=_alike(fitter, plain), columns=tuple(found), linearly=seen, p_value=p,
        by_chance=by_chance, odd=odd, named=named, left=left[0], left_gain=left[1], unnamed=without,
    )  # fmt: skip


def better_of(fits: Sequence[Fit], others: Sequence[Fit]) -> list[Fit]:
    """The fits, but of hypotheses that others have fitted likelier theirs."""
    likelier = {one.hypothesis.name: one for one in others}
    return [
        max(fit, likelier.get(fit.hypothesis.name, fit), key=lambda one: one.log_likelihood) for fit in fits
    ]  # fmt: skip


def _alike(fitter: Fitter, fit: Fit) -> float:
    """By a chi-square of the frictions' squares, the largest not counted: what is odd of one push is no physics."""
    squares = np.sort((fitter.frictions(fit) / SCATTER) ** 2)[:-1]
    return float(stats.chi2.sf(squares.sum(), len(squares)))


def _left(fitter: Fitter, fit: Fit, kinds: Sequence[type[Effect]], rng: np.random.Generator) -> tuple[float, float]:
    """That the best gain of the catalogue beside a hypothesis is chance, and that gain."""
    present = {part.kind for part in fit.hypothesis.parts}
    beside = columns(fitter, fit, [kind for kind in kinds if kind not in present])
    if not beside:
        return 1.0, 0.0
    seen, by_chance = gains_by_chance(fitter, fit, beside, rng)
    return p_value(seen, by_chance), max(seen.values())
