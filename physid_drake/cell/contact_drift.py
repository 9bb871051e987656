"""Drift of a sliding contact: the gap moves beyond Drake's linear prediction where the face turns in a step."""

from __future__ import annotations

from physid_drake.cell.touch import HandMove, Planar, Tip, Touch


class ContactDrift:
    """What the gap drifted in the last step, fed forward into the tip's velocity along the normal."""

    def __init__(self, tip: Tip) -> None:
        """``tip`` tells gaps to the object's outline."""
        self._tip, self._drift = tip, 0.0

    def forget(self) -> None:
        """Nothing is to be made up for: the contact is new, or there is none."""
        self._drift = 0.0

    def command(self, touch: Touch, velocity: tuple[float, float], span: float) -> tuple[float, float]:
        """The tip's velocity [m/s] over a step of ``span`` [s] that makes up for the drift."""
        mend = -self._drift / span
        return velocity[0] + mend * touch.nx, velocity[1] + mend * touch.ny

    def learn(self, before: Touch, pose: Planar, twist: Planar, move: HandMove, span: float) -> None:
        """Measure the drift of a step.

        Args:
            before: the touch at its start.
            pose: of the object's section at its end.
            twist: of the section at its end.
            move: the hand's.
            span: s.
        """
        nx, ny, rx, ry = before.nx, before.ny, before.rx, before.ry
        vx, vy, wz = twist
        rate = nx * (vx - wz * ry - move.velocity[0]) + ny * (vy + wz * rx - move.velocity[1])
        now, *_ = self._tip.gap(*pose, *move.goal)
        self._drift = now - (before.gap + span * rate)
