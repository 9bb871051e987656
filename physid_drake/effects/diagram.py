"""A cell with effects as a Drake diagram that is safe to simulate as it comes: theta and poses are its defaults."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform
from pydrake.systems.framework import Diagram, DiagramBuilder

from physid_drake.cell import Body, CellConfig
from physid_drake.cell.cell import Cell, holding_body, setters_of
from physid_drake.cell.diagram import Scene, add_scene, spatial_inertia
from physid_drake.cell.forces import ForceLaw, FrictionLaw
from physid_drake.effects.rollout import Geometry
from physid_drake.effects.system import add_effect_forces

Array = NDArray[np.float64]

SCHEME: Final = "lagged"  # of Drake's discrete contact; its steps are those of CENIC in rollouts
CLEAR = 0.05  # m between object and hand
PORTS: Final = {
    "hand.state_desired": "in, (6,): x, y, z [m] and velocities [m/s] of the tip P in W; unfixed, nothing drives it",
    "hand.state_estimated": "out, (6,): the same as it is",
    "object.state_estimated": "out, (13,): quaternion wxyz and position of B, angular and linear velocity in W",
    "contact_results": "out: of the plant",
    "scene_graph.query": "out: for MeshcatVisualizer and other watchers",
}
"""Of the diagram; those of the hand are left out where there is none."""


def augmented_diagram(
    geometry: Geometry, cell: Cell, body: Body, config: CellConfig, hand_radius: float | None, *,
    laws: Sequence[ForceLaw], frictions: Sequence[FrictionLaw], hand_height: float,
    time_step: float,
) -> tuple[Diagram, Scene]:  # fmt: skip
    """Plant, scene graph, parameter setters and the effects' forces, with named ports (``PORTS``).

    Its Contexts begin with theta in them, the object at rest on the table at the origin and the hand 50 mm beside it.
    The table does not end. The plant takes discrete steps, so that any simulator of Drake's advances it.

    Args:
        geometry: the object's, with what effects change of it.
        cell: for rollouts, of the same geometry.
        body: theta, with what effects change of it.
        config: of the cell.
        hand_radius: of the tip [m]; None without a hand.
        laws: the effects' forces.
        frictions: the effects' friction laws.
        hand_height: of the tip above the table [m].
        time_step: of the plant [s].
    """
    discrete = dc.replace(config, solver=dc.replace(config.solver, scheme=SCHEME, time_step_s=time_step))
    solid = cell.solid
    builder = DiagramBuilder()
    com = (float(body.p_BBcm[0]), float(body.p_BBcm[1]))
    scene = add_scene(
        builder, discrete, solid, hand_radius, edge=None, pressure=geometry.pressure, gravity=geometry.gravity,
        inertia=spatial_inertia(solid, body.mass, com, body.inertia_ratio), driven=hand_radius is not None,
    )  # fmt: skip
    for setter in setters_of(scene, discrete):
        setter.make_default(holding_body(body, frictions))
        builder.AddSystem(setter.system)
    rest = cell.rest_pose(body)
    scene.plant.SetDefaultFloatingBaseBodyPose(scene.object, RigidTransform(Quaternion(rest[:4]), rest[4:7]))
    if hand_radius is not None:
        x0 = solid.outline.extent()[0]
        for joint, place in zip(scene.joints, (x0 - hand_radius - CLEAR, 0.0, hand_height), strict=True):
            joint.set_default_translation(place)
    if laws or frictions:
        add_effect_forces(builder, scene, body, time_step, laws, frictions)
    _export(builder, scene)
    return builder.Build(), scene


def _export(builder: DiagramBuilder, scene: Scene) -> None:
    plant = scene.plant
    own = scene.object.model_instance()
    if scene.joints:
        hand = scene.joints[0].model_instance()
        builder.ExportInput(plant.get_desired_state_input_port(hand), "hand.state_desired")
        builder.ExportOutput(plant.get_state_output_port(hand), "hand.state_estimated")
    builder.ExportOutput(plant.get_state_output_port(own), "object.state_estimated")
    builder.ExportOutput(plant.get_contact_results_output_port(), "contact_results")
    builder.ExportOutput(scene.scene_graph.get_query_output_port(), "scene_graph.query")
