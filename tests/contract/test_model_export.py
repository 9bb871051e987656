"""``model export``: the same push in a plant of one's own, and in MuJoCo, as in the cell."""

from dataclasses import replace

import numpy as np
import pytest
from plans import MODEL, TILTED
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant, MultibodyPlantConfig
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial
from runs import shipped_pushes

from physid_drake.cell import CellConfig, Start
from physid_drake.cli import main
from physid_drake.export import exported as exported_files
from physid_drake.model import Model
from physid_drake.policies import PlannedPush
from physid_drake.pushes.case import case_of
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Cylinder, Prism
from physid_drake.recording.outlines import polygon_centroid

START, SECONDS, HEIGHT = (0.02, -0.01, 0.4), 1.2, 0.015
CORNERS = np.array([[-0.06, 0.0], [0.06, 0.0], [0.06, 0.03], [0.015, 0.03], [0.015, 0.1], [-0.015, 0.1],
                    [-0.015, 0.03], [-0.06, 0.03]])  # fmt: skip
T_SHAPE = Prism(polygon=tuple(map(tuple, (CORNERS - polygon_centroid(CORNERS)).tolist())), height=0.03)
BODY = replace(MODEL.body, p_BBcm=np.array([0.004, -0.002]))
MODELS = {
    "box": replace(MODEL, config=CellConfig(), body=BODY),
    "disc": replace(MODEL, config=CellConfig(), shape=Cylinder(radius=0.04, length=0.03, axis="z")),
    "notched": replace(MODEL, config=CellConfig(), shape=T_SHAPE),
    "cells": replace(
        MODEL, config=CellConfig(friction_cells=[2, 1]), body=replace(BODY, support_friction=np.array([0.2, 0.4]))
    ),
}
PUSHES = {
    "pushed": PlannedPush(direction=0.3, speed=0.1, travel=0.06, contact_offset=0.004),
    "thrown": PlannedPush(direction=2.0, speed=0.35, travel=0.05),
}


# Of a disc and a T one push is enough in Drake, where each takes four seconds.
IN_DRAKE = {"box": list(PUSHES), "disc": ["thrown"], "notched": ["pushed"], "cells": list(PUSHES)}


@pytest.fixture(scope="module", params=list(MODELS))
def exported(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    model = MODELS[request.param]
    (folder / "model.yaml").write_text(model.dump())
    out = folder / "export"
    assert main(["model", "export", str(folder / "model.yaml"), "--out", str(out)]) == 0
    return request.param, model, model.build(), out


def rolled_out(model, cell, push):
    path = push.path(START, cell.cell.solid.outline, model.hand_radius)
    motion = cell.rollout(start=Start(pose=START), path=path, begin=0.0, end=SECONDS)
    return path, motion.planar_at(np.array([SECONDS]))[0]


def in_own_plant(out, path, start=START, *, begin=0.0, seconds=SECONDS, height=HEIGHT):
    """Planar end (3,) of the exported scene in a plant that this test makes."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(
        MultibodyPlantConfig(
            time_step=2.5e-4, contact_model="hydroelastic_with_fallback", discrete_contact_approximation="lagged",
            stiction_tolerance=1e-4,
        ),
        builder,
    )  # fmt: skip
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(out / "package.xml"))
    parser.AddModels(str(out / "scene.dmd.yaml"))
    plant.Finalize()
    times = np.linspace(0.0, seconds, 3000)
    places = np.column_stack([path.positions(begin + times), np.full(len(times), height)])
    wanted = builder.AddSystem(TrajectorySource(PiecewisePolynomial.FirstOrderHold(times, places.T), 1))
    hand = plant.GetModelInstanceByName("hand")
    builder.Connect(wanted.get_output_port(), plant.get_desired_state_input_port(hand))
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    body = plant.GetBodyByName("object")
    rest = plant.GetFreeBodyPose(context, body)
    assert rest.translation()[2] == pytest.approx(0.015)
    X_WB = RigidTransform(RotationMatrix.MakeZRotation(start[2]), [*start[:2], rest.translation()[2]])
    plant.SetFreeBodyPose(context, body, X_WB)
    plant.SetPositions(context, hand, places[0])
    simulator.AdvanceTo(seconds)
    X_WB = plant.GetFreeBodyPose(context, body)
    return np.array([*X_WB.translation()[:2], X_WB.rotation().ToRollPitchYaw().yaw_angle()])


def in_mujoco(out, path, start=START):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(out / "model.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qpos[:7] = [*start[:2], 0.015, np.cos(0.5 * start[2]), 0.0, 0.0, np.sin(0.5 * start[2])]
    data.qpos[7:10] = [*path.positions(np.zeros(1))[0], HEIGHT]
    step = model.opt.timestep
    for k in range(round(SECONDS / step)):
        now, soon = path.positions(np.array([k * step, (k + 1) * step]))
        speed = (soon - now) / step
        data.ctrl[:] = [soon[0], speed[0], soon[1], speed[1], HEIGHT, 0.0]
        mujoco.mj_step(model, data)
    w, x, y, z = data.qpos[3:7]
    return np.array([*data.qpos[:2], np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))])


def test_drakes_parser_gives_the_pushes_of_the_cell(exported):
    name, model, cell, out = exported
    for push in IN_DRAKE[name]:
        path, want = rolled_out(model, cell, PUSHES[push])
        got = in_own_plant(out, path)
        assert np.hypot(*(want[:2] - START[:2])) > 0.03
        assert np.hypot(*(got - want)[:2]) < 1e-3 and abs(got[2] - want[2]) < 0.03  # measured: 0.5 mm, 1.1 degrees


@pytest.mark.slow
def test_a_recorded_push_ends_where_it_was_recorded(tmp_path):
    """Of the eraser, whose truth is known: the median of three pushes within a millimetre and a degree."""
    recording = shipped_pushes(3)
    case = case_of(recording, CellConfig(), ThetaConfig(nominal={"hand_friction": 0.22, "support_friction": 0.27}))
    body = case.thetas.body(case.thetas.space.nominal)
    spec = case.pool.spec
    model = Model(
        recording="eraser", shape=spec.shape, hand_radius=spec.hand_radius, table=spec.table, config=spec.config,
        body=body,
    )  # fmt: skip
    for name, text in exported_files(model).items():
        (tmp_path / name).write_text(text)
    misses = []
    for problem in case.problems:
        begin, end = float(problem.times[0]), problem.poses[-1]
        got = in_own_plant(
            tmp_path, problem.path, problem.start.pose, begin=begin, seconds=float(problem.times[-1]) - begin,
            height=problem.hand_height,
        )  # fmt: skip
        misses.append([np.hypot(*(got - end)[:2]), abs(np.angle(np.exp(1j * (got[2] - end[2]))))])
        assert np.hypot(*(end[:2] - problem.start.pose[:2])) > 0.02
    position, rotation = np.median(misses, axis=0)
    assert position < 1e-3 and rotation < np.radians(1.0)


@pytest.mark.parametrize("push", PUSHES)
def test_mujoco_gives_the_push_of_the_cell(exported, push):
    _, model, cell, out = exported
    path, want = rolled_out(model, cell, PUSHES[push])
    got = in_mujoco(out, path)
    assert np.hypot(*(got - want)[:2]) < 3e-3 and abs(got[2] - want[2]) < 0.09  # measured: 2.3 mm, 4.1 degrees


def test_what_neither_format_expresses_is_said(tmp_path, capsys):
    (tmp_path / "model.yaml").write_text(TILTED.dump())
    assert main(["model", "export", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    said = "- table_tilt: forces"
    assert said in capsys.readouterr().out and said in (tmp_path / "out" / "README.txt").read_text()


def test_an_object_that_rolls_and_a_model_without_a_hand(tmp_path, capsys):
    lying = replace(
        MODEL, recording="odd -- <name>", config=CellConfig(), shape=Cylinder(radius=0.015, length=0.1, axis="y")
    )
    (tmp_path / "model.yaml").write_text(lying.dump())
    assert main(["model", "export", str(tmp_path), "--out", str(tmp_path / "out")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "Not in these files:" in said and "what rolls has the table's in SDFormat" in said
    plant = MultibodyPlant(1e-3)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(tmp_path / "out" / "package.xml"))
    parser.AddModels(str(tmp_path / "out" / "scene.dmd.yaml"))
    plant.Finalize()
    assert plant.num_positions() == 10
    mujoco = pytest.importorskip("mujoco")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "model.xml")).nq == 10
    (tmp_path / "model.yaml").write_text(replace(MODEL, hand_radius=None).dump())
    assert main(["model", "export", str(tmp_path), "--out", str(tmp_path / "other")]) == 1
    assert "has no hand" in capsys.readouterr().err and not (tmp_path / "other").exists()
