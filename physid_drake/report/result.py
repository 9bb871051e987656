"""``result.json``: the identification with fixed keys, so that others can read it."""

from __future__ import annotations

import dataclasses
import json
import math
from typing import Any

import numpy as np

from physid_drake.identify import Accuracy, CellsTold, Identification
from physid_drake.pushes.doubts import doubts
from physid_drake.recording import Recording
from physid_drake.report.inspection import warning_lines

FORMAT = "physid-result/1"


def result_json(result: Identification, recording: Recording, seed: int, versions: dict[str, str]) -> str:
    """The result as JSON text; the same recording, configuration and seed give the same bytes.

    Args:
        result: the identification.
        recording: what it was made from.
        seed: of the run.
        versions: of the packages.
    """
    best = int(np.argmax(result.search.belief.p_min))
    content: dict[str, Any] = {
        "format": FORMAT,
        "recording": recording.name,
        "theta": {
            e.name: {
                "value": e.value,
                "unit": e.unit,
                "ci90": list(e.ci90),
                "identifiable": e.identifiable,
                "prior": e.prior,
                "at_bound": e.at_bound,
            }
            for e in result.estimates
        },
        **({} if result.cells is None else {"cells": _cells(result.cells)}),
        "held_out": {
            "pushes": list(result.held_out),
            "before": _numbers(result.before),
            "after": _numbers(result.after),
        },
        "training": {"pushes": list(result.training), "after": _numbers(result.fitted)},
        **({} if result.foreseen is None else {"foreseen": _numbers(result.foreseen)}),
        "reduced_chi2": result.reduced_chi2,
        "friction_scatter": result.polished.friction_scatter,
        "push_unknowns": dict(zip(result.training, result.polished.unknowns, strict=True)),
        "noise": dataclasses.asdict(result.noise),
        "search": {
            "stop_reason": result.search.stop_reason,
            "trials": result.search.belief.n_trials,
            "failed": result.search.n_failed,
            "entropies_nats": result.search.entropies.tolist(),
            "most_likely": result.thetas.space.as_dict(result.search.belief.most_likely),
            "p_min": float(result.search.belief.p_min[best]),
        },
        "rollouts": result.polished.rollouts,
        "warnings": [*doubts(recording), *warning_lines(recording)],
        "seed": seed,
        "versions": versions,
    }
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def _cells(cells: CellsTold) -> dict[str, Any]:
    return {
        "grid": list(cells.grid),
        "names": list(cells.names),
        "friction": cells.friction.tolist(),
        "prior_std_left": cells.left.tolist(),
        "combinations_told": cells.told,
        "combinations": [
            {"weights": c.weights.tolist(), "singular_value": c.strength, "prior_std_left": c.left, "told": c.told}
            for c in cells.combinations
        ],
        "neighbours_told_apart": [list(pair) for pair in cells.apart],
        "neighbours_not_told_apart": [list(pair) for pair in cells.not_apart],
    }


def _numbers(accuracy: Accuracy | None) -> dict[str, float | int | None] | None:
    """An accuracy with units in its keys."""
    if accuracy is None:
        return None
    numbers = {
        "position_rms_m": accuracy.position,
        "rotation_rms_rad": accuracy.rotation,
        "end_position_rms_m": accuracy.end_position,
        "end_rotation_rms_rad": accuracy.end_rotation,
        "force_rms_n": accuracy.force,
        "sigmas_rms": accuracy.sigmas,
        "diverged": accuracy.diverged,
    }
    # JSON has no infinity, which stands where every rollout diverged.
    return {key: value if value is None or math.isfinite(value) else None for key, value in numbers.items()}
