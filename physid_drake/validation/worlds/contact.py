"""The contacts of a MuJoCo world: feet and tip as springs and dampers with Coulomb friction.

MuJoCo's usual settings let slip lift a contact, so that a sliding body rides on its fastest feet. A tiny impedance
of the normals and a large one of the friction undo it; a foot is then a spring and damper with Coulomb friction.
"""

from __future__ import annotations

import math
from typing import Final

from physid_drake.validation.worlds.world_plan import GRAVITY, Plan

RESIDUAL_RESTITUTION: Final = 0.0017
"""Of a central bounce where 0 is asked for: an overdamped contact still gives some. Measured with steps: 0.006."""
SINKAGE: Final = 1e-5  # m, at rest; more lets tall objects rock
IMPEDANCE: Final = 1e-4  # MuJoCo's smallest
SCALE: Final = 1e3  # takes the impedance of the normals lower still, by the body's inverse weight
FRICTION_RATIO: Final = 1e7 * SCALE
_TIP_DAMPING: Final = 12.0  # of critical, where nothing shall bounce
_TIP_FREQUENCY: Final = 1500.0  # rad/s; the stiffest tip that the step resolves
TIP_RATES: Final = (2000.0, 8000.0)  # 1/s; most damping over mass, usually and in a touch: stable twice off-centre
_SPRUNG_TIP_LAW: Final = (0.7, 300.0)  # damping ratio, rad/s; a light tip is unstable with more


def foot_law() -> tuple[float, float]:
    """Stiffness and damping of all feet together over the mass [1/s^2, 1/s]: critically damped."""
    return GRAVITY / SINKAGE, 2.0 * math.sqrt(GRAVITY / SINKAGE)


def tip_law(plan: Plan) -> tuple[float, float]:
    """Stiffness and damping of the tip's contact over the object's mass [1/s^2, 1/s]."""
    if plan.sprung_tip is not None:
        ratio, frequency = _SPRUNG_TIP_LAW
    else:
        ratio = damping_ratio(plan.restitution)
        frequency = min(_TIP_FREQUENCY, TIP_RATES[1] / (2.0 * ratio))
    return frequency**2, 2.0 * ratio * frequency


def damping_ratio(restitution: float) -> float:
    """Of the tip's contact, as a ratio, that gives a coefficient of restitution between 0.0017 and 1."""
    wanted = min(0.98, max(restitution, RESIDUAL_RESTITUTION))
    low, high = 1e-3, _TIP_DAMPING
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if _bounce(middle) > wanted else (low, middle)
    return (low + high) / 2.0


def _bounce(ratio: float) -> float:
    """Restitution of a spring and damper that lets go where its force is zero."""
    if ratio < 1.0:
        root = math.sqrt(1.0 - ratio**2)
        phase = math.pi - math.atan2(2.0 * ratio * root, 1.0 - 2.0 * ratio**2)
        # Past ratio 1/sqrt 2 the force vanishes in the other branch of the arc tangent, which atan2 takes by itself.
        return math.exp(-ratio / root * phase)
    root = math.sqrt(max(ratio**2 - 1.0, 1e-12))
    share = (ratio - root) / (ratio + root)
    return share * math.exp(2.0 * share * math.log(share) / (1.0 - share))
