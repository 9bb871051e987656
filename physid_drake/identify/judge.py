"""Refits hypotheses in the Drake cell, from whose rollouts all results are reported.

The twin finds a fit; then Gauss-Newton steps are made with the residuals of a cell with stiff contacts and the
derivatives of the twin.
"""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import CellConfig
from physid_drake.inference.fit import Fit, Fitter
from physid_drake.inference.hypothesis import Hypothesis
from physid_drake.inference.rollouts import Ask
from physid_drake.pushes.problem import spec_of

Array = NDArray[np.float64]

TIME_STEP, LONGEST_TIME_STEP = 5e-4, 1e-3  # s: of the judge; of a hand that is not slow
HAND_FREQUENCY, REST_DEPTH, STICTION = 3000.0, 3e-7, 1e-5  # rad/s, m, m/s: a contact that hardly gives
STEPS, SETTLED = 2, 0.3  # most steps; a step that gains less log likelihood is the last


class Judge:
    """Takes fits from the twin to the Drake cell.

    Attributes:
        fitter: as the one that found the fits, but with the cell's predictions.
    """

    def __init__(self, fitter: Fitter) -> None:
        case = fitter.case
        pool = case.pool.of(spec_of(case.recording, stiff(case.config)))
        self.fitter = Fitter(case, fitter.predictor.judging(pool))
        self.fitter.tolerances = fitter.tolerances

    def judged(self, fit: Fit) -> Fit:
        """The fit after steps that raise its likelihood in the cell; the same where the cell cannot roll it out."""
        h, point = fit.hypothesis, self.fitter.points([fit.hypothesis], [fit.point.z], [fit.point.nuisance])[0]
        if point is None:  # the cell cannot roll it out: what the twin says stands
            return fit
        best = self.fitter.seen_at(fit, point)
        for _ in range(STEPS):
            z, nuisance = self.fitter.step(best)
            moved = self.fitter.points([h], [z], [nuisance])[0]
            if moved is None:
                break
            other = self.fitter.seen_at(best, moved)
            gained = other.log_likelihood - best.log_likelihood
            best = other if gained > 0.0 else best
            if gained < SETTLED:
                break
        return best

    def errors(self, h: Hypothesis, zs: Sequence[Array]) -> list[Array | None]:
        """Recorded less predicted features (m_i,) of each push, in the features' units; None without a rollout.

        Of the push itself, a prediction uses only the recorded start of the object and the hand's path.

        Args:
            h: the hypothesis.
            zs: (n,) for each push.
        """
        rests, predictor = self.fitter.at_rest(), self.fitter.predictor
        asks = [Ask(i, h.physics(z), rests[i]) for i, z in enumerate(zs)]
        pairs = zip(predictor.vectors(asks), predictor.recorded, predictor.whitening, strict=True)
        return [None if one is None else np.asarray(np.linalg.solve(w, y - one)) for one, y, w in pairs]

    def left_out(self, fit: Fit) -> tuple[Array, ...]:
        """Errors (m_i,) of each held-out push, in the features' units.

        The push is rolled out by the cell with z from all other pushes. Where there is no rollout, they are
        linearised about the fit.
        """
        zs = [self.fitter.without(fit, i) for i in range(len(fit.pushes))]
        made = []
        for push, z, whitening, error in zip(
            fit.pushes, zs, self.fitter.predictor.whitening, self.errors(fit.hypothesis, zs), strict=True
        ):
            left = push.residual - push.shared @ (z - fit.point.z)
            made.append(np.asarray(np.linalg.solve(whitening, left)) if error is None else error)
        return tuple(made)


def stiff(config: CellConfig) -> CellConfig:
    """The cell with stiffer contacts and a shorter time step.

    A cell whose time step is long, since its hand is slow, is returned as it is.
    """
    solver, contact = config.solver, config.contact
    if solver.time_step_s > LONGEST_TIME_STEP:
        return config
    time_step = min(TIME_STEP, solver.time_step_s)
    return dc.replace(
        config,
        solver=dc.replace(
            solver, time_step_s=time_step, slide_time_step_s=min(2.0 * time_step, solver.slide_time_step_s)
        ),
        contact=dc.replace(
            contact, hand_frequency_rad_s=HAND_FREQUENCY, rest_depth_m=REST_DEPTH, stiction_tolerance_mps=STICTION
        ),
    )
