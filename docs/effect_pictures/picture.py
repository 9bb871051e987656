"""A picture: the law of an effect on the left, pushes without and with it on the right."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from physid_drake.effects import Effect
from physid_drake.effects.rollout import Rollout
from physid_drake.report.svg import INK

from .drawing import HEIGHT, LEFT, PLAIN, RIGHT, WIDTH, WITH
from .scenes import Array, reports


@dc.dataclass(frozen=True, kw_only=True)
class Picture:
    """What is drawn of an effect.

    Attributes:
        effect: with the values that the picture is of.
        law: draws the left panel.
        law_title: of that.
        pushes: of the right panel.
        pushes_title: of that.
        shown: draws the right panel.
        end: of the time that is shown [s].
        rolls: whether the object is a lying cylinder.
        hand: whether the right panel has the tip.
    """

    effect: Effect
    law: Callable[[Axes, Picture], None]
    law_title: str
    pushes: tuple[Rollout, ...]
    pushes_title: str
    shown: Callable[[Axes, Picture, Array, list[Array], list[Array]], None]
    end: float = 0.8
    rolls: bool = False
    hand: bool = True

    @property
    def values(self) -> str:
        """The parameters with their units, as the page says them."""
        return said(self.effect)


def said(effect: Effect) -> str:
    """Parameters and units of an effect."""
    parts = []
    for name, unit in effect.units().items():
        value = getattr(effect, name)
        number = "as drawn" if isinstance(value, tuple) else f"{value:.3g}"
        parts.append(f"{name} {number}" + ("" if unit == "-" else f" {unit}"))
    return ", ".join(parts)


def draw(picture: Picture) -> Figure:
    """The two panels."""
    figure = Figure(figsize=(WIDTH, HEIGHT), facecolor="white")
    left, right = figure.add_axes(LEFT, label="law"), figure.add_axes(RIGHT, label="pushes")
    times = np.linspace(0.0, picture.end, 101)
    plain = reports(picture.pushes, times, rolls=picture.rolls)
    others = reports(picture.pushes, times, picture.effect, rolls=picture.rolls)
    picture.law(left, picture)
    picture.shown(right, picture, times, plain, others)
    for box, title in ((LEFT, picture.law_title), (RIGHT, picture.pushes_title)):
        figure.text(box[0], 0.935, title, fontsize=8.5, fontweight="bold", color=INK)
    figure.text(LEFT[0], 0.86, picture.values, fontsize=8.0, color=INK)
    _legend(figure, picture.hand)
    return figure


def _legend(figure: Figure, hand: bool) -> None:
    """Placed by hand: what a legend's size depends on differs between machines."""
    keys = [
        ("baseline model", 0.13, {"color": PLAIN, "linestyle": "--"}),
        ("with the effect", 0.124, {"color": WITH}),
    ]
    if hand:
        keys.append(("tip", 0.05, {"color": INK, "linestyle": ":"}))
    x = RIGHT[0]
    for text, wide, style in keys:
        figure.add_artist(Line2D([x, x + 0.03], [0.873, 0.873], linewidth=1.6, **style))
        figure.text(x + 0.036, 0.86, text, fontsize=7.5, color=INK)
        x += 0.036 + wide
