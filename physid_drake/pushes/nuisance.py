"""Each push's own small unknowns, with stated priors: they enter linearly and are fitted along.

What a recording cannot say exactly moves the object by several standard deviations of the tracker: where the
object stood, how the hand braked between two samples, the scatter of friction between pushes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import HandPath, Start
from physid_drake.pushes.problem import PushProblem, triple

Array = NDArray[np.float64]

BRAKE_STD = 0.3  # share of the brake's duration
SPEED_STD = 0.003  # share of the hand's speed
RESTITUTION_STD = 0.02
START = ("start_x", "start_y", "start_yaw")
VELOCITY = ("start_vx", "start_vy", "start_wz")


@dataclass(frozen=True, kw_only=True)
class Nuisance:
    """One push's nuisance parameters and their prior standard deviations.

    Attributes:
        names: of the unknowns, all zero when nothing is known.
        stds: (k,) prior standard deviations.
    """

    names: tuple[str, ...]
    stds: Array

    def index(self, name: str) -> int:
        """Position of an unknown."""
        return self.names.index(name)


def nuisance_of(problem: PushProblem, friction_scatter: float) -> Nuisance:
    """The unknowns of one push."""
    names = list(START)
    stds = list(problem.start_std[:3])
    if problem.path is None:
        names += VELOCITY
        stds += list(problem.start_std[3:])
    else:
        if problem.path.last_brake(*problem.moving) is not None:
            names.append("brake")
            stds.append(BRAKE_STD)
        names += ["speed", "restitution"]
        stds += [SPEED_STD, RESTITUTION_STD]
    return Nuisance(names=(*names, "friction"), stds=np.array([*stds, friction_scatter]))


@dataclass(frozen=True, kw_only=True)
class PushSetting:
    """A push with its unknowns put in: start, path, friction scale and restitution."""

    start: Start
    path: HandPath | None
    friction_scale: float
    restitution: float


def apply_nuisance(problem: PushProblem, nuisance: Nuisance, values: Array) -> PushSetting:
    """The push that the unknowns (k,) describe."""
    given = dict(zip(nuisance.names, values.tolist(), strict=True))
    pose = np.array(problem.start.pose) + [given[name] for name in START]
    velocity = np.array(problem.start.velocity) + [given.get(name, 0.0) for name in VELOCITY]
    path = problem.path
    if path is not None:
        brake = path.last_brake(*problem.moving)  # a faster hand brakes at the same knots
        path = path.faster(given.get("speed", 0.0)).braking(given.get("brake", 0.0), brake)
    start = replace(problem.start, pose=triple(pose), velocity=triple(velocity))
    return PushSetting(
        start=start,
        path=path,
        friction_scale=1.0 + given["friction"],
        restitution=given.get("restitution", 0.0),
    )
