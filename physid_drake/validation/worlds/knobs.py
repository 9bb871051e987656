"""The effects of a drawn world, each with all but its strength drawn. SI units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from physid_drake.validation.worlds.effects import body, hand, others, table, tracker, world
from physid_drake.validation.worlds.effects.effect import Effect
from physid_drake.validation.worlds.feet import feet_of, stays_loaded
from physid_drake.validation.worlds.scene import Rng, Scene
from physid_drake.validation.worlds.shapes import Array, plan_size
from physid_drake.validation.worlds.world_plan import GRAVITY

_ARM: Final = 0.3  # m; about as far from the origin as objects get


@dataclass(frozen=True, kw_only=True)
class Knob:
    """An effect whose strength is still to be set: nothing at 0, the most that is plausible at ``limit``."""

    at: Callable[[float], Effect]
    limit: float


def draw_knob(name: str, rng: Rng, scene: Scene) -> Knob:
    """The effect ``name`` with all but its strength drawn."""
    return _KNOBS[name](rng, scene)


def _hold(scene: Scene) -> float:
    """Force that friction can hold [N]."""
    return scene.plan.support_friction * scene.plan.mass * GRAVITY


def _direction(rng: Rng) -> tuple[float, float, float]:
    angle = float(rng.uniform(-math.pi, math.pi))
    return angle, math.cos(angle), math.sin(angle)


def _place(rng: Rng, reach: float) -> tuple[float, float]:
    x, y = rng.uniform(-reach, reach, 2).tolist()
    return x, y


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _stribeck(rng: Rng, scene: Scene) -> Knob:
    speed = float(rng.uniform(0.02, 0.15))
    return Knob(at=lambda a: table.StribeckFriction(excess=a, speed=speed), limit=1.0)


def _viscous(rng: Rng, scene: Scene) -> Knob:
    return Knob(at=lambda a: table.ViscousDrag(coefficient=a), limit=1.5 * _hold(scene) / 0.3)


def _quadratic(rng: Rng, scene: Scene) -> Knob:
    return Knob(at=lambda a: world.QuadraticDrag(coefficient=a), limit=2.0 * _hold(scene) / 0.3**2)


def _table_grain(rng: Rng, scene: Scene) -> Knob:
    angle = float(rng.uniform(0.0, math.pi))
    return Knob(at=lambda a: table.AnisotropicTable(ratio=math.exp(a), angle=angle), limit=math.log(2.0))


def _underside_grain(rng: Rng, scene: Scene) -> Knob:
    angle = float(rng.uniform(0.0, math.pi))
    return Knob(at=lambda a: body.AnisotropicObject(ratio=math.exp(a), angle=angle), limit=math.log(2.0))


def _patch(rng: Rng, scene: Scene) -> Knob:
    (x, y), radius, sign = _place(rng, 0.1), float(rng.uniform(0.06, 0.13)), _sign(rng)
    limit = math.log(2.0) if sign > 0 else -math.log(0.4)
    return Knob(at=lambda a: table.FrictionPatch(ratio=math.exp(sign * a), x=x, y=y, radius=radius), limit=limit)


def _gradient(rng: Rng, scene: Scene) -> Knob:
    _, c, s = _direction(rng)
    return Knob(at=lambda a: table.FrictionGradient(slope_x=a * c, slope_y=a * s), limit=2.2)


def _drift(rng: Rng, scene: Scene) -> Knob:
    sign = _sign(rng)
    return Knob(at=lambda a: table.FrictionDrift(per_push=sign * a), limit=0.6 / len(scene.pushes))


def _tilt(rng: Rng, scene: Scene) -> Knob:
    _, c, s = _direction(rng)
    return Knob(at=lambda a: table.TableTilt(x=a * c, y=a * s), limit=min(0.1, 0.5 * scene.plan.support_friction))


def _support(rng: Rng, scene: Scene) -> Knob:
    """A pattern of pressure that the object can stand on; otherwise another."""
    while True:
        pattern = _pressure_pattern(rng)
        for limit in (0.95, 0.8):
            knob = Knob(at=lambda a, p=pattern: body.UnevenSupport(weights=_blend(p, a)), limit=limit)  # type: ignore[misc]
            if stays_loaded(knob.at(limit).build(scene.plan)):
                return knob


def _pressure_pattern(rng: Rng) -> Array:
    kind = rng.choice(["legs", "rim", "middle", "random"])
    if kind == "legs":
        return np.array([[1.0, 0.0, 1.0], [0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
    if kind == "rim":
        return np.array([[1.0, 1.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0]])
    if kind == "middle":
        return np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    return np.exp(rng.normal(0.0, 1.0, (3, 3)))


def _blend(pattern: Array, share: float) -> tuple[tuple[float, ...], ...]:
    weights = (1.0 - share) + share * pattern / pattern.mean()
    return tuple(tuple(round(value, 6) for value in row) for row in weights.tolist())


def _com(rng: Rng, scene: Scene) -> Knob:
    _, c, s = _direction(rng)
    knob = Knob(at=lambda a: body.ComOffset(x=a * c, y=a * s), limit=0.2 * min(plan_size(scene.plan.shape)))
    while not stays_loaded(knob.at(knob.limit).build(scene.plan)) and knob.limit > 1e-3:
        knob = replace(knob, limit=0.9 * knob.limit)
    return knob


def _inertia(rng: Rng, scene: Scene) -> Knob:
    sign = _sign(rng)
    return Knob(at=lambda a: body.RotationalInertia(ratio=math.exp(sign * a)), limit=math.log(2.2))


def _slosh(rng: Rng, scene: Scene) -> Knob:
    frequency, damping = float(rng.uniform(1.5, 5.0)), float(rng.uniform(0.03, 0.2))
    return Knob(at=lambda a: body.Sloshing(fraction=a, frequency=frequency, damping=damping), limit=0.4)


def _tether(rng: Rng, scene: Scene) -> Knob:
    """A spring, a cable that is taut nearly everywhere, or one that is slack up to about the middle of the table."""
    x, y = _place(rng, 0.3)
    far = math.hypot(x, y)
    rest, stretch = (
        (0.0, 0.4),
        (float(rng.uniform(0.0, 0.1)), 0.4),
        (max(0.02, far + float(rng.uniform(-0.06, 0.03))), 0.1),
    )[int(rng.integers(3))]
    limit = 0.6 * _hold(scene) / stretch
    return Knob(at=lambda a: world.Tether(stiffness=a, x=x, y=y, rest_length=rest), limit=limit)


def _magnet(rng: Rng, scene: Scene) -> Knob:
    (x, y), core = _place(rng, 0.12), float(rng.uniform(0.03, 0.07))
    limit = 0.8 * _hold(scene) * core**2
    return Knob(at=lambda a: world.Magnet(strength=a, x=x, y=y, core=core), limit=limit)


def _bounce(rng: Rng, scene: Scene) -> Knob:
    return Knob(at=lambda a: hand.Restitution(coefficient=a), limit=0.7)


def _compliance(rng: Rng, scene: Scene) -> Knob:
    damping, share = float(rng.uniform(0.1, 0.6)), float(np.exp(rng.uniform(math.log(0.1), math.log(0.5))))
    return Knob(
        at=lambda a: hand.HandCompliance(compliance=a, damping=damping, share=share), limit=0.008 / _hold(scene)
    )


def _lag(rng: Rng, scene: Scene) -> Knob:
    return Knob(at=lambda a: hand.ActuatorLag(time_constant=a), limit=0.08)


def _hand_offset(rng: Rng, scene: Scene) -> Knob:
    _, c, s = _direction(rng)
    return Knob(at=lambda a: hand.HandOffset(x=a * c, y=a * s), limit=0.004)


def _latency(rng: Rng, scene: Scene) -> Knob:
    return Knob(at=lambda a: tracker.TrackerLatency(delay=a), limit=0.08)


def _bias(rng: Rng, scene: Scene) -> Knob:
    (_, c, s), yaw = _direction(rng), float(rng.uniform(-8.0, 8.0))
    limit = min(0.012, 0.2 * min(plan_size(scene.plan.shape)))
    return Knob(at=lambda a: tracker.TrackerBias(x=a * c, y=a * s, yaw=a * yaw), limit=limit)


def _scale(rng: Rng, scene: Scene) -> Knob:
    sign = _sign(rng)
    return Knob(at=lambda a: tracker.TrackerScale(ratio=1.0 + sign * a), limit=0.08)


def _size(rng: Rng, scene: Scene) -> Knob:
    sign = _sign(rng)
    # A larger one must not reach the tip before it starts: run-ups are 8 mm at least.
    limit = min(0.08, 0.005 / (max(plan_size(scene.plan.shape)) / 2.0))
    return Knob(at=lambda a: body.SizeError(ratio=1.0 + sign * a), limit=limit)


def _ridges(rng: Rng, scene: Scene) -> Knob:
    wave, angle, phase = float(rng.uniform(0.05, 0.15)), _direction(rng)[0], float(rng.uniform(0.0, 0.1))
    return Knob(at=lambda a: others.Ridges(depth=a, wavelength=wave, angle=angle, phase=phase), limit=0.7)


def _adhesion(rng: Rng, scene: Scene) -> Knob:
    length = float(rng.uniform(0.02, 0.08))
    return Knob(at=lambda a: others.Adhesion(excess=a, length=length), limit=1.5)


def _warming(rng: Rng, scene: Scene) -> Knob:
    sign, time = _sign(rng), float(rng.uniform(0.1, 0.4))
    return Knob(at=lambda a: others.Warming(share=sign * a, time=time), limit=0.6)


def _ratchet(rng: Rng, scene: Scene) -> Knob:
    angle = _direction(rng)[0]
    return Knob(at=lambda a: others.Ratchet(share=a, angle=angle), limit=0.5)


def _heading(rng: Rng, scene: Scene) -> Knob:
    angle = _direction(rng)[0]
    return Knob(at=lambda a: others.HeadingFriction(share=a, angle=angle), limit=0.5)


def _lift(rng: Rng, scene: Scene) -> Knob:
    sign = _sign(rng)
    return Knob(at=lambda a: others.Lift(coefficient=sign * a), limit=3.0 * _hold(scene) / (2.0 * 0.2))


def _gust(rng: Rng, scene: Scene) -> Knob:
    (_, c, s), begin = _direction(rng), float(rng.uniform(0.35, 0.5))
    end = begin + float(rng.uniform(0.1, 0.2))
    return Knob(at=lambda a: others.Gust(x=a * c, y=a * s, begin=begin, end=end), limit=0.8 * _hold(scene))


def _seam(rng: Rng, scene: Scene) -> Knob:
    angle, offset, width = _direction(rng)[0], float(rng.uniform(-0.08, 0.08)), float(rng.uniform(0.01, 0.03))
    limit = 1.4 * _hold(scene) * width
    return Knob(at=lambda a: others.Seam(energy=a, angle=angle, offset=offset, width=width), limit=limit)


def _trough(rng: Rng, scene: Scene) -> Knob:
    angle, limit = _direction(rng)[0], 0.7 * _hold(scene) / 0.2**3
    return Knob(at=lambda a: others.Trough(coefficient=a, angle=angle), limit=limit)


def _rotor(rng: Rng, scene: Scene) -> Knob:
    feet, weights = feet_of(scene.plan.shape)
    sign, limit = _sign(rng), 0.6 * _hold(scene) * float(weights @ np.hypot(*feet.T))
    return Knob(at=lambda a: others.Rotor(torque=sign * a), limit=limit)


def _swirl(rng: Rng, scene: Scene) -> Knob:
    (x, y), sign = _place(rng, 0.05), _sign(rng)
    return Knob(at=lambda a: others.Swirl(coefficient=sign * a, x=x, y=y), limit=0.7 * _hold(scene) / _ARM)


def _shaken_table(rng: Rng, scene: Scene) -> Knob:
    frequency, angle = float(rng.uniform(8.0, 25.0)), _direction(rng)[0]
    limit = 0.8 * scene.plan.support_friction * GRAVITY
    return Knob(at=lambda a: others.TableVibration(acceleration=a, frequency=frequency, angle=angle), limit=limit)


def _turntable(rng: Rng, scene: Scene) -> Knob:
    sign, limit = _sign(rng), math.sqrt(0.5 * scene.plan.support_friction * GRAVITY / _ARM)
    return Knob(at=lambda a: others.Turntable(rate=sign * a), limit=limit)


def _shaken_hand(rng: Rng, scene: Scene) -> Knob:
    frequency, angle = float(rng.uniform(6.0, 16.0)), _direction(rng)[0]
    return Knob(at=lambda a: others.HandVibration(amplitude=a, frequency=frequency, angle=angle), limit=0.003)


def _clock(rng: Rng, scene: Scene) -> Knob:
    sign = _sign(rng)
    return Knob(at=lambda a: others.HandClock(rate=sign * a), limit=0.08)


def _backlash(rng: Rng, scene: Scene) -> Knob:
    return Knob(at=lambda a: others.HandBacklash(play=a), limit=0.008)


def _perspective(rng: Rng, scene: Scene) -> Knob:
    (x, y), sign = _place(rng, 0.1), _sign(rng)
    return Knob(at=lambda a: others.Perspective(coefficient=sign * a, x=x, y=y), limit=2.0)


def _overshoot(rng: Rng, scene: Scene) -> Knob:
    damping = float(rng.uniform(0.15, 0.6))
    return Knob(at=lambda a: others.TrackerOvershoot(period=a, damping=damping), limit=0.25)


def _wobble(rng: Rng, scene: Scene) -> Knob:
    angle = _direction(rng)[0]
    return Knob(at=lambda a: others.MarkerWobble(amplitude=a, angle=angle), limit=0.015)


_KNOBS: Final[dict[str, Callable[[Rng, Scene], Knob]]] = {
    "stribeck_friction": _stribeck,
    "viscous_drag": _viscous,
    "quadratic_drag": _quadratic,
    "anisotropic_table": _table_grain,
    "anisotropic_object": _underside_grain,
    "friction_patch": _patch,
    "friction_gradient": _gradient,
    "friction_drift": _drift,
    "table_tilt": _tilt,
    "uneven_support": _support,
    "com_offset": _com,
    "rotational_inertia": _inertia,
    "sloshing": _slosh,
    "tether": _tether,
    "magnet": _magnet,
    "restitution": _bounce,
    "hand_compliance": _compliance,
    "actuator_lag": _lag,
    "hand_offset": _hand_offset,
    "tracker_latency": _latency,
    "tracker_bias": _bias,
    "tracker_scale": _scale,
    "size_error": _size,
    "other_ridges": _ridges,
    "other_adhesion": _adhesion,
    "other_warming": _warming,
    "other_ratchet": _ratchet,
    "other_heading_friction": _heading,
    "other_lift": _lift,
    "other_gust": _gust,
    "other_seam": _seam,
    "other_trough": _trough,
    "other_rotor": _rotor,
    "other_swirl": _swirl,
    "other_table_vibration": _shaken_table,
    "other_turntable": _turntable,
    "other_hand_vibration": _shaken_hand,
    "other_hand_clock": _clock,
    "other_hand_backlash": _backlash,
    "other_perspective": _perspective,
    "other_tracker_overshoot": _overshoot,
    "other_marker_wobble": _wobble,
}
