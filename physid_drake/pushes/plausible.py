"""What is true of hardly any recording: a table like a hall, forces in mN, a push twice, an object that hovers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.solid import Solid, solid_of
from physid_drake.cell.touch import Tip
from physid_drake.pushes.force_windows import windows_of
from physid_drake.pushes.frame_checks import HEAVIEST, LIGHTEST, moves
from physid_drake.recording import Push, Recording
from physid_drake.recording.clocks import FEWEST

Array = NDArray[np.float64]

FEW_NAMES = 5
WIDE_TABLE = 20.0  # m: longer than any in a laboratory
LIGHT, HEAVY = 5.0, 12000.0  # kg/m^3 of the box around an object: lighter than foam, heavier than lead
GRAVITY = 9.81  # m/s^2
# Of an object's weight. Friction of 0.02 to 2 times the load, and what it takes to set an object moving, are within;
# a force in mN is a thousand times beyond, and so is one in kN.
WEAKEST, STRONGEST = 0.01, 20.0
LIGHTEST_GUESS, HEAVIEST_GUESS = 20.0, 8000.0  # kg/m^3, between which a mass is sought that nobody stated
UNTOUCHED = 5e-3  # m between tip and face: nothing is touched
FEW_FORCES = 10  # samples, of which no mean is taken
OFFSET = 0.2  # of the force that pushes: less is drift and noise
HOVERS = 0.01  # m above or below the table: beyond a frame's errors
HOVERS_SHARE = 0.25  # of its height: half of it is an origin at the object's foot
HASTY = 4e-4  # s between samples of the object: no tracker is as fast, and one of 40 Hz seems so in minutes
LAST = 4  # quarters of a push, in the last of which the object has come down


def implausible(recording: Recording) -> tuple[str, ...]:
    """What to look at again, in words."""
    solid = solid_of(recording.object.shape)
    return (
        *_table(recording, solid),
        *_density(recording, solid),
        *_forces(recording, solid),
        *_forces_untouched(recording, solid),
        *_hasty(recording),
        *_hovering(recording, solid),
        *_never_turning(recording),
        *_repeated(recording),
    )


def some_names(names: Sequence[str]) -> str:
    """The first few of many pushes."""
    more = f" and {len(names) - FEW_NAMES} more" if len(names) > FEW_NAMES else ""
    return ", ".join(names[:FEW_NAMES]) + more


def _table(recording: Recording, solid: Solid) -> tuple[str, ...]:
    x0, y0, x1, y1 = solid.underside.extent()
    size = recording.table.size
    if max(size) > WIDE_TABLE:
        return (f"the table is {size[0]:g} m by {size[1]:g} m; is its size in m?",)
    if min(size) < min(x1 - x0, y1 - y0):
        return (
            f"the table, {size[0]:g} m by {size[1]:g} m, is smaller than the object; are both sizes in m?",
        )  # fmt: skip
    return ()


def _density(recording: Recording, solid: Solid) -> tuple[str, ...]:
    mass = recording.object.mass
    density = None if mass is None else mass / _volume(solid)
    if density is None or LIGHT <= density <= HEAVY or not LIGHTEST < density < HEAVIEST:
        return ()  # what is not between the latter two is refused
    what = "lighter than foam" if density < LIGHT else "heavier than lead"
    return (f"with {mass:g} kg the object would be {what} ({density:.3g} kg/m^3); is its mass in kg?",)


def _volume(solid: Solid) -> float:
    """Of the box around an object [m^3]."""
    x0, y0, x1, y1 = solid.outline.extent()
    return (x1 - x0) * (y1 - y0) * solid.height


def _forces(recording: Recording, solid: Solid) -> tuple[str, ...]:
    """Forces that hardly any friction takes, by the mass that was weighed, or by any that such an object has."""
    usual = [_pushing_force(push) for push in recording.pushes if push.force is not None and moves(push)]
    if not usual or not max(usual) > 0.0:
        return ()
    force, mass = float(np.median(usual)), recording.object.mass
    guesses = [density * _volume(solid) for density in (LIGHTEST_GUESS, HEAVIEST_GUESS)]
    light, heavy = guesses if mass is None else (mass, mass)
    if WEAKEST * GRAVITY * light <= force <= STRONGEST * GRAVITY * heavy:
        return ()
    against = "any that such an object can have" if mass is None else f"{mass * GRAVITY:.3g} N"
    return (
        f"the hand pushes with {force:.3g} N (largest mean over a tenth of a second, median over pushes), and the"
        f" object's weight is {against}; are forces in N, and its mass in kg?",
    )


def _forces_untouched(recording: Recording, solid: Solid) -> tuple[str, ...]:
    """Forces that are felt before the tip is at the object: an offset of the sensor, or the tool's weight."""
    forced = [push for push in recording.pushes if push.force is not None]
    if not forced or recording.hand is None:
        return ()
    every = [push.force.forces for push in forced if push.force is not None]
    if all(float(np.ptp(forces, axis=0).max()) == 0.0 for forces in every) and any(forces.any() for forces in every):
        return ("the force is the same in all samples of a push; is it the right column or topic?",)
    tip = Tip(solid.outline, recording.hand.radius)
    means = [mean for push in forced if (mean := _mean_untouched(push, tip)) is not None]
    pushing = [_pushing_force(push) for push in forced if moves(push)]
    if not means or not pushing:
        return ()
    offset = float(np.linalg.norm(np.median(means, axis=0)))
    if not offset > OFFSET * float(np.median(pushing)):
        return ()
    return (
        f"forces are {offset:.3g} N (mean, median over pushes) while the tip is {1e3 * UNTOUCHED:g} mm and more from"
        " the object; take the offset away (map: force: tare_s), or the tool's weight (weight_n)",
    )


def _mean_untouched(push: Push, tip: Tip) -> Array | None:
    """The mean force in the plane (2,) [N] before the tip is first near the object; None of few samples."""
    assert push.force is not None
    if push.hand is None:
        return None
    times, hand, planar = push.force.times, push.hand, push.object.planar
    at = [np.interp(times, hand.times, column) for column in hand.positions[:, :2].T]
    poses = [np.interp(times, push.object.times, column) for column in planar.T]
    near = [tip.gap(*state)[0] < UNTOUCHED for state in np.column_stack([*poses, *at]).tolist()]
    before = int(np.argmax(near)) if any(near) else 0
    return np.asarray(push.force.forces[:before, :2].mean(axis=0)) if before >= FEW_FORCES else None


def _pushing_force(push: Push) -> float:
    """The largest mean over a window [N]; 0 where none has two samples."""
    assert push.force is not None
    forces = push.force.forces[:, :2]
    means = [np.linalg.norm(forces[window].mean(axis=0)) for window in windows_of(push.force.times)]
    return float(max(means, default=0.0))


def _hasty(recording: Recording) -> tuple[str, ...]:
    """Times in minutes, which are sixty times as dense."""
    streams = [push.object.times for push in recording.pushes if len(push.object) >= FEWEST]
    intervals = [float(np.median(np.diff(times))) for times in streams]
    usual = float(np.median(intervals)) if intervals else HASTY
    if usual >= HASTY:
        return ()
    return (
        f"the object's samples are {1e3 * usual:.2g} ms apart (median); are times in seconds, and those of the"
        " measurement?",
    )


def _hovering(recording: Recording, solid: Solid) -> tuple[str, ...]:
    """Objects whose middle is not half their height above the table as they have come to rest."""
    allowed = max(HOVERS, HOVERS_SHARE * solid.height)
    heights = [_last_height(push) - 0.5 * solid.height for push in recording.pushes]
    off = {p.name: h for p, h in zip(recording.pushes, heights, strict=True) if abs(h) > allowed}
    if not off:
        return ()
    middle = float(np.median(list(off.values())))
    where = "above" if middle > 0.0 else "below"
    return (
        f"the object's middle ends {1e3 * abs(middle):.0f} mm {where} where it is as the object stands on the table"
        " (median); z = 0 of W is the table's top, and B's origin the middle of the object's shape:"
        f" {some_names(list(off))}",
    )


def _last_height(push: Push) -> float:
    heights = push.object.positions[:, 2]
    return float(np.median(heights[-max(1, len(heights) // LAST) :]))


def _never_turning(recording: Recording) -> tuple[str, ...]:
    """A rotation that is filled in, and was not measured."""
    turns = [push.object.quaternions for push in recording.pushes if moves(push) and push.object.rotation != "none"]
    if not turns or any((turn != turns[0][0]).any() for turn in turns):
        return ()
    return (
        "the object's rotation is the same to the last digit in all samples of all pushes, while it moves; was it"
        " measured?",
    )


def _repeated(recording: Recording) -> tuple[str, ...]:
    """Pushes that hold the same samples, whatever their times."""
    found: dict[bytes, list[str]] = {}
    for push in recording.pushes:
        streams = (push.object, *(() if push.hand is None else (push.hand,)))
        key = b"".join(part.tobytes() for stream in streams for part in (stream.positions, stream.quaternions))
        found.setdefault(key, []).append(push.name)
    alike = [names for names in found.values() if len(names) > 1]
    if not alike:
        return ()
    names = "; ".join(some_names(group) for group in alike[:FEW_NAMES])
    return (f"pushes hold the same samples: {names}; are they one push? It counts as several",)
