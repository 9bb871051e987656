"""The search loop: propose, try, update, until the budget is spent or P_min stands still."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, final

import numpy as np
import numpy.typing as npt

from physid_drake.belief import Belief, BeliefSettings
from physid_drake.errors import ParameterError
from physid_drake.search.candidates import initial_design, refine_candidates
from physid_drake.search.protocol import Indices, Search
from physid_drake.space import Array, ParameterSpace

Objective = Callable[[Array], Array]
StopReason = Literal["budget spent", "time spent", "entropy settled", "candidates exhausted"]


@final
@dataclass(frozen=True, kw_only=True, eq=False)
class SearchResult:
    """What a search found.

    Attributes:
        belief: The last belief, with all trials in their order.
        theta_best: The trial (d,) of lowest error, each entry in its unit; the most likely candidate if
            every trial failed or none was made.
        error_best: Its error, in the unit of the objective; inf if every trial failed or none was made.
        entropies: Entropy of P_min in nats before the first trial and after each iteration.
        stop_reason: Why the search ended, in words.
        n_failed: Trials whose error was infinite or nan.
    """

    belief: Belief
    theta_best: Array
    error_best: float
    entropies: Array
    stop_reason: StopReason
    n_failed: int


def search_minimum(
    objective: Objective,
    space: ParameterSpace,
    candidates: npt.ArrayLike,
    search: Search,
    *,
    budget: int,
    rng: np.random.Generator,
    batch: int = 1,
    n_initial: int | None = None,
    entropy_tolerance: float = 0.1,
    patience: int = 5,
    time_limit: float | None = None,
    refine_every: int = 0,
    prior_weights: npt.ArrayLike | None = None,
    settings: BeliefSettings | None = None,
    on_trial: Callable[[Belief], None] | None = None,
    resume_from: Belief | None = None,
) -> SearchResult:
    """Searches the candidates for the one of least error.

    The first `n_initial` trials are `initial_design`, the rest is up to `search`. The search stops when the
    entropy of P_min stayed within `entropy_tolerance` over the last `patience` updates after the initial
    design, provided the samples resolve the entropy (`Belief.resolved`); the estimate itself scatters by
    about n_samples^-1/2 nats, so a tolerance below that never stops.

    Every iteration has its own generator, made from one number drawn from `rng` and the number of trials so
    far. A search resumed with the same arguments and an `rng` seeded alike goes on with the very trials it
    would have made.

    A `KeyboardInterrupt`, in the objective or the callback, passes through: `on_trial` has had every belief until
    then, the batch under way is lost.

    Args:
        objective: Errors (k,) at thetas (k, d); inf or nan where the rollout failed.
        space: The space the candidates live in.
        candidates: The set Theta (n, d), each entry in its unit; not read when resuming.
        search: Chooses the next trials.
        budget: Trials in all, those of `resume_from` included.
        rng: One number is drawn from it.
        batch: Trials per iteration.
        n_initial: Trials before `search` is asked; None takes d + 1 but at least 4 and at most a third of
            the budget; 0 asks it at once.
        entropy_tolerance: In nats; 0 never stops early.
        patience: Number of updates, at least 1.
        time_limit: Wall-clock limit in s, looked at between iterations; None for no limit.
        refine_every: Trials between refinements of the candidate set (`refine_candidates`, same size, half
            kept); 0 keeps the set, as the paper does.
        prior_weights: See `Belief.start`; not read when resuming.
        settings: See `Belief.start`; not read when resuming.
        on_trial: Called with the belief after every iteration, to show or to save it.
        resume_from: A belief to go on from.

    Raises:
        ParameterError: When an argument breaks a rule above, or the objective's result has a wrong shape.

    Source: Zhu, Kimmel, Boularias, section III.B.
    """
    plan = _Plan(
        budget=budget,
        batch=batch,
        n_initial=_default_n_initial(space.dimension, budget) if n_initial is None else n_initial,
        entropy_tolerance=entropy_tolerance,
        patience=patience,
        refine_every=refine_every,
        deadline=np.inf if time_limit is None else time.monotonic() + time_limit,
        root=int(rng.integers(2**63)),
    )
    belief = resume_from
    if belief is None:
        belief = Belief.start(
            space, candidates, plan.generator(_START), prior_weights=prior_weights, settings=settings
        )
    while (reason := plan.why_stop(belief)) is None:
        step = plan.generator(belief.n_trials)
        # Assigned only after the update, so that a resumed search repeats the refinement, not doubles it.
        asked = _refined(belief, step) if plan.refines(belief) else belief
        indices = _propose(asked, search, plan, step)
        if not len(indices):
            reason = "candidates exhausted"
            break
        thetas = asked.candidates[indices]
        belief = asked.update(thetas, _evaluate(objective, thetas), step)
        if on_trial is not None:
            on_trial(belief)
    theta_best, error_best = belief.best
    return SearchResult(
        belief=belief,
        theta_best=theta_best,
        error_best=error_best,
        entropies=belief.entropies,
        stop_reason=reason,
        n_failed=belief.n_failed,
    )


_START, _DESIGN = 2**32, 2**32 + 1


@dataclass(frozen=True, kw_only=True)
class _Plan:
    """The numbers of one search, and the decisions that follow from them and a belief."""

    budget: int
    batch: int
    n_initial: int
    entropy_tolerance: float
    patience: int
    refine_every: int
    deadline: float
    root: int

    def __post_init__(self) -> None:
        whole = {"budget": 1, "batch": 1, "patience": 1, "n_initial": 0, "refine_every": 0}
        for name, least in whole.items():
            if getattr(self, name) < least:
                raise ParameterError(f"search_minimum: {name} is at least {least}, but got {getattr(self, name)}.")
        if not self.entropy_tolerance >= 0.0:
            raise ParameterError(
                f"search_minimum: entropy_tolerance is at least 0 nats, but got {self.entropy_tolerance}."
            )

    def generator(self, stage: int) -> np.random.Generator:
        """The generator of one stage: a number of trials, or one of the named stages."""
        return np.random.default_rng([self.root, stage])

    def why_stop(self, belief: Belief) -> StopReason | None:
        if belief.n_trials >= self.budget:
            return "budget spent"
        if time.monotonic() >= self.deadline:
            return "time spent"
        return "entropy settled" if self._settled(belief) else None

    def refines(self, belief: Belief) -> bool:
        if not self.refine_every or belief.n_trials <= self.n_initial:
            return False
        before = belief.n_trials - self.batch
        return belief.n_trials // self.refine_every > before // self.refine_every

    def _settled(self, belief: Belief) -> bool:
        n_design = -(-self.n_initial // self.batch)
        if len(belief.entropies) < 1 + n_design + self.patience or not belief.resolved:
            return False
        return bool(np.ptp(belief.entropies[-1 - self.patience :]) < self.entropy_tolerance)


def _default_n_initial(dimension: int, budget: int) -> int:
    return min(max(4, dimension + 1), max(1, budget // 3))


def _propose(belief: Belief, search: Search, plan: _Plan, rng: np.random.Generator) -> Indices:
    wanted = min(plan.batch, plan.budget - belief.n_trials)
    if belief.n_trials < plan.n_initial:
        design = initial_design(belief, plan.generator(_DESIGN), plan.n_initial)
        left = design[~belief.tried[design]]
        if len(left):
            return left[: min(wanted, plan.n_initial - belief.n_trials)]
    return _sound(search.propose(belief, rng, wanted), belief, wanted)


def _sound(indices: Indices, belief: Belief, wanted: int) -> Indices:
    """What a search proposed, if it kept to the protocol.

    Raises:
        ParameterError: if not.
    """
    found = np.asarray(indices)
    if not len(found):
        return np.zeros(0, dtype=np.intp)
    whole = found.ndim == 1 and found.dtype.kind in "iu"
    if not whole or found.min() < 0 or found.max() >= len(belief.tried) or len(found) > wanted:
        raise ParameterError(f"search: propose must return at most {wanted} indices of candidates, got {found[:5]}.")
    if belief.tried[found].any() or len(np.unique(found)) < len(found):
        raise ParameterError(f"search: propose must return distinct candidates that were not tried, got {found[:5]}.")
    return found.astype(np.intp)


def _evaluate(objective: Objective, thetas: Array) -> Array:
    errors = np.asarray(objective(thetas), dtype=np.float64)
    if errors.shape != (len(thetas),):
        raise ParameterError(
            f"objective: one error per theta is needed, shape ({len(thetas)},), but it returned"
            f" {errors.shape}; return inf for a failed rollout."
        )
    return errors


def _refined(belief: Belief, rng: np.random.Generator) -> Belief:
    n = len(belief.candidates)
    return belief.with_candidates(refine_candidates(belief, rng, n, max(1, n // 2)), rng)
