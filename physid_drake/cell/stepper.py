"""One push, simulated: Drake's steps, with the four remedies that bring its error below the tracker's noise."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator

from physid_drake.cell.config import SolverConfig
from physid_drake.cell.diagram import HAND_MASS, Scene
from physid_drake.cell.forces import (
    ForceLaw,
    FrictionLaw,
    ObjectState,
    Swinging,
    Wrench,
    reader_of,
    total_wrenches,
)
from physid_drake.cell.hand_path import HandPath
from physid_drake.cell.motion import Log, Motion, Outcome, Start, planar_pose
from physid_drake.cell.setters import Body
from physid_drake.cell.soft_tip import Mount, Push, SoftTip
from physid_drake.cell.touch import Planar, Tip, Touch, blow

Array = NDArray[np.float64]

REST_SPEED = 2e-4  # m/s of any point: Drake's regularised friction lets a stopped object creep below this
NEAR = 3  # ticks: the hand is near when it could arrive within so many
SMALLEST_STEP = 1e-7  # s
SURELY_HELD = 0.5  # of the friction: a resting object under less does not slide
FALLEN = 0.05  # m below the table top: it does not come back
PARKED = (0.0, 0.0, 10.0)  # m: a hand that takes no part
FASTEST = 50.0  # m/s: beyond it a rollout has diverged


class Stepper:
    """Steps one scene: stops at touches, applies impacts and the laws' forces, and overwrites the hand."""

    def __init__(
        self,
        scene: Scene,
        simulator: Simulator,
        solver: SolverConfig,
        hand_radius: float | None,
        *,
        tilt_depth: float | None = None,
    ) -> None:
        """Prepare to step ``scene``; ``tilt_depth`` is the rest depth [m] of a hydroelastic support, else None."""
        self._scene, self._simulator, self._solver = scene, simulator, solver
        self._tilt_gain = 0.0 if tilt_depth is None else 1.0 / tilt_depth
        self._tip = Tip(scene.solid.outline, hand_radius or 0.0)
        plant = scene.plant
        self._root = simulator.get_mutable_context()
        self._context = plant.GetMyMutableContextFromRoot(self._root)
        nq = plant.num_positions()
        self._q = scene.object.floating_positions_start()
        self._v = nq + scene.object.floating_velocities_start_in_v()
        self._hand_q = [joint.position_start() for joint in scene.joints]
        self._hand_v = [nq + joint.velocity_start() for joint in scene.joints]
        # Serial prismatic joints: the x joint carries three links, z one.
        self._hand_masses = (3.0 * HAND_MASS, 2.0 * HAND_MASS, HAND_MASS)
        self._round = scene.solid.rolling_radius is not None  # a rolling one is round at every angle
        self._discrete = solver.scheme != "cenic"
        self._slide_ticks = 1 if self._discrete else max(1, round(solver.slide_time_step_s / solver.time_step_s))

    def run(
        self,
        *,
        body: Body,
        start: Start,
        rest: Array,
        path: HandPath | None,
        height: float,
        begin: float,
        end: float,
        laws: Sequence[ForceLaw] = (),
        frictions: Sequence[FrictionLaw] = (),
        mount: Mount | None = None,
    ) -> Motion:
        """Simulate from ``begin`` to ``end`` [s].

        Args:
            body: the parameters already written into the Context.
            start: the object's state.
            rest: (7,) the settled pose of B at the origin with yaw 0.
            path: the hand's; None without a hand.
            height: of the tip's centre above the table [m].
            begin: time of the start [s].
            end: time of the end [s].
            laws: forces beyond weight, friction and hand.
            frictions: friction laws; the contact must hold their largest friction already.
            mount: what holds the tip; None where it is rigid.
        """
        self._laws, self._frictions = laws, frictions
        dt = self._solver.time_step_s
        count = max(1, math.ceil((end - begin) / dt - 1e-6))
        self._body, self._begin, self._height = body, begin, height
        self._inertia = body.mass * body.inertia_ratio * self._scene.solid.gyration[2]
        self._reader = reader_of(body, self._scene)
        self._hand = (
            None
            if path is None
            else path.positions(np.asarray(begin + dt * np.arange(count + 1), dtype=np.float64)).tolist()
        )
        self._soft = None if mount is None or path is None else SoftTip(mount, self._tip, body, self._inertia)
        self._drift, self._log = 0.0, Log()
        k = 0
        try:
            self._begin_at(start, rest, height)
            while k < count:
                k = self._skip_rest(k, count) if self._resting(k) else self._tick(k, count)
                if self._x[self._q + 6] < -FALLEN:
                    return self._log.motion(Outcome.FELL)
        except (RuntimeError, SystemExit, FloatingPointError):
            # Drake ends the process from a degenerate contact query; for a search it is one failed trial.
            return self._log.motion(Outcome.DIVERGED)
        return self._log.motion(Outcome.COMPLETED)

    def _begin_at(self, start: Start, rest: Array, height: float) -> None:
        self._x = self._place(start, rest, height)
        if self._soft is not None and self._hand is not None:
            first = self._hand_velocity(self._hand[0], self._hand[1], self._solver.time_step_s)
            self._soft.begin(self._section()[0], self._hand[0], first)
        self._root.SetTime(0.0)
        self._send()
        self._simulator.Initialize()
        self._record(0.0, (0.0, 0.0, 0.0))

    # The object's planar state, as plain floats.

    def _twist(self) -> Planar:
        """Planar velocity vx, vy, wz of Bo in W."""
        v = self._v
        return float(self._x[v + 3]), float(self._x[v + 4]), float(self._x[v + 2])

    def _section(self) -> tuple[Planar, Planar]:
        """Pose and twist of the object's section at the tip's height.

        A can that leans by 1 mrad has moved there by more than the contact is deep.
        """
        q, v = self._q, self._v
        w, i, j, k, px, py, pz = self._x[q : q + 7].tolist()
        wx, wy, wz, vx, vy = self._x[v : v + 5].tolist()
        above = self._height - pz
        pose = planar_pose(w, i, j, k, px, py)
        if self._round:
            return pose, (vx, vy, wz)
        px += 2.0 * (i * k + w * j) * above
        py += 2.0 * (j * k - w * i) * above
        return (px, py, pose[2]), (vx + wy * above, vy - wx * above, wz)

    def _place(self, start: Start, rest: Array, height: float) -> Array:
        x = np.zeros(self._scene.plant.num_multibody_states())
        px, py, yaw = start.pose
        if self._hand is not None and self._soft is None:
            px, py = self._clear_of_hand(px, py, yaw)
            x[self._hand_q] = [*self._hand[0], height]
        elif self._hand_q:
            x[self._hand_q] = PARKED
        c, s = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
        w, i, j, k = rest[:4]
        x[self._q : self._q + 4] = [c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w]
        x[self._q + 4 : self._q + 7] = [px, py, rest[6]]
        vx, vy, wz = start.velocity
        x[self._v : self._v + 6] = [0.0, 0.0, wz, vx, vy, 0.0]
        if self._scene.solid.rolling_radius is not None:
            self._roll_with(x, vx, vy, yaw)
        return x

    def _roll_with(self, x: Array, vx: float, vy: float, yaw: float) -> None:
        """A lying cylinder that moves across its axis starts rolling, not sliding."""
        across = vx * math.cos(yaw) + vy * math.sin(yaw)
        rate = across / float(self._scene.solid.rolling_radius or 1.0)
        x[self._v : self._v + 2] = [-rate * math.sin(yaw), rate * math.cos(yaw)]

    def _clear_of_hand(self, px: float, py: float, yaw: float) -> tuple[float, float]:
        """An object recorded a hair inside the hand starts touching it, or the contact would fling it."""
        assert self._hand is not None
        gap, nx, ny = self._tip.gap(px, py, yaw, *self._hand[0])
        overlap = max(0.0, -gap)
        return px + overlap * nx, py + overlap * ny

    def _send(self) -> None:
        self._scene.plant.SetPositionsAndVelocities(self._context, self._x)

    def _record(self, time: float, force: tuple[float, float, float]) -> None:
        self._log.add(self._begin + time, self._x[self._q : self._q + 7].copy(), force)

    def _touch(self, hand: list[float], velocity: tuple[float, float]) -> Touch:
        """The touch as it is now."""
        pose, twist = self._section()
        return self._tip.touch(pose, twist, hand, velocity)

    # Ticks.

    def _resting(self, k: int) -> bool:
        vx, vy, wz = self._twist()
        if math.hypot(vx, vy) + abs(wz) * 0.05 > REST_SPEED or self._scene.solid.rolling_radius is not None:
            return False
        if self._hand is not None:
            tip = self._hand[k] if self._soft is None else self._soft.place
            if self._tip.gap(*self._section()[0], *tip)[0] <= 1e-6:
                return False
        return self._holds(k * self._solver.time_step_s)

    def _skip_rest(self, k: int, count: int) -> int:
        """Nothing happens until the hand comes: go to the last tick before it touches."""
        (pose, _), dt = self._section(), self._solver.time_step_s
        m = count
        if self._soft is not None:
            m = self._coast(pose, k, count)
        elif self._hand is not None:
            m = (
                next(
                    (i for i in range(k + 1, count + 1) if self._tip.gap(*pose, *self._hand[i])[0] <= 0.0),
                    count + 1,
                )
                - 1
            )
        if m > k:
            self._x[self._v : self._v + 6] = 0.0
            self._settle_hand(m)
            self._root.SetTime(m * dt)
            self._send()
            self._simulator.Initialize()
            self._record(m * dt, (0.0, 0.0, 0.0))
            if m == count:
                return count
        return self._tick(m, count)

    def _coast(self, pose: Planar, k: int, count: int) -> int:
        """Move a sprung tip beside an object at rest; returns the tick at which it may meet it."""
        assert self._soft is not None
        assert self._hand is not None
        dt = self._solver.time_step_s
        while k < count and not self._soft.arrives(pose, dt):
            self._soft.coast(self._hand[k + 1], self._hand_velocity(self._hand[k], self._hand[k + 1], dt), dt)
            k += 1
        return k

    def _settle_hand(self, k: int) -> None:
        if self._hand is not None and self._soft is None:
            self._x[self._hand_q[:2]] = self._hand[k]
            self._x[self._hand_v] = 0.0

    def _tick(self, k: int, count: int) -> int:
        """Advance by one tick, or by a few in a free slide; returns the new tick."""
        dt = self._solver.time_step_s
        if self._hand is None:
            m = min(k + self._slide_ticks, count)
            self._step(m * dt, k * dt, None, None)
            return m
        if self._soft is not None:
            return self._soft_tick(self._soft, k, count)
        m = k + 1
        velocity = self._hand_velocity(self._hand[k], self._hand[m], dt)
        touch = self._touch(self._hand[k], velocity)
        reach = dt * NEAR * self._slide_ticks
        if (
            touch.gap + min(touch.rate, 0.0) * reach > 0.0
            and k + self._slide_ticks <= count
            and self._far(k, count, touch.pose)
        ):
            m = k + self._slide_ticks
            velocity = self._hand_velocity(self._hand[k], self._hand[m], (m - k) * dt)
            touch = self._touch(self._hand[k], velocity)
        self._cross(k * dt, m * dt, self._hand[k], self._hand[m], velocity, touch)
        return m

    def _soft_tick(self, soft: SoftTip, k: int, count: int) -> int:
        """As ``_tick``, with a sprung tip."""
        assert self._hand is not None
        dt = self._solver.time_step_s
        touch = self._touch(soft.place, soft.velocity)
        m = min(k + self._slide_ticks, count)
        reach = dt * NEAR * self._slide_ticks
        if touch.gap + min(touch.rate, 0.0) * reach <= 0.0 or not self._far(k, count, touch.pose):
            m = k + 1
        span = (m - k) * dt
        held = soft.held
        push = soft.step(touch, self._hand[m], self._hand_velocity(self._hand[k], self._hand[m], span), span)
        if push is not None and not held:
            self._log.impacts.append(self._begin + k * dt)
        self._step(m * dt, k * dt, None, None, push)
        return m

    def _far(self, k: int, count: int, pose: Planar) -> bool:
        ahead = min(k + NEAR * self._slide_ticks, count)
        assert self._hand is not None
        return self._tip.gap(*pose, *self._hand[ahead])[0] > 0.0

    @staticmethod
    def _hand_velocity(start: list[float], end: list[float], span: float) -> tuple[float, float]:
        return (end[0] - start[0]) / span, (end[1] - start[1]) / span

    def _cross(
        self,
        begin: float,
        end: float,
        start: list[float],
        goal: list[float],
        velocity: tuple[float, float],
        touch: Touch,
    ) -> None:
        """Advance over one tick, stopping at a touch to apply the impact law."""
        time, hand = begin, start
        seen: Touch | None = touch  # valid until the object or the hand has moved
        for _ in range(3):
            if not self._solver.impact_law:
                break
            seen = seen or self._touch(hand, velocity)
            until = self._tip.time_to_touch(seen, hand, velocity, end - time)
            if until is None:
                break
            if not self._discrete and until > SMALLEST_STEP:
                reached = [hand[0] + until * velocity[0], hand[1] + until * velocity[1]]
                self._step(time + until, time, (hand, reached, velocity), seen)
                time, hand = time + until, reached
            self._strike(hand, velocity, until if self._discrete else 0.0)
            seen = None
            self._log.impacts.append(self._begin + time)
            if end - time < SMALLEST_STEP:
                return
        self._step(end, time, (hand, goal, velocity), seen)

    def _strike(self, hand: list[float], velocity: tuple[float, float], until: float) -> None:
        """Apply Routh's impact to the object's velocity.

        Args:
            hand: tip centre [m].
            velocity: of the tip [m/s].
            until: for discrete schemes, which cannot stop inside a step: time to the touch [s].
        """
        touch = self._touch(hand, velocity)
        gain = self._kick(touch.pose[2], *blow(touch, velocity, self._body, self._inertia))
        if until > 0.0:
            self._shift(-until * gain[0], -until * gain[1], -until * gain[2])
        self._drift = 0.0

    def _kick(self, yaw: float, jx: float, jy: float, spin: float) -> Planar:
        """Give the object a planar impulse [N s] at Bcm and an angular one [N m s]; returns Bo's gain in velocity."""
        body = self._body
        c, s = math.cos(yaw), math.sin(yaw)
        cx, cy = float(body.p_BBcm[0]), float(body.p_BBcm[1])
        turn = spin / self._inertia
        # Bcm gets J/m; Bo moves with it and with the new spin about it.
        ox, oy = -(c * cx - s * cy), -(s * cx + c * cy)
        gain = (jx / body.mass - turn * oy, jy / body.mass + turn * ox, turn)
        self._x[self._v + 2] += gain[2]
        self._x[self._v + 3] += gain[0]
        self._x[self._v + 4] += gain[1]
        return gain

    # Force laws.

    def _apply_laws(self, time: float, span: float) -> None:
        """Add the laws' impulses over a tick to the velocities."""
        state = self._object_state(time)
        for wrench in self._wrenches(state):
            self._kick(state.yaw, span * wrench.fx, span * wrench.fy, span * wrench.torque)
            if wrench.tip_x or wrench.tip_y:
                self._rock(state.yaw, span * wrench.tip_x, span * wrench.tip_y)

    def _wrenches(self, state: ObjectState) -> list[Wrench]:
        return total_wrenches(state, self._laws, self._frictions)

    def _take(self, push: Push) -> None:
        """Give the object a sprung tip's impulse, at the tip's height."""
        yaw = self._section()[0][2]
        self._kick(yaw, push.jx, push.jy, push.spin)
        arm = self._height - float(self._x[self._q + 6])
        self._rock(yaw, -arm * push.jy, arm * push.jx)

    def _rock(self, yaw: float, hx: float, hy: float) -> None:
        """Give the object an angular impulse [N m s] about x and y of W; Bcm keeps its velocity."""
        scale = self._body.mass * self._body.inertia_ratio
        ix, iy = scale * self._scene.solid.gyration[0], scale * self._scene.solid.gyration[1]
        c, s = math.cos(yaw), math.sin(yaw)
        about_x, about_y = (c * hx + s * hy) / ix, (c * hy - s * hx) / iy
        wx, wy = c * about_x - s * about_y, s * about_x + c * about_y
        self._x[self._v] += wx
        self._x[self._v + 1] += wy
        cx, cy = float(self._body.p_BBcm[0]), float(self._body.p_BBcm[1])
        self._x[self._v + 5] += wy * (c * cx - s * cy) - wx * (s * cx + c * cy)

    def _object_state(self, time: float) -> ObjectState:
        q, v = self._q, self._v
        return self._reader.at(time, self._x[q : q + 7].tolist(), self._x[v : v + 6].tolist())

    def _mean_depth(self) -> float:
        """How deep the support points are in the table on average [m]; those that hang over it not at all."""
        foot, along_x, along_y = self._reader.lean(self._x[self._q : self._q + 7].tolist())
        support = self._scene.support
        plane = foot + support.points @ np.array([along_x, along_y])
        return float(support.weights @ np.maximum(plane, 0.0))

    def _holds(self, time: float) -> bool:
        """Whether friction surely holds a resting object against the laws' forces."""
        if not self._laws:
            return True
        state = self._object_state(time)
        limit = float(state.holding.sum())
        reach = math.sqrt(self._inertia / self._body.mass)
        pull = sum(math.hypot(w.fx, w.fy) + abs(w.torque) / reach for w in self._wrenches(state))
        pull += sum(law.strongest() for law in self._laws if isinstance(law, Swinging))
        return pull < SURELY_HELD * limit

    def _shift(self, dx: float, dy: float, turn: float) -> None:
        """Move the object's pose by a small planar displacement."""
        q = self._q
        w, i, j, k = self._x[q : q + 4].tolist()
        half = 0.5 * turn
        norm = 1.0 / math.sqrt(1.0 + half * half)
        self._x[q : q + 4] = [
            norm * (w - half * k), norm * (i - half * j), norm * (j + half * i), norm * (k + half * w),
        ]  # fmt: skip
        self._x[q + 4] += dx
        self._x[q + 5] += dy

    # Drake's step.

    def _step(
        self,
        end: float,
        begin: float,
        move: tuple[list[float], list[float], tuple[float, float]] | None,
        seen: Touch | None,
        push: Push | None = None,
    ) -> None:
        """Let Drake advance from ``begin`` to ``end``.

        Args:
            end: time [s].
            begin: time [s].
            move: the tip's start, goal and velocity.
            seen: the touch at the start, where it is known already.
            push: what a sprung tip gives.
        """
        span = end - begin
        old = self._twist()
        touching, before = False, None
        command = (0.0, 0.0)
        force = (0.0, 0.0, 0.0)
        if push is not None:
            force = push.jx / span, push.jy / span, 0.0
            self._take(push)
        if move is not None:
            hand, goal, velocity = move
            before = seen or self._touch(hand, velocity)
            touching = before.gap + span * min(before.rate, 0.0) <= 1e-6
            if not touching:
                self._drift = 0.0
            mend = -self._drift / span
            command = (velocity[0] + mend * before.nx, velocity[1] + mend * before.ny)
            self._x[self._hand_q[0]], self._x[self._hand_q[1]] = hand
            self._x[self._hand_v[0]], self._x[self._hand_v[1]] = command
            self._x[self._hand_v[2]] = 0.0
        height = self._x[self._hand_q[2]] if move is not None else 0.0
        if self._laws or self._frictions:
            self._apply_laws(begin, span)
        pushed = self._twist()
        self._send()
        self._simulator.AdvanceTo(end)
        self._x = self._scene.plant.GetPositionsAndVelocities(self._context)
        after = self._twist()
        # Written so that a NaN anywhere fails the comparison.
        if not abs(after[0]) + abs(after[1]) + 1e-3 * abs(after[2]) < FASTEST:
            raise FloatingPointError("the object left")
        if move is not None:
            if touching:
                force = self._hand_force(command, span)
            self._x[self._hand_q[0]], self._x[self._hand_q[1]] = goal
            self._x[self._hand_q[2]] = height
        if self._tilt_gain > 0.0 and not touching and push is None:
            after = self._without_tilt_friction(pushed, after)
        if self._solver.trapezoid_slide and not touching:
            self._shift(
                0.5 * span * (old[0] - after[0]),
                0.5 * span * (old[1] - after[1]),
                0.5 * span * (old[2] - after[2]),
            )
        if touching and before is not None and move is not None:
            self._learn_drift(before, move, span)
        self._record(end, force)

    def _without_tilt_friction(self, before: Planar, after: Planar) -> Planar:
        """Take back the friction that a tilted rigid face on a compliant table feels too much of.

        A face that leans by n and slides at v is predicted to lift by v n dt in a step, as if the table were
        not flat; equilibrium makes up for it by sinking deeper, and CENIC's lagged friction follows the
        depth: too large by v n dt / depth. Measured: -2.5 % of a slide at 1 m/s and 2 ms.
        """
        excess = self._mean_depth() * self._tilt_gain - 1.0
        if not 0.0 < excess < 0.5:  # lighter than at rest, or a bounce: nothing of the kind
            return after
        factor = 1.0 / (1.0 + excess)
        vx, vy, wz = (old + factor * (new - old) for old, new in zip(before, after, strict=True))
        v = self._v
        self._x[v + 2], self._x[v + 3], self._x[v + 4] = wz, vx, vy
        return vx, vy, wz

    def _hand_force(self, command: tuple[float, float], span: float) -> tuple[float, float, float]:
        """What slowed the hand pushed the object."""
        target = (*command, 0.0)
        fx, fy, fz = (
            mass * (target[i] - float(self._x[self._hand_v[i]])) / span for i, mass in enumerate(self._hand_masses)
        )
        return fx, fy, fz

    def _learn_drift(
        self,
        before: Touch,
        move: tuple[list[float], list[float], tuple[float, float]],
        span: float,
    ) -> None:
        """How much the gap moved beyond Drake's linear prediction, because the face turned: fed forward."""
        if not self._solver.drift_feedforward:
            return
        _, goal, velocity = move
        pose, after = self._section()
        nx, ny, rx, ry = before.nx, before.ny, before.rx, before.ry
        rate = nx * (after[0] - after[2] * ry - velocity[0]) + ny * (after[1] + after[2] * rx - velocity[1])
        now, *_ = self._tip.gap(*pose, *goal)
        self._drift = now - (before.gap + span * rate)
