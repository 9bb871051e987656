"""Recordings, numbers and matrices that the property tests draw."""

import tempfile
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from hypothesis import assume, settings
from hypothesis import strategies as st

from physid_drake.recording import (
    Box,
    Cylinder,
    ForceStream,
    Hand,
    ObjectModel,
    PoseStream,
    Prism,
    Push,
    Recording,
    Sensors,
    Table,
)
from physid_drake.recording.outlines import polygon_centroid

costly = settings(max_examples=max(1, settings.default.max_examples // 4))  # of tests that take 50 ms and more
FEW = 20  # samples of a stream: of fewer than 25 none is screened


def numbers(low, high):
    """Floating-point numbers between two, both among them."""
    return st.floats(low, high, allow_nan=False)


def arrays(low, high, *shape):
    """Arrays of such numbers."""
    count = int(np.prod(shape))
    return st.lists(numbers(low, high), min_size=count, max_size=count).map(lambda v: np.array(v).reshape(shape))


def generators():
    """Random generators: of matrices whose digits do not matter, hypothesis need not draw each."""
    return st.integers(0, 2**32 - 1).map(np.random.default_rng)


@contextmanager
def folder():
    """A folder that is gone afterwards: pytest's own is shared by all examples of a test."""
    with tempfile.TemporaryDirectory() as path:
        yield Path(path)


texts = st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp", "Cf")), max_size=12)
lengths = numbers(1e-4, 10.0)


@st.composite
def shapes(draw):
    kind = draw(st.sampled_from(("box", "standing", "lying", "prism")))
    if kind == "box":
        return Box(size=draw(st.tuples(lengths, lengths, lengths)))
    if kind != "prism":
        return Cylinder(radius=draw(lengths), length=draw(lengths), axis="z" if kind == "standing" else "y")
    return Prism(polygon=draw(polygons()), height=draw(lengths))


@st.composite
def polygons(draw, most=0.06):
    """Convex, counter-clockwise, about their centroid."""
    count = draw(st.integers(3, 7))
    gaps = draw(arrays(0.6, 1.4, count))
    angles = draw(numbers(-3.0, 3.0)) + 2.0 * np.pi * np.cumsum(gaps) / gaps.sum()
    corners = most * np.column_stack([np.cos(angles), draw(numbers(0.4, 1.0)) * np.sin(angles)])
    corners = corners - polygon_centroid(corners)
    return tuple((float(x), float(y)) for x, y in corners)


@st.composite
def times(draw, count):
    """Seconds by any clock, at intervals that trackers have."""
    begin = draw(st.sampled_from((0.0, -3.0, 1.75e9)) | numbers(-1e3, 1e3))
    return begin + np.cumsum(draw(generators()).uniform(1e-4, draw(st.sampled_from((1e-3, 0.02, 0.5))), count))


@st.composite
def poses(draw, rotation):
    """A stream of a body; lost ones, which are all zeros, have a test of their own."""
    count = draw(st.integers(2, FEW))
    rng = draw(generators())
    positions = draw(st.sampled_from((1e-3, 0.3, 900.0))) * rng.uniform(0.01, 1.0, (count, 3))
    if rotation == "none":
        quaternions = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    else:
        # Turns of less than a quarter from sample to sample: neighbours have the same sign.
        turns = draw(numbers(-3.0, 3.0)) + np.cumsum(rng.uniform(-1.5, 1.5, count))
        quaternions = np.column_stack([np.cos(0.5 * turns), np.zeros((count, 2)), np.sin(0.5 * turns)])
        if rotation == "full":
            quaternions = quaternions + rng.uniform(-0.1, 0.1, (count, 4))
        quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    return PoseStream(times=draw(times(count)), positions=positions, quaternions=quaternions, rotation=rotation)


@st.composite
def forces(draw):
    count = draw(st.integers(1, FEW))
    rng = draw(generators())
    return ForceStream(times=draw(times(count)), forces=rng.uniform(-1e3, 1e3, (count, 3)))


@st.composite
def hands(draw):
    tip = draw(st.sampled_from(("cylinder", "sphere", "capsule", "reflex_sf")))
    length = draw(lengths) if tip in ("cylinder", "capsule") else None
    stream = draw(st.sampled_from(("measured", "commanded")))
    return Hand(tip=tip, radius=draw(lengths), length=length, stream=stream)


@st.composite
def objects(draw):
    mass = draw(st.none() | numbers(1e-6, 1e6))
    share = draw(st.none() | numbers(0.0, 0.99))
    std = None if mass is None or share is None else share * mass
    assume(std is None or std < mass)
    return ObjectModel(shape=draw(shapes()), mass=mass, mass_std=std)


@st.composite
def sensors(draw):
    stds = [draw(st.none() | numbers(0.0, most)) for most in (0.05, 0.5, 0.05, 100.0)]
    return Sensors(
        object_position_std=stds[0], object_rotation_std=stds[1], hand_position_std=stds[2], force_std=stds[3]
    )


@st.composite
def recordings(draw):
    """Whatever `physid-recording/1` can hold, meshes aside."""
    hand = draw(st.none() | hands())
    side = numbers(1e-3, 99.0)
    pushes = []
    for k in range(draw(st.integers(1, 3))):
        pushes.append(
            Push(
                name=f"pushes/{k:03d}.csv",
                note=draw(texts),
                object=draw(poses(draw(st.sampled_from(("full", "yaw", "none"))))),
                hand=None if hand is None else draw(poses(draw(st.sampled_from(("full", "none"))))),
                force=None if hand is None else draw(st.none() | forces()),
            )
        )
    return Recording(
        name=draw(texts), description=draw(texts), object=draw(objects()),
        table=Table(size=draw(st.tuples(side, side)), centre=draw(st.tuples(numbers(-99, 99), numbers(-99, 99)))),
        hand=hand, sensors=draw(sensors()), pushes=tuple(pushes),
    )  # fmt: skip
