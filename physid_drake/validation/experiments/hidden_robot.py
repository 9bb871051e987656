"""Hidden worlds: a robot whose table and object are simulated by MuJoCo, not by the cell that learns from them.

The simulation is the proof's (``validation/worlds/mujoco_world.py``), which shares no physics with the cell.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body, CellConfig
from physid_drake.cell.solid import solid_of
from physid_drake.errors import RobotError
from physid_drake.model import Model
from physid_drake.policies import PlannedPush
from physid_drake.recording import Box, Cylinder, Hand, ObjectModel, Push, Recording, Sensors, Table, planar_poses
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.shapes import height_of
from physid_drake.validation.worlds.world_plan import HandPath as WorldPath
from physid_drake.validation.worlds.world_plan import Plan

Array = NDArray[np.float64]
Pose = tuple[float, float, float]
Corners = tuple[tuple[float, float], tuple[float, float]]

SENSORS: Final = Sensors(object_position_std=3e-4, object_rotation_std=3e-3, hand_position_std=5e-5)
NO_NOISE: Final = Sensors()
FRICTION_SCATTER: Final = 0.02
"""Relative, from push to push."""
ERASER: Final = Box(size=(0.127, 0.051, 0.030))
BOTTLE: Final = Cylinder(radius=0.033, length=0.200, axis="z")
TIP_RADIUS: Final = 0.010
TABLE: Final = ((-0.8, -0.7), (0.8, 0.7))
PATIENCE: Final = 4.0
"""s after the hand has stopped in which an object may still move."""

_SAMPLE_TIME = 0.01  # s
_MASSES = (0.1, 0.9)  # kg, as the paper bounds them
_HAND_FRICTIONS = (0.15, 0.4)
_HEADING = math.radians(25.0)  # of a random push against the face's normal
_SPREAD = 0.15  # m about the origin
_TRAVELS = (0.03, 0.08)  # m, of the hand from the touch to the brake


class HiddenRobot:
    """Pushes a hidden object and records it with noise; the object stays where a push has left it.

    Attributes:
        world: the hidden parameters, for the score alone.
        lost: whether the object left the table in the last push, or did not come to rest.
    """

    def __init__(
        self,
        world: Plan,
        *,
        rng: np.random.Generator,
        start: Pose = (0.0, 0.0, 0.0),
        table: Corners = TABLE,
        sensors: Sensors = SENSORS,
        friction_scatter: float = FRICTION_SCATTER,
    ) -> None:
        """Put the object on the table.

        Args:
            world: what is hidden.
            rng: draws noise and scatter.
            start: of the object.
            table: corners of its top [m].
            sensors: standard deviations of white noise; None is none.
            friction_scatter: relative standard deviation of the support friction of one push.

        Raises:
            ProofError: if MuJoCo is not installed.
        """
        self.world, self.lost = world, False
        self._simulation = PushWorld(world)
        self._rng, self._pose, self._table = rng, start, table
        self._sensors, self._scatter, self._pushes = sensors, friction_scatter, 0

    def put(self, pose: Pose) -> None:
        """Put the object somewhere."""
        self._pose, self.lost = pose, False

    @property
    def pose(self) -> Pose:
        """Where the object is, without noise: for the score alone."""
        return self._pose

    def see(self) -> Pose:
        """Where the tracker says that the object is."""
        x, y, yaw = (np.array(self._pose) + self._rng.standard_normal(3) * self._sensors.object_std).tolist()
        return x, y, yaw

    def execute(self, push: PlannedPush, *, aim: Pose | None = None) -> Push:
        """Make a push, and record it until the object rests.

        Args:
            push: to make.
            aim: where the hand takes the object to be; None for where it is seen.

        Raises:
            RobotError: if the object is lost.
            ConfigError: if the hand would pass it.
        """
        if self.lost:
            raise RobotError("hidden world: the object was lost in the last push; put it back first.")
        path = push.path(aim or self.see(), solid_of(self.world.shape).outline, self.world.tip_radius)
        factor = max(0.5, 1.0 + self._scatter * float(self._rng.standard_normal()))
        motion = self._simulation.run(
            self._pose, WorldPath(times=path.times, start=path.start, velocities=path.velocities),
            friction_factor=factor, sample_time=_SAMPLE_TIME, patience=PATIENCE,
        )  # fmt: skip
        places = motion.true_poses[:, :2]
        low, high = np.array(self._table)
        self.lost = bool((places < low).any() or (places > high).any()) or not motion.rested
        x, y, yaw = motion.true_poses[-1].tolist()
        self._pose = (x, y, yaw)
        self._pushes += 1
        return self._recorded(motion.times, motion.poses, motion.tips)

    def recording(self, pushes: tuple[Push, ...]) -> Recording:
        """Pushes as a recording that says neither mass nor friction."""
        (x0, y0), (x1, y1) = self._table
        return Recording(
            name="hidden", description="", object=ObjectModel(shape=self.world.shape),
            table=Table(size=(x1 - x0, y1 - y0), centre=(0.5 * (x0 + x1), 0.5 * (y0 + y1))),
            hand=Hand(tip="sphere", radius=self.world.tip_radius), sensors=self._sensors, pushes=pushes,
        )  # fmt: skip

    def model(self, config: CellConfig, body: Body) -> Model:
        """A model of this table, hand and shape with another's theta."""
        return Model(
            recording="hidden", shape=self.world.shape, hand_radius=self.world.tip_radius, table=self._table,
            config=config, body=body,
        )  # fmt: skip

    def _recorded(self, times: Array, poses: Array, tips: Array) -> Push:
        seen = poses + self._rng.standard_normal(poses.shape) * self._sensors.object_std
        hand = tips + (self._sensors.hand_position_std or 0.0) * self._rng.standard_normal(tips.shape)
        flat = np.column_stack([hand, np.zeros(len(hand))])
        return Push(
            name=f"pushes/{self._pushes:03d}.csv", force=None,
            object=planar_poses(times, seen, 0.5 * height_of(self.world.shape)),
            hand=planar_poses(times, flat, self.world.tip_height),
        )  # fmt: skip


def draw_world(rng: np.random.Generator, shape: Box | Cylinder, frictions: tuple[float, float]) -> Plan:
    """A world with hidden mass, support friction and hand friction, each uniform over a range.

    Args:
        rng: draws them.
        shape: of the object, which is pushed at half its height.
        frictions: least and greatest support friction.
    """
    return Plan(
        shape=shape,
        mass=float(rng.uniform(*_MASSES)),
        support_friction=float(rng.uniform(*frictions)),
        hand_friction=float(rng.uniform(*_HAND_FRICTIONS)),
        tip_radius=TIP_RADIUS,
        tip_height=0.5 * height_of(shape),
    )


def draw_start(rng: np.random.Generator) -> Pose:
    """A place near the middle of the table, and any yaw."""
    x, y = rng.uniform(-_SPREAD, _SPREAD, 2).tolist()
    return x, y, float(rng.uniform(-math.pi, math.pi))


def draw_push(
    rng: np.random.Generator,
    shape: Box | Cylinder,
    yaw: float,
    *,
    speeds: tuple[float, float],
    direction: float | None = None,
) -> PlannedPush:
    """A random push onto a face: heading within 25 degrees of its normal, contact within half of its length.

    A disc is met within a fifth of its radius from the middle.

    Args:
        rng: draws it.
        shape: of the object.
        yaw: of the object [rad].
        speeds: least and greatest [m/s]; uniform in the logarithm.
        direction: of the motion in W [rad], only for a disc; None draws it.
    """
    if isinstance(shape, Cylinder):
        # Further from its middle a disc rolls off the tip, and a hair decides where it goes.
        half, normal = 0.4 * shape.radius, float(rng.uniform(-math.pi, math.pi)) if direction is None else direction
    else:
        face = int(rng.integers(4))
        half, normal = 0.5 * shape.size[1 - face % 2], yaw + 0.5 * math.pi * face
    return PlannedPush(
        direction=normal + float(rng.uniform(-_HEADING, _HEADING)),
        speed=float(np.exp(rng.uniform(*np.log(speeds)))),
        travel=float(rng.uniform(*_TRAVELS)),
        contact_offset=0.5 * half * float(rng.uniform(-1.0, 1.0)),
    )


def record_pushes(
    robot: HiddenRobot, rng: np.random.Generator, count: int, *, speeds: tuple[float, float]
) -> tuple[Push, ...]:
    """Random pushes, each from a random place."""
    pushes = []
    for _ in range(count):
        robot.put(draw_start(rng))
        shape = robot.world.shape
        assert isinstance(shape, Box | Cylinder)
        pushes.append(robot.execute(draw_push(rng, shape, robot.pose[2], speeds=speeds)))
    return tuple(pushes)
