"""Generalisation across regimes: from slow to fast pushes, and from some headings to others."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.location import headings_of, speeds_of
from physid_drake.diagnose.values import RegimeGain
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.pushes.case import Case
from physid_drake.pushes.problem import push_speed

Array = NDArray[np.float64]

FEWEST = 3  # pushes of a regime
FASTER = 2.0  # the median of the fast over that of the slow pushes: less is one regime
APART = 1.0  # rad between the mean headings of two groups: less is one direction


def regime_gains(fitter: Fitter, before: Fit, after: Fit) -> tuple[RegimeGain, ...]:
    """Gains of one half of the pushes when both models are fitted to the other half only.

    Halves are made by speed and by heading, where these differ enough.

    Args:
        fitter: of the fits.
        before: the baseline model.
        after: the model with effects.
    """
    found, case = [], fitter.case
    for halves, words in ((_by_speed(case), _speeds), (_by_heading(case), _headings)):
        if halves is None:
            continue
        names = tuple(words(case, half) for half in halves)
        gains = fitter.held_out(after, halves) - fitter.held_out(before, halves)
        for tested, fitted in ((1, 0), (0, 1)):
            own = gains[list(halves[tested])]
            found.append(
                RegimeGain(
                    fitted_on=names[fitted], tested_on=names[tested], gain=float(own.sum()),
                    standard_error=standard_error(own),
                )
            )  # fmt: skip
    return tuple(found)


def standard_error(values: Array) -> float:
    """Standard error of the sum of independent values (n,); infinite for one value."""
    return float(np.std(values, ddof=1) * np.sqrt(len(values))) if len(values) > 1 else math.inf


Halves = tuple[tuple[int, ...], tuple[int, ...]]


def _by_speed(case: Case) -> Halves | None:
    """The slow and the fast pushes; None where they are about as fast."""
    speeds = np.array([speed_of(case, i) for i in range(len(case.problems))])
    order = np.argsort(speeds, kind="stable")
    slow, fast = np.array_split(order, 2)
    if len(fast) < FEWEST or np.median(speeds[fast]) < FASTER * np.median(speeds[slow]):
        return None
    return tuple(slow.tolist()), tuple(fast.tolist())


def speed_of(case: Case, i: int) -> float:
    """Speed of push ``i`` [m/s], as defined by ``push_speed``."""
    return push_speed(case.problems[i])


def _speeds(case: Case, half: Sequence[int]) -> str:
    """The range of speeds of some pushes."""
    return speeds_of([speed_of(case, i) for i in half])


def _headings(case: Case, half: Sequence[int]) -> str:
    """The range of headings of some pushes."""
    return headings_of([math.atan2(*_moves(case)[i, ::-1]) for i in half])


def _moves(case: Case) -> Array:
    """From each object's start to its end (n, 2) [m]."""
    return np.array([p.poses[-1, :2] - np.array(p.start.pose[:2]) for p in case.problems])


def _by_heading(case: Case) -> Halves | None:
    """Pushes that went to either side of the axis along which headings spread most; None where all go one way."""
    moves = _moves(case)
    headings = moves / np.maximum(np.linalg.norm(moves, axis=1, keepdims=True), 1e-9)
    centred = headings - headings.mean(axis=0)
    axis = np.linalg.eigh(centred.T @ centred)[1][:, -1]
    order = np.argsort(headings @ axis, kind="stable")
    first, second = np.array_split(order, 2)
    if len(second) < FEWEST:
        return None
    means = [headings[half].mean(axis=0) for half in (first, second)]
    cosine = float(means[0] @ means[1]) / max(float(np.linalg.norm(means[0]) * np.linalg.norm(means[1])), 1e-9)
    if np.arccos(np.clip(cosine, -1.0, 1.0)) < APART:
        return None
    return tuple(first.tolist()), tuple(second.tolist())
