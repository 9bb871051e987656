"""The ``diagnose`` command's refusals, and models that cannot be read: one clear line, nothing half-written."""

import re
import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from physid_drake import load_model, run_diagnose
from physid_drake.cell import Body, CellConfig, Start
from physid_drake.cell.hand_path import straight_path
from physid_drake.cli import main
from physid_drake.diagnose.exported import hand_frame
from physid_drake.effects.body import UnevenSupport
from physid_drake.effects.drag import ViscousDrag
from physid_drake.effects.hand import HandOffset
from physid_drake.errors import ConfigError
from physid_drake.model import AS_W, Correlation, Model
from physid_drake.recording import Prism
from physid_drake.resources import shipped
from physid_drake.run_folder import RunFolder

DRAG = "viscous_drag.coefficient"


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["no_such_folder"], "no_such_folder"),
        (["eraser_reference", "--alpha", "2"], "--alpha"),
        (["eraser_reference", "--seed", "-1"], "--seed"),
        (["eraser_reference", "--pushes", "0"], "--pushes"),
        (["eraser_reference", "--jobs", "-1"], "--jobs"),
        (["eraser_reference", "--time-step", "1"], "--time-step"),
        (["eraser_reference", "--effects", "phlogiston"], "phlogiston"),
    ],
)
def test_what_cannot_be_diagnosed_is_refused_in_one_line(argv, named, tmp_path, capsys):
    assert main(["diagnose", *argv, "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and named in error
    assert not (tmp_path / "out").exists()


def test_an_output_folder_that_cannot_be_written_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["diagnose", "eraser_reference", "--out", str(tmp_path / "file" / "out")]) == 1
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.slow
def test_results_go_to_a_folder_named_after_the_recordings(tmp_path, monkeypatch, capsys):
    def interrupted(*_, kept, **__):
        kept.keep({bytes(16): None})
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(run_diagnose, "run_case", interrupted)
    shutil.copytree(shipped("recordings") / "eraser_reference", tmp_path / "mine")
    assert main(["diagnose", "mine"]) == 130
    assert "the same command resumes from them" in capsys.readouterr().out
    RunFolder(path=tmp_path / "diagnoses" / "mine", command="diagnose").write("diagnosis.json", "{}")
    assert main(["diagnose", "mine"]) == 130
    shown = capsys.readouterr().out
    assert "resuming with 1 rollouts of the interrupted run" in shown
    assert main(["diagnose", "mine", "--seed", "1"]) == 1
    assert "of other settings" in capsys.readouterr().err


@pytest.fixture
def model():
    return Model(
        recording="triangle",
        shape=Prism(polygon=((-0.05, -0.03), (0.07, -0.03), (-0.02, 0.06)), height=0.04),
        hand_radius=0.01,
        table=((-1.0, -1.0), (1.0, 1.0)),
        config=CellConfig(),
        body=Body(
            mass=0.2, p_BBcm=np.array([0.001, 0.0]), inertia_ratio=1.0, hand_friction=0.2,
            support_friction=np.array([0.3]),
        ),
        effects=(ViscousDrag(coefficient=0.4), UnevenSupport(weights=((1.0, 2.0), (0.5, 0.5)))),
        intervals={"viscous_drag.coefficient": [0.3, 0.5]},
    )  # fmt: skip


def test_a_model_survives_its_file(model, tmp_path):
    file = tmp_path / "model.yaml"
    file.write_text(model.dump(), encoding="utf-8")
    loaded = load_model(tmp_path)
    assert loaded.effects == model.effects and loaded.shape == model.shape and loaded.config == model.config
    assert loaded.intervals == model.intervals and loaded.body.support_friction[0] == 0.3
    assert loaded.build().diagram.HasSubsystemNamed("plant")
    assert loaded.baseline().effects == ()


def test_a_push_is_simulated_as_the_docs_say(model, tmp_path, monkeypatch, capsys):
    page = (Path(__file__).parents[2] / "docs" / "model.md").read_text(encoding="utf-8")
    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    folder = tmp_path / "diagnoses" / "my_recording"
    folder.mkdir(parents=True)
    (folder / "model.yaml").write_text(model.dump(), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    said = {}
    exec(block, said)
    assert capsys.readouterr().out.startswith("[[")
    touched, stopped = said["motion"].planar_at(np.array([0.5, 1.5]))[:, 0]
    assert 0.03 < touched < stopped + 1e-3  # the tip ends at Bo's first place and has a radius; faces are 0.03 m away


def test_a_tip_that_was_turned_stays_turned(model, tmp_path):
    assert "hand_axes" not in model.dump()
    down = ((0.0, 1.0), (1.0, 0.0))  # pointing down: P's x along y of W
    offset = replace(model, effects=(HandOffset(x=0.01),), hand_axes=down)
    (tmp_path / "model.yaml").write_text(offset.dump(), encoding="utf-8")
    loaded = load_model(tmp_path)
    assert loaded.hand_axes == down
    path = straight_path(np.array([-0.1, 0.0]), np.array([0.0, 0.0]), 0.0, 0.3)
    push = {"start": Start(pose=(0.0, 0.0, 0.0)), "path": path, "begin": 0.0, "end": 0.5}
    turned = loaded.build().rollout(**push).poses[-1]
    aside = replace(offset, effects=(HandOffset(y=0.01),), hand_axes=AS_W).build().rollout(**push).poses[-1]
    assert np.array_equal(turned, aside)
    told = loaded.build().rollout(**push, hand_axes=np.eye(2)).poses[-1]
    assert not np.allclose(told, turned, atol=1e-3)


def test_a_tip_that_turns_with_its_pushes_takes_its_offset_along(model, tmp_path):
    assert "hand_turns" not in model.dump()
    offset = replace(model, effects=(HandOffset(x=0.01, y=0.004),), hand_turns=True)
    (tmp_path / "model.yaml").write_text(offset.dump(), encoding="utf-8")
    loaded = load_model(tmp_path)
    for heading in (0.0, 0.7, 2.5):
        c, s = np.cos(heading), np.sin(heading)
        path = straight_path(np.array([0.1, 0.2]), np.array([0.1 + 0.1 * c, 0.2 + 0.1 * s]), 0.0, 0.3)
        assert loaded.axes_on(path) == pytest.approx(np.array([[c, -s], [s, c]]), abs=1e-12)
        assert replace(loaded, hand_turns=False).axes_on(path) == pytest.approx(np.eye(2))


def problems_with(headings, turns):
    """Pushes whose hand's x is at an angle in W, less how much of it goes with the push."""
    found = []
    for heading, turn in zip(headings, turns, strict=True):
        end = 0.1 * np.array([np.cos(heading), np.sin(heading)])
        axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        found.append(SimpleNamespace(path=straight_path(np.zeros(2), end, 0.0, 0.3), hand_axes=axes))
    return found


def test_whether_a_hand_turns_with_its_pushes_is_seen():
    headings = np.array([0.0, 1.6, 3.1, -1.5])
    axes, turns = hand_frame(problems_with(headings, headings + 0.3))
    assert turns and np.arctan2(axes[1][0], axes[0][0]) == pytest.approx(0.3)
    axes, turns = hand_frame(problems_with(headings, [0.3, 0.31, 0.29, 0.3]))
    assert not turns and np.arctan2(axes[1][0], axes[0][0]) == pytest.approx(0.3, abs=1e-6)
    assert hand_frame(problems_with(headings, [0.0, 1.0, -2.0, 2.0])) == (AS_W, False)
    # In pushes of one direction both are true: nothing is known of others.
    assert hand_frame(problems_with([0.1] * 3, [0.3] * 3))[1] is False


def test_how_estimates_vary_together_survives_the_file_and_may_be_absent(model, tmp_path):
    file = tmp_path / "model.yaml"
    names = ("theta.mass", "viscous_drag.coefficient")
    correlation = Correlation.of(names, np.array([[1.0, -1.0 / 3.0], [-1.0 / 3.0, 1.0]]))
    told = replace(model, intervals={**model.intervals, "theta.mass": [0.1, 0.3]}, correlation=correlation)
    file.write_text(told.dump(), encoding="utf-8")
    assert load_model(file).correlation == correlation
    file.write_text(model.dump(), encoding="utf-8")
    assert "correlation" not in file.read_text() and load_model(file).correlation is None


def test_what_a_correlation_does_not_hold_is_independent():
    correlation = Correlation.of(("a", "b"), np.array([[1.0, 0.5], [0.5, 1.0]]))
    np.testing.assert_array_equal(correlation.among(["b", "c", "a"]), [[1, 0, 0.5], [0, 1, 0], [0.5, 0, 1]])


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"correlation": {"names": ["theta.colour"], "matrix": [[1.0]]}}, "theta.colour"),
        ({"correlation": {"names": [DRAG, DRAG], "matrix": [[1.0, 0.0], [0.0, 1.0]]}}, "unique"),
        ({"correlation": {"names": [DRAG], "matrix": [[1.0, 0.0]]}}, "1 rows"),
        ({"correlation": {"names": [DRAG], "matrix": [[0.5]]}}, "diagonal"),
        ({"correlation": {"names": [DRAG], "matrix": [["x"]]}}, "x"),
        ({"correlation": 3}, "model"),
        ({"format": "physid-model/0"}, "physid-model/1"),
        ({"effects": [{"name": "phlogiston", "parameters": {}}]}, "phlogiston"),
        ({"effects": [{"name": "viscous_drag", "parameters": {"coefficient": 0.1, "colour": 1.0}}]}, "colour"),
        ({"theta": {"mass": 1.0}}, "model"),
        ({"object": {"shape": "sphere"}}, "sphere"),
        ({"intervals": None}, "intervals"),
        ({"intervals": {3: [0.1, 0.2]}}, "intervals"),
        ({"intervals": {"viscous_drag.name": [0.1, 0.2]}}, "viscous_drag.name"),
        ({"hand_radius_m": "abc"}, "hand_radius_m"),
        ({"hand_radius_m": -0.01}, "above 0"),
        ({"tip_height_m": float("nan")}, "tip_height_m"),
        ({"hand_axes": [[1.0, 0.0]]}, "hand_axes"),
        ({"table_m": []}, "'table_m': must be two rows"),
        ({"cell": {}}, "key 'cell.contact' is missing"),
        ({"table_m": [[1.0, 1.0], [-1.0, -1.0]]}, "table_m"),
        ({"effects": [{"name": "size_error", "parameters": {"ratio": 0.0}}]}, "size_error.ratio"),
        ({"effects": [{"name": "sloshing", "parameters": {"fraction": 1.0}}]}, "of at least 0 and below 1"),
        ({"effects": [{"name": "viscous_drag", "parameters": {"coefficient": -0.5}}]}, "viscous_drag.coefficient"),
        (
            {"effects": [{"name": "restitution", "parameters": {"coefficient": 1.7}}]},
            "of at least 0 and of at most 1",
        ),
        ({"effects": [{"name": "uneven_support", "parameters": {"weights": [[1.0], [1.0, 2.0]]}}]}, "equally many"),
        ({"effects": [{"name": "table_tilt", "parameters": {"x": float("inf")}}]}, "table_tilt.x"),
        (
            {"effects": [{"name": "table_tilt", "parameters": {"x": x, "y": 0.0}} for x in (0.0, 0.1)]},
            "twice",
        ),
        ({"effects": [{"name": "table_tilt", "parameters": {"x": 0.1}}]}, "table_tilt.y' is missing"),
        ({"tip_height_m": -1.0}, "tip_height_m"),
        ({"contact_height_m": 3.0}, "contact_height_m"),
        ({"top_speed_mps": -0.1}, "top_speed_mps"),
        ({"complete": "tr"}, "cut off"),
    ],
)
def test_a_model_of_another_kind_is_refused_by_name(model, tmp_path, change, named):
    file = tmp_path / "model.yaml"
    file.write_text(yaml.safe_dump({**yaml.safe_load(model.dump()), **change}), encoding="utf-8")
    with pytest.raises(ConfigError, match=named):
        load_model(file)


@pytest.mark.parametrize(
    ("section", "change", "named"),
    [
        ("theta", {"mass": float("nan")}, "theta.mass"),
        ("theta", {"mass": 0.0}, "above 0"),
        ("theta", {"support_friction": 0.3}, "theta.support_friction"),
        ("theta", {"support_friction": [0.3, 0.3]}, "list of 1 numbers"),
        ("theta", {"support_friction": [0.0]}, "above 0"),
        ("theta", {"p_BBcm": [0.0, 0.0, 0.0]}, "theta.p_BBcm"),
        ("theta", {"colour": 1.0}, "colour"),
        ("cell", {"friction_cells": [1]}, "cell.friction_cells"),
        ("cell", {"solver": {"scheme": "foo"}}, "cell.solver.scheme"),
        ("cell", {"solver": {"time_step_s": 0.0}}, "cell.solver.time_step_s"),
        ("cell", {"solver": {"impact_law": "abc"}}, "true or false"),
        ("cell", {"contact": {"model": "foo"}}, "cell.contact.model"),
    ],
)
def test_a_model_whose_numbers_cannot_be_is_refused_by_key(model, tmp_path, section, change, named):
    content = yaml.safe_load(model.dump())
    content[section] |= change
    (tmp_path / "model.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(ConfigError, match=named):
        load_model(tmp_path)


def test_a_relative_mesh_is_one_beside_the_model(model, tmp_path, monkeypatch):
    content = yaml.safe_load(model.dump())
    content["object"] = {"shape": "mesh", "file": "cube.obj", "scale": 1.0}
    (tmp_path / "model.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    vertices = (f"v {x} {y} {z}" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    (tmp_path / "cube.obj").write_text("\n".join(vertices), encoding="utf-8")
    monkeypatch.chdir(tmp_path.parent)
    assert load_model(tmp_path.name).shape.file == (tmp_path / "cube.obj").resolve()


def test_a_model_that_is_not_there_or_no_yaml_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="no such file"):
        load_model(tmp_path / "model.yaml")
    for text in ("{", "format: 2001-99-99", "{a: !!int x}", "[" * 3000):
        (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
        with pytest.raises(ConfigError, match="is no YAML"):
            load_model(tmp_path)


def test_a_model_that_was_cut_off_is_refused_wherever_it_was_cut(model, tmp_path):
    """Half of the keys may be left out, and a cut number is a number."""
    text = model.dump()
    for count in (*range(40, len(text) - 1, 97), len(text) - 2):
        (tmp_path / "model.yaml").write_text(text[:count], encoding="utf-8")
        with pytest.raises(ConfigError):
            load_model(tmp_path)
