"""``proof.json`` and ``proof.md`` of a proof, and what it prints: it reads figures, it never computes them."""

from __future__ import annotations

import dataclasses as dc
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.table import Table

from physid_drake.report.terminal import narrow_table, words
from physid_drake.validation.scoring.figures import Figures, json_of
from physid_drake.validation.scoring.score import HeldOut, Outcome, number
from physid_drake.validation.scoring.tables import decimals, held_out_table, power_table, table

FORMAT = "physid-proof/1"
MAIN = ("", "result", "95 % interval", "target")
POWER = ("size [sigma]", "found", "95 % interval", "named correctly", "95 % interval")
HELD_OUT = ("median of worlds with", "worlds", "baseline mm", "diagnosed mm", "true mm", "baseline deg",
            "diagnosed deg", "true deg", "baseline sigma", "diagnosed sigma", "true sigma")  # fmt: skip
AT_BEST = (
    "Baseline: identified without effects. Diagnosed: with the effects found. True: the true model with all its"
    " physics, but without the friction of the held-out push. Sigma: in units of tracker noise (one standard"
    " deviation)."
)


@dc.dataclass(frozen=True, kw_only=True)
class Proof:
    """A proof that was opened.

    Attributes:
        seed: of the worlds.
        kind: of them, None for the mix.
        seal: SHA-256 that was written down before the diagnosis.
        sealed: how many worlds were sealed.
        outcomes: of those that were diagnosed, by name.
        figures: of them.
        versions: of the packages that made it.
        hidden_by: what hid the truth from the diagnoses, and from how many.
    """

    seed: int
    kind: str | None
    seal: str
    sealed: int
    outcomes: tuple[Outcome, ...]
    figures: Figures
    versions: dict[str, str]
    hidden_by: Mapping[str, int] = dc.field(default_factory=dict)

    @property
    def faults(self) -> tuple[Outcome, ...]:
        """Worlds of which the answer is not right, the largest effects first."""
        return tuple(sorted((o for o in self.outcomes if o.fault is not None), key=lambda o: (-o.size, o.id)))


def said_of(outcome: Outcome) -> str:
    """Verdict and names in words."""
    names = " + ".join(" or ".join(group) for group in outcome.classes)
    return outcome.verdict + (f": {names}" if names else "") + (f" ({outcome.error})" if outcome.error else "")


def truth_of(outcome: Outcome) -> str:
    """The world's effects in words."""
    return " + ".join(outcome.true) or "no effect"


def proof_json(proof: Proof) -> str:
    """The file's text; all but ``seconds`` is the same for the same worlds, diagnoses and versions."""
    figures = json_of(proof.figures)
    seconds: dict[str, Any] = figures.pop("seconds")
    seconds["worlds"] = {o.id: o.seconds for o in proof.outcomes if math.isfinite(o.seconds)}
    content = {
        "format": FORMAT,
        "seed": proof.seed,
        "kind": proof.kind,
        "seal_sha256": proof.seal,
        "sealed": proof.sealed,
        "hidden_by": dict(proof.hidden_by),
        "versions": proof.versions,
        "figures": figures,
        "faults": [
            {"id": o.id, "fault": o.fault, "true": list(o.true), "size_sigma": _digits(o.size), "said": said_of(o)}
            for o in proof.faults
        ],
        "outcomes": [_outcome(o) for o in proof.outcomes],
        "seconds": seconds,
    }
    return json.dumps(content, indent=2) + "\n"


def _outcome(outcome: Outcome) -> dict[str, Any]:
    return {
        "id": outcome.id,
        "kind": outcome.kind,
        "true": list(outcome.true),
        "size_sigma": _digits(outcome.size),
        "verdict": outcome.verdict,
        "classes": [list(names) for names in outcome.classes],
        "probabilities": [_digits(p) for p in outcome.probabilities],
        "parameter_errors": [_digits(e) for e in outcome.errors],
        "covered_90": list(outcome.covered),
        "others_covered_90": list(outcome.others_covered),
        "theta_errors": [_digits(e) for e in outcome.theta_errors],
        "theta_covered_90": list(outcome.theta_covered),
        "reduced_chi2_after": _digits(outcome.chi2),
        "held_out_rms": [_digits(v) for v in outcome.held_out.rms],
        "held_out_position_m": [_digits(v) for v in outcome.held_out.position],
        "held_out_rotation_rad": [_digits(v) for v in outcome.held_out.rotation],
        "error": outcome.error,
    }


def outcomes_in(content: dict[str, Any]) -> tuple[Outcome, ...]:
    """The outcomes of a ``proof.json``; those of older ones have no intervals of places and of theta."""
    times = content["seconds"].get("worlds", {})
    return tuple(
        Outcome(
            id=one["id"],
            kind=one["kind"],
            true=tuple(one["true"]),
            size=one["size_sigma"],
            verdict=one["verdict"],
            classes=tuple(tuple(names) for names in one["classes"]),
            probabilities=tuple(one["probabilities"]),
            errors=tuple(one["parameter_errors"]),
            covered=tuple(one["covered_90"]),
            others_covered=tuple(one.get("others_covered_90", ())),
            theta_errors=tuple(one.get("theta_errors", ())),
            theta_covered=tuple(one.get("theta_covered_90", ())),
            chi2=number(one["reduced_chi2_after"]),
            held_out=HeldOut(
                rms=_three(one["held_out_rms"]),
                position=_three(one.get("held_out_position_m")),
                rotation=_three(one.get("held_out_rotation_rad")),
            ),
            seconds=number(times.get(one["id"])),
            error=one["error"],
        )
        for one in content["outcomes"]
    )


def _three(values: Sequence[float | None] | None) -> tuple[float, float, float]:
    before, after, floor = map(number, values or (None,) * 3)
    return before, after, floor


def _digits(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


def proof_markdown(proof: Proof) -> str:
    """The tables for a reader of plain text."""
    figures = proof.figures
    parts = [
        "# Proof on sealed worlds",
        f"{_worlds(proof)}, seed {proof.seed}. Seal, written down before the diagnosis: `sha256 {proof.seal}`.",
        *_hidden(proof),
        f"{', '.join(f'{name} {version}' for name, version in proof.versions.items())}.",
        _markdown(MAIN, table(figures)),
        "## Power against the size of the effect",
        _markdown(POWER, power_table(figures)),
        "## Prediction error of held-out pushes (root mean square)",
        _markdown(HELD_OUT, held_out_table(figures)),
        AT_BEST,
        "## Stated probabilities",
        _markdown(
            ("stated", "mean", "correct"),
            [
                (f"{b.low:g} to {b.high:g}", decimals(b.stated), f"{b.right.count} of {b.right.of}")
                for b in figures.reliability
            ],
        ),
        f"## Wrong answers ({len(proof.faults)})",
        _markdown(
            ("world", "error", "truth", "size [sigma]", "diagnosis"),
            [(o.id, o.fault or "", truth_of(o), f"{o.size:.1f}", said_of(o)) for o in proof.faults],
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _hidden(proof: Proof) -> list[str]:
    """What hid the truth from the diagnoses; nothing of a proof that does not say so."""
    worlds = sum(proof.hidden_by.values())
    parts = [f"{what}, {count} of {worlds}" for what, count in proof.hidden_by.items()]
    return [f"The truth was hidden from the diagnoses by: {'; '.join(parts)}."] if parts else []


def _worlds(proof: Proof) -> str:
    kinds = proof.figures.worlds
    some = f" of {proof.sealed} that were sealed" if len(proof.outcomes) < proof.sealed else ""
    return (
        f"{len(proof.outcomes)} worlds{some}: {kinds['none']} without an effect, {kinds['effect']} with one of the"
        f" catalogue, {kinds['pair']} with two, {kinds['other']} with one that is not in the catalogue"
    )


def _markdown(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join("| " + " | ".join(cell.strip().replace("|", "\\|") for cell in line) + " |" for line in lines)


def proof_tables(proof: Proof) -> tuple[Table, Table]:
    """What the command prints: the figures, and power against size."""
    main = narrow_table(_worlds(proof), *map(words, MAIN))
    for row in table(proof.figures):
        main.add_row(*row)
    power = narrow_table("single effects by size", *map(words, POWER))
    for row_of_power in power_table(proof.figures):
        power.add_row(*row_of_power)
    return main, power
