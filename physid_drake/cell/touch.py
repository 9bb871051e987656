"""The touch of hand and object, seen from above: the gap between them, when it closes, and what a blow gives."""

from __future__ import annotations

import math
from typing import NamedTuple

from physid_drake.cell.impact import routh_impulse
from physid_drake.cell.outline import Outline
from physid_drake.cell.setters import Body

Planar = tuple[float, float, float]  # x, y [m] and yaw [rad], or their rates

GENTLE = 1e-3  # m/s: below this closing speed a touch needs no impact law


class Touch(NamedTuple):
    """Object and hand at one time: the section's pose and twist, gap, normal, lever from Bo, the gap's rate."""

    pose: Planar
    twist: Planar
    gap: float
    nx: float
    ny: float
    rx: float
    ry: float
    rate: float


class HandMove(NamedTuple):
    """The tip's way over a step: ``start`` and ``goal`` of its centre (2,) [m], and velocity [m/s]."""

    start: list[float]
    goal: list[float]
    velocity: tuple[float, float]


class Tip:
    """The hand's round tip beside the object's outline; plain floats, since a rollout asks in every time step."""

    def __init__(self, outline: Outline, radius: float) -> None:
        """``radius`` of the tip [m]."""
        self._nearest, self._radius = outline.nearest, radius

    def gap(self, px: float, py: float, yaw: float, hx: float, hy: float) -> tuple[float, float, float]:
        """Gap [m] between tip and outline, and the unit normal in W from the hand into the object."""
        c, s = math.cos(yaw), math.sin(yaw)
        dx, dy = hx - px, hy - py
        distance, nx, ny = self._nearest(c * dx + s * dy, c * dy - s * dx)
        return distance - self._radius, -(c * nx - s * ny), -(s * nx + c * ny)

    def touch(self, pose: Planar, twist: Planar, hand: list[float], velocity: tuple[float, float]) -> Touch:
        """The touch for the section's pose and twist, and the tip's place [m] and velocity [m/s]."""
        gap, nx, ny = self.gap(*pose, *hand)
        rx = hand[0] + (self._radius + gap) * nx - pose[0]
        ry = hand[1] + (self._radius + gap) * ny - pose[1]
        vx, vy, wz = twist
        rate = nx * (vx - wz * ry - velocity[0]) + ny * (vy + wz * rx - velocity[1])
        return Touch(pose, twist, gap, nx, ny, rx, ry, rate)

    def time_to_touch(
        self, touch: Touch, hand: list[float], velocity: tuple[float, float], span: float
    ) -> float | None:
        """When within ``span`` [s] the gap closes faster than gently, or None."""
        pose, twist, gap = touch.pose, touch.twist, touch.gap
        if gap <= 0.0:
            # Already touching: only a blow is an impact (the object swung into a moving face).
            return 0.0 if touch.rate < -GENTLE and gap > -1e-8 else None
        low, low_gap = 0.0, gap
        high, high_gap = span, self._gap_after(pose, twist, hand, velocity, span)
        if high_gap > 0.0:
            return None
        for _ in range(30):
            middle = low + (high - low) * min(max(low_gap / (low_gap - high_gap), 0.01), 0.99)
            middle_gap = self._gap_after(pose, twist, hand, velocity, middle)
            if middle_gap > 0.0:
                low, low_gap = middle, middle_gap
            else:
                high, high_gap = middle, middle_gap
            if high - low < 1e-9 or low_gap < 1e-10:
                break
        later = (pose[0] + low * twist[0], pose[1] + low * twist[1], pose[2] + low * twist[2])
        reached = [hand[0] + low * velocity[0], hand[1] + low * velocity[1]]
        return low if self.touch(later, twist, reached, velocity).rate < -GENTLE else None

    def _gap_after(
        self, pose: Planar, twist: Planar, hand: list[float], velocity: tuple[float, float], span: float
    ) -> float:
        return self.gap(
            pose[0] + span * twist[0], pose[1] + span * twist[1], pose[2] + span * twist[2],
            hand[0] + span * velocity[0], hand[1] + span * velocity[1],
        )[0]  # fmt: skip


def blow(touch: Touch, velocity: tuple[float, float], body: Body, inertia: float) -> tuple[float, float, float]:
    """Routh's impact: the impulse in W [N s], and its angular one about Bcm [N m s].

    Args:
        touch: of object and hand as they meet.
        velocity: of the tip [m/s].
        body: its mass, centre of mass and contact with the hand.
        inertia: about z through Bcm [kg m^2].
    """
    _, (vx, vy, wz), _, nx, ny, rx, ry, rate = touch
    yaw = touch.pose[2]
    c, s = math.cos(yaw), math.sin(yaw)
    cx, cy = float(body.p_BBcm[0]), float(body.p_BBcm[1])
    mx, my = rx - (c * cx - s * cy), ry - (s * cx + c * cy)  # contact point from Bcm
    slip = -ny * (vx - wz * ry - velocity[0]) + nx * (vy + wz * rx - velocity[1])
    impulse = routh_impulse(
        lever_n=mx * nx + my * ny, lever_t=-mx * ny + my * nx, approach=rate, slip=slip, mass=body.mass,
        inertia=inertia, friction=body.hand_friction, restitution=body.restitution,
    )  # fmt: skip
    jx = impulse.normal * nx - impulse.tangent * ny
    jy = impulse.normal * ny + impulse.tangent * nx
    return jx, jy, mx * jy - my * jx
