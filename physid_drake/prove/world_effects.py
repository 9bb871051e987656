"""Every effect of the catalogue in this engine's own terms, and physics that is in no catalogue (``other_*``).

Parameters are in SI units; with the null values stated an effect is not built in at all. ``rolling_resistance`` is
missing: it needs a lying cylinder, and these worlds have none. Points and directions are in W unless B is said.
"""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import ClassVar, Final

import numpy as np
from scipy.signal import bilinear, lfilter

from physid_drake.prove.mujoco_world import (
    Array,
    Effect,
    Grain,
    Moment,
    Plan,
    Slosh,
    SprungTip,
    stretched,
)


def parameters_of(effect: Effect) -> dict[str, object]:
    """Name to value."""
    return asdict(effect)  # type: ignore[call-overload, no-any-return]


def _turned(vector: tuple[float, float], yaw: float) -> tuple[float, float]:
    c, s = math.cos(yaw), math.sin(yaw)
    return c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]


# ------------------------------------------------------------------------------------------------ table and object


@dataclass(frozen=True, kw_only=True)
class StribeckFriction(Effect):
    """mu = mu_k (1 + ``excess`` exp(-(v / ``speed``)^2)) at every foot."""

    name: ClassVar[str] = "stribeck_friction"
    strengths: ClassVar[tuple[str, ...]] = ("excess",)
    excess: float = 0.0
    speed: float = 0.05

    def friction(self, moment: Moment) -> Array:
        squares = (moment.foot_velocities**2).sum(axis=1) / self.speed**2
        factor: Array = 1.0 + self.excess * np.exp(-squares)
        return factor


@dataclass(frozen=True, kw_only=True)
class ViscousDrag(Effect):
    """Force -``coefficient`` v at the centre of mass, torque -``coefficient`` k^2 w; k is the uniform object's."""

    name: ClassVar[str] = "viscous_drag"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c = -self.coefficient
        return c * moment.vx, c * moment.vy, c * moment.gyration_squared * moment.spin


@dataclass(frozen=True, kw_only=True)
class QuadraticDrag(Effect):
    """Force -``coefficient`` v abs(v) at the centre of mass."""

    name: ClassVar[str] = "quadratic_drag"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c = -self.coefficient * math.hypot(moment.vx, moment.vy)
        return c * moment.vx, c * moment.vy, 0.0


@dataclass(frozen=True, kw_only=True)
class AnisotropicTable(Effect):
    """Friction mu sqrt(``ratio``) across and mu / sqrt(``ratio``) along the slippery axis at ``angle`` in W."""

    name: ClassVar[str] = "anisotropic_table"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0
    angle: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, table_grain=Grain(ratio=self.ratio, angle=self.angle))


@dataclass(frozen=True, kw_only=True)
class AnisotropicObject(Effect):
    """The same, with the slippery axis at ``angle`` in B."""

    name: ClassVar[str] = "anisotropic_object"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0
    angle: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, underside_grain=Grain(ratio=self.ratio, angle=self.angle))


@dataclass(frozen=True, kw_only=True)
class FrictionPatch(Effect):
    """Feet within ``radius`` of (``x``, ``y``) have ``ratio`` times the friction."""

    name: ClassVar[str] = "friction_patch"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0
    x: float = 0.0
    y: float = 0.0
    radius: float = 0.05

    def friction(self, moment: Moment) -> Array:
        places = moment.foot_places
        inside = (places[:, 0] - self.x) ** 2 + (places[:, 1] - self.y) ** 2 < self.radius**2
        return np.where(inside, self.ratio, 1.0)


@dataclass(frozen=True, kw_only=True)
class FrictionGradient(Effect):
    """Factor 1 + ``slope_x`` x + ``slope_y`` y, at least 0.1."""

    name: ClassVar[str] = "friction_gradient"
    strengths: ClassVar[tuple[str, ...]] = ("slope_x", "slope_y")
    slope_x: float = 0.0
    slope_y: float = 0.0

    def friction(self, moment: Moment) -> Array:
        factor: Array = np.maximum(0.1, 1.0 + moment.foot_places @ np.array([self.slope_x, self.slope_y]))
        return factor


@dataclass(frozen=True, kw_only=True)
class FrictionDrift(Effect):
    """Factor 1 + ``per_push`` i in the i-th push, i from 0."""

    name: ClassVar[str] = "friction_drift"
    strengths: ClassVar[tuple[str, ...]] = ("per_push",)
    per_push: float = 0.0

    def friction(self, moment: Moment) -> float:
        return max(0.1, 1.0 + self.per_push * moment.push)


@dataclass(frozen=True, kw_only=True)
class TableTilt(Effect):
    """Gravity has components g sin(``x``), g sin(``y``) along the table [rad]."""

    name: ClassVar[str] = "table_tilt"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, tilt=(plan.tilt[0] + math.sin(self.x), plan.tilt[1] + math.sin(self.y)))


@dataclass(frozen=True, kw_only=True)
class UnevenSupport(Effect):
    """Stiffness of the underside by a regular grid of ``weights``: rows along x, columns along y of B.

    The load follows the weights, balanced linearly so that it stands under the centre of mass.
    """

    name: ClassVar[str] = "uneven_support"
    weights: tuple[tuple[float, ...], ...] = ((1.0,),)

    @property
    def is_null(self) -> bool:
        return len({weight for row in self.weights for weight in row}) == 1

    def build(self, plan: Plan) -> Plan:
        return replace(plan, pressure=self.weights)


@dataclass(frozen=True, kw_only=True)
class ComOffset(Effect):
    """The centre of mass is at (``x``, ``y``) in B; the pressure follows it."""

    name: ClassVar[str] = "com_offset"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, com=(self.x, self.y))


@dataclass(frozen=True, kw_only=True)
class RotationalInertia(Effect):
    """Moment of inertia about the centre of mass, as a ``ratio`` to uniform density's."""

    name: ClassVar[str] = "rotational_inertia"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, inertia_ratio=self.ratio)


@dataclass(frozen=True, kw_only=True)
class Sloshing(Effect):
    """A ``fraction`` of the mass swings on springs in B at ``frequency`` (of it alone) with ``damping`` ratio."""

    name: ClassVar[str] = "sloshing"
    strengths: ClassVar[tuple[str, ...]] = ("fraction",)
    fraction: float = 0.0
    frequency: float = 2.0
    damping: float = 0.1

    def build(self, plan: Plan) -> Plan:
        slosh = Slosh(fraction=self.fraction, frequency=self.frequency, damping=self.damping)
        return replace(plan, slosh=slosh)


@dataclass(frozen=True, kw_only=True)
class SizeError(Effect):
    """The real object's plan is ``ratio`` times the stated one; its height is as stated."""

    name: ClassVar[str] = "size_error"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, shape=stretched(plan.shape, self.ratio))


# ---------------------------------------------------------------------------------------------------------- the world


@dataclass(frozen=True, kw_only=True)
class Tether(Effect):
    """A cable's pull at the centre of mass: ``stiffness`` times what exceeds ``rest_length``, towards a point."""

    name: ClassVar[str] = "tether"
    strengths: ClassVar[tuple[str, ...]] = ("stiffness",)
    stiffness: float = 0.0
    x: float = 0.0
    y: float = 0.0
    rest_length: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        dx, dy = self.x - moment.x, self.y - moment.y
        distance = math.hypot(dx, dy)
        pull = self.stiffness * max(0.0, distance - self.rest_length) / max(distance, 1e-9)
        return pull * dx, pull * dy, 0.0


@dataclass(frozen=True, kw_only=True)
class Magnet(Effect):
    """Attraction ``strength`` / (d^2 + ``core``^2) to a point at distance d from Bo."""

    name: ClassVar[str] = "magnet"
    strengths: ClassVar[tuple[str, ...]] = ("strength",)
    strength: float = 0.0
    x: float = 0.0
    y: float = 0.0
    core: float = 0.03

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        dx, dy = self.x - moment.x, self.y - moment.y
        squared = dx * dx + dy * dy
        # The unit vector jumps at the point itself; within a millimetre it is faded out.
        pull = self.strength / (squared + self.core**2) / math.sqrt(squared + 1e-6)
        return pull * dx, pull * dy, 0.0


# ---------------------------------------------------------------------------------------------- the hand, the sensors


@dataclass(frozen=True, kw_only=True)
class Restitution(Effect):
    """The tip's contact gives back ``coefficient`` of the speed of a central touch."""

    name: ClassVar[str] = "restitution"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def build(self, plan: Plan) -> Plan:
        return replace(plan, restitution=self.coefficient)


@dataclass(frozen=True, kw_only=True)
class HandCompliance(Effect):
    """The tip is on springs of ``compliance`` [m/N]; ``damping`` is the ratio with the object's mass on them."""

    name: ClassVar[str] = "hand_compliance"
    strengths: ClassVar[tuple[str, ...]] = ("compliance",)
    compliance: float = 0.0
    damping: float = 0.3

    def build(self, plan: Plan) -> Plan:
        return replace(plan, sprung_tip=SprungTip(compliance=self.compliance, damping=self.damping))


def first_order_lag(times: Array, values: Array, time_constant: float) -> Array:
    """Response of a first-order lag to values (n, m) on even times, linear between them, at rest at the start."""
    step = float(times[1] - times[0])
    keep = math.exp(-step / time_constant)
    ahead = 1.0 - time_constant / step * (1.0 - keep)
    start = values[0]
    filtered: Array = lfilter([ahead, 1.0 - keep - ahead], [1.0, -keep], values - start, axis=0) + start
    return filtered


def _shifted(times: Array, values: Array, delay: float) -> Array:
    at = times - delay
    return np.column_stack([np.interp(at, times, column) for column in values.T])


@dataclass(frozen=True, kw_only=True)
class ActuatorLag(Effect):
    """The tip follows the hand columns with a first-order lag of ``time_constant``."""

    name: ClassVar[str] = "actuator_lag"
    strengths: ClassVar[tuple[str, ...]] = ("time_constant",)
    time_constant: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        return first_order_lag(times, places, self.time_constant)


@dataclass(frozen=True, kw_only=True)
class HandOffset(Effect):
    """The tip is at (``x``, ``y``) in P, whose axes are W's, from where the hand columns say."""

    name: ClassVar[str] = "hand_offset"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        moved: Array = places + np.array([self.x, self.y])
        return moved


@dataclass(frozen=True, kw_only=True)
class TrackerLatency(Effect):
    """What is stamped t was so at t - ``delay``."""

    name: ClassVar[str] = "tracker_latency"
    strengths: ClassVar[tuple[str, ...]] = ("delay",)
    delay: float = 0.0

    def tracked(self, times: Array, poses: Array) -> Array:
        return _shifted(times, poses, self.delay)


@dataclass(frozen=True, kw_only=True)
class TrackerBias(Effect):
    """The tracked frame is at (``x``, ``y``, ``yaw``) in B."""

    name: ClassVar[str] = "tracker_bias"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y", "yaw")
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def tracked(self, times: Array, poses: Array) -> Array:
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        shift = np.column_stack([c * self.x - s * self.y, s * self.x + c * self.y, np.full(len(c), self.yaw)])
        seen: Array = poses + shift
        return seen


@dataclass(frozen=True, kw_only=True)
class TrackerScale(Effect):
    """Places of the object are measured ``ratio`` times as far from the origin of W."""

    name: ClassVar[str] = "tracker_scale"
    strengths: ClassVar[tuple[str, ...]] = ("ratio",)
    ratio: float = 1.0

    def tracked(self, times: Array, poses: Array) -> Array:
        seen: Array = poses * np.array([self.ratio, self.ratio, 1.0])
        return seen


# ----------------------------------------------------------------------------------------- not in the catalogue


@dataclass(frozen=True, kw_only=True)
class Ridges(Effect):
    """Friction rises and falls across the table: 1 + ``depth`` sin(2 pi (u - ``phase``) / ``wavelength``)."""

    name: ClassVar[str] = "other_ridges"
    strengths: ClassVar[tuple[str, ...]] = ("depth",)
    depth: float = 0.0
    wavelength: float = 0.08
    angle: float = 0.0
    phase: float = 0.0

    def friction(self, moment: Moment) -> Array:
        along = moment.foot_places @ np.array([math.cos(self.angle), math.sin(self.angle)])
        factor: Array = 1.0 + self.depth * np.sin(2.0 * math.pi * (along - self.phase) / self.wavelength)
        return factor


@dataclass(frozen=True, kw_only=True)
class Adhesion(Effect):
    """What has rested sticks: friction is (1 + ``excess`` exp(-s / ``length``)) after sliding s in a push."""

    name: ClassVar[str] = "other_adhesion"
    strengths: ClassVar[tuple[str, ...]] = ("excess",)
    excess: float = 0.0
    length: float = 0.02

    def friction(self, moment: Moment) -> float:
        return 1.0 + self.excess * math.exp(-moment.slid / self.length)


@dataclass(frozen=True, kw_only=True)
class Warming(Effect):
    """Friction changes while the object moves, by ``share`` (1 - exp(-t / ``time``)), afresh in each push."""

    name: ClassVar[str] = "other_warming"
    strengths: ClassVar[tuple[str, ...]] = ("share",)
    share: float = 0.0
    time: float = 0.2

    def friction(self, moment: Moment) -> float:
        return 1.0 + self.share * (1.0 - math.exp(-moment.slid_time / self.time))


@dataclass(frozen=True, kw_only=True)
class Ratchet(Effect):
    """A napped underside: 1 + ``share`` cos(angle between a foot's slip and the direction ``angle`` in B)."""

    name: ClassVar[str] = "other_ratchet"
    strengths: ClassVar[tuple[str, ...]] = ("share",)
    share: float = 0.0
    angle: float = 0.0

    def friction(self, moment: Moment) -> Array:
        direction = np.array(_turned((math.cos(self.angle), math.sin(self.angle)), moment.yaw))
        v = moment.foot_velocities
        factor: Array = 1.0 + self.share * (v @ direction) / np.sqrt((v**2).sum(axis=1) + 1e-6)
        return factor


@dataclass(frozen=True, kw_only=True)
class HeadingFriction(Effect):
    """Friction depends on the object's heading: 1 + ``share`` cos(2 (yaw - ``angle``)); two weaves that mesh."""

    name: ClassVar[str] = "other_heading_friction"
    strengths: ClassVar[tuple[str, ...]] = ("share",)
    share: float = 0.0
    angle: float = 0.0

    def friction(self, moment: Moment) -> float:
        return 1.0 + self.share * math.cos(2.0 * (moment.yaw - self.angle))


@dataclass(frozen=True, kw_only=True)
class Lift(Effect):
    """A sideways force ``coefficient`` w x v on what spins while it moves."""

    name: ClassVar[str] = "other_lift"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c = self.coefficient * moment.spin
        return -c * moment.vy, c * moment.vx, 0.0


@dataclass(frozen=True, kw_only=True)
class Gust(Effect):
    """A steady force (``x``, ``y``) [N] from ``begin`` to ``end`` [s] of every push."""

    name: ClassVar[str] = "other_gust"
    strengths: ClassVar[tuple[str, ...]] = ("x", "y")
    x: float = 0.0
    y: float = 0.0
    begin: float = 0.5
    end: float = 0.7

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        blows = self.begin <= moment.time < self.end
        return (self.x, self.y, 0.0) if blows else (0.0, 0.0, 0.0)


@dataclass(frozen=True, kw_only=True)
class Seam(Effect):
    """A joint of two boards: the object is carried over a rise of ``energy`` [J] and ``width`` across a line.

    The line is at ``offset`` along the direction ``angle``.
    """

    name: ClassVar[str] = "other_seam"
    strengths: ClassVar[tuple[str, ...]] = ("energy",)
    energy: float = 0.0
    angle: float = 0.0
    offset: float = 0.0
    width: float = 0.01

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c, s = math.cos(self.angle), math.sin(self.angle)
        u = (c * moment.x + s * moment.y - self.offset) / self.width
        force = self.energy / self.width * u * math.exp(-u * u / 2.0)
        return force * c, force * s, 0.0


@dataclass(frozen=True, kw_only=True)
class Trough(Effect):
    """A bowed table: a force -``coefficient`` d^3 back to a line through the origin across ``angle`` [N/m^3]."""

    name: ClassVar[str] = "other_trough"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0
    angle: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c, s = math.cos(self.angle), math.sin(self.angle)
        force = -self.coefficient * (c * moment.x + s * moment.y) ** 3
        return force * c, force * s, 0.0


@dataclass(frozen=True, kw_only=True)
class Rotor(Effect):
    """A motor inside: a steady ``torque`` about z [N m]."""

    name: ClassVar[str] = "other_rotor"
    strengths: ClassVar[tuple[str, ...]] = ("torque",)
    torque: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        return 0.0, 0.0, self.torque


@dataclass(frozen=True, kw_only=True)
class Swirl(Effect):
    """A force field that goes round a point: ``coefficient`` (-(y - y0), x - x0) [N/m]."""

    name: ClassVar[str] = "other_swirl"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0
    x: float = 0.0
    y: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c = self.coefficient
        return -c * (moment.y - self.y), c * (moment.x - self.x), 0.0


@dataclass(frozen=True, kw_only=True)
class TableVibration(Effect):
    """The table shakes along ``angle`` with ``acceleration`` [m/s^2] at ``frequency`` [Hz]; all is seen from it."""

    name: ClassVar[str] = "other_table_vibration"
    strengths: ClassVar[tuple[str, ...]] = ("acceleration",)
    acceleration: float = 0.0
    frequency: float = 20.0
    angle: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        force = moment.mass * self.acceleration * math.sin(2.0 * math.pi * self.frequency * moment.time)
        return force * math.cos(self.angle), force * math.sin(self.angle), 0.0


@dataclass(frozen=True, kw_only=True)
class Turntable(Effect):
    """The table turns with ``rate`` [rad/s] about the origin, hand and tracker with it: Coriolis and centrifugal."""

    name: ClassVar[str] = "other_turntable"
    strengths: ClassVar[tuple[str, ...]] = ("rate",)
    rate: float = 0.0

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        c, m = self.rate, moment.mass
        fx = m * c * (2.0 * moment.vy + c * moment.x)
        return fx, m * c * (c * moment.y - 2.0 * moment.vx), 0.0


@dataclass(frozen=True, kw_only=True)
class HandVibration(Effect):
    """The tip shakes along ``angle`` by ``amplitude`` [m] at ``frequency`` [Hz] while it moves."""

    name: ClassVar[str] = "other_hand_vibration"
    strengths: ClassVar[tuple[str, ...]] = ("amplitude",)
    amplitude: float = 0.0
    frequency: float = 12.0
    angle: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        moving = np.hypot(*np.gradient(places, times, axis=0).T) > 1e-6
        eased = first_order_lag(times, moving[:, None].astype(float), 0.02)[:, 0]
        shake = self.amplitude * np.sin(2.0 * math.pi * self.frequency * times) * np.where(eased > 1e-4, eased, 0.0)
        return places + np.outer(shake, [math.cos(self.angle), math.sin(self.angle)])


@dataclass(frozen=True, kw_only=True)
class HandClock(Effect):
    """The hand's clock runs ``rate`` fast: at time t the tip is where the columns say it is at t (1 + rate)."""

    name: ClassVar[str] = "other_hand_clock"
    strengths: ClassVar[tuple[str, ...]] = ("rate",)
    rate: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        return np.column_stack([np.interp(times * (1.0 + self.rate), times, column) for column in places.T])


@dataclass(frozen=True, kw_only=True)
class HandBacklash(Effect):
    """The tip has ``play`` [m]: along x and along y it follows only what exceeds half of it."""

    name: ClassVar[str] = "other_hand_backlash"
    strengths: ClassVar[tuple[str, ...]] = ("play",)
    play: float = 0.0

    def tip(self, times: Array, places: Array) -> Array:
        half, at = self.play / 2.0, places[0].tolist()
        followed = np.empty_like(places)
        for k, place in enumerate(places.tolist()):
            at = [min(max(a, p - half), p + half) for a, p in zip(at, place, strict=True)]
            followed[k] = at
        return followed


@dataclass(frozen=True, kw_only=True)
class Perspective(Effect):
    """The tracker's lens: a place r from (``x``, ``y``) appears ``coefficient`` r^2 of r further out [1/m^2]."""

    name: ClassVar[str] = "other_perspective"
    strengths: ClassVar[tuple[str, ...]] = ("coefficient",)
    coefficient: float = 0.0
    x: float = 0.0
    y: float = 0.0

    def tracked(self, times: Array, poses: Array) -> Array:
        arms = poses[:, :2] - np.array([self.x, self.y])
        shift = self.coefficient * (arms**2).sum(axis=1, keepdims=True) * arms
        seen: Array = poses + np.column_stack([shift, np.zeros(len(poses))])
        return seen


@dataclass(frozen=True, kw_only=True)
class TrackerOvershoot(Effect):
    """The tracker's filter is of second order: ``period`` [s] of its undamped swing, and ``damping`` ratio."""

    name: ClassVar[str] = "other_tracker_overshoot"
    strengths: ClassVar[tuple[str, ...]] = ("period",)
    period: float = 0.0
    damping: float = 0.4

    def tracked(self, times: Array, poses: Array) -> Array:
        rate = 2.0 * math.pi / self.period
        over, under = [rate**2], [1.0, 2.0 * self.damping * rate, rate**2]
        b, a = bilinear(over, under, 1.0 / float(times[1] - times[0]))
        filtered: Array = lfilter(b, a, poses - poses[0], axis=0) + poses[0]
        return filtered


@dataclass(frozen=True, kw_only=True)
class MarkerWobble(Effect):
    """The tracked place swings with the object's heading by ``amplitude`` [m]: a marker seen from the side."""

    name: ClassVar[str] = "other_marker_wobble"
    strengths: ClassVar[tuple[str, ...]] = ("amplitude",)
    amplitude: float = 0.0
    angle: float = 0.0

    def tracked(self, times: Array, poses: Array) -> Array:
        swing = self.amplitude * np.sin(2.0 * poses[:, 2])
        return poses + np.outer(swing, [math.cos(self.angle), math.sin(self.angle), 0.0])


_CATALOGUED: Final[tuple[type[Effect], ...]] = (
    StribeckFriction,
    ViscousDrag,
    QuadraticDrag,
    AnisotropicTable,
    AnisotropicObject,
    FrictionPatch,
    FrictionGradient,
    FrictionDrift,
    TableTilt,
    UnevenSupport,
    ComOffset,
    RotationalInertia,
    Sloshing,
    Tether,
    Magnet,
    Restitution,
    HandCompliance,
    ActuatorLag,
    HandOffset,
    TrackerLatency,
    TrackerBias,
    TrackerScale,
    SizeError,
)
_OTHERS: Final[tuple[type[Effect], ...]] = (
    Ridges,
    Adhesion,
    Warming,
    Ratchet,
    HeadingFriction,
    Lift,
    Gust,
    Seam,
    Trough,
    Rotor,
    Swirl,
    TableVibration,
    Turntable,
    HandVibration,
    HandClock,
    HandBacklash,
    Perspective,
    TrackerOvershoot,
    MarkerWobble,
)
CATALOGUED: Final = {effect.name: effect for effect in _CATALOGUED}
"""Effects of the catalogue, by name."""
OTHERS: Final = {effect.name: effect for effect in _OTHERS}
"""Physics that is in no catalogue, by name."""
