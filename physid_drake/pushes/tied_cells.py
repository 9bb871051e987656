"""A prior under which neighbouring friction cells have about the same friction."""

from __future__ import annotations

import dataclasses as dc
import itertools
import math

import numpy as np
from scipy.spatial.distance import cdist

from physid_drake.cell.outline import Outline
from physid_drake.errors import ConfigError
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.theta import ThetaMap, friction_names

LEVEL_STD = 1.0  # of ln friction, common to all cells: about what bounds of 0.02 and 1.2 leave open


def tied_cells(thetas: ThetaMap, outline: Outline, config: ThetaConfig) -> ThetaMap:
    """The same parameters with a prior under which neighbouring cells have about the same friction.

    ln friction is a level that all cells share plus a Gaussian process over the underside, whose correlation falls
    with the distance of the cells' centres as exp(-distance / length): on a line, a Markov process.

    Args:
        thetas: the parameters; without a grid they are returned as they are.
        outline: of the object, over whose box the grid lies.
        config: ``cell_spread`` and ``cell_length``.

    Raises:
        ConfigError: if one of the two is not above 0.
    """
    if not (config.cell_spread > 0.0 and config.cell_length > 0.0):
        raise ConfigError(
            f"theta: cell_spread and cell_length must be above 0, but are {config.cell_spread:g} and"
            f" {config.cell_length:g}."
        )
    names = friction_names(thetas.cells)
    space = thetas.space
    places = {name: k for k, name in enumerate(names) if name in space.names}
    if len(names) == 1 or not places:
        return thetas
    low_x, low_y, high_x, high_y = outline.extent()
    size = np.array([high_x - low_x, high_y - low_y])
    index = np.array(list(itertools.product(range(thetas.cells[0]), range(thetas.cells[1]))))
    centres = (index + 0.5) / thetas.cells * size
    decay = np.exp(-cdist(centres, centres) / (config.cell_length * size.max()))
    std = math.hypot(LEVEL_STD, config.cell_spread)
    tie = (LEVEL_STD**2 + config.cell_spread**2 * decay) / std**2
    np.fill_diagonal(tie, 1.0)
    correlation = np.eye(space.dimension)
    for a, b in itertools.product(places, places):
        correlation[space.index(a), space.index(b)] = tie[places[a], places[b]]
    parameters = tuple(dc.replace(p, prior_std=std) if p.name in places else p for p in space.parameters)
    rows = tuple(map(tuple, correlation.tolist()))
    return dc.replace(thetas, space=dc.replace(space, parameters=parameters, correlation=rows))
