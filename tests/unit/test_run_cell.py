"""The main job: what a run leaves behind, and how it goes on after an interrupt."""

import json
import shutil
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import yaml
from runs import QUICK, laid_over, quick, write_small

from physid_drake import run_cell
from physid_drake.identify import identify, theta_search
from physid_drake.run_folder import RunFolder
from physid_drake.scenario import load_scenario


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_small(tmp_path_factory.mktemp("recordings") / "small")


@pytest.fixture(scope="module")
def done(tmp_path_factory, recording):
    """The folder of a finished run, seed 3."""
    folder = tmp_path_factory.mktemp("runs") / "deep" / "done"
    assert quick(folder, "--seed", 3, recording=recording) == 0
    return folder


def result_of(folder):
    return json.loads((folder / "result.json").read_text())


def test_a_run_leaves_its_configuration_its_result_and_its_page(done):
    assert {path.name for path in done.iterdir()} == {
        "manifest.json",
        "config.yaml",
        "result.json",
        "index.html",
        "scene.html",
        "model.yaml",
    }
    assert {oct(path.stat().st_mode & 0o777) for path in done.iterdir()} == {"0o644"}


def test_the_result_says_everything_that_was_asked(done):
    result = result_of(done)
    assert result["format"] == "physid-result/1"
    assert result["seed"] == 3
    assert set(result["versions"]) >= {"physid_drake", "drake", "numpy", "scipy", "python"}
    assert result["held_out"]["pushes"] == result["training"]["pushes"] == [*result["per_push_parameters"]]
    assert result["model"] == {"verdict": None, "effects": []} and result["pushes"] == 3
    friction = result["theta"]["support_friction"]
    assert set(friction) == {"value", "unit", "ci90", "identifiable", "prior", "at_bound"}
    assert friction["ci90"][0] < friction["value"] < friction["ci90"][1]
    assert result["search"]["trials"] == 2


@pytest.mark.slow
def test_the_configuration_beside_the_result_gives_the_same_result(done, recording, tmp_path):
    again = tmp_path / "again"
    assert run_cell.main([str(done / "config.yaml"), "--out", str(again), "--no-view", "--no-diagnosis"]) == 0
    assert (again / "config.yaml").read_text() == (done / "config.yaml").read_text()
    assert (again / "result.json").read_bytes() == (done / "result.json").read_bytes()


def test_flags_and_overrides_are_written_into_the_configuration(done, recording):
    _, scenario = load_scenario(str(done / "config.yaml"), None)
    assert scenario.seed == 3
    assert scenario.recording == str(recording)
    assert scenario.search.budget == 2
    assert scenario.cell.contact.model == "point"


class Page(HTMLParser):
    """Attributes of a page's own tags, and its text; scripts are not looked into."""

    def __init__(self):
        super().__init__()
        self.loads, self.text, self.tags = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.loads += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "data", "action")]

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def page(done):
    parser = Page()
    parser.feed((done / "index.html").read_text())
    return parser


def test_the_page_loads_nothing_from_elsewhere(page):
    assert {value[:80] for value in page.loads if not value.startswith(("data:", "#"))} == {"scene.html"}


def test_the_page_shows_the_numbers_of_the_result(page, done):
    text = " ".join("".join(page.text).split())
    result = result_of(done)
    for name, estimate in result["theta"].items():
        assert name in text
        assert f"{estimate['value']:.4g}" in text
        assert "{:.4g} to {:.4g}".format(*estimate["ci90"]) in text
    assert f"{1e3 * result['held_out']['identified']['position_rms_m']:.2f}" in text
    assert f"reduced chi-square {result['reduced_chi2']:.2f}" in text
    assert "Seed 3" in text


def test_the_scene_lets_a_person_choose_every_push_and_loads_nothing(done):
    scene = Page()
    scene.feed((done / "scene.html").read_text())
    assert scene.tags.count("option") == 3
    for name in result_of(done)["training"]["pushes"]:
        assert name in "".join(scene.text)
    assert {value[:80] for value in scene.loads if not value.startswith(("data:", "#"))} == {"index.html"}


@pytest.mark.slow
def test_a_name_that_looks_like_html_stays_text(tmp_path):
    folder = write_small(tmp_path / "odd", name="<b>odd</b> & [red]$x$")
    assert quick(tmp_path / "out", recording=folder) == 0
    assert "&lt;b&gt;odd&lt;/b&gt; &amp; [red]$x$" in (tmp_path / "out" / "index.html").read_text()


def test_the_terminal_shows_theta_accuracy_and_verdict(recording, tmp_path, capsys):
    assert quick(tmp_path / "out", recording=recording, theta={"parameters": ["mass"]}) == 0
    shown = capsys.readouterr().out
    assert "mass" in shown
    assert "no (interval is the prior)" in " ".join(shown.split())
    assert "held-out" in shown
    assert "reduced chi-square" in shown


class _CtrlC:
    """Ctrl-C during a trial of the search, or at the fit after it."""

    def __init__(self, monkeypatch, trial=None):
        self.calls = 0
        module, name = (identify, "baseline") if trial is None else (theta_search, "log_misfits")
        original = getattr(module, name)

        def interrupted(*args):
            self.calls += 1
            if trial is None or self.calls == trial:
                raise KeyboardInterrupt
            return original(*args)

        monkeypatch.setattr(module, name, interrupted)


SEARCH = {"search": {"budget": 6, "entropy_tolerance_nats": 0.0}}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory, recording):
    folder = tmp_path_factory.mktemp("runs") / "uninterrupted"
    assert quick(folder, recording=recording, **SEARCH) == 0
    return result_of(folder)


@pytest.mark.slow
@pytest.mark.parametrize(
    "trial",
    [
        4,
        None,
    ],
    ids=["in the search", "in the fit"],
)
def test_ctrl_c_keeps_what_was_found_and_the_same_command_goes_on(
    trial, recording, tmp_path, capsys, monkeypatch, uninterrupted
):
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        _CtrlC(patch, trial)
        assert quick(out, recording=recording, **SEARCH) == 130
    assert "interrupted" in capsys.readouterr().err
    assert {"manifest.json", "config.yaml", "belief.npz"} <= {path.name for path in out.iterdir()}
    with monkeypatch.context() as patch:
        count = _CtrlC(patch, trial=-1)
        assert quick(out, recording=recording, **SEARCH) == 0
    assert count.calls == (0 if trial is None else 3)
    assert not (out / "belief.npz").exists()
    assert result_of(out) == uninterrupted


@pytest.mark.slow
def test_ctrl_c_after_the_identification_keeps_it_too(recording, tmp_path, monkeypatch):
    """A plan and a diagnosis follow, which take longer."""

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        patch.setattr(run_cell, "_keep_plan", interrupted)
        assert quick(out, recording=recording, **SEARCH) == 130
    assert (out / "belief.npz").exists()
    with monkeypatch.context() as patch:
        count = _CtrlC(patch, trial=-1)
        assert quick(out, recording=recording, **SEARCH) == 0
    assert count.calls == 0
    assert not (out / "belief.npz").exists()


@pytest.mark.slow
def test_another_configuration_does_not_go_on_from_there(recording, tmp_path, monkeypatch):
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        _CtrlC(patch)
        assert quick(out, recording=recording) == 130
    RunFolder.begin(out, "run_cell").own("rollouts.bin").touch()  # of a diagnosis
    other = laid_over(SEARCH, {"seed": 4})
    with monkeypatch.context() as patch:
        count = _CtrlC(patch, trial=-1)
        assert quick(out, recording=recording, **other) == 0
    assert count.calls == 6
    assert not (out / "rollouts.bin").exists()
    assert np.isfinite(result_of(out)["reduced_chi2"])


@pytest.mark.slow
def test_a_recording_that_was_changed_since_is_not_gone_on_with(tmp_path, monkeypatch):
    recording, out = write_small(tmp_path / "recording", 3), tmp_path / "out"
    with monkeypatch.context() as patch:
        _CtrlC(patch)
        assert quick(out, recording=recording, **SEARCH) == 130
    shutil.rmtree(recording)
    write_small(recording, 2)
    with monkeypatch.context() as patch:
        count = _CtrlC(patch, trial=-1)
        assert quick(out, recording=recording, **SEARCH) == 0
    assert count.calls == 6


@pytest.mark.slow
def test_the_main_job_learns_push_by_push_on_request(tmp_path):
    recording = write_small(tmp_path / "recording", 2)
    assert quick(tmp_path / "out", recording=recording, search={"online": True}) == 0
    content = json.loads((tmp_path / "out" / "result.json").read_text())
    assert len(content["training"]["pushes"]) == 2
    assert content["next_push_prediction"]["rms_sigma"] < content["held_out"]["initial_guess"]["rms_sigma"]


@pytest.mark.slow
def test_a_pipe_that_closes_loses_no_result(tmp_path, monkeypatch):
    def closed(*_, **__):
        raise SystemExit(1)

    monkeypatch.setattr(run_cell, "_show", closed)
    with pytest.raises(SystemExit):
        quick(tmp_path / "out", recording=write_small(tmp_path / "recording", 2))
    assert {"result.json", "index.html", "model.yaml"} <= {file.name for file in (tmp_path / "out").iterdir()}


def test_an_unknown_search_is_refused_before_anything_is_written(tmp_path, capsys):
    recording = write_small(tmp_path / "recording", 2)
    assert quick(tmp_path / "out", recording=recording, search={"method": "annealing"}) == 1
    assert "search.method" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def everything(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def refused(capsys, *argv):
    assert run_cell.main([*map(str, argv), "--no-view"]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1
    return error


def test_a_recordings_folder_is_no_place_for_results(tmp_path, capsys):
    """Its tables may have the names of results."""
    flat = write_small(tmp_path / "flat", 2)
    for k in (1, 2):
        (flat / f"push_{k}.csv").write_text("raw")
    before = everything(flat)
    assert "read from" in refused(capsys, "--recording", flat, "--out", flat)
    assert everything(flat) == before


def test_a_configurations_folder_is_no_place_for_results(tmp_path, recording, capsys):
    (tmp_path / "config.yaml").write_text(f"lab: {{recording: {recording}}}")
    for name in ("model.yaml", "index.html", "push.csv"):
        (tmp_path / name).write_text("mine")
    before = everything(tmp_path)
    assert "read from" in refused(capsys, tmp_path / "config.yaml", "--out", tmp_path)
    assert everything(tmp_path) == before


def test_a_folder_of_somebodys_own_is_refused(tmp_path, recording, capsys):
    (tmp_path / "index.html").write_text("mine")
    assert "is not empty" in refused(capsys, "--recording", recording, "--out", tmp_path)
    assert everything(tmp_path) == {Path("index.html"): b"mine"}


@pytest.mark.parametrize(("flag", "file"), [("--no-diagnosis", "diagnosis.json"), ("--no-plan", "plan.json")])
def test_a_flag_that_leaves_a_result_out_does_not_drop_the_one_that_is_there(
    tmp_path, recording, capsys, monkeypatch, flag, file
):
    monkeypatch.setattr(run_cell, "_fill", lambda folder, *_: folder.write(file, "{}"))
    monkeypatch.setattr(run_cell, "_keep_serving", lambda *_: None)
    asked = ["--recording", str(recording), "--out", str(tmp_path / "out"), "--no-view"]
    assert run_cell.main(asked) == 0
    assert flag in refused(capsys, *asked, flag)
    assert (tmp_path / "out" / file).exists()
    for other in (["--seed", "5", flag], ["--seed", "5"], ["--seed", "5", "--host", "nonsense"]):
        refused(capsys, *asked, *other)
        assert (tmp_path / "out" / file).exists()


@pytest.mark.slow
def test_all_files_of_a_run_say_the_same(tmp_path):
    """One theta, one set of errors, one verdict, to the digit."""
    out, recording = tmp_path / "out", write_small(tmp_path / "recording", 4)
    override = json.dumps(laid_over(QUICK, {"theta": {"parameters": ["hand_friction", "support_friction"]}}))
    arguments = ["--recording", recording, "--out", out, "--set", override, "--no-view", "--no-plan"]
    assert run_cell.main([str(a) for a in arguments]) == 0
    result, said = result_of(out), json.loads((out / "diagnosis.json").read_text())
    model = yaml.safe_load((out / "model.yaml").read_text())
    assert result["model"]["verdict"] == said["verdict"] == "consistent"
    for name, told in result["theta"].items():
        assert told["value"] == said["theta"][name]["value"] == said["theta"][name]["before"]
        assert (
            told["ci90"]
            == said["theta"][name]["ci90"]
            == pytest.approx(model["intervals"][f"theta.{name}"], rel=1e-5)
        )
        assert told["value"] == pytest.approx(np.ravel(model["theta"][name])[0], rel=1e-5)
    errors = result["held_out"]["identified"]
    assert errors["position_rms_m"] == said["fit"]["held_out_rms_after_m"]
    assert errors["rotation_rms_rad"] == said["fit"]["held_out_rms_after_rad"]
    assert result["reduced_chi2"] == said["reduced_chi2_before"] == said["reduced_chi2_after"]
    assert (result["friction_scatter"], result["noise"]) == (said["friction_scatter"], said["noise"])
