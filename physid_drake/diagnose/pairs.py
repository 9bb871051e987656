"""Two effects at once, where none alone takes a good part of the mismatch away.

Each of two strong effects, fitted alone, bends towards what the other one does, ends far from where it belongs and
explains little. So pairs are ranked by score tests in which both may move, and the best few are fitted together.
"""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from physid_drake.diagnose.confirm import EXPLAINED, Candidate, candidate_of, push_scores
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.linear import Whitened, best_scatter, solve
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.screen import Score, extended
from physid_drake.diagnose.starts import scanned_start, start_of

Tick = Callable[[str, int, int], None]
Pair = tuple[Score, Score]

AMONG = 6  # effects, by their own score tests
FITTED = 3  # pairs
ROUNDS, CAREFUL = 6, 3  # of a fit; in the first of them the pushes' unknowns are held


@dc.dataclass(frozen=True, kw_only=True)
class FittedPair:
    """A model with two effects; of each, what it adds to the model with the other one alone."""

    fitted: Fitted
    candidates: tuple[Candidate, Candidate]


def confirmed_pair(fitter: Fitter, plain: Fitted, scores: Sequence[Score], tick: Tick) -> FittedPair | None:
    """The pair of effects that explains the pushes, each confirmed beside the other one; None where none does.

    Args:
        fitter: fits.
        plain: the model without effects.
        scores: of the catalogue.
        tick: told which pair is fitted.
    """
    for k, pair in enumerate(promising(plain, scores)):
        tick(f"fit with {pair[0].kind.name} and {pair[1].kind.name}", k, FITTED)
        first_at = scanned_start(fitter, plain, pair[0], (start_of(fitter, pair[1]),))
        effects = (first_at, scanned_start(fitter, plain, pair[1], (first_at,)))
        model = fitter.fit(fitter.start(plain.state.u, effects), rounds=ROUNDS, careful=CAREFUL, renew=True)
        if model.reduced_chi2 > EXPLAINED:
            continue
        first, second = (_beside(fitter, model, pair, j) for j in (0, 1))
        if first.accepted and second.accepted:
            return FittedPair(fitted=model, candidates=(first, second))
    return None


def promising(plain: Fitted, scores: Sequence[Score]) -> list[Pair]:
    """Pairs by the gain of both together, best first, each score with its coefficients beside the other's."""
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
    scatter, value = best_scatter(pushes, mean, std)
    beta = solve(Whitened.of(pushes, scatter), mean, std).beta[len(plain.prior_mean) :]
    parts = np.split(beta, [len(pair[0].kept)])
    if any(_backwards(one, part.tolist()) for one, part in zip(pair, parts, strict=True)):
        return None
    first, second = (_with_coefficients(one, part.tolist()) for one, part in zip(pair, parts, strict=True))
    return value, (first, second)


def _backwards(one: Score, coefficients: Sequence[float]) -> bool:
    return any(one.signature.one_sided[k] and c < 0.0 for k, c in zip(one.kept, coefficients, strict=True))


def _with_coefficients(one: Score, coefficients: Sequence[float]) -> Score:
    every = np.zeros(one.signature.steps)
    every[list(one.kept)] = coefficients
    return dc.replace(one, coefficients=every)


def _beside(fitter: Fitter, model: Fitted, pair: Pair, j: int) -> Candidate:
    """The j-th effect of a pair, judged by the pushes that the other one alone leaves worse predicted."""
    other = (model.state.effects[1 - j],)
    without = fitter.fit(dc.replace(model.state, effects=other), rounds=4, like=model)
    return candidate_of(fitter, pair[j], model, model.state.effects[j], push_scores(without))
