"""What is to be rolled out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from physid_drake.effects import Effect
from physid_drake.pushes.nuisance import Nuisance
from physid_drake.pushes.problem import PushProblem

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Task:
    """One rollout to make: push ``problem`` with ``theta`` (d,), the push's nuisance parameters (k,), and effects."""

    problem: PushProblem
    theta: Array
    nuisance: Nuisance
    values: Array
    effects: tuple[Effect, ...] = ()
