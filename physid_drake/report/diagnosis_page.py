"""``page.html`` of a diagnosis: one file that opens without a network, read from top to bottom.

It reads and draws what was computed; the statistics are all made before.
"""

from __future__ import annotations

import dataclasses as dc
import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon, Rectangle
from numpy.typing import NDArray

from physid_drake.cell.outline import Disc
from physid_drake.cell.outline import Polygon as OutlinePolygon
from physid_drake.cell.solid import solid_of
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.values import Diagnosis, EffectFinding, NextPush, ParameterEstimate, ThetaEstimate
from physid_drake.errors import CellError
from physid_drake.recording import Recording, Shape

Array = NDArray[np.float64]
Box = tuple[float, float, float, float]  # x and y from, x and y to [mm]

INK, MUTED, RULE, PAPER = "#1c2330", "#667085", "#dfe3ea", "#f6f7f9"
BEFORE, AFTER = "#98a1b0", "#2563c9"
CONTACT, FREE = "#b4540a", "#0f766e"
BADGES = {
    "consistent": "#1d7a46",
    "explained": "#1f5fbf",
    "ambiguous": "#a15c00",
    "unexplained": "#b42318",
    "underpowered": "#5d6475",
}
MEANING = {
    "consistent": "There is no evidence against the plain cell.",
    "explained": "One model accounts for what the plain cell leaves.",
    "ambiguous": "More than one effect accounts for these pushes: they are named together, not guessed at.",
    "unexplained": "The mismatch is real, and no effect of the catalogue brings it down to noise.",
    "underpowered": "These pushes are too few, or move too little, to show an effect of ordinary size.",
}
PHASES = {"contact": "while it is pushed", "free_slide": "in its free slide"}
DOFS = {"along_motion": "along the motion", "across_motion": "across the motion", "rotation": "in rotation"}
MOST_ERRORS, MOST_STRIPS, MOST_RANKED = 4, 8, 8  # shown before the reader asks for more
MOST_DRAWN = 40  # strips in all, so that the page stays small
MOST_POINTS = 160  # of a path
MANY_PUSHES = 12
MM = 1e3

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "text.color": INK,
    "text.parse_math": False,
    "axes.edgecolor": "#c3c9d4",
    "axes.labelcolor": MUTED,
    "axes.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": RULE,
    "grid.linewidth": 0.5,
    "xtick.color": "#c3c9d4",
    "ytick.color": "#c3c9d4",
    "xtick.labelcolor": MUTED,
    "ytick.labelcolor": MUTED,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "savefig.transparent": True,
}


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class ShownPush:
    """One push, recorded and predicted while it was left out of the fit.

    Attributes:
        name: of the push.
        times: (n,) [s].
        recorded: (n, 3) x, y [m], yaw [rad].
        before: (n, 3) predicted by the plain cell.
        after: (n, 3) predicted with what is missing, None where nothing was found.
        released: when the hand lets go [s], None where it is not known.
    """

    name: str
    times: Array
    recorded: Array
    before: Array
    after: Array | None
    released: float | None


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class _Scene:
    """What the drawings share: the outline (n, 2) in B [m], pushes, missing wrenches, friction with the table."""

    outline: Array | None
    shown: Sequence[ShownPush]
    wrenches: Sequence[MissingWrench]
    friction: float | None

    def name(self, push: int) -> str:
        """Of a push by its index."""
        return self.shown[push].name if 0 <= push < len(self.shown) else f"push {push + 1}"


def diagnosis_page(
    diagnosis: Diagnosis, recording: Recording, shown: Sequence[ShownPush], wrenches: Sequence[MissingWrench]
) -> str:
    """The page as HTML; the same arguments give the same bytes.

    Args:
        diagnosis: what to show.
        recording: what it was made from.
        shown: its pushes, in the recording's order.
        wrenches: what is missing from the plain cell, window by window.
    """
    friction = diagnosis.theta.get("support_friction")
    scene = _Scene(
        outline=_outline(recording.object.shape),
        shown=shown,
        wrenches=wrenches,
        friction=None if friction is None else _told(friction),
    )
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_STYLE)
        content = _content(diagnosis, recording, scene)
    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["degrees"] = lambda angle: _fixed(math.degrees(angle))
    environment.filters.update(number=_number, fixed=_fixed, quantity=_quantity, chance=_chance, tiny=_tiny)
    return environment.from_string(_PAGE).render(content) + "\n"


def _content(diagnosis: Diagnosis, recording: Recording, scene: _Scene) -> dict[str, Any]:
    """What the template is filled with."""
    order = _most_changed(diagnosis, scene.shown)
    strips = _strips(diagnosis, scene)
    return {
        "d": diagnosis,
        "style": Markup(_CSS),
        "colours": {"ink": INK, "before": BEFORE, "after": AFTER, "contact": CONTACT, "free": FREE},
        "badge": BADGES.get(diagnosis.verdict, MUTED),
        "meaning": MEANING.get(diagnosis.verdict, ""),
        "pushes": len(recording.pushes),
        "found": [_finding(e, k, scene) for k, e in enumerate(diagnosis.effects)],
        "phases": [] if diagnosis.location is None else [PHASES.get(p, p) for p in diagnosis.location.phase],
        "dofs": [] if diagnosis.location is None else [DOFS.get(x, x) for x in diagnosis.location.dof],
        "frame": "" if diagnosis.location is None else _frame(diagnosis.location.frame),
        "views": _views(scene),
        "errors": [_error_figure(scene, k, diagnosis.noise) for k in order[:MOST_ERRORS]],
        "arrows": _arrows(scene),
        "strips": strips[:MOST_STRIPS],
        "more_strips": strips[MOST_STRIPS:],
        "left_out": len({w.push for w in scene.wrenches}) - len(strips),
        "fits": _fits(diagnosis),
        "bars": _bars(diagnosis),
        "ranking": _ranking(diagnosis)[:MOST_RANKED],
        "more_ranking": _ranking(diagnosis)[MOST_RANKED:],
        "theta": [_theta_row(name, t) for name, t in diagnosis.theta.items()],
        "next_push": None if diagnosis.next_push is None else _next_figure(diagnosis.next_push, recording, scene),
        "noise": _noise(diagnosis),
        "warnings": [
            *diagnosis.warnings,
            *(f"{push.name}: {warning}" for push in recording.pushes for warning in push.warnings),
        ],
    }


# Numbers and words.


def _number(value: float | None, digits: int = 3) -> str:
    """A number for reading: significant digits, a true minus sign, powers of ten; a dash where there is none."""
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0.0 else "−∞"
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, power = text.split("e")
        if -5 < int(power) < 7:
            text = f"{value:.{max(0, digits - 1 - int(power))}f}"
        else:
            raised = str(int(power)).translate(str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻"))
            text = f"{mantissa} × 10{raised}"
    return text.replace("-", "−")


def _fixed(value: float) -> str:
    """Two decimals, so that the numbers of a column are alike."""
    return f"{value:.2f}".replace("-", "−") if abs(value) < 1e4 else _number(value)


def _tenths(value: float | None) -> str:
    """One decimal; a dash where there is no number."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.1f}".replace("-", "−")


def _tiny(value: float) -> str:
    """A probability that may be too small for a float."""
    return "< 10⁻³⁰⁰" if value < 1e-300 else _number(value, 2)


def _chance(value: float) -> str:
    """A probability that something is so; never quite certain."""
    return "> 0.99" if value > 0.99 else _fixed(value)


def _unit(unit: str) -> str:
    return "" if unit == "-" else unit.replace("*", "·").replace("^2", "²")


def _quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """A number with its unit; angles in degrees too."""
    text = f"{_number(value, digits)} {_unit(unit)}".strip()
    if unit == "rad" and value is not None and math.isfinite(value):
        text += f" ({_number(math.degrees(value), digits)}°)"
    return text


def _interval(ends: Sequence[float] | None, unit: str) -> str:
    if ends is None:
        return "–"
    scale = f" ({_number(math.degrees(ends[0]))}° to {_number(math.degrees(ends[1]))}°)" if unit == "rad" else ""
    return f"{_number(ends[0])} to {_number(ends[1])} {_unit(unit)}".strip() + scale


def _frame(frame: str) -> str:
    return "no one frame" if frame == "none" else f"of the {frame.replace('_', ' ')}"


def _told(theta: ThetaEstimate) -> float:
    return theta.before if theta.value is None else theta.value


def _fits(diagnosis: Diagnosis) -> list[tuple[str, list[str]]]:
    """Rows of the table of held-out errors."""
    fit = diagnosis.fit
    rows = [("plain cell", fit.position_before, fit.rotation_before, fit.rms_before, diagnosis.reduced_chi2_before)]
    if diagnosis.effects:
        after = (fit.position_after, fit.rotation_after, fit.rms_after, diagnosis.reduced_chi2_after)
        rows.append(("with what is missing", *after))
    return [
        (name, [_fixed(MM * position), _fixed(math.degrees(rotation)), _fixed(sigmas), _fixed(chi2)])
        for name, position, rotation, sigmas, chi2 in rows
    ]


def _bars(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Per push: the errors before and after, and how long their bars are [%]."""
    rows = diagnosis.fit.per_push
    longest = max((v for _, b, a in rows for v in (b, a) if math.isfinite(v)), default=1.0) or 1.0
    return [
        {
            "name": name,
            "bars": [
                (kind, f"{_share(value, longest):.1f}", _fixed(value))
                for kind, value in (("before", before), ("after", after))
                if kind == "before" or diagnosis.effects
            ],
        }
        for name, before, after in rows
    ]


def _share(value: float, longest: float) -> float:
    """Length of a bar [%]."""
    return 100.0 * min(1.0, max(0.0, value / longest)) if math.isfinite(value) else 0.0


def _ranking(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    best = max((r.gain for r in diagnosis.ranking if math.isfinite(r.gain)), default=1.0) or 1.0
    return [
        {
            "name": r.name,
            "gain": _tenths(r.gain),
            "width": f"{_share(r.gain, best):.1f}",
            "p": _tiny(r.p_value),
            "held_out": "–" if r.held_out_gain is None else f"{_tenths(r.held_out_gain)} ± {_tenths(r.held_out_se)}",
            "why": r.why,
            "found": r.name in {e.name for e in diagnosis.effects},
        }
        for r in diagnosis.ranking
    ]


def _theta_row(name: str, theta: ThetaEstimate) -> dict[str, Any]:
    told = theta.identifiable and theta.value is not None
    return {
        "name": name.replace("_", " "),
        "before": _quantity(theta.before, theta.unit),
        "after": _quantity(theta.value, theta.unit) if told else "not told by these pushes",
        "interval": _interval(theta.ci90, theta.unit) if told else "–",
        "told": told,
    }


def _noise(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """What is known of the noise, in words."""
    noise = diagnosis.noise
    rows = [
        ("position", "position_m", MM, " mm"),
        ("rotation", "rotation_rad", math.degrees(1.0), "°"),
        ("jitter of time stamps", "jitter_s", MM, " ms"),
    ]
    told = [(name, f"{_number(scale * noise[key])}{unit}") for name, key, scale, unit in rows if key in noise]
    times = noise.get("correlation_time_s")
    if times:
        told.append(("correlated over", ", ".join(_number(MM * t) for t in times) + " ms (position, rotation)"))
    told.append(("friction from push to push", f"{_number(100.0 * diagnosis.friction_scatter)} %"))
    return told


# Geometry.


def _outline(shape: Shape) -> Array | None:
    """Corners (n, 2) of the object seen from above [m]; None where its mesh cannot be read."""
    try:
        outline = solid_of(shape).outline
    except CellError:
        return None
    if isinstance(outline, Disc):
        angles = np.linspace(0.0, 2.0 * math.pi, 40, endpoint=False)
        return np.asarray(outline.radius * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.array(outline.vertices) if isinstance(outline, OutlinePolygon) else None


def _placed(outline: Array | None, pose: Array) -> Array:
    """The outline at a pose (n, 2) [mm]; the pose's point alone where there is no outline."""
    if outline is None:
        return MM * pose[None, :2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    return np.asarray(MM * (outline @ np.array([[c, s], [-s, c]]) + pose[:2]))


def _path(poses: Array) -> Array:
    """The finite rows of a path (n, 3), thinned to what a drawing shows."""
    finite = poses[np.isfinite(poses).all(axis=1)]
    step = max(1, math.ceil(len(finite) / MOST_POINTS))
    return np.vstack([finite[:-1:step], finite[-1:]])


def _most_changed(diagnosis: Diagnosis, shown: Sequence[ShownPush]) -> list[int]:
    """Indices of the pushes, those first whose error changes most; where nothing was found, the largest errors."""
    errors = {name: (before, after) for name, before, after in diagnosis.fit.per_push}
    changes = []
    for k, push in enumerate(shown):
        before, after = errors.get(push.name, (0.0, 0.0))
        change = before if push.after is None else abs(before - after)
        changes.append((-change if math.isfinite(change) else -math.inf, k))
    return [k for _, k in sorted(changes)]


def _box(scene: _Scene, pushes: Sequence[ShownPush], margin: float = 0.04) -> Box:
    """What of the table to show: the recorded objects, and the simulated ones while they are near."""
    real, simulated = [], []
    for push in pushes:
        path = _path(push.recorded)
        real += [MM * path[:, :2], *(_placed(scene.outline, p) for p in path[-1:])]
        for other in (push.before, push.after):
            simulated += [] if other is None else [_placed(scene.outline, p) for p in _path(other)[-1:]]
    if not any(len(points) for points in real):
        return -100.0, -100.0, 100.0, 100.0
    low, high = np.vstack(real).min(axis=0), np.vstack(real).max(axis=0)
    near = 0.4 * (high - low)
    every = np.clip(np.vstack(real + simulated), low - near, high + near)
    low, high = every.min(axis=0), every.max(axis=0)
    pad = margin * float((high - low).max())
    return float(low[0] - pad), float(low[1] - pad), float(high[0] + pad), float(high[1] + pad)


# Figures.


def _svg(figure: Figure, salt: str, label: str) -> Markup:
    """A figure as inline SVG that scales with its column; ``salt`` keeps its ids apart from the others'."""
    mpl.rcParams["svg.hashsalt"] = salt
    file = io.BytesIO()
    figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = file.getvalue().decode()
    text = text[text.index("<svg") :]
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>|<style .*?</style>", "", text, flags=re.S)
    text = re.sub(r'<g id="[^"]*">', "<g>", text).replace("xlink:href", "href")
    box = re.search(r'viewBox="[^"]*"', text)
    assert box is not None
    body = text[text.index(">") + 1 :]
    body = re.sub(r"\n\s*", "\n", body).strip()
    return Markup('<svg {} role="img" aria-label="{}">\n{}').format(Markup(box[0]), label, Markup(body))


def _map(box: Box, width: float, tallest: float = 6.0) -> tuple[Figure, Axes]:
    """Empty axes on the table from above, in mm, as high as the box asks for; ``width`` in inches."""
    left, right, bottom, top = 0.62, 0.08, 0.42, 0.1
    inner = width - left - right
    height = min(tallest, max(0.45 * width, inner * (box[3] - box[1]) / (box[2] - box[0])))
    figure = Figure(figsize=(width, height + bottom + top))
    whole = height + bottom + top
    axes = figure.add_axes((left / width, bottom / whole, inner / width, height / whole))
    _ground(axes, box, inner / height)
    return figure, axes


def _ground(axes: Axes, box: Box, aspect: float) -> None:
    """The table from above: the box, widened to the axes' aspect, so that a mm is as long along x as along y."""
    x, y = 0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])
    half = 0.5 * max(box[3] - box[1], (box[2] - box[0]) / aspect)
    axes.set(xlim=(x - aspect * half, x + aspect * half), ylim=(y - half, y + half), xlabel="x [mm]", ylabel="y [mm]")
    axes.locator_params(nbins=6)
    axes.grid()


def _draw_motion(axes: Axes, scene: _Scene, poses: Array, colour: str, *, width: float, alpha: float) -> None:
    """A path, and the object at its end."""
    path = _path(poses)
    if not len(path):
        return
    axes.plot(MM * path[:, 0], MM * path[:, 1], color=colour, linewidth=width, alpha=alpha, solid_capstyle="round")
    end = _placed(scene.outline, path[-1])
    if len(end) > 1:
        axes.add_patch(Polygon(end, closed=True, facecolor="none", edgecolor=colour, linewidth=width, alpha=alpha))


def _draw_recorded(axes: Axes, scene: _Scene, alpha: float = 0.25) -> None:
    """All recorded motions, faintly, as a ground for other things."""
    for push in scene.shown:
        _draw_motion(axes, scene, push.recorded, INK, width=0.6, alpha=alpha)
        axes.lines[-1].set_alpha(0.45)


def _views(scene: _Scene) -> list[tuple[str, Markup]]:
    """The table from above: all pushes before, and after where something was found."""
    if not scene.shown:
        return []
    box = _box(scene, scene.shown)
    alpha = 0.7 if len(scene.shown) > MANY_PUSHES else 0.9
    views = []
    for kind, colour, title in (("before", BEFORE, "plain cell"), ("after", AFTER, "with what is missing")):
        motions = [push.before if kind == "before" else push.after for push in scene.shown]
        if all(m is None for m in motions):
            continue
        figure, axes = _map(box, 5.2)
        for push, motion in zip(scene.shown, motions, strict=True):
            if motion is not None:
                _draw_motion(axes, scene, motion, colour, width=2.6, alpha=0.55 * alpha)
            _draw_motion(axes, scene, push.recorded, INK, width=0.7, alpha=alpha)
        views.append((title, _svg(figure, f"view {kind}", f"Table from above: recorded and simulated, {title}")))
    return views


def _error_figure(scene: _Scene, k: int, noise: Mapping[str, Any]) -> tuple[str, Markup]:
    """One push: from above, and the errors of x, y and yaw over time."""
    push = scene.shown[k]
    figure = Figure(figsize=(3.3, 5.0))
    above = figure.add_axes((0.22, 0.6, 0.75, 0.39))
    for motion, colour in ((push.before, BEFORE), (push.after, AFTER)):
        if motion is not None:
            _draw_motion(above, scene, motion, colour, width=2.2, alpha=0.6)
    _draw_motion(above, scene, push.recorded, INK, width=0.7, alpha=0.9)
    box = _box(scene, [push], margin=0.06)
    _ground(above, box, 0.75 * 3.3 / (0.39 * 5.0))
    above.yaxis.set_label_coords(-0.215, 0.5)
    scales = (
        ("Δx [mm]", MM, "position_m"),
        ("Δy [mm]", MM, "position_m"),
        ("Δyaw [°]", math.degrees(1.0), "rotation_rad"),
    )
    for row, (label, scale, key) in enumerate(scales):
        axes = figure.add_axes((0.22, 0.365 - 0.145 * row, 0.75, 0.125))
        _draw_error(axes, push, row, scale, 2.0 * scale * float(noise.get(key, math.nan)))
        axes.set_ylabel(label)
        axes.set_xlabel("time [s]" if row == 2 else "")
        axes.tick_params(labelbottom=row == 2)
    return push.name, _svg(figure, f"error {k}", f"Error over time of {push.name}")


def _draw_error(axes: Axes, push: ShownPush, column: int, scale: float, band: float) -> None:
    """Simulated minus recorded, with the noise's band."""
    if math.isfinite(band):
        axes.axhspan(-band, band, color="#eef0f4", linewidth=0.0, zorder=0)
    axes.axhline(0.0, color="#c3c9d4", linewidth=0.6, zorder=1)
    step = max(1, math.ceil(len(push.times) / MOST_POINTS))
    for motion, colour in ((push.before, BEFORE), (push.after, AFTER)):
        if motion is not None:
            error = scale * (motion[::step, column] - push.recorded[::step, column])
            axes.plot(push.times[::step], error, color=colour, linewidth=1.3, marker=".", markersize=3.0)
    if push.released is not None:
        axes.axvline(push.released, color=FREE, linewidth=0.8, linestyle=(0, (2, 2)))
    axes.locator_params(axis="y", nbins=4)
    axes.margins(x=0.03, y=0.12)
    axes.yaxis.set_label_coords(-0.215, 0.5)


def _strips(diagnosis: Diagnosis, scene: _Scene) -> list[tuple[str, Markup]]:
    """The missing wrench over time, one figure per push, on the same scales."""
    if not scene.wrenches:
        return []
    scale = np.array([1.0, 1.0, MM])
    reach = 1.2 * np.max([np.abs(np.nan_to_num(w.wrench)) for w in scene.wrenches], axis=0) * scale
    most = set() if diagnosis.location is None else {(w.push, w.start) for w in diagnosis.location.windows}
    figures = []
    marked = {owner for owner, _ in most}
    every = sorted({w.push for w in scene.wrenches}, key=lambda push: (scene.name(push) not in marked, push))
    for push in sorted(every[:MOST_DRAWN]):
        name = scene.name(push)
        mine = [w for w in scene.wrenches if w.push == push]
        figure = Figure(figsize=(3.3, 3.1))
        for row, label in enumerate(("along [N]", "across [N]", "torque [N mm]")):
            axes = figure.add_axes((0.22, 0.715 - 0.285 * row, 0.75, 0.25))
            _draw_strip(axes, mine, row, scale[row], {start for owner, start in most if owner == name})
            axes.set(ylabel=label, ylim=(-(reach[row] or 1.0), reach[row] or 1.0))
            axes.set_xlabel("time [s]" if row == 2 else "")
            axes.tick_params(labelbottom=row == 2)
        figures.append((name, _svg(figure, f"strip {push}", f"Missing wrench over time in {name}")))
    return figures


def _draw_strip(axes: Axes, windows: Sequence[MissingWrench], row: int, scale: float, most: set[float]) -> None:
    """One component: a bar per window, with two standard deviations; a mark at the windows that stand out."""
    axes.axhline(0.0, color="#c3c9d4", linewidth=0.6, zorder=1)
    for w in windows:
        colour = FREE if w.phase == "free_slide" else CONTACT
        value, std = scale * float(w.wrench[row]), scale * float(w.std[row])
        axes.axvspan(w.start, w.end, color=colour, alpha=0.07, linewidth=0.0, zorder=0)
        span = w.end - w.start
        alpha = 0.85 if abs(value) > 2.0 * std else 0.35
        axes.add_patch(
            Rectangle((w.start + 0.1 * span, 0.0), 0.8 * span, value, color=colour, alpha=alpha, linewidth=0)
        )
        middle = 0.5 * (w.start + w.end)
        axes.errorbar(middle, value, 2.0 * std, color=MUTED, elinewidth=0.7, capsize=1.6, capthick=0.7)
        if row == 0 and w.start in most:
            axes.plot(middle, 0.94, marker="v", markersize=4.0, color=INK, transform=axes.get_xaxis_transform())
    start, end = min(w.start for w in windows), max(w.end for w in windows)
    axes.set_xlim(start - 0.03 * (end - start), end + 0.03 * (end - start))
    axes.locator_params(axis="y", nbins=4)
    axes.locator_params(axis="x", nbins=6)
    axes.yaxis.set_label_coords(-0.215, 0.5)


def _arrows(scene: _Scene) -> Markup | None:
    """The missing force as arrows on the table; faint where it is within two standard deviations."""
    places = [w for w in scene.wrenches if np.isfinite(w.wrench).all()]
    forces = np.array([_turned(w.wrench[:2], w.heading) for w in places])
    largest = float(np.hypot(*forces.T).max()) if places else 0.0
    if largest == 0.0:
        return None
    box = _box(scene, scene.shown) if scene.shown else _around(places)
    figure, axes = _map(box, 5.2)
    _draw_recorded(axes, scene)
    scale = largest / (0.25 * max(box[2] - box[0], box[3] - box[1]))  # N per mm of arrow
    for phase, colour in (("contact", CONTACT), ("free_slide", FREE)):
        for sure in (False, True):
            chosen = [k for k, w in enumerate(places) if (w.phase == phase, _stands_out(w)) == (True, sure)]
            if chosen:
                at = MM * np.array([places[k].place for k in chosen])
                axes.quiver(
                    at[:, 0], at[:, 1], forces[chosen, 0], forces[chosen, 1], angles="xy", scale_units="xy",
                    scale=scale, width=0.0055, color=colour, alpha=0.95 if sure else 0.28, zorder=3,
                )  # fmt: skip
    _draw_key(axes, box, _round_number(0.4 * largest), scale)
    return _svg(figure, "arrows", "Missing force on the table from above")


def _turned(force: Array, heading: float) -> Array:
    """From along and across the motion to W."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([c * force[0] - s * force[1], s * force[0] + c * force[1]])


def _stands_out(w: MissingWrench) -> bool:
    return bool((np.abs(w.wrench[:2]) > 2.0 * w.std[:2]).any())


def _around(places: Sequence[MissingWrench]) -> Box:
    at = MM * np.array([w.place for w in places])
    low, high = at.min(axis=0) - 50.0, at.max(axis=0) + 50.0
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _round_number(value: float) -> float:
    """The next 1, 2 or 5 times a power of ten below."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(m for m in (1.0, 2.0, 5.0) if m <= value / power + 1e-9) * power


def _draw_key(axes: Axes, box: Box, force: float, scale: float) -> None:
    """How long an arrow of a round force is, on a plate in the upper left."""
    left, right = axes.get_xlim()
    reach = force / scale / (right - left)
    axes.add_patch(
        Rectangle((0.015, 0.9), max(reach + 0.04, 0.14), 0.09, transform=axes.transAxes, color="white", alpha=0.85,
                  linewidth=0, zorder=4)
    )  # fmt: skip
    arrow = {"arrowstyle": "-|>", "color": INK, "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", (0.03 + reach, 0.92), (0.03, 0.92), "axes fraction", "axes fraction", arrow, zorder=5)
    axes.text(0.03, 0.94, f"{_number(force)} N", transform=axes.transAxes, fontsize=8, zorder=5)


def _next_figure(push: NextPush, recording: Recording, scene: _Scene) -> Markup | None:
    """The proposed push: the object with its axes along the table's, the tip, and where it goes."""
    if scene.outline is None:
        return None
    angle = math.radians(push.direction_deg)
    ahead, aside = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    tip = MM * (0.005 if recording.hand is None else recording.hand.radius)
    outline = MM * scene.outline
    size = float(np.abs(outline).max())
    back = float((-outline @ ahead).max()) + tip + 0.3 * size
    start = MM * push.contact_offset_m * aside - back * ahead
    end = start + (back + 0.9 * size) * ahead
    corners = np.vstack([outline, start - tip, start + tip, end])
    low, high = corners.min(axis=0) - 0.15 * size, corners.max(axis=0) + 0.15 * size
    figure, axes = _map((float(low[0]), float(low[1]), float(high[0]), float(high[1])), 3.3, 3.0)
    axes.add_patch(Polygon(outline, closed=True, facecolor=PAPER, edgecolor=INK, linewidth=1.0))
    axes.plot(0.0, 0.0, "+", color=MUTED, markersize=6)
    axes.add_patch(Circle((float(start[0]), float(start[1])), tip, color=CONTACT))
    arrow = {"arrowstyle": "-|>", "color": CONTACT, "linewidth": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", end.tolist(), start.tolist(), arrowprops=arrow)
    return _svg(figure, "next push", "The push that would tell more")


# The law of an effect, drawn.


def _finding(effect: EffectFinding, k: int, scene: _Scene) -> dict[str, Any]:
    drawn = _law(effect, k, scene)
    return {
        "name": effect.name,
        "element": effect.element,
        "statement": effect.statement,
        "alike": effect.indistinguishable_from,
        "probability": _chance(effect.probability),
        "width": f"{_share(effect.probability, 1.0):.1f}",
        "parameters": [_parameter_row(name, p) for name, p in effect.parameters.items()],
        "figure": None if drawn is None else drawn[0],
        "caption": "" if drawn is None else drawn[1],
    }


def _parameter_row(name: str, p: ParameterEstimate) -> tuple[str, str, str, str]:
    """Name, value, interval, null."""
    if isinstance(p.value, list | tuple):
        shape = f"{len(p.value)} × {len(p.value[0])} values"
        return name, shape, "in the drawing", "even"
    null = "–" if p.null is None else _quantity(p.null, p.unit)
    return name, _quantity(p.value, p.unit), _interval(p.ci90, p.unit), null


_Law = Callable[[Mapping[str, Any], _Scene], "tuple[Figure, str] | None"]


def _law(effect: EffectFinding, k: int, scene: _Scene) -> tuple[Markup, str] | None:
    """The drawing of an effect's law and what it shows; None for effects that are just a number."""
    values = {name: p.value for name, p in effect.parameters.items()}
    wanted = _LAWS.get(effect.name)
    if wanted is None or not set(wanted[1]) <= set(values):
        return None
    if effect.name == "uneven_support":
        values["ci90"] = effect.parameters["weights"].ci90
    drawn = wanted[0](values, scene)
    if drawn is None:
        return None
    return _svg(drawn[0], f"law {k}", f"Law of {effect.name}"), drawn[1]


def _curve(scene: _Scene, fastest: float, across: str, up: str) -> tuple[Figure, Axes, Array]:
    """Axes over speed, with a tick at each speed that these pushes had; speeds (n,) [m/s]."""
    seen = [w.speed for w in scene.wrenches if math.isfinite(w.speed)]
    top = 1.05 * max([fastest, *seen])
    figure = Figure(figsize=(3.5, 2.4))
    axes = figure.add_axes((0.17, 0.19, 0.79, 0.76))
    axes.set(xlabel=across, ylabel=up, xlim=(0.0, top))
    axes.grid()
    axes.plot(seen, np.full(len(seen), 0.015), "|", color=CONTACT, alpha=0.6, markersize=6,
              transform=axes.get_xaxis_transform())  # fmt: skip
    return figure, axes, np.linspace(0.0, top, 90)


_TICKS = " Ticks: speeds of the object in these pushes."


def _ticks(scene: _Scene) -> str:
    return _TICKS if scene.wrenches else ""


def _stribeck(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
    mu = scene.friction or 1.0
    up = "friction with the table" if scene.friction else "friction over the plain cell's"
    figure, axes, speeds = _curve(scene, 3.0 * p["speed"], "slip [m/s]", up)
    axes.plot(speeds, mu * (1.0 + p["excess"] * np.exp(-((speeds / p["speed"]) ** 2))), color=AFTER, linewidth=1.8)
    axes.axhline(mu, color=BEFORE, linewidth=1.0, linestyle="--")
    axes.set_ylim(0.0, 1.15 * mu * (1.0 + max(0.0, p["excess"])))
    return figure, "Friction over slip; dashed: what it falls to." + _ticks(scene)


def _drag(power: int) -> _Law:
    """Drag in proportion to a power of speed."""

    def draw(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
        figure, axes, speeds = _curve(scene, 0.1, "speed [m/s]", "drag [N]")
        axes.plot(speeds, p["coefficient"] * speeds**power, color=AFTER, linewidth=1.8)
        axes.set_ylim(bottom=0.0)
        return figure, "Drag over the object's speed." + _ticks(scene)

    return draw


def _ellipse(frame: str) -> _Law:
    """The limit curve of friction: an ellipse about that of the plain cell, a circle."""

    def draw(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
        mu = scene.friction or 1.0
        turn = np.linspace(0.0, 2.0 * math.pi, 121)
        low, high = mu / math.sqrt(p["ratio"]), mu * math.sqrt(p["ratio"])
        c, s = math.cos(p["angle"]), math.sin(p["angle"])
        x, y = low * np.cos(turn), high * np.sin(turn)
        figure = Figure(figsize=(3.5, 3.0))
        axes = figure.add_axes((0.17, 0.15, 0.79, 0.82))
        axes.plot(mu * np.cos(turn), mu * np.sin(turn), color=BEFORE, linewidth=1.0, linestyle="--")
        axes.plot(c * x - s * y, s * x + c * y, color=AFTER, linewidth=1.8)
        axes.plot([-c * low, c * low], [-s * low, s * low], color=AFTER, linewidth=0.8, linestyle=":")
        reach = 1.1 * max(low, high)
        _ground(axes, (-reach, -reach, reach, reach), 0.79 * 3.5 / (0.82 * 3.0))
        axes.set(xlabel=f"along x of the {frame}", ylabel=f"along y of the {frame}")
        return figure, "Friction by the direction it pulls in; dashed: alike in all; dotted: the slippery axis."

    return draw


def _patch(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
    box, x, y, r = _box(scene, scene.shown), MM * p["x"], MM * p["y"], MM * p["radius"]
    wide = (min(box[0], x - 0.5 * r), min(box[1], y - 0.5 * r), max(box[2], x + 0.5 * r), max(box[3], y + 0.5 * r))
    figure, axes = _map(wide, 3.5, 3.5)
    _draw_recorded(axes, scene, 0.12)
    colour = CONTACT if p["ratio"] > 1.0 else AFTER
    axes.add_patch(Circle((x, y), r, facecolor=colour, alpha=0.18, linewidth=0))
    axes.add_patch(Circle((x, y), r, facecolor="none", edgecolor=colour, linewidth=1.4))
    return figure, f"In the circle friction is {_number(p['ratio'])} times that of the rest of the table."


def _gradient(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
    box = _box(scene, scene.shown)
    figure, axes = _map(box, 3.5, 3.5)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 9), np.linspace(low, high, 9))
    factor = 1.0 + (p["slope_x"] * x + p["slope_y"] * y) / MM
    if np.ptp(factor) > 0.0:
        axes.contourf(x, y, factor, levels=10, cmap="PuOr_r", alpha=0.5, zorder=0)
    _draw_recorded(axes, scene, 0.1)
    slope = np.array([p["slope_x"], p["slope_y"]])
    along = slope / max(float(np.hypot(*slope)), 1e-12)
    reach = 0.38 * min(right - left, high - low)
    for step in (-1.0, 0.0, 1.0):
        at = np.array([0.5 * (left + right), 0.5 * (low + high)]) + step * reach * along
        text = f"× {1.0 + float(slope @ at) / MM:.2f}"
        axes.text(at[0], at[1], text, ha="center", va="center", fontweight="bold", zorder=5)
    axes.set(xlim=(left, right), ylim=(low, high))
    return figure, "Friction over that at the table's origin."


def _field(axes: Axes, force: Callable[[Array], Array]) -> bool:
    """Arrows of a force on a grid; ``force`` takes places (n, 2) [m]. False where there is none."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = (np.linspace(a, b, 8)[:-1] + (b - a) / 14.0 for a, b in ((left, right), (low, high)))
    at = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    forces = force(at / MM)
    largest = float(np.hypot(*forces.T).max())
    if not largest > 0.0 or not math.isfinite(largest):
        return False
    axes.quiver(at[:, 0], at[:, 1], forces[:, 0], forces[:, 1], angles="xy", scale_units="xy",
                scale=largest / ((right - left) / 8.0), width=0.008, color=AFTER, pivot="middle")  # fmt: skip
    return True


def _tilt(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
    figure, axes = _map(_box(scene, scene.shown), 3.5, 3.5)
    _draw_recorded(axes, scene, 0.12)
    slope = np.array([math.sin(p["x"]), math.sin(p["y"])])
    _field(axes, lambda at: np.tile(slope, (len(at), 1)))
    steep, towards = math.degrees(math.hypot(p["x"], p["y"])), math.degrees(math.atan2(p["y"], p["x"]))
    return figure, f"Downhill: {_number(steep)}° steep, towards {_number(towards)}° from x."


def _spring(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
    rest = p.get("rest_length", 0.0)

    def force(at: Array) -> Array:
        away = np.array([p["x"], p["y"]]) - at
        distance = np.maximum(np.hypot(*away.T), 1e-9)
        return np.asarray((np.maximum(0.0, distance - rest) / distance)[:, None] * away)

    return _pull(p, scene, force, "Pull of the spring; longest arrow: strongest.")


def _magnet(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str]:
    def force(at: Array) -> Array:
        away = np.array([p["x"], p["y"]]) - at
        square = (away**2).sum(axis=1)
        return np.asarray((1.0 / (square + p["core"] ** 2) / np.sqrt(np.maximum(square, 1e-12)))[:, None] * away)

    return _pull(p, scene, force, "Pull towards the point; longest arrow: strongest.")


def _pull(p: Mapping[str, Any], scene: _Scene, force: Callable[[Array], Array], caption: str) -> tuple[Figure, str]:
    """A pull towards a point, which is shown where it is not far off."""
    box, x, y = _box(scene, scene.shown), MM * p["x"], MM * p["y"]
    reach = max(box[2] - box[0], box[3] - box[1])
    near = box[0] - reach < x < box[2] + reach and box[1] - reach < y < box[3] + reach
    pad = 0.06 * reach
    if near:
        box = (min(box[0], x - pad), min(box[1], y - pad), max(box[2], x + pad), max(box[3], y + pad))
    figure, axes = _map(box, 3.5, 3.5)
    _draw_recorded(axes, scene, 0.12)
    _field(axes, force)
    if near:
        axes.plot(x, y, "o", color=CONTACT, markersize=6, zorder=4)
        return figure, caption + " Dot: where it is fixed."
    return figure, caption + f" It is fixed beyond the view, at ({_number(p['x'])}, {_number(p['y'])}) m."


def _pressure(p: Mapping[str, Any], scene: _Scene) -> tuple[Figure, str] | None:
    """The grid of weights under the object: rows along x of B, columns along y."""
    weights = np.asarray(p["weights"], dtype=np.float64)
    if weights.ndim != 2 or weights.size < 2:
        return None
    half = np.array([1.0, 1.0]) if scene.outline is None else MM * np.abs(scene.outline).max(axis=0)
    x, y = (np.linspace(-h, h, n + 1) for h, n in zip(half.tolist(), weights.shape, strict=True))
    figure, axes = _map((-half[0], -half[1], half[0], half[1]), 3.8, 3.6)
    axes.grid(visible=False)
    axes.pcolormesh(x, y, weights.T, cmap="Blues", vmin=0.0, vmax=1.35 * float(weights.max()), edgecolors="white")
    ends = np.asarray(p["ci90"], dtype=np.float64)
    for i, j in np.ndindex(weights.shape):
        at = 0.5 * (x[i] + x[i + 1]), 0.5 * (y[j] + y[j + 1])
        dark = "white" if weights[i, j] > 0.8 * weights.max() else INK
        axes.annotate(
            f"{weights[i, j]:.2f}", at, (0, 1), textcoords="offset points", ha="center", fontsize=9, color=dark
        )
        if ends.shape == (2, *weights.shape):
            text = f"{ends[0, i, j]:.2f} to {ends[1, i, j]:.2f}"
            axes.annotate(text, at, (0, -9), textcoords="offset points", ha="center", fontsize=6.5, color=dark)
    axes.set(xlabel="x of the object [mm]", ylabel="y of the object [mm]")
    return figure, "Pressure under the object over its mean, with 90 % intervals."


_LAWS: dict[str, tuple[_Law, tuple[str, ...]]] = {
    "stribeck_friction": (_stribeck, ("excess", "speed")),
    "viscous_drag": (_drag(1), ("coefficient",)),
    "quadratic_drag": (_drag(2), ("coefficient",)),
    "anisotropic_table": (_ellipse("table"), ("ratio", "angle")),
    "anisotropic_object": (_ellipse("object"), ("ratio", "angle")),
    "friction_patch": (_patch, ("ratio", "x", "y", "radius")),
    "friction_gradient": (_gradient, ("slope_x", "slope_y")),
    "table_tilt": (_tilt, ("x", "y")),
    "tether": (_spring, ("stiffness", "x", "y")),
    "magnet": (_magnet, ("strength", "x", "y", "core")),
    "uneven_support": (_pressure, ("weights",)),
}


# The page.

_CSS = """
:root { --ink: #1c2330; --muted: #667085; --rule: #dfe3ea; --paper: #f6f7f9; --before: #98a1b0; --after: #2563c9;
  --contact: #b4540a; --free: #0f766e; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; color: var(--ink); background: #fff; overflow-wrap: break-word;
  font: 15px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 36px 28px 60px; }
h1 { font-size: 31px; line-height: 1.25; font-weight: 650; letter-spacing: -.012em; margin: 14px 0 12px;
  max-width: 32em; text-wrap: balance; overflow-wrap: anywhere; }
h2 { font-size: 20px; line-height: 1.3; font-weight: 650; margin: 52px 0 6px; padding-top: 18px;
  border-top: 1px solid var(--rule); }
h3 { font-size: 16px; font-weight: 650; margin: 0; } h4 { font-size: 13px; font-weight: 600; margin: 0 0 4px; }
p { margin: 6px 0 10px; max-width: 46em; } .muted, figcaption, .note { color: var(--muted); }
.note, figcaption { font-size: 13px; line-height: 1.45; } figcaption { margin-top: 6px; }
.kicker { color: var(--muted); font-size: 13px; margin: 0; } .badge { display: inline-block; color: #fff;
  font-size: 13px; font-weight: 650; letter-spacing: .03em; padding: 3px 12px; border-radius: 20px;
  margin-right: 10px; }
.figures { display: flex; flex-wrap: wrap; gap: 10px; margin: 24px 0 0; }
.figures div { background: var(--paper); border-radius: 8px; padding: 10px 16px 11px; flex: 1 1 160px; }
.figures b { display: block; font-size: 20px; line-height: 1.3; font-weight: 600;
  font-variant-numeric: tabular-nums; }
.figures span { color: var(--muted); font-size: 12.5px; line-height: 1.35; display: block; }
.card { border: 1px solid var(--rule); border-radius: 10px; padding: 18px 20px; margin: 14px 0; }
.found { display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 370px); gap: 26px; align-items: start; }
.found.plain { grid-template-columns: minmax(0, 1fr); }
.columns { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 24px; margin-top: 12px; }
.columns.single { grid-template-columns: minmax(0, 620px); }
.grid { display: grid; grid-template-columns: repeat(4, minmax(0, 1fr)); gap: 22px 18px; margin-top: 14px; }
.chip { display: inline-block; background: var(--paper); border: 1px solid var(--rule); border-radius: 20px;
  font-size: 12.5px; line-height: 1.4; padding: 1px 10px; margin: 2px 4px 2px 0; }
.probability { display: inline-block; vertical-align: middle; width: 90px; height: 6px; border-radius: 3px;
  background: var(--rule); overflow: hidden; margin: 0 8px; }
.probability i { display: block; height: 100%; background: var(--after); }
figure { margin: 0; min-width: 0; } svg { display: block; width: 100%; height: auto; }
svg * { stroke-linejoin: round; } svg text { font-family: inherit !important; }
.key { font-size: 13px; color: var(--muted); margin: 4px 0 0; max-width: none; }
.key span { display: inline-block; margin-right: 16px; }
.key i { display: inline-block; width: 18px; height: 4px; border-radius: 2px; vertical-align: middle;
  margin-right: 6px; }
.key i.square { width: 12px; height: 12px; } .key i.thin { height: 2px; }
.key i.band { height: 12px; background: #e6e9ee; }
.key i.dotted { height: 0; border-top: 2px dotted var(--free); border-radius: 0; }
.wide { overflow-x: auto; margin: 10px 0; }
table { border-collapse: collapse; font-size: 14px; line-height: 1.4; font-variant-numeric: tabular-nums; }
.wide table { min-width: 100%; } .wide.fits table { min-width: 0; }
th { text-align: left; color: var(--muted); font-weight: 500; font-size: 12.5px; vertical-align: bottom; }
th, td { padding: 6px 18px 6px 0; border-bottom: 1px solid var(--rule); vertical-align: top; }
tr:last-child td { border-bottom: 0; } td.n, th.n { text-align: right; white-space: nowrap; }
td.v { white-space: nowrap; } td.why { min-width: 13em; } tr.found-row td { background: #eef4fd; }
tr.found-row td:first-child { font-weight: 650; box-shadow: -8px 0 0 #eef4fd; }
.gain { display: inline-block; width: 64px; height: 6px; border-radius: 3px; overflow: hidden;
  background: var(--paper); margin-right: 8px; vertical-align: middle; }
.gain + b { font-weight: inherit; display: inline-block; min-width: 4em; }
.gain i { display: block; height: 100%; background: var(--before); }
.bars { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: 7px 14px; margin: 12px 0;
  font-size: 13px; line-height: 1.2; align-items: center; font-variant-numeric: tabular-nums; }
.bars > span { max-width: 30vw; overflow-wrap: anywhere; }
.bar { display: flex; align-items: center; gap: 7px; height: 14px; padding-right: 4.5em; }
.bar i { display: block; height: 9px; border-radius: 2px; min-width: 2px; flex: none; }
.bar b { font-weight: 400; color: var(--muted); font-size: 12px; }
.before { background: var(--before); } .after { background: var(--after); }
details { margin: 10px 0; } summary { cursor: pointer; color: var(--after); font-size: 14px; }
dl { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: 4px 18px; margin: 10px 0;
  font-size: 14px; }
dt { color: var(--muted); } dd { margin: 0; font-variant-numeric: tabular-nums; }
.warnings { background: #fff7e8; border-radius: 8px; padding: 10px 18px 10px 34px; margin: 12px 0; font-size: 14px; }
@media (max-width: 980px) { .grid { grid-template-columns: repeat(2, minmax(0, 1fr)); } }
@media (max-width: 700px) {
  main { padding: 22px 16px 44px; } h1 { font-size: 23px; } h2 { margin-top: 38px; }
  .found, .columns, .next { grid-template-columns: minmax(0, 1fr) !important; gap: 16px; } .card { padding: 14px; }
  .figures div { flex: 1 1 40%; padding: 9px 12px; } .figures b { font-size: 17px; }
  th, td { padding-right: 12px; } .gain { display: none; }
}
@media (max-width: 480px) { .grid { grid-template-columns: minmax(0, 1fr); } }
@media print { main { max-width: none; padding: 0; } .card, figure { break-inside: avoid; } }
"""

_PAGE = """
{%- macro key(colour, text, kind="") -%}
<span><i class="{{ kind }}"{% if colour %} style="background:{{ colour }}"{% endif %}></i>{{ text }}</span>
{%- endmacro -%}
{%- macro ranks(rows) -%}
<div class="wide"><table><tr><th>effect</th><th class="n">score gain</th><th class="n">p</th>
<th class="n">held-out gain</th><th>why</th></tr>
{% for r in rows %}
<tr{% if r.found %} class="found-row"{% endif %}><td>{{ r.name }}</td>
<td class="n"><span class="gain"><i style="width:{{ r.width }}%"></i></span><b>{{ r.gain }}</b></td>
<td class="n">{{ r.p }}</td>
<td class="n">{{ r.held_out }}</td><td class="why">{{ r.why }}</td></tr>
{% endfor %}
</table></div>
{%- endmacro -%}
<!DOCTYPE html>
<html lang="en-GB"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ d.recording }}: {{ d.verdict }}</title>
<style>{{ style }}</style></head>
<body><main>
<header>
<p class="kicker">Diagnosis of <b>{{ d.recording }}</b>, {{ pushes }} push{{ "" if pushes == 1 else "es" }}</p>
<h1>{{ d.sentence }}</h1>
<p style="max-width:none"><span class="badge" style="background:{{ badge }}">{{ d.verdict }}</span>{{ meaning }}</p>
<div class="figures">
<div><b>{{ d.p_value | tiny }}</b><span>probability of so much mismatch if the plain cell were right; a mismatch is
claimed below {{ d.alpha | number }}</span></div>
{% set fit = d.fit %}
<div><b>{{ (1e3 * fit.position_before) | fixed }}
{{ ("→ " ~ (1e3 * fit.position_after) | fixed) if d.effects }} mm</b><span>position error of pushes left out of the
fit{{ ", before and after" if d.effects }}</span></div>
<div><b>{{ fit.rotation_before | degrees }}{{ (" → " ~ fit.rotation_after | degrees) if d.effects }}°</b>
<span>rotation error of pushes left out of the fit{{ ", before and after" if d.effects }}</span></div>
<div><b>{{ d.reduced_chi2_before | fixed }}{{ (" → " ~ d.reduced_chi2_after | fixed) if d.effects }}</b>
<span>misfit over what noise leaves; 1 is noise alone</span></div>
</div>
</header>

<section><h2>What was found</h2>
{% for e in found %}
<div class="card found{% if not e.figure %} plain{% endif %}"><div>
<h3>{{ e.name }} <span class="chip">{{ e.element }}</span></h3>
<p>{{ e.statement[:1] | upper }}{{ e.statement[1:] }}.</p>
<p class="note">Probability that the name is right, among those of the catalogue:
<span class="probability"><i style="width:{{ e.width }}%"></i></span>{{ e.probability }}</p>
<p class="note">{% if e.alike %}These pushes cannot tell it from
{% for name in e.alike %}<span class="chip">{{ name }}</span>{% endfor %}
{% else %}No other effect of the catalogue explains these pushes as well.{% endif %}</p>
<div class="wide"><table><tr><th>parameter</th><th>value</th><th>90 % interval</th><th>without it</th></tr>
{% for name, value, interval, null in e.parameters %}
<tr><td>{{ name }}</td><td class="v">{{ value }}</td><td>{{ interval }}</td><td class="v">{{ null }}</td></tr>
{% endfor %}
</table></div></div>
{% if e.figure %}<figure>{{ e.figure }}<figcaption>{{ e.caption }}</figcaption></figure>{% endif %}
</div>
{% else %}
<p>No effect of the catalogue is claimed.</p>
{% endfor %}
<p>Left over: {{ d.left }}.</p>
</section>

<section><h2>Where it is</h2>
<div class="{{ "columns" if arrows else "" }}"><div>
{% if d.location %}
<p>{{ d.location.statement[:1] | upper }}{{ d.location.statement[1:] }}.</p>
<dl><dt>when</dt><dd>{% for x in phases %}<span class="chip">{{ x }}</span>{% endfor %}</dd>
<dt>in what</dt><dd>{% for x in dofs %}<span class="chip">{{ x }}</span>{% endfor %}</dd>
<dt>frame</dt><dd><span class="chip">{{ frame }}</span></dd></dl>
{% if d.location.windows %}
<h4>Where most is missing</h4>
<div class="wide fits"><table><tr><th>push</th><th class="n">from [s]</th><th class="n">to [s]</th></tr>
{% for w in d.location.windows %}
<tr><td>{{ w.push }}</td><td class="n">{{ "%.2f" % w.start }}</td><td class="n">{{ "%.2f" % w.end }}</td></tr>
{% endfor %}
</table></div>{% endif %}
{% elif d.verdict in ("consistent", "underpowered") %}<p>There is no mismatch to place.</p>
{% else %}<p>No phase, direction or frame stands out beyond chance.</p>{% endif %}
</div>
{% if arrows %}
<figure>{{ arrows }}<figcaption>The force that is missing from the plain cell, on the table from above; faint where
it is within two standard deviations. Thin lines: recorded paths, and the object at their ends.</figcaption></figure>
{% endif %}
</div>
{% if strips %}
<h3 style="margin-top:30px">What is missing over time</h3>
<p class="key">{{ key(colours.contact, "while it is pushed", "square") }}
{{ key(colours.free, "in its free slide", "square") }}
<span>bars: pale within two standard deviations, which the lines show</span><span>▾ where most is missing</span></p>
<div class="grid">
{% for name, figure in strips %}<figure><h4>{{ name }}</h4>{{ figure }}</figure>
{% endfor %}
</div>
{% if more_strips %}
<details><summary>{{ more_strips | length }} more push{{ "" if more_strips | length == 1 else "es" }}</summary>
<div class="grid">
{% for name, figure in more_strips %}<figure><h4>{{ name }}</h4>{{ figure }}</figure>
{% endfor %}
</div></details>{% endif %}
<p class="note">Along and across the object's motion (positive: forwards, to its left), and torque (positive:
anticlockwise), on the same scales in all pushes.
{% if left_out %}{{ left_out }} more pushes are not drawn.{% endif %}</p>
{% endif %}
</section>

{% if views %}
<section><h2>Recorded and simulated</h2>
<p>Each push as predicted while it was left out of the fit, on top of what was recorded.</p>
<p class="key">{{ key(colours.ink, "recorded", "thin") }}{{ key(colours.before, "simulated, plain cell") }}
{% if d.effects %}{{ key(colours.after, "simulated, with what is missing") }}{% endif %}</p>
<div class="columns{{ " single" if views | length == 1 }}">
{% for title, figure in views %}<figure><h4>{{ title[:1] | upper }}{{ title[1:] }}</h4>{{ figure }}</figure>
{% endfor %}
</div>
<h3 style="margin-top:30px">{% if d.effects %}The pushes that change most{% else %}The pushes that are predicted worst
{% endif %}</h3>
<p class="key">{{ key("", "± 2 standard deviations of one tracker sample", "band") }}
{{ key("", "the hand lets go", "dotted") }}</p>
<div class="grid">
{% for name, figure in errors %}<figure><h4>{{ name }}</h4>{{ figure }}</figure>
{% endfor %}
</div>
<p class="note">Above: the path, and the object at its end. Below: simulated minus recorded over time.</p>
</section>
{% endif %}

<section><h2>How well pushes are predicted that were left out</h2>
<div class="columns"><div>
<div class="wide fits"><table><tr><th>model</th><th class="n">mm</th><th class="n">deg</th><th class="n">sigmas</th>
<th class="n">misfit</th></tr>
{% for name, cells in fits %}
<tr><td>{{ name }}</td>{% for c in cells %}<td class="n">{{ c }}</td>{% endfor %}</tr>
{% endfor %}
</table></div>
<p class="note">Root mean square; sigmas: in standard deviations of the tracker; misfit: of all pushes, over what
noise leaves.{% if d.effects %} Log score of pushes left out: {{ fit.log_score_gain | number }}
± {{ fit.log_score_gain_se | number }} better.{% endif %}</p>
</div><div>
<h4>Error of each push [sigmas]</h4>
<div class="bars">
{% for row in bars %}<span>{{ row.name }}</span><div>
{% for kind, width, value in row.bars %}
<div class="bar"><i class="{{ kind }}" style="width:{{ width }}%"></i><b>{{ value }}</b></div>
{% endfor %}
</div>
{% endfor %}
</div></div></div>
</section>

<section><h2>{{ "Why the others lose" if d.effects else "The catalogue, best first" }}</h2>
{% if ranking %}
<p class="note">Score gain: how much of the plain cell's misfit an effect could take away; held-out gain: by how much
it predicts pushes better that were left out, where it was worth a fit.</p>
{{ ranks(ranking) }}
{% if more_ranking %}<details><summary>{{ more_ranking | length }} more</summary>
{{ ranks(more_ranking) }}</details>{% endif %}
{% else %}<p>No effect was looked at.</p>{% endif %}
{% if d.detectable %}
<details><summary>What these pushes would have shown</summary>
<p class="note">The smallest effect of each kind that would have been seen, and the motion that it makes.</p>
<div class="wide"><table><tr><th>effect</th><th>parameter</th><th class="n">smallest</th>
<th class="n">motion [sigmas]</th></tr>
{% for x in d.detectable %}
<tr><td>{{ x.name }}</td><td>{{ x.parameter }}</td><td class="n">{{ x.value | quantity(x.unit) }}</td>
<td class="n">{{ x.sigmas | number(2) }}</td></tr>
{% endfor %}
</table></div></details>{% endif %}
</section>

<section><h2>Parameters</h2>
<div class="wide"><table><tr><th>parameter</th>{% if d.effects %}<th>plain cell</th><th>with what is missing</th>
{% else %}<th>plain cell</th>{% endif %}<th>90 % interval</th></tr>
{% for t in theta %}
<tr><td>{{ t.name }}</td>{% if d.effects %}<td class="v{% if not t.told %} muted{% endif %}">{{ t.before }}</td>
{% endif %}
<td class="v{% if not t.told %} muted{% endif %}">{{ t.after }}</td><td class="v">{{ t.interval }}</td></tr>
{% endfor %}
</table></div></section>

{% if d.next_push %}
<section><h2>The next push</h2>
<div class="next" style="display:grid;grid-template-columns:minmax(0,1fr) minmax(0,320px);gap:26px">
<div><p>The push that would tell most: towards {{ d.next_push.direction_deg | number }}° from x of the table, at
{{ (1e3 * d.next_push.speed_mps) | number }} mm/s, {{ (1e3 * d.next_push.contact_offset_m) | abs | number }} mm
{{ "left" if d.next_push.contact_offset_m > 0 else "right" }} of the middle.</p>
<p>It would settle the question with probability {{ d.next_push.settles_with_probability | chance }}.</p></div>
{% if next_push %}
<figure>{{ next_push }}<figcaption>The object's axes along the table's.</figcaption></figure>
{% endif %}
</div></section>
{% endif %}

<section><h2>Noise and circumstances</h2>
{% if warnings %}<ul class="warnings">
{% for w in warnings %}<li>{{ w }}</li>
{% endfor %}
</ul>{% endif %}
<dl>{% for name, value in noise %}<dt>{{ name }}</dt><dd>{{ value }}</dd>
{% endfor %}<dt>seed</dt><dd>{{ d.seed }}</dd><dt>rollouts</dt><dd>{{ d.rollouts }}</dd></dl>
<p class="note">Noise: one standard deviation.</p>
</section>
</main></body></html>
"""
