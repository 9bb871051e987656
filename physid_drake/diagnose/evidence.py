"""All that a diagnosis rests on."""

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
    """All that was computed, for the report and for the model that is exported.

    Attributes:
        known: the identification, with the recording and the baseline model in the Drake cell.
        found: all hypotheses, fitted on the twin.
        decision: the verdict.
        fitter: the fitter whose predictions are the Drake cell's.
        best: the hypothesis that was decided on, refined in the cell; None where nothing is missing, or nothing found
            helps.
        errors_after: per held-out push (m,), recorded less predicted features with the best hypothesis, in the
            features' units; those of the baseline where there is none.
        errors_partly: the same with effects that explain a part of the mismatch; None where there are none.
        wrenches: force and torque that the baseline lacks, window by window.
        next_push: the push that would distinguish rivals best; None where there is none.
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
        """The recording, made ready."""
        return self.known.case

    @property
    def baseline(self) -> Fit:
        """The baseline model in the Drake cell."""
        return self.known.fit

    @property
    def errors_before(self) -> tuple[Array, ...]:
        """Per held-out push (m,), recorded less predicted features with the baseline, in the features' units."""
        return self.known.errors

    @property
    def named(self) -> bool:
        """Whether the verdict names effects."""
        return self.decision.verdict in ("explained", "ambiguous")

    @property
    def corrected(self) -> Fit:
        """The model to export: with the effects or the unnamed force that was found, otherwise the baseline."""
        return self.baseline if self.best is None else self.best


def predicted(evidence: Evidence, errors: tuple[Array, ...], push: int) -> Array:
    """Predicted window means (w, 3), x, y [m], yaw [rad], of a held-out push.

    Args:
        evidence: of the diagnosis.
        errors: its ``errors_before`` or ``errors_after``.
        push: index of the push.
    """
    features = evidence.case.features[push]
    return features.poses(features.recorded - errors[push])
