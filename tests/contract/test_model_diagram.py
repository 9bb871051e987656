"""``load_model(folder).build().diagram``: safe to simulate as it comes, and it pushes as rollouts do."""

from dataclasses import replace

import numpy as np
import pytest
from plans import MODEL, TILTED
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from physid_drake.cell import CellConfig, Start
from physid_drake.effects.diagram import CLEAR, PORTS
from physid_drake.policies import PlannedPush

FINE = replace(MODEL, config=CellConfig())
TILTED_FINE = replace(TILTED, config=CellConfig())


@pytest.fixture(scope="module")
def built():
    return FINE.build()


def test_a_simulator_of_the_diagram_has_theta_and_stays_at_rest(built):
    simulator = Simulator(built.diagram)
    plant, context = built.scene.plant, built.scene.plant.GetMyContextFromRoot(simulator.get_context())
    before = plant.GetPositions(context)
    simulator.AdvanceTo(0.3)
    np.testing.assert_allclose(plant.GetPositions(context), before, atol=1e-6)
    spatial = built.scene.object.CalcSpatialInertiaInBodyFrame(context)
    assert spatial.get_mass() == MODEL.body.mass
    state = built.diagram.GetOutputPort("object.state_estimated").Eval(simulator.get_context())
    assert state[6] == pytest.approx(0.015, abs=1e-5) and state.shape == (13,)
    hand = built.diagram.GetOutputPort("hand.state_estimated").Eval(simulator.get_context())
    assert hand[:3] == pytest.approx([-0.0635 - 0.01 - CLEAR, 0.0, 0.015])


def test_it_has_the_ports_that_it_says(built):
    diagram = built.diagram
    names = {diagram.get_input_port(i).get_name() for i in range(diagram.num_input_ports())}
    names |= {diagram.get_output_port(i).get_name() for i in range(diagram.num_output_ports())}
    assert names == set(PORTS)
    without = replace(FINE, hand_radius=None).build().diagram
    assert without.num_input_ports() == 0 and without.num_output_ports() == 3


def pushed(model, push, *, time_step=None, seconds=1.5):
    """Planar end pose (3,) in the diagram, and in a rollout; the hand is driven by a trajectory of Drake's."""
    built, start = model.build(time_step=time_step), (0.0, 0.0, 0.4)
    path = push.path(start, built.cell.solid.outline, model.hand_radius)
    motion = built.rollout(start=Start(pose=start), path=path, begin=0.0, end=seconds)
    times = np.linspace(0.0, seconds, 3000)
    places = np.column_stack([path.positions(times), np.full(len(times), 0.015)])
    builder = DiagramBuilder()
    cell = builder.AddSystem(built.diagram)
    wanted = builder.AddSystem(TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, places.T), 1))
    builder.Connect(wanted.get_output_port(), cell.GetInputPort("hand.state_desired"))
    simulator = Simulator(builder.Build())
    plant = built.scene.plant
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    rest = plant.GetFreeBodyPose(context, built.scene.object)
    turned = RigidTransform(RotationMatrix.MakeZRotation(start[2]) @ rest.rotation(), rest.translation())
    plant.SetFreeBodyPose(context, built.scene.object, turned)
    for joint, place in zip(built.scene.joints, places[0], strict=True):
        joint.set_translation(context, place)
    simulator.AdvanceTo(seconds)
    X_WB = plant.GetFreeBodyPose(context, built.scene.object)
    end = np.array([*X_WB.translation()[:2], X_WB.rotation().ToRollPitchYaw().yaw_angle()])
    return end, motion.planar_at(np.array([seconds]))[0]


PUSHES = [
    PlannedPush(direction=0.0, speed=0.08, travel=0.06, contact_offset=0.005),
    PlannedPush(direction=0.6, speed=0.2, travel=0.08, contact_offset=-0.004),
    PlannedPush(direction=2.0, speed=0.4, travel=0.06, contact_offset=0.0),
]


@pytest.mark.parametrize("model", [FINE, TILTED_FINE], ids=["baseline", "table_tilt"])
@pytest.mark.parametrize("push", PUSHES, ids=["slow", "faster", "thrown"])
def test_a_push_in_the_diagram_is_that_of_a_rollout(model, push):
    got, want = pushed(model, push, time_step=2.5e-4)
    assert np.hypot(*want[:2]) > 0.02
    # docs/from_python.md has what was measured on the shipped recordings.
    np.testing.assert_allclose(got[:2], want[:2], atol=1.5e-3)
    assert abs(got[2] - want[2]) < 0.03
