"""Recorded forces as they are compared: means over short windows, but for those that tell nothing of the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath
from physid_drake.recording import Push, motion_span

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

WINDOW = 0.1  # s: forces are compared as means over such windows; single samples of a stiff contact chatter
SHARE = 0.05  # of the largest force: how well a rigid-body contact force is expected to be predicted
LOADED = 0.3  # of the largest force: a window with more has contact
TOUCH_SIGMAS = 3.0  # of the start pose
STRIKE = 5e-3  # s: longer than two hard bodies touch
STRIKE_SIGMAS = 3.0  # of a window's mean
STANDS = 0.05  # of its largest speed while the object moves: a hand that is slower stands
STRIKE_SHARE = 0.1  # of the largest force: ten samples, of which one has all of it, saw no strike but the touch


@dataclass(frozen=True, kw_only=True)
class ForceWindows:
    """Mean forces on the object.

    Attributes:
        middles: (k,) of the windows [s].
        means: (k, 2), x and y of W [N].
        stds: (k,) of each component [N]: the sensor's noise, and how well a contact force is predicted.
    """

    middles: Array
    means: Array
    stds: Array


def offsets() -> Array:
    """Of ten samples within a window, from its middle [s]."""
    return np.asarray(WINDOW * np.linspace(-0.45, 0.45, 10))


def force_windows(push: Push, path: HandPath | None, sensor_std: float, start_std: float) -> ForceWindows:
    """The windows of a push whose force tells something of the object.

    Args:
        push: with or without forces.
        path: of the hand; None without one.
        sensor_std: of a sample of a component [N].
        start_std: of the object's start along an axis [m].
    """
    if push.force is None:
        return ForceWindows(middles=np.zeros(0), means=np.zeros((0, 2)), stds=np.zeros(0))
    times, forces = push.force.times, push.force.forces[:, :2]
    parts = windows_of(times)
    middles = np.array([times[part].mean() for part in parts])
    means = np.array([forces[part].mean(axis=0) for part in parts]).reshape(-1, 2)
    white = sensor_std / np.sqrt([len(part) for part in parts])
    silent = _struck([forces[part] for part in parts], means, white) | _resting(push, middles)
    if path is not None:
        silent |= _touching(path, middles, means, white, start_std) | _standing(push, path, middles)
    told = ~silent
    largest = float(np.linalg.norm(means[told], axis=1).max(initial=0.0))
    return ForceWindows(middles=middles[told], means=means[told], stds=np.hypot(white[told], SHARE * largest))


def too_seldom(push: Push) -> bool:
    """Whether forces are recorded, but none of their windows has two samples."""
    return push.force is not None and not windows_of(push.force.times)


def windows_of(times: Array) -> list[NDArray[np.intp]]:
    """Indices of the samples of each window; of one sample none is made."""
    index = np.floor((times - times[0]) / WINDOW + 1e-6)
    windows = np.split(np.arange(len(times)), np.flatnonzero(np.diff(index)) + 1)
    return [window for window in windows if len(window) >= 2]


def _struck(samples: Sequence[Array], means: Array, white: Array) -> Mask:
    """Windows (k,) whose mean a few samples make: a strike is over in so few, and what a sensor sees of it is chance.

    Args:
        samples: of each window, (n, 2) [N].
        means: (k, 2) of the windows [N].
        white: (k,) deviations of the means by the sensor's noise [N].
    """
    rest = np.array([_without_its_peak(window) for window in samples]).reshape(-1, 2)
    usual = float(np.linalg.norm(rest, axis=1).max(initial=0.0))
    made_by_peaks = np.linalg.norm(means - rest, axis=1)
    struck: Mask = made_by_peaks > np.hypot(STRIKE_SIGMAS * white, STRIKE_SHARE * usual)
    return struck


def _without_its_peak(window: Array) -> Array:
    """Mean (2,) of the samples (n, 2) of a window but the largest, as many as a strike lasts."""
    peak = max(1, round(STRIKE / WINDOW * len(window)))
    mean: Array = window[np.argsort(np.linalg.norm(window, axis=1))[:-peak]].mean(axis=0)
    return mean


def _resting(push: Push, middles: Array) -> Mask:
    """Windows (k,) that reach into the object's last rest.

    A hand that stops against it may hold any force between none and what starts it again: friction holds as much.
    """
    resting: Mask = middles + 0.5 * WINDOW > motion_span(push)[1]
    return resting


def _standing(push: Push, path: HandPath, middles: Array) -> Mask:
    """Windows (k,) that reach into a standstill of the hand.

    What it has stopped pushing holds it as any object at rest does, which a noisy tracker does not always see.
    """
    ends = middles + 0.5 * WINDOW
    speeds = np.linalg.norm(path.positions(ends) - path.positions(ends - 0.1 * WINDOW), axis=1) / (0.1 * WINDOW)
    standing: Mask = speeds < STANDS * path.top_speed(*motion_span(push))
    return standing


def _touching(path: HandPath, middles: Array, forces: Array, stds: Array, start_std: float) -> Mask:
    """Windows (k,) about the first touch.

    A slow hand meets an object whose place the tracker knows to ``start_std`` [m] that much earlier or later: there
    the force jumps between nothing and all, and tells nothing but the gap. A fast one strikes it for a few
    milliseconds, and how much of that peak a sensor's samples catch is chance.
    """
    sizes = np.linalg.norm(forces, axis=1)
    loaded: Mask = sizes > np.maximum(LOADED * sizes.max(initial=0.0), stds)
    if not loaded.any() or loaded[0]:
        return np.zeros(len(middles), dtype=bool)
    touch = float(middles[np.argmax(loaded)])
    way = path.positions(np.array([touch, touch + 2.0 * WINDOW]))
    speed = float(np.linalg.norm(way[1] - way[0])) / (2.0 * WINDOW)
    unsure = TOUCH_SIGMAS * start_std / max(speed, 1e-6)
    near: Mask = np.abs(middles - touch) < unsure + 0.5 * WINDOW
    return near
