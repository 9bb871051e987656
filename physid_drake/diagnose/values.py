"""What a diagnosis says."""

from __future__ import annotations

import dataclasses as dc
from typing import Any


@dc.dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """One parameter of an effect: value, unit, 90 % interval, null value (None for what only shapes the effect)."""

    value: Any
    unit: str
    ci90: Any
    null: Any


@dc.dataclass(frozen=True, kw_only=True)
class EffectFinding:
    """An effect that was found.

    Attributes:
        name, element: as in the catalogue.
        indistinguishable_from: names of effects that explain these pushes as well.
        probability: that the name is right, among those of the catalogue.
        parameters: by name.
        statement: one sentence.
    """

    name: str
    element: str
    indistinguishable_from: tuple[str, ...]
    probability: float
    parameters: dict[str, ParameterEstimate]
    statement: str


@dc.dataclass(frozen=True, kw_only=True)
class Partly:
    """What takes a good part of an unexplained mismatch away, and leaves more than it may.

    Attributes:
        effects: names; confirmed by pushes that were held out.
        share: of the mean square error of held-out pushes that they take away, in standard deviations.
        position, rotation: root mean square errors of held-out pushes with them [m, rad].
    """

    effects: tuple[str, ...]
    share: float
    position: float
    rotation: float


@dc.dataclass(frozen=True, kw_only=True)
class Window:
    """A part of a push.

    Attributes:
        push: file.
        start, end: [s].
        place: of the object, x, y [m].
        heading: of its motion in W [rad].
        speed: of the object [m/s].
        phase: ``contact`` or ``free_slide``.
    """

    push: str
    start: float
    end: float
    place: tuple[float, float]
    heading: float
    speed: float
    phase: str


@dc.dataclass(frozen=True, kw_only=True)
class Location:
    """Where simulation and recording part.

    Attributes:
        statement: a sentence that a person can check.
        phase: of ``contact``, ``free_slide``.
        dof: of ``along_motion``, ``across_motion``, ``rotation``.
        frame: in which what is missing is constant.
        windows: where it is largest.
    """

    statement: str
    phase: tuple[str, ...]
    dof: tuple[str, ...]
    frame: str
    windows: tuple[Window, ...]


@dc.dataclass(frozen=True, kw_only=True)
class RegimeGain:
    """Gain in log predictive density of pushes of one regime when both models are fitted to the other one only."""

    fitted_on: str
    tested_on: str
    gain: float
    standard_error: float


@dc.dataclass(frozen=True, kw_only=True)
class FitQuality:
    """How well pushes are predicted that were held out of the fit, by the baseline model and with what was found.

    Attributes:
        rms_before, rms_after: root mean square errors, in standard deviations of the measurement.
        position_before, position_after: of the place of B [m].
        rotation_before, rotation_after: of its yaw [rad].
        log_score_gain: gain in log predictive density over all pushes [log likelihood], and its standard error over
            pushes.
        log_score_gain_se: that standard error [log likelihood].
        per_push: name, error before and after in standard deviations, of each.
        regimes: gains where fit and test are of different kinds of pushes.
        force_before, force_after: of the hand's force [N]; None where none was compared.
    """

    rms_before: float
    rms_after: float
    position_before: float
    position_after: float
    rotation_before: float
    rotation_after: float
    log_score_gain: float
    log_score_gain_se: float
    per_push: tuple[tuple[str, float, float], ...]
    regimes: tuple[RegimeGain, ...] = ()
    force_before: float | None = None
    force_after: float | None = None


@dc.dataclass(frozen=True, kw_only=True)
class ThetaEstimate:
    """One parameter of theta.

    Attributes:
        value: with what was found in the model; where it is not identifiable, about what was known beforehand.
        unit: of the value.
        ci90: 90 % interval; where it is not identifiable, no wider than the prior's.
        identifiable: whether these pushes at least halve what was not known of it.
        before: the baseline model's estimate.
    """

    value: float
    unit: str
    ci90: tuple[float, float]
    identifiable: bool
    before: float


@dc.dataclass(frozen=True, kw_only=True)
class Ranked:
    """One effect in the ranking.

    Attributes:
        name: as in the catalogue.
        gain: in log-likelihood, linearised: of its score test.
        p_value: that such an effect gains as much on held-out pushes by chance.
        held_out_gain: of the effect, in log-likelihood of held-out pushes, over the model without it; linearised
            where it was not fitted. None where it would have to act the other way round.
        held_out_se: its standard error over pushes; None where it was not fitted.
        why: it was found, or lost.
    """

    name: str
    gain: float
    p_value: float
    held_out_gain: float | None
    held_out_se: float | None
    why: str


@dc.dataclass(frozen=True, kw_only=True)
class Detectable:
    """The smallest effect that these pushes would have shown.

    Attributes:
        name, parameter: of the effect.
        value: the smallest that would have been seen; of several parameters, the one named, the others at rest.
        unit: of the value.
        sigmas: how far such an effect moves the object, in standard deviations of the tracker.
    """

    name: str
    parameter: str
    value: float
    unit: str
    sigmas: float


@dc.dataclass(frozen=True, kw_only=True)
class NextPush:
    """The push that would tell the rivals apart.

    Attributes:
        direction_deg: of the hand's way in W.
        speed_mps: of the hand.
        contact_offset_m: of the hand's line from the centre of B, to its left.
        start_x_m, start_y_m, start_yaw_deg: of the object in W before it; elsewhere it may tell something else.
        settles_with_probability: that it tells which rival is right.
    """

    direction_deg: float
    speed_mps: float
    contact_offset_m: float
    start_x_m: float
    start_y_m: float
    start_yaw_deg: float
    settles_with_probability: float

    @property
    def aim(self) -> str:
        """Where the hand's line passes the object, in words."""
        offset = round(1e3 * self.contact_offset_m)
        if offset == 0:
            return "through the centre"
        return f"{abs(offset)} mm {'left' if offset > 0 else 'right'} of the centre"

    @property
    def start(self) -> str:
        """Where the object stands before it, in words."""
        place = f"({1e3 * self.start_x_m:.0f}, {1e3 * self.start_y_m:.0f}) mm"
        return f"with the object at {place}, yaw {self.start_yaw_deg:.0f} deg"


@dc.dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The answer.

    Attributes:
        recording: its name.
        verdict: ``consistent``, ``explained``, ``ambiguous``, ``unexplained`` or ``underpowered``.
        sentence: the verdict for a person.
        p_value: of the baseline model: that noise and scatter alone would leave as much; 1 where there is hardly any
            noise, and no more is left than the cell's own error.
        alpha: false-alarm rate that was asked for.
        effects: that were found, in the order in which they were; empty unless explained or ambiguous.
        location: of the mismatch; None where there is none.
        fit: of pushes that were held out.
        theta: by parameter.
        next_push: None where none would help, or nothing pushes.
        seed: of all that is drawn.
        ranking: the catalogue, best first.
        detectable: the smallest effects that would have been seen.
        undetectable: names of effects of which not even the strongest would have been seen.
        left: what remains, in words.
        partly: what takes a part of an unexplained mismatch away.
        reduced_chi2_before, reduced_chi2_after: cost per degree of freedom, plain and with what was found.
        friction_scatter: of the last model's friction, push to push, relative.
        noise: ``position_m``, ``rotation_rad``, ``correlation_time_s`` (of both), ``jitter_s`` that were used, and
            ``hand_m`` and ``force_n`` (of a component) where hand and force were, ``hand_correlation_time_s`` where
            the hand's noise is slow.
        warnings: what was found odd, one line each.
        rollouts: how many were asked for, those of an interrupted run that were kept included.
        pushes: of the whole recording, looked at or not.
    """

    recording: str
    verdict: str
    sentence: str
    p_value: float
    alpha: float
    effects: tuple[EffectFinding, ...]
    location: Location | None
    fit: FitQuality
    theta: dict[str, ThetaEstimate]
    next_push: NextPush | None
    seed: int
    ranking: tuple[Ranked, ...]
    detectable: tuple[Detectable, ...]
    left: str
    partly: Partly | None
    reduced_chi2_before: float
    reduced_chi2_after: float
    friction_scatter: float
    noise: dict[str, Any]
    warnings: tuple[str, ...]
    rollouts: int
    pushes: int = 0
    undetectable: tuple[str, ...] = ()

    @property
    def with_it(self) -> str | None:
        """In words, what the model that leaves has beside the baseline model; None where nothing."""
        if self.effects:
            return "with the effects found"
        return None if self.fit.rms_after == self.fit.rms_before else "with an unnamed force"
