"""What a contact does in a step that Coulomb's law and the hand's path do not ask for: its gap drifts, and it creeps.

The gap moves beyond Drake's linear prediction where the face turns in a step. A contact that sticks slips all the
same, since regularised friction is a function of slip, zero without it: a slow hand takes long for its way, and its
tip would leave its place on the face.
"""

from __future__ import annotations

import math

from physid_drake.cell.touch import HandMove, Planar, Tip, Touch

# Of the largest friction: with less to spare the contact begins to slide, which is no creep to be made up for.
SPARE = 0.1


class ContactDrift:
    """What the tip drifted and crept in the last step, fed forward into its velocity."""

    def __init__(self, tip: Tip) -> None:
        """``tip`` tells gaps to the object's outline."""
        self._tip, self._drift, self._creep = tip, 0.0, 0.0

    def forget(self) -> None:
        """Nothing is to be made up for: the contact is new, or there is none."""
        self._drift = self._creep = 0.0

    def command(self, touch: Touch, velocity: tuple[float, float], span: float) -> tuple[float, float]:
        """The tip's velocity [m/s] over a step of ``span`` [s] that makes up for drift and creep."""
        mend, nx, ny = -self._drift / span, touch.nx, touch.ny
        return velocity[0] + mend * nx - self._creep * ny, velocity[1] + mend * ny + self._creep * nx

    def learn(self, before: Touch, pose: Planar, twist: Planar, move: HandMove, span: float, spare: float) -> None:
        """Measure the drift and the creep of a step.

        Args:
            before: the touch at its start.
            pose: of the object's section at its end.
            twist: of the section at its end.
            move: the hand's.
            span: s.
            spare: of the largest friction, what the contact did not need.
        """
        nx, ny, rx, ry = before.nx, before.ny, before.rx, before.ry
        vx, vy, wz = twist
        slip_x, slip_y = vx - wz * ry - move.velocity[0], vy + wz * rx - move.velocity[1]
        now, *_ = self._tip.gap(*pose, *move.goal)
        self._drift = now - (before.gap + span * (nx * slip_x + ny * slip_y))
        self._creep = min(spare / SPARE, 1.0) * (self._creep - (nx * slip_y - ny * slip_x))


def spare_friction(touch: Touch, force: Planar, friction: float) -> float:
    """Share of the largest friction that a contact of a coefficient ``friction`` did not need for a force [N]."""
    normal = touch.nx * force[0] + touch.ny * force[1]
    if friction * normal <= 0.0:
        return 0.0
    along = math.hypot(touch.nx * force[1] - touch.ny * force[0], force[2])
    return max(1.0 - along / (friction * normal), 0.0)
