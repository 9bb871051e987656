"""Pushes simulated with MuJoCo: an object on many feet, a prescribed fingertip, and whatever physics is added.

MuJoCo's usual settings let slip lift a contact, so that a sliding body rides on its fastest feet. A tiny impedance
of the normals and a large one of the friction undo it; a foot is then a spring and damper with Coulomb friction.

Frames: ``W`` world, z up, table top at z = 0; ``B`` object, at the centre of its shape. SI units throughout. This
package shares no physics with the tool that diagnoses its worlds.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from physid_drake.errors import PhysidError
from physid_drake.recording import Box, Cylinder, Prism, outline_distance

Array: TypeAlias = npt.NDArray[np.float64]
Solid: TypeAlias = Box | Cylinder | Prism
Pose: TypeAlias = tuple[float, float, float]

GRAVITY: Final = 9.81
"""m/s^2."""
TIME_STEP: Final = 2e-4
"""s; the explicit dampers of feet and tip are chosen for it."""
RESIDUAL_RESTITUTION: Final = 0.0017
"""Of a central bounce where 0 is asked for: an overdamped contact still gives some. Measured with steps: 0.006."""

_SINKAGE: Final = 1e-5  # m, at rest; more lets tall objects rock
_FOOT_RADIUS: Final = 0.003
_CAPSULE_HALF: Final = 5e-4  # m; a lying capsule's contact frame follows its axis
_IMPEDANCE: Final = 1e-4  # MuJoCo's smallest
_SCALE: Final = 1e3  # takes the impedance of the normals lower still, by the body's inverse weight
_FRICTION_RATIO: Final = 1e7 * _SCALE
_TIP_DAMPING: Final = 12.0  # of critical, where nothing shall bounce
_TIP_FREQUENCY: Final = 1500.0  # rad/s; the stiffest tip that the step resolves
_TIP_RATES: Final = (2000.0, 8000.0)  # 1/s; most damping over mass, usually and in a touch: stable twice off-centre
_TOUCH_SUBSTEPS: Final = 40  # while a touch lasts: friction may reverse within it, and both parts count
_TOUCH_TIME: Final = 2e-3  # s
_SPRUNG_TIP_LAW: Final = (0.7, 300.0)  # damping ratio, rad/s; a light tip is unstable with more
_SPRUNG_TIP_MASS: Final = 0.2  # of the object's
_WALL: Final = 0.002  # m; thickness of a prism's faces
_SETTLE: Final = 0.02  # s simulated before the touch
_REST_SPEED: Final = 2e-4  # m/s and, over the radius of gyration, rad/s
_REST_TIME: Final = 0.02


class ProofError(PhysidError, RuntimeError):
    """The proof cannot run: something it needs is missing, or a folder is not as it left it."""


def load_mujoco() -> Any:
    """The module ``mujoco``.

    Raises:
        ProofError: if it is not installed.
    """
    try:
        return importlib.import_module("mujoco")
    except ImportError as error:
        raise ProofError(
            "the proof simulates its worlds with MuJoCo, which is missing; pip install 'physid_drake[proof]'."
        ) from error


# ---------------------------------------------------------------------------------------------------- the object


def plan_size(shape: Solid) -> tuple[float, float]:
    """Extent of the outline along x and y of B [m]."""
    if isinstance(shape, Box):
        return shape.size[0], shape.size[1]
    if isinstance(shape, Cylinder):
        return 2.0 * shape.radius, 2.0 * shape.radius
    spans = np.ptp(np.array(shape.polygon), axis=0)
    return float(spans[0]), float(spans[1])


def height_of(shape: Solid) -> float:
    """Along z [m]."""
    if isinstance(shape, Box):
        return shape.size[2]
    return shape.length if isinstance(shape, Cylinder) else shape.height


def outline_of(shape: Box | Prism) -> Array:
    """Corners (n, 2) in B, counter-clockwise [m]."""
    if isinstance(shape, Prism):
        return np.array(shape.polygon)
    x, y = shape.size[0] / 2.0, shape.size[1] / 2.0
    return np.array([[-x, -y], [x, -y], [x, y], [-x, y]])


def stretched(shape: Solid, ratio: float) -> Solid:
    """The shape with its plan ``ratio`` times as large, at the same height."""
    if isinstance(shape, Box):
        return Box(size=(shape.size[0] * ratio, shape.size[1] * ratio, shape.size[2]))
    if isinstance(shape, Cylinder):
        return Cylinder(radius=shape.radius * ratio, length=shape.length, axis="z")
    polygon = tuple((x * ratio, y * ratio) for x, y in shape.polygon)
    return Prism(polygon=polygon, height=shape.height)


def plan_moments(shape: Solid) -> Array:
    """Mean of x x, y y and x y over the underside (3,) [m^2]."""
    if isinstance(shape, Cylinder):
        return np.array([1.0, 1.0, 0.0]) * shape.radius**2 / 4.0
    corners = outline_of(shape)
    following = np.roll(corners, -1, axis=0)
    areas = (corners[:, 0] * following[:, 1] - corners[:, 1] * following[:, 0]) / 2.0
    # Over a triangle with one corner at 0: the mean of u v is (sum u_i v_i + sum u sum v) / 12.
    total = corners + following
    squares = corners**2 + following**2 + total**2
    cross = corners.prod(axis=1) + following.prod(axis=1) + total.prod(axis=1)
    means = np.column_stack([squares, cross]) / 12.0
    moments: Array = areas @ means / areas.sum()
    return moments


def gyration_squared(shape: Solid) -> float:
    """Of a uniform density about z [m^2]."""
    return float(plan_moments(shape)[:2].sum())


def distance_outside(shape: Solid, points: Array) -> Array:
    """Distance (n,) of points (n, 2) in B from the outline, negative inside [m]."""
    if isinstance(shape, Cylinder):
        distances: Array = np.hypot(*points.T) - shape.radius
        return distances
    return outline_distance(outline_of(shape), points)


def feet_of(shape: Solid) -> tuple[Array, Array]:
    """Places (n, 2) in B [m] and shares (n,) of a uniform pressure; their second moments are the underside's."""
    if isinstance(shape, Box):
        return _grid_feet(shape)
    if isinstance(shape, Cylinder):
        return _ring_feet(shape.radius)
    return _triangle_feet(shape)


def _grid_feet(shape: Box) -> tuple[Array, Array]:
    long_side = shape.size[0] / shape.size[1]
    nx = min(15, max(5, round(math.sqrt(80.0 * long_side))))
    ny = max(5, math.ceil(72 / nx))
    # Middles of cells have 1 - 1/n^2 of the second moment; spreading them out restores it.
    x, y = (
        ((np.arange(n) + 0.5) / n - 0.5) * side / math.sqrt(1.0 - 1.0 / n**2)
        for n, side in ((nx, shape.size[0]), (ny, shape.size[1]))
    )
    grid = np.meshgrid(x, y, indexing="ij")
    return np.column_stack([axis.ravel() for axis in grid]), np.full(nx * ny, 1.0 / (nx * ny))


def _ring_feet(radius: float, rings: int = 4) -> tuple[Array, Array]:
    counts = 6 * np.arange(1, rings + 1)
    edges = np.sqrt(np.concatenate([[0], np.cumsum(counts)]) / counts.sum()) * radius
    places = []
    for ring, count in enumerate(counts.tolist()):
        middle = math.sqrt((edges[ring] ** 2 + edges[ring + 1] ** 2) / 2.0)
        angles = 2.0 * math.pi * (np.arange(count) + 0.5 * (ring % 2)) / count
        places.append(middle * np.column_stack([np.cos(angles), np.sin(angles)]))
    return np.concatenate(places), np.full(counts.sum(), 1.0 / counts.sum())


def _triangle_feet(shape: Prism) -> tuple[Array, Array]:
    corners = outline_of(shape)
    parts = math.ceil(math.sqrt(72 / len(corners)))
    places, shares = [], []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        area = (a[0] * b[1] - a[1] * b[0]) / 2.0
        for i in range(parts):
            for j in range(parts - i):
                # The upright and the inverted small triangle of one cell of the subdivision.
                thirds = [1.0 / 3.0, 2.0 / 3.0][: 2 if i + j < parts - 1 else 1]
                places += [((i + t) * a + (j + t) * b) / parts for t in thirds]
                shares += [area / parts**2] * len(thirds)
    feet, weights = np.array(places), np.array(shares) / np.sum(shares)
    lacking = gyration_squared(shape) / float(weights @ (feet**2).sum(axis=1))
    return feet * math.sqrt(lacking), weights


# ---------------------------------------------------------------------------------------------- the hand's motion


@dataclass(frozen=True, kw_only=True, eq=False)
class HandPath:
    """A tip whose velocity is linear between knots; it rests before the first and after the last.

    Attributes:
        times: (n,) s.
        start: (2,) place in W before the first knot [m].
        velocities: (n, 2) m/s, zero at both ends.
    """

    times: Array
    start: Array
    velocities: Array

    def position(self, times: Array) -> Array:
        """Places (n, 2) in W [m]."""
        spans = np.diff(self.times)[:, None]
        steps = np.cumsum((self.velocities[1:] + self.velocities[:-1]) / 2.0 * spans, axis=0)
        places = self.start + np.concatenate([np.zeros((1, 2)), steps])
        at = np.clip(times, self.times[0], self.times[-1])
        k = np.clip(np.searchsorted(self.times, at, side="right") - 1, 0, len(spans) - 1)
        since = (at - self.times[k])[:, None]
        gain = (self.velocities[k + 1] - self.velocities[k]) / spans[k]
        result: Array = places[k] + (self.velocities[k] + gain * since / 2.0) * since
        return result


# ------------------------------------------------------------------------------------------- what a world is made of


@dataclass(frozen=True, kw_only=True)
class Grain:
    """An ellipse of friction: ``ratio`` of its axes (geometric mean 1), ``angle`` of the slippery one [rad]."""

    ratio: float
    angle: float


@dataclass(frozen=True, kw_only=True)
class Slosh:
    """A ``fraction`` of the mass on springs along x and y of B: ``frequency`` [Hz] and ``damping`` ratio."""

    fraction: float
    frequency: float
    damping: float


@dataclass(frozen=True, kw_only=True)
class SprungTip:
    """A tip on springs: ``compliance`` [m/N], and ``damping`` as a ratio with the object's mass on the spring."""

    compliance: float
    damping: float


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A world before it is built; its defaults are the plain cell.

    Attributes:
        shape: of the object, standing on the table.
        mass: kg.
        support_friction: between object and table.
        hand_friction: between tip and object.
        tip_radius: of a sphere [m].
        tip_height: of its centre above the table [m].
        com: centre of mass from Bo along x and y of B [m].
        inertia_ratio: moment of inertia over that of uniform density.
        pressure: weights (rows along x, columns along y) of a regular grid over the underside; None: uniform.
        table_grain: friction ellipse in W.
        underside_grain: friction ellipse in B.
        slosh: a part of the mass that swings.
        sprung_tip: compliance of the hand.
        restitution: of tip and object; 0 is `RESIDUAL_RESTITUTION`.
        tilt: gravity's components along the table over g: sines of angles about -y and x.
    """

    shape: Solid
    mass: float
    support_friction: float
    hand_friction: float
    tip_radius: float
    tip_height: float
    com: tuple[float, float] = (0.0, 0.0)
    inertia_ratio: float = 1.0
    pressure: tuple[tuple[float, ...], ...] | None = None
    table_grain: Grain | None = None
    underside_grain: Grain | None = None
    slosh: Slosh | None = None
    sprung_tip: SprungTip | None = None
    restitution: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)


@dataclass(kw_only=True)
class Moment:
    """The state of a push at the start of a step, in W: what laws of friction and force may depend on.

    Attributes:
        time: since the recording of this push began [s].
        push: its index.
        pushes: how many there are.
        mass: of the object [kg].
        gyration_squared: of the uniform object [m^2].
        x: of Bo [m].
        y: of Bo [m].
        yaw: rad.
        vx: of the centre of mass [m/s].
        vy: of the centre of mass [m/s].
        spin: rad/s.
        slid: path length of the centre of mass in this push [m].
        slid_time: time in this push during which it moved [s].
        foot_places: (n, 2) in W [m].
        foot_velocities: (n, 2) in W [m/s].
    """

    push: int
    pushes: int
    mass: float
    gyration_squared: float
    time: float = 0.0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0
    slid: float = 0.0
    slid_time: float = 0.0
    foot_places: Array = field(default_factory=lambda: np.empty((0, 2)))
    foot_velocities: Array = field(default_factory=lambda: np.empty((0, 2)))


class Effect:
    """One piece of physics or of the sensors that the plain cell leaves out. What is not overridden does nothing."""

    name: ClassVar[str]
    strengths: ClassVar[tuple[str, ...]] = ()
    """Parameters whose defaults, all of them, make it nothing."""

    @property
    def is_null(self) -> bool:
        """Whether its parameters make it nothing; then it is not built in at all."""
        return all(getattr(self, name) == getattr(type(self), name) for name in self.strengths)

    def build(self, plan: Plan) -> Plan:
        """What it changes before the world is built."""
        return plan

    def friction(self, moment: Moment) -> Array | float:
        """Factor on the friction of every foot (n,) or of all."""
        raise NotImplementedError

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        """Force at the centre of mass in W [N] and torque about z [N m]."""
        raise NotImplementedError

    def tip(self, times: Array, places: Array) -> Array:
        """Where the tip (its carriage) really goes (n, 2), given where the recording says it is, on even times."""
        return places

    def tracked(self, times: Array, poses: Array) -> Array:
        """What the tracker says (n, 3) of a motion on even times."""
        return poses


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What one push did, without noise.

    Attributes:
        times: (n,) even times from 0 [s].
        poses: (n, 3) x, y, yaw of B as the tracker would say without noise [m, rad].
        true_poses: (n, 3) the same as it was.
        tips: (n, 2) of the tip as the recording would say without noise [m].
        forces: (n, 3) of the hand on the object [N].
        rested: whether the object came to rest.
    """

    times: Array
    poses: Array
    true_poses: Array
    tips: Array
    forces: Array
    rested: bool


def damping_ratio(restitution: float) -> float:
    """Of the tip's contact, as a ratio, that gives a coefficient of restitution between 0.0017 and 1."""
    wanted = min(0.98, max(restitution, RESIDUAL_RESTITUTION))
    low, high = 1e-3, _TIP_DAMPING
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if _bounce(middle) > wanted else (low, middle)
    return (low + high) / 2.0


def _bounce(ratio: float) -> float:
    """Restitution of a spring and damper that lets go where its force is zero."""
    if ratio < 1.0:
        root = math.sqrt(1.0 - ratio**2)
        phase = math.pi - math.atan2(2.0 * ratio * root, 1.0 - 2.0 * ratio**2)
        # Past ratio 1/sqrt 2 the force vanishes in the other branch of the arc tangent, which atan2 takes by itself.
        return math.exp(-ratio / root * phase)
    root = math.sqrt(max(ratio**2 - 1.0, 1e-12))
    share = (ratio - root) / (ratio + root)
    return share * math.exp(2.0 * share * math.log(share) / (1.0 - share))


# --------------------------------------------------------------------------------------------------------- the world


class PushWorld:
    """A built world; the same push gives the same bits."""

    def __init__(
        self,
        plan: Plan,
        effects: Sequence[Effect] = (),
        *,
        pushes: int = 1,
        time_step: float = TIME_STEP,
    ) -> None:
        """Build the world of ``plan`` with ``effects``; those whose parameters are null are left out."""
        self._effects = tuple(effect for effect in effects if not effect.is_null)
        for effect in self._effects:
            plan = effect.build(plan)
        self.plan, self._pushes, self._dt = plan, pushes, time_step
        self._friction_laws = [e.friction for e in self._effects if type(e).friction is not Effect.friction]
        self._wrenches = [e.wrench for e in self._effects if type(e).wrench is not Effect.wrench]
        self._turn = plan.table_grain.angle if plan.table_grain is not None else 0.0
        self._feet, self._weights = weighted_feet(plan)
        self._mujoco = load_mujoco()
        self._model = self._mujoco.MjModel.from_xml_string(_xml(plan, self._feet, self._weights, time_step))
        self._state = self._mujoco.MjData(self._model)
        self._adjust()

    def _adjust(self) -> None:
        """Sets what XML cannot: the impedance scale, gravity in the simulation's frame, the solver's tolerance."""
        model, plan = self._model, self.plan
        body = self._body = model.body("object").id
        model.body_invweight0[body] = [_SCALE / plan.mass, model.body_invweight0[body, 1] * _SCALE]
        # A light body in the pair would change the tip's stiffness without a word.
        for link in ("carriage", "tip"):
            model.body_invweight0[model.body(link).id] = 0.0
        model.stat.meaninertia = plan.mass  # the tolerance is relative to it, and must not be to the carriage
        self._q, self._v = int(model.joint("object").qposadr[0]), int(model.joint("object").dofadr[0])
        self._tip_geom = model.geom("tip").id
        self._tip_damping = _tip_law(plan)[1]
        self._faces, self._reach = _half_planes(plan.shape)
        gx, gy = self._to_simulation(*(GRAVITY * s for s in plan.tilt))
        model.opt.gravity[:] = gx, gy, -GRAVITY * math.sqrt(1.0 - plan.tilt[0] ** 2 - plan.tilt[1] ** 2)

    def _to_simulation(self, x: float, y: float) -> tuple[float, float]:
        """A vector of W in the simulation's frame, whose x is the table's slippery axis."""
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
        begin = 0 if path is None or duration is not None else self._first_touch(pose, actual)
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
        z = height_of(self.plan.shape) / 2.0 - _SINKAGE
        state.qpos[q : q + 7] = [*self._to_simulation(*pose[:2]), z, math.cos(half), 0.0, 0.0, math.sin(half)]
        state.qvel[v : v + 6] = [*self._to_simulation(*velocity[:2]), 0.0, 0.0, 0.0, velocity[2]]
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
        parts, touched, touch_steps = self._refine(1), 0, round(_TOUCH_TIME / self._dt)
        log, forces = np.empty((len(tips), 7)), np.zeros(((len(tips) - 1) // every + 1, 3))
        log[begin] = qpos[q : q + 7]
        lawful, quiet = bool(self._friction_laws or self._wrenches), 0
        size = math.sqrt(moment.gyration_squared)
        for k in range(begin, len(speeds)):
            if lawful:
                self._apply_laws(moment, k)
            near = k < stop + touch_steps and self._tip_is_near()
            touched = touched + self._tip_touches() if near else 0
            wanted = _TOUCH_SUBSTEPS if near and touched <= touch_steps else 1
            if wanted != len(parts):
                parts = self._refine(wanted)
            for part in parts:
                qpos[:2], qvel[:2] = turned[k] + part * model.opt.timestep * speeds[k], speeds[k]
                step(model, state)
            log[k + 1] = qpos[q : q + 7]
            if k % every == 0:
                forces[k // every] = self._hand_force()
                slow = max(abs(qvel[v]), abs(qvel[v + 1]), size * abs(qvel[v + 5])) < _REST_SPEED
                quiet = quiet + every if slow and stops and k >= stop else 0
                if quiet * self._dt >= _REST_TIME:
                    return log, forces, k + 1
        return log, forces, len(log) - 1

    def _refine(self, parts: int) -> range:
        """Makes steps so many times finer; friction stops slip within one, or a stiff touch would be over before."""
        step = self._dt / parts
        self._model.opt.timestep = step
        self._model.pair_solreffriction[:, 1] = -_IMPEDANCE / step
        # A touch is damped the more, so that it is over at once and does not bounce.
        damping = min(self._tip_damping, _TIP_RATES[parts > 1] * TIME_STEP / self._dt)
        self._model.pair_solref[len(self._feet) :, 1] = -damping * _SCALE
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
        moment.vx, moment.vy = ux - spin * (sy * bx + cy * by), uy + spin * (cy * bx - sy * by)
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

    def _tip_is_near(self) -> bool:
        """Whether the tip may touch the object within three steps, or does."""
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
            outside = math.hypot(dx, dy) - reach
        else:
            outside = max(nx * local[0] + ny * local[1] - offset for nx, ny, offset in self._faces)
        near: bool = outside - self.plan.tip_radius < 3.0 * self._dt * fast + 1e-5
        return near

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


def _half_planes(shape: Solid) -> tuple[list[tuple[float, float, float]], float]:
    """Outward normals and offsets of a polygon's faces (none of a disc), and the greatest radius [m]."""
    if isinstance(shape, Cylinder):
        return [], shape.radius
    corners = outline_of(shape)
    edges = np.roll(corners, -1, axis=0) - corners
    normals = np.column_stack([edges[:, 1], -edges[:, 0]]) / np.hypot(*edges.T)[:, None]
    offsets = (normals * corners).sum(axis=1)
    rows = np.column_stack([normals, offsets]).tolist()
    return [(nx, ny, offset) for nx, ny, offset in rows], float(np.hypot(*corners.T).max())


def weighted_feet(plan: Plan) -> tuple[Array, Array]:
    """Places (n, 2) in B [m] and stiffness shares (n,) of the feet; those without weight are left out."""
    feet, weights = feet_of(plan.shape)
    if plan.pressure is None:
        return feet, weights
    grid = np.array(plan.pressure)
    if isinstance(plan.shape, Cylinder):
        low, high = np.outer([-1.0, 1.0], [plan.shape.radius] * 2)
    else:
        corners = outline_of(plan.shape)
        low, high = corners.min(axis=0), corners.max(axis=0)
    cells = np.clip(((feet - low) / (high - low) * grid.shape).astype(int), 0, np.array(grid.shape) - 1)
    weights = weights * grid[cells[:, 0], cells[:, 1]]
    keep = weights > 1e-6 * weights.max()
    return feet[keep], weights[keep] / weights[keep].sum()


# ----------------------------------------------------------------------------------------------------- MuJoCo's XML


def _xml(plan: Plan, feet: Array, weights: Array, time_step: float) -> str:
    """The model. Feet and tip are direct springs and dampers (negative ``solref``), scaled by `_SCALE`."""
    height = height_of(plan.shape)
    soft = f'condim="3" solimp="{_IMPEDANCE} {_IMPEDANCE} .001" solreffriction="0 {-_IMPEDANCE / time_step!r}"'
    capsule = plan.underside_grain is not None
    # A lying capsule touches with both ends, so each end is half a foot.
    spring, damper = (value * _SCALE / (2.0 if capsule else 1.0) for value in _foot_law())
    pairs = "".join(
        f'<pair geom1="table" geom2="foot{i}" {soft} solref="{-spring * share!r} {-damper * share!r}"/>'
        for i, share in enumerate(weights.tolist())
    )
    stiffness, drag = (value * _SCALE for value in _tip_law(plan))
    rub = f'friction="{plan.hand_friction!r} {plan.hand_friction!r}"'
    walls, names = _walls(plan.shape)
    touch = "".join(
        f'<pair geom1="tip" geom2="{name}" {soft} {rub} solref="{-stiffness!r} {-drag!r}"/>' for name in names
    )
    return f"""<mujoco><option timestep="{time_step!r}" integrator="Euler" cone="elliptic"
        impratio="{_FRICTION_RATIO!r}" tolerance="1e-12"/>
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


def _foot_law() -> tuple[float, float]:
    """Stiffness and damping of all feet together over the mass [1/s^2, 1/s]: critically damped."""
    return GRAVITY / _SINKAGE, 2.0 * math.sqrt(GRAVITY / _SINKAGE)


def _tip_law(plan: Plan) -> tuple[float, float]:
    """Stiffness and damping of the tip's contact over the object's mass [1/s^2, 1/s]."""
    if plan.sprung_tip is not None:
        ratio, frequency = _SPRUNG_TIP_LAW
    else:
        ratio = damping_ratio(plan.restitution)
        frequency = min(_TIP_FREQUENCY, _TIP_RATES[1] / (2.0 * ratio))
    return frequency**2, 2.0 * ratio * frequency


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
    return _SPRUNG_TIP_MASS * plan.mass if plan.sprung_tip is not None else 1e-4


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
