"""Converts the slides that end the ContactNets tosses of a cube (Pfrommer, Halm, Posa, CoRL 2020).

Source: ``contactnets_all.npz`` of github.com/DAIRLab/contact-nets: ``traj`` holds the rows of all tosses one after
the other, ``length`` the rows of each; a row is position (3) [m], quaternion (4), velocity (3), angular velocity (3).
No hand. What a toss is used for is its end: from where the cube lies flat on the board until it rests it slides in
the plane. What was determined from the tosses:

* A slide begins where the cube is within 0.3 degrees of its final lean and its height changes by less than 20 mm/s,
  and so to the end. The board leans by 0.2 to 0.9 degrees against the tracker, which is left out.
* So read, 473 of 570 tosses end in a slide of 30 mm or more, at up to 0.9 m/s; it slows down as under a friction of
  0.20 to 0.22 (median, at 0.1 to 0.5 m/s).
* Some tosses stand in the file twice; one slide speeds up, so that something pushes it. They are left out.
* Noise: from the tosses that go on after the cube has come to rest (0.015 mm, 0.43 mrad); most stop at once.

Only slides on one face, the most frequent, make one recording: a centre of mass that is off would be another
one on each face.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.errors import RecordingError
from physid_drake.files import FileError
from physid_drake.npz import read_arrays
from physid_drake.recording.adapters.sources import drawn
from physid_drake.recording.object_model import Box, ObjectModel
from physid_drake.recording.planar import planar_poses
from physid_drake.recording.reading import read_recording
from physid_drake.recording.statistics import estimate_noise
from physid_drake.recording.values import Array, PoseStream, Push, Recording, Sensors, Table
from physid_drake.recording.writing import write_recording
from physid_drake.wording import named

SIDE: Final = 0.1048
MASS: Final = 0.37
RATE: Final = 148.0
MOST: Final = 1e6
SHORTEST: Final = 25
"""Samples that a slide must have."""
LEAST_WAY: Final = 0.03
"""m that it must go."""
_COLUMNS: Final = 13
_LARGEST_LEAN: Final = np.deg2rad(0.3)
_LARGEST_CLIMB: Final = 0.02  # m/s
_SPEEDS_UP: Final = 0.05  # m/s


def convert_cube(source: Path, folder: Path, limit: int | None = None, seed: int = 0) -> Recording:
    """Converts the slides on one face, and writes the recording.

    Args:
        source: the file, or the folder that holds it.
        folder: where the recording goes; must not exist, or be empty.
        limit: draw so many slides at random, and keep their order; None takes all.
        seed: of that draw.

    Returns:
        The recording as read back from ``folder``.

    Raises:
        RecordingError: if the file is not in the published layout, or holds no slide.
        OutputError: if the folder cannot be written.
    """
    slides, note = _slides_of(_read(Path(source)))
    every = Recording(
        name="cube_slides",
        description="ContactNets tosses of a cube (Pfrommer, Halm, Posa, CoRL 2020): the slide on the board that ends"
        f" a toss, put flat on the table (yaw only). {note} Table size assumed.",
        object=ObjectModel(shape=Box(size=(SIDE, SIDE, SIDE)), mass=MASS),
        table=Table(size=(2.0, 2.0)),
        hand=None,
        sensors=Sensors(),
        pushes=tuple(
            Push(name=f"{k}", object=stream, hand=None, force=None, note=f"toss {number}")
            for k, (number, stream) in enumerate(slides)
        ),
    )
    kept = drawn(len(slides), limit, np.random.default_rng(seed))
    pushes = tuple(replace(every.pushes[k], name=f"pushes/{n + 1:03d}.csv") for n, k in enumerate(kept))
    write_recording(replace(every, sensors=_sensors(every), pushes=pushes), folder)
    return read_recording(folder)


def _sensors(recording: Recording) -> Sensors:
    """The tracker's noise from all rests: the slides that are drawn may have none."""
    noise = estimate_noise(recording)

    def rounded(value: float | None) -> float | None:
        return float(f"{value:.2g}") if value else None

    return Sensors(
        object_position_std=rounded(noise.object_position_std), object_rotation_std=rounded(noise.object_rotation_std)
    )


def _read(source: Path) -> list[Array]:
    """The tosses (n, 13)."""
    file = source / "contactnets_all.npz" if source.is_dir() else source
    try:
        content = read_arrays(file)
    except FileError as error:
        raise RecordingError(f"{named(file)}: is no table of tosses: {error}.") from error
    traj, length = content.get("traj"), content.get("length")
    if traj is None or length is None or traj.dtype.kind not in "iuf" or length.dtype.kind not in "iu":
        raise RecordingError(
            f"{named(file)}: is no table of tosses: it must hold numbers 'traj' and whole numbers 'length', but holds"
            f" {named(', '.join(content)) or 'nothing'}."
        )
    rows, lengths = np.asarray(traj, dtype=np.float64), length
    if lengths.size and not (int(lengths.min()) >= 1 and int(lengths.max()) <= len(np.atleast_1d(rows))):
        raise RecordingError(f"{named(file)}: every toss must have from 1 to {len(np.atleast_1d(rows))} rows.")
    lengths = lengths.astype(int)
    if rows.ndim != 2 or rows.shape[1] != _COLUMNS or lengths.ndim != 1 or lengths.sum() != len(rows):
        raise RecordingError(f"{named(file)}: must hold rows of 13 numbers and their lengths, but got {rows.shape}.")
    if not np.isfinite(rows).all() or np.abs(rows).max(initial=0.0) > MOST:
        raise RecordingError(f"{named(file)}: numbers must be finite and at most {MOST:g}; leave that toss out.")
    if not len(lengths) or not (np.linalg.norm(rows[:, 3:7], axis=1) > 0.5).all():
        raise RecordingError(
            f"{named(file)}: there must be tosses, every toss needs a row, and every row a quaternion of length 1."
        )
    return np.split(rows, np.cumsum(lengths)[:-1])


def _slides_of(tosses: list[Array]) -> tuple[list[tuple[int, PoseStream]], str]:
    """Number and poses of the slides on the most frequent face, and a sentence on them."""
    faces: dict[tuple[int, int], list[tuple[int, PoseStream]]] = {}
    seen: set[bytes] = set()
    for number, toss in enumerate(tosses):
        if toss.tobytes() in seen:
            continue
        seen.add(toss.tobytes())
        face, planar = _slide(toss)
        if len(planar) < SHORTEST or np.hypot(*(planar[-1] - planar[0])[:2]) < LEAST_WAY:
            continue
        speeds = np.hypot(*np.diff(planar[:, :2], axis=0).T) * RATE
        if speeds[5:].max() > speeds[:5].mean() + _SPEEDS_UP:
            continue
        times = np.arange(len(planar)) / RATE
        faces.setdefault(face, []).append((number, planar_poses(times, planar, 0.5 * SIDE)))
    if not faces:
        raise RecordingError(f"no toss ends in a slide of {1e3 * LEAST_WAY:g} mm on the board.")
    slides = max(faces.values(), key=len)
    total = sum(len(found) for found in faces.values())
    return slides, f"{total} of {len(tosses)} tosses end in a slide, {len(slides)} of them on this face."


def _slide(toss: Array) -> tuple[tuple[int, int], Array]:
    """Which face is down (axis of the object, sign), and x, y, yaw (n, 3) from where the cube lies flat."""
    rotations = _rotations(toss[:, 3:7])
    axis = int(np.argmax(np.abs(rotations[-1, 2])))
    sign = int(np.sign(rotations[-1, 2, axis]))
    upright = sign * rotations[:, :, axis]
    lean = np.arccos(np.clip(upright @ upright[-1], -1.0, 1.0))
    moves = (lean > _LARGEST_LEAN) | (np.abs(toss[:, 9]) > _LARGEST_CLIMB)
    first = int(np.flatnonzero(moves)[-1]) + 1 if moves.any() else 0
    # The new x axis is the next of the old ones, so that the new frame is right-handed with z up.
    forward = rotations[first:, :, (axis + 1) % 3]
    yaw = np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))
    return (axis, sign), np.column_stack([toss[first:, :2], yaw])


def _rotations(quaternions: Array) -> Array:
    """Matrices (n, 3, 3) of w, x, y, z (n, 4)."""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)
