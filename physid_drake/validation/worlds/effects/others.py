"""Physics that is in no catalogue (``other_*``), for worlds that no diagnosis can name."""

# ruff: noqa: D102 - methods do what those of the base class say they do.

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.signal import bilinear, lfilter

from physid_drake.validation.worlds.effects.effect import Effect, Moment
from physid_drake.validation.worlds.effects.hand import first_order_lag
from physid_drake.validation.worlds.shapes import Array


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


def _turned(vector: tuple[float, float], yaw: float) -> tuple[float, float]:
    c, s = math.cos(yaw), math.sin(yaw)
    return c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]
