"""A noise that is stated far too large: what rests say against it, and what a fit leaves below it."""

from __future__ import annotations

import math

import numpy as np
from scipy import stats

from physid_drake.pushes.frame_checks import reach_of
from physid_drake.pushes.noise import (
    FINEST_FORCE,
    FINEST_HAND,
    finest_position,
    finest_rotation,
    hand_noise,
)
from physid_drake.recording import Push, Recording, estimate_noise
from physid_drake.recording.rest_noise import SILENT

MANY_TIMES = 8.0
"""What is stated over what is seen. A tracker that smooths shows less at rest than it is wrong by, as the square root
of the samples it takes together: 64 of them would blur a push as well."""

VISIBLE = 3.0  # standard deviations: what moves by less is not seen to move
FAR_BELOW = 0.25  # reduced chi-square: noise that is twice what is left
BY_CHANCE = 1e-3  # that honest noise leaves as little


def quieter_by(reduced_chi2: float, degrees: float) -> float | None:
    """How many times the noise that counts is larger than what a fit leaves; None unless it is surely far larger."""
    if degrees < 1 or reduced_chi2 > FAR_BELOW or stats.chi2.cdf(reduced_chi2 * degrees, degrees) > BY_CHANCE:
        return None
    return 1.0 / math.sqrt(max(reduced_chi2, 1e-12))


def too_loud(recording: Recording) -> tuple[str, ...]:
    """Stated figures that are many times what the recording shows, or hide what moves in it."""
    return (*_louder_than_seen(recording), *_hiding_motion(recording))


def _louder_than_seen(recording: Recording) -> tuple[str, ...]:
    said, seen = recording.sensors, estimate_noise(recording)
    # A commanded stream has no noise: what is stated is how far the hand is from it.
    hand = None if recording.hand is None or recording.hand.stream == "commanded" else hand_noise(recording)[0]
    place, turn = said.object_position_std, said.object_rotation_std
    figures = (
        ("object_position_std_m", "m", place, seen.object_position_std, finest_position(recording)),
        ("object_rotation_std_rad", "rad", turn, seen.object_rotation_std, finest_rotation(recording)),
        ("hand_position_std_m", "m", said.hand_position_std, hand, FINEST_HAND),
        ("force_std_n", "N", said.force_std, seen.force_std, FINEST_FORCE),
    )
    return tuple(
        f"{key} states {stated:.3g} {unit}, {stated / shown:.0f} times the {shown:.2g} {unit} that the stream shows;"
        f" is it in {unit}? A tracker that smooths shows less, but hardly so much less; effects smaller than the"
        " stated noise cannot be detected"
        for key, unit, stated, shown, finest in figures
        if stated is not None and shown is not None and shown > SILENT * finest and stated > MANY_TIMES * shown
    )


def _hiding_motion(recording: Recording) -> tuple[str, ...]:
    """Where the object moves by no more than a noise that somebody stated."""
    stated = recording.sensors.object_position_std
    if stated is None:
        return ()
    usual = float(np.median([_way(push, reach_of(recording)) for push in recording.pushes]))
    if stated == 0.0 or usual > VISIBLE * stated:
        return ()
    return (
        f"object_position_std_m states {1e3 * stated:.3g} mm, and the object moves by {1e3 * usual:.3g} mm (median);"
        " is it in m? Such noise hides what the object does",
    )


def _way(push: Push, reach: float) -> float:
    """How far a corner of the object comes from where it begins, at most [m]."""
    planar = push.object.planar
    away = planar - planar[0]
    return float((np.hypot(away[:, 0], away[:, 1]) + reach * np.abs(away[:, 2])).max())
