"""What a world is made of before it is built, how a hand moves in it, and what comes out.

Frames: ``W`` world, z up, table top at z = 0; ``B`` object, at the centre of its shape. SI units throughout.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np

from physid_drake.validation.worlds.shapes import Array, Solid

Pose: TypeAlias = tuple[float, float, float]
GRAVITY: Final = 9.81
"""m/s^2."""


@dataclass(frozen=True, kw_only=True)
class Grain:
    """An ellipse of friction: ``ratio`` of its axes (geometric mean 1), ``angle`` of the slippery one [rad]."""

    ratio: float
    angle: float


@dataclass(frozen=True, kw_only=True)
class Slosh:
    """A ``fraction`` of the mass on springs along x and y of B: ``frequency`` [Hz] and ``damping`` ratio."""

    fraction: float
    frequency: float
    damping: float


@dataclass(frozen=True, kw_only=True)
class SprungTip:
    """A tip on springs.

    Attributes:
        compliance: m/N.
        damping: ratio, with the object's mass on the spring.
        share: mass of what moves with the tip, over the object's.
    """

    compliance: float
    damping: float
    share: float


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A world before it is built; its defaults are the baseline model.

    Attributes:
        shape: of the object, standing on the table.
        mass: kg.
        support_friction: between object and table.
        hand_friction: between tip and object.
        tip_radius: of a sphere [m].
        tip_height: of its centre above the table [m].
        com: centre of mass from Bo along x and y of B [m].
        inertia_ratio: moment of inertia over that of uniform density.
        pressure: weights (rows along x, columns along y) of a regular grid over the underside; None: uniform.
        table_grain: friction ellipse in W.
        underside_grain: friction ellipse in B.
        slosh: a part of the mass that swings.
        sprung_tip: compliance of the hand.
        restitution: of tip and object; 0 is `RESIDUAL_RESTITUTION`.
        tilt: gravity's components along the table over g: sines of angles about -y and x.
    """

    shape: Solid
    mass: float
    support_friction: float
    hand_friction: float
    tip_radius: float
    tip_height: float
    com: tuple[float, float] = (0.0, 0.0)
    inertia_ratio: float = 1.0
    pressure: tuple[tuple[float, ...], ...] | None = None
    table_grain: Grain | None = None
    underside_grain: Grain | None = None
    slosh: Slosh | None = None
    sprung_tip: SprungTip | None = None
    restitution: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class HandPath:
    """A tip whose velocity is linear between knots; it rests before the first and after the last.

    Attributes:
        times: (n,) s.
        start: (2,) place in W before the first knot [m].
        velocities: (n, 2) m/s, zero at both ends.
    """

    times: Array
    start: Array
    velocities: Array

    def position(self, times: Array) -> Array:
        """Places (n, 2) in W [m]."""
        spans = np.diff(self.times)[:, None]
        steps = np.cumsum((self.velocities[1:] + self.velocities[:-1]) / 2.0 * spans, axis=0)
        places = self.start + np.concatenate([np.zeros((1, 2)), steps])
        at = np.clip(times, self.times[0], self.times[-1])
        k = np.clip(np.searchsorted(self.times, at, side="right") - 1, 0, len(spans) - 1)
        since = (at - self.times[k])[:, None]
        gain = (self.velocities[k + 1] - self.velocities[k]) / spans[k]
        result: Array = places[k] + (self.velocities[k] + gain * since / 2.0) * since
        return result


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What one push did, without noise.

    Attributes:
        times: (n,) even times from 0 [s].
        poses: (n, 3) x, y, yaw of B as the tracker would say without noise [m, rad].
        true_poses: (n, 3) the same as it was.
        tips: (n, 2) of the tip as the recording would say without noise [m].
        forces: (n, 3) of the hand on the object [N].
        rested: whether the object came to rest.
    """

    times: Array
    poses: Array
    true_poses: Array
    tips: Array
    forces: Array
    rested: bool
