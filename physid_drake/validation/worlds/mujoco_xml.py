"""The XML of a world, as MuJoCo reads it."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from physid_drake.recording import Box, Cylinder
from physid_drake.validation.worlds.contact import FRICTION_RATIO, IMPEDANCE, SCALE, foot_law, tip_law
from physid_drake.validation.worlds.shapes import Array, Solid, height_of, outline_of, plan_moments
from physid_drake.validation.worlds.world_plan import Plan

_FOOT_RADIUS: Final = 0.003
_CAPSULE_HALF: Final = 5e-4  # m; a lying capsule's contact frame follows its axis
_WALL: Final = 0.002  # m; thickness of a prism's faces


def world_xml(plan: Plan, feet: Array, weights: Array, time_step: float) -> str:
    """The model. Feet and tip are direct springs and dampers (negative ``solref``), scaled by `SCALE`."""
    height = height_of(plan.shape)
    soft = f'condim="3" solimp="{IMPEDANCE} {IMPEDANCE} .001" solreffriction="0 {-IMPEDANCE / time_step!r}"'
    capsule = plan.underside_grain is not None
    # A lying capsule touches with both ends, so each end is half a foot.
    spring, damper = (value * SCALE / (2.0 if capsule else 1.0) for value in foot_law())
    pairs = "".join(
        f'<pair geom1="table" geom2="foot{i}" {soft} solref="{-spring * share!r} {-damper * share!r}"/>'
        for i, share in enumerate(weights.tolist())
    )
    stiffness, drag = (value * SCALE for value in tip_law(plan))
    rub = f'friction="{plan.hand_friction!r} {plan.hand_friction!r}"'
    walls, names = _walls(plan.shape)
    touch = "".join(
        f'<pair geom1="tip" geom2="{name}" {soft} {rub} solref="{-stiffness!r} {-drag!r}"/>' for name in names
    )
    return f"""<mujoco><option timestep="{time_step!r}" integrator="Euler" cone="elliptic"
        impratio="{FRICTION_RATIO!r}" tolerance="1e-12"/>
      <default><geom contype="0" conaffinity="0"/></default>
      <worldbody><geom name="table" type="plane" size="4 4 .1"/>
        <body name="carriage" pos="0 0 {plan.tip_height!r}" gravcomp="1">
          <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
          <inertial pos="0 0 0" mass="10" diaginertia=".1 .1 .1"/>
          <body name="tip" gravcomp="1">{_tip_joints(plan)}
            <joint type="slide" axis="0 0 1" stiffness=".1" damping=".001"/>
            <geom name="tip" type="sphere" size="{plan.tip_radius!r}" mass="{_tip_mass(plan)!r}"/></body></body>
        <body name="object" pos="0 0 {height / 2.0!r}"><freejoint name="object"/>
          {_masses(plan)}{walls}{_foot_geoms(plan, feet)}</body></worldbody>
      <contact>{pairs}{touch}</contact></mujoco>"""


def _foot_geoms(plan: Plan, feet: Array) -> str:
    z = _FOOT_RADIUS - height_of(plan.shape) / 2.0
    if plan.underside_grain is None:
        kind = f'type="sphere" size="{_FOOT_RADIUS}"'
    else:
        angle = plan.underside_grain.angle
        axis = f"{math.cos(angle)!r} {math.sin(angle)!r} 0"
        kind = f'type="capsule" size="{_FOOT_RADIUS} {_CAPSULE_HALF}" zaxis="{axis}"'
    return "".join(f'<geom name="foot{i}" {kind} pos="{x!r} {y!r} {z!r}"/>' for i, (x, y) in enumerate(feet.tolist()))


def _masses(plan: Plan) -> str:
    """Inertia of the object, and the part of it that swings."""
    xx, yy, _ = plan_moments(plan.shape)
    flat = height_of(plan.shape) ** 2 / 12.0
    # Products of inertia are left out: they do not enter motion in the plane.
    inertia = np.array([yy + flat, xx + flat, xx + yy]) * plan.mass * plan.inertia_ratio
    fraction = plan.slosh.fraction if plan.slosh is not None else 0.0
    # Off the origin by a micrometre, or MuJoCo takes the body for a simple one.
    x, y = plan.com[0] + (1e-6 if plan.com == (0.0, 0.0) else 0.0), plan.com[1]
    fixed = _inertial(x, y, plan.mass * (1.0 - fraction), inertia * (1.0 - fraction))
    if plan.slosh is None:
        return fixed
    mass, rate = plan.mass * fraction, 2.0 * math.pi * plan.slosh.frequency
    spring = f'stiffness="{mass * rate**2!r}" damping="{2.0 * plan.slosh.damping * mass * rate!r}"'
    joints = f'<joint type="slide" axis="1 0 0" {spring}/><joint type="slide" axis="0 1 0" {spring}/>'
    return f'{fixed}<body name="liquid">{joints}{_inertial(x, y, mass, inertia * fraction)}</body>'


def _inertial(x: float, y: float, mass: float, inertia: Array) -> str:
    diagonal = " ".join(repr(value) for value in inertia.tolist())
    return f'<inertial pos="{x!r} {y!r} 0" mass="{mass!r}" diaginertia="{diagonal}"/>'


def _tip_mass(plan: Plan) -> float:
    """A sprung tip weighs a part of the object; a rigid one hardly anything, since only its z is free."""
    return plan.sprung_tip.share * plan.mass if plan.sprung_tip is not None else 1e-4


def _tip_joints(plan: Plan) -> str:
    if plan.sprung_tip is None:
        return ""
    stiffness = 1.0 / plan.sprung_tip.compliance
    damping = 2.0 * plan.sprung_tip.damping * math.sqrt(stiffness * plan.mass)
    spring = f'stiffness="{stiffness!r}" damping="{damping!r}"'
    return f'<joint type="slide" axis="1 0 0" {spring}/><joint type="slide" axis="0 1 0" {spring}/>'


def _walls(shape: Solid) -> tuple[str, list[str]]:
    """What the tip touches: a box, a cylinder, or a thin box for each face of a prism; spheres meet them exactly."""
    half = height_of(shape) / 2.0
    if isinstance(shape, Box):
        return f'<geom name="body" type="box" size="{shape.size[0] / 2!r} {shape.size[1] / 2!r} {half!r}"/>', ["body"]
    if isinstance(shape, Cylinder):
        return f'<geom name="body" type="cylinder" size="{shape.radius!r} {half!r}"/>', ["body"]
    corners = outline_of(shape)
    geoms = []
    for k, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        before, after = corners[k - 1], corners[(k + 2) % len(corners)]
        geoms.append(_wall(f"face{k}", a, b, _overhang(before, a, b), _overhang(after, b, a), half))
    return "".join(geoms), [f"face{k}" for k in range(len(corners))]


def _overhang(beside: Array, corner: Array, other: Array) -> float:
    """By how much a face of `_WALL` thickness must end before an acute corner so as not to poke out [m]."""
    u, v = beside - corner, other - corner
    cosine = float(u @ v / np.linalg.norm(u) / np.linalg.norm(v))
    return _WALL * max(0.0, cosine) / math.sqrt(1.0 - cosine**2)


def _wall(name: str, a: Array, b: Array, from_a: float, from_b: float, half: float) -> str:
    along = (b - a) / np.linalg.norm(b - a)
    a, b = a + from_a * along, b - from_b * along
    middle = (a + b) / 2.0 + _WALL / 2.0 * np.array([-along[1], along[0]])
    length, angle = float(np.linalg.norm(b - a)), math.degrees(math.atan2(along[1], along[0]))
    x, y = middle.tolist()
    size = f"{length / 2.0!r} {_WALL / 2.0!r} {half!r}"
    return f'<geom name="{name}" type="box" size="{size}" pos="{x!r} {y!r} 0" euler="0 0 {angle!r}"/>'
