"""Friction where slip turns about a place within what a support point stands for.

A point has friction of full size and of one direction. Over the part of the underside that it stands for, here a disc
of the same area, slip points all ways where it turns about a place within: most of the friction cancels, and leaves a
torque. The form is a fit, not a closed form: the mean over the disc would count again what the points' weights, which
are right for slip that changes little from one to the next, have counted already.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

# Where slip turns about a place at a distance from a point, in radii of its disc. Chosen for the least error of
# forces and torques over six bases and 30 to 45 points; `benchmarks/turning.py` prints what is left.
CANCELS = 2.0  # further off, nothing cancels
LEAVES_ALL = 1.1  # about where friction begins to cancel
OWN_ARM = 0.35  # of the torque about the disc's centre; two thirds if no other point made up for it
OWN_TORQUE = 1.2  # further off, the disc has no torque of its own


@dataclass(frozen=True, kw_only=True)
class Turning:
    """A support point that slip nearly turns about.

    Attributes:
        point: its index.
        cancelled: share of its friction that cancels over what the point stands for.
        arm: of the torque that is left there, about the point: so many metres times the point's friction.
    """

    point: int
    cancelled: float
    arm: float

    @classmethod
    def of(cls, point: int, distance: float, radius: float) -> Turning:
        """Where slip turns about a place at a distance [m] from a point that stands for a disc of a radius [m]."""
        apart = distance / radius
        near = apart / LEAVES_ALL
        left = near / math.pow(1.0 + near**8, 0.125)  # a smooth min(near, 1)
        arm = OWN_ARM * radius * max(0.0, 1.0 - (apart / OWN_TORQUE) ** 2)
        return cls(point=point, cancelled=1.0 - left, arm=arm)
