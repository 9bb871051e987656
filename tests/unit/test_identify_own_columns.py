"""What a push has for itself: its unknowns, and errors of the path of its hand, as columns of its misfit."""

from dataclasses import replace

import numpy as np
import pytest
from runs import coarse_identifier, shipped_pushes

from physid_drake.cell.hand_path import PathError
from physid_drake.identify.own_columns import NUISANCE_STEP, own_columns, own_tasks
from physid_drake.identify.polish import Polisher
from physid_drake.pushes.misfit import whitened_residual
from physid_drake.pushes.nuisance import SPEED_STD, nuisance_of


@pytest.fixture(scope="module")
def identifier():
    return coarse_identifier(shipped_pushes(3))


def columns_of(identifier, problem):
    tasks = own_tasks(problem, nuisance_of(problem, 0.02), identifier.thetas.space.nominal)
    pairs = zip(tasks, identifier.pool.run(tasks), strict=True)
    return own_columns(
        problem, identifier.noise, [whitened_residual(t.problem, identifier.noise, p) for t, p in pairs]
    )


def test_an_error_of_the_path_counts_as_the_unknown_that_moves_the_hand_alike(identifier):
    faster = identifier.problems[0].path.faster(NUISANCE_STEP * SPEED_STD)
    problem = replace(identifier.problems[0], path_errors=(PathError(path=faster, stds=NUISANCE_STEP),))
    columns, nuisance = columns_of(identifier, problem), nuisance_of(problem, 0.02)
    own = len(nuisance.names)
    assert columns.shape[1] == own + 1 + 3  # the cell's own error comes last
    speed = columns[:, nuisance.index("speed")]
    assert np.linalg.norm(speed) > 1.0
    np.testing.assert_array_equal(columns[:, own], speed)
    without = columns_of(identifier, replace(problem, path_errors=()))
    np.testing.assert_array_equal(without, np.delete(columns, own, axis=1))


def test_pushes_whose_paths_may_be_off_tell_less_of_theta(identifier):
    """By 2 mm along x and along y here."""

    def spread(problems):
        polisher = Polisher(identifier.pool, problems, identifier.noise, 0.02)
        whiteners = polisher._linearise(identifier.thetas.space.nominal)
        slope = polisher._jacobian(np.full(identifier.thetas.space.dimension, 0.5), whiteners)
        return np.sqrt(np.diag(np.linalg.inv(slope.T @ slope)))

    def aside(path, *way):
        return PathError(path=replace(path, start=path.start + way), stds=1.0)

    sure = [replace(p, path_errors=()) for p in identifier.problems]
    unsure = [replace(p, path_errors=(aside(p.path, 0.002, 0.0), aside(p.path, 0.0, 0.002))) for p in sure]
    ratios = spread(unsure) / spread(sure)
    assert (ratios >= 0.999).all()
    # Where the hand touches is what tells its friction. Measured: 1.045; 1 if the errors are left out.
    assert ratios[identifier.thetas.space.names.index("hand_friction")] > 1.02
