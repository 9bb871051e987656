"""Pushes that were left out of a fit, simulated: their errors."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.estimates import rms
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]

OWN_ERROR = (2e-4, 2e-3)  # m, rad: of pushes left out, by which two honest simulators differ


@dc.dataclass(frozen=True, kw_only=True)
class Errors:
    """Root mean square errors of pushes that were left out.

    Attributes:
        rms: of their poses, in standard deviations.
        per_push: the same of each.
        position, rotation: of place and yaw [m, rad].
        force: of the hand's force [N]; NaN where none was compared.
        force_per_push: of the force of each, in standard deviations; NaN of those without.
    """

    rms: float
    per_push: tuple[float, ...]
    position: float
    rotation: float
    force: float
    force_per_push: tuple[float, ...]


def errors_of(case: Case, residuals: Sequence[Array]) -> Errors:
    """Of pushes that were left out, from what was recorded less what was simulated of each (m_i,)."""
    poses = [f.poses(r) for f, r in zip(case.features, residuals, strict=True)]
    forces = [f.forces(r) for f, r in zip(case.features, residuals, strict=True)]
    scaled = [p / f.sigmas for p, f in zip(poses, case.features, strict=True)]
    scaled_forces = [p / f.force_sigmas for p, f in zip(forces, case.features, strict=True)]
    every = np.concatenate(poses)
    return Errors(
        rms=rms(np.concatenate(scaled)), per_push=tuple(rms(s) for s in scaled),
        position=math.sqrt(2.0) * rms(every[:, :2]), rotation=rms(every[:, 2]),
        force=math.sqrt(2.0) * rms(np.concatenate(forces)), force_per_push=tuple(rms(s) for s in scaled_forces),
    )  # fmt: skip


def is_own_error(errors: Errors) -> bool:
    """Whether pushes are predicted as well as simulators agree: what is left has structure, and is no physics."""
    return errors.position < OWN_ERROR[0] and errors.rotation < OWN_ERROR[1]
