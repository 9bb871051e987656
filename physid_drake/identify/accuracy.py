"""How well pushes are predicted: root mean square errors in physical units and in units of tracker noise."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.pushes.case import Case

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True)
class Accuracy:
    """Root mean square errors of pushes, over the windows that are compared.

    Attributes:
        rms: of x, y and yaw, in units of tracker noise.
        per_push: the same for each push.
        position: of the distance in the plane [m].
        rotation: of the yaw [rad]; NaN where no yaw was measured.
        end_position: of the distance in each push's last window [m].
        end_rotation: of the yaw in each push's last window [rad].
        force: of the size of the hand's force [N]; NaN where none was compared.
        diverged: number of pushes that could not be simulated, which are not in the errors.
    """

    rms: float
    per_push: tuple[float, ...]
    position: float
    rotation: float
    end_position: float
    end_rotation: float
    force: float
    diverged: int = 0


def accuracy_of(case: Case, errors: Sequence[Array | None]) -> Accuracy:
    """The accuracy of predictions.

    Args:
        case: the recording, made ready.
        errors: per push (m,), recorded less predicted features, in the features' units; None where there is no
            rollout.
    """
    made = [(f, e) for f, e in zip(case.features, errors, strict=True) if e is not None]
    poses = [f.poses(e) for f, e in made]
    forces = [f.forces(e) for f, e in made]
    scaled = [(p / f.sigmas)[:, : f.dofs] for (f, _), p in zip(made, poses, strict=True)]
    turned = _joined([p for (f, _), p in zip(made, poses, strict=True) if f.dofs == 3])[:, 2]
    turned_last = np.array([p[-1, 2] for (f, _), p in zip(made, poses, strict=True) if f.dofs == 3])
    every, last = _joined(poses), np.array([p[-1] for p in poses]).reshape(-1, 3)
    return Accuracy(
        rms=rms(np.concatenate([np.zeros(0), *map(np.ravel, scaled)])), per_push=tuple(rms(s) for s in scaled),
        position=math.sqrt(2.0) * rms(every[:, :2]), rotation=rms(turned),
        end_position=math.sqrt(2.0) * rms(last[:, :2]), end_rotation=rms(turned_last),
        force=math.sqrt(2.0) * rms(_joined(forces, 2)),
        diverged=len(errors) - len(made),
    )  # fmt: skip


def _joined(parts: Sequence[Array], width: int = 3) -> Array:
    return np.concatenate([np.zeros((0, width)), *parts])


def rms(values: Array) -> float:
    """Root mean square; NaN of an empty array."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else math.nan
