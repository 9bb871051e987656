"""A plan as ``plan.json`` and as a table in the terminal."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
from rich.table import Table

from physid_drake.plan import (
    DistanceToGoal,
    Ending,
    Hindsight,
    InsideRegion,
    Outcome,
    Plan,
    Spread,
    SweepRow,
    Trajectory,
    WithinDisc,
    caveats_of,
)
from physid_drake.plan.trajectory import tip_height_of
from physid_drake.report.terminal import narrow_table, words

FORMAT = "physid-plan/1"


def push_files(plan: Plan) -> list[str]:
    """Names of the files that hold the hand's paths."""
    count = len(plan.predicted.paths)
    return ["push.csv"] if count == 1 else [f"push_{k + 1}.csv" for k in range(count)]


def plan_json(
    plan: Plan, *, seed: int, with_effects: Outcome | None = None, hindsight: Hindsight | None = None
) -> str:
    """The plan as JSON text; the same model, task and seed give the same bytes.

    Args:
        plan: the plan.
        seed: of the run.
        with_effects: trajectory and cost of the same push under the model with its effects, where it was planned
            without them.
        hindsight: the plan that was made before a diagnosis, and what that leaves open.
    """
    pushes = plan.policy.pushes(plan.settings)
    content: dict[str, Any] = {
        "format": FORMAT,
        "recording": plan.model.recording,
        "effects": [e.name for e in plan.model.effects],
        "policy": plan.policy.name,
        "goal_m": list(plan.cost_function.goal) if isinstance(plan.cost_function, DistanceToGoal) else None,
        "goal_within": _disc(plan.cost_function) if isinstance(plan.cost_function, WithinDisc) else None,
        "tolerance_m": plan.tolerance,
        "start": _pose(plan.situation.start),
        "settings": _settings(plan),
        "pushes": [
            {"file": file, "direction_rad": p.direction, "speed_mps": p.speed, "travel_m": p.travel,
             "contact_offset_m": p.contact_offset}
            for file, p in zip(push_files(plan), pushes, strict=False)
        ],
        "hand_height_m": tip_height_of(plan.model, plan.situation),
        "predicted": _outcome(plan.predicted, plan.cost),
        "predicted_with_effects": None if with_effects is None else _outcome(*with_effects),
        "baseline_plan": None if hindsight is None else _baseline_plan(hindsight),
        "warnings": caveats_of(plan, hindsight),
        "posterior": None if plan.spread is None else _posterior(plan.spread, plan.tolerance),
        "loss_m": plan.loss,
        "sweep": {"setting": plan.policy.swept, "rows": [_row(row) for row in plan.sweep]},
        "search": {
            "minimised": "expected cost" if plan.risk else "cost with the most likely parameters",
            "trials": plan.search.belief.n_trials,
            "failed": plan.search.n_failed,
            "stop_reason": plan.search.stop_reason,
        },
        "seed": seed,
    }  # fmt: skip
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def plan_table(plan: Plan, *, with_effects: Outcome | None = None, hindsight: Hindsight | None = None) -> Table:
    """The best push and what is expected of it."""
    table = narrow_table(title_of(plan), words("what"), words("value"), header=False)
    for what, value in plan_rows(plan, with_effects=with_effects, hindsight=hindsight):
        table.add_row(what, value)
    return table


def title_of(plan: Plan) -> str:
    """One line that says what was planned."""
    effects = ", ".join(e.name for e in plan.model.effects)
    return f"{plan.model.recording}: {plan.policy.name}, {'with ' + effects if effects else 'baseline model'}"


def plan_rows(
    plan: Plan, *, with_effects: Outcome | None = None, hindsight: Hindsight | None = None
) -> list[tuple[str, str]]:
    """The plan as lines of two texts."""
    x, y, yaw = plan.situation.start
    rows = [("object at", f"{1e3 * x:.0f}, {1e3 * y:.0f} mm, {math.degrees(yaw):.0f} deg")]
    if isinstance(plan.cost_function, DistanceToGoal):
        gx, gy = plan.cost_function.goal
        rows.append(("goal", f"{1e3 * gx:.0f}, {1e3 * gy:.0f} mm"))
    if isinstance(plan.cost_function, WithinDisc):
        (gx, gy), radius = plan.cost_function.centre, plan.cost_function.radius
        rows.append(
            ("goal", f"within {1e3 * radius:.0f} mm of {1e3 * gx:.0f}, {1e3 * gy:.0f} mm, within a robot's reach")
        )
    rows += _settings_rows(plan)
    rows.append(("predicted end", _said(plan.predicted, plan.cost)))
    if not isinstance(plan.cost_function, InsideRegion) and plan.tolerance < plan.cost < plan.loss:
        rows.append(("misses the goal", f"by {1e3 * plan.cost:.1f} mm; the tolerance is {1e3 * plan.tolerance:g} mm"))
    if with_effects is not None:
        rows.append(("with the effects found", _said(*with_effects)))
    if plan.spread is not None:
        whose = "" if with_effects is None else ", baseline model"
        rows += [(what + whose, value) for what, value in _posterior_rows(plan.spread, plan.tolerance)]
    if hindsight is not None and hindsight.baseline is not None and hindsight.outcome is not None:
        settings = ", ".join(value for _, value in _settings_rows(hindsight.baseline))
        rows += [
            ("baseline plan", f"{settings}; predicted miss {1e3 * hindsight.baseline.cost:.1f} mm"),
            ("baseline plan, simulated with the effect", _said(*hindsight.outcome)),
        ]
    return [*rows, *(("warning", caveat) for caveat in caveats_of(plan, hindsight))]


def _settings_rows(plan: Plan) -> list[tuple[str, str]]:
    return [
        (p.name, _setting(float(v), p.unit))
        for p, v in zip(plan.policy.space.parameters, plan.settings, strict=True)
    ]  # fmt: skip


def _baseline_plan(hindsight: Hindsight) -> dict[str, Any] | None:
    """The plan with the baseline model: what that predicts, and what the model with the effects does."""
    plain, outcome = hindsight.baseline, hindsight.outcome
    if plain is None or outcome is None:
        return None
    return {
        **_outcome(*outcome),
        "settings": _settings(plain),
        "predicted": _outcome(plain.predicted, plain.cost),
        "posterior": None if plain.spread is None else _posterior(plain.spread, plain.tolerance),
    }


def _settings(plan: Plan) -> dict[str, Any]:
    return {
        p.name: {"value": float(v), "unit": p.unit}
        for p, v in zip(plan.policy.space.parameters, plan.settings, strict=True)
    }


def _posterior_rows(spread: Spread, tolerance: float) -> list[tuple[str, str]]:
    rate, (low, high) = spread.success_rate(tolerance)
    count = len(spread.costs)
    band = spread.band
    rows = [
        ("expected miss", f"{1e3 * spread.mean:.1f} mm (90 %: {1e3 * band[0]:.1f} to {1e3 * band[1]:.1f} mm)"),
        ("success rate",
         f"{round(rate * count)}/{count} (90 %: {low:.2f} to {high:.2f}) within {1e3 * tolerance:g} mm"),
        ("falls or topples", f"{spread.losses}/{count}"),
    ]  # fmt: skip
    if spread.moving:
        rows.append(("does not stop", f"{spread.moving}/{count}, counted as lost"))
    if spread.diverged:
        rows.append(("diverged", f"{spread.diverged}/{count}, counted as lost"))
    return rows


def _setting(value: float, unit: str) -> str:
    if unit == "rad":
        return f"{math.degrees(value):.2f} deg"
    return f"{round(1e3 * value, 1) + 0.0:.1f} mm" if unit == "m" else f"{value:.4f} {unit}"


def _said(trajectory: Trajectory, cost: float) -> str:
    x, y, yaw = np.round(trajectory.end * [1e3, 1e3, 180.0 / math.pi], 1) + 0.0  # no -0.0
    place = f"{x:.1f}, {y:.1f} mm, {yaw:.1f} deg"
    if trajectory.ending is not Ending.AT_REST:
        return f"{place}, {trajectory.ending.value}: this push does not bring it to the goal"
    return f"{place}, {trajectory.ending.value}; miss {1e3 * cost:.1f} mm"


def _pose(pose: Any) -> dict[str, float]:
    x, y, yaw = (float(v) for v in pose)
    return {"x_m": x, "y_m": y, "yaw_rad": yaw}


def _outcome(trajectory: Trajectory, cost: float) -> dict[str, Any]:
    return {"end": _pose(trajectory.end), "ending": trajectory.ending.value, "cost_m": _finite(cost)}


def _posterior(spread: Spread, tolerance: float) -> dict[str, Any]:
    rate, interval = spread.success_rate(tolerance)
    return {
        "samples": len(spread.costs),
        "mean_cost_m": spread.mean,
        "cost_5_95_m": list(spread.band),
        "losses": spread.losses,
        "moving": spread.moving,
        "diverged": spread.diverged,
        "success_rate": rate,
        "success_rate_ci90": list(interval),
        "ends": [_pose(end) for end in spread.ends],
    }


def _disc(cost: WithinDisc) -> dict[str, float]:
    return {"x_m": cost.centre[0], "y_m": cost.centre[1], "radius_m": cost.radius}


def _row(row: SweepRow) -> dict[str, Any]:
    numbers: dict[str, Any] = {"value": row.value, "cost_m": _finite(row.cost), "ending": row.ending.value}
    if row.spread is not None:
        numbers |= {"mean_cost_m": row.spread.mean, "cost_5_95_m": list(row.spread.band), "losses": row.spread.losses}
    return numbers


def _finite(cost: float) -> float | None:
    return cost if math.isfinite(cost) else None
