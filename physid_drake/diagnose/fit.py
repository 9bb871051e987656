"""Gauss-Newton on all pushes: theta, the effects' chart points, and each push's own unknowns."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.linear import (
    LinearPush,
    Whitened,
    best_scatter,
    left_out_scores,
    own_unknowns,
    solve,
)
from physid_drake.diagnose.model import EffectPoint, Fitted, State
from physid_drake.diagnose.steps import Step, effect_steps, own_steps, theta_steps, with_theta
from physid_drake.effects import Effect
from physid_drake.inference.bounded import Bounds
from physid_drake.pushes.case import Case
from physid_drake.pushes.misfit import FAILED, diverged
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.task import Task

Array = NDArray[np.float64]

MOST_OWN = 3.0  # standard deviations: unknowns are linearised no further out
MOST_FRICTION = 8.0  # in units of the usual scatter, which is itself learnt: 20 %
SETTLED = 0.5  # of the cost: a step that gained less is the last
# Far from an explanation, of the squares beyond twice what noise would leave:
SLOW = 0.01  # a step that gained less is the last
FAST, MORE = 0.3, 2  # while steps gain as much, a fit goes on, to so many times its rounds
REFINEMENTS = 3  # steps on short ticks
RENEWED = 5.0  # of the cost, per push: a step that gained as much has left the place of its derivatives
MOST_THETA_MOVE = 0.25  # of the unit cube in one iteration
THETA_WITHIN = (1e-3, 1.0 - 1e-3)  # of the unit cube
Say = Callable[[str], None]


class Fitter:
    """Fits models to a case."""

    def __init__(
        self, case: Case, extra: Sequence[Array] | None = None, tolerances: Sequence[Array] | None = None
    ) -> None:
        """Prepare.

        Args:
            case: the pushes.
            extra: per push (m, j), directions of the numerics guard, each push with unknown multiples of its own.
            tolerances: per push (m, t), directions that all pushes may share by one standard deviation each.
        """
        self.case = case
        self.extra = extra
        self.tolerances = tolerances
        self._places = {problem.name: i for i, problem in enumerate(case.problems)}
        self._most = [
            np.array([MOST_FRICTION if name == "friction" else MOST_OWN for name in n.names]) for n in case.nuisances
        ]

    def start(self, u: Array, effects: tuple[EffectPoint, ...] = ()) -> State:
        """A model at theta ``u`` (d,), the pushes' unknowns at zero."""
        own = tuple(np.zeros(len(n.names)) for n in self.case.nuisances)
        return State(u=u, effects=effects, own=own, scatter=1.0)

    # Rollouts.

    def task(self, state: State, i: int, *, effects: Sequence[Effect] | None = None) -> Task:
        """The rollout of push i at a state, or with other effects."""
        case = self.case
        return Task(
            problem=case.problems[i],
            theta=np.asarray(case.thetas.space.from_unit(state.u)),
            nuisance=case.nuisances[i],
            values=self._within(i, state.own[i]) * case.nuisances[i].stds,
            effects=tuple(e.effect(case) for e in state.effects) if effects is None else tuple(effects),
        )

    def _within(self, i: int, own: Array) -> Array:
        """Unknowns (k,) of push i, no further out than they are linearised."""
        return np.clip(own, -self._most[i], self._most[i])

    def vectors(self, tasks: Sequence[Task]) -> list[Array]:
        """Features of rollouts; a large value in all where one diverged."""
        predictions: list[Prediction | None] = self.case.pool.run(tasks)
        result = []
        for task, prediction in zip(tasks, predictions, strict=True):
            features = self.case.features[self._places[task.problem.name]]
            result.append(np.full(len(features.recorded), FAILED) if prediction is None else features.of(prediction))
        return result

    # Linearisation.

    def linearise(
        self,
        state: State,
        *,
        learn_scatter: bool = True,
        like: Fitted | None = None,
        fresh_theta: bool = False,
        at: Fitted | None = None,
    ) -> Fitted:
        """All derivatives at a state, by differences.

        Args:
            state: where.
            learn_scatter: choose the scatter of friction anew, instead of keeping the state's.
            like: a fitted model whose derivatives with respect to theta and the pushes' unknowns are near enough:
                only those of the effects are taken.
            fresh_theta: take those of theta nevertheless.
            at: a model at this very state, whose rollouts need not be made again.
        """
        theta, own = like is None or fresh_theta, like is None
        tasks: list[Task] = []
        owners: list[int] = []
        for i in range(len(self.case.problems)):
            mine = self._tasks_of(state, i, theta=theta, own=own)[0 if at is None else 1 :]
            tasks += mine
            owners += [i] * len(mine)
        vectors = self.vectors(tasks)
        pushes, predicted = [], []
        for i in range(len(self.case.problems)):
            mine_vectors = [] if at is None else [at.predicted[i]]
            mine_vectors += [v for v, owner in zip(vectors, owners, strict=True) if owner == i]
            near = None if like is None else like.pushes[i]
            pushes.append(self._linear_push(state, i, mine_vectors, near, theta=theta))
            predicted.append(mine_vectors[0])
        return self._fitted(state, tuple(pushes), tuple(predicted), learn_scatter)

    def seen_from(self, best: Fitted, state: State, *, learn_scatter: bool = True) -> Fitted:
        """The model at another state with the derivatives of ``best``: one rollout per push."""
        predicted = self.vectors([self.task(state, i) for i in range(len(self.case.problems))])
        pushes = tuple(
            dc.replace(push, residual=self._residual(state, i, base, push.own))
            for i, (push, base) in enumerate(zip(best.pushes, predicted, strict=True))
        )
        return self._fitted(state, pushes, tuple(predicted), learn_scatter)

    def _residual(self, state: State, i: int, predicted: Array, own: Array) -> Array:
        """Recorded less predicted (m,), as if the push's unknowns were zero."""
        values = self._within(i, state.own[i])
        residual: Array = self.case.features[i].recorded - predicted + own[:, : len(values)] @ values
        return residual

    def _tasks_of(self, state: State, i: int, *, theta: bool, own: bool) -> list[Task]:
        steps = theta_steps(self.case, state) if theta else []
        steps += effect_steps(self.case, state)
        steps += self._own_steps(state, i) if own else []
        return [self.task(one, i) for one in (state, *(step.state for step in steps))]

    def _own_steps(self, state: State, i: int) -> list[Step]:
        """From where the unknowns of push i are linearised."""
        within = (*state.own[:i], self._within(i, state.own[i]), *state.own[i + 1 :])
        return own_steps(dc.replace(state, own=within), i)

    def _linear_push(
        self, state: State, i: int, vectors: list[Array], like: LinearPush | None, *, theta: bool
    ) -> LinearPush:
        """A push from its rollouts, in the order of ``_tasks_of``; what is not among them is that of ``like``."""
        base, seen = vectors[0], iter(vectors[1:])
        moved = [step.derivative(base, next(seen)) for step in (theta_steps(self.case, state) if theta else ())]
        more = [step.derivative(base, next(seen)) for step in effect_steps(self.case, state)]
        effects = np.column_stack([np.zeros((len(base), 0)), *more])
        if like is None or theta:  # by the chain rule, without the forces that went with the mass
            columns = [np.column_stack(moved) - effects @ with_theta(self.case, state), effects]
        else:
            columns = [like.shared[:, : len(state.u)], effects]
        if like is None:
            own = np.column_stack([step.derivative(base, next(seen)) for step in self._own_steps(state, i)])
            all_own = own if self.extra is None else np.column_stack([own, self.extra[i]])
        else:
            all_own = like.own
        return LinearPush(
            residual=self._residual(state, i, base, all_own),
            shared=self._with_tolerances(i, columns),
            own=all_own,
            noise=self.case.features[i].noise,
            friction=self.case.nuisances[i].index("friction"),
        )

    def _with_tolerances(self, i: int, columns: Sequence[Array]) -> Array:
        more = [] if self.tolerances is None else [self.tolerances[i]]
        return np.column_stack([*columns, *more])

    def priors(self, state: State) -> tuple[Array, Array]:
        """Mean and standard deviation (d,) of a change of the shared parameters from a state."""
        space = self.case.thetas.space
        means = list(np.asarray(space.to_unit(space.nominal)) - state.u)
        stds = list(space.prior_std_unit)
        for e in state.effects:
            chart = e.chart(self.case)
            for j in e.free:
                means.append(float(e.origin[j] - e.point[j]))
                stds.append(chart[j].std)
        count = 0 if self.tolerances is None else self.tolerances[0].shape[1]
        return np.array([*means, *([0.0] * count)]), np.array([*stds, *([1.0] * count)])

    def bounds(self, state: State) -> Bounds:
        """Least and greatest change (d,) of theta and the effects' coordinates from a state."""
        least, most = list(THETA_WITHIN[0] - state.u), list(THETA_WITHIN[1] - state.u)
        for e in state.effects:
            chart = e.chart(self.case)
            least += [chart[j].lower - float(e.point[j]) for j in e.free]
            most += [chart[j].upper - float(e.point[j]) for j in e.free]
        return np.array(least), np.array(most)

    def _fitted(
        self, state: State, pushes: tuple[LinearPush, ...], predicted: tuple[Array, ...], learn_scatter: bool
    ) -> Fitted:
        mean, std = self.priors(state)
        bounds = self.bounds(state)
        scatter, score = best_scatter(pushes, mean, std, () if learn_scatter else (state.scatter,), bounds)
        state = dc.replace(state, scatter=scatter)
        solution = solve(Whitened.of(pushes, scatter), mean, std, bounds)
        return Fitted(
            state=state, pushes=pushes, prior_mean=mean, prior_std=std, solution=solution, predicted=predicted,
            score=score, doubt=self.case.noise.doubt, bounds=bounds,
        )  # fmt: skip

    def guard(self, fitted: Fitted) -> Fitted:
        """A model that was fitted without the guard's directions and the tolerances, with them."""
        assert self.extra is not None
        pushes = tuple(
            dc.replace(
                push, own=np.column_stack([push.own, self.extra[i]]), shared=self._with_tolerances(i, [push.shared])
            )
            for i, push in enumerate(fitted.pushes)
        )
        return self._fitted(fitted.state, pushes, fitted.predicted, learn_scatter=True)

    def relieved(self, fitted: Fitted, explained: Sequence[Array]) -> Fitted:
        """A model as it would be if something else explained so much (m_i,) of each push."""
        pushes = tuple(
            dc.replace(push, residual=push.residual - much)
            for push, much in zip(fitted.pushes, explained, strict=True)
        )
        return self._fitted(fitted.state, pushes, fitted.predicted, learn_scatter=True)

    # Iteration.

    def fit(
        self,
        state: State,
        *,
        rounds: int = 4,
        careful: int = 0,
        like: Fitted | None = None,
        renew: bool = False,
        say: Say | None = None,
    ) -> Fitted:
        """Iterate from a state, with shorter steps where one fails.

        Args:
            state: where to start.
            rounds: at most so many steps, not fewer than ``careful``; more as long as they gain much.
            careful: in so many first rounds only the shared parameters move, the pushes' unknowns stay at zero and
                the scatter at its prior's median: far from the answer they would explain anything.
            like: a fitted model whose derivatives for theta and the pushes' unknowns are near enough.
            renew: take all derivatives anew after each step that gained much.
            say: told of each round.

        Returns:
            The best state seen, linearised there, or where its last small step began.
        """
        best = self.linearise(state, learn_scatter=careful == 0, like=like)
        like = best if renew else like
        k, stale, fast = 0, False, False
        while k < rounds or (fast and k < MORE * rounds):
            if say is not None:
                say(f"round {k + 1}")
            held, released = k + 1 < careful, k + 1 >= careful
            if k + 1 == careful:  # the scatter is learnt from here on, so that costs compare
                best = self._fitted(best.state, best.pushes, best.predicted, learn_scatter=True)
            trial = self._tried(best, cautious=k < careful, released=released)
            gained, far = best.cost_here - trial.cost_here, max(0.0, best.excess_here - best.degrees)
            fast, worth = k >= careful and 0.0 < FAST * far < gained, SLOW * far
            if held and gained <= worth:
                k = careful - 1  # nothing more to gain with the unknowns at zero
                continue
            if k >= careful and gained < max(SETTLED, worth):
                return trial if gained > 0.0 else best
            if gained <= 0.0:  # the pushes' unknowns are released where it is
                trial = best
            anew = renew and (k + 1 < rounds or fast) and gained > RENEWED * len(best.pushes)
            # Unknowns that are held only weigh what is left: their derivatives may be those of nearby.
            stale, whole = (stale or anew) and held, (stale or anew) and released
            best = self.linearise(
                trial.state, learn_scatter=released, like=None if whole else like, fresh_theta=anew, at=trial
            )  # fmt: skip
            like = best if anew or whole else like
            k += 1
        return best

    def _tried(self, best: Fitted, *, cautious: bool, released: bool) -> Fitted:
        """One step, shorter where a long one fails; the derivatives stay those of where it starts.

        Args:
            best: where it starts.
            cautious: keep the pushes' unknowns at zero.
            released: learn the scatter.
        """
        trial = best
        for share in (1.0, 0.4, 0.15):
            step = self.stepped(best, share)
            if cautious:
                step = dc.replace(step, own=tuple(np.zeros_like(o) for o in step.own))
            trial = self.seen_from(best, step, learn_scatter=released)
            if trial.cost_here < best.cost_here:
                break
        return trial

    def refine(self, rough: Fitted) -> Fitted:
        """What another cell's fit left, here: derivatives of theta and effects anew, then steps while they help.

        Beside an effect those of the pushes' unknowns, too: a start beside a patch matters more than elsewhere.
        """
        like = None if rough.state.effects else rough
        best = self.linearise(rough.state, like=like, fresh_theta=True)
        for _ in range(REFINEMENTS):
            moved = self.seen_from(best, self.stepped(best))
            gained = best.cost_here - moved.cost_here
            best = moved if gained > 0.0 else best
            if gained < SETTLED:
                break
        return best

    def left_out(self, fitted: Fitted) -> tuple[Array, ...]:
        """Recorded less predicted (m_i,) of each push, simulated by the model as it leaves, fitted without that push.

        Nothing of the push itself is known to the prediction but the start of the object and the hand's path. A push
        whose rollout diverges is predicted by the model's derivatives.
        """
        _, betas = left_out_scores(
            fitted.pushes, fitted.state.scatter, fitted.prior_mean, fitted.prior_std, bounds=fitted.bounds
        )
        states = [self.start(*self._moved(fitted.state, beta)) for beta in betas]
        predicted = self.vectors([self.task(state, i) for i, state in enumerate(states)])
        known = fitted.own_dimension
        return tuple(
            push.residual - push.shared[:, :known] @ beta[:known] if diverged(vector) else f.recorded - vector
            for f, vector, push, beta in zip(self.case.features, predicted, fitted.pushes, betas, strict=True)
        )

    def _moved(self, state: State, beta: Array) -> tuple[Array, tuple[EffectPoint, ...]]:
        """Theta (d,) and the effects of a state, moved by beta, no further than a step goes."""
        d = len(state.u)
        u = np.clip(state.u + np.clip(beta[:d], -MOST_THETA_MOVE, MOST_THETA_MOVE), *THETA_WITHIN)
        effects, at = [], d
        for e in state.effects:
            # Coordinates of shape (a place, a speed) go no further in a step than their prior says they are unsure.
            longest = np.array([e.chart(self.case)[j].std for j in e.free])
            effects.append(e.moved(self.case, np.clip(beta[at : at + len(e.free)], -longest, longest)))
            at += len(e.free)
        return u, tuple(effects)

    def stepped(self, fitted: Fitted, share: float = 1.0) -> State:
        """The state after a Gauss-Newton step."""
        state = fitted.state
        u, effects = self._moved(state, share * fitted.solution.beta)
        own = []
        for i, (push, old) in enumerate(zip(fitted.pushes, state.own, strict=True)):
            new = own_unknowns(push, state.scatter, fitted.solution.beta)[: len(old)]
            own.append(self._within(i, old + share * (new - old)))
        return State(u=u, effects=effects, own=tuple(own), scatter=state.scatter)
