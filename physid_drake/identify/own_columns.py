"""What a push's misfit does with all that the push has for itself: columns that are marginalised over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from physid_drake.pushes.misfit import difference, model_error_columns
from physid_drake.pushes.noise import Noise
from physid_drake.pushes.nuisance import Nuisance
from physid_drake.pushes.problem import PushProblem
from physid_drake.pushes.task import Task

Array = NDArray[np.float64]

NUISANCE_STEP = 0.5  # of the prior standard deviation


def own_tasks(problem: PushProblem, nuisance: Nuisance, theta: Array) -> list[Task]:
    """Rollouts of a push at theta (d,): with nothing known of it, then one for each column.

    They are steps of its k unknowns, and the e errors that the path of its hand may have.
    """
    rest = np.zeros(len(nuisance.names))
    others = [replace(problem, path=error.path) for error in problem.path_errors]
    made = [(problem, step) for step in (rest, *(NUISANCE_STEP * np.diag(nuisance.stds)))]
    made += [(other, rest) for other in others]
    return [Task(problem=one, theta=theta, nuisance=nuisance, values=values) for one, values in made]


def own_columns(problem: PushProblem, noise: Noise, residuals: Sequence[Array]) -> Array:
    """How the misfit (m,) changes by one standard deviation of each: columns (m, k + e + 3).

    The unknowns come first, in their order; then the errors of the path, and of the cell.

    Args:
        problem: the push.
        noise: its noise.
        residuals: (m,) of the rollouts of ``own_tasks``.
    """
    base, *moved = residuals
    of_path = [error.stds for error in problem.path_errors]
    steps = [NUISANCE_STEP] * (len(moved) - len(of_path)) + of_path
    columns = [difference(base, one) / step for one, step in zip(moved, steps, strict=True)]
    # The model error begins when the object starts to move.
    return np.column_stack([*columns, model_error_columns(problem, noise, problem.moving[0])])
