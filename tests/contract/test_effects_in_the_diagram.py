"""``load_model(path).build()``: the effects' forces are a system of the diagram, and act as in a rollout."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from physid_drake.cell import Body, CellConfig, Start
from physid_drake.cell.object_state import reader_of
from physid_drake.effects import effect_named
from physid_drake.effects.system import NAME
from physid_drake.model import Model
from physid_drake.recording import Box

SPEED, END = 0.5, 1.0
EFFECTS = [
    ("table_tilt", {"x": 0.05, "y": -0.02}),
    ("viscous_drag", {"coefficient": 0.2}),
    ("stribeck_friction", {"excess": 0.5, "speed": 0.1}),
    ("anisotropic_table", {"ratio": 1.5, "angle": 0.4}),
    ("sloshing", {"fraction": 0.2, "frequency": 3.0, "damping": 0.1}),
    ("friction_drift", {"per_push": 0.1}),
]


def model(*effects):
    body = Body(mass=0.2, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=0.3, support_friction=np.array([0.3]))
    return Model(
        recording="made",
        shape=Box(size=(0.08, 0.05, 0.03)),
        hand_radius=None,
        table=((-1.0, -1.0), (1.0, 1.0)),
        config=CellConfig(),
        body=body,
        effects=tuple(effect_named(name)(**parameters) for name, parameters in effects),
    )


def slid_in_diagram(built, seconds=END):
    """Pose (7,) to which Drake's simulator takes the object, started as the rollout starts it."""
    scene, root = built.scene, built.simulator.get_mutable_context()
    context = scene.plant.GetMyMutableContextFromRoot(root)
    rest = built.cell.rest_pose(built.model.body)
    scene.plant.SetPositionsAndVelocities(context, [*rest, 0.0, 0.0, 0.0, SPEED, 0.0, 0.0])
    built.simulator.Initialize()
    built.simulator.AdvanceTo(seconds)
    return scene.plant.GetPositions(context)


def planar(q):
    return np.array([q[4], q[5], 2.0 * np.arctan2(q[3], q[0])])


@pytest.mark.parametrize("effect", EFFECTS, ids=[name for name, _ in EFFECTS])
def test_the_diagram_slides_as_the_rollout_does(effect):
    built = model(effect).build()
    start = Start(pose=(0.0, 0.0, 0.0), velocity=(SPEED, 0.0, 0.0))
    want = built.rollout(start=start, path=None, begin=0.0, end=END).planar_at(np.array([END]))[0]
    # Measured: 0.72 mm without any force: half a time step of speed that only the rollout's trapezoidal update takes
    # back.
    np.testing.assert_allclose(planar(slid_in_diagram(built)), want, atol=9e-4)


@pytest.mark.parametrize("stiffness", [20.0, 200.0])
def test_a_spring_in_the_diagram_gives_back_what_it_took(stiffness):
    """Drake's step moves by the velocity at its end: with the force half a step ahead, half of it was lost in 2 s."""
    made = model(("tether", {"stiffness": stiffness, "x": 0.05, "y": 0.0}))
    built = replace(made, body=replace(made.body, support_friction=np.array([1e-6]))).build()
    scene, context = built.scene, built.scene.plant.GetMyMutableContextFromRoot(built.simulator.get_mutable_context())
    scene.plant.SetPositionsAndVelocities(context, [*built.cell.rest_pose(built.model.body), *[0.0] * 6])
    built.simulator.Initialize()
    energies = []
    for time in np.linspace(1.9, 2.0, 41):
        built.simulator.AdvanceTo(time)
        x, v = scene.plant.GetPositions(context)[4] - 0.05, scene.plant.GetVelocities(context)[3]
        energies.append(0.5 * stiffness * x**2 + 0.5 * built.model.body.mass * v**2)
    # Measured: 0.98 to 1.01; it swings with the time step.
    np.testing.assert_allclose(energies, 0.5 * stiffness * 0.05**2, rtol=0.04)


def pressed(built, q):
    """Centre of pressure (2,) of a pose in B [m]."""
    state = reader_of(built.model.body, built.cell.scene).at(0.0, 1e-3, q.tolist(), [0.0] * 6)
    return state.loads @ built.cell.scene.support.points / state.loads.sum()


def test_liquid_shifts_the_pressure_in_the_diagram_as_in_the_rollout():
    built, middle = model(("sloshing", {"fraction": 0.4, "frequency": 3.0, "damping": 0.1})).build(), 0.1
    start = Start(pose=(0.0, 0.0, 0.0), velocity=(SPEED, 0.0, 0.0))
    motion = built.rollout(start=start, path=None, begin=0.0, end=middle)
    ahead = pressed(built, motion.poses[-1])
    got = pressed(built, slid_in_diagram(built, middle))
    # Friction alone shifts it by 4.5 mm.
    assert ahead[0] > 0.008
    np.testing.assert_allclose(got, ahead, atol=2e-4)  # measured 5.4e-5 m


def test_each_simulation_of_a_liquid_begins_anew_and_each_context_has_its_own():
    """The swing of another simulation went on where the object no longer was: math range error."""
    effect = ("sloshing", {"fraction": 0.4, "frequency": 3.0, "damping": 0.05})
    built, fresh = model(effect).build(), slid_in_diagram(model(effect).build(), 0.25)
    np.testing.assert_array_equal(slid_in_diagram(built, 0.25), fresh)
    again = slid_in_diagram(built, 0.5)  # from 0.25 on, the object put back: a later begin is no continuation
    np.testing.assert_allclose(again, fresh, atol=1e-9)
    scene, root = built.scene, built.simulator.get_mutable_context()
    root.SetTime(0.0)
    slid_in_diagram(built, 0.1)
    halfway, other = root.Clone(), Simulator(built.diagram, root.Clone())
    other.AdvanceTo(0.2)  # a second simulation of the same diagram in between
    built.simulator.AdvanceTo(0.25)
    np.testing.assert_array_equal(scene.plant.GetPositions(scene.plant.GetMyContextFromRoot(root)), fresh)
    third = Simulator(built.diagram, halfway)
    third.AdvanceTo(0.25)
    assert third.get_context().get_time() == 0.25


def test_a_model_without_force_effects_has_the_plain_diagram():
    assert not model().build().diagram.HasSubsystemNamed(NAME)
    assert model(EFFECTS[0]).build().diagram.HasSubsystemNamed(NAME)


@pytest.mark.parametrize("hand_radius", [None, 0.01])
def test_the_diagram_begins_with_the_object_at_rest_on_the_table(hand_radius):
    built = replace(model(), hand_radius=hand_radius).build()
    plant, root = built.scene.plant, built.simulator.get_mutable_context()
    before = plant.GetPositions(plant.GetMyContextFromRoot(root), built.scene.object.model_instance())
    built.simulator.AdvanceTo(0.1)
    after = plant.GetPositions(plant.GetMyContextFromRoot(root), built.scene.object.model_instance())
    np.testing.assert_allclose(after, before, atol=1e-6)
    assert after[-1] == pytest.approx(0.015, abs=1e-4)  # half its height
