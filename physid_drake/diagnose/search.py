"""All hypotheses about a recording, fitted on the twin."""

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
from physid_drake.inference.replicates import gains_by_chance, of_all, p_value
from physid_drake.inference.scores import Column, columns
from physid_drake.progress import Progress
from physid_drake.pushes.case import UNIT_SCATTER

Array = NDArray[np.float64]

SCATTER = MOST_SCATTER / UNIT_SCATTER
ODD_SCATTER = 0.5 * SCATTER  # of a model beside which more is looked for: what orders frictions looks like scatter
POLISHINGS = 4  # of a best hypothesis, at most
SINGLES = 4  # effects, beside each of which a second one is looked for


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Scored:
    """A fitted hypothesis, with its gains on held-out pushes.

    Attributes:
        fit: with the highest likelihood that was found.
        gains: (n,) log predictive density of each held-out push, less that of the baseline [log likelihood].
        alike: p-value of the hypothesis that frictions of the pushes differ by no more than usual.
    """

    fit: Fit
    gains: Array
    alike: float

    @property
    def name(self) -> str:
        """Names of the hypothesis's effects."""
        return self.fit.hypothesis.name

    @property
    def gain(self) -> float:
        """Sum of the gains [log likelihood]."""
        return float(self.gains.sum())


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """All that was fitted.

    Attributes:
        fitter: of all fits.
        baseline: the fit without effects, with the errors that all pushes may share.
        alike: of the baseline, as in ``Scored``.
        columns: of the catalogue's effects at the baseline.
        linearly: by an effect's name, its linearised gain on held-out pushes without the largest [log likelihood].
        p_value: of the best of these gains.
        by_chance: by an effect's name, the same gains (r,) in replicates of the recording without any effect.
        rare: whether the p-value is below the false-alarm rate that was asked for.
        odd: whether that is so, or the scatter of friction is large.
        named: hypotheses with effects of the catalogue, best first; empty where none were fitted.
        left: p-value of the catalogue's best gain beside the first of them; 1 where this was not looked at.
        left_gain: that gain, linearised [log likelihood].
        unnamed: models with an unnamed force, best first.
    """

    fitter: Fitter
    baseline: Fit
    alike: float
    columns: tuple[Column, ...]
    linearly: dict[str, float]
    p_value: float
    by_chance: dict[str, Array]
    rare: bool
    odd: bool
    named: tuple[Scored, ...] = ()
    left: float = 1.0
    left_gain: float = 0.0
    unnamed: tuple[Scored, ...] = ()

    @property
    def richest(self) -> Fit:
        """The fit with the highest likelihood."""
        return max(
            [self.baseline, *(one.fit for one in (*self.named, *self.unnamed))], key=lambda fit: fit.log_likelihood
        )


def searched(
    fitter: Fitter, plain: Fit, kinds: Sequence[type[Effect]], *, seed: int, alpha: float, progress: Progress
) -> Found:
    """Fit single effects, pairs of effects where one does not suffice, and unnamed forces.

    Args:
        fitter: of the recording.
        plain: the baseline model's fit.
        kinds: effects that can be in the recording.
        seed: random seed.
        alpha: false-alarm rate; a p-value below it claims a mismatch.
        progress: called with the stage, steps done and steps in all.
    """
    search = _Search(fitter, plain, kinds, np.random.default_rng(seed), alpha)
    progress("test for missing physics", 0, 0)
    found = search.begun()
    if found.odd or plain.noise_scale > 1.0:
        progress("single effects", 0, 0)
        found = search.with_singles(found)
    if not found.odd or not found.named:
        return found
    found = search.with_left(found)
    if found.left < alpha or found.named[0].fit.scatter > ODD_SCATTER:
        progress("pairs of effects", 0, 0)
        found = search.with_pairs(found)
    progress("unnamed force", 0, 0)
    return dc.replace(found, unnamed=search.ranked(unnamed(fitter, plain)))


class _Search:
    """Hypotheses beside a baseline."""

    def __init__(
        self, fitter: Fitter, plain: Fit, kinds: Sequence[type[Effect]], rng: np.random.Generator, alpha: float
    ) -> None:
        self._fitter, self._plain, self._kinds, self._rng, self._alpha = fitter, plain, kinds, rng, alpha
        self._before = fitter.held_out(plain)
        self._polished_fits: list[Fit] = []

    def begun(self) -> Found:
        """The baseline, and what is said of it by columns alone."""
        fitter, plain = self._fitter, self._plain
        found = columns(fitter, plain, self._kinds)
        seen, by_chance = gains_by_chance(fitter, plain, found, self._rng)
        p = p_value(seen, by_chance)
        return Found(
            fitter=fitter, baseline=plain,
            alike=_alike(fitter, plain), columns=tuple(found), linearly=seen, p_value=p,
            by_chance=by_chance, rare=p < self._alpha, odd=p < self._alpha or plain.scatter > ODD_SCATTER,
        )  # fmt: skip

    def with_singles(self, found: Found) -> Found:
        """Each effect alone, the best one polished where something is odd."""
        fits = with_one_more(self._fitter, self._plain, found.columns)
        return dc.replace(found, named=self._with_best_polished(fits) if found.odd else self.ranked(fits))

    def with_pairs(self, found: Found) -> Found:
        """The best effects, each with others beside it; and both effects of the best pair alone."""
        singles = [one.fit for one in found.named]
        pairs = [one.fit for one in self.ranked(with_two(self._fitter, singles[:SINGLES], self._kinds))]
        pairs[:1] = map(self._polished, pairs[:1])
        alone = each_alone(self._fitter, pairs[0]) if pairs else ()
        return self.with_left(dc.replace(found, named=self._with_best_polished([*better_of(singles, alone), *pairs])))

    def with_left(self, found: Found) -> Found:
        """Whether the best gain of the catalogue beside the best hypothesis is chance, and that gain."""
        fit = found.named[0].fit
        present = {part.kind for part in fit.hypothesis.parts}
        beside = columns(self._fitter, fit, [kind for kind in self._kinds if kind not in present])
        if not beside:
            return dc.replace(found, left=1.0, left_gain=0.0)
        seen, by_chance = gains_by_chance(self._fitter, fit, beside, self._rng, of_all)
        return dc.replace(found, left=p_value(seen, by_chance), left_gain=max(seen.values()))

    def ranked(self, fits: Sequence[Fit]) -> tuple[Scored, ...]:
        """The fits with what each gains over the baseline, best first."""
        made = [
            Scored(fit=fit, gains=self._fitter.held_out(fit) - self._before, alike=_alike(self._fitter, fit))
            for fit in fits
        ]
        return tuple(sorted(made, key=lambda one: -one.gain))

    def _with_best_polished(self, fits: Sequence[Fit]) -> tuple[Scored, ...]:
        """Ranked, when the best one is polished: it may not have been the best before."""
        ranked = self.ranked(fits)
        for _ in range(POLISHINGS):
            if not ranked or any(ranked[0].fit is fit for fit in self._polished_fits):
                break
            ranked = self.ranked([self._polished(ranked[0].fit), *(one.fit for one in ranked[1:])])
        return ranked

    def _polished(self, fit: Fit) -> Fit:
        self._polished_fits.append(settled(self._fitter, freed(self._fitter, fit), self._rng))
        return self._polished_fits[-1]


def better_of(fits: Sequence[Fit], others: Sequence[Fit]) -> list[Fit]:
    """The fits, each replaced by the other fit of the same hypothesis if that has a higher likelihood."""
    likelier = {one.hypothesis.name: one for one in others}
    return [
        max(fit, likelier.get(fit.hypothesis.name, fit), key=lambda one: one.log_likelihood) for fit in fits
    ]  # fmt: skip


def _alike(fitter: Fitter, fit: Fit) -> float:
    """By a chi-square of the frictions' squares, the largest not counted: what is odd of one push is no physics."""
    squares = np.sort((fitter.frictions(fit) / SCATTER) ** 2)[:-1]
    return float(stats.chi2.sf(squares.sum(), len(squares)))
