"""Pushes simulated with MuJoCo: an object on many feet, a prescribed fingertip, and whatever physics is added.

Frames: ``W`` world, z up, table top at z = 0; ``B`` object, at the centre of its shape. SI units throughout. This
package shares no physics with the tool that diagnoses its worlds.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from physid_drake.errors import ParameterError, ProofError
from physid_drake.recording import Prism, is_convex
from physid_drake.validation.worlds.contact import IMPEDANCE, SCALE, SINKAGE, TIP_RATES, tip_law
from physid_drake.validation.worlds.effects.effect import Effect, Moment
from physid_drake.validation.worlds.feet import weighted_feet
from physid_drake.validation.worlds.mujoco_xml import world_xml
from physid_drake.validation.worlds.shapes import (
    Array,
    distance_outside,
    gyration_squared,
    half_planes,
    height_of,
    nearest_face,
)
from physid_drake.validation.worlds.world_plan import GRAVITY, HandPath, Motion, Plan, Pose

TIME_STEP: Final = 2e-4
"""s; the explicit dampers of feet and tip are chosen for it."""
_TOUCH_SUBSTEPS: Final = 40  # while a touch lasts: friction may reverse within it, and both parts count
_TOUCH_TIME: Final = 2e-3  # s
_SETTLE: Final = 0.02  # s simulated before the touch
_REST_SPEED: Final = 2e-4  # m/s and, over the radius of gyration, rad/s
_REST_TIME: Final = 0.02


def load_mujoco() -> Any:
    """The module ``mujoco``.

    Raises:
        ProofError: if it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise ProofError(
            "worlds are simulated with MuJoCo, which is missing; pip install '.[proof]' in the project's folder."
        ) from error


class PushWorld:
    """A built world; the same push gives the same bits."""

    def __init__(
        self,
        plan: Plan,
        effects: Sequence[Effect] = (),
        *,
        pushes: int = 1,
    ) -> None:
        """Build the world of ``plan`` with ``effects``; those whose parameters are null are left out."""
        self._effects = tuple(effect for effect in effects if not effect.is_null)
        for effect in self._effects:
            plan = effect.build(plan)
        self.plan, self._pushes, self._dt = plan, pushes, TIME_STEP
        self._friction_laws = [e.friction for e in self._effects if type(e).friction is not Effect.friction]
        self._wrenches = [e.wrench for e in self._effects if type(e).wrench is not Effect.wrench]
        self._turn = plan.table_grain.angle if plan.table_grain is not None else 0.0
        self._feet, self._weights = weighted_feet(plan)
        self._mujoco = load_mujoco()
        self._model = self._mujoco.MjModel.from_xml_string(world_xml(plan, self._feet, self._weights, TIME_STEP))
        self._state = self._mujoco.MjData(self._model)
        self._adjust()

    def _adjust(self) -> None:
        """Sets what XML cannot: the impedance scale, gravity in the simulation's frame, the solver's tolerance."""
        model, plan = self._model, self.plan
        body = self._body = model.body("object").id
        model.body_invweight0[body] = [SCALE / plan.mass, model.body_invweight0[body, 1] * SCALE]
        # A light body in the pair would change the tip's stiffness without a word.
        for link in ("carriage", "tip"):
            model.body_invweight0[model.body(link).id] = 0.0
        model.stat.meaninertia = plan.mass  # the tolerance is relative to it, and must not be to the carriage
        self._q, self._v = int(model.joint("object").qposadr[0]), int(model.joint("object").dofadr[0])
        self._tip_geom = model.geom("tip").id
        self._tip_law = tip_law(plan)
        self._faces, self._reach = half_planes(plan.shape)
        prism = plan.shape if isinstance(plan.shape, Prism) else None
        self._notched = prism if prism is not None and not is_convex(prism.polygon) else None
        solid = 1.0 - (plan.slosh.fraction if plan.slosh is not None else 0.0)  # what a touch moves
        self._mobility = 1.0 / solid, 1.0 / (gyration_squared(plan.shape) * plan.inertia_ratio)
        gx, gy = self._to_simulation(*(GRAVITY * s for s in plan.tilt))
        model.opt.gravity[:] = gx, gy, -GRAVITY * math.sqrt(1.0 - plan.tilt[0] ** 2 - plan.tilt[1] ** 2)

    def _to_simulation(self, x: float, y: float) -> tuple[float, float]:
        """A vector of W in the simulation's frame, whose x is the table's low-friction axis."""
        c, s = math.cos(self._turn), math.sin(self._turn)
        return c * x + s * y, c * y - s * x

    def run(
        self,
        pose: Pose,
        path: HandPath | None,
        *,
        push: int = 0,
        friction_factor: float = 1.0,
        sample_time: float = 0.005,
        velocity: Pose = (0.0, 0.0, 0.0),
        duration: float | None = None,
        patience: float = 1.5,
        rest: float = 0.2,
    ) -> Motion:
        """Simulates one push, until ``rest`` after hand and object have stopped.

        Args:
            pose: x, y, yaw of B at the start [m, rad].
            path: what the recording says of the tip; None: no hand.
            push: index among the recording's pushes.
            friction_factor: on the support friction, in this push.
            sample_time: of the motion returned, a multiple of the time step [s].
            velocity: of Bo at the start [m/s, rad/s].
            duration: simulate just so long [s].
            patience: how long after the hand an object may still move [s].
            rest: how long the motion goes on at rest [s].
        """
        every = round(sample_time / self._dt)
        end = (float(path.times[-1]) if path is not None else 0.0) + patience if duration is None else duration
        samples = math.ceil(end / sample_time - 1e-9)
        grid = self._dt * np.arange(samples * every + 1, dtype=np.float64)
        nominal = np.full((len(grid), 2), 10.0) if path is None else path.position(grid)
        actual = nominal
        for effect in self._effects:
            actual = effect.tip(grid, actual) if path is not None else actual
        # A sprung tip swings from the first move of its mount.
        whole = path is None or duration is not None or self.plan.sprung_tip is not None
        begin = 0 if whole else self._first_touch(pose, actual)
        if path is not None:
            moving = np.flatnonzero(np.abs(np.diff(actual, axis=0)).max(axis=1) > 1e-7 * self._dt / TIME_STEP)
            stop = int(moving[-1]) + 1 if len(moving) else 0
        else:
            stop = 0
        moment = Moment(
            push=push, pushes=self._pushes, mass=self.plan.mass, gyration_squared=gyration_squared(self.plan.shape)
        )
        self._start(pose, velocity, friction_factor)
        log, forces, last = self._steps(actual, begin, stop, every, moment, stops=duration is None)
        rested = last < len(log) - 1
        log[last + 1 :] = log[last]
        seen = (last - 1) // every  # the last sample of force
        forces[seen + 1 :] = forces[seen]  # friction holds what a tip leans with
        log[:begin] = log[begin]
        kept = min(samples, math.ceil(last / every) + round(rest / sample_time)) if duration is None else samples
        grid_poses = self._poses(log, pose)
        tracked = grid_poses
        for effect in self._effects:
            tracked = effect.tracked(grid, tracked)
        pick = slice(0, kept * every + 1, every)
        return Motion(
            times=grid[pick],
            poses=tracked[pick],
            true_poses=grid_poses[pick],
            tips=nominal[pick],
            forces=self._from_simulation(forces[: kept + 1]),
            rested=rested,
        )

    def _first_touch(self, pose: Pose, tips: Array) -> int:
        """The step from which on simulation matters: nothing moves before the tip is near."""
        c, s = math.cos(pose[2]), math.sin(pose[2])
        local = (tips - np.array(pose[:2])) @ np.array([[c, -s], [s, c]])
        near = distance_outside(self.plan.shape, local) - self.plan.tip_radius < 2e-4
        first = int(np.argmax(near)) if near.any() else len(tips) - 1
        return max(0, first - round(_SETTLE / self._dt))

    def _start(self, pose: Pose, velocity: Pose, friction_factor: float) -> None:
        self._mujoco.mj_resetData(self._model, self._state)
        state, q, v = self._state, self._q, self._v
        half = (pose[2] - self._turn) / 2.0
        z = height_of(self.plan.shape) / 2.0 - SINKAGE
        state.qpos[q : q + 7] = [*self._to_simulation(*pose[:2]), z, math.cos(half), 0.0, 0.0, math.sin(half)]
        state.qvel[v : v + 6] = [*self._to_simulation(*velocity[:2]), 0.0, 0.0, 0.0, velocity[2]]
        if self.plan.table_grain is not None and self.plan.underside_grain is not None:
            raise ParameterError("a contact of MuJoCo has one grain: the table's or the object's, not both.")
        grain = self.plan.table_grain or self.plan.underside_grain
        stretch = math.sqrt(grain.ratio) if grain is not None else 1.0
        # A plane's tangents are the simulation's y and -x; a lying capsule's are its axis and the other.
        along = np.array([stretch, 1.0 / stretch] if self.plan.table_grain is not None else [1.0 / stretch, stretch])
        self._base_friction = self.plan.support_friction * friction_factor * along
        self._model.pair_friction[: len(self._feet), :2] = self._base_friction

    def _steps(
        self, tips: Array, begin: int, stop: int, every: int, moment: Moment, *, stops: bool
    ) -> tuple[Array, Array, int]:
        """Steps until hand and object rest: raw poses (n, 7), forces of the samples, and the last step."""
        model, state, step = self._model, self._state, self._mujoco.mj_step
        qpos, qvel, q, v = state.qpos, state.qvel, self._q, self._v
        turned = tips @ np.array([self._to_simulation(1.0, 0.0), self._to_simulation(0.0, 1.0)])
        speeds = np.diff(turned, axis=0) / self._dt
        parts, touched, touch_steps = self._refine(1, 1.0), 0, round(_TOUCH_TIME / self._dt)
        log, forces = np.empty((len(tips), 7)), np.zeros(((len(tips) - 1) // every + 1, 3))
        log[begin] = qpos[q : q + 7]
        sprung = self.plan.sprung_tip is not None
        if sprung:  # unloaded, and as fast as its mount
            qpos[:2], qvel[:2] = turned[begin], speeds[begin]
        lawful, quiet = bool(self._friction_laws or self._wrenches), 0
        size = math.sqrt(moment.gyration_squared)
        for k in range(begin, len(speeds)):
            if lawful:
                self._apply_laws(moment, k)
            moved = self._mass_met() if k < stop + touch_steps else None
            touches = moved is not None and self._tip_touches()
            touched = touched + touches if moved is not None else 0
            wanted = _TOUCH_SUBSTEPS if moved is not None and touched <= touch_steps else 1
            if wanted != len(parts) or (moved is not None and not touches):
                parts = self._refine(wanted, moved or 1.0)
            for part in parts:
                place = turned[k] + part * model.opt.timestep * speeds[k]
                if sprung:  # its joints are relative to the carriage: the tip itself stays as it is
                    qpos[2:4] += qpos[:2] - place
                    qvel[2:4] += qvel[:2] - speeds[k]
                qpos[:2], qvel[:2] = place, speeds[k]
                step(model, state)
            log[k + 1] = qpos[q : q + 7]
            if k % every == 0:
                forces[k // every] = self._hand_force()
                slow = max(abs(qvel[v]), abs(qvel[v + 1]), size * abs(qvel[v + 5])) < _REST_SPEED
                quiet = quiet + every if slow and stops and k >= stop else 0
                if quiet * self._dt >= _REST_TIME:
                    return log, forces, k + 1
        return log, forces, len(log) - 1

    def _refine(self, parts: int, moved: float) -> range:
        """Makes steps so many times finer; friction stops slip within one, or a stiff touch would be over before.

        The tip's spring and damper are those of the mass that the touch moves, ``moved`` of the object's: off the
        middle, too, a touch then takes as long and gives back as much.
        """
        step = self._dt / parts
        self._model.opt.timestep = step
        self._model.pair_solreffriction[:, 1] = -IMPEDANCE / step
        stiffness, damping = self._tip_law
        # A touch is damped the more, so that it is over at once and does not bounce.
        damping = min(damping, TIP_RATES[parts > 1] * TIME_STEP / self._dt)
        self._model.pair_solref[len(self._feet) :] = -stiffness * SCALE * moved, -damping * SCALE * moved
        return range(parts)

    def _apply_laws(self, moment: Moment, k: int) -> None:
        """Writes friction and force of the next step."""
        state, q, v = self._state, self._q, self._v
        x, y, _, w, i, j, z = state.qpos[q : q + 7].tolist()
        vx, vy, _, _, _, spin = state.qvel[v : v + 6].tolist()
        moment.time, moment.spin = k * self._dt, spin
        c, s = math.cos(self._turn), math.sin(self._turn)
        moment.x, moment.y, moment.yaw = c * x - s * y, s * x + c * y, self._turn + _yaw(w, i, j, z)
        ux, uy = c * vx - s * vy, s * vx + c * vy
        cy, sy = math.cos(moment.yaw), math.sin(moment.yaw)
        bx, by = self.plan.com
        across, along = cy * bx - sy * by, sy * bx + cy * by
        moment.com_x, moment.com_y = moment.x + across, moment.y + along
        moment.vx, moment.vy = ux - spin * along, uy + spin * across
        speed = math.hypot(moment.vx, moment.vy)
        if speed > 1e-3:
            moment.slid += speed * self._dt
            moment.slid_time += self._dt
        if self._friction_laws:
            arms = self._feet @ np.array([[cy, sy], [-sy, cy]])
            moment.foot_places = arms + np.array([moment.x, moment.y])
            moment.foot_velocities = arms @ np.array([[0.0, spin], [-spin, 0.0]]) + np.array([ux, uy])
            factor: Array | float = 1.0
            for law in self._friction_laws:
                factor = factor * law(moment)
            column = np.broadcast_to(np.maximum(factor, 0.02), len(self._feet))
            self._model.pair_friction[: len(self._feet), :2] = np.outer(column, self._base_friction)
        if self._wrenches:
            fx, fy, torque = np.sum([law(moment) for law in self._wrenches], axis=0).tolist()
            state.xfrc_applied[self._body] = [*self._to_simulation(fx, fy), 0.0, 0.0, 0.0, torque]

    def _mass_met(self) -> float | None:
        """Share of the object's mass that a touch moves, off the middle the less; None unless near in three steps."""
        state, q, v = self._state, self._q, self._v
        x, y, _, w, i, j, z = state.qpos[q : q + 7].tolist()
        tip_x, tip_y, _ = state.geom_xpos[self._tip_geom].tolist()
        tip_vx, tip_vy = state.qvel[:2].tolist()
        vx, vy, _, _, _, spin = state.qvel[v : v + 6].tolist()
        reach = self._reach
        fast = math.hypot(tip_vx - vx, tip_vy - vy) + abs(spin) * reach
        yaw, dx, dy = _yaw(w, i, j, z), tip_x - x, tip_y - y
        c, s = math.cos(yaw), math.sin(yaw)
        local = (c * dx + s * dy, c * dy - s * dx)
        if not self._faces:
            distance = max(math.hypot(dx, dy), 1e-9)
            outside, nx, ny = distance - reach, local[0] / distance, local[1] / distance
        elif self._notched is not None:
            outside, nx, ny = nearest_face(self._notched, *local)
        else:
            outside, nx, ny = max((nx * local[0] + ny * local[1] - offset, nx, ny) for nx, ny, offset in self._faces)
        if outside - self.plan.tip_radius >= 3.0 * self._dt * fast + 1e-5:
            return None
        if self.plan.sprung_tip is not None:
            return 1.0  # its law is for the light tip
        bx, by = self.plan.com
        lever = (local[0] - bx) * ny - (local[1] - by) * nx
        along, turning = self._mobility
        share: float = 1.0 / (along + turning * lever**2)
        return share

    def _tip_touches(self) -> bool:
        """Whether the last step saw a contact of the tip; contacts come in the order of the pairs, the tip's last."""
        state = self._state
        return bool(state.ncon) and int(state.contact.geom1[-1]) == self._tip_geom

    def _hand_force(self) -> Array:
        """Force of the tip on the object in the simulation's frame (3,) [N]."""
        total, wrench = np.zeros(3), np.zeros(6)
        contacts = self._state.contact
        for k in np.flatnonzero(contacts.geom1 == self._tip_geom).tolist():
            self._mujoco.mj_contactForce(self._model, self._state, k, wrench)
            total += contacts.frame[k].reshape(3, 3).T @ wrench[:3]
        return total

    def _from_simulation(self, vectors: Array) -> Array:
        c, s = math.cos(self._turn), math.sin(self._turn)
        turned: Array = vectors @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        return turned

    def _poses(self, log: Array, pose: Pose) -> Array:
        """x, y, yaw in W (n, 3); the yaw goes on from the start's."""
        w, i, j, z = log[:, 3:].T
        yaw = np.unwrap(np.arctan2(2.0 * (w * z + i * j), 1.0 - 2.0 * (j * j + z * z)) + self._turn)
        yaw += 2.0 * math.pi * round((pose[2] - yaw[0]) / (2.0 * math.pi))
        places = self._from_simulation(np.column_stack([log[:, :2], np.zeros(len(log))]))
        return np.column_stack([places[:, :2], yaw])


def _yaw(w: float, i: float, j: float, z: float) -> float:
    return math.atan2(2.0 * (w * z + i * j), 1.0 - 2.0 * (j * j + z * z))
