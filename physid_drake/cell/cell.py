"""The Cell: a Drake diagram built once, and rollouts of it."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator, SimulatorConfig
from pydrake.systems.framework import Diagram, DiagramBuilder

from physid_drake.cell.config import CellConfig
from physid_drake.cell.diagram import GRAVITY, Scene, add_scene
from physid_drake.cell.forces import ForceLaw, FrictionLaw
from physid_drake.cell.hand_path import HandPath
from physid_drake.cell.motion import Motion, Outcome, Start
from physid_drake.cell.setters import (
    Body,
    HandContactSetter,
    InertiaSetter,
    ParameterSetter,
    SupportSetter,
    check_body,
)
from physid_drake.cell.soft_tip import Mount
from physid_drake.cell.solid import Solid, solid_of
from physid_drake.cell.stepper import Stepper
from physid_drake.cell.support import PressureGrid, rest_depths
from physid_drake.recording import Shape

Array = NDArray[np.float64]

EDGE_POINTS = 200  # under an object where the table's edge cuts the underside


class Cell:
    """Table, object and hand in Drake. Built once per process; theta goes into the Context.

    Attributes:
        diagram: the Drake diagram: ``plant``, ``scene_graph`` and the parameter setters.
        solid: the object's shape.
    """

    def __init__(
        self,
        shape: Shape,
        *,
        hand_radius: float | None,
        config: CellConfig | None = None,
        table: Array | None = None,
        with_edge: bool = False,
        pressure: PressureGrid | None = None,
        gravity: float = GRAVITY,
    ) -> None:
        """Build the diagram.

        Args:
            shape: the object's.
            hand_radius: of the hand's tip [m]; None without a hand.
            config: contact, solver, friction cells.
            table: (2, 2) lower and upper corner of the table top [m]; None for an endless one. An object that
                comes to its edge is simulated again in a cell with that edge, from which it can fall.
            with_edge: model the edge from the start: point contact on a box, slower than the endless table.
            pressure: under the object, where it is not even.
            gravity: m/s^2; more than the earth's where a body stands for a part of what it carries.

        Raises:
            CellError: if the shape cannot be built.
        """
        self.config = config or CellConfig()
        self._build = (shape, hand_radius, table, pressure, gravity)
        self._table = None if table is None or with_edge else np.asarray(table, dtype=np.float64)
        self._at_edge: Cell | None = None
        edge = np.asarray(table, dtype=np.float64) if table is not None and with_edge else None
        self.solid: Solid = solid_of(shape)
        builder = DiagramBuilder()
        self.scene: Scene = add_scene(
            builder, self.config, self.solid, hand_radius, edge=edge, pressure=pressure, gravity=gravity
        )
        cells = self.config.friction_cells[0] * self.config.friction_cells[1]
        self._cells = cells
        self.setters = setters_of(self.scene, self.config)
        for setter in self.setters:
            builder.AddSystem(setter.system)
        self.diagram: Diagram = builder.Build()
        self.simulator = Simulator(self.diagram)
        self._take_integrator()
        self._stepper = Stepper(self.scene, self.simulator, self.config.solver, hand_radius)

    def _take_integrator(self) -> None:
        """A new one of Drake's, if the scheme has one."""
        solver = self.config.solver
        if solver.scheme == "cenic":
            ApplySimulatorConfig(
                SimulatorConfig(
                    integration_scheme="cenic",
                    # A hair above the time step: rounding would else split every other time step in two. Never a part
                    # of it: what laws give for a time step would act in its first step.
                    max_step_size=1.001 * max(solver.slide_time_step_s, solver.time_step_s),
                    use_error_control=False,
                ),
                self.simulator,
            )

    def set_body(self, body: Body) -> None:
        """Write the parameters into the Context.

        Raises:
            ParameterError: if one is not physical.
        """
        check_body(body, self._cells)
        root = self.simulator.get_mutable_context()
        for setter in self.setters:
            setter.apply(root, body)

    def rollout(
        self,
        body: Body,
        *,
        start: Start,
        path: HandPath | None,
        begin: float,
        end: float,
        hand_height: float | None = None,
        laws: Sequence[ForceLaw] = (),
        frictions: Sequence[FrictionLaw] = (),
        mount: Mount | None = None,
    ) -> Motion:
        """Simulate one push.

        Args:
            body: the physical parameters.
            start: the object's state at ``begin``.
            path: the hand's path; None without a hand.
            begin: start time [s].
            end: end time [s].
            hand_height: of the tip's contact above the table [m]; half the object's height if None.
            laws: forces beyond weight, Coulomb friction and the hand.
            frictions: friction laws; the contact holds the largest friction of each, the law gives back the rest.
            mount: what holds the hand's tip where it gives way; None for a rigid hand.
        """
        self.set_body(holding_body(body, frictions))
        motion = self._stepper.run(
            body=body,
            start=start,
            rest=self.rest_pose(body),
            path=path,
            height=0.5 * self.solid.height if hand_height is None else hand_height,
            begin=begin,
            end=end,
            laws=laws,
            frictions=frictions,
            mount=mount,
        )
        if motion.outcome is Outcome.DIVERGED:
            self._take_integrator()  # one that stopped half way through a step never steps again
        if self._table is None or not len(motion.times) or not self._overhangs(motion):
            return motion
        return self._cell_with_edge().rollout(
            body,
            start=start,
            path=path,
            begin=begin,
            end=end,
            hand_height=hand_height,
            laws=laws,
            frictions=frictions,
            mount=mount,
        )

    def _overhangs(self, motion: Motion) -> bool:
        """Whether the object's circle was beyond the table's edge anywhere on its way."""
        assert self._table is not None
        x0, y0, x1, y1 = self.solid.underside.extent()
        reach = max(np.hypot(x, y) for x in (x0, x1) for y in (y0, y1))
        places = motion.poses[:, 4:6]
        return bool((places - reach < self._table[0]).any() or (places + reach > self._table[1]).any())

    def _cell_with_edge(self) -> Cell:
        if self._at_edge is None:
            shape, hand_radius, table, pressure, gravity = self._build
            # Few Gauss points would let an object tip over the innermost one that has left the table.
            contact = dc.replace(self.config.contact, model="point", support_points=EDGE_POINTS)
            config = dc.replace(self.config, contact=contact)
            self._at_edge = Cell(
                shape, hand_radius=hand_radius, config=config, table=table, with_edge=True, pressure=pressure,
                gravity=gravity,
            )  # fmt: skip
        return self._at_edge

    def rest_pose(self, body: Body) -> Array:
        """Settled pose (7,) of B, quaternion wxyz and position, at the origin with yaw 0."""
        depth = self.scene.rest_depth
        if self.solid.rolling_radius is not None:
            return np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5 * self.solid.height - depth])
        plane, _ = rest_depths(self.scene.support, body.p_BBcm, depth)
        pitch, roll = float(plane[1]), -float(plane[2])
        quaternion = np.array([1.0, 0.5 * roll, 0.5 * pitch, 0.0])
        z = 0.5 * self.solid.height - float(plane[0])
        return np.array([*(quaternion / np.linalg.norm(quaternion)), 0.0, 0.0, z])


def setters_of(scene: Scene, config: CellConfig) -> tuple[ParameterSetter, ...]:
    """The parameter setters of a scene: inertia, support, contact of the hand."""
    cells = config.friction_cells[0] * config.friction_cells[1]
    return (
        InertiaSetter(scene),
        SupportSetter(scene, config, cells),
        HandContactSetter(scene, config),
    )


def holding_body(body: Body, frictions: Sequence[FrictionLaw]) -> Body:
    """The body whose contact friction is the largest that the laws reach."""
    if not frictions:
        return body
    factor = math.prod(law.largest for law in frictions)
    return dc.replace(body, support_friction=factor * body.support_friction)
