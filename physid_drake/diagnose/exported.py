"""The model that a diagnosis exports."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physid_drake.diagnose.estimates import correlation_of, parameters_of
from physid_drake.diagnose.evidence import Evidence
from physid_drake.identify.estimates import estimates_of
from physid_drake.model import AS_W, Axes, Correlation, Model, turned
from physid_drake.pushes.problem import HandUse, PushProblem

SAME = 0.9  # determinant of the mean of frames: they lie within about 25 degrees of each other


def model_of(evidence: Evidence) -> Model:
    """The model to export, for ``model.yaml``: with the effects or the unnamed force that was found."""
    case, fit, fitter = evidence.case, evidence.corrected, evidence.fitter
    h, spec = fit.hypothesis, case.pool.spec
    # Also of what these pushes do not tell: a drag is known over a mass, and belief in one goes with the other.
    intervals: dict[str, object] = {f"theta.{e.name}": list(e.ci90) for e in estimates_of(fitter, fit)}
    for k, part in enumerate(h.parts if evidence.named else ()):
        intervals |= {f"{part.kind.name}.{name}": p.ci90 for name, p in parameters_of(fitter, fit, k).items()}
    names, matrix = correlation_of(fitter, fit)
    hand_axes, hand_turns = hand_frame(case.problems)
    hand = HandUse.of(case.problems)
    kept = [k for k, name in enumerate(names) if name in intervals]
    return Model(
        recording=case.recording.name,
        shape=spec.shape,
        hand_radius=spec.hand_radius,
        table=spec.table,
        config=spec.config,
        body=case.thetas.body(h.theta(fit.point.z)),
        effects=h.effects(fit.point.z),
        intervals=intervals,
        correlation=Correlation.of([names[k] for k in kept], matrix[np.ix_(kept, kept)]),
        hand_axes=hand_axes,
        hand_turns=hand_turns,
        tip_height=hand.tip_height,
        contact_height=hand.contact_height,
        top_speed=hand.top_speed,
    )


def hand_frame(problems: Sequence[PushProblem]) -> tuple[Axes, bool]:
    """The axes of P in the pushes.

    Args:
        problems: the pushes.

    Returns:
        The mean axes (2, 2), as columns, and whether they turn with the push: then they are relative to its heading,
        otherwise to W. The axes of W where the pushes have no common axes either way.
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
