"""The values of an answer, as ``diagnosis.json`` has them."""

from __future__ import annotations

import dataclasses as dc
from typing import Any


@dc.dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """One parameter of an effect.

    Attributes:
        value: the estimate; a number, or rows of numbers.
        unit: of the value; ``-`` for none.
        ci90: ends of the 90 % interval.
        null: the value at which the effect vanishes; None for a parameter that only shapes the effect.
    """

    value: Any
    unit: str
    ci90: Any
    null: Any


@dc.dataclass(frozen=True, kw_only=True)
class EffectFinding:
    """An effect that was found.

    Attributes:
        name: as in the catalogue.
        element: what it belongs to, as in the catalogue.
        indistinguishable_from: names of effects that explain these pushes as well.
        probability: that the name is right, if the effect is in the catalogue.
        parameters: estimates by the parameter's name.
        statement: the effect in words.
    """

    name: str
    element: str
    indistinguishable_from: tuple[str, ...]
    probability: float
    parameters: dict[str, ParameterEstimate]
    statement: str


@dc.dataclass(frozen=True, kw_only=True)
class Partly:
    """Effects that explain a good part of an unexplained mismatch, but not all of it.

    Attributes:
        effects: their names; held-out pushes confirm them.
        share: by which they reduce the mean squared error of held-out pushes in units of tracker noise [-].
        position: rms error of held-out pushes with them, in the plane [m].
        rotation: rms error of held-out pushes with them [rad].
    """

    effects: tuple[str, ...]
    share: float
    position: float
    rotation: float


@dc.dataclass(frozen=True, kw_only=True)
class Window:
    """A part of a push.

    Attributes:
        push: name of its file.
        start: [s].
        end: [s].
        place: of the object in W, x, y [m].
        heading: direction of its motion in W [rad].
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
    """Where simulation and recording differ.

    Attributes:
        statement: a sentence that a person can check.
        phase: some of ``contact``, ``free_slide``.
        dof: some of ``along_motion``, ``across_motion``, ``rotation``.
        frame: in which the missing force or torque is constant; ``none`` where there is no such frame.
        windows: with the largest missing wrench.
    """

    statement: str
    phase: tuple[str, ...]
    dof: tuple[str, ...]
    frame: str
    windows: tuple[Window, ...]


@dc.dataclass(frozen=True, kw_only=True)
class RegimeGain:
    """Gain of the model with effects over the baseline on pushes of one regime, both fitted to the other regime only.

    Attributes:
        fitted_on: the regime of the fit, in words.
        tested_on: the regime of the test, in words.
        gain: of log predictive density, summed over its pushes [log likelihood].
        standard_error: of the gain [log likelihood].
    """

    fitted_on: str
    tested_on: str
    gain: float
    standard_error: float


@dc.dataclass(frozen=True, kw_only=True)
class FitQuality:
    """Errors of held-out pushes, with the baseline model and with the model that was found.

    Attributes:
        rms_before: of x, y and yaw with the baseline, in units of tracker noise.
        rms_after: the same with the model that was found.
        position_before: rms distance of B in the plane with the baseline [m].
        position_after: the same with the model that was found.
        rotation_before: rms error of the yaw with the baseline [rad].
        rotation_after: the same with the model that was found.
        log_score_gain: of log predictive density, summed over pushes [log likelihood].
        log_score_gain_se: its standard error over pushes [log likelihood].
        per_push: of each, name, and rms before and after in units of tracker noise.
        regimes: gains where the models were fitted to another regime.
        force_before: rms error of the hand's force with the baseline [N]; None where none was compared.
        force_after: the same with the model that was found.
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
    """The estimate of one parameter of theta.

    Attributes:
        value: in the model that was found; near the prior's value where it is not identifiable.
        unit: of the value.
        ci90: 90 % interval; no wider than the prior's where it is not identifiable.
        identifiable: whether the pushes at least halve the prior's standard deviation.
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
        gain: of log likelihood in its score test, linearised.
        p_value: probability of such a gain on held-out pushes, the largest not counted, where no effect is there.
        held_out_gain: of log likelihood of held-out pushes over the baseline; linearised where the effect was not
            fitted. None where it would need the wrong sign.
        held_out_se: its standard error over pushes; None where the effect was not fitted.
        why: the reason for which it was found or rejected, in words.
    """

    name: str
    gain: float
    p_value: float
    held_out_gain: float | None
    held_out_se: float | None
    why: str


@dc.dataclass(frozen=True, kw_only=True)
class Detectable:
    """The smallest effect of a kind that would have been detected.

    Attributes:
        name: of the effect.
        parameter: the one that the value is of; the effect's other amplitudes are null.
        value: the smallest that would have been detected.
        unit: of the value.
        sigmas: rms motion of the object by such an effect, in units of tracker noise.
    """

    name: str
    parameter: str
    value: float
    unit: str
    sigmas: float


@dc.dataclass(frozen=True, kw_only=True)
class NextPush:
    """The push that would distinguish the rivals best.

    Attributes:
        direction_deg: of the hand's motion in W [deg].
        speed_mps: of the hand [m/s].
        contact_offset_m: of the hand's line from the centre of B, to the left [m].
        start_x_m: of the object in W [m].
        start_y_m: of the object in W [m].
        start_yaw_deg: of the object in W [deg].
        settles_with_probability: probability that its end shows which rival is right.
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
        """On which side of the object's centre the hand's line passes, in words."""
        offset = round(1e3 * self.contact_offset_m)
        if offset == 0:
            return "through the centre"
        return f"{abs(offset)} mm {'left' if offset > 0 else 'right'} of the centre"

    @property
    def start(self) -> str:
        """Where the object stands before the push, in words."""
        place = f"({1e3 * self.start_x_m:.0f}, {1e3 * self.start_y_m:.0f}) mm"
        return f"with the object at {place}, yaw {self.start_yaw_deg:.0f} deg"


@dc.dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The answer.

    Attributes:
        recording: its name.
        verdict: ``consistent``, ``explained``, ``ambiguous``, ``unexplained`` or ``underpowered``.
        sentence: the verdict in words.
        p_value: of the hypothesis that no physics is missing; 1 where held-out errors are no larger than the
            difference between two simulators.
        alpha: false-alarm rate that was asked for.
        effects: that were found; empty unless the verdict is ``explained`` or ``ambiguous``.
        location: where the mismatch is; None where there is none.
        fit: errors of held-out pushes.
        theta: estimates by the parameter's name.
        next_push: the push that would distinguish rivals best; None where there is none.
        seed: random seed.
        ranking: all effects of the catalogue, best first.
        detectable: the smallest effects that would have been detected.
        undetectable: names of effects that would not have been detected at any size within their bounds.
        left: what the model that was found leaves, in words.
        partly: effects that explain a part of an unexplained mismatch; None where there are none.
        reduced_chi2_before: of the baseline model.
        reduced_chi2_after: of the model that was found.
        friction_scatter: relative standard deviation of friction between pushes in the model that was found [-].
        noise: ``position_m``, ``rotation_rad``, ``correlation_time_s`` (of both) and ``jitter_s`` that were used;
            ``hand_m`` and ``force_n`` (of a component) where they were compared; ``hand_correlation_time_s`` where
            the hand's noise is correlated.
        warnings: about the recording, one line each.
        rollouts: number of rollouts, with those that an interrupted run had kept.
        pushes: number of pushes in the recording, of which not all may have been used.
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
        """What the model that was found adds to the baseline, in words; None where it is the baseline."""
        if self.effects:
            return "with the effects found"
        return None if self.fit.rms_after == self.fit.rms_before else "with an unnamed force"
