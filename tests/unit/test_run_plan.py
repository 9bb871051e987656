"""What the command and the main job plan, write and refuse."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from plans import MODEL, TILTED
from rich.console import Console
from runs import QUICK as RUN
from runs import coarse_identifier, quick, shipped_pushes, write_small

from physid_drake import run_cell, run_plan
from physid_drake.cli import main
from physid_drake.effects.fields import TableTilt
from physid_drake.errors import ConfigError
from physid_drake.model import Correlation
from physid_drake.model_reading import load_model
from physid_drake.plan import PlanConfig
from physid_drake.plan.system import planner_of
from physid_drake.recording import Table
from physid_drake.run_folder import RunFolder
from physid_drake.scenario_schema import Scenario


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "model.yaml").write_text(TILTED.dump())
    return tmp_path / "run"


QUICK = ["--goal", "0.25", "0", "--budget", "4", "--draws", "2", "--tolerance", "0.5"]


def planned_files(folder, out, *argv):
    assert main(["plan", str(folder), *QUICK, "--out", str(out), *argv]) == 0
    return {path.name: path.read_bytes() for path in out.iterdir()}


@pytest.fixture
def few_rows(monkeypatch):
    """A sweep of three rows, so that the command is quick."""
    original = run_plan.plan
    monkeypatch.setattr(run_plan, "plan", lambda *args, **more: original(*args, **{**more, "sweep": 3}))


def test_the_command_writes_the_plan_and_the_same_seed_the_same_bytes(folder, tmp_path, capsys, few_rows):
    files = planned_files(folder, tmp_path / "one")
    shown = capsys.readouterr().out
    assert set(files) == {
        "plan.json",
        "push.csv",
        "plan.png",
        "plan.html",
        "index.html",
        "scene.html",
        "settings.json",
        "manifest.json",
    }
    again = planned_files(folder, tmp_path / "two")
    assert all(again[name] == content for name, content in files.items() if name != "settings.json")
    content = json.loads(files["plan.json"])
    assert content["format"] == "physid-plan/1" and content["effects"] == ["table_tilt"]
    assert content["pushes"][0]["speed_mps"] == content["settings"]["speed"]["value"]
    assert content["posterior"]["samples"] == 2 and len(content["sweep"]["rows"]) == 3
    assert f"{content['settings']['speed']['value']:.4f} m/s" in shown and "table_tilt" in shown
    page = files["plan.html"].decode()
    assert f"{content['settings']['speed']['value']:.4f} m/s" in page
    assert "http" not in page.replace("http://www.w3.org", "")


def test_a_plan_goes_to_a_folder_named_after_the_runs(folder, tmp_path, monkeypatch, capsys, few_rows):
    """Not after the recording's name, "eraser" here, which recordings of one data set may share."""
    monkeypatch.chdir(tmp_path)
    folder.rename(tmp_path / "monday")
    assert main(["plan", "monday", *QUICK]) == 0
    assert main(["plan", "--model", "monday/model.yaml", *QUICK]) == 0
    assert "Replaces the earlier plan in plans/monday." in capsys.readouterr().out
    assert [path.name for path in (tmp_path / "plans").iterdir()] == ["monday"]


def test_plain_plans_without_the_effects_and_says_what_they_make_of_it(folder, tmp_path, capsys, few_rows):
    with_effects = json.loads(planned_files(folder, tmp_path / "one")["plan.json"])
    plain = json.loads(planned_files(folder, tmp_path / "two", "--baseline")["plan.json"])
    assert plain["effects"] == [] and with_effects["predicted_with_effects"] is None
    assert plain["settings"]["speed"]["value"] != with_effects["settings"]["speed"]["value"]
    assert plain["predicted_with_effects"]["cost_m"] > with_effects["predicted"]["cost_m"]
    assert "with the effects found" in capsys.readouterr().out


def test_the_results_beside_a_model_give_scatter_and_order(folder, tmp_path, few_rows):
    (folder / "model.yaml").write_text(replace(MODEL, intervals={}).dump())
    assert json.loads(planned_files(folder, tmp_path / "one")["plan.json"])["posterior"] is None
    content = {"friction_scatter": 0.05, "training": {"pushes": ["b", "c"]}, "pushes": 3}
    (folder / "result.json").write_text(json.dumps(content))
    belief = json.loads(planned_files(folder, tmp_path / "two")["plan.json"])["posterior"]
    assert belief["ends"][0]["x_m"] != belief["ends"][1]["x_m"]
    # The first guess is worth four pushes; the others add theirs.
    assert run_plan._learnt(folder) == run_plan.Learnt(friction_scatter=0.05, scatter_freedom=6.0, pushes=3)
    diagnosis = {
        "friction_scatter": 0.02, "fit": {"per_push": [1, 2, 3, 4, 5]}, "pushes": 30, "verdict": "explained",
        "effects": [{"name": "table_tilt", "indistinguishable_from": []}],
    }  # fmt: skip
    (folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    assert run_plan._learnt(folder) == run_plan.Learnt(friction_scatter=0.02, scatter_freedom=9.0, pushes=30)
    for odd in (float("inf"), -5):
        (folder / "diagnosis.json").write_text(json.dumps(diagnosis | {"pushes": odd}))
        with pytest.raises(ConfigError, match=r"diagnosis\.json"):
            run_plan._learnt(folder)


@pytest.mark.parametrize("odd", [None, [], {}, "x" * 70_000, True, -1, 1e308, float("nan"), 10**400], ids=range(9))
def test_a_result_with_anything_in_the_place_of_a_value_is_one_line(tmp_path, odd):
    diagnosis = {
        "friction_scatter": 0.02, "fit": {"per_push": [1]}, "pushes": 30, "verdict": "explained",
        "effects": [{"name": "table_tilt", "indistinguishable_from": []}],
    }  # fmt: skip
    changes = [{**diagnosis, key: odd} for key in diagnosis]
    changes += [{**diagnosis, "fit": {"per_push": odd}}, {**diagnosis, "effects": [odd]}, odd]
    changes += [{**diagnosis, "effects": [{"name": odd, "indistinguishable_from": odd}]}]
    for content in changes:
        (tmp_path / "diagnosis.json").write_text(json.dumps(content))
        try:
            run_plan._learnt(tmp_path)
        except ConfigError as error:
            message = str(error)
            assert "diagnosis.json" in message and message.isprintable() and len(message) < 250 + len(str(tmp_path))
            assert "Error" not in message


@pytest.mark.parametrize(
    ("verdict", "alike", "said"),
    [
        ("unexplained", [], "does not explain"),
        ("ambiguous", ["tether"], "table_tilt is indistinguishable from tether"),
        ("explained", [], None),
    ],
)
def test_what_a_diagnosis_leaves_open_stands_beside_a_plan(folder, tmp_path, capsys, few_rows, verdict, alike, said):
    effects = [{"name": "table_tilt", "indistinguishable_from": alike}]
    diagnosis = {"friction_scatter": 0.0, "fit": {"per_push": [1] * 5}, "verdict": verdict, "effects": effects}
    (folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    files = planned_files(folder, tmp_path / "out")
    warned = json.loads(files["plan.json"])["warnings"]
    assert warned == [] if said is None else said in warned[0]
    page = files["plan.html"].decode()
    assert ("warning" in capsys.readouterr().out) is ("<th>warning" in page) is (said is not None)


@pytest.mark.parametrize(("known", "warned"), [(0.01, True), (2.0, False), (None, False)])
def test_a_push_faster_than_every_recorded_one_is_said(folder, tmp_path, few_rows, known, warned):
    (folder / "model.yaml").write_text(replace(TILTED, top_speed=known).dump())
    files = planned_files(folder, tmp_path / "out")
    warnings = " ".join(json.loads(files["plan.json"])["warnings"])
    page = files["plan.html"].decode()
    assert ("fastest recorded push 0.01 m/s" in warnings) is ("fastest recorded push" in page) is warned


def test_a_plan_takes_no_other_commands_folder(folder, capsys):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert main(["plan", str(folder), *QUICK, "--out", str(folder)]) == 1
    assert "read from" in capsys.readouterr().err
    RunFolder.begin(folder / "of_diagnose", "diagnose")
    assert main(["plan", str(folder), *QUICK, "--out", str(folder / "of_diagnose")]) == 1
    assert "holds what diagnose wrote" in capsys.readouterr().err
    assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before


def test_a_push_that_loses_the_object_is_no_plan(folder, tmp_path, capsys, few_rows):
    edge = ["--start", "0.45", "0", "0", "--direction", "0", "--goal", "0.3", "0"]
    status = main(["plan", str(folder), *QUICK, *edge, "--out", str(tmp_path / "out")])
    assert status == 1
    assert "does not bring the object to rest" in capsys.readouterr().err
    assert not (tmp_path / "out" / "push.csv").exists()


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["--goal", "9", "0"], "not on the table"), (["--goal", "nan", "0"], "finite"),
        (["--goal", "0", "0"], "already"),
        (["--policy", "throw"], "throw"), (["--speed", "0.1"], "push_direction"),
        (["--direction", "nan"], "--direction"),
        (["--start", "0", "0", "inf"], "--start"), (["--start", "5", "0", "0"], "start"),
        (["--tolerance", "nan"], "tolerance"),
        (["--budget", "0"], "budget"), (["--draws", "-1"], "draws"), (["--seed", "-1"], "--seed"),
        (["--search", "luck"], "luck"), (["--travel", "0"], "travel"), (["--travel", "1e9"], "table"),
        (["--model", "nowhere.yaml"], "nowhere.yaml"),
    ],
)  # fmt: skip
def test_bad_input_ends_in_one_line(folder, tmp_path, capsys, argv, named):
    assert main(["plan", str(folder), *QUICK, "--out", str(tmp_path / "out"), *argv]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and named in error
    assert not (tmp_path / "out").exists()


def test_an_output_folder_that_cannot_be_is_refused_before_the_search(folder, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(run_plan, "plan", None)
    assert main(["plan", str(folder), *QUICK, "--out", str(folder / "model.yaml" / "deeper")]) == 1
    assert "cannot be written" in capsys.readouterr().err


def test_the_rod_of_a_file_for_a_robot_is_as_high_as_the_recorded_one(folder, tmp_path, few_rows):
    """Where an upright rod touches is not where its centre is: it would be in the table."""
    (folder / "model.yaml").write_text(replace(TILTED, tip_height=0.06).dump())
    files = planned_files(folder, tmp_path / "out")
    heights = {row.split(",")[3] for row in files["push.csv"].decode().splitlines()[1:]}
    assert heights == {"0.0600000"} and json.loads(files["plan.json"])["hand_height_m"] == 0.06


@pytest.mark.parametrize(
    ("write", "named"),
    [
        ({}, "no model.yaml"),
        ({"model.yaml": "{"}, "model.yaml"),
        ({"model.yaml": MODEL.dump(), "result.json": "{"}, "result.json"),
        ({"model.yaml": MODEL.dump(), "result.json": '{"friction_scatter": 7}'}, "result.json"),
        ({"model.yaml": replace(MODEL, intervals={"theta.mass": "x"}).dump()}, "theta.mass"),
        ({"model.yaml": MODEL.dump().replace("static_ratio: 1.0", "static_ratio: 0.5")}, "theta.static_ratio"),
        ({"model.yaml": MODEL.dump().replace("restitution: 0.0", "restitution: 1.5")}, "theta.restitution"),
        (
            {"model.yaml": replace(MODEL, config=replace(MODEL.config, friction_cells=[1.0, 1.0])).dump()},
            "friction_cells",
        ),
    ],
)
def test_a_run_that_cannot_be_planned_from_ends_in_one_line(tmp_path, capsys, write, named):
    (tmp_path / "run").mkdir()
    for name, text in write.items():
        (tmp_path / "run" / name).write_text(text)
    assert main(["plan", str(tmp_path / "run"), *QUICK, "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and named in error
    assert main(["plan", str(tmp_path / "nowhere"), *QUICK]) == 1
    assert "no such folder" in capsys.readouterr().err
    assert main(["plan", *QUICK]) == 1
    assert "--model" in capsys.readouterr().err


def test_ctrl_c_ends_with_130_and_writes_nothing(folder, tmp_path, capsys, monkeypatch):
    def interrupted(*args, **more):
        raise KeyboardInterrupt

    monkeypatch.setattr("physid_drake.plan.pipeline.trajectory_of", interrupted)
    assert main(["plan", str(folder), *QUICK, "--out", str(tmp_path / "out")]) == 130
    assert "interrupted" in capsys.readouterr().err and not (tmp_path / "out").exists()


# The main job.


@pytest.mark.slow
def test_the_main_job_plans_with_what_it_identified(tmp_path):
    recording = write_small(tmp_path / "small")
    plan = {"start_m": [0.0, 0.0], "goal_m": [0.25, 0.0], "budget": 6, "sweep": 3, "draws": 2}
    override = {"plan": {"policy": "push_speed", **plan}}
    out = tmp_path / "out"
    assert quick(out, recording=recording, plan_too=True, **override) == 0
    content = json.loads((out / "plan.json").read_text())
    theta = json.loads((out / "result.json").read_text())["theta"]["support_friction"]
    model = load_model(out)
    assert theta["value"] == pytest.approx(float(model.body.support_friction[0]), rel=1e-5)  # six digits
    assert theta["ci90"] == pytest.approx(model.intervals["theta.support_friction"], rel=1e-5)
    assert model.correlation == Correlation(names=("theta.support_friction",), matrix=((1.0,),))
    assert (
        content["policy"] == "push_speed"
        and len(content["sweep"]["rows"]) == 3
        and content["posterior"]["samples"] == 2
    )
    assert yaml.safe_load((out / "config.yaml").read_text())["small"]["plan"]["budget"] == 6
    assert (out / "push.csv").exists() and (out / "plan.png").exists()
    for page in ("plan.html", "index.html"):
        text = (out / page).read_text()
        assert f"{content['settings']['speed']['value']:.4f} m/s" in text and "Miss against speed" in text


TILT = (TableTilt(x=0.04),)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("verdict", "effects", "rivals", "caveat"),
    [
        ("consistent", (), (), None),
        ("explained", TILT, (), None),
        ("ambiguous", TILT, ("tether", "magnet"), "table_tilt is indistinguishable from tether or magnet"),
        ("unexplained", (), (), "the plan may fail"),
    ],
)
def test_the_main_job_plans_again_with_what_its_diagnosis_found(
    tmp_path, capsys, monkeypatch, verdict, effects, rivals, caveat
):
    """The push planned without a tilt ends elsewhere on a tilted table; the plan that is left knows the tilt."""

    def diagnosed(known, **_):
        named = [SimpleNamespace(name=e.name, indistinguishable_from=rivals) for e in effects]
        said = SimpleNamespace(verdict=verdict, sentence="Said & done.", effects=named, rollouts=1)
        return said, SimpleNamespace(
            known=known, corrected=known.fit, fitter=known.fitter, errors_after=known.errors
        )  # fmt: skip

    model = run_cell.Work.model

    def with_effects(work, examined):
        return replace(model(work, run_cell.Examined(known=examined.known)), effects=effects)

    monkeypatch.setattr(run_cell, "diagnose_from", diagnosed)
    monkeypatch.setattr(run_cell.Work, "model", with_effects)
    for name in ("write", "show"):
        monkeypatch.setattr(run_cell, name, lambda *_, **__: None)
    plan = {"start_m": [0.0, 0.0], "goal_m": [0.25, 0.0], "budget": 15, "sweep": 3, "draws": 0}
    override = json.dumps({**RUN, "plan": {"policy": "push_speed", **plan}})
    recording = write_small(tmp_path / "small")
    flags = ["--recording", str(recording), "--out", str(tmp_path / "out"), "--set", override, "--no-view"]
    assert run_cell.main(flags) == 0
    content = json.loads((tmp_path / "out" / "plan.json").read_text())
    shown, page = " ".join(capsys.readouterr().out.split()), (tmp_path / "out" / "plan.html").read_text()
    assert f"<b>{verdict}</b>. Said &amp; done." in (tmp_path / "out" / "index.html").read_text()
    assert content["effects"] == [e.name for e in effects]
    assert ("push_speed, with table_tilt" in shown) == ("push_speed, with table_tilt" in page) == bool(effects)
    assert ("baseline plan" in shown) == ("baseline plan" in page) == bool(effects)
    warned = " ".join(content["warnings"])
    assert (page.count("<th>warning") > 0) == bool(warned)
    for said in ("table_tilt is indistinguishable from tether or magnet", "the plan may fail"):
        assert warned.count(said) == page.count(said) == (said == caveat)
    plain = content["baseline_plan"]
    assert (plain is None) == (not effects)
    if effects:
        assert plain["cost_m"] > content["predicted"]["cost_m"] + 0.005 > plain["predicted"]["cost_m"]
        assert plain["settings"]["speed"]["value"] != content["settings"]["speed"]["value"]


def test_the_main_job_refuses_a_goal_off_the_table_before_it_writes(tmp_path, capsys):
    recording = write_small(tmp_path / "small")
    assert quick(tmp_path / "out", recording=recording, plan_too=True, plan={"goal_m": [3.0, 0.0]}) == 1
    assert "not on the table" in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("plan_section", "named"),
    [
        ({"policy": "throw"}, "throw"),
        ({"goal_m": [1.0]}, "goal_m"),
        ({"budget": 0}, "budget"),
        ({"speeds": 3}, "speeds"),
    ],
)
def test_the_main_job_refuses_a_plan_it_cannot_make(tmp_path, capsys, plan_section, named):
    recording = write_small(tmp_path / "small")
    assert quick(tmp_path / "out", recording=recording, plan_too=True, plan=plan_section) == 1
    assert named in capsys.readouterr().err


def test_the_planner_starts_where_the_recording_began():
    identifier = coarse_identifier(shipped_pushes(2))
    planner = planner_of(PlanConfig(), identifier.case.pool.spec, identifier.case.problems, "eraser", 0)
    assert planner.situation.start == identifier.case.problems[0].start.pose
    assert planner.situation.order == 2 and planner.situation.hand_height == pytest.approx(0.015)
    assert planner.goal == pytest.approx((planner.situation.start[0] + 0.3, planner.situation.start[1]))
    assert planner.dimension == 3
    z = float(np.median(shipped_pushes(1).pushes[0].hand.positions[:, 2]))
    assert planner.hand.tip_height == pytest.approx(z)
    assert 0.05 < planner.hand.top_speed < 1.0


def test_without_a_hand_no_push_is_planned_and_a_goal_is_refused(capsys):
    known = shipped_pushes(2)
    toss = replace(known, hand=None, pushes=tuple(replace(p, hand=None, force=None) for p in known.pushes))
    assert run_cell._planner(Scenario(), toss, None, Console()) is None
    assert "No push is planned" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(ConfigError, match="no hand"):
        run_cell._planner(Scenario(plan=PlanConfig(goal_m=[0.3, 0.1])), toss, None, Console())


def test_no_goal_that_fits_is_no_reason_to_stop_but_a_wrong_one_is(capsys):
    recording = shipped_pushes(2)
    first = recording.pushes[0]
    x, y = first.object.positions[0, :2]
    again = replace(first, name="again.csv")
    small = replace(recording, pushes=(first, again), table=Table(size=(0.01, 0.01), centre=(x, y)))
    identifier = coarse_identifier(small)
    assert run_cell._planner(Scenario(), small, identifier, Console()) is None
    assert "No push is planned" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(ConfigError, match="not on the table"):
        run_cell._planner(Scenario(plan=PlanConfig(goal_m=[5.0, 5.0])), small, identifier, Console())


def test_a_push_that_misses_is_said_and_another_policy_is_offered(folder, tmp_path, capsys, few_rows):
    """Along a direction that leads aside, no speed brings it to the goal."""
    out = tmp_path / "out"
    argv = ["--goal", "0.1", "0.05", "--direction", "-40", "--budget", "12", "--draws", "0", "--out", str(out)]
    assert main(["plan", str(folder), *argv]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    missed = 1e3 * json.loads((out / "plan.json").read_text())["predicted"]["cost_m"]
    assert missed > 20.0 and f"The best push misses the goal by {missed:.1f} mm; the tolerance is 10 mm." in shown
    nearer = re.search(r"--policy (push|two_pushes) (reaches it|comes nearer): miss ([\d.]+) mm\.", shown)
    assert nearer is not None and float(nearer[3]) < missed
    assert (nearer[2] == "reaches it") == (float(nearer[3]) <= 10.0)
    assert f"by {missed:.1f} mm; the tolerance is 10 mm" in (out / "plan.html").read_text()


def test_a_push_that_reaches_its_goal_says_nothing_of_the_kind(folder, tmp_path, capsys, few_rows):
    argv = ["--goal", "0.1", "0.05", "--tolerance", "0.03", "--budget", "30", "--draws", "0"]
    assert main(["plan", str(folder), *argv, "--policy", "push", "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert "misses the goal" not in shown and "--policy" not in shown
