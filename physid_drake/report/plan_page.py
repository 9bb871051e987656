"""A plan as pictures and as a page that opens without a network; the same plan gives the same bytes."""

from __future__ import annotations

import io
import math
from collections.abc import Collection

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from physid_drake.effects.rollout import Geometry, geometry_with
from physid_drake.plan import DistanceToGoal, Ending, Hindsight, InsideRegion, Outcome, Plan, SweepRow, WithinDisc
from physid_drake.report.outline import outline_of
from physid_drake.report.pages import BASELINE_MEANS, PLAN, nav
from physid_drake.report.plan import plan_rows, push_files, title_of
from physid_drake.report.svg import MUTED, drawn, svg_of
from physid_drake.report.table_view import MM, placed

Array = NDArray[np.float64]

OBJECT, HAND, GOAL, LOST = "#2563c9", "#b4540a", "#1d7a46", "#b42318"
FLATTEST = 0.6  # of the longer side of a view from above


def curve_svg(plan: Plan) -> Markup:
    """Cost against the swept setting, with its spread, as inline SVG."""
    with drawn():
        figure = Figure(figsize=(5.2, 3.4), layout="constrained")
        _draw_curve(figure.add_subplot(), plan)
        return svg_of(figure, "plan curve", f"Miss against {plan.policy.swept}")


def plan_png(plan: Plan) -> bytes:
    """The table from above and the cost's curve, side by side, as PNG."""
    with drawn():
        figure = Figure(figsize=(11.0, 4.2), layout="constrained")
        axes = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
        _draw_table(axes[0], plan)
        _draw_curve(axes[1], plan)
        figure.suptitle(title_of(plan), x=0.01, ha="left", fontsize=10)
        file = io.BytesIO()
        figure.savefig(file, format="png", dpi=120, transparent=False, metadata={"Software": None})
        return file.getvalue()


def plan_page(
    plan: Plan, *, seed: int, with_effects: Outcome | None = None, hindsight: Hindsight | None = None,
    pages: Collection[str] = (),
) -> str:  # fmt: skip
    """The page as HTML.

    Args:
        plan: what to show.
        seed: of the run.
        with_effects: trajectory and cost of the same push under the model with its effects, where it was planned
            without them.
        hindsight: what a diagnosis leaves open.
        pages: that lie beside this one.
    """
    with drawn():
        above = Figure(figsize=(6.4, 4.4), layout="constrained")
        _draw_table(above.add_subplot(), plan, with_effects)
        picture = svg_of(above, "plan above", "The table from above: the object, its predicted path, the goal")
    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(_PAGE).render(
        title=title_of(plan), rows=plan_rows(plan, with_effects=with_effects, hindsight=hindsight),
        above=picture,
        curve=curve_svg(plan) if plan.sweep else None, caption=caption_of(plan), files=push_files(plan),
        seed=seed, baseline_means=BASELINE_MEANS, other=with_effects is not None,
        trials=plan.search.belief.n_trials, nav=nav(PLAN, pages),
    ) + "\n"  # fmt: skip


def caption_of(plan: Plan) -> str:
    """What the curve shows, in words."""
    fixed = "" if plan.policy.space.dimension == 1 else ", with the other settings at their optimum"
    text = f"Miss against {plan.policy.swept}{fixed}."
    drawn = [row.spread for row in plan.sweep if row.spread is not None]
    if drawn:
        text += f" Line: most likely parameters; band: 5 to 95 % of {len(drawn[0].costs)} posterior samples."
    lost = sum(s.losses + s.moving for s in drawn) + sum(row.ending is not Ending.AT_REST for row in plan.sweep)
    if lost:
        text += f" An object that falls, topples or does not stop counts as {MM * plan.loss:.0f} mm."
    return text


def _draw_curve(axes: Axes, plan: Plan) -> None:
    parameter = plan.policy.space.parameters[plan.policy.space.index(plan.policy.swept)]
    angle = parameter.unit == "rad"
    scale, unit = (180.0 / math.pi, "deg") if angle else (1.0, parameter.unit)
    best = scale * float(plan.settings[plan.policy.space.index(plan.policy.swept)])
    rows = _curve(plan)
    values = np.array([scale * row.value for row in rows])
    costs = np.array([MM * row.cost if math.isfinite(row.cost) else np.nan for row in rows])
    bands = np.array([row.spread.band if row.spread is not None else (np.nan, np.nan) for row in rows])
    if len(values):
        axes.fill_between(values, MM * bands[:, 0], MM * bands[:, 1], color=OBJECT, alpha=0.18, linewidth=0.0)
        axes.plot(values, costs, color=OBJECT, marker="o", markersize=2.5, linewidth=1.2)
    lost = [k for k, row in enumerate(rows) if row.ending is not Ending.AT_REST]
    axes.plot(values[lost], costs[lost], "x", color=LOST, markersize=6)
    if math.isfinite(plan.cost):
        axes.plot([best], [MM * plan.cost], "o", color=GOAL, markersize=6, zorder=4, clip_on=False)
    axes.axvline(best, color=GOAL, linewidth=0.8, linestyle=":")
    axes.axhline(MM * plan.tolerance, color=MUTED, linewidth=0.6, linestyle="--")
    axes.set(xlabel=f"{plan.policy.swept} [{unit}]", ylabel="miss [mm]")
    axes.set_ylim(bottom=0.0)
    axes.grid()


def _curve(plan: Plan) -> list[SweepRow]:
    """The sweep with the plan itself at its place, so that the curve reaches down to it."""
    if not plan.sweep:
        return []
    value = float(plan.settings[plan.policy.space.index(plan.policy.swept)])
    chosen = SweepRow(value=value, cost=plan.cost, ending=plan.predicted.ending, spread=plan.spread)
    return sorted([*plan.sweep, chosen], key=lambda row: row.value)


def _draw_table(axes: Axes, plan: Plan, other: Outcome | None = None) -> None:
    # As large as effects make it.
    outline = outline_of(geometry_with(plan.model.effects, Geometry(shape=plan.model.shape)).shape)
    start, poses = np.array(plan.situation.start), plan.predicted.poses
    (x0, y0), (x1, y1) = plan.model.table
    axes.add_patch(
        Rectangle((MM * x0, MM * y0), MM * (x1 - x0), MM * (y1 - y0), facecolor="#faf8f4", edgecolor="#cbbfa8")
    )
    for path in plan.predicted.paths:
        hand = MM * path.positions(np.linspace(0.0, float(path.times[-1]), 100))
        axes.plot(hand[:, 0], hand[:, 1], color=HAND, linewidth=1.4, linestyle=(0, (6, 2)))
        axes.add_patch(
            Circle(tuple(hand[-1]), MM * (plan.model.hand_radius or 0.0), facecolor="none", edgecolor=HAND)
        )
    ends = [] if plan.spread is None else list(plan.spread.ends)
    for end in ends:
        axes.add_patch(Polygon(placed(outline, end), closed=True, facecolor="none", edgecolor=OBJECT, alpha=0.2))
        axes.plot(*(MM * end[:2]), ".", color=OBJECT, alpha=0.4, markersize=3)
    axes.plot(MM * poses[:, 0], MM * poses[:, 1], color=OBJECT, linewidth=1.2)
    for pose, alpha in ((start, 0.45), (plan.predicted.end, 1.0)):
        axes.add_patch(Polygon(placed(outline, pose), closed=True, facecolor="none", edgecolor=OBJECT, alpha=alpha))
    if other is not None:
        end = other[0].end
        axes.add_patch(Polygon(placed(outline, end), closed=True, facecolor="none", edgecolor=LOST, linestyle="--"))
    _draw_goal(axes, plan)
    _frame(axes, plan, outline, [start, *poses[:: max(1, len(poses) // 20)], *ends])
    axes.set(xlabel="x [mm]", ylabel="y [mm]")
    axes.grid()


def _draw_goal(axes: Axes, plan: Plan) -> None:
    cost = plan.cost_function
    if isinstance(cost, DistanceToGoal):
        x, y = MM * cost.goal[0], MM * cost.goal[1]
        axes.add_patch(Circle((x, y), MM * plan.tolerance, facecolor=GOAL, edgecolor=GOAL, alpha=0.25))
        axes.plot([x], [y], "+", color=GOAL, markersize=9, zorder=5)
    elif isinstance(cost, WithinDisc):
        centre = (MM * cost.centre[0], MM * cost.centre[1])
        axes.add_patch(Circle(centre, MM * cost.radius, facecolor=GOAL, edgecolor=GOAL, alpha=0.2))
    elif isinstance(cost, InsideRegion):
        (x0, y0), (x1, y1) = cost.lower, cost.upper
        axes.add_patch(
            Rectangle((MM * x0, MM * y0), MM * (x1 - x0), MM * (y1 - y0), facecolor=GOAL, edgecolor=GOAL, alpha=0.2)
        )


def _frame(axes: Axes, plan: Plan, outline: Array | None, poses: list[Array]) -> None:
    """Show what moves, the goal and a margin, with a mm as long along x as along y."""
    points = [placed(outline, pose) for pose in poses]
    points += [MM * path.knot_positions() for path in plan.predicted.paths]
    if isinstance(plan.cost_function, DistanceToGoal):
        points.append(MM * np.array([plan.cost_function.goal]))
    every = np.vstack(points)
    middle, half = 0.5 * (every.min(axis=0) + every.max(axis=0)), 0.56 * np.ptp(every, axis=0)
    half = np.maximum(half, FLATTEST * half[::-1])
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])


_PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
body { margin: 0; color: #1c2330; background: #fff; font: 15px/1.5 system-ui, "Segoe UI", Roboto, Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 28px 24px 48px; }
h1 { font-size: 24px; line-height: 1.25; margin: 0 0 16px; overflow-wrap: anywhere; }
.columns { display: grid; grid-template-columns: minmax(0, 1.25fr) minmax(0, 1fr); gap: 28px; align-items: start; }
figure { margin: 0; } svg { display: block; width: 100%; height: auto; } svg * { stroke-linejoin: round; }
figcaption, .note { color: #667085; font-size: 13px; margin-top: 6px; }
table { border-collapse: collapse; margin: 20px 0 8px; font-size: 14px; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 500; color: #667085; } th, td { padding: 5px 22px 5px 0; }
tr + tr th, tr + tr td { border-top: 1px solid #dfe3ea; }
i { display: inline-block; width: 18px; height: 4px; border-radius: 2px; vertical-align: middle;
  margin: 0 6px 0 12px; }
@media print { * { print-color-adjust: exact; -webkit-print-color-adjust: exact; } }
@media (max-width: 800px) { .columns { grid-template-columns: minmax(0, 1fr); } main { padding: 18px 14px; } }
</style></head><body><main>
{{ nav }}
<h1>{{ title }}</h1>
<div class="columns">
<figure>{{ above }}<figcaption><i style="background:#2563c9; margin-left:0"></i>object
<i style="background:repeating-linear-gradient(90deg, #b4540a 0 7px, transparent 7px 10px)"></i>hand
<i style="background:#1d7a46"></i>goal and tolerance. Faint: end poses of the posterior samples.
{% if other %}Dashed red: end pose with the effects found.{% endif %}
</figcaption></figure>
{% if curve %}
<figure>{{ curve }}<figcaption>{{ caption }} Green: the plan; dashed: the tolerance.</figcaption></figure>
{% endif %}
</div>
<table>
{% for what, value in rows %}
<tr><th>{{ what }}</th><td>{{ value }}</td></tr>
{% endfor %}
</table>
<p class="note">{{ files | join(", ") }}: the hand's path for a controller (time_s, hand_x_m, hand_y_m, hand_z_m).
{{ trials }} candidates evaluated; random seed {{ seed }}. {{ baseline_means }}</p>
</main></body></html>
"""
