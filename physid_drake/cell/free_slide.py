"""Corrections of a step in which the object slides free of the hand: its friction, and how far it comes."""

from __future__ import annotations

import numpy as np

from physid_drake.cell.plant_state import PlantState
from physid_drake.cell.support import Support
from physid_drake.cell.touch import Planar


class FreeSlide:
    """Mends the steps of an object that slides on its support points."""

    def __init__(self, support: Support, *, trapezoid: bool, tilt_depth: float | None) -> None:
        """Prepare.

        Args:
            support: the points that carry the object.
            trapezoid: whether positions are updated by the trapezoidal rule instead of the symplectic one.
            tilt_depth: rest depth [m] of a hydroelastic support; None where a lean adds no friction.
        """
        self._support, self._trapezoid = support, trapezoid
        self._tilt_gain = 0.0 if tilt_depth is None else 1.0 / tilt_depth

    def without_tilt_friction(self, state: PlantState, before: Planar, after: Planar) -> Planar:
        """Take back the friction that a tilted rigid face on a compliant table feels too much of.

        A face that leans by n and slides at v is predicted to lift by v n dt in a step, as if the table were
        not flat; equilibrium makes up for it by sinking deeper, and CENIC's lagged friction follows the
        depth: too large by v n dt / depth. Measured: -2.5 % of a slide at 1 m/s and 2 ms.

        Args:
            state: at the end of the step.
            before: the twist with which Drake began it.
            after: the twist at the end; the mended one is returned.
        """
        if self._tilt_gain <= 0.0:
            return after
        excess = self._mean_depth(state) * self._tilt_gain - 1.0
        if not 0.0 < excess < 0.5:  # lighter than at rest, or a bounce: nothing of the kind
            return after
        factor = 1.0 / (1.0 + excess)
        vx, vy, wz = (old + factor * (new - old) for old, new in zip(before, after, strict=True))
        state.set_twist((vx, vy, wz))
        return vx, vy, wz

    @property
    def mends_friction(self) -> bool:
        """Whether ``without_tilt_friction`` has anything to take back."""
        return self._tilt_gain > 0.0

    def mend_position(self, state: PlantState, before: Planar, after: Planar, span: float) -> None:
        """Move the object by half of what its velocity changed from ``before`` to ``after`` over a ``span`` [s]."""
        if self._trapezoid:
            state.shift(
                0.5 * span * (before[0] - after[0]),
                0.5 * span * (before[1] - after[1]),
                0.5 * span * (before[2] - after[2]),
            )

    def _mean_depth(self, state: PlantState) -> float:
        """How deep the support points are in the table on average [m]; those that hang over it not at all."""
        foot, along_x, along_y = state.lean()
        plane = foot + self._support.points @ np.array([along_x, along_y])
        return float(self._support.weights @ np.maximum(plane, 0.0))
