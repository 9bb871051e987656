"""PyBullet as a peer, the engine of the paper: a box, or feet with soft contacts.

Its friction directions are fixed in the world, so a slide veers by up to 13 degrees whatever the settings,
and a box stands on its four corners.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pybullet

from peers.push import FRICTION, GRAVITY, MASS, SIZE, TIP_HEIGHT, TIP_RADIUS, Array, Push, planar

FOOT_RADIUS = 0.003  # m
_LENGTH, _WIDTH, _HEIGHT = SIZE


class _Prescribed:
    """Steps a client with a table, a tip of mass 0 that is overwritten, and the object of a subclass."""

    def __init__(self, time_step: float, iterations: int) -> None:
        self._dt, self._client = time_step, pybullet.connect(pybullet.DIRECT)
        c = self._client
        pybullet.setGravity(0, 0, -GRAVITY, physicsClientId=c)
        pybullet.setPhysicsEngineParameter(fixedTimeStep=time_step, numSolverIterations=iterations, physicsClientId=c)
        plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=c)
        sphere = pybullet.createCollisionShape(pybullet.GEOM_SPHERE, radius=TIP_RADIUS, physicsClientId=c)
        self._table = pybullet.createMultiBody(0, plane, physicsClientId=c)
        self._tip = pybullet.createMultiBody(0, sphere, basePosition=[1, 1, TIP_HEIGHT], physicsClientId=c)
        self._object = self._add_object()
        # Bullet's own damping of 4 % per second is no friction of the table's.
        pybullet.changeDynamics(self._object, -1, linearDamping=0, angularDamping=0, physicsClientId=c)

    def _add_object(self) -> int:
        raise NotImplementedError

    def _write_parameters(self) -> None:
        """A pair's friction is the product: the object's is 1."""
        c = self._client
        pybullet.changeDynamics(self._object, -1, mass=MASS, lateralFriction=1.0, physicsClientId=c)
        for other in (self._table, self._tip):
            pybullet.changeDynamics(other, -1, lateralFriction=FRICTION, physicsClientId=c)

    def rollout(self, push: Push) -> Array:
        """End pose (3,) [m, rad]."""
        return self.motion(push)[-1]

    def motion(self, push: Push) -> Array:
        """Poses (n, 3) [m, rad] after every step."""
        self._write_parameters()
        c, tip, body = self._client, self._tip, self._object
        places = np.column_stack([push.grid(self._dt), np.full(round(1.5 / self._dt) + 1, TIP_HEIGHT)])
        speeds = (np.diff(places, axis=0) / self._dt).tolist()
        pybullet.resetBasePositionAndOrientation(body, [0, 0, _HEIGHT / 2], [0, 0, 0, 1], physicsClientId=c)
        pybullet.resetBaseVelocity(body, [0, 0, 0], [0, 0, 0], physicsClientId=c)
        log = []
        for place, speed in zip(places[:-1].tolist(), speeds, strict=True):
            pybullet.resetBasePositionAndOrientation(tip, place, (0, 0, 0, 1), physicsClientId=c)
            pybullet.resetBaseVelocity(tip, speed, physicsClientId=c)
            pybullet.stepSimulation(physicsClientId=c)
            log.append(pybullet.getBasePositionAndOrientation(body, physicsClientId=c))
        places, quaternions = (np.array(column) for column in zip(*log, strict=True))
        return planar(places, *quaternions[:, [3, 0, 1, 2]].T)


class BulletBox(_Prescribed):
    """A box on a plane, Bullet's defaults but for the damping."""

    def __init__(self, time_step: float, iterations: int = 50) -> None:
        super().__init__(time_step, iterations)

    def _add_object(self) -> int:
        half = [0.5 * side for side in SIZE]
        shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half, physicsClientId=self._client)
        return int(pybullet.createMultiBody(MASS, shape, physicsClientId=self._client))


class BulletFeet(_Prescribed):
    """4 x 4 spheres under the box with contact stiffness: what Bullet can do at its best."""

    def __init__(self, time_step: float, iterations: int = 50) -> None:
        super().__init__(time_step, iterations)
        pybullet.changeDynamics(
            self._object, -1, contactStiffness=1e3, contactDamping=10.0, physicsClientId=self._client
        )

    def _add_object(self) -> int:
        """From a URDF, since Bullet's arrays of shapes silently end at sixteen."""
        cells = (np.arange(4) + 0.5) / 4 - 0.5
        feet = "".join(
            f'<collision><origin xyz="{_LENGTH * x} {_WIDTH * y} {FOOT_RADIUS - _HEIGHT / 2}"/>'
            f'<geometry><sphere radius="{FOOT_RADIUS}"/></geometry></collision>'
            for x in cells
            for y in cells
        )
        inertia = MASS / 12.0 * (np.dot(SIZE, SIZE) - np.square(SIZE))
        text = f"""<robot name="eraser"><link name="eraser"><inertial><mass value="{MASS}"/>
            <inertia ixx="{inertia[0]}" iyy="{inertia[1]}" izz="{inertia[2]}" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><geometry><box size="{_LENGTH} {_WIDTH} {_HEIGHT - 0.004}"/></geometry></collision>
            {feet}</link></robot>"""
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "eraser.urdf"
            file.write_text(text, encoding="utf-8")
            flags = pybullet.URDF_USE_INERTIA_FROM_FILE
            return int(pybullet.loadURDF(str(file), flags=flags, physicsClientId=self._client))
