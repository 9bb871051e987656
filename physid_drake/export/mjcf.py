"""MJCF: the object on feet, each with its cell's friction, the table, and a tip that actuators move."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.diagram import DRIVEN_FREQUENCY, DRIVEN_MASS
from physid_drake.export.parts import Parts, Tile
from physid_drake.export.templates import filled

Array = NDArray[np.float64]

FEET = 60  # about: so many carry the underside as if it were whole
FOOT = 1e-3  # m: radius


def mujoco_file(parts: Parts, name: str) -> str:
    """``model.xml``; it reads the sides' meshes beside it. Actuators: x, vx, y, vy, z, vz of the tip."""
    low, high = np.array(parts.table)
    x0, y0, _, y1 = parts.solid.outline.extent()
    touched = ["roller"] if parts.rolls else [f"side_{k}" for k in range(len(parts.sides))]
    return filled("model.xml", {
        "p": parts, "name": name, "feet": feet_of(parts.tiles, parts.area), "touched": touched, "foot": FOOT,
        "mass": DRIVEN_MASS, "rate": DRIVEN_FREQUENCY, "x": 0.5 * (low[0] + high[0]), "y": 0.5 * (low[1] + high[1]),
        "wide": high[0] - low[0], "deep": high[1] - low[1], "long": y1 - y0, "clear": x0 - parts.hand_radius - 0.05,
    })  # fmt: skip


def feet_of(tiles: tuple[Tile, ...], area: float) -> list[tuple[float, float, float]]:
    """Feet x, y [m] with their friction: a square grid, so that each stands for as much of the underside."""
    if not tiles:
        return []
    every = np.vstack([tile.corners for tile in tiles])
    low, high = every.min(axis=0), every.max(axis=0)
    across = max(2, math.ceil((high[0] - low[0]) / math.sqrt(area / FEET)))
    along = max(2, math.ceil((high[1] - low[1]) / math.sqrt(area / FEET)))
    feet = []
    for i, j in np.ndindex(across, along):
        at = low + (high - low) * (np.array([i, j]) + 0.5) / (across, along)
        mu = next((tile.friction for tile in tiles if _inside(tile.corners, at)), None)
        if mu is not None:
            feet.append((float(at[0]), float(at[1]), mu))
    return feet


def _inside(corners: Array, point: Array) -> bool:
    """Whether a convex polygon (n, 2), counter-clockwise, holds a point (2,)."""
    edges, away = np.roll(corners, -1, axis=0) - corners, point - corners
    return bool((edges[:, 0] * away[:, 1] - edges[:, 1] * away[:, 0] >= 0.0).all())
