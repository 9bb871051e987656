"""A rough fit of the baseline model to a few pushes: what it leaves of all, and of most of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.errors import PhysidError
from physid_drake.identify.baseline import baseline_hypothesis
from physid_drake.inference.fit import Fit, Fitter, Point
from physid_drake.inference.predictions import Predictor
from physid_drake.inference.push import TAIL
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Recording

Array = NDArray[np.float64]

STARTS: Final = 32
FITTED: Final = 2
STEPS: Final = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Left:
    """What the baseline leaves of the pushes that are fitted, in units of noise.

    Attributes:
        names: of the pushes.
        fitter: of these.
        fit: the likeliest, if errors are normal.
        starts: from which it may begin, or another one.
    """

    names: tuple[str, ...]
    fitter: Fitter
    fit: Fit
    starts: tuple[Point, ...]

    @property
    def of_all(self) -> float:
        """Of all pushes, by the fit in which each counts alike."""
        return float(self.fit.noise_scale)

    @cached_property
    def each(self) -> Array:
        """Of each push (n,), by the fit that leaves least of most of them: one that is far off hardly counts."""
        hypothesis = self.fit.hypothesis
        best = sorted(self.starts, key=lambda point: _of_most(self._misfits(point)))[:FITTED]
        begun = self.fitter.started([hypothesis] * len(best), best, [None] * len(best), TAIL)
        fits = self.fitter.fitted([*self.fitter.robust([self.fit.again()]), *begun], STEPS)
        return min((_each(fit) for fit in fits), key=_of_most)

    @property
    def of_most(self) -> float:
        """By the same fit, of that push than which more than half of them fit no worse."""
        return max(1.0, _of_most(self.each))

    def _misfits(self, point: Point) -> Array:
        pairs = zip(self.fitter.predictor.recorded, point.predicted, strict=True)
        return np.array([float(np.sqrt(np.mean((y - f) ** 2))) for y, f in pairs])


def _each(fit: Fit) -> Array:
    squares = [one.square / len(push.residual) for one, push in zip(fit.weighed, fit.pushes, strict=True)]
    return np.sqrt(squares)


def _of_most(each: Array) -> float:
    return float(np.sort(each)[len(each) // 2])


def left_by(recording: Recording) -> tuple[Left | None, str]:
    """What the baseline model leaves, fitted roughly; None and why, where it is refused."""
    try:
        case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
        case = replace(case, noise=replace(case.noise, known=True))
        fitter = Fitter(case, Predictor(case))
        hypothesis = baseline_hypothesis(case)
        rng = np.random.default_rng(0)
        drawn = hypothesis.space.sample(rng, STARTS, from_prior=True)
        zs = [hypothesis.mean, *(np.clip(hypothesis.space.to_unit(theta), *hypothesis.bounds) for theta in drawn)]
        points = fitter.points([hypothesis] * len(zs), zs, [fitter.at_rest()] * len(zs))
        starts = tuple(point for point in points if point is not None)
        best = sorted(starts, key=fitter.roughly)[:FITTED]
        if not best:
            return None, "no push can be simulated"
        fits = fitter.fitted(fitter.started([hypothesis] * len(best), best, [None] * len(best)), STEPS)
        fit = max(fits, key=lambda fit: fit.log_likelihood)
        return Left(names=tuple(p.name for p in case.recording.pushes), fitter=fitter, fit=fit, starts=starts), ""
    except PhysidError as error:
        return None, str(error)
