"""The model that leaves a diagnosis, and what it predicts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.diagnose.estimates import correlation_of, theta_intervals
from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.model import Fitted
from physid_drake.diagnose.values import Diagnosis
from physid_drake.model import AS_W, Axes, Correlation, Model, turned
from physid_drake.pushes.problem import HandUse, PushProblem

Array = NDArray[np.float64]

SAME = 0.9  # determinant of the mean of frames: they lie within about 25 degrees of each other


def fit_that_leaves(diagnosis: Diagnosis, evidence: Evidence) -> Fitted:
    """The fit with the effects if they were found, else the plain cell where it predicts best."""
    return evidence.final if diagnosis.effects else evidence.nearest


def predicted(evidence: Evidence, errors: Sequence[Array], i: int) -> Array:
    """Window means (w, 3) [m, m, rad] of push i, left out, of ``errors_before`` or ``errors_after``."""
    features = evidence.case.features[i]
    return features.poses(features.recorded - errors[i])


def model_of(diagnosis: Diagnosis, evidence: Evidence) -> Model:
    """The model that leaves, as ``model.yaml`` has it: with the effects if they were found, else plain."""
    case, fitted = evidence.case, fit_that_leaves(diagnosis, evidence)
    state, spec = fitted.state, case.pool.spec
    # Also of what these pushes do not tell: a drag is known over a mass, and belief in one goes with the other.
    intervals: dict[str, object] = {f"theta.{n}": list(ends) for n, ends in theta_intervals(evidence, fitted).items()}
    for effect in diagnosis.effects:
        intervals |= {f"{effect.name}.{name}": p.ci90 for name, p in effect.parameters.items()}
    names, matrix = correlation_of(case, fitted)
    hand_axes, hand_turns = hand_frame(case.problems)
    hand = HandUse.of(case.problems)
    kept = [k for k, name in enumerate(names) if name in intervals]
    return Model(
        recording=case.recording.name,
        shape=spec.shape,
        hand_radius=spec.hand_radius,
        table=spec.table,
        config=spec.config,
        body=case.thetas.body(np.asarray(case.thetas.space.from_unit(state.u))),
        effects=tuple(e.effect(case) for e in state.effects) if diagnosis.effects else (),
        intervals=intervals,
        correlation=Correlation.of([names[k] for k in kept], matrix[np.ix_(kept, kept)]),
        hand_axes=hand_axes,
        hand_turns=hand_turns,
        tip_height=hand.tip_height,
        contact_height=hand.contact_height,
        top_speed=hand.top_speed,
    )


def hand_frame(problems: Sequence[PushProblem]) -> tuple[Axes, bool]:
    """The mean of the pushes' axes of P, and whether they are along and across the push instead of those of W.

    Those of W where they differ so much, either way, that there is no frame.
    """
    pushed = [p for p in problems if p.path is not None]
    fixed = [p.hand_axes for p in pushed]
    along = [turned(-p.path.heading) @ p.hand_axes for p in pushed if p.path is not None]
    for every, turns in ((fixed, False), (along, True)):
        mean = np.mean(every, axis=0) if every else np.zeros((2, 2))
        if abs(np.linalg.det(mean)) > SAME:
            (a, b), (c, d) = mean.tolist()
            return ((a, b), (c, d)), turns
    return AS_W, False
