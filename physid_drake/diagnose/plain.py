"""The plain cell, fitted: greedy entropy search for a start, the numerics guard, Gauss-Newton."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import CellConfig
from physid_drake.diagnose.candidate import FAR_OFF
from physid_drake.diagnose.fit import Fitter
from physid_drake.diagnose.model import EffectPoint, Fitted, State
from physid_drake.progress import Progress
from physid_drake.pushes.case import Case
from physid_drake.pushes.misfit import DIVERGED, difference, diverged
from physid_drake.pushes.problem import spec_of
from physid_drake.search import GreedyEntropySearch, search_minimum

Array = NDArray[np.float64]

CANDIDATES = 300
BUDGET = 24
CAREFUL = 3  # rounds
ODD = 0.8  # of the squares that a model leaves
SOME_PUSHES = 6  # the search needs a start, not an answer
TRIED = 8  # thetas, and the nominal one, at which a push must diverge to be left out


def search_theta(
    case: Case,
    rng: np.random.Generator,
    tick: Progress,
    *,
    effects: Sequence[EffectPoint] = (),
    near: Array | None = None,
) -> Array:
    """A start (d,) in the unit cube, by greedy entropy search over a part of the pushes.

    Args:
        case: the pushes.
        rng: of the candidates and the search.
        tick: told the trials.
        effects: in the cell meanwhile, where they are.
        near: (d,) a point of the unit cube, returned where nothing better is found.
    """
    fitter, space = Fitter(case), case.thetas.space
    some = np.unique(np.linspace(0, len(case.problems) - 1, min(SOME_PUSHES, len(case.problems))).round().astype(int))

    def objective(thetas: Array) -> Array:
        errors = []
        for theta in thetas:
            state = fitter.start(np.asarray(space.to_unit(theta)), tuple(effects))
            vectors = fitter.vectors([fitter.task(state, int(i)) for i in some])
            squares = [
                np.mean((v - case.features[i].recorded) ** 2)
                for v, i in zip(vectors, some, strict=True)
                if not diverged(v)
            ]
            lost = len(some) - len(squares)
            # A push that diverges says nothing, and must not hide what the others say.
            errors.append(0.5 * np.log(np.mean(squares)) + DIVERGED * lost if lost < len(squares) else np.inf)
        return np.array(errors)

    candidates = space.sample(rng, CANDIDATES, from_prior=True)
    # Where people would start by hand is a candidate too.
    candidates[0] = space.nominal
    beside = " and ".join(e.kind.name for e in effects)
    stage = f"greedy entropy search beside {beside}" if effects else "greedy entropy search"
    found = search_minimum(
        objective, space, candidates, GreedyEntropySearch(), budget=BUDGET, rng=rng,
        on_trial=lambda belief: tick(stage, belief.n_trials, BUDGET),
    )  # fmt: skip
    if near is not None and objective(np.asarray(space.from_unit(near))[None])[0] <= found.error_best:
        return near
    return np.asarray(space.to_unit(found.theta_best))


def lost_pushes(case: Case) -> tuple[int, ...]:
    """Indices of the pushes that the cell cannot simulate, not at the nominal theta and not at draws of the prior."""
    fitter, space = Fitter(case), case.thetas.space
    lost = list(range(len(case.problems)))
    for theta in (space.nominal, *space.sample(np.random.default_rng(0), TRIED, from_prior=True)):
        state = fitter.start(np.asarray(space.to_unit(theta)))
        vectors = fitter.vectors([fitter.task(state, i) for i in lost])
        lost = [i for i, vector in zip(lost, vectors, strict=True) if diverged(vector)]
        if not lost:
            break
    return tuple(lost)


def numerics(case: Case, state: State) -> tuple[Array, ...]:
    """Per push (m, 2): how the rollout changes with half the case's own ticks, and with these and the other contact.

    Rollouts of the case are on ticks twice as long (``coarse``), so that ticks differ by a factor of four, and two.

    The cell's own error has about the shape and the size of these; each push has an unknown multiple of them.
    """
    fitter = Fitter(case)
    base = fitter.vectors([fitter.task(state, i) for i in range(len(case.problems))])
    columns: list[list[Array]] = [[] for _ in case.problems]
    half_step = dc.replace(case.config, solver=case.config.solver.scaled(0.5))
    for config in (half_step, _other_contact(case.config)):
        pool = case.pool.of(spec_of(case.recording, config))
        other = Fitter(dc.replace(case, pool=pool))
        vectors = other.vectors([other.task(state, i) for i in range(len(case.problems))])
        case.pool.count += pool.count
        for own, changed, plain in zip(columns, vectors, base, strict=True):
            own.append(difference(plain, changed))
    return tuple(np.column_stack(own) for own in columns)


def path_errors(case: Case, state: State, tick: Progress) -> tuple[Array, ...]:
    """Per push (m, e): how the case's rollout changes with each of the errors that its hand's path may have.

    By one standard deviation of the path, so that each push has an unknown multiple of them, as of ``numerics``.
    """
    fitter, count = Fitter(case), len(case.problems)
    columns = []
    for i, features in enumerate(case.features):
        task = fitter.task(state, i)
        errors = task.problem.path_errors
        if errors:
            tick("errors of the hand's path", i, count)
        others = [dc.replace(task, problem=dc.replace(task.problem, path=error.path)) for error in errors]
        base, *moved = fitter.vectors([task, *others]) if errors else [features.recorded]
        own = [difference(base, one) / error.stds for one, error in zip(moved, errors, strict=True)]
        columns.append(np.column_stack([np.zeros((len(base), 0)), *own]))
    return tuple(columns)


def _other_contact(config: CellConfig) -> CellConfig:
    other = "point" if config.contact.model == "hydroelastic" else "hydroelastic"
    return dc.replace(config, contact=dc.replace(config.contact, model=other))


def coarse(case: Case) -> Case:
    """The case on ticks twice as long: good enough for what a small change does, and twice as fast."""
    config = dc.replace(case.config, solver=case.config.solver.scaled(2.0))
    return dc.replace(case, pool=case.pool.of(spec_of(case.recording, config)))


def least_squares(case: Case, at: Fitted) -> Fitted:
    """The plain cell at the theta that fits best if all that is left over were noise.

    Far from an explanation the marginal cost is about shapes of motion that the plain cell cannot have: for a tenth
    of a millimetre of those it lets all distances go wrong, which the pushes' own frictions then take up.

    Args:
        case: the pushes.
        at: a plain model that says where to start, and how much is left over.
    """
    loud = Fitter(_blunted(case, at))
    return loud.fit(loud.start(at.state.u), rounds=CAREFUL, careful=CAREFUL + 1, like=at, renew=True)


def nearest(rough: Case, case: Case, plain: Fitted) -> Fitted | None:
    """The plain cell where it predicts best, by least squares; None where it was fitted well enough.

    Args:
        rough: the case on longer ticks, to which the plain fit belongs.
        case: the case on its own ticks, to which the model that is returned belongs.
        plain: the plain fit.
    """
    if plain.reduced_chi2 <= FAR_OFF:
        return None
    return Fitter(_blunted(case, plain)).refine(least_squares(rough, plain))


def _blunted(case: Case, at: Fitted) -> Case:
    """The case with poses, and forces, as noisy as a model leaves them, in the units of the old."""
    counts = [3 * len(one.middles) for one in case.features]
    poses = np.concatenate([push.residual[:n] for push, n in zip(at.pushes, counts, strict=True)])
    forces = np.concatenate([push.residual[n:] for push, n in zip(at.pushes, counts, strict=True)])
    features = []
    for one, n in zip(case.features, counts, strict=True):
        times = np.full(len(one.recorded), _loudness(poses))
        times[n:] = _loudness(forces)
        features.append(dc.replace(one, noise=one.noise * np.outer(times, times)))
    return dc.replace(case, features=tuple(features))


def _odd_blunted(case: Case, at: Fitted) -> Case:
    """The case with each push as noisy as a model leaves it."""
    features = []
    for one, push in zip(case.features, at.pushes, strict=True):
        features.append(dc.replace(one, noise=one.noise * _loudness(push.residual) ** 2))
    return dc.replace(case, features=tuple(features))


def _few_are_odd(fitted: Fitted) -> bool:
    """Whether a quarter of the pushes carries nearly all of what a model leaves."""
    squares = np.sort([float(push.residual @ push.residual) for push in fitted.pushes])[::-1]
    return float(squares[: len(squares) // 4].sum()) >= ODD * float(squares.sum())


def _without_the_odd(case: Case, at: Fitted) -> Fitted:
    """A plain fit that starts from where theta is best for the pushes that are explained.

    An object that is about to slip off the hand goes one way or the other. Where one such push goes the wrong way, no
    step of theta that it speaks of leads back: it shouts louder than all others together.
    """
    most = Fitter(_odd_blunted(case, at))
    theta = most.fit(most.start(at.state.u), rounds=CAREFUL, careful=CAREFUL, renew=True).state.u
    fitter = Fitter(case)
    again = fitter.fit(fitter.start(theta), rounds=CAREFUL, careful=CAREFUL, renew=True)
    return max((at, again), key=lambda one: one.score)


def _loudness(left: Array) -> float:
    """How many of its deviations something is off, at least 1."""
    return max(1.0, math.sqrt(float(np.mean(left**2)))) if len(left) else 1.0


def _nominal(case: Case) -> Array:
    """Where people would start by hand, a point (d,) of the unit cube."""
    return np.asarray(case.thetas.space.to_unit(case.thetas.space.nominal))


def _nearest_from(case: Case, u: Array) -> Fitted:
    """The plain cell where it predicts best, by least squares from a point (d,) of the unit cube."""
    fitter = Fitter(case)
    there = fitter.linearise(fitter.start(u), learn_scatter=False)
    return fitter.seen_from(there, fitter.start(least_squares(case, there).state.u), learn_scatter=False)


def _squares_at_rest(fitted: Fitted) -> float:
    """Mean square of what a model leaves with the pushes' own unknowns at zero, in standard deviations."""
    at_zero = np.concatenate([push.residual for push in fitted.pushes])
    return float(np.mean(at_zero**2))


def fit_plain(case: Case, rng: np.random.Generator, tick: Progress) -> Fitted:
    """The plain cell fitted, without guard and tolerances.

    Where something large is missing, the pushes' own unknowns stay at zero: moved, they would imitate it, and effects
    would be looked for from a place where nothing is as it was recorded. What is missing may then be so much larger
    than what theta changes that the search ends anywhere; so the nominal theta is a start, too.
    """
    u = search_theta(case, rng, tick)
    fitter = Fitter(case)
    first = fitter.fit(
        fitter.start(u),
        rounds=CAREFUL,
        careful=CAREFUL,
        renew=True,
        say=lambda text: tick(f"plain fit, {text}", 0, 0),
    )
    if first.reduced_chi2 > FAR_OFF and _few_are_odd(first):
        tick("plain fit without what is odd", 0, 0)
        first = _without_the_odd(case, first)
    if first.reduced_chi2 > FAR_OFF:
        tick("plain fit with as much noise as it leaves", 0, 0)
        first = min((first, *(_nearest_from(case, start) for start in (u, _nominal(case)))), key=_squares_at_rest)
        if first.reduced_chi2 > FAR_OFF:
            return first
    return fitter.fit(
        first.state, rounds=4, like=first, renew=True, say=lambda text: tick(f"plain fit, {text}", 0, 0)
    )  # fmt: skip
