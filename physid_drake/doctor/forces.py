"""What a recording may have got wrong of its forces, and of the mass, which forces alone tell."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Final

from physid_drake.doctor.convention import Convention, each_push
from physid_drake.recording import ForceStream, Push, Recording

POUND: Final = 0.45359237
"""kg."""
EARTH: Final = 9.80665
"""m/s^2."""


def conventions_of_forces(recording: Recording) -> Iterator[Convention]:
    """What may be wrong with forces, and with the mass, which forces alone tell."""
    yield from _forces(recording)
    yield from _masses(recording)


def without_forces(recording: Recording) -> Recording:
    """The recording without its forces; itself where there are none."""
    if all(push.force is None for push in recording.pushes):
        return recording
    return each_push(recording, lambda push: replace(push, force=None))


def _forces(recording: Recording) -> Iterator[Convention]:
    yield Convention(
        says="the force is that of the object on the hand",
        remedy="map: force: acts_on: hand",
        recording=each_push(recording, partial(_scaled, factor=-1.0)),
    )
    factors: Sequence[tuple[float, str]] = (
        (1e-3, "mN"), (1e3, "kN"), (EARTH, "kgf"), (1e-3 * EARTH, "gf"), (POUND * EARTH, "lbf"),
    )  # fmt: skip
    for factor, unit in factors:
        yield Convention(
            says=f"forces are in {unit}",
            remedy=f"map: force: unit: {unit}",
            recording=each_push(recording, partial(_scaled, factor=factor)),
        )


def _scaled(push: Push, factor: float) -> Push:
    force = push.force
    scaled = None if force is None else ForceStream(times=force.times, forces=factor * force.forces)
    return replace(push, force=scaled)


def _masses(recording: Recording) -> Iterator[Convention]:
    mass, std = recording.object.mass, recording.object.mass_std
    if mass is None or std is None:
        return
    for factor, unit in ((POUND, "lb"), (1.0 / EARTH, "N"), (1e-3, "g")):
        yield Convention(
            says=f"the mass is in {unit}",
            remedy=f"object: mass_kg: {factor * mass:.4g}",
            recording=replace(
                recording, object=replace(recording.object, mass=factor * mass, mass_std=factor * std)
            ),
        )  # fmt: skip
