"""The state of the plant between Drake's steps: where object and hand are, and what impulses change of it."""

from __future__ import annotations

import cmath
import math

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.framework import Context

from physid_drake.cell.diagram import Scene
from physid_drake.cell.lift import Lift
from physid_drake.cell.motion import Start, planar_pose
from physid_drake.cell.object_state import ObjectState, reader_of
from physid_drake.cell.setters import Body
from physid_drake.cell.touch import Planar

Array = NDArray[np.float64]

PARKED = (0.0, 0.0, 10.0)  # m: a hand that takes no part


class PlantState:
    """Positions and velocities of the plant: sent to Drake before a step, fetched after it.

    Answers are plain floats, since a rollout asks at every time step.
    """

    def __init__(self, scene: Scene, root: Context) -> None:
        """Prepare for the plant of ``scene``, whose diagram has the Context ``root``."""
        self._scene, self._plant = scene, scene.plant
        self._context = scene.plant.GetMyMutableContextFromRoot(root)
        nq = scene.plant.num_positions()
        self._q = scene.object.floating_positions_start()
        self._v = nq + scene.object.floating_velocities_start_in_v()
        self._hand_q = [joint.position_start() for joint in scene.joints]
        self._hand_v = [nq + joint.velocity_start() for joint in scene.joints]
        self._round = scene.solid.rolling_radius is not None  # a rolling one is round at every angle

    def begin(self, body: Body, start: Start, rest: Array) -> None:
        """Place the object, and park the hand.

        Args:
            body: mass, centre of mass and inertia of the object.
            start: its pose and velocity.
            rest: (7,) the settled pose of B at the origin with yaw 0.
        """
        reader = self._reader = reader_of(body, self._scene)
        self._lift = Lift(reader.underside, reader.stiffness) if reader.lifted else None
        self._mass = body.mass
        self._cx, self._cy = float(body.p_BBcm[0]), float(body.p_BBcm[1])
        self._inertias = tuple(body.mass * body.inertia_ratio * g for g in self._scene.solid.gyration)
        x = self._x = np.zeros(self._plant.num_multibody_states())
        if self._hand_q:
            x[self._hand_q] = PARKED
        px, py, yaw = start.pose
        c, s = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
        w, i, j, k = rest[:4]
        x[self._q : self._q + 4] = [c * w - s * k, c * i - s * j, c * j + s * i, c * k + s * w]
        x[self._q + 4 : self._q + 7] = [px, py, rest[6]]
        vx, vy, wz = start.velocity
        wx, wy = self._rolling(vx, vy, yaw)
        x[self._v : self._v + 6] = [wx, wy, wz, vx, vy, 0.0]

    def _rolling(self, vx: float, vy: float, yaw: float) -> tuple[float, float]:
        """Rates about x and y of W: a lying cylinder that moves across its axis starts rolling, not sliding."""
        radius = self._scene.solid.rolling_radius
        if radius is None:
            return 0.0, 0.0
        rate = (vx * math.cos(yaw) + vy * math.sin(yaw)) / radius
        return -rate * math.sin(yaw), rate * math.cos(yaw)

    def send(self) -> None:
        """Write the state into Drake's Context."""
        self._plant.SetPositionsAndVelocities(self._context, self._x)

    def fetch(self) -> None:
        """Read the state from Drake's Context."""
        self._x = self._plant.GetPositionsAndVelocities(self._context)

    # Where object and hand are, and how they move.

    def pose(self) -> Array:
        """Pose (7,) of B: quaternion wxyz and position [m]."""
        return self._x[self._q : self._q + 7].copy()

    @property
    def height(self) -> float:
        """Of Bo above the table [m]."""
        return float(self._x[self._q + 6])

    @property
    def inertia(self) -> float:
        """Of the object about z through Bcm [kg m^2]."""
        return self._inertias[2]

    def twist(self) -> Planar:
        """Planar velocity vx, vy, wz of Bo in W."""
        wz, vx, vy = self._x[self._v + 2 : self._v + 5].tolist()
        return vx, vy, wz

    def heading(self) -> tuple[float, float]:
        """Yaw of B [rad], and its rate [rad/s]."""
        yaw = planar_pose(*self._x[self._q : self._q + 6].tolist())[2]
        return yaw, float(self._x[self._v + 2])

    def section(self, height: float) -> tuple[Planar, Planar]:
        """Pose and twist of the object's section at a height [m], the hand tip's.

        A can that leans by 1 mrad has moved there by more than the contact is deep.
        """
        q, v = self._q, self._v
        w, i, j, k, px, py, pz = self._x[q : q + 7].tolist()
        wx, wy, wz, vx, vy = self._x[v : v + 5].tolist()
        above = height - pz
        pose = planar_pose(w, i, j, k, px, py)
        if self._round:
            return pose, (vx, vy, wz)
        px += 2.0 * (i * k + w * j) * above
        py += 2.0 * (j * k - w * i) * above
        return (px, py, pose[2]), (vx + wy * above, vy - wx * above, wz)

    def object_state(self, time: float, span: float) -> ObjectState:
        """The object as force laws see it when a time step of ``span`` [s] begins, ``time`` [s] after the start."""
        q, v = self._q, self._v
        X_WB, V_WB = self._x[q : q + 7].tolist(), self._x[v : v + 6].tolist()
        return self._reader.at(time, span, X_WB, V_WB)

    def over_table(self) -> bool:
        """Whether the table is under the centre of mass."""
        edge = self._scene.edge
        if edge is None:
            return True
        (low, high), (x, y) = edge, self.object_state(0.0, 0.0).p_WBcm.tolist()
        return bool(low.real <= x <= high.real and low.imag <= y <= high.imag)

    def turns(self) -> bool:
        """Whether the object turns about a place under it or close by."""
        vx, vy, wz = self.twist()
        return math.hypot(vx, vy) < abs(wz) * self._reader.underside.reach

    def lean(self) -> tuple[float, float, float]:
        """Depth of Bo's foot in the table [m], and how it grows along x and y of B [-]."""
        return self._reader.lean(self._x[self._q : self._q + 7].tolist())

    def hand_velocity(self) -> tuple[float, float, float]:
        """Of the hand along x, y and z of W [m/s]."""
        x, y, z = self._hand_v
        return float(self._x[x]), float(self._x[y]), float(self._x[z])

    # Changes.

    def weigh_hand(self, mass: float) -> None:
        """Give each of the hand's links a mass [kg]."""
        for joint in self._scene.joints:
            link = joint.child_body()
            if link.get_mass(self._context) != mass:
                link.SetMass(self._context, mass)

    def set_hand(self, place: list[float], height: float, velocity: tuple[float, float]) -> None:
        """Put the hand's tip at a place (2,) and a height [m], with a velocity [m/s] along x and y."""
        x, (qx, qy, qz), (vx, vy, vz) = self._x, self._hand_q, self._hand_v
        x[qx], x[qy], x[qz] = place[0], place[1], height
        x[vx], x[vy], x[vz] = velocity[0], velocity[1], 0.0

    def stop(self) -> None:
        """Take all of the object's velocity."""
        self._x[self._v : self._v + 6] = 0.0

    def set_twist(self, twist: Planar) -> None:
        """Give Bo a planar velocity vx, vy, wz in W."""
        v = self._v
        self._x[v + 3], self._x[v + 4], self._x[v + 2] = twist

    def keep_momentum(self, yaw: float, spin: float, span: float) -> None:
        """Give Bcm the velocity that forces gave it in a step of ``span`` [s] from a yaw [rad] and a spin [rad/s].

        Drake steps the velocity of Bo, which goes round Bcm, along a straight line: off by half the spin cubed times
        the arm and the step squared, each time the same way. What no force acts on would not go straight on.
        """
        if self._cx == 0.0 == self._cy:
            return
        after, rate = self.heading()
        vx, vy = self._x[self._v + 3 : self._v + 5].tolist()
        arm = complex(self._cx, self._cy)
        was, now = arm * cmath.exp(1j * yaw), arm * cmath.exp(1j * after)
        velocity = complex(vx, vy) + 1j * rate * (was - now) - span * spin**2 * was
        self.set_twist((velocity.real, velocity.imag, rate))

    def kick(self, yaw: float, jx: float, jy: float, spin: float) -> Planar:
        """Give the object a planar impulse [N s] at Bcm and an angular one [N m s]; returns Bo's gain in velocity."""
        c, s = math.cos(yaw), math.sin(yaw)
        cx, cy = self._cx, self._cy
        turn = spin / self._inertias[2]
        # Bcm gets J/m; Bo moves with it and with the new spin about it.
        ox, oy = -(c * cx - s * cy), -(s * cx + c * cy)
        gain = (jx / self._mass - turn * oy, jy / self._mass + turn * ox, turn)
        self._x[self._v + 2] += gain[2]
        self._x[self._v + 3] += gain[0]
        self._x[self._v + 4] += gain[1]
        return gain

    def rock(self, yaw: float, hx: float, hy: float) -> None:
        """Give the object an angular impulse [N m s] about x and y of W; Bcm keeps its velocity."""
        ix, iy, _ = self._inertias
        c, s = math.cos(yaw), math.sin(yaw)
        about_x, about_y = (c * hx + s * hy) / ix, (c * hy - s * hx) / iy
        if self._round:
            # A rate across the axis, which the contact takes back within the time step, would turn what rolls
            # meanwhile.
            about_x = 0.0
        wx, wy = c * about_x - s * about_y, s * about_x + c * about_y
        self._x[self._v] += wx
        self._x[self._v + 1] += wy
        cx, cy = self._cx, self._cy
        self._x[self._v + 5] += wy * (c * cx - s * cy) - wx * (s * cx + c * cy)

    def give_back_lift(self, span: float, largest: float) -> None:
        """Give back the friction of depths beyond the loads, over a time step [s].

        Args:
            span: of the time step.
            largest: of the contact's friction over the cell's, where laws reach so much [-].
        """
        if self._lift is None:
            return
        yaw, spin = self.heading()
        turn, (vx, vy) = cmath.exp(1j * yaw), self._x[self._v + 3 : self._v + 5].tolist()
        force, moment = self._lift.excess(span, self.lean(), complex(vx, vy) / turn, spin)
        moment -= self._cx * force.imag - self._cy * force.real  # about Bcm
        force *= largest * span * turn
        self.kick(yaw, force.real, force.imag, largest * span * moment)
        arm = self._reader.half_height
        self.rock(yaw, arm * force.imag, -arm * force.real)

    def shift(self, dx: float, dy: float, turn: float) -> None:
        """Move the object's pose by a small planar displacement [m, rad]."""
        q = self._q
        w, i, j, k = self._x[q : q + 4].tolist()
        half = 0.5 * turn
        norm = 1.0 / math.sqrt(1.0 + half * half)
        self._x[q : q + 4] = [
            norm * (w - half * k), norm * (i - half * j), norm * (j + half * i), norm * (k + half * w),
        ]  # fmt: skip
        self._x[q + 4] += dx
        self._x[q + 5] += dy
