"""Contact of tip and object as impulses: a rigid contact with Coulomb friction in closed form, and blows."""

from __future__ import annotations

import math

import numpy as np

from physid_drake.twin.compiled import compiled, compiled_inside

NO_SLIP = 1e-15  # m/s
FEWEST_PHASES = 4  # of a planar blow: slip, stick or slip back, before and after the greatest compression


@compiled_inside
def resting_contact(un, ut, wnn, wnt, wtt, friction):
    """Normal and tangential impulse that end a relative velocity: the contact separates, sticks or slips.

    Args:
        un, ut: velocity of the object's point against the tip, along the normal and across it [m/s].
        wnn, wnt, wtt: velocity per impulse, the inverse of the mass that the contact feels [1/kg].
        friction: coefficient of the contact [-].
    """
    if un >= 0.0:
        return 0.0, 0.0
    det = wnn * wtt - wnt * wnt
    pn, pt = (-un * wtt + ut * wnt) / det, (-ut * wnn + un * wnt) / det
    if pn > 0.0 and abs(pt) <= friction * pn:
        return pn, pt
    likely = 1.0 if pt > 0.0 else -1.0
    for sign in (likely, -likely):
        slope = wnn + sign * friction * wnt
        if slope > 0.0:
            pn = -un / slope
            if (ut + (wnt + sign * friction * wtt) * pn) * sign <= NO_SLIP:
                return pn, sign * friction * pn
    return max(0.0, -un / wnn), 0.0


@compiled
def blow(mass, inertia, rn, rt, un, ut, friction, restitution, tip_yield):
    """Normal and tangential impulse of a blow between a round tip and a planar object, Poisson's restitution.

    Source: E. J. Routh, Dynamics of a System of Rigid Bodies, 1905; Y. Wang and M. T. Mason, J. Applied
    Mechanics 59, 1992.

    Args:
        mass, inertia: of the object [kg, kg m^2].
        rn, rt: torque per unit of normal and tangential impulse, about Bcm [m].
        un, ut: velocity of the object's point against the tip [m/s]; un < 0.
        friction, restitution: of the contact [-].
        tip_yield: inverse of the tip's own mass [1/kg]; 0 of one that is moved as its path says.
    """
    wnn, wtt = 1.0 / mass + rn * rn / inertia + tip_yield, 1.0 / mass + rt * rt / inertia + tip_yield
    wnt = rn * rt / inertia
    pn, pt, end = 0.0, 0.0, np.inf
    for _ in range(FEWEST_PHASES):
        if abs(ut) > NO_SLIP:
            ratio = -math.copysign(friction, ut)
        elif abs(wnt) <= friction * wtt:
            ratio = -wnt / wtt
        else:
            ratio = -math.copysign(friction, wnt)
        slip_rate, rate = wnt + wtt * ratio, wnn + wnt * ratio
        stop = -ut / slip_rate if ut * slip_rate < 0.0 else np.inf
        if end == np.inf:
            turn = -un / rate if rate > 0.0 else np.inf
            if turn <= stop:  # greatest compression lies in this phase
                end = (1.0 + restitution) * (pn + turn)
        step = min(stop, end - pn)
        pn, pt, un = pn + step, pt + ratio * step, un + rate * step
        ut = 0.0 if step == stop else ut + slip_rate * step
        if pn >= end:
            break
    return pn, pt
