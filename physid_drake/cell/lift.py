"""The friction that CENIC's hydroelastic contact takes from depths beyond the loads, and its return.

A rigid face that leans by n and slides at v on a compliant table is predicted to lift by v n dt in a step, as if the
table were not flat. Equilibrium makes up for it by sinking deeper, and the lagged friction follows the depth: too
large by v n dt over it. Measured: -2.5 % of a slide at 1 m/s and 2 ms; and where points lift by more than others, a
torque.
"""

from __future__ import annotations

import math

import numpy as np

from physid_drake.cell.object_state import Underside, as_plane, lifts_of

TINY = 1e-12  # m/s: nothing lifts where nothing slips, and directions need not fade there


class Lift:
    """The excess friction of a rollout's support points.

    It goes with slip and is a few per cent of the friction: four points that are together as rough as all of them,
    with the same mean and covariance, tell it to a thousandth of the friction, unless some of them leave the table.
    Plain floats, since a rollout asks at every time step.
    """

    def __init__(self, underside: Underside, stiffness: float) -> None:
        """``stiffness`` of the whole support [N/m]."""
        points = underside.points
        self._points, self._stiffness = points, stiffness
        self._roughness = underside.weights * underside.friction
        rough = max(float(self._roughness.sum()), TINY)
        middle = complex(self._roughness @ points) / rough
        arms = as_plane(points - middle)
        variances, axes = np.linalg.eigh((self._roughness * arms.T) @ arms / rough)
        ways = (np.sqrt(2.0 * np.maximum(variances, 0.0)) * axes).T.tolist()
        self._four = [middle + sign * complex(*way) for way in ways for sign in (1.0, -1.0)]
        self._share, self._farthest = 0.25 * rough, float(np.abs(points).max())
        self._ends_x = float(points.real.min()), float(points.real.max())
        self._ends_y = float(points.imag.min()), float(points.imag.max())

    def excess(
        self, span: float, lean: tuple[float, float, float], velocity: complex, spin: float
    ) -> tuple[complex, float]:
        """Force on the table's plane, x + iy in B [N], and moment about Bo [N m], given back over a time step.

        Args:
            span: of the time step [s].
            lean: depth of Bo's foot in the table [m], and how it grows along x and y of B [-].
            velocity: of Bo, x + iy in B [m/s].
            spin: rad/s.
        """
        foot, along_x, along_y = lean
        shallowest = foot + min(along_x * x for x in self._ends_x) + min(along_y * y for y in self._ends_y)
        fastest = abs(velocity) + abs(spin) * self._farthest
        if shallowest < span * fastest * math.hypot(along_x, along_y):
            return self._of_all(span, lean, velocity, spin)
        force, moment, gain = 0j, 0.0, self._stiffness * span * self._share
        for point in self._four:
            slip = velocity + 1j * spin * point
            push = gain * (along_x * slip.real + along_y * slip.imag) / (abs(slip) + TINY) * slip
            force += push
            moment += point.real * push.imag - point.imag * push.real
        return force, moment

    def _of_all(
        self, span: float, lean: tuple[float, float, float], velocity: complex, spin: float
    ) -> tuple[complex, float]:
        """The same from all points: what is not in the table cannot be too deep in it."""
        slips = velocity + 1j * spin * self._points
        lifts = lifts_of(self._points, slips, span, lean)
        pushes = self._stiffness * self._roughness * lifts / (np.abs(slips) + TINY) * slips
        return complex(pushes.sum()), float(np.vdot(self._points, pushes).imag)
