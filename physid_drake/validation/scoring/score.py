"""Scores of diagnoses against sealed truths, world by world. It reads JSON and knows no simulator."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from itertools import permutations
from pathlib import Path
from typing import Any

from physid_drake.validation.sealing.diagnosing import RESULT, Attempt, attempt_of, verdict_of
from physid_drake.validation.sealing.seal import REMEDY
from physid_drake.validation.sealing.written import AGAIN, broken, is_number, read_object
from physid_drake.wording import one_line

FOUND = ("explained", "ambiguous", "unexplained")
NAMED = ("explained", "ambiguous")
FAILED = "failed"
CLEAR = 5.0  # standard deviations of motion: an effect that must be found
MOST_NAMES = 2  # in a class that counts as the right answer
_KINDS = ("none", "effect", "pair", "other")
NOT_AS_WRITTEN = (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError)
"""What Python raises where JSON holds another value than it should."""
_NO_ERRORS = (math.nan, math.nan, math.nan)
_HALF_TURN = math.pi  # rad: a grain is the same from both sides
# Components of one vector: their errors are over its length, since one of them may be next to nothing.
_VECTORS = (("x", "y"), ("slope_x", "slope_y"))


@dc.dataclass(frozen=True, kw_only=True)
class HeldOut:
    """Root mean square errors of pushes that were held out: (before, after, floor) each; nan where unknown.

    Attributes:
        rms: in standard deviations of the tracker.
        position: in the plane [m].
        rotation: [rad].
    """

    rms: tuple[float, float, float] = _NO_ERRORS
    position: tuple[float, float, float] = _NO_ERRORS
    rotation: tuple[float, float, float] = _NO_ERRORS


@dc.dataclass(frozen=True, kw_only=True)
class Outcome:
    """One world and what was said of it.

    Attributes:
        id: of the world.
        kind: ``none``, ``effect``, ``pair`` or ``other``.
        true: names of its effects.
        size: how far they move the object, in standard deviations of the tracker.
        verdict: of the diagnosis, or ``failed``.
        classes: per finding, its name and those it cannot be told from.
        probabilities: stated for the first name of each finding.
        errors: relative error of each amplitude (a parameter with a null value) that was found.
        covered: whether each one's 90 % interval holds the truth.
        others_covered: the same of the parameters that say where, which way or how fast.
        theta_errors, theta_covered: the same of friction and mass, where these pushes tell them.
        chi2: cost per degree of freedom after; nan where the diagnosis failed.
        held_out: errors before and after, and those of the true world.
        seconds: that the diagnosis took on this machine; nan where unknown.
        error: one line on why a diagnosis failed.
    """

    id: str
    kind: str
    true: tuple[str, ...]
    size: float
    verdict: str
    classes: tuple[tuple[str, ...], ...] = ()
    probabilities: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()
    covered: tuple[bool, ...] = ()
    others_covered: tuple[bool, ...] = ()
    theta_errors: tuple[float, ...] = ()
    theta_covered: tuple[bool, ...] = ()
    chi2: float = math.nan
    held_out: HeldOut = HeldOut()
    seconds: float = math.nan
    error: str | None = None

    @property
    def failed(self) -> bool:
        """Whether there is no diagnosis."""
        return self.verdict == FAILED

    @property
    def found(self) -> bool:
        """Whether a mismatch was claimed."""
        return self.verdict in FOUND

    @property
    def right(self) -> bool:
        """Whether the name is right, or in a class of at most two, and no wrong one is beside it."""
        return not self.wrong_name and any(_names(names, name) for name in self.true for names in self.classes)

    @property
    def first(self) -> bool:
        """Whether the name given first is right."""
        return any(names[0] in self.true for names in self.classes)

    @property
    def in_class(self) -> bool:
        """Whether a true name is in a class, of whatever size."""
        return any(name in names for name in self.true for names in self.classes)

    @property
    def wrong_name(self) -> bool:
        """Whether a name was given that is not there, also not within the class."""
        return any(not set(names) & set(self.true) for names in self.classes)

    @property
    def named(self) -> int:
        """How many of the world's effects were named rightly, each by a finding of its own."""
        findings = [*self.classes, *((),) * len(self.true)]
        chosen = permutations(findings, len(self.true))
        return max(sum(map(_names, some, self.true)) for some in chosen)

    @property
    def both(self) -> bool:
        """Whether all effects of the world were named."""
        return self.named == len(self.true)

    @property
    def fault(self) -> str | None:
        """What is not right about the answer, None where nothing is."""
        if self.failed:
            return FAILED
        if self.kind == "none":
            return "false alarm" if self.found else None
        if self.kind == "other" and self.found:
            return "wrong name" if self.classes else None
        if self.wrong_name or not self.found:
            return "wrong name" if self.wrong_name else "missed"
        if self.kind == "pair":
            return None if self.both else "one of two" if self.named else "not named"
        return None if self.right else "a large class" if self.in_class else "not named"


def _names(names: Sequence[str], effect: str) -> bool:
    """Whether a finding names an effect: first, or in a class of at most two."""
    return effect in names[:1] or (effect in names and len(names) <= MOST_NAMES)


def outcome(truth: dict[str, Any], diagnosis: dict[str, Any], seconds: float = math.nan) -> Outcome:
    """Compare one diagnosis with its truth.

    Args:
        truth: what was sealed.
        diagnosis: what was said.
        seconds: that it took.
    """
    named = diagnosis["effects"] if diagnosis["verdict"] in NAMED else []
    compared = [pair for effect in named for pair in _parameters(truth["effects"], effect)]
    theta = _theta(truth.get("theta", {}), diagnosis.get("theta", {}))
    return Outcome(
        id=truth["id"],
        kind=truth["kind"],
        true=tuple(e["name"] for e in truth["effects"]),
        size=truth["size_sigma"],
        verdict=diagnosis["verdict"],
        classes=tuple((e["name"], *e["indistinguishable_from"]) for e in named),
        probabilities=tuple(e["probability"] for e in named),
        errors=tuple(error for error, _ in compared),
        covered=tuple(covered for _, covered in compared),
        others_covered=tuple(c for effect in named for c in _others_covered(truth["effects"], effect)),
        theta_errors=tuple(error for error, _ in theta),
        theta_covered=tuple(covered for _, covered in theta),
        chi2=number(diagnosis["reduced_chi2_after"]),
        held_out=_held_out(diagnosis["fit"], truth.get("held_out_floor", {})),
        seconds=seconds,
    )


def failed_outcome(truth: dict[str, Any], attempt: Attempt) -> Outcome:
    """A world whose diagnosis failed: nothing was found in it, and the score says so."""
    return Outcome(
        id=truth["id"],
        kind=truth["kind"],
        true=tuple(e["name"] for e in truth["effects"]),
        size=truth["size_sigma"],
        verdict=FAILED,
        seconds=attempt.seconds,
        error=attempt.error,
    )


def read_outcomes(sealed: Path, diagnoses: Path, identities: Sequence[str] | None = None) -> list[Outcome]:
    """All worlds with a truth, by name.

    Args:
        sealed: folder of the truths.
        diagnoses: folder with one folder for each world.
        identities: only these worlds; None: all. Those that have not been diagnosed yet are left out.

    Raises:
        ProofError: if a truth, or what was said of a world, is not as it was written.
    """
    outcomes = []
    names = [file.stem for file in sealed.glob("*.json")] if identities is None else list(identities)
    for name in sorted(names):
        attempt = attempt_of(diagnoses / name)
        if attempt is None:
            continue
        truth = _read_truth(sealed / f"{name}.json")
        if attempt.error is not None:
            outcomes.append(failed_outcome(truth, attempt))
            continue
        verdict_of(diagnoses / name)
        file = diagnoses / name / RESULT
        try:
            outcomes.append(checked(outcome(truth, read_object(file, AGAIN), attempt.seconds)))
        except NOT_AS_WRITTEN as error:
            raise broken(file, f"it is not as a diagnosis writes it ({described(error)})", AGAIN) from error
    return outcomes


def _read_truth(file: Path) -> dict[str, Any]:
    """What was put into a world.

    Raises:
        ProofError: if it cannot be read, or is not as the worlds' maker writes it.
    """
    truth = read_object(file, REMEDY)
    rules = {
        "'id' must be a text": isinstance(truth.get("id"), str),
        f"'kind' must be one of {', '.join(_KINDS)}": truth.get("kind") in _KINDS,
        "'size_sigma' must be a number": is_number(truth.get("size_sigma")),
        "'effects' must be a list of names with their parameters": _are_effects(truth.get("effects")),
        "'effects' must not be empty": bool(truth.get("effects")) or truth.get("kind") not in ("effect", "pair"),
        "'theta' must be numbers by name": _are_numbers(truth.get("theta", {})),
        "'held_out_floor' must be numbers by name": _are_numbers(truth.get("held_out_floor", {})),
    }
    for rule, holds in rules.items():
        if not holds:
            raise broken(file, rule, REMEDY)
    return truth


def _are_effects(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(one, dict) and isinstance(one.get("name"), str) and isinstance(one.get("parameters"), dict)
        for one in value
    )


def _are_numbers(value: object) -> bool:
    return isinstance(value, dict) and all(one is None or is_number(one) for one in value.values())


def checked(found: Outcome) -> Outcome:
    """An outcome whose names are words and whose figures are numbers; JSON may hold anything.

    Raises:
        TypeError: if they are not.
    """
    if not all(isinstance(name, str) for names in found.classes for name in names):
        raise TypeError("a name must be a text")
    figures = (*found.probabilities, *found.errors, *found.theta_errors)
    if not all(is_number(one) and abs(one) < math.inf for one in figures):
        raise TypeError("a probability or an error must be a finite number")
    return found


def described(error: Exception) -> str:
    """Why a value is not as it was written, in words."""
    return f"it has no {error}" if isinstance(error, KeyError) else one_line(error)


def _parameters(true: Sequence[dict[str, Any]], effect: dict[str, Any]) -> list[tuple[float, bool]]:
    """Relative error of each parameter that has a null value, and whether its interval holds the truth."""
    match = next((t["parameters"] for t in true if t["name"] == effect["name"]), None)
    compared = []
    for name, found in effect["parameters"].items() if match is not None else ():
        value, null = match.get(name) if match is not None else None, found["null"]
        if not isinstance(value, float) or not isinstance(found["value"], float) or null is None:
            continue  # shapes and grids are not compared by one number
        vector = next((names for names in _VECTORS if name in names), (name,))
        scale = math.hypot(*(_leaves(match, effect, part) for part in vector))
        if scale > 0.0:
            compared.append((abs(found["value"] - value) / scale, _holds(found["ci90"], value)))
    return compared


def _others_covered(true: Sequence[dict[str, Any]], effect: dict[str, Any]) -> list[bool]:
    """Whether the interval of each parameter without a null value holds the truth."""
    match: dict[str, Any] = next((t["parameters"] for t in true if t["name"] == effect["name"]), {})
    covered = []
    for name, found in effect["parameters"].items():
        value, ends = match.get(name), found["ci90"]
        if isinstance(value, float) and isinstance(found["value"], float) and found["null"] is None and ends:
            turns = (-_HALF_TURN, 0.0, _HALF_TURN) if name == "angle" else (0.0,)
            covered.append(any(_holds(ends, value + turn) for turn in turns))
    return covered


def _theta(true: dict[str, float], found: dict[str, Any]) -> list[tuple[float, bool]]:
    """Relative error of each parameter of theta that is identifiable, and whether its interval holds the truth."""
    return [
        (abs(one["value"] / true[name] - 1.0), _holds(one["ci90"], true[name]))
        for name, one in found.items()
        if one["value"] is not None and one.get("identifiable", True) and true.get(name)
    ]


def _holds(ends: Sequence[float | None], value: float) -> bool:
    """Whether an interval holds a value; an end that JSON has no number for is infinite."""
    low, high = (number(end) for end in ends)
    return not (value < low or value > high)


def _leaves(true: dict[str, Any] | None, effect: dict[str, Any], name: str) -> float:
    """How far a parameter's true value is from its null."""
    null = effect["parameters"].get(name, {}).get("null")
    value = true.get(name) if true is not None else None
    return value - null if isinstance(value, float) and null is not None else 0.0


def _held_out(fit: dict[str, Any], floor: dict[str, float]) -> HeldOut:
    def three(what: str, unit: str) -> tuple[float, float, float]:
        before, after = (number(fit.get(f"held_out_rms_{when}{unit}")) for when in ("before", "after"))
        return before, after, number(floor.get(what))

    return HeldOut(rms=three("rms", ""), position=three("position_m", "_m"), rotation=three("rotation_rad", "_rad"))


def number(value: float | None) -> float:
    """A number of a JSON file; null is NaN."""
    return math.nan if value is None else float(value)
