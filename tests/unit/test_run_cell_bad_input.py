"""Every bad input of the main job ends in one clear line, exit status 1, nothing half-written."""

from dataclasses import replace

import numpy as np
import pytest
from runs import quick, rewrite_yaml, shipped_pushes, write_small

from physid_drake import run_cell
from physid_drake.cell.stepper import Stepper
from physid_drake.recording import PoseStream, write_recording
from physid_drake.run_folder import RunFolder


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return write_small(tmp_path_factory.mktemp("recordings") / "small")


@pytest.fixture
def refused(capsys, tmp_path):
    """Runs the main job, and gives the one line it must end in; nothing is left behind."""

    def run(*argv, status=1):
        before = sorted(tmp_path.rglob("*"))
        assert run_cell.main([*(str(a) for a in argv), "--no-view"]) == status
        error = capsys.readouterr().err
        assert error.startswith("error: ")
        assert error.count("\n") == 1
        assert "Traceback" not in error
        assert sorted(tmp_path.rglob("*")) == before
        return error

    return run


def out(tmp_path):
    return "--out", tmp_path / "out"


def test_a_missing_recording(refused, tmp_path):
    assert "nowhere" in refused(*out(tmp_path), "--recording", tmp_path / "nowhere")


def test_a_recording_without_its_description(refused, tmp_path):
    (tmp_path / "empty").mkdir()
    assert "recording.yaml" in refused(*out(tmp_path), "--recording", tmp_path / "empty")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: [1, 2\nb: }", "is no YAML"),
        ("a: {sed: 1}", "'sed'"),
        ("a: {cell: {contact: {modell: point}}}", "'modell'"),
        ("a: {search: {budget: many}}", "many"),
        ("", "named scenarios"),
        pytest.param(
            "_a: {}",
            "scenario",
        ),
    ],
)
def test_a_broken_config(refused, tmp_path, text, said):
    file = tmp_path / "mine.yaml"
    file.write_text(text)
    message = refused(file, *out(tmp_path))
    assert str(file) in message
    assert said in message


def test_a_missing_config(refused, tmp_path):
    assert "nowhere.yaml" in refused(tmp_path / "nowhere.yaml", *out(tmp_path))


def test_an_unknown_scenario(refused, tmp_path):
    assert "'rubber'" in refused("eraser.yaml:rubber", *out(tmp_path))


@pytest.mark.parametrize("override", ["{a: [", "{foo: 1}", "{search: {bugdet: 1}}", "{seed: many}", "3"])
def test_a_bad_override(refused, tmp_path, override):
    assert "--set" in refused("--set", override, *out(tmp_path))


def test_an_unknown_flag_is_a_usage_error(capsys):
    with pytest.raises(SystemExit) as caught:
        run_cell.main(["--speed", "3"])
    assert caught.value.code == 2
    assert "--speed" in capsys.readouterr().err


def changed(folder, name, change):
    """A copy of a recording with one file's text changed."""
    write_recording(shipped_pushes(3), folder)
    file = folder / name
    file.write_text(change(file.read_text()))
    return folder


def swap_rows(text):
    lines = text.splitlines(keepends=True)
    return "".join([*lines[:5], lines[6], lines[5], *lines[7:]])


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("recording.yaml", lambda t: t.replace("physid-recording/1", "physid-recording/9"), "format"),
        ("recording.yaml", lambda t: t + "colour: red\n", "colour"),
        ("recording.yaml", lambda t: t.replace("pushes/002.csv", "pushes/099.csv"), "099.csv"),
        ("pushes/002.csv", swap_rows, "row 7: column time_s"),
        ("pushes/002.csv", lambda t: t.replace("0.0,", "nan,", 1), "002.csv: row 2"),
    ],
)
def test_a_recording_that_the_format_refuses(refused, tmp_path, name, change, said):
    folder = changed(tmp_path / "bad", name, change)
    assert said in refused("--recording", folder, *out(tmp_path))


CUBE = "".join(f"v {x} {y} {z}\n" for x in (-0.06, 0.06) for y in (-0.02, 0.02) for z in (-0.01, 0.01))


@pytest.mark.parametrize(
    "text",
    [
        "hello\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 x\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n",
        CUBE + "v 1e400 0 0\n",
    ],
    ids=["no mesh", "no number", "flat", "infinite"],
)
def test_a_mesh_that_does_not_load(refused, tmp_path, text):
    folder = meshed(tmp_path / "mesh", text)
    assert "mesh" in refused("--recording", folder, *out(tmp_path))


def meshed(folder, text):
    write_small(folder)
    (folder / "body.obj").write_text(text)
    rewrite_yaml(folder / "recording.yaml", object={"shape": "mesh", "file": "body.obj", "mass_kg": 0.054})
    return folder


def test_a_hand_above_the_object(refused, tmp_path):
    pushes = shipped_pushes(3)
    high = []
    for push in pushes.pushes:
        hand = push.hand
        lifted = PoseStream(times=hand.times, positions=hand.positions + np.array([0.0, 0.0, 0.2]),
                            quaternions=hand.quaternions)  # fmt: skip
        high.append(replace(push, hand=lifted))
    write_recording(replace(pushes, pushes=tuple(high)), tmp_path / "high")
    message = refused("--recording", tmp_path / "high", *out(tmp_path))
    assert "pushes/001.csv" in message
    assert "passes the object" in message


@pytest.mark.parametrize(
    ("theta", "said"),
    [
        ("{nominal: {hand_friction: 9}}", "hand_friction"),
        ("{bounds: {mass: [0.1, 0.2]}, nominal: {mass: 0.3}}", "mass"),
        ("{nominal: {mass: .nan}}", "mass"),
        ("{bounds: {mass: [0.5, 0.1]}}", "mass"),
        ("{bounds: {mass: [-1, 1]}}", "mass"),
        ("{bounds: {mass: [0.1]}}", "mass"),
        ("{parameters: [weight]}", "weight"),
        ("{parameters: []}", "at least one"),
    ],
)
def test_theta_outside_its_bounds(refused, recording, tmp_path, theta, said):
    assert said in refused("--recording", recording, "--set", f"{{theta: {theta}}}", *out(tmp_path))


def test_what_an_override_has_wrong_is_not_put_down_to_the_file(refused, tmp_path):
    said = refused("--set", "{search: {method: annealing}}", *out(tmp_path))
    assert "--set, key 'search.method': must be one of" in said and "sealed.yaml" not in said


@pytest.mark.parametrize(
    "contact",
    [
        "{dissipation_s_per_m: -1}",
        "{stiction_tolerance_mps: 0}",
        "{stiction_tolerance_mps: -1}",
        "{hand_frequency_rad_s: 0}",
    ],
)
def test_a_contact_that_drake_refuses(refused, tmp_path, contact):
    refused("--set", f"{{cell: {{contact: {contact}}}}}", *out(tmp_path))


def test_a_negative_seed(refused, tmp_path):
    assert "seed" in refused("--seed", -1, *out(tmp_path))


def test_an_output_folder_that_is_a_file(refused, tmp_path):
    (tmp_path / "out").write_text("precious")
    assert "cannot be written" in refused(*out(tmp_path))
    assert (tmp_path / "out").read_text() == "precious"


def test_an_output_folder_below_a_file(refused, tmp_path):
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused("--out", tmp_path / "file" / "out")


def test_an_output_folder_that_the_system_refuses(refused):
    assert "'/proc/x'" in refused("--out", "/proc/x")


def test_a_folder_in_the_place_of_the_config(refused, tmp_path):
    (tmp_path / "out" / "config.yaml").mkdir(parents=True)
    assert "is not empty" in refused(*out(tmp_path))


@pytest.mark.slow
def test_a_folder_in_the_place_of_the_result_leaves_no_scraps(tmp_path, recording, capsys):
    RunFolder.begin(tmp_path / "out", "run_cell")
    (tmp_path / "out" / "result.json").mkdir()
    assert quick(tmp_path / "out", recording=recording) == 1
    assert "result.json" in capsys.readouterr().err
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"manifest.json", "result.json"}


@pytest.mark.parametrize("content", [b"garbage", b"", None], ids=["garbage", "empty", "folder"])
def test_a_state_to_go_on_from_that_is_none(tmp_path, recording, capsys, content):
    """Either it is not taken, or one line says so."""
    state = RunFolder.begin(tmp_path / "out", "run_cell").own("belief.npz")
    state.mkdir() if content is None else state.write_bytes(content)
    status = quick(tmp_path / "out", recording=recording)
    error = capsys.readouterr().err
    assert status == 0 or (status == 1 and "belief.npz" in error)


# Rollouts that fail are outcomes of a trial, not errors.


def failing(monkeypatch, which, error):
    """Lets the steps of some rollouts fail; ``which`` is told how many rollouts there have been."""
    advance, begin = Stepper._advance, Stepper._begin_at
    count = {"rollouts": 0}

    def begin_at(self, *args):
        count["rollouts"] += 1
        begin(self, *args)

    def fail(self, *args, **more):
        if which(count["rollouts"]):
            raise error
        return advance(self, *args, **more)

    monkeypatch.setattr(Stepper, "_begin_at", begin_at)
    monkeypatch.setattr(Stepper, "_advance", fail)


@pytest.mark.slow
@pytest.mark.parametrize(
    "error", [SystemExit("GJK: no convergence"), RuntimeError("step failed"), FloatingPointError("left")], ids=repr
)
def test_rollouts_that_diverge_are_counted_and_not_fatal(tmp_path, recording, capsys, monkeypatch, error):
    # The second trial of the search: its three pushes.
    failing(monkeypatch, lambda rollout: rollout in (4, 5), error)
    assert quick(tmp_path / "out", recording=recording, search={"integrator": "cell"}) == 0
    captured = capsys.readouterr()
    assert "2 of " in captured.out
    assert "rollouts diverged and count as failed" in captured.out
    assert "error" not in captured.err and "Traceback" not in captured.err
    assert '"failed": 1' in (tmp_path / "out" / "result.json").read_text()


@pytest.mark.slow
def test_an_object_that_flies_away_has_diverged(recording, tmp_path, capsys, monkeypatch):
    """A kilometre in a second, in every rollout of one trial."""
    count = {"rollouts": 0}
    begin = Stepper._begin_at

    def thrown(self, *args):
        begin(self, *args)
        count["rollouts"] += 1
        if count["rollouts"] <= 3:
            self._state.set_twist((1e3, 0.0, 0.0))

    monkeypatch.setattr(Stepper, "_begin_at", thrown)
    assert quick(tmp_path / "out", recording=recording, search={"integrator": "cell"}) == 0
    assert "3 of " in capsys.readouterr().out


def test_a_recording_that_no_rollout_follows_is_not_fatal(tmp_path, recording, capsys, monkeypatch):
    failing(monkeypatch, lambda _: True, RuntimeError("step failed"))
    status = quick(tmp_path / "out", recording=recording)
    captured = capsys.readouterr()
    assert (status == 0 and "diverged" in captured.out) or (status == 1 and captured.err.count("error: ") == 1)


@pytest.mark.slow
def test_a_rollout_that_does_not_even_begin_is_not_fatal(tmp_path, recording, capsys, monkeypatch):
    begin, count = Stepper._begin_at, {"rollouts": 0}

    def begin_at(self, *args):
        count["rollouts"] += 1
        if count["rollouts"] == 1:
            raise SystemExit("GJK: no convergence")
        begin(self, *args)

    monkeypatch.setattr(Stepper, "_begin_at", begin_at)
    assert quick(tmp_path / "out", recording=recording) == 0
    assert "1 of " in capsys.readouterr().out
