"""Everything that an answer rests on."""

from __future__ import annotations

import dataclasses as dc

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.decide import Decision
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.search import Found
from physid_drake.diagnose.values import NextPush
from physid_drake.identify import Identification
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.pushes.case import Case

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """What was computed, for the report and the model that leaves.

    Attributes:
        known: what was identified: the recording, and the baseline in the cell.
        found: all hypotheses, on the twin.
        decision: what is said.
        fitter: whose predictions are the cell's.
        best: the hypothesis that was decided on, or comes nearest, in the cell; None where nothing is missing.
        errors_after: per push (m,), recorded less what the best hypothesis predicts, fitted without that push; of the
            baseline where there is none.
        errors_partly: the same of effects that take a part away; None where there are none.
        wrenches: what is missing from the baseline, window by window.
        next_push: that would tell rivals apart.
    """

    known: Identification
    found: Found
    decision: Decision
    fitter: Fitter
    best: Fit | None
    errors_after: tuple[Array, ...]
    errors_partly: tuple[Array, ...] | None = None
    wrenches: tuple[MissingWrench, ...] = ()
    next_push: NextPush | None = None

    @property
    def case(self) -> Case:
        """The recording."""
        return self.known.case

    @property
    def baseline(self) -> Fit:
        """The baseline in the cell."""
        return self.known.fit

    @property
    def errors_before(self) -> tuple[Array, ...]:
        """Per push (m,), recorded less what the baseline predicts, fitted without that push."""
        return self.known.errors

    @property
    def named(self) -> bool:
        """Whether effects are named."""
        return self.decision.verdict in ("explained", "ambiguous")

    @property
    def corrected(self) -> Fit:
        """The model that leaves: with what was found, under a name or without one, else the baseline."""
        return self.baseline if self.best is None else self.best


def predicted(evidence: Evidence, errors: tuple[Array, ...], push: int) -> Array:
    """Window means (w, 3) [m, m, rad] of a push that was held out, of ``errors_before`` or ``errors_after``."""
    features = evidence.case.features[push]
    return features.poses(features.recorded - errors[push])
