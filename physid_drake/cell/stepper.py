"""One push, simulated: Drake's steps, with the remedies that bring its error below the tracker's noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator

from physid_drake.cell.applied_laws import AppliedLaws
from physid_drake.cell.config import SolverConfig
from physid_drake.cell.contact_drift import ContactDrift, spare_friction
from physid_drake.cell.diagram import HAND_MASS, Scene
from physid_drake.cell.forces import ForceLaw, FrictionLaw
from physid_drake.cell.hand_path import HandPath
from physid_drake.cell.motion import Log, Motion, Outcome, Start
from physid_drake.cell.plant_state import PlantState
from physid_drake.cell.setters import Body
from physid_drake.cell.soft_tip import Mount, SoftTip, TipImpulse
from physid_drake.cell.touch import HandMove, Planar, Tip, Touch, blow

Array = NDArray[np.float64]

REST_SPEED = 2e-4  # m/s of any point: Drake's regularised friction lets a stopped object creep below this
NEAR = 3  # time steps: the hand is near when it could arrive within so many
SMALLEST_STEP = 1e-7  # s
# s: a sprung tip knows the table's friction from the time step before. In time steps of 20 ms, which suit a slow
# hand, a stiff tip was 6 standard deviations off in yaw; in these as far as in time steps of 1 ms.
SOFT_TICK = 2e-3
# Longer ones will do for a slow hand on a spring that is soft enough: within 0.03 mm and 0.4 mrad for 40 mm.
SOFT_TRAVEL = 1e-4  # m: of the hand in one
SOFT_SWING = 2.0  # times the root of mass over stiffness
SLOWEST_HAND = 1e-6  # m/s: no path moves slower
FALLEN = 0.05  # m below the table top: it does not come back
FASTEST = 50.0  # m/s: beyond it a rollout has diverged
# Of the hand's speed: what friction with the table takes of it in a time step. A contact that sticks creeps by as
# much: with 100 kg, time steps of 10 ms and a hand of 2 mm/s, forces turned by 5 deg. A hand far heavier than this
# one hides the contact, as solvers' tolerances are relative to all momenta: 1e5 kg at 0.4 m/s hid three quarters of a
# push's force.
SLOWED = 1e-6
LIGHTEST_HAND = 100.0  # times the object's mass: where there is no friction, nothing slows a hand


class Stepper:
    """Steps one scene: stops at touches, applies impacts and the laws' forces, and overwrites the hand."""

    def __init__(
        self,
        scene: Scene,
        simulator: Simulator,
        solver: SolverConfig,
        hand_radius: float | None,
    ) -> None:
        """Prepare to step ``scene``, with a hand's tip of a radius [m]; None without one."""
        self._simulator, self._solver = simulator, solver
        self._root = simulator.get_mutable_context()
        self._state = PlantState(scene, self._root)
        self._tip = Tip(scene.solid.outline, hand_radius or 0.0)
        self._drift = ContactDrift(self._tip)
        self._rolls, self._gravity = scene.solid.rolling_radius is not None, scene.gravity
        self._discrete = solver.scheme != "cenic"
        self._slide_ticks = 1 if self._discrete else max(1, int(solver.slide_time_step_s / solver.time_step_s + 1e-6))

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
        dt = self._solver.time_step_s
        count = max(1, math.ceil((end - begin) / dt - 1e-6))
        self._body, self._begin, self._height = body, begin, height
        self._laws, self._mount, self._log = AppliedLaws(laws, frictions), mount, Log()
        times = np.asarray(begin + dt * np.arange(count + 1), dtype=np.float64)
        self._hand = None if path is None else path.positions(times).tolist()
        speed = 0.0 if path is None else float(np.linalg.norm(path.velocities, axis=1).max())
        self._hand_mass = self._mass_of_hand(body, max(speed, SLOWEST_HAND))
        self._longest_soft = self._soft_tick_of(body, max(speed, SLOWEST_HAND))
        k = 0
        try:
            self._begin_at(start, rest)
            while k < count:
                k = self._skip_rest(k, count) if self._resting(k) else self._time_step(k, count)
                if self._state.height < -FALLEN:
                    return self._log.motion(Outcome.FELL)
        except (RuntimeError, SystemExit, ArithmeticError):
            # Drake ends the process from a degenerate contact query, a law's numbers may overflow: for a search it
            # is one failed trial.
            return self._log.motion(Outcome.DIVERGED)
        return self._log.motion(Outcome.COMPLETED)

    def _mass_of_hand(self, body: Body, speed: float) -> float:
        """What contact hardly slows, and what does not hide the contact [kg]."""
        friction = float(body.support_friction.min()) * body.mass * self._gravity
        unslowed = friction * self._solver.time_step_s / (SLOWED * speed)
        return min(HAND_MASS, max(unslowed, LIGHTEST_HAND * body.mass))

    def _soft_tick_of(self, body: Body, speed: float) -> float:
        """The longest time step of a sprung tip whose mount goes at most so fast [s]."""
        swing = math.sqrt(body.mass / self._mount.stiffness) if self._mount is not None else 0.0
        return max(SOFT_TICK, min(SOFT_SWING * swing, SOFT_TRAVEL / speed))

    def _begin_at(self, start: Start, rest: Array) -> None:
        """Place object and hand; a sprung tip is no body of Drake's, whose hand stays parked then."""
        self._drift.forget()
        self._soft, state = None, self._state
        if self._hand is None:
            state.begin(self._body, start, rest)
        elif self._mount is None:
            state.begin(self._body, start, rest)
            self._clear_of_hand(self._hand[0])
            state.weigh_hand(self._hand_mass)
            state.set_hand(self._hand[0], self._height, (0.0, 0.0))
        else:
            state.begin(self._body, start, rest)
            self._soft = SoftTip(self._mount, self._tip, self._body, state.inertia)
            self._soft.begin(state.section(self._height)[0], self._hand[0], self._move(0, 1).velocity)
        self._restart(0.0)

    def _clear_of_hand(self, hand: list[float]) -> None:
        """An object recorded a hair inside the hand starts touching it, or the contact would fling it.

        Where it leans, it leans into a hand that it touches upright.
        """
        gap, nx, ny = self._tip.gap(*self._state.section(self._height)[0], *hand)
        if gap < 0.0:
            self._state.shift(-gap * nx, -gap * ny, 0.0)

    def _restart(self, time: float) -> None:
        """Let Drake begin anew from the state as it is."""
        self._root.SetTime(time)
        self._state.send()
        self._record(time, (0.0, 0.0, 0.0))  # first, so that a motion that fails here has a pose
        self._simulator.Initialize()

    def _record(self, time: float, force: Planar) -> None:
        self._log.add(self._begin + time, self._state.pose(), force)

    def _touch(self, hand: list[float], velocity: tuple[float, float]) -> Touch:
        """The touch as it is now."""
        pose, twist = self._state.section(self._height)
        return self._tip.touch(pose, twist, hand, velocity)

    def _move(self, k: int, m: int) -> HandMove:
        """The hand's way from time step ``k`` to time step ``m``."""
        assert self._hand is not None
        start, goal, span = self._hand[k], self._hand[m], (m - k) * self._solver.time_step_s
        return HandMove(start, goal, ((goal[0] - start[0]) / span, (goal[1] - start[1]) / span))

    # Rest.

    def _resting(self, k: int) -> bool:
        vx, vy, wz = self._state.twist()
        if math.hypot(vx, vy) + abs(wz) * 0.05 > REST_SPEED or self._rolls or not self._state.over_table():
            return False
        if self._hand is not None:
            tip = self._hand[k] if self._soft is None else self._soft.place
            if self._tip.gap(*self._state.section(self._height)[0], *tip)[0] <= 1e-6:
                return False
        dt = self._solver.time_step_s
        return self._laws.are_held(self._state, k * dt, dt)

    def _skip_rest(self, k: int, count: int) -> int:
        """Nothing happens until the hand comes: go to the last time step before it touches."""
        pose, _ = self._state.section(self._height)
        m = count
        if self._soft is not None:
            m = self._coast(self._soft, pose, k, count)
        elif self._hand is not None:
            later = range(k + 1, count + 1)
            m = next((i for i in later if self._tip.gap(*pose, *self._hand[i])[0] <= 0.0), count + 1) - 1
        if m > k:
            self._state.stop()
            if self._hand is not None and self._soft is None:
                self._state.set_hand(self._hand[m], self._height, (0.0, 0.0))
            self._restart(m * self._solver.time_step_s)
            if m == count:
                return count
        return self._time_step(m, count)

    def _coast(self, soft: SoftTip, pose: Planar, k: int, count: int) -> int:
        """Move a sprung tip beside an object at rest; returns the time step at which it may meet it."""
        dt = self._solver.time_step_s
        while k < count and not soft.arrives(pose, dt):
            move = self._move(k, k + 1)
            soft.coast(move.goal, move.velocity, dt)
            k += 1
        return k

    # Time steps.

    def _time_step(self, k: int, count: int) -> int:
        """Advance by one time step, or by a few in a free slide; returns the new time step."""
        dt, time_steps = self._solver.time_step_s, self._slide_ticks
        if self._hand is None:
            m = min(k + time_steps, count)
            self._step_free(m * dt, k * dt)
            return m
        if self._soft is not None:
            return self._soft_tick(self._soft, k, count)
        m = k + 1
        move = self._move(k, m)
        touch = self._touch(move.start, move.velocity)
        if k + time_steps <= count and self._apart(touch, k, count):
            m = k + time_steps
            move = self._move(k, m)
            touch = self._touch(move.start, move.velocity)
        self._cross(k * dt, m * dt, move, touch)
        return m

    def _soft_tick(self, soft: SoftTip, k: int, count: int) -> int:
        """As ``_tick``, with a sprung tip."""
        dt = self._solver.time_step_s
        apart = self._apart(self._touch(soft.place, soft.velocity), k, count)
        m = min(k + self._slide_ticks, count) if apart else k + 1
        move, (x, y) = self._move(k, m), self._move(k, m).start
        parts = 1 if apart or self._discrete else math.ceil(dt / self._longest_soft - 1e-6)
        times = np.linspace(k * dt, m * dt, parts + 1).tolist()
        for begin, end in pairwise(times):
            held, gone = soft.held, end - k * dt
            touch = self._touch(soft.place, soft.velocity)
            goal = [x + gone * move.velocity[0], y + gone * move.velocity[1]]
            push = soft.step(touch, goal, move.velocity, end - begin)
            if push is not None and not held:
                self._log.impacts.append(self._begin + begin)
            self._step_free(end, begin, push)
        return m

    def _apart(self, touch: Touch, k: int, count: int) -> bool:
        """Whether hand and object do not meet within the next few time steps."""
        assert self._hand is not None
        reach = self._solver.time_step_s * NEAR * self._slide_ticks
        if touch.gap + min(touch.rate, 0.0) * reach <= 0.0:
            return False
        ahead = min(k + NEAR * self._slide_ticks, count)
        return self._tip.gap(*touch.pose, *self._hand[ahead])[0] > 0.0

    def _cross(self, begin: float, end: float, move: HandMove, touch: Touch) -> None:
        """Advance over one time step, stopping at a touch to apply the impact law."""
        time, velocity = begin, move.velocity
        seen: Touch | None = touch  # valid until the object or the hand has moved
        for _ in range(3):
            if not self._solver.impact_law:
                break
            seen = seen or self._touch(move.start, velocity)
            until = self._tip.time_to_touch(seen, move.start, velocity, end - time)
            if until is None:
                break
            if not self._discrete and until > SMALLEST_STEP:
                hand = move.start
                reached = [hand[0] + until * velocity[0], hand[1] + until * velocity[1]]
                self._step_with_hand(time + until, time, move, seen)
                time, move = time + until, HandMove(reached, move.goal, velocity)
            self._strike(move.start, velocity, until if self._discrete else 0.0)
            seen = None
            self._log.impacts.append(self._begin + time)
            if end - time < SMALLEST_STEP:
                return
        self._step_with_hand(end, time, move, seen)

    def _strike(self, hand: list[float], velocity: tuple[float, float], until: float) -> None:
        """Apply Routh's impact to the object's velocity.

        Args:
            hand: tip centre [m].
            velocity: of the tip [m/s].
            until: for discrete schemes, which cannot stop inside a step: time to the touch [s].
        """
        touch = self._touch(hand, velocity)
        gain = self._state.kick(touch.pose[2], *blow(touch, velocity, self._body, self._state.inertia))
        if until > 0.0:
            self._state.shift(-until * gain[0], -until * gain[1], -until * gain[2])
        self._drift.forget()

    # Drake's step.

    def _step_free(self, end: float, begin: float, push: TipImpulse | None = None) -> None:
        """Advance from ``begin`` to ``end`` [s] without Drake's hand; ``push`` is what a sprung tip gives."""
        span, old, force = end - begin, self._state.twist(), (0.0, 0.0, 0.0)
        # First the laws: friction has not yet answered the tip's impulse, which may be far more than it lets through.
        self._laws.act(self._state, begin, span)
        if push is not None:
            force = push.jx / span, push.jy / span, 0.0
            self._take(push)
        after = self._advance(end, span, free=push is None)
        self._mend_position(old, after, span)
        self._record(end, force)

    def _step_with_hand(self, end: float, begin: float, move: HandMove, seen: Touch | None) -> None:
        """Advance from ``begin`` to ``end`` [s] with Drake's hand; ``seen`` is the touch where it is known."""
        state, span, old, force = self._state, end - begin, self._state.twist(), (0.0, 0.0, 0.0)
        before = seen or self._touch(move.start, move.velocity)
        touching = before.gap + span * min(before.rate, 0.0) <= 1e-6
        if not touching:
            self._drift.forget()
        command = self._drift.command(before, move.velocity, span)
        state.set_hand(move.start, self._height, command)
        self._laws.act(state, begin, span)
        after = self._advance(end, span, free=not touching)
        if touching:
            force = self._hand_force(command, span)
            if self._solver.drift_feedforward:
                spare = spare_friction(before, force, self._body.hand_friction)
                self._drift.learn(before, *state.section(self._height), move, span, spare)
        else:
            self._mend_position(old, after, span)
        self._record(end, force)

    def _advance(self, end: float, span: float, *, free: bool) -> Planar:
        """Let Drake step over a span [s]; returns the object's twist.

        ``free`` where nothing pushes the object.

        Raises:
            FloatingPointError: if the object has flown away.
        """
        state = self._state
        yaw, spin = state.heading()
        state.send()
        self._simulator.AdvanceTo(end)
        state.fetch()
        if free:
            state.keep_momentum(yaw, spin, span)
        after = state.twist()
        # Written so that a NaN anywhere fails the comparison.
        if not abs(after[0]) + abs(after[1]) + 1e-3 * abs(after[2]) < FASTEST:
            raise FloatingPointError("the object left")
        return after

    def _mend_position(self, before: Planar, after: Planar, span: float) -> None:
        """Trapezoidal instead of symplectic: move the object by half of what its velocity changed over a span [s]."""
        if self._solver.trapezoid_slide:
            dx, dy, turn = (0.5 * span * (old - new) for old, new in zip(before, after, strict=True))
            self._state.shift(dx, dy, turn)

    def _take(self, push: TipImpulse) -> None:
        """Give the object a sprung tip's impulse, at the tip's height."""
        yaw = self._state.section(self._height)[0][2]
        self._state.kick(yaw, push.jx, push.jy, push.spin)
        arm = self._height - self._state.height
        self._state.rock(yaw, -arm * push.jy, arm * push.jx)

    def _hand_force(self, command: tuple[float, float], span: float) -> Planar:
        """What slowed the hand pushed the object [N]."""
        rate, (vx, vy, vz) = self._hand_mass / span, self._state.hand_velocity()
        # Serial prismatic joints: the x joint carries three links, z one.
        return 3.0 * rate * (command[0] - vx), 2.0 * rate * (command[1] - vy), rate * (0.0 - vz)
