"""SDFormat with Drake's contact properties, and model directives that put object, table and hand together."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from physid_drake.cell.diagram import (
    DRIVEN_DISSIPATION,
    DRIVEN_FREQUENCY,
    DRIVEN_MASS,
    GRAVITY,
    TABLE_FRICTION,
    paired_friction,
)
from physid_drake.export.parts import TILE, Parts, facets_obj, prism_obj
from physid_drake.export.templates import filled

PACKAGE: Final = "physid_export"
FACETS: Final = 60  # about, of the underside
SINKAGE: Final = 1e-5  # m: how deep the object stands in the table
SLAB: Final = 0.05  # m: thickness of the table
HAND_RATE: Final = 1000.0  # rad/s: natural frequency of the object on the tip


def drake_files(parts: Parts, ratio: float) -> dict[str, str]:
    """``object.sdf``, ``table.sdf``, ``hand.sdf``, ``scene.dmd.yaml``, ``package.xml`` and meshes.

    Args:
        parts: of the model.
        ratio: static over kinetic support friction [-].
    """
    bottom, top = -0.5 * parts.solid.height, 0.5 * parts.solid.height
    meshes = {
        f"underside_{k}.obj": facets_obj(tile.corners, bottom, math.sqrt(parts.area / FACETS))
        for k, tile in enumerate(parts.tiles)
    } | {f"side_{k}.obj": prism_obj(side, bottom + TILE, top) for k, side in enumerate(parts.sides)}
    low, high = np.array(parts.table)
    x0, y0, _, y1 = parts.solid.outline.extent()
    weight = GRAVITY * parts.mass
    values = {
        "p": parts, "package": PACKAGE, "rough": f"{TABLE_FRICTION:g}", "ratio": ratio, "slab": SLAB,
        "tiles": [(f"underside_{k}.obj", paired_friction(t.friction)) for k, t in enumerate(parts.tiles)],
        "sides": [f"side_{k}.obj" for k in range(len(parts.sides))],
        "hand": paired_friction(parts.hand_friction), "roll_friction": paired_friction(parts.friction),
        "stiffness": parts.mass * HAND_RATE**2, "dissipation": DRIVEN_DISSIPATION, "sinkage": SINKAGE,
        "half_pi": 0.5 * np.pi, "long": y1 - y0, "mass": DRIVEN_MASS, "rate": DRIVEN_FREQUENCY,
        "axes": [("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1")],
        "x": 0.5 * (low[0] + high[0]), "y": 0.5 * (low[1] + high[1]), "wide": high[0] - low[0],
        "deep": high[1] - low[1],
        # Pressure grows from nothing at the faces to the modulus at half the slab's thickness.
        "modulus": 1e5 if parts.rolls else weight / parts.area * 0.5 * SLAB / SINKAGE,
        "clear": x0 - parts.hand_radius - 0.05,
    }  # fmt: skip
    files = ("object.sdf", "table.sdf", "hand.sdf", "scene.dmd.yaml", "package.xml")
    return {file: filled(file, values) for file in files} | meshes
