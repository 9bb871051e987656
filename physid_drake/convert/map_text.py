"""The lines of a first map, with their doubts as comments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.convert.bodies import Body, filled, up_of
from physid_drake.convert.columns import Columns
from physid_drake.convert.names import unit_of
from physid_drake.convert.units import FORCES, LENGTHS, likely_length, symbol_of

FAR_AWAY: Final = 0.3
"""m from the table's top, along the vertical: the source's frame is that of a camera."""

_OTHERS: Final = {"wxyz": "xyzw", "xyzw": "wxyz", "matrix": "inverse: true, if it is written column by column"}


@dataclass(frozen=True, kw_only=True)
class Guess:
    """A first map, and what the log holds.

    Attributes:
        text: of the map.
        rows: of a table for the terminal: name, samples, rate [Hz], least, largest.
    """

    text: str
    rows: tuple[tuple[str, ...], ...]


def head_lines(source: Path, body: Body | None, columns: Columns, has_hand: bool) -> list[str]:
    """The description of the recording, and which axis is up."""
    world = [] if body is None else _world_lines(body, columns)
    hand = ["  hand: {tip: sphere, radius_m: 0.01, stream: measured}   # CHANGE: the tip's shape and size"]
    return [
        f"# A first map of {source.name}. Lines with CHANGE need your knowledge; the others are worth a look.",
        "# Every key: docs/bring_your_data.md",
        "format: physid-map/1",
        "recording:",
        f"  name: {quoted(source.stem)}",
        "  object: {shape: box, size_m: [0.1, 0.1, 0.1]}   # CHANGE: measure it; mass_kg: if you weighed it",
        "  table: {size_m: [1.2, 0.8], centre_m: [0, 0]}   # CHANGE: its size, and where its middle is in W",
        *(hand if has_hand else []),
        *world,
    ]


def _world_lines(body: Body, columns: Columns) -> list[str]:
    """Which axis is up: the one along which the object hardly moves; where the table's top is nobody knows."""
    up = up_of(body.position, columns)
    if up is None:
        return []
    axes = {0: "[y, z, x]", 1: "[z, x, y]", 2: "[x, y, z]"}[up]
    if len(body.position) < len("xyz"):
        return [f"# The object has no {'xyz'[up]}, which is taken for up.", f"world: {{axes: {axes}}}"]
    height = LENGTHS[body.unit or "m"] * float(np.median(filled(body.position, columns)[:, up]))
    return [
        f"# {'xyz'[up]} of the object changes least, and is taken for up. It is {height:.4g} m: unless that is",
        "# how high the object's middle is above the table, give origin, too.",
        *(
            ["# So far away, the frame may be a camera's: then give its pose in W instead (world: {pose: ...})."]
            if abs(height) > FAR_AWAY
            else []
        ),
        f"world: {{axes: {axes}}}",
    ]


def set_units(bodies: Sequence[Body], columns: Columns) -> str:
    """Gives all bodies a unit of length: the header's, else one that fits a table; the doubt that is left."""
    stated = next((body.unit for body in bodies if body.unit in LENGTHS), columns.length)
    values = [columns.numbers[name] for body in bodies for name in body.position]
    likely = likely_length(np.concatenate(values) if values else np.zeros(0))
    for body in bodies:
        body.unit = body.unit if body.unit in LENGTHS else stated or likely
    return "" if stated else "   # m, cm, inch or mm?"


def pose_lines(key: str, body: Body | None, columns: Columns, doubt: str, own: Sequence[str]) -> list[str]:
    """What a map says of the object or the hand; ``own`` are lines on where its columns are."""
    if body is None:
        return [
            f"{key}:",
            '  position: {columns: ["?", "?", "?"], unit: m}   # CHANGE: no columns look like places',
            "  rotation: none",
        ]
    lines = [
        f"{key}:   # {body.name}",
        *(f"  {line}" for line in own),
        f"  position: {{columns: {listed(body.position)}, unit: {body.unit}}}{body.doubt or doubt}",
    ]
    if not body.rotation:
        lines.append("  rotation: none" + ("   # is it nowhere in the log?" if key == "object" else ""))
    elif body.kind in ("wxyz", "xyzw", "matrix"):
        other = "" if body.sure else f"   # or {_OTHERS[body.kind]}?"
        lines.append(f"  rotation: {{columns: {listed(body.rotation)}, as: {body.kind}}}{other}")
    else:
        values = np.concatenate([columns.numbers[name] for name in body.rotation])
        likely = "deg" if np.nanmax(np.abs(values), initial=0.0) > 2.5 * np.pi else "rad"
        unit = symbol_of(columns.unit_of(body.rotation[0]) or likely)
        order = f", order: {body.order}" if body.kind == "euler" else ""
        lines.append(
            f"  rotation: {{columns: {listed(body.rotation)}, as: {body.kind}{order}, unit: {unit}}}   # deg or rad?"
        )
    if len(body.position) == 2:
        lines.append("  height_m: 0.05   # CHANGE: of its middle above the table, which nobody measured")
    return lines


def force_lines(force: Body, columns: Columns, own: Sequence[str]) -> list[str]:
    """What a map says of the force; ``own`` says where its columns are."""
    stated = (unit_of(name, columns)[1] for name in force.force)
    unit = next((one for one in stated if one in FORCES), "N")
    return [
        f"force: {{{''.join(f'{key}, ' for key in own)}columns: {listed(force.force)}, unit: {unit},"
        " axes: world, acts_on: object}"
        "   # or axes: hand, acts_on: hand? tare_s: 0.2 takes an offset away"
    ]


def quoted(name: str) -> str:
    """A name as YAML takes it, whatever is in it."""
    return '"' + name.replace("\\", "\\\\").replace('"', '\\"') + '"'


def listed(names: Sequence[str]) -> str:
    """Names as a list of YAML."""
    return "[" + ", ".join(map(quoted, names)) + "]"
