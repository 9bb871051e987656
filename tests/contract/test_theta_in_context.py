"""Theta lives in the Context: the same theta gives the same bits, whatever was run before and wherever."""

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from reference.scenes import sixty_pushes
from twin import MODELS, body_of, config_of, twin

from physid_drake.cell import Cell, HandPath, Outcome, Start
from physid_drake.errors import ParameterError, PhysidError
from physid_drake.recording import Box

BODY = body_of(
    0.35, [0.2, 0.4, 0.3, 0.25], com=(0.004, -0.003), inertia_ratio=1.1, hand_friction=0.25, static_ratio=1.3,
    restitution=0.05,
)  # fmt: skip
OTHERS = (
    body_of(0.05, [0.6, 0.1, 0.1, 0.6], hand_friction=0.9),
    body_of(2.0, [0.1] * 4, com=(-0.01, 0.0), inertia_ratio=0.7, hand_friction=0.0),
)

both_models = pytest.mark.parametrize("model", MODELS)


def new_cell(model):
    return Cell(Box(size=(0.10, 0.08, 0.06)), hand_radius=0.01, config=config_of(model, cells=(2, 2)))


def push(cell, body=BODY):
    path = HandPath(
        times=np.array([0.0, 0.05, 0.25, 0.29]),
        velocities=np.outer([0.0, 0.3, 0.3, 0.0], [1.0, 0.1]),
        start=np.array([-0.07, 0.01]),
    )
    return cell.rollout(body, start=Start(pose=(0.0, 0.0, 0.1)), path=path, begin=0.0, end=0.6)


def bits(motion):
    """A digest of every number of a motion."""
    series = (motion.times, motion.poses, motion.forces, np.array(motion.impacts))
    return hashlib.sha256(b"".join(np.ascontiguousarray(s).tobytes() for s in series)).hexdigest()


@both_models
def test_the_same_theta_gives_the_same_bits_again_and_after_others(model):
    cell = new_cell(model)
    first = bits(push(cell))
    assert bits(push(cell)) == first
    for other in OTHERS:
        assert bits(push(cell, other)) != first
    assert bits(push(cell)) == first


@both_models
def test_the_same_theta_gives_the_same_bits_in_a_new_cell(model):
    used = new_cell(model)
    push(used, OTHERS[0])
    assert bits(push(new_cell(model))) == bits(push(used))


@both_models
def test_the_same_theta_gives_the_same_bits_after_a_free_slide_and_a_cell_at_work_beside_it(model):
    cell, beside = new_cell(model), new_cell(model)
    first = bits(push(cell))
    push(beside, OTHERS[1])
    cell.rollout(OTHERS[0], start=Start(pose=(0, 0, 0), velocity=(0.5, 0, 3.0)), path=None, begin=0.0, end=0.3)
    assert bits(push(cell)) == first


@both_models
def test_the_same_theta_gives_the_same_bits_in_another_process(model):
    here = Path(__file__)
    code = f"from test_theta_in_context import *; print(bits(push(new_cell({model!r}))))"
    paths = [str(here.parent), str(here.parents[1]), str(here.parents[2])]
    answer = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=here.parent,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
    )  # fmt: skip
    assert answer.stdout.strip().splitlines()[-1] == bits(push(new_cell(model)))


@both_models
def test_the_setters_are_systems_of_the_diagram_and_hold_theta(model):
    cell = new_cell(model)
    cell.set_body(BODY)
    root = cell.simulator.get_context()
    held = {}
    for setter in cell.setters:
        system = setter.system
        assert cell.diagram.HasSubsystemNamed(system.get_name())
        held[system.get_name()] = setter.value(root)
        port = system.get_output_port()
        np.testing.assert_array_equal(port.Eval(system.GetMyContextFromRoot(root)), held[system.get_name()])
    np.testing.assert_array_equal(held["inertia_setter"], [0.35, 0.004, -0.003, 1.1])
    np.testing.assert_array_equal(held["support_friction_setter"], [1.3, 0.35, 0.2, 0.4, 0.3, 0.25])
    np.testing.assert_array_equal(held["hand_friction_setter"], [0.25, 0.35])


@both_models
def test_drakes_own_context_has_the_inertia_of_theta(model):
    cell = new_cell(model)
    cell.set_body(BODY)
    context = cell.scene.plant.GetMyContextFromRoot(cell.simulator.get_context())
    spatial = cell.scene.object.CalcSpatialInertiaInBodyFrame(context)
    assert spatial.get_mass() == 0.35
    np.testing.assert_allclose(spatial.get_com(), [0.004, -0.003, 0.0], atol=1e-15)
    about_com = spatial.Shift(spatial.get_com()).CalcRotationalInertia().CopyToFullMatrix3()
    assert about_com[2, 2] == pytest.approx(1.1 * 0.35 * (0.10**2 + 0.08**2) / 12, rel=1e-12)


def test_only_this_context_is_written():
    cell = new_cell("point")
    fresh = cell.diagram.CreateDefaultContext()
    cell.set_body(BODY)
    mass = cell.scene.object.get_mass(cell.scene.plant.GetMyContextFromRoot(fresh))
    assert mass == 1.0


@pytest.mark.parametrize(
    ("change", "value"),
    [
        ({"mass": 0.0}, "0"),
        ({"mass": -0.2}, "-0.2"),
        ({"mass": float("nan")}, "nan"),
        ({"inertia_ratio": 0.0}, "0"),
        ({"hand_friction": -0.1}, "-0.1"),
        ({"support_friction": np.array([0.2, 0.2, -0.3, 0.2])}, "-0.3"),
        ({"support_friction": np.array([0.2, float("inf"), 0.2, 0.2])}, "inf"),
        ({"static_ratio": 0.9}, "0.9"),
        ({"restitution": 1.2}, "1.2"),
        ({"restitution": -0.1}, "-0.1"),
        ({"p_BBcm": np.array([float("nan"), 0.0])}, "nan"),
    ],
)  # fmt: skip
def test_parameters_outside_of_physics_are_refused_by_name(change, value, request):
    cell = new_cell("point")
    with pytest.raises(ParameterError) as caught:
        push(cell, replace(BODY, **change))
    (name,) = change
    assert {"p_BBcm": "com"}.get(name, name) in str(caught.value)
    assert value in str(caught.value)


def test_a_wrong_number_of_friction_cells_is_refused():
    with pytest.raises(ParameterError, match=r"support_friction needs 4 cells, but has 2"):
        push(new_cell("point"), replace(BODY, support_friction=np.array([0.3, 0.3])))


def test_a_centre_of_mass_beside_the_base_is_refused_as_the_packages_error(request):
    with pytest.raises(PhysidError):
        push(new_cell("point"), replace(BODY, p_BBcm=np.array([0.06, 0.0])))


@pytest.mark.parametrize("error", [RuntimeError("did not converge"), SystemExit(1)])
@both_models
def test_a_rollout_that_drake_gives_up_is_an_outcome(model, error, monkeypatch):
    cell = new_cell(model)
    first, calls, advance = push(cell), [], Simulator.AdvanceTo

    def fails_later(simulator, boundary_time):
        calls.append(boundary_time)
        if len(calls) > 20:
            raise error
        return advance(simulator, boundary_time)

    with monkeypatch.context() as patched:
        patched.setattr(Simulator, "AdvanceTo", fails_later)
        broken = push(cell)
    assert broken.outcome is Outcome.DIVERGED
    assert 1 < len(broken.times) < len(first.times)
    again = push(cell)
    assert again.outcome is Outcome.COMPLETED
    assert bits(again) == bits(first)


@both_models
def test_a_start_too_fast_to_be_true_is_an_outcome(model):
    cell = new_cell(model)
    first = bits(push(cell))
    absurd = cell.rollout(BODY, start=Start(pose=(0, 0, 0), velocity=(80.0, 0, 0)), path=None, begin=0.0, end=0.2)
    assert absurd.outcome is Outcome.DIVERGED
    assert bits(push(cell)) == first


@both_models
def test_a_start_that_is_not_a_number_is_an_outcome(model, request):
    cell = new_cell(model)
    first = bits(push(cell))
    absurd = cell.rollout(
        BODY, start=Start(pose=(0, 0, 0), velocity=(float("nan"), 0, 0)), path=None, begin=0.0, end=0.2
    )
    assert absurd.outcome is Outcome.DIVERGED
    assert bits(push(cell)) == first


def test_an_object_that_jumps_ends_no_process(request):
    push_of_a_can = sixty_pushes(0)[4]
    end = push_of_a_can[2].path.times[-1] + 0.3
    assert twin(*push_of_a_can, end, "hydroelastic", (("impact_law", False),)).outcome in Outcome
