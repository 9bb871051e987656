"""The command ``prove`` with worlds and diagnoses that cost nothing."""

import json
import signal
import stat
import sys
import time
from pathlib import Path

import pytest

from physid_drake.cli import build_parser, main
from physid_drake.errors import ProofError
from physid_drake.run_folder import RunFolder
from physid_drake.validation import run_prove
from physid_drake.validation.sealing.diagnosing import Task, attempt_of, diagnose_all, diagnose_command
from physid_drake.validation.sealing.seal import write_seal
from physid_drake.validation.sealing.secret import keep_secret, read_secret

# Notes that it was called, then does as the world's answer says.
FAKE = """
import json, pathlib, sys, time
recording, out = map(pathlib.Path, sys.argv[1:])
with open(out.parent.parent / "calls.txt", "a") as calls:
    calls.write(recording.name + "\\n")
answer = json.loads((recording / "answer.json").read_text())
time.sleep(answer.get("sleep", 0.0))
if "error" in answer:
    print(answer["error"], file=sys.stderr)
    sys.exit(answer.get("exit", 1))
(out / "diagnosis.json").write_text(json.dumps(answer["diagnosis"]))
"""


def fake(recording, folder, *sealed):
    return (sys.executable, "-c", FAKE, str(recording), str(folder))


def diagnosis(verdict, names=()):
    effects = [{"name": n, "indistinguishable_from": [], "probability": 0.9, "parameters": {}} for n in names]
    fit = {"held_out_rms_before": 5.0, "held_out_rms_after": 1.1}
    return {"verdict": verdict, "effects": effects, "fit": fit, "reduced_chi2_after": 1.0}


ANSWERS = (
    ("none", (), {"diagnosis": diagnosis("consistent")}),
    ("effect", ("viscous_drag",), {"diagnosis": diagnosis("explained", ["viscous_drag"])}),
    ("effect", ("table_tilt",), {"error": "error: the cell fell apart."}),
)


@pytest.fixture
def worlds(tmp_path, monkeypatch):
    """Three worlds, as if they had been made: one is right without an effect, one named, one fails."""

    def make(arguments, count, out, console):
        names = read_secret(out).names(count)
        for name, (kind, true, answer) in zip(names, ANSWERS, strict=False):
            for part in ("sealed", f"recordings/{name}"):
                (out / part).mkdir(parents=True, exist_ok=True)
            truth = {"id": name, "kind": kind, "effects": [{"name": n, "parameters": {}} for n in true],
                     "size_sigma": 8.0 * len(true)}  # fmt: skip
            file = out / "sealed" / f"{name}.json"
            if not file.exists():
                file.write_text(json.dumps(truth))
                (out / "recordings" / name / "answer.json").write_text(json.dumps(answer))
        return write_seal(out, names)

    monkeypatch.setattr(run_prove, "_make", make)
    return tmp_path / "proof"


def prove(out, *words):
    arguments = build_parser().parse_args(["prove", "--worlds", "3", "--jobs", "2", "--out", str(out), *words])
    return run_prove.run(arguments, command=fake)


def world(out, index):
    return read_secret(out).name_of(index)


def calls(out):
    file = out / "calls.txt"
    return file.read_text().split() if file.exists() else []


def test_a_world_that_fails_is_counted_and_listed_and_ends_nothing(worlds, capsys):
    assert prove(worlds) == 0
    content = json.loads((worlds / "proof.json").read_text())
    lost = world(worlds, 2)
    assert content["faults"] == [
        {"id": lost, "fault": "failed", "true": ["table_tilt"], "size_sigma": 8.0,
         "said": "failed (error: the cell fell apart.)"}
    ]  # fmt: skip
    assert (content["figures"]["failed"]["count"], content["figures"]["failed"]["of"]) == (1, 3)
    assert (
        content["figures"]["effect_clear"]["right"]["count"],
        content["figures"]["effect_clear"]["right"]["of"],
    ) == (1, 2)
    for name in ("proof.md", "index.html", "confusion.png"):
        assert (worlds / name).stat().st_size > 500
    said = capsys.readouterr().out
    assert said.index("sha256 " + content["seal_sha256"]) < said.index(world(worlds, 0))  # before the first diagnosis


def test_what_is_done_is_not_done_again(worlds):
    prove(worlds)
    first = (worlds / "proof.json").read_bytes()
    prove(worlds)
    assert len(calls(worlds)) == 3
    assert (worlds / "proof.json").read_bytes() == first
    prove(worlds, "--retry")
    assert calls(worlds)[3:] == [world(worlds, 2)]


def test_an_interrupted_run_keeps_what_is_finished_and_opens_the_seal_again(worlds, monkeypatch):
    tell = run_prove._tell

    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_prove, "_tell", stop)
    with pytest.raises(KeyboardInterrupt):
        prove(worlds, "--jobs", "1")
    assert stat.S_IMODE((worlds / "sealed").stat().st_mode) == 0o755
    assert not (worlds / "proof.json").exists()
    finished = [d.parent.name for d in (worlds / "diagnoses").glob("*/diagnosis.json")]
    assert len(finished) == 1
    assert prove(worlds, "--open") == 0  # what is there so far is scored, and nothing else is diagnosed
    content = json.loads((worlds / "proof.json").read_text())
    assert (sum(content["figures"]["worlds"].values()), content["sealed"]) == (1, 3)
    assert "1 worlds of 3 that were sealed" in (worlds / "proof.md").read_text()
    assert calls(worlds) == finished
    monkeypatch.setattr(run_prove, "_tell", tell)
    assert prove(worlds) == 0
    assert calls(worlds).count(finished[0]) == 1


def test_a_failure_that_is_tried_again_and_interrupted_has_not_ended(tmp_path):
    tasks = [Task(name="a", words=(sys.executable, "-c", "import time; time.sleep(60)"), folder=tmp_path / "a")]
    folder = RunFolder.begin(tmp_path / "a", "diagnose")
    folder.write("attempt.json", json.dumps({"seconds": 1.0, "error": "error: no"}))
    folder.write("diagnosis.json", "{}")  # written before it failed

    def stop(seconds):
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("physid_drake.validation.sealing.diagnosing.time.sleep", stop)
        diagnose_all(tasks, jobs=1, timeout=60.0, ended=lambda task, attempt: None, again=True)
    assert attempt_of(tmp_path / "a") is None


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_request_to_end_is_an_interruption(number):
    before = signal.signal(number, signal.SIG_DFL)  # it may be ignored: tests may run under nohup
    try:
        with pytest.raises(KeyboardInterrupt), run_prove.ended_softly():
            signal.raise_signal(number)
        assert signal.getsignal(number) == signal.SIG_DFL
        signal.signal(number, signal.SIG_IGN)  # as nohup does
        with run_prove.ended_softly():
            signal.raise_signal(number)
    finally:
        signal.signal(number, before)


def test_fewer_worlds_can_be_scored_of_more_that_are_sealed(worlds):
    prove(worlds)
    prove(worlds, "--worlds", "2")
    assert sum(json.loads((worlds / "proof.json").read_text())["figures"]["worlds"].values()) == 2
    arguments = build_parser().parse_args(["prove", "--open", "--out", str(worlds)])
    assert run_prove.run(arguments, command=fake) == 0
    assert sum(json.loads((worlds / "proof.json").read_text())["figures"]["worlds"].values()) == 3


def test_a_proof_where_it_is_by_default_is_opened_whole(worlds, monkeypatch):
    monkeypatch.chdir(worlds.parent)
    prove(Path("proofs") / "worlds")
    assert run_prove.run(build_parser().parse_args(["prove", "--open"]), command=fake) == 0


def test_the_sealed_folder_is_shut_while_worlds_are_diagnosed(worlds, monkeypatch):
    modes = []
    run_tasks = run_prove.run_tasks

    def look(*arguments):
        modes.append(stat.S_IMODE((worlds / "sealed").stat().st_mode))
        run_tasks(*arguments)

    monkeypatch.setattr(run_prove, "run_tasks", look)
    prove(worlds)
    assert modes == [0]
    assert stat.S_IMODE((worlds / "sealed").stat().st_mode) == 0o755


def test_a_broken_seal_is_refused(worlds, monkeypatch):
    run_tasks = run_prove.run_tasks

    def tamper(*arguments):
        run_tasks(*arguments)
        file = worlds / "sealed" / f"{world(worlds, 1)}.json"
        (worlds / "sealed").chmod(0o755)
        file.write_text(file.read_text().replace("viscous_drag", "table_tilt"))

    monkeypatch.setattr(run_prove, "run_tasks", tamper)
    with pytest.raises(run_prove.ProofError, match=r"^the seal is broken"):
        prove(worlds)
    assert not (worlds / "proof.json").exists()
    # Nor does a second run take the new truth for the old one.
    with pytest.raises(run_prove.ProofError, match="has changed since it was sealed"):
        prove(worlds)


def test_there_is_nothing_to_open_before_worlds_are_sealed_and_diagnosed(worlds, tmp_path):
    with pytest.raises(ProofError, match="holds no sealed worlds"):
        prove(tmp_path / "empty", "--open")
    assert not (tmp_path / "empty").exists()
    for name in ("sealed/", "recordings/", "seal.txt", "seal.sha256"):
        RunFolder.begin(worlds, "prove").own(name)
    keep_secret(worlds, 0)
    run_prove._make(build_parser().parse_args(["prove"]), 3, worlds, None)
    with pytest.raises(ProofError, match="none of the 3 sealed worlds"):
        prove(worlds, "--open")


def test_another_proof_in_the_same_folder_is_refused(worlds):
    prove(worlds)
    with pytest.raises(run_prove.ConfigError, match="holds another"):
        prove(worlds, "--seed", "5")


@pytest.mark.parametrize(
    ("words", "rule"),
    [
        (["--worlds", "0"], "--worlds must be at least 1"),
        (["--worlds", "2147483648"], "--worlds must be at most 100000"),
        (["--quick", "--worlds", "4"], "give it or --worlds"),
        (["--jobs", "0"], "--jobs must be at least 1"),
        (["--seed", "-1"], "--seed must be at least 0"),
        (["--timeout", "0"], "--timeout must be positive"),
        (["--only", "cmu"], "give --real too"),
        (["--pushes", "5"], "give --real too"),
        (["--real", "/nowhere"], "there is no such folder"),
        (["--real", "/", "--quick"], "--quick is for sealed worlds"),
        (["--real", "/", "--worlds", "3"], "--worlds is for sealed worlds"),
        (["--real", "/", "--kind", "none"], "--kind is for sealed worlds"),
        (["--real", "/", "--only", "nothing"], "no real case is named 'nothing'"),
        (["--real", "/", "--pushes", "2"], "--pushes must be at least 3"),
    ],
)
def test_bad_arguments_are_one_line(words, rule, tmp_path, capsys):
    assert main(["prove", "--out", str(tmp_path / "out"), *words]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and rule in said


def test_missing_mujoco_is_one_line_that_says_what_to_install(tmp_path, monkeypatch, capsys):
    (tmp_path / "mujoco.py").write_text("raise ImportError('not here')\n")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{Path(run_prove.__file__).parents[1]}")
    assert main(["prove", "--worlds", "1", "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "pip install '.[proof]'" in said


def task(tmp_path, name, code):
    return Task(name=name, words=(sys.executable, "-c", code), folder=tmp_path / name)


def test_a_diagnosis_that_takes_too_long_is_stopped_with_all_that_it_started(tmp_path):
    code = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import time; time.sleep(60)'])"
    slow = task(tmp_path, "slow", code)
    begin = time.monotonic()
    diagnose_all([slow], jobs=1, timeout=0.6, ended=lambda t, a: None)
    assert time.monotonic() - begin < 10.0
    found = attempt_of(slow.folder)
    assert found is not None and found.error == "stopped after 0.6 s (--timeout)."


def test_a_crash_and_a_silence_have_a_line_too(tmp_path):
    codes = {
        "crash": "import os; print('  3 s  plain fit', flush=True); os.abort()",
        "silence": "pass",
        "words": "print('error: no table.'); raise SystemExit(1)",
    }
    tasks = [task(tmp_path, name, code) for name, code in codes.items()]
    diagnose_all(tasks, jobs=3, timeout=30.0, ended=lambda t, a: None)
    said = {t.name: attempt_of(t.folder).error for t in tasks}
    assert said["crash"] == "signal 6, after '3 s  plain fit'."
    assert said["silence"] == "exit status 0, without a word."
    assert said["words"] == "error: no table."


def test_the_command_is_given_the_recording_and_no_truth(tmp_path):
    words = diagnose_command(tmp_path / "recordings" / "ab", tmp_path / "diagnoses" / "ab", tmp_path / "sealed")
    at = words.index("diagnose")
    assert words[1:at] == ("-m", "physid_drake.validation.sealing.blindfold", json.dumps([str(tmp_path / "sealed")]))
    assert not any("sealed" in word for word in words[at:])
    assert words[words.index("--jobs") + 1] == "1"


def test_the_child_is_asked_what_hides_the_truth_and_the_proof_counts_it(worlds, monkeypatch):
    said = "print('the truth is hidden by: mount namespace', flush=True)\n"
    monkeypatch.setattr(sys.modules[__name__], "FAKE", said + FAKE)
    prove(worlds)
    attempts = [json.loads(file.read_text()) for file in worlds.glob("diagnoses/*/attempt.json")]
    assert [attempt["hidden_by"] for attempt in attempts] == ["mount namespace"] * 3
    assert {attempt["error"] for attempt in attempts} == {None, "error: the cell fell apart."}
    assert json.loads((worlds / "proof.json").read_text())["hidden_by"] == {"mount namespace": 3}
    assert "The truth was hidden from the diagnoses by: mount namespace, 3 of 3." in (worlds / "proof.md").read_text()


def test_nothing_outside_of_the_sealed_folder_tells_seed_or_kind_before_it_is_opened(worlds, monkeypatch):
    def stop(*arguments):
        raise KeyboardInterrupt

    words = ("--seed", "271828182", "--kind", "effect")
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(run_prove, "_tell", stop)
        prove(worlds, *words)
    told = {file for file in worlds.rglob("*") if file.is_file() and b"271828182" in file.read_bytes()}
    assert told == {worlds / "sealed" / "secret.json"}
    assert json.loads((worlds / "settings.json").read_text()) == {"command": "prove"}
    names = read_secret(worlds).names(3)
    assert prove(worlds, "--kind", "effect") == 0  # the seed that was kept
    content = json.loads((worlds / "proof.json").read_text())
    assert (content["seed"], content["kind"]) == (271828182, "effect")
    assert sorted(one["id"] for one in content["outcomes"]) == sorted(names)
    for other in (("--seed", "5", "--kind", "effect"), ("--seed", "271828182")):
        with pytest.raises(run_prove.ConfigError, match="holds another proof"):
            prove(worlds, *other)


def test_what_was_scored_is_dropped_before_more_is_diagnosed(worlds, monkeypatch):
    """It says from which seed all worlds are, also those that are sealed."""
    there = []

    def look(*arguments):
        there.append([name for name in run_prove.WRITTEN if (worlds / name).exists()])

    prove(worlds, "--worlds", "2")
    monkeypatch.setattr(run_prove, "run_tasks", look)
    prove(worlds, "--worlds", "2")
    prove(worlds)
    assert there == [list(run_prove.WRITTEN), []]


def test_without_a_seed_one_is_drawn_and_the_command_goes_on_with_it(worlds):
    prove(worlds)
    seed = read_secret(worlds).seed
    prove(worlds)
    assert read_secret(worlds).seed == seed == json.loads((worlds / "proof.json").read_text())["seed"]
    prove(worlds.parent / "other")
    assert read_secret(worlds.parent / "other").seed != seed


@pytest.mark.parametrize(
    ("content", "rule"),
    [
        ("", "it is no JSON"),
        ("{", "it is no JSON"),
        ("null", "it must be a JSON object, but is None"),
        ("[]", "it must be a JSON object, but is []"),
        ('"x"', "it must be a JSON object, but is 'x'"),
        ('{"seconds": "x"}', "'seconds' must be a number, but is 'x'"),
        ('{"seconds": true}', "'seconds' must be a number"),
        ('{"seconds": 1, "error": 5}', "'error' must be a text or null, but is 5"),
        ('{"seconds": 1, "hidden_by": []}', "'hidden_by' must be a text or null"),
        (b"\xff", "is not UTF-8 text"),
    ],
)
@pytest.mark.parametrize("words", [(), ("--open",)])
def test_an_attempt_that_somebody_changed_is_one_line(worlds, capsys, words, content, rule):
    prove(worlds, "--worlds", "1")
    file = worlds / "diagnoses" / world(worlds, 0) / "attempt.json"
    file.write_bytes(content.encode() if isinstance(content, str) else content)
    with pytest.raises(ProofError) as caught:
        prove(worlds, "--worlds", "1", *words)
    said = str(caught.value)
    assert str(file) in said and rule in said and "\n" not in said
    assert said.endswith("; delete it to diagnose this world again.")


@pytest.mark.parametrize("answer", ["", "[]", "{}", '{"verdict": 3}', "{"])
def test_a_diagnosis_that_writes_no_answer_has_failed(tmp_path, answer):
    one = task(tmp_path, "a", f"open({str(tmp_path / 'a' / 'diagnosis.json')!r}, 'w').write({answer!r})")
    diagnose_all([one], jobs=1, timeout=30.0, ended=lambda t, a: None)
    assert "diagnosis.json' cannot be read: " in attempt_of(one.folder).error


@pytest.mark.parametrize(
    "change",
    [
        {"verdict": 3}, {"effects": None}, {"effects": [1]}, {"effects": [{}]}, {"fit": 5}, {"theta": [1]},
        {"reduced_chi2_after": "x"}, {"effects": [{"name": 1, "indistinguishable_from": [], "probability": 0.9,
                                                   "parameters": {}}]},
        {"effects": [{"name": "tether", "indistinguishable_from": [], "probability": "x", "parameters": {}}]},
        {"effects": [{"name": "viscous_drag", "indistinguishable_from": 3, "probability": 1, "parameters": {}}]},
    ],
)  # fmt: skip
def test_an_answer_that_somebody_changed_is_one_line(worlds, change):
    prove(worlds)
    file = worlds / "diagnoses" / world(worlds, 1) / "diagnosis.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | change))
    with pytest.raises(ProofError) as caught:
        prove(worlds, "--open")
    assert str(caught.value).startswith(f"'{file}' cannot be read: ") and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "rule"),
    [
        ({"kind": None}, "'kind' must be one of none, effect, pair, other"),
        ({"kind": "odd"}, "'kind' must be one of"),
        ({"effects": 3}, "'effects' must be a list of names"),
        ({"effects": [{"parameters": {}}]}, "'effects' must be a list of names"),
        ({"size_sigma": "x"}, "'size_sigma' must be a number"),
        ({"id": 3}, "'id' must be a text"),
        ({"theta": {"mass": "x"}}, "'theta' must be numbers"),
        ({"held_out_floor": []}, "'held_out_floor' must be numbers"),
    ],
)
def test_a_truth_that_is_none_is_one_line(worlds, monkeypatch, change, rule):
    make = run_prove._make

    def other(arguments, count, out, console):
        make(arguments, count, out, console)
        file = out / "sealed" / f"{world(out, 1)}.json"
        file.write_text(json.dumps(json.loads(file.read_text()) | change))
        (out / "seal.txt").unlink()
        return write_seal(out, read_secret(out).names(count))

    monkeypatch.setattr(run_prove, "_make", other)
    with pytest.raises(ProofError) as caught:
        prove(worlds)
    file = worlds / "sealed" / f"{world(worlds, 1)}.json"
    assert str(caught.value).startswith(f"'{file}' cannot be read: {rule}")
