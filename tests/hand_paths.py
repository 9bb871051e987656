"""Hand paths: straight ones, and those that are fitted to streams, without their errors."""

import math

import numpy as np

from physid_drake.cell import HandPath
from physid_drake.cell.hand_fit import fit_uncertain_paths


def straight_path(start, end, begin, duration):
    """At constant speed from ``start`` to ``end`` (2,) [m]."""
    velocity = (end - start) / duration
    return HandPath(times=np.array([begin, begin + duration]), velocities=np.array([velocity, velocity]), start=start)


def fit_hand_paths(streams, std):
    return tuple(path for path, _ in fit_uncertain_paths(streams, std, least=math.inf))


def fit_hand_path(times, positions, std):
    return fit_hand_paths([(times, positions)], std)[0]
