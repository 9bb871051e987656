"""Two effects at once, where none alone takes a good part of the mismatch away.

Each of two strong effects, fitted alone, bends towards what the other one does, ends far from where it belongs and
explains little. So pairs are ranked by score tests in which both may move, and the best few are fitted together.
"""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.candidate import A_COORDINATE, A_LAW, Candidate, push_scores
from physid_drake.diagnose.confirm import candidate_of
from physid_drake.diagnose.evidence import unexplained
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.linear import Whitened, best_scatter, solve
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.screen import Score, extended
from physid_drake.diagnose.starts import scanned_start, start_of
from physid_drake.progress import Progress

Array = NDArray[np.float64]
Pair = tuple[Score, Score]

AMONG = 6  # effects, by their own score tests
FITTED = 3  # pairs
ROUNDS, CAREFUL = 6, 3  # of a fit; in the first of them the pushes' unknowns are held
EXPECTED = 1.0  # cost per degree of freedom that the right pair leaves
PROMISING = 0.5  # of the plain cell's cost beyond that: a pair that leaves more by then explains nothing in the end


@dc.dataclass(frozen=True, kw_only=True)
class FittedPair:
    """A model with two effects.

    Attributes:
        pair: their score tests, in the order in which they are in the model.
        fitted: the model.
        candidates: of each effect, what it adds to the model with the other one alone.
        alone: per effect (n,), the scores of the pushes by the model that has it and not the other one.
    """

    pair: Pair
    fitted: Fitted
    candidates: tuple[Candidate, Candidate]
    alone: tuple[Array, Array]

    @property
    def gain(self) -> float:
        """Log predictive density of pushes left out."""
        return float(push_scores(self.fitted).sum())

    @property
    def coordinates(self) -> int:
        """How many numbers of both effects were fitted."""
        return sum(c.coordinates for c in self.candidates)


def confirmed_pairs(
    fitter: Fitter, plain: Fitted, scores: Sequence[Score], tick: Progress, *, most: int
) -> list[FittedPair]:
    """Pairs that explain the pushes, each effect confirmed beside the other one; the one to take is first.

    Args:
        fitter: fits.
        plain: the model without effects.
        scores: of the catalogue.
        tick: told which pair is fitted.
        most: rollouts of the pool after which no further pair is fitted.
    """
    if plain.reduced_chi2 <= EXPECTED:
        return []  # no pair can promise anything
    found: list[FittedPair] = []
    for k, pair in enumerate(promising(plain, scores)):
        if fitter.case.pool.count > most:
            break
        tick(f"fit with {pair[0].kind.name} and {pair[1].kind.name}", k, FITTED)
        model = _model_with(fitter, plain, pair)
        if model is not None and not unexplained(plain, model):
            fitted = _judged(fitter, pair, model)
            if all(c.accepted for c in fitted.candidates):
                found.append(fitted)
    if not found:
        return []
    best = max(found, key=lambda one: one.gain)
    explained = best.gain - float(push_scores(plain).sum())
    as_good = [
        one
        for one in found
        if best.gain - one.gain <= A_COORDINATE * max(0, best.coordinates - one.coordinates) + A_LAW * explained
    ]
    first = min(as_good, key=lambda one: (one.coordinates, -one.gain))
    return [first, *(one for one in found if one is not first)]


def steps_of(pairs: Sequence[FittedPair]) -> tuple[tuple[Candidate, ...], ...]:
    """One step per effect of the first pair; its rivals are those that stand in for it in another pair."""
    first, others = pairs[0], pairs[1:]
    steps = []
    for j in (0, 1):
        rivals = [_stand_in(first, other, j) for other in others]
        steps.append((first.candidates[j], *(r for r in rivals if r is not None)))
    return tuple(steps)


def _stand_in(first: FittedPair, other: FittedPair, j: int) -> Candidate | None:
    """The effect that takes the place of the j-th beside the same second one in another pair, if there is one."""
    partner = first.pair[1 - j].kind
    for k in (0, 1):
        if other.pair[1 - k].kind is partner:
            gains = push_scores(other.fitted) - first.alone[1 - j]
            return dc.replace(other.candidates[k], gains=gains)
    return None


def promising(plain: Fitted, scores: Sequence[Score]) -> list[Pair]:
    """Pairs by what both together explain for their number of coordinates, each score beside the other's."""
    best = sorted((s for s in scores if s.kept), key=lambda s: -s.gain)[:AMONG]
    found = [_together(plain, pair) for pair in combinations(best, 2)]
    ranked = sorted((f for f in found if f is not None), key=lambda f: -f[0])
    return [pair for _, pair in ranked[:FITTED]]


def _together(plain: Fitted, pair: Pair) -> tuple[float, Pair] | None:
    """The log likelihood with both effects, linearised; None where one would act the other way round."""
    columns = [
        np.column_stack([one.signature.columns[i][:, list(one.kept)] for one in pair])
        for i in range(len(plain.pushes))
    ]
    stds = np.concatenate([np.array(one.signature.stds)[list(one.kept)] for one in pair])
    pushes = extended(plain.pushes, columns)
    mean, std = np.append(plain.prior_mean, np.zeros(len(stds))), np.append(plain.prior_std, stds)
    scatter, value = best_scatter(pushes, mean, std, bounds=plain.bounds)
    beta = solve(Whitened.of(pushes, scatter), mean, std, plain.bounds).beta[len(plain.prior_mean) :]
    parts = np.split(beta, [len(pair[0].kept)])
    if any(_backwards(one, part.tolist()) for one, part in zip(pair, parts, strict=True)):
        return None
    first, second = (_with_coefficients(one, part.tolist()) for one, part in zip(pair, parts, strict=True))
    return value - A_COORDINATE * len(stds), (first, second)


def _backwards(one: Score, coefficients: Sequence[float]) -> bool:
    return any(one.signature.one_sided[k] and c < 0.0 for k, c in zip(one.kept, coefficients, strict=True))


def _with_coefficients(one: Score, coefficients: Sequence[float]) -> Score:
    every = np.zeros(one.signature.steps)
    every[list(one.kept)] = coefficients
    return dc.replace(one, coefficients=every)


def _model_with(fitter: Fitter, plain: Fitted, pair: Pair) -> Fitted | None:
    """The model with a pair, fitted from the best of two scans; None where it does not lead anywhere."""
    first, *_ = scanned_start(fitter, plain, pair[0], (start_of(fitter, pair[1]),))
    second, *_ = scanned_start(fitter, plain, pair[1], (first,))
    start = fitter.start(plain.state.u, (first, second))
    model = fitter.fit(start, rounds=CAREFUL, careful=CAREFUL, renew=True)
    if model.reduced_chi2 > EXPECTED + PROMISING * (plain.reduced_chi2 - EXPECTED):
        return None
    return fitter.fit(model.state, rounds=ROUNDS - CAREFUL, like=model, renew=True)


def _judged(fitter: Fitter, pair: Pair, model: Fitted) -> FittedPair:
    """A fitted pair, each of its effects judged beside the other one."""
    alone = tuple(_alone(fitter, model, j) for j in (0, 1))
    candidates = tuple(candidate_of(fitter, pair[j], model, model.state.effects[j], alone[1 - j]) for j in (0, 1))
    return FittedPair(
        pair=pair, fitted=model, candidates=(candidates[0], candidates[1]), alone=(alone[0], alone[1])
    )  # fmt: skip


def _alone(fitter: Fitter, model: Fitted, j: int) -> Array:
    """Scores (n,) of the pushes by the model that keeps only the j-th effect."""
    state = dc.replace(model.state, effects=(model.state.effects[j],))
    return push_scores(fitter.fit(state, rounds=4, like=model))
