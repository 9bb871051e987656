"""MuJoCo as a peer: as most people set it, and with the settings that make its dry friction right.

By default slip lifts a contact (the convex cone), so that a sliding body rides on its fastest feet. A tiny
impedance of the normals and a large one of the friction (``solimp``, ``impratio``, direct ``solref``) undo it.
The tip's slide joints are overwritten at every step; a mocap body would touch with no velocity.
"""

from __future__ import annotations

import math

import mujoco
import numpy as np

from peers.push import FRICTION, GRAVITY, MASS, SIZE, TIP_HEIGHT, TIP_RADIUS, Array, Push, planar

FOOT_RADIUS = 0.003  # m
IMPEDANCE = 1e-4  # MuJoCo's smallest
SCALE = 1e3  # takes the normals' impedance lower still, by the body's inverse weight
TIP_DAMPING = 0.7  # of critical
_LENGTH, _WIDTH, _HEIGHT = SIZE


def midpoints(nx: int, ny: int) -> tuple[Array, Array]:
    """Middles (n, 2) of equal cells of the underside [m], and their shares (n,) of the weight."""
    x, y = np.meshgrid((np.arange(nx) + 0.5) / nx - 0.5, (np.arange(ny) + 0.5) / ny - 0.5, indexing="ij")
    return np.column_stack([_LENGTH * x.ravel(), _WIDTH * y.ravel()]), np.full(nx * ny, 1.0 / (nx * ny))


class _Prescribed:
    """Steps a model whose first two joints are the tip's."""

    def __init__(self, model: mujoco.MjModel, rest: float) -> None:
        self.model, self._rest = model, rest
        self._state = mujoco.MjData(model)
        self._q = model.joint("object").qposadr[0]

    def _write_parameters(self) -> None:
        raise NotImplementedError

    def rollout(self, push: Push) -> Array:
        """End pose (3,) [m, rad]."""
        return self.motion(push)[-1]

    def motion(self, push: Push) -> Array:
        """Poses (n, 3) [m, rad] after every step."""
        self._write_parameters()
        model, state, step, q = self.model, self._state, mujoco.mj_step, self._q
        places = push.grid(model.opt.timestep)
        speeds = np.diff(places, axis=0) / model.opt.timestep
        mujoco.mj_resetData(model, state)
        state.qpos[q : q + 7] = [0.0, 0.0, self._rest, 1.0, 0.0, 0.0, 0.0]
        log = np.empty((len(speeds), 7))
        qpos, qvel = state.qpos, state.qvel
        for k in range(len(speeds)):
            qpos[:2], qvel[:2] = places[k], speeds[k]
            step(model, state)
            log[k] = qpos[q : q + 7]
        return planar(log[:, :3], *log[:, 3:].T)


class NaiveBox(_Prescribed):
    """A box on a plane with MuJoCo's defaults: pyramidal cone, 2 ms, soft contacts."""

    def __init__(self) -> None:
        model = mujoco.MjModel.from_xml_string(f"""<mujoco><worldbody>
            <geom type="plane" size="2 2 .1" friction="{FRICTION}"/>
            <body pos="0 0 {TIP_HEIGHT}"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
              <geom type="sphere" size="{TIP_RADIUS}" mass="10" friction="{FRICTION}"/></body>
            <body pos="0 0 {_HEIGHT / 2}"><freejoint name="object"/>
              <geom type="box" size="{_LENGTH / 2} {_WIDTH / 2} {_HEIGHT / 2}" mass="{MASS}" friction="{FRICTION}"/>
            </body></worldbody></mujoco>""")
        super().__init__(model, _HEIGHT / 2)

    def _write_parameters(self) -> None:
        self.model.geom_friction[:, 0] = FRICTION


class SoftFeet(_Prescribed):
    """Small spheres under the box with the soft-impedance settings, and a tip that is free to move up and down."""

    def __init__(self, points: Array, weights: Array, time_step: float, *, soft: bool = False) -> None:
        """Take support ``points`` (n, 2) [m] and ``weights`` (n,); ``soft`` contacts are for steps of 2 ms."""
        depth, stiffness = (2e-4, 2e3) if soft else (5e-5, 1e4)  # m at rest; N/m of the tip
        model = mujoco.MjModel.from_xml_string(_soft_xml(points, weights, time_step, depth, stiffness))
        # The contacts' stiffness is in units of the pair's inverse weight: the object's alone, and scaled.
        model.body_invweight0[model.body("object").id] *= SCALE
        for link in ("tip", "finger"):
            model.body_invweight0[model.body(link).id] = 0.0
        model.stat.meaninertia = MASS  # the solver's tolerance is relative to it
        super().__init__(model, _HEIGHT / 2 - depth)

    def _write_parameters(self) -> None:
        self.model.pair_friction[:, :2] = FRICTION


def _soft_xml(points: Array, weights: Array, time_step: float, depth: float, stiffness: float) -> str:
    """The model; a foot's stiffness is its weight's share of what makes the object sink by ``depth``."""
    inertia = MASS / 12.0 * (np.dot(SIZE, SIZE) - np.square(SIZE))
    spring, damper = GRAVITY / depth * SCALE, 2.0 * math.sqrt(GRAVITY / depth) * SCALE
    tip_spring = stiffness / MASS * SCALE
    tip_damper = 2.0 * TIP_DAMPING * math.sqrt(stiffness / MASS) * SCALE
    soft = f'solimp="{IMPEDANCE} {IMPEDANCE} .001" solreffriction="0 {-IMPEDANCE / time_step}" condim="3"'
    rub = f'friction="{FRICTION} {FRICTION}"'
    feet = "".join(
        f'<geom name="foot{i}" type="sphere" size="{FOOT_RADIUS}" pos="{x} {y} {FOOT_RADIUS - _HEIGHT / 2}"/>'
        for i, (x, y) in enumerate(points)
    )
    pairs = "".join(
        f'<pair geom1="table" geom2="foot{i}" {rub} {soft} solref="{-spring * w} {-damper * w}"/>'
        for i, w in enumerate(weights)
    )
    # The centre of mass lies off the origin, or a body_mass written later would be ignored without a word.
    return f"""<mujoco>
      <option timestep="{time_step}" cone="elliptic" impratio="{1e7 * SCALE}" tolerance="1e-12"/>
      <default><geom contype="0" conaffinity="0"/></default>
      <worldbody><geom name="table" type="plane" size="2 2 .1"/>
        <body name="finger" pos="0 0 {TIP_HEIGHT}" gravcomp="1">
          <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
          <inertial pos="0 0 0" mass="10" diaginertia=".1 .1 .1"/>
          <body name="tip" gravcomp="1"><joint type="slide" axis="0 0 1" stiffness=".1" damping=".001"/>
            <geom name="tip" type="sphere" size="{TIP_RADIUS}" mass="1e-4"/></body></body>
        <body name="object" pos="0 0 {_HEIGHT / 2}"><freejoint name="object"/>
          <inertial pos="1e-6 0 0" mass="{MASS}" diaginertia="{inertia[0]} {inertia[1]} {inertia[2]}"/>
          <geom name="box" type="box" size="{_LENGTH / 2} {_WIDTH / 2} {_HEIGHT / 2}"/>{feet}</body></worldbody>
      <contact>{pairs}<pair geom1="tip" geom2="box" {rub} {soft} solref="{-tip_spring} {-tip_damper}"/></contact>
    </mujoco>"""
