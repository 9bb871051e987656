"""Paths that are fitted to streams of the hand, without their errors."""

import math

from physid_drake.cell.hand_fit import fit_uncertain_paths


def fit_hand_paths(streams, std):
    return tuple(path for path, _ in fit_uncertain_paths(streams, std, least=math.inf))


def fit_hand_path(times, positions, std):
    return fit_hand_paths([(times, positions)], std)[0]
