"""Where a search begins, and candidate sets that follow the belief."""

import numpy as np
from scipy.spatial import cKDTree

from physid_drake.belief import Belief
from physid_drake.errors import ParameterError
from physid_drake.search.protocol import Indices
from physid_drake.space import Array

_FRESH_SHARE = 0.2


def initial_design(belief: Belief, rng: np.random.Generator, n: int) -> Indices:
    """Candidates to begin with: the nominal one, then the nearest to a Sobol sequence.

    The first is the candidate nearest to the space's nominal point, the predefined model of the object.
    The others cover the unit cube evenly in every projection; a maximin choice would sit in its corners.

    Whether a candidate was tried plays no part, so that the design of a resumed search is the same.

    Args:
        belief: Holds the candidates.
        rng: Scrambles the sequence.
        n: Number of points wanted.

    Returns:
        Distinct indices (k,) into `belief.candidates`, k = n unless there are fewer candidates.
    """
    space = belief.space
    n = min(n, len(belief.candidates))
    if n < 1:
        return np.zeros(0, dtype=np.intp)
    targets = space.to_unit(space.nominal)[np.newaxis]
    if n > 1:
        targets = np.concatenate([targets, space.to_unit(space.sample(rng, n - 1, from_prior=False))])
    taken = np.zeros(len(belief.candidates), dtype=np.bool_)
    chosen = []
    for target in targets:
        squares = np.sum((belief.candidates_u - target) ** 2, axis=1)
        chosen.append(int(np.argmin(np.where(taken, np.inf, squares))))
        taken[chosen[-1]] = True
    return np.array(chosen, dtype=np.intp)


def refine_candidates(belief: Belief, rng: np.random.Generator, n: int, keep: int) -> Array:
    """A new candidate set that is dense where P_min is: pass it to `Belief.with_candidates`.

    Of the new set, `keep` are the candidates of highest P_min and the best trial; of the rest, a fifth is
    spread over the whole space, so that nothing is given up, and the others are scattered around draws from
    P_min. The scatter is between 1 % and 100 %, in equal parts per decade, of P_min's standard deviation in
    each dimension or of the distance to the neighbouring candidates, whichever is more: a P_min that is
    certain of one candidate says nothing about the gaps around it. It is reflected at the bounds.

    Args:
        belief: What is thought so far.
        rng: Draws centres, scatter and the spread-out part.
        n: Size of the new set.
        keep: How many old points stay, at least 1 and at most n.

    Returns:
        Thetas (n, d), each entry in its parameter's unit.

    Raises:
        ParameterError: When not 1 <= keep <= n.
    """
    if not 1 <= keep <= n:
        raise ParameterError(f"refine_candidates: 1 <= keep <= n is needed, but got keep {keep}, n {n}.")
    space, u, p = belief.space, belief.candidates_u, belief.p_min
    favourites = belief.candidates[np.argsort(-p, kind="stable")[: keep - 1]]
    kept = np.concatenate([belief.best[0][np.newaxis], favourites])
    kept = kept[np.sort(np.unique(kept, axis=0, return_index=True)[1])]
    n_new = n - len(kept)
    if n_new == 0:
        return kept
    n_fresh = int(_FRESH_SHARE * n_new)
    around = _scattered(u, p, space.to_unit(belief.best[0]), rng, n_new - n_fresh)
    parts = [kept, space.from_unit(around)]
    if n_fresh:
        parts.append(space.sample(rng, n_fresh, from_prior=False))
    return np.concatenate(parts)


def _scattered(u: Array, p: Array, best_u: Array, rng: np.random.Generator, n: int) -> Array:
    """Points (n, d) of the unit cube around draws from P_min; every tenth around the best trial."""
    centres = u[rng.choice(len(u), size=n, p=p)]
    centres[::10] = best_u
    deviation = np.sqrt(p @ (u - p @ u) ** 2)
    width = np.maximum(deviation, _spacing(u, centres)[:, np.newaxis])
    sizes = 10.0 ** rng.uniform(-2.0, 0.0, size=(n, 1))
    points = np.abs(centres + sizes * width * rng.standard_normal(centres.shape))
    return np.clip(1.0 - np.abs(1.0 - points), 0.0, 1.0)


def _spacing(u: Array, centres: Array) -> Array:
    """Distance (k,) per dimension from each centre (k, d) to its 2 d-th nearest among points u (n, d)."""
    d = u.shape[1]
    unique, back = np.unique(centres, axis=0, return_inverse=True)
    nth = min(2 * d + 1, len(u))
    distances = np.reshape(cKDTree(u).query(unique, k=[nth])[0], -1)
    return np.asarray(distances[back.reshape(-1)] / np.sqrt(d))
