"""``scene.html``: Meshcat's static page with its pushes, what its colours mean, and what can be switched."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from pathlib import Path

from jinja2 import Environment, StrictUndefined

from physid_drake.plan.reach import SHIPPED_TABLE
from physid_drake.report.pages import BASELINE_MEANS, SCENE, nav
from physid_drake.report.stage import (
    ARROW,
    BASELINE,
    COLOURS,
    CORRECTED,
    LOUDEST,
    MISSING,
    RECORDED,
    Act,
    Setting,
    Stage,
    view_of,
)

_TEMPLATE = Path(__file__).with_name("scene_page.html")


def scene_page(
    setting: Setting,
    acts: Sequence[Act],
    *,
    name: str,
    lines: Sequence[str] = (),
    corrected: str = "corrected",
    unit_force: float | None = None,
    pages: Collection[str] = (),
) -> str:
    """The page, which opens without a network.

    Args:
        setting: what stands on the stage.
        acts: what is played, at least one.
        name: of the recording.
        lines: sentences on what was found.
        corrected: what the corrected model is called.
        unit_force: that is drawn as long as ``ARROW`` [N]; None where no arrow is drawn.
        pages: that lie beside this one.
    """
    stage = Stage(setting)
    marks = stage.play(acts, unit_force or 1.0)
    target, offset = view_of(acts)
    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    kinds = [kind for kind in (BASELINE, CORRECTED) if kind in setting.shapes]
    words = {BASELINE: "baseline model", CORRECTED: corrected}
    panel = environment.from_string(_TEMPLATE.read_text("utf-8")).render(
        name=name, title=f"{name}: in 3D", lines=lines, marks=marks, starts=[start for _, start in marks],
        both=len(kinds) == 2, camera=offset.tolist(), switches=_switches(setting, acts),
        notes=_notes(acts, unit_force),
        models=[(kind, _css(COLOURS[kind]), words[kind]) for kind in kinds], nav=nav(SCENE, pages),
        place=target.tolist(),
    )  # fmt: skip
    html: str = stage.meshcat.StaticHtml()
    body_end = html.rindex("</body>")
    return html[:body_end] + panel + html[body_end:]


def _switches(setting: Setting, acts: Sequence[Act]) -> list[tuple[str, str, str, bool]]:
    """What can be shown and hidden: key, colour, words, whether it is shown at first."""
    (x0, y0), (x1, y1) = setting.table
    shipped = abs(x1 - x0 - SHIPPED_TABLE[0]) + abs(y1 - y0 - SHIPPED_TABLE[1]) < 1e-6
    found = []
    if RECORDED in setting.shapes:
        found.append((RECORDED, _css(COLOURS[RECORDED]), "recorded object", True))
    found.append(("paths", "", "paths", True))
    if any(act.missing for act in acts):
        found += [
            ("missing", _css(MISSING), "force missing from the baseline model", True),
            ("mismatch", _css(MISSING), "where on the table it is missing", True),
        ]
    if setting.hand is not None:
        found.append(("hand", "", "hand", True))
    return [*found, ("reach", "", "reach of the robots: Motoman blue, Baxter red", shipped)]


def _notes(acts: Sequence[Act], unit_force: float | None) -> list[str]:
    lines = [BASELINE_MEANS]
    if unit_force is not None and any(act.missing for act in acts):
        lines.append(
            f"An arrow of {1e3 * ARROW:.0f} mm is {unit_force:.2g} N; grey arrows are within two standard deviations"
            f" of zero. The darkest spots on the table are {LOUDEST:.0f} standard deviations from zero."
        )
    if any(act.goal is not None for act in acts):
        lines.append("Green: the goal of the planned push; its radius is the tolerance.")
    return lines


def _css(colour: Iterable[float]) -> str:
    red, green, blue, *_ = (round(255 * part) for part in colour)
    return f"{red}, {green}, {blue}"
