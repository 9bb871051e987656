"""What an exported model is made of: tiles of the underside, sides, inertia; and what is left out."""

from __future__ import annotations

import dataclasses as dc
import math

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell.outline import Disc
from physid_drake.cell.solid import Solid, solid_of
from physid_drake.cell.support import as_polygon, clipped
from physid_drake.effects import Effect
from physid_drake.effects.rollout import Geometry, geometry_with
from physid_drake.model import Model
from physid_drake.plan.trajectory import hand_radius_of
from physid_drake.recording import convex_pieces

Array = NDArray[np.float64]

TILE = 1e-3  # m: thickness of the tiles; the sides begin above them, so that each meets one partner
BODY_SEAMS = ("reshaped", "body")
SEAMS = {
    "pressure": "an uneven pressure under the object",
    "heaviness": "mass that moves against the object",
    "laws": "forces",
    "frictions": "friction that is not one coefficient",
    "hand": "another path of the hand",
    "mount": "a compliant tip",
    "true_pose": "a tracked frame",
    "lateness": "a late tracker",
    "tracked": "what the tracker reports",
}
"""What an effect may add beside shape and body, of which neither format has any."""
LEAST_AREA = 1e-9  # m^2 of a tile


@dc.dataclass(frozen=True, kw_only=True)
class Tile:
    """A convex part (n, 2) of the underside in B [m], counter-clockwise, with its friction with the table [-]."""

    corners: Array
    friction: float


@dc.dataclass(frozen=True, kw_only=True)
class Parts:
    """A model as bodies with one material for each contact.

    Attributes:
        solid: the object's shape.
        tiles: of the underside, none of an object that rolls.
        sides: convex parts (n, 2) of the outline [m]; none of an object that rolls.
        mass: kg.
        com: (2,) centre of mass in B [m].
        moments: (3,) about the axes of B through the centre of mass [kg m^2].
        friction: with the table, the cells' mean [-].
        hand_friction: with the hand [-].
        hand_radius: of the tip [m].
        hand_height: of the tip above the table [m].
        table: lower and upper corner of its top [m].
    """

    solid: Solid
    tiles: tuple[Tile, ...]
    sides: tuple[Array, ...]
    mass: float
    com: tuple[float, float]
    moments: Array
    friction: float
    hand_friction: float
    hand_radius: float
    hand_height: float
    table: tuple[tuple[float, float], tuple[float, float]]

    @property
    def rolls(self) -> bool:
        """Whether the object is a lying cylinder."""
        return self.solid.rolling_radius is not None

    @property
    def area(self) -> float:
        """Of the underside [m^2]."""
        return sum(_area(tile.corners) for tile in self.tiles)


def parts_of(model: Model) -> tuple[Parts, list[str]]:
    """The parts of a model, and a line for each effect that no such parts express.

    Raises:
        ConfigError: if the model has no hand.
    """
    radius = hand_radius_of(model)
    cell = model.build()
    solid = solid_of(geometry_with(model.effects, Geometry(shape=model.shape)).shape)
    body = cell.body
    nx, ny = model.config.friction_cells
    frictions = np.reshape(body.support_friction, (nx, ny))
    rolls = solid.rolling_radius is not None
    height = 0.5 * solid.height if model.contact_height is None else model.contact_height
    return Parts(
        solid=solid, tiles=() if rolls else _tiles(solid, frictions), sides=() if rolls else _pieces(solid.outline),
        mass=body.mass, com=(float(body.p_BBcm[0]), float(body.p_BBcm[1])),
        moments=body.mass * body.inertia_ratio * np.array(solid.gyration),
        friction=float(frictions.mean()), hand_friction=body.hand_friction, hand_radius=radius, hand_height=height,
        table=model.table,
    ), left_out(model)  # fmt: skip


def left_out(model: Model) -> list[str]:
    """A line for each effect, or part of one, that neither format expresses."""
    lines = []
    for effect in model.effects:
        if not effect.is_null:
            missing = [words for seam, words in SEAMS.items() if _acts(effect, seam)]
            whole = not any(_acts(effect, seam) for seam in BODY_SEAMS)
            if missing:
                lines.append(f"{effect.name}: {', '.join(missing)}{'' if whole else '; its shape and body are in'}")
    body = model.body
    if solid_of(model.shape).rolling_radius is not None:
        # One collision geometry meets the table and the hand.
        lines.append(f"friction {body.hand_friction:.3g} with the hand: what rolls has the table's in SDFormat")
    if body.restitution:
        lines.append(f"restitution {body.restitution:.3g} of the hand's touch")
    if body.static_ratio > 1.0:
        lines.append(f"static friction {body.static_ratio:.3g} times the kinetic one: MJCF has one coefficient")
    return lines


def facets_obj(corners: Array, height: float, side: float) -> str:
    """OBJ of a convex polygon (n, 2) that faces down at a height [m], in facets of about a side [m].

    Drake's discrete hydroelastic contact acts at one point of each facet: two triangles would be two feet.
    """
    low, high = corners.min(axis=0), corners.max(axis=0)
    counts = np.maximum(1, np.ceil((high - low) / side)).astype(int)
    x, y = (np.linspace(a, b, n + 1).tolist() for a, b, n in zip(low, high, counts, strict=True))
    rows: list[str] = []
    faces: list[str] = []
    for i, j in np.ndindex(*counts):
        part = clipped(corners, (x[i], y[j], x[i + 1], y[j + 1]))
        if len(part) < 3 or _area(part) < LEAST_AREA:
            continue
        first = len(rows)
        rows += [f"v {a:.9g} {b:.9g} {height:.9g}" for a, b in part.tolist()]
        # Clockwise from above, so that the outward normal points down.
        faces += [f"f {first + 1} {first + k + 2} {first + k + 1}" for k in range(1, len(part) - 1)]
    return "\n".join([*rows, *faces]) + "\n"


def prism_obj(corners: Array, bottom: float, top: float) -> str:
    """Wavefront OBJ of an upright prism over a convex polygon (n, 2), counter-clockwise [m]."""
    count = len(corners)
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for z in (bottom, top) for x, y in corners.tolist()]
    ahead = [(k, (k + 1) % count) for k in range(count)]
    faces = [[count - k for k in range(count)], [count + k + 1 for k in range(count)]]
    faces += [[a + 1, b + 1, count + b + 1, count + a + 1] for a, b in ahead]
    return "\n".join([*rows, *("f " + " ".join(map(str, face)) for face in faces)]) + "\n"


def _acts(effect: Effect, seam: str) -> bool:
    return getattr(type(effect), seam) is not getattr(Effect, seam)


def _pieces(outline: object) -> tuple[Array, ...]:
    polygon = as_polygon(outline)  # type: ignore[arg-type]
    return (polygon,) if isinstance(outline, Disc) else tuple(convex_pieces(polygon))


def _tiles(solid: Solid, frictions: Array) -> tuple[Tile, ...]:
    """The underside cut along the friction cells, each piece convex."""
    x0, y0, x1, y1 = solid.underside.extent()
    nx, ny = frictions.shape
    x, y = np.linspace(x0, x1, nx + 1), np.linspace(y0, y1, ny + 1)
    tiles = []
    for i, j in np.ndindex(nx, ny):
        window = (float(x[i]), float(y[j]), float(x[i + 1]), float(y[j + 1]))
        for piece in _pieces(solid.underside):
            part = clipped(piece, window)
            if len(part) >= 3 and _area(part) > LEAST_AREA:
                tiles.append(Tile(corners=part, friction=float(frictions[i, j])))
    return tuple(tiles)


def _area(corners: Array) -> float:
    x, y = corners.T
    return 0.5 * math.fabs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
