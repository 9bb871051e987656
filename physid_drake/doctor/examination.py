"""Fits the pushes as they are, and where they fit nothing, as they would be by other conventions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from physid_drake.doctor.convention import Convention
from physid_drake.doctor.conventions import conventions_of, gap_of, pairs_of
from physid_drake.doctor.forces import conventions_of_forces, without_forces
from physid_drake.errors import PhysidError
from physid_drake.identify.baseline import baseline_hypothesis
from physid_drake.inference.fit import Fitter
from physid_drake.inference.predictions import Predictor
from physid_drake.progress import Progress
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Recording

PUSHES: Final = 4
"""That are fitted: what is wrong with a convention is wrong with all."""
FAR: Final = 5.0
"""Deviations that a baseline leaves: less is physics that is missing, and what a diagnosis is for."""
MUCH: Final = 3.0
"""Times: so much better a convention has to fit, to be offered."""
ALIKE: Final = 1.3
"""Times: conventions that fit as well as the best one."""
NEAR: Final = 3e-3
"""m between tip and object as it is pushed: a convention by which it is so near is fitted."""
HAND_NOISE: Final = 3e-4
"""m: the hand's path is followed no better than that. A finer one has many more knots, and tells no frames."""
MOST_PAIRS: Final = 12
"""Pairs of conventions that are fitted."""
STARTS: Final = 32
STEPS: Final = 6


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What the pushes say of the recording's conventions.

    Attributes:
        before: what the baseline model leaves, in units of noise (1 if it explains all); None where it is refused.
        refused: why it is refused; empty if it is not.
        after: deviations that it leaves by the best other convention; None where none is much better.
        better: conventions that fit as well as that one.
    """

    before: float | None
    refused: str = ""
    after: float | None = None
    better: tuple[Convention, ...] = ()

    def lines(self) -> list[str]:
        """One line for each convention; none where the pushes speak for what is said."""
        if self.after is None:
            return []
        instead = "instead of not at all" if self.before is None else f"instead of {self.before:.3g}"
        lines = [
            f"the pushes fit to {self.after:.2g} sigma {instead} if {one.says} ({one.remedy})" for one in self.better
        ]
        if len(lines) > 1:
            lines.append("these are indistinguishable from the pushes: check which way the object really turned")
        return lines

    def sentence(self) -> str:
        """What came of it."""
        if self.before is None:
            left = "some of the pushes cannot be fitted as recorded"
        else:
            left = (
                "a rough fit of the baseline model (no effects) to some pushes has an error of"
                f" {self.before:.3g} sigma (in units of tracker noise)"
            )
        if self.better or (self.before is not None and self.before < FAR):
            return left
        return f"{left}; no other unit or convention that was tested fits better"


def examined(recording: Recording, progress: Progress | None = None) -> Finding:
    """Whether the pushes speak for other conventions than what is said.

    Args:
        recording: the pushes.
        progress: called with the stage, steps done and steps in all.
    """
    few = _few(recording)
    before, refused = _left(few)
    if before is not None and before < FAR:
        return Finding(before=before)
    # What is said of forces may be wrong beside what is said of places: these are asked first, and alone.
    unforced = without_forces(few)
    placed, _ = (before, refused) if unforced is few else _left(unforced)
    if unforced is not few and placed is not None and placed < FAR:
        tried = list(conventions_of_forces(few))
    else:
        before, tried = placed, _likely(list(conventions_of(unforced)))
    # To be fitted at all is worth much, where it is refused as it is.
    enough = MUCH * FAR if before is None else before / MUCH
    found = _fitted("other conventions", tried, progress)
    least, seen = min(((left, one.recording) for left, one in found), key=lambda pair: pair[0], default=(np.inf, few))
    # No physics leaves the tip elsewhere than at what it pushes: by what fits, or as it is.
    if not least < FAR and gap_of(seen if before is None and least < enough else unforced) > NEAR:
        pairs = _fitted("two at once", _likely(list(pairs_of(unforced))), progress, most=MOST_PAIRS)
        both = min((left for left, _ in pairs), default=np.inf)
        if both < min(least / MUCH, enough if before is None else enough / MUCH):
            found, least = pairs, both
    if not least < enough:
        return Finding(before=before, refused=refused)
    best = sorted((pair for pair in found if pair[0] <= ALIKE * least), key=lambda pair: pair[0])
    return Finding(before=before, refused=refused, after=least, better=_simplest([one for _, one in best]))


def _simplest(conventions: Sequence[Convention]) -> tuple[Convention, ...]:
    """Without those that are another one and something more."""
    said = [one.says for one in conventions]
    return tuple(one for one in conventions if not any(one.says.startswith(f"{other}, and ") for other in said))


def _fitted(
    stage: str, conventions: Sequence[Convention], progress: Progress | None, most: int | None = None
) -> list[tuple[float, Convention]]:
    """What the baseline leaves by each of the first conventions that are not refused."""
    found: list[tuple[float, Convention]] = []
    for convention in conventions:
        if len(found) == most:
            break
        if progress is not None:
            progress(stage, len(found), most or len(conventions))
        left, _ = _left(convention.recording)
        if left is not None:
            found.append((left, convention))
    return found


def _few(recording: Recording) -> Recording:
    """Some of the pushes, without those in which nothing moves."""
    ways = [float(np.hypot(*np.ptp(push.object.planar[:, :2], axis=0))) for push in recording.pushes]
    moving = [k for k, way in enumerate(ways) if way > 0.2 * float(np.median(ways))]
    chosen = np.unique(np.linspace(0, len(moving) - 1, min(PUSHES, len(moving))).round().astype(int))
    sensors = recording.sensors
    stated = max(sensors.hand_position_std or 0.0, HAND_NOISE)
    return replace(recording.subset([moving[k] for k in chosen]), sensors=replace(sensors, hand_position_std=stated))


def _likely(conventions: list[Convention]) -> list[Convention]:
    """Those by which the tip is about as near to what it pushes as by the best of them, the nearest first."""
    gaps = [(gap_of(convention.recording), convention) for convention in conventions]
    known = [gap for gap, _ in gaps if gap >= 0.0]
    if not known:
        return conventions
    near = [pair for pair in gaps if pair[0] < max(NEAR, MUCH * min(known))]
    return [convention for _, convention in sorted(near, key=lambda pair: pair[0])]


def _left(recording: Recording) -> tuple[float | None, str]:
    """What the baseline model leaves, in units of noise, fitted roughly; None and why, where it is refused."""
    try:
        case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=1)
        case = replace(case, noise=replace(case.noise, known=True))
        fitter = Fitter(case, Predictor(case))
        hypothesis = baseline_hypothesis(case)
        rng = np.random.default_rng(0)
        drawn = hypothesis.space.sample(rng, STARTS, from_prior=True)
        zs = [hypothesis.mean, *(np.clip(hypothesis.space.to_unit(theta), *hypothesis.bounds) for theta in drawn)]
        points = fitter.points([hypothesis] * len(zs), zs, [fitter.at_rest()] * len(zs))
        best = sorted((point for point in points if point is not None), key=fitter.roughly)[:2]
        if not best:
            return None, "no push can be simulated"
        fits = fitter.fitted(fitter.started([hypothesis] * len(best), best, [None] * len(best)), STEPS)
        return float(max(fits, key=lambda fit: fit.log_likelihood).noise_scale), ""
    except PhysidError as error:
        return None, str(error)
