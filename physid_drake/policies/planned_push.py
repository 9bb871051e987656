"""One push as it is planned: direction, speed, contact offset and distance, and the hand's path that follows."""

from __future__ import annotations

import dataclasses as dc
import math

import numpy as np

from physid_drake.cell import HandPath
from physid_drake.cell.outline import Outline
from physid_drake.errors import ConfigError

Pose = tuple[float, float, float]

LEAD = 0.1  # s at rest before the hand moves
ACCELERATION = 10.0  # m/s^2 of the approach
DECELERATION = 20.0  # m/s^2 of the brake: above any friction times gravity, so that a fast object slides on
SHORTEST_RAMP = 0.05  # s: slower pushes start and stop no more abruptly than this
STEADY = 5e-3  # m at constant speed before the touch


@dc.dataclass(frozen=True, kw_only=True)
class PlannedPush:
    """A straight push.

    Attributes:
        direction: of the hand's motion in W [rad], 0 along x.
        speed: from just before the touch to the brake [m/s].
        travel: of the hand from the touch to the brake [m].
        contact_offset: of the hand's line from the object's middle, to the left of the motion [m].
    """

    direction: float
    speed: float
    travel: float
    contact_offset: float = 0.0

    def __post_init__(self) -> None:
        numbers = (self.direction, self.speed, self.travel, self.contact_offset)
        if not all(math.isfinite(v) for v in numbers) or self.speed <= 0.0 or self.travel <= 0.0:
            raise ConfigError(
                "planned push: speed and travel are positive and everything is finite, but got direction"
                f" {self.direction:g} rad, speed {self.speed:g} m/s, travel {self.travel:g} m,"
                f" contact offset {self.contact_offset:g} m."
            )

    def path(self, pose: Pose, outline: Outline, hand_radius: float) -> HandPath:
        """Rest, approach, constant speed over ``travel`` from the touch on, brake.

        Args:
            pose: x, y [m] and yaw [rad] of the object.
            outline: of the object, in B.
            hand_radius: of the tip [m].

        Raises:
            ConfigError: if the hand would pass the object.
        """
        ahead = np.array([math.cos(self.direction), math.sin(self.direction)])
        aside = np.array([-ahead[1], ahead[0]])
        middle = np.array(pose[:2]) + self.contact_offset * aside
        back = self._touch(pose, outline, hand_radius)
        ramp = max(SHORTEST_RAMP, self.speed / ACCELERATION)
        brake = max(SHORTEST_RAMP, self.speed / DECELERATION)
        cruise = (STEADY + self.travel) / self.speed
        run_up = 0.5 * ramp * self.speed + STEADY
        return HandPath(
            times=np.cumsum([LEAD, ramp, cruise, brake]),
            velocities=np.outer([0.0, self.speed, self.speed, 0.0], ahead),
            start=middle - (back + run_up) * ahead,
        )

    def _touch(self, pose: Pose, outline: Outline, hand_radius: float) -> float:
        """How far behind the object's middle the tip's centre touches it, along the hand's line [m]."""
        # In B the motion is turned by the object's yaw.
        turn = self.direction - pose[2]
        ax, ay = math.cos(turn), math.sin(turn)

        def gap(back: float) -> float:
            x, y = -self.contact_offset * ay - back * ax, self.contact_offset * ax - back * ay
            return outline.nearest(x, y)[0] - hand_radius

        x0, y0, x1, y1 = outline.extent()
        near, far = 0.0, math.hypot(max(-x0, x1), max(-y0, y1)) + hand_radius
        if gap(near) > 0.0:
            raise ConfigError(
                f"planned push: a contact offset of {1e3 * self.contact_offset:.1f} mm passes the object;"
                " move it towards the middle."
            )
        for _ in range(60):
            middle = 0.5 * (near + far)
            near, far = (near, middle) if gap(middle) > 0.0 else (middle, far)
        return far
