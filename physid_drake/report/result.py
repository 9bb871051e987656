"""``result.json``: the model that leaves, and how it was identified, with fixed keys so that others can read it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from physid_drake.diagnose import Examined
from physid_drake.identify import Accuracy, Estimate, IdentifiableCells, Identification
from physid_drake.identify.accuracy import accuracy_of
from physid_drake.identify.estimates import estimates_of
from physid_drake.identify.identify import unknowns_of
from physid_drake.pushes.case import UNIT_SCATTER
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import Recording
from physid_drake.report.inspection import warning_lines
from physid_drake.report.numbers import rounded
from physid_drake.search import SearchResult

FORMAT = "physid-result/1"


def result_json(examined: Examined, recording: Recording, seed: int, versions: dict[str, str]) -> str:
    """The result as JSON text; the same recording, configuration and seed give the same bytes.

    Theta is that of the final model, with the effects found if there are any; then ``baseline`` is there, too, with
    what the baseline model had.

    Args:
        examined: what was identified, and diagnosed if it was.
        recording: what it was made from.
        seed: of the run.
        versions: of the packages.
    """
    known, evidence, search = examined.known, examined.evidence, examined.known.search
    fitter, fit = (known.fitter, known.fit) if evidence is None else (evidence.fitter, evidence.corrected)
    changed = fit is not known.fit
    after = known.after if evidence is None else accuracy_of(known.case, evidence.errors_after)
    pushes = list(known.pushes)
    content: dict[str, Any] = {
        "format": FORMAT,
        "recording": recording.name,
        "model": {
            "verdict": None if examined.diagnosis is None else examined.diagnosis.verdict,
            "effects": [part.kind.name for part in fit.hypothesis.parts],
        },
        "theta": _theta(estimates_of(fitter, fit)),
        **({"baseline": _baseline(known)} if changed else {}),
        **({} if known.cells is None else {"cells": _cells(known.cells)}),
        "held_out": {"pushes": pushes, "initial_guess": _numbers(known.before), "identified": _numbers(after)},
        "training": {"pushes": pushes},
        **({} if known.foreseen is None else {"next_push_prediction": _numbers(known.foreseen)}),
        "reduced_chi2": fit.reduced_chi2,
        "friction_scatter": UNIT_SCATTER * fit.scatter,
        "per_push_parameters": unknowns_of(known.case, fit),
        "noise": known.noise,
        "search": None if search is None else _search(search, known),
        "rollouts": known.rollouts if examined.diagnosis is None else examined.diagnosis.rollouts,
        "warnings": [*doubts(recording), *warning_lines(recording)],
        "pushes": len(recording.pushes),
        "seed": seed,
        "versions": versions,
    }
    return json.dumps(rounded(content), indent=2, allow_nan=False) + "\n"


def _theta(estimates: Sequence[Estimate]) -> dict[str, Any]:
    return {
        e.name: {
            "value": e.value, "unit": e.unit, "ci90": list(e.ci90), "identifiable": e.identifiable, "prior": e.prior,
            "at_bound": e.at_bound,
        }
        for e in estimates
    }  # fmt: skip


def _baseline(known: Identification) -> dict[str, Any]:
    """What the baseline model had, where effects were found beside it."""
    return {
        "theta": _theta(known.estimates), "held_out": _numbers(known.after), "reduced_chi2": known.reduced_chi2,
        "friction_scatter": known.friction_scatter,
    }  # fmt: skip


def _search(search: SearchResult, known: Identification) -> dict[str, Any]:
    best = int(np.argmax(search.belief.p_min))
    return {
        "stop_reason": search.stop_reason,
        "trials": search.belief.n_trials,
        "failed": search.n_failed,
        "entropies_nats": search.entropies.tolist(),
        "most_likely": known.case.thetas.space.as_dict(search.belief.most_likely),
        "p_min": float(search.belief.p_min[best]),
    }


def _cells(cells: IdentifiableCells) -> dict[str, Any]:
    return {
        "grid": list(cells.grid),
        "names": list(cells.names),
        "friction": cells.friction.tolist(),
        "posterior_over_prior_std": cells.left.tolist(),
        "combinations_identifiable": cells.identifiable,
        "combinations": [
            {
                "weights": c.weights.tolist(),
                "singular_value": c.strength,
                "posterior_over_prior_std": c.left,
                "identifiable": c.identifiable,
            }
            for c in cells.combinations
        ],
        "neighbours_distinguishable": [list(pair) for pair in cells.apart],
        "neighbours_indistinguishable": [list(pair) for pair in cells.not_apart],
    }


def _numbers(accuracy: Accuracy | None) -> dict[str, float] | None:
    """An accuracy with units in its keys."""
    if accuracy is None:
        return None
    return {
        "position_rms_m": accuracy.position,
        "rotation_rms_rad": accuracy.rotation,
        "end_position_rms_m": accuracy.end_position,
        "end_rotation_rms_rad": accuracy.end_rotation,
        "force_rms_n": accuracy.force,
        "rms_sigma": accuracy.rms,
        "diverged": accuracy.diverged,
    }
