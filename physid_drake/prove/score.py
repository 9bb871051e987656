"""Scores of diagnoses against sealed truths. It reads two kinds of JSON and knows no simulator."""

from __future__ import annotations

import dataclasses as dc
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

FOUND = ("explained", "ambiguous", "unexplained")
NAMED = ("explained", "ambiguous")
CLEAR = 5.0  # standard deviations of motion: an effect that must be found
MOST_NAMES = 2  # in a class that counts as the right answer


@dc.dataclass(frozen=True, kw_only=True)
class Outcome:
    """One world and what was said of it.

    Attributes:
        id: of the world.
        kind: ``none``, ``effect``, ``pair`` or ``other``.
        true: names of its effects.
        size: how far they move the object, in standard deviations of the tracker.
        verdict: of the diagnosis.
        classes: per finding, its name and those it cannot be told from.
        probability: stated for the first name.
        errors: relative error of each parameter that was found.
        covered: whether each 90 % interval holds the truth.
        chi2: cost per degree of freedom after.
        rms: held-out error before and after, in standard deviations.
    """

    id: str
    kind: str
    true: tuple[str, ...]
    size: float
    verdict: str
    classes: tuple[tuple[str, ...], ...]
    probability: float
    errors: tuple[float, ...]
    covered: tuple[bool, ...]
    chi2: float
    rms: tuple[float, float]

    @property
    def found(self) -> bool:
        """Whether a mismatch was claimed."""
        return self.verdict in FOUND

    @property
    def right(self) -> bool:
        """Whether the name is right, or in a class of at most two."""
        return any(
            name in names[:1] or (name in names and len(names) <= MOST_NAMES)
            for name in self.true
            for names in self.classes
        )

    @property
    def wrong_name(self) -> bool:
        """Whether a name was given that is not there, also not within the class."""
        return any(not set(names) & set(self.true) for names in self.classes)

    @property
    def both(self) -> bool:
        """Whether all effects of the world were named."""
        return all(any(name in names for names in self.classes) for name in self.true)


def outcome(truth: dict[str, Any], diagnosis: dict[str, Any]) -> Outcome:
    """Compare one diagnosis with its truth."""
    named = diagnosis["effects"] if diagnosis["verdict"] in NAMED else []
    errors, covered = _parameters(truth["effects"], named)
    return Outcome(
        id=truth["id"],
        kind=truth["kind"],
        true=tuple(e["name"] for e in truth["effects"]),
        size=truth["size_sigma"],
        verdict=diagnosis["verdict"],
        classes=tuple((e["name"], *e["indistinguishable_from"]) for e in named),
        probability=named[0]["probability"] if named else math.nan,
        errors=errors,
        covered=covered,
        chi2=diagnosis["reduced_chi2_after"],
        rms=(diagnosis["fit"]["held_out_rms_before"], diagnosis["fit"]["held_out_rms_after"]),
    )


def _parameters(true: Sequence[dict[str, Any]], named: Sequence[dict[str, Any]]) -> tuple[Any, Any]:
    errors, covered = [], []
    for effect in named:
        match = next((t for t in true if t["name"] == effect["name"]), None)
        for name, found in effect["parameters"].items() if match is not None else ():
            value = match["parameters"].get(name) if match is not None else None
            null = found["null"]
            if not isinstance(value, float) or not isinstance(found["value"], float) or null is None:
                continue  # shapes and grids are not compared by one number
            scale = abs(value - null)
            if scale > 0.0:
                errors.append(abs(found["value"] - value) / scale)
                covered.append(bool(found["ci90"][0] <= value <= found["ci90"][1]))
    return tuple(errors), tuple(covered)


def read_outcomes(sealed: Path, diagnoses: Path) -> list[Outcome]:
    """All worlds that have a truth and a diagnosis."""
    outcomes = []
    for file in sorted(sealed.glob("*.json")):
        found = diagnoses / file.stem / "diagnosis.json"
        if found.exists():
            outcomes.append(outcome(json.loads(file.read_text()), json.loads(found.read_text())))
    return outcomes


def table(outcomes: Sequence[Outcome]) -> list[tuple[str, str, str]]:
    """Rows: what, the figure with its counts, what was asked for."""
    kinds = {k: [o for o in outcomes if o.kind == k] for k in ("none", "effect", "pair", "other")}
    clear = [o for o in kinds["effect"] if o.size >= CLEAR]
    faint = [o for o in kinds["effect"] if o.size < CLEAR]
    errors = sorted(e for o in clear for e in o.errors)
    covered = [c for o in kinds["effect"] for c in o.covered]
    return [
        ("no effect: called a mismatch", _share([o.found for o in kinds["none"]]), "at most 1 %"),
        (f"effect of {CLEAR:g} sigma or more: found", _share([o.found for o in clear]), "95 %"),
        ("  named rightly, or in a class of two", _share([o.right for o in clear]), "90 %"),
        ("  a wrong name", _share([o.wrong_name for o in clear]), ""),
        ("  error of its parameters, median", f"{100 * errors[len(errors) // 2]:.1f} %" if errors else "-", "10 %"),
        ("90 % intervals that hold the truth", _share(covered), "85 to 95 %"),
        (f"effect below {CLEAR:g} sigma: found", _share([o.found for o in faint]), ""),
        ("  named rightly, or in a class of two", _share([o.right for o in faint]), ""),
        ("not in the catalogue: unexplained", _share([o.verdict == "unexplained" for o in kinds["other"]]), "90 %"),
        ("  a wrong name", _share([o.verdict in NAMED for o in kinds["other"]]), "at most 3 %"),
        ("two effects: both named", _share([o.both for o in kinds["pair"]]), "70 %"),
    ]


def _share(flags: Sequence[bool]) -> str:
    return f"{sum(flags)} of {len(flags)}" + (f" ({100 * sum(flags) / len(flags):.0f} %)" if flags else "")
