"""What sensors make of a motion: noise, late stamps, gaps, and what the recording says of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from physid_drake.recording import ForceStream, Hand, ObjectModel, PoseStream, Push, Recording, Sensors, Table
from physid_drake.validation.worlds.scene import TABLE_SIZE, Noise, Rng, Scene
from physid_drake.validation.worlds.shapes import Array, height_of
from physid_drake.validation.worlds.world_plan import Motion


def record(rng: Rng, scene: Scene, index: int, motion: Motion) -> tuple[Push, Array]:
    """A push with noise, and the noise-free poses (n, 3) of its object samples."""
    noise, count = scene.noise, len(motion.times)
    # A stamp is late or early; what it stamps is of the true, even times.
    stamps = np.round(motion.times + noise.jitter * rng.uniform(-1.0, 1.0, count), 7)
    stamps -= min(0.0, float(stamps[0]))
    places = np.column_stack([motion.poses[:, :2], np.full(count, height_of(scene.plan.shape) / 2.0)])
    places += noise.position * _series(rng, count, noise)
    turns = noise.rotation * _series(rng, count, noise)
    quaternions = _quaternions(motion.poses[:, 2] + turns[:, 2], turns[:, :2])
    tips = np.column_stack([motion.tips, np.full(count, scene.plan.tip_height)])
    tips += noise.hand * rng.standard_normal((count, 3))
    # The first and the last sample stay: a push needs both ends.
    kept = np.ones(count, dtype=bool)
    kept[1:-1] = rng.random(count - 2) >= noise.dropout
    push = Push(
        name=f"{index + 1:03d}",
        object=PoseStream(
            times=stamps[kept], positions=np.round(places[kept], 8), quaternions=np.round(quaternions[kept], 8)
        ),
        hand=PoseStream(
            times=stamps, positions=np.round(tips, 8), quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
        ),
        force=_forces(rng, scene, stamps, motion),
    )
    return push, motion.poses[kept]


def _forces(rng: Rng, scene: Scene, stamps: Array, motion: Motion) -> ForceStream | None:
    if scene.noise.force is None:
        return None
    noisy = motion.forces + scene.noise.force * rng.standard_normal(motion.forces.shape)
    return ForceStream(times=stamps, forces=np.round(noisy, 6))


def _series(rng: Rng, count: int, noise: Noise) -> Array:
    """(count, 3) of unit variance, correlated from sample to sample."""
    series = rng.standard_normal((count, 3))
    keep, fresh = noise.correlation, math.sqrt(1.0 - noise.correlation**2)
    for k in range(1, count if keep else 0):
        series[k] = keep * series[k - 1] + fresh * series[k]
    return series


def _quaternions(yaw: Array, lean: Array) -> Array:
    """w, x, y, z (n, 4) of a rotation by small ``lean`` (n, 2) after one by ``yaw`` (n,)."""
    c, s = np.cos(yaw / 2.0), np.sin(yaw / 2.0)
    x, y = (lean / 2.0).T
    turned = np.column_stack([c, x * c + y * s, y * c - x * s, s])
    normal: Array = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    return normal


def recording_of(name: str, scene: Scene, pushes: Sequence[Push], lags: bool) -> Recording:
    """The recording of a world: what its maker says of it, which is not always all or true."""
    noise = scene.noise
    stated = Sensors(
        object_position_std=float(f"{noise.position:.3g}"),
        object_rotation_std=float(f"{noise.rotation:.3g}"),
        hand_position_std=float(f"{noise.hand:.3g}"),
        force_std=noise.force,
    )
    return Recording(
        name=name,
        description="An object pushed on a table.",
        object=ObjectModel(shape=scene.plan.shape, mass=scene.stated_mass),
        table=Table(size=TABLE_SIZE),
        hand=Hand(
            tip="sphere",
            radius=round(scene.plan.tip_radius, 6),
            # Columns that are commanded do not betray a lag: half of all worlds have such.
            stream="commanded" if scene.commanded or lags else "measured",
        ),
        sensors=stated if scene.sensors_stated else Sensors(),
        pushes=tuple(pushes),
    )
