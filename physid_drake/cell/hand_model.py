"""The hand as it looks: SDF text of each kind of tip, and the visuals that it holds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import get_args

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from pydrake.geometry import Rgba, SceneGraph, Shape
from pydrake.math import RigidTransform
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from physid_drake.errors import CellError
from physid_drake.recording.values import TipShape
from physid_drake.resources import shipped

_LONG = ("cylinder", "capsule")


@dataclass(frozen=True, kw_only=True)
class Preshape:
    """How a ReFlex SF is held during a push: nothing moves in it. The default points with finger 1.

    Attributes:
        spread: turn of fingers 1 and 2 away from each other about the palm's normal, 0 to pi / 2 [rad].
        proximal: flexion of fingers 1, 2, 3 against the palm's plane, 0 (flat, outward) to pi [rad].
        distal: flexion of their distal links against the proximal ones, 0 to 2.2 [rad]. Finger 1's tip points
            straight down where its two flexions add up to pi / 2.
        yaw: turn of the whole hand about the vertical through the tip, in P [rad]; at 0 the palm lies
            on the -x side of the tip.
    """

    spread: float = 0.0
    proximal: tuple[float, float, float] = (1.25, 2.55, 2.55)
    distal: tuple[float, float, float] = (0.5 * math.pi - 1.25, 1.3, 1.3)
    yaw: float = 0.0

    def __post_init__(self) -> None:
        _check_angles("spread", (self.spread,), 0.5 * math.pi)
        _check_angles("proximal", self.proximal, math.pi, fingers=3)
        _check_angles("distal", self.distal, 2.2, fingers=3)
        if not math.isfinite(self.yaw):
            raise CellError(f"pre-shape: yaw must be finite, but got {self.yaw!r} rad; correct it.")


def _check_angles(name: str, angles: tuple[float, ...], largest: float, fingers: int = 1) -> None:
    if len(angles) != fingers:
        raise CellError(f"pre-shape: {name} needs {fingers} angles, one a finger, but got {len(angles)}; give all.")
    for angle in angles:
        if not 0.0 <= angle <= largest:
            raise CellError(
                f"pre-shape: {name} must lie in [0, {largest:.4g}] rad, but got {angle!r} rad; correct it."
            )


def hand_model_sdf(
    tip: TipShape,
    radius: float,
    length: float | None = None,
    preshape: Preshape | None = None,
    *,
    forearm: bool = True,
) -> str:
    """SDF text of a hand, whose frame ``P`` is at the centre of the tip, z up.

    Args:
        tip: its kind.
        radius: of the tip [m].
        length: of an upright cylinder, or between the centres of a capsule's ends [m]; None for the others.
        preshape: of a ``reflex_sf``; None for the default one. Other tips have none to take.
        forearm: whether the wrist above the flange is shown.

    Raises:
        CellError: if the tip is unknown, a size is missing, superfluous or not positive, or a pre-shape is
            given for a tip that has no fingers.
    """
    if tip not in get_args(TipShape):
        raise CellError(
            f"hand: tip must be one of {', '.join(get_args(TipShape))}, but got {tip!r}; choose one of them."
        )
    _check_size(tip, "radius", radius)
    if tip in _LONG:
        _check_size(tip, "length", length)
    elif length is not None:
        raise CellError(f"hand: a {tip} tip has no length, but got {length!r} m; remove it.")
    if tip != "reflex_sf" and preshape is not None:
        raise CellError(f"hand: a {tip} tip has no fingers, but got a pre-shape; remove it.")
    held = preshape or Preshape()
    name = "reflex_sf.sdf.j2" if tip == "reflex_sf" else f"tip_{tip}.sdf.j2"
    return _templates().get_template(name).render(
        radius=float(radius), length=length, spread=held.spread, proximal=held.proximal, distal=held.distal,
        yaw=held.yaw, forearm=forearm,
    )  # fmt: skip


def _check_size(tip: str, name: str, value: float | None) -> None:
    if value is None or not (math.isfinite(value) and value > 0.0):
        raise CellError(f"hand: a {tip} tip needs a positive {name}, but got {value!r} m; give it.")


@cache
def _templates() -> Environment:
    # SDF, not HTML: nothing to escape, and every value is a number or checked.
    return Environment(
        loader=FileSystemLoader(shipped("models") / "hand"), undefined=StrictUndefined, autoescape=False
    )


@dataclass(frozen=True, kw_only=True)
class Looks:
    """One visual of a hand: its name, shape, pose ``X_PG`` and colour."""

    name: str
    shape: Shape
    X_PG: RigidTransform
    rgba: Rgba


def hand_looks(
    tip: TipShape,
    radius: float,
    length: float | None = None,
    preshape: Preshape | None = None,
    *,
    forearm: bool = True,
) -> list[Looks]:
    """What a hand looks like, found by a plant that is thrown away; arguments as in ``hand_model_sdf``.

    Raises:
        CellError: as ``hand_model_sdf``.
    """
    scene_graph = SceneGraph()
    plant = MultibodyPlant(time_step=0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    text = hand_model_sdf(tip, radius, length, preshape, forearm=forearm)
    (hand,) = Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    context = plant.CreateDefaultContext()
    X_PW = plant.GetFrameByName("P", hand).CalcPoseInWorld(context).inverse()
    inspector = scene_graph.model_inspector()
    found = []
    for index in plant.GetBodyIndices(hand):
        body = plant.get_body(index)
        X_PL = X_PW @ body.EvalPoseInWorld(context)
        for gid in plant.GetVisualGeometriesForBody(body):
            found.append(
                Looks(
                    name=inspector.GetName(gid).rpartition("::")[2],
                    shape=inspector.GetShape(gid),
                    X_PG=X_PL @ inspector.GetPoseInFrame(gid),
                    rgba=inspector.GetIllustrationProperties(gid).GetProperty("phong", "diffuse"),
                )
            )
    return found
