"""Plans a push: from a model, a policy and a cost to the best settings, with the spread of their cost."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from physid_drake.belief import Belief
from physid_drake.errors import ConfigError
from physid_drake.model import Model
from physid_drake.plan.costs import Cost, cost_of, loss_of
from physid_drake.plan.draws import Draw, draws_of, uncertain_names
from physid_drake.plan.reach import beyond_reach
from physid_drake.plan.trajectory import Ending, Situation, Trajectory, hand_radius_of, path_of, trajectory_of
from physid_drake.policies import PlannedPush, Policy
from physid_drake.progress import Progress
from physid_drake.search import SearchResult, search_minimum, search_named

Array = NDArray[np.float64]
Outcome = tuple[Trajectory, float]  # and its cost [m]

CANDIDATES = 256
REFINE_EVERY = 6  # trials: candidates gather where the best setting may be
TOLERANCE = 0.01  # m
# m: costs are capped at that of no push, and no lower than here. A lost object costs a metre and more; beside such a
# cliff a Gaussian process does not see the millimetres before it.
LEAST_CAP = 0.1
FASTER = 1.2  # times the speed of the fastest recorded push, which noise may make larger than it was


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Spread:
    """Posterior samples of what one push comes to.

    Attributes:
        costs: (n,) of the samples [m]; that of a lost object where the rollout diverged.
        ends: (n, 3) x, y [m], yaw [rad].
        endings: (n,) how they ended.
    """

    costs: Array
    ends: Array
    endings: tuple[Ending, ...]

    @property
    def mean(self) -> float:
        """Mean cost [m]."""
        return float(self.costs.mean())

    @property
    def band(self) -> tuple[float, float]:
        """5 % and 95 % quantiles of the cost [m]."""
        low, high = np.quantile(self.costs, [0.05, 0.95]).tolist()
        return low, high

    @property
    def losses(self) -> int:
        """Number of samples in which the object fell or toppled."""
        return sum(e in (Ending.FELL, Ending.TOPPLED) for e in self.endings)

    @property
    def moving(self) -> int:
        """Number of samples in which the object had not stopped when the rollout ended."""
        return sum(e is Ending.MOVING for e in self.endings)

    @property
    def diverged(self) -> int:
        """Number of samples whose rollout diverged."""
        return sum(e is Ending.DIVERGED for e in self.endings)

    def successes(self, tolerance: float) -> int:
        """Number of samples that end at rest with a cost of at most ``tolerance`` [m]."""
        ended = [e is Ending.AT_REST for e in self.endings]
        return int(np.count_nonzero((self.costs <= tolerance) & ended))

    def success_rate(self, tolerance: float) -> tuple[float, tuple[float, float]]:
        """Share of successes, and its 90 % interval (Wilson's); ``tolerance`` in m."""
        hits, count = self.successes(tolerance), len(self.costs)
        interval = stats.binomtest(hits, count).proportion_ci(confidence_level=0.9, method="wilson")
        return hits / count, (float(interval.low), float(interval.high))


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class SweepRow:
    """One point of the curve of cost over a setting.

    Attributes:
        value: of the setting, in its unit.
        cost: with the most probable parameters [m].
        ending: with the most probable parameters.
        spread: by posterior samples; None where there are none.
    """

    value: float
    cost: float
    ending: Ending
    spread: Spread | None


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Plan:
    """The best push of a policy.

    Attributes:
        model: with which it was planned.
        policy: the family of pushes.
        cost_function: what was minimised.
        situation: where the object starts.
        tolerance: cost up to which a push counts as a success [m].
        settings: (d,) the best ones, each in its unit.
        predicted: the trajectory with the most probable parameters.
        cost: of that trajectory [m]; infinite if every rollout diverged.
        loss: cost of an object that is lost or does not stop [m].
        spread: by posterior samples; None where there are none.
        sweep: cost over the policy's swept setting, the others at their best values.
        search: the result of the search; with ``risk`` its errors are mean costs.
        risk: whether the mean cost over posterior samples was minimised, instead of that of the most probable
            parameters.
    """

    model: Model
    policy: Policy
    cost_function: Cost
    situation: Situation
    tolerance: float
    settings: Array
    predicted: Trajectory
    cost: float
    loss: float
    spread: Spread | None
    sweep: tuple[SweepRow, ...]
    search: SearchResult
    risk: bool


def plan(
    model: Model,
    policy: Policy,
    cost: Cost,
    *,
    situation: Situation,
    rng: np.random.Generator,
    budget: int = 24,
    search: str = "greedy_entropy",
    draws: int = 16,
    risk: bool = False,
    sweep: int = 16,
    tolerance: float = TOLERANCE,
    friction_scatter: float = 0.0,
    scatter_freedom: float = math.inf,
    progress: Progress | None = None,
) -> Plan:
    """Search a policy's settings for the least cost.

    The cost is that of the trajectory with the most probable parameters, as in the paper. With ``risk`` it is the
    mean over posterior samples, in which a lost object costs more than any that is not lost.

    Args:
        model: the object, with its effects.
        policy: the family of pushes.
        cost: to be minimised.
        situation: where the object starts.
        rng: of candidates, search and samples; the same state gives the same plan.
        budget: settings that are tried.
        search: a name in ``search.SEARCHES``.
        draws: posterior samples for the spread; 0 for none. A model without intervals has no spread.
        risk: minimise the mean cost over posterior samples.
        sweep: points of the curve of cost over one setting; 0 for none.
        tolerance: cost up to which a push counts as a success [m].
        friction_scatter: relative standard deviation of friction between pushes [-].
        scatter_freedom: degrees of freedom of that estimate; infinite if it is exact.
        progress: called with the stage, steps done and steps in all.

    Raises:
        ConfigError: if a number is out of its range, the search is unknown, the model has no hand, or ``risk`` has no
            samples.

    Source: Zhu, Kimmel, Boularias, section III.C, policy optimization.
    """
    _check(budget, draws, sweep, tolerance, search)
    hand_radius_of(model)
    streams = [np.random.default_rng(s) for s in rng.integers(2**63, size=4)]
    drawn, fresh = tuple[Draw, ...](), tuple[Draw, ...]()
    if uncertain_names(model) or friction_scatter > 0.0 or any(situation.start_std):
        drawn, fresh = (
            draws_of(
                model, situation, draws, stream, friction_scatter=friction_scatter, scatter_freedom=scatter_freedom
            )
            for stream in (streams[0], streams[3])
        )
    if risk and not drawn:
        raise ConfigError(
            "plan: --risk needs posterior samples (--draws above 0), and a model with intervals to sample from."
        )
    rollouts = _Rollouts(model, drawn, policy, cost, situation, progress or (lambda stage, done, total: None))
    objective = rollouts.mean_costs if risk else rollouts.likely_costs
    found = search_minimum(
        objective, policy.space, policy.space.sample(streams[1], CANDIDATES, from_prior=False),
        search_named(search), budget=budget, rng=streams[2], refine_every=REFINE_EVERY, entropy_tolerance=0.0,
        on_trial=lambda belief: rollouts.tell_search(belief, budget),
    )  # fmt: skip
    tried = rollouts.best if math.isfinite(rollouts.best[1]) else (np.array(found.theta_best), math.inf)
    rows = rollouts.sweep(tried[0], sweep)
    best = _better(policy, tried, rows, risk=risk)
    predicted = rollouts.trajectory(model, best)
    pushes = policy.pushes(best)
    # With risk, fresh samples: on those that were minimised over, the cost is too low.
    told = spread_of(fresh if risk else drawn, pushes, cost, model=model, situation=situation) if drawn else None
    return Plan(
        model=model, policy=policy, cost_function=cost, situation=situation, tolerance=tolerance, settings=best,
        predicted=predicted, cost=cost_of(cost, predicted, model.table), loss=rollouts.loss,
        spread=told, sweep=rows, search=found, risk=risk,
    )  # fmt: skip


def spread_of(
    draws: Sequence[Draw], pushes: tuple[PlannedPush, ...], cost: Cost, *, model: Model, situation: Situation
) -> Spread:
    """What pushes come to in posterior samples; the hand aims at where the object is seen.

    Args:
        draws: the samples, at least one.
        pushes: made one after the other.
        cost: of the end.
        model: with which the hand's path is made.
        situation: where the object is seen.
    """
    path = path_of(model, pushes[0], situation.start)
    trajectories = [trajectory_of(d.model, pushes, d.situation, path=path, believed=model) for d in draws]
    costs, loss = [cost_of(cost, t, model.table) for t in trajectories], loss_of(cost, model.table)
    return Spread(
        costs=np.array([c if math.isfinite(c) else loss for c in costs]),
        ends=np.array([t.end for t in trajectories]),
        endings=tuple(t.ending for t in trajectories),
    )


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Hindsight:
    """What a diagnosis changes for the plan that was made before it.

    Attributes:
        baseline: the plan that was made with the baseline model; None where this one is that plan.
        outcome: trajectory and cost [m] of the baseline plan's push, simulated with the effects; None where there is
            none.
        caveat: a warning that the diagnosis gives; empty if none.
    """

    baseline: Plan | None = None
    outcome: Outcome | None = None
    caveat: str = ""


def caveat_of(verdict: str, alike: Mapping[str, Sequence[str]]) -> str:
    """The warning that a diagnosis gives for plans made with its model; empty if none.

    Args:
        verdict: of the diagnosis.
        alike: for each effect that was found, names of effects that it cannot be distinguished from.
    """
    rivals = {name: others for name, others in alike.items() if others}
    if rivals:
        unsure = "; ".join(
            f"{name} is indistinguishable from {' or '.join(others)}" for name, others in rivals.items()
        )
        return f"{unsure}: the object may move differently"
    if verdict == "unexplained":
        return "the model does not explain the recorded pushes: the plan may fail"
    return ""


def caveats_of(made: Plan, hindsight: Hindsight | None = None) -> list[str]:
    """All warnings about a plan, one line each: of its diagnosis, of its speed, and of the robots' reach.

    Args:
        made: the plan.
        hindsight: what a diagnosis changes for it; None without a diagnosis.
    """
    speed, known = max(push.speed for push in made.policy.pushes(made.settings)), made.model.top_speed
    caveats = [hindsight.caveat] if hindsight is not None and hindsight.caveat else []
    if known is not None and speed > FASTER * known:
        caveats.append(
            f"extrapolates beyond the recorded speeds (plan {speed:.2f} m/s, fastest recorded push {known:.2f} m/s)"
        )
    ways = np.vstack([path.positions(np.linspace(0.0, float(path.times[-1]), 100)) for path in made.predicted.paths])
    return [*caveats, *beyond_reach(made.model.table, ways, made.predicted.end[:2])]


def outcome_under(made: Plan, model: Model) -> Outcome:
    """Trajectory and cost [m] of a plan's push, simulated with another model."""
    pushes, path = made.policy.pushes(made.settings), made.predicted.paths[0]
    trajectory = trajectory_of(model, pushes, made.situation, path=path, believed=made.model)
    return trajectory, cost_of(made.cost_function, trajectory, model.table)


def _better(policy: Policy, tried: tuple[Array, float], rows: Sequence[SweepRow], *, risk: bool) -> Array:
    """The best setting (d,), of one that was tried, with its cost [m], and of the sweep along the swept one."""
    best, least = tried[0].copy(), tried[1]
    index = policy.space.index(policy.swept)
    for row in rows:
        cost = row.spread.mean if risk and row.spread is not None else row.cost
        if cost < least:
            least, best[index] = cost, row.value
    return best


def _check(budget: int, draws: int, sweep: int, tolerance: float, search: str) -> None:
    for name, value, least in (("budget", budget, 1), ("draws", draws, 0), ("sweep", sweep, 0)):
        if value < least:
            raise ConfigError(f"plan: {name} must be at least {least}, but is {value}.")
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise ConfigError(f"plan: the tolerance must be above 0 m, but is {tolerance:g} m.")
    search_named(search)


class _Rollouts:
    """The rollouts of one plan."""

    def __init__(
        self,
        model: Model,
        draws: Sequence[Draw],
        policy: Policy,
        cost: Cost,
        situation: Situation,
        progress: Progress,
    ) -> None:
        self._model, self._draws, self._policy = model, draws, policy
        self._cost, self._situation, self._progress = cost, situation, progress
        self.loss = loss_of(cost, model.table)
        self.best = np.zeros(policy.space.dimension), math.inf  # settings that were tried, and their cost [m]

    def trajectory(self, model: Model, settings: Array) -> Trajectory:
        return trajectory_of(model, self._policy.pushes(settings), self._situation)

    def likely_costs(self, settings: Array) -> Array:
        """Costs (k,) of settings (k, d) under the likely theta, as the search sees them."""
        return self._capped(
            settings, [cost_of(self._cost, self.trajectory(self._model, s), self._model.table) for s in settings]
        )

    def mean_costs(self, settings: Array) -> Array:
        """Mean costs (k,) of settings (k, d) under the belief, as the search sees them."""
        return self._capped(settings, [self.spread(s).mean for s in settings])

    def _capped(self, settings: Array, costs: Sequence[float]) -> Array:
        """No more than that of no push at all; infinite ones, of what diverged, stay so. The best is remembered."""
        least = int(np.argmin(costs))
        if costs[least] < self.best[1]:
            self.best = np.array(settings[least]), float(costs[least])
        most = max(self._cost.at(np.array(self._situation.start[:2])), LEAST_CAP)
        return np.array([min(cost, most) if math.isfinite(cost) else cost for cost in costs])

    def spread(self, settings: Array) -> Spread:
        pushes = self._policy.pushes(settings)
        return spread_of(self._draws, pushes, self._cost, model=self._model, situation=self._situation)

    def sweep(self, best: Array, count: int) -> tuple[SweepRow, ...]:
        """Costs along the swept setting, evenly over its bounds, the others at their best."""
        index = self._policy.space.index(self._policy.swept)
        parameter = self._policy.space.parameters[index]
        rows = []
        for k, value in enumerate(np.linspace(parameter.lower, parameter.upper, count).tolist()):
            self._progress("sweep", k, count)
            settings = np.array(best)
            settings[index] = value
            trajectory = self.trajectory(self._model, settings)
            rows.append(
                SweepRow(
                    value=value,
                    cost=cost_of(self._cost, trajectory, self._model.table),
                    ending=trajectory.ending,
                    spread=self.spread(settings) if self._draws else None,
                )
            )
        return tuple(rows)

    def tell_search(self, belief: Belief, budget: int) -> None:
        self._progress("policy search", belief.n_trials, budget)
