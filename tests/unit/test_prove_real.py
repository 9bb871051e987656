"""The proof on published recordings, with files in their layouts and diagnoses that cost nothing."""

import csv
import json
import math
import shutil
import sys

import numpy as np
import pytest

from physid_drake.cli import build_parser
from physid_drake.errors import ProofError, RecordingError
from physid_drake.recording import read_recording
from physid_drake.recording.adapters import convert_cube
from physid_drake.recording.adapters.cube import RATE, SIDE
from physid_drake.validation import run_prove_real
from physid_drake.validation.scoring.real import chosen_cases, prepare, slides_of_squares
from physid_drake.validation.scoring.real_score import (
    _fresh,
    balanced_pressure,
    mean_arm,
    points_of_support,
    published_errors,
    weight_near,
)

MIT_COLUMNS = [
    *(f"{when}_{what}" for when in ("start", "end") for what in
      ("object_x_m", "object_y_m", "object_yaw_rad", "tip_x_m", "tip_y_m")),
    *(f"{model}_end_object_{what}" for model in ("quadratic", "poly4") for what in ("x_m", "y_m", "yaw_rad")),
]  # fmt: skip


@pytest.fixture
def published(tmp_path):
    """Thirty pushes of the MIT layout, in which one model is 3 mm and 4 mm off, the other 0.1 rad."""
    folder = tmp_path / "published"
    (folder / "mit_push_endpoints").mkdir(parents=True)
    with (folder / "mit_push_endpoints" / "abs_rect1_v20.csv").open("w", newline="") as stream:
        table = csv.DictWriter(stream, MIT_COLUMNS)
        table.writeheader()
        for k in range(30):
            row = dict.fromkeys(MIT_COLUMNS, 0.0)
            row |= {"start_tip_x_m": -0.06, "end_tip_x_m": -0.04, "end_object_x_m": 0.01 + 1e-3 * k}
            # An angle may be given a turn away.
            row |= {"quadratic_end_object_x_m": 0.013 + 1e-3 * k, "quadratic_end_object_y_m": 0.004,
                    "quadratic_end_object_yaw_rad": 2.0 * math.pi}  # fmt: skip
            row |= {"poly4_end_object_x_m": 0.01 + 1e-3 * k, "poly4_end_object_yaw_rad": -0.1}
            table.writerow(row)
    return folder


def toss(rng, *, speeds_up=False, face=2, number=0):
    """Falls for ten samples, then slides 80 mm straight ahead with its given face up, and rests."""
    steps = np.arange(60) / RATE
    way = 0.4 * steps - 0.5 * 1.0 * steps**2 if not speeds_up else 0.5 * 1.5 * steps**2
    rows = np.zeros((70, 13))
    rows[10:, 0] = way
    rows[:, 1] = 0.01 * number
    rows[:, 2] = SIDE / 2
    rows[:10, 9] = -0.5
    half = math.pi / 4
    # Turned about y by a right angle, the object's x axis points down.
    rows[:, 3:7] = [1.0, 0.0, 0.0, 0.0] if face == 2 else [math.cos(half), 0.0, math.sin(half), 0.0]
    rows[:, :2] += 1e-5 * rng.standard_normal((70, 2))
    return rows


def write_tosses(file, tosses):
    np.savez(file, traj=np.concatenate(tosses), length=[len(t) for t in tosses], id=np.arange(len(tosses)))


def test_slides_of_one_face_are_taken_and_copies_and_driven_ones_are_not(tmp_path):
    rng = np.random.default_rng(0)
    tosses = [toss(rng, number=k) for k in range(3)]
    tosses += [tosses[0], toss(rng, speeds_up=True), toss(rng, face=0), toss(rng, face=0)]
    write_tosses(tmp_path / "contactnets_all.npz", tosses)
    recording = convert_cube(tmp_path, tmp_path / "slides")
    assert [push.note for push in recording.pushes] == ["toss 0", "toss 1", "toss 2"]
    assert recording.hand is None
    assert "5 of 7 tosses end in a slide, 3 of them on this face" in recording.description
    stream = recording.pushes[0].object
    assert len(stream) == 60
    assert stream.planar[-1, 0] == pytest.approx(tosses[0][-1, 0])
    assert np.abs(stream.planar[:, 2]).max() < 1e-9
    assert np.allclose(stream.positions[:, 2], SIDE / 2)


def test_a_cube_on_another_face_gets_a_frame_with_z_up(tmp_path):
    rng = np.random.default_rng(0)
    write_tosses(tmp_path / "tosses.npz", [toss(rng, face=0, number=k) for k in range(2)])
    recording = convert_cube(tmp_path / "tosses.npz", tmp_path / "slides")
    # The new x axis is the object's y, which points along the table's y.
    assert recording.pushes[0].object.planar[:, 2] == pytest.approx(np.full(60, math.pi / 2))


def test_a_file_that_holds_no_tosses_is_refused(tmp_path):
    np.savez(tmp_path / "other.npz", traj=np.zeros((4, 6)), length=[4])
    with pytest.raises(RecordingError, match="rows of 13 numbers"):
        convert_cube(tmp_path / "other.npz", tmp_path / "slides")
    (tmp_path / "text.npz").write_text("no")
    with pytest.raises(RecordingError, match="is no table of tosses"):
        convert_cube(tmp_path / "text.npz", tmp_path / "slides")
    write_tosses(tmp_path / "still.npz", [np.tile([0.0, 0, 0.05, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0], (40, 1))])
    with pytest.raises(RecordingError, match="no toss ends in a slide"):
        convert_cube(tmp_path / "still.npz", tmp_path / "slides")


def test_the_reason_for_leaving_out_the_squares_has_its_figures(tmp_path):
    drops = np.zeros((3, 50, 6))
    drops[0, :, 0] = np.linspace(0.0, 0.05, 50)  # slides flat all the time
    drops[1, :25, 2] = 0.5
    np.savez(tmp_path / "dice.npz", traj=drops)
    assert slides_of_squares(tmp_path / "dice.npz").startswith("1 of 3 drops end in a slide of 30 mm or more")


def test_a_recording_gets_a_neutral_name_and_fresh_pushes_stay_apart(published, tmp_path):
    (case,) = chosen_cases(["mit_rect1_v20"])
    out = tmp_path / "out"
    assert prepare(case, published, out, pushes=16, seed=1) is None
    given, held = (read_recording(out / part / case.id) for part in ("recordings", "held_out"))
    assert (len(given.pushes), len(held.pushes)) == (16, 8)
    assert given.name == case.id and "rect1" not in given.name
    notes = [{push.note for push in part.pushes} for part in (given, held)]
    assert not notes[0] & notes[1]
    assert [path.name for path in (out / "held_out").iterdir()] == [case.id]
    before = {file: file.read_bytes() for file in out.rglob("*") if file.is_file()}
    assert prepare(case, published, out, pushes=16, seed=1) is None
    shutil.rmtree(out / "held_out" / case.id)  # as where it was interrupted between the two
    assert prepare(case, published, out, pushes=16, seed=1) is None
    assert before == {file: file.read_bytes() for file in out.rglob("*") if file.is_file()}


def test_what_is_not_there_is_left_out_with_a_reason(published, tmp_path):
    (case,) = chosen_cases(["cmu_patch"])
    assert "not in this folder" in prepare(case, published, tmp_path / "out")


def test_the_publishers_models_are_judged_on_the_same_pushes(published):
    file = published / "mit_push_endpoints" / "abs_rect1_v20.csv"
    errors = published_errors(file, ["abs_rect1_v20.csv, row 2", "abs_rect1_v20.csv, row 31"])
    assert errors["quadratic"] == (pytest.approx(0.005), pytest.approx(0.0, abs=1e-12))
    assert errors["poly4"] == (pytest.approx(0.0), pytest.approx(0.1))


def test_points_of_support_and_the_weight_near_them():
    assert points_of_support("patch") is None
    points = points_of_support("30_90_30_30_30_90")
    assert points == pytest.approx(np.array([[-0.02, -0.02], [0.04, -0.02], [-0.02, 0.04]]))
    near, even = weight_near(balanced_pressure(np.ones((1, 1))), points)
    assert near == pytest.approx(even) and even == pytest.approx(3 * math.pi * 15**2 / (150**2 / 2), rel=0.02)


def test_a_recovered_pressure_balances_the_weight():
    # Cells of 10 mm: three feet at (35, 95), (35, 35) and (95, 35) mm from the right angle, unequally stiff.
    weights = np.full((15, 15), 1e-9)
    weights[3, 9], weights[3, 3], weights[9, 3] = 5.0, 1.0, 2.0
    pressure = balanced_pressure(weights)
    middles = np.arange(0.5, 150.0) - 50.0
    np.testing.assert_allclose(pressure.sum(axis=1) @ middles, 0.0, atol=1e-6 * pressure.sum())
    np.testing.assert_allclose(pressure.sum(axis=0) @ middles, 0.0, atol=1e-6 * pressure.sum())
    # Three feet under a centre of mass at (50, 50) mm: the lever rule, however stiff they are.
    loads = [pressure[a : a + 10, b : b + 10].sum() / pressure.sum() for a, b in ((30, 90), (30, 30), (90, 30))]
    np.testing.assert_allclose(loads, [0.25, 0.5, 0.25], atol=0.02)
    found, of_points, even = mean_arm(pressure, points_of_support("35_95_35_35_35_95"))
    assert even == pytest.approx(0.0453, rel=0.005)  # by the raster of benchmarks/cmu_raw.py
    assert of_points == pytest.approx(0.25 * 2 * math.hypot(45, 15) / 1e3 + 0.5 * math.hypot(15, 15) / 1e3)
    assert found == pytest.approx(of_points, rel=0.02)  # feet of 10 mm
    assert math.isnan(mean_arm(pressure, None)[1])


ANSWER = {
    "verdict": "unexplained",
    "effects": [],
    "reduced_chi2_before": 9.0,
    "reduced_chi2_after": 9.0,
    "fit": {f"held_out_rms_{when}{unit}": 0.004 for when in ("before", "after") for unit in ("", "_m", "_rad")},
}
FAKE = """import pathlib, sys
assert sys.argv[4:] == ["--pushes", "20"]
(pathlib.Path(sys.argv[2]) / "diagnosis.json").write_text(sys.argv[3])"""


@pytest.mark.parametrize(
    ("forces", "held_out", "column"),
    [
        ({}, [None, None], " - "),
        ({"held_out_rms_before_n": 0.3, "held_out_rms_after_n": 0.1}, [0.3, 0.1], " 0.30 to 0.10 "),
    ],
)
def test_the_command_writes_a_table_and_goes_on(published, tmp_path, monkeypatch, forces, held_out, column):
    monkeypatch.setattr(
        run_prove_real, "fresh_errors", lambda diagnosis, held: np.array([[0.003, 0.1], [0.004, 0.2]])
    )
    hidden = []

    def fake(recording, folder, *sealed):
        hidden.extend(sealed)
        answer = ANSWER | {"fit": ANSWER["fit"] | forces}
        return (sys.executable, "-c", FAKE, str(recording), str(folder), json.dumps(answer))

    words = ["prove", "--real", str(published), "--only", "mit_rect1", "square", "--out", str(tmp_path / "out")]
    arguments = build_parser().parse_args(words)
    assert run_prove_real.run_real(arguments, command=fake) == 0
    content = json.loads((tmp_path / "out" / "real.json").read_text())
    cases = {case["name"]: case for case in content["cases"]}
    assert set(cases) == {"mit_rect1_v10", "mit_rect1_v20", "square_drops"}
    assert cases["mit_rect1_v10"]["skipped"].startswith("skipped: ")
    done = cases["mit_rect1_v20"]
    assert (done["verdict"], done["pushes"], done["held_out_m"]) == ("unexplained", 20, [0.004, 0.004])
    assert done["held_out_n"] == held_out
    assert done["fresh"] == pytest.approx([math.sqrt(12.5e-6), math.sqrt(0.025)], rel=1e-5)
    assert set(hidden) == {published, tmp_path / "out" / "held_out"}
    first = (tmp_path / "out" / "real.md").read_bytes()
    head, row = (next(line for line in first.decode().splitlines() if word in line) for word in ("case", "rect1_v20"))
    assert row.split("|")[head.split("|").index(" held-out N ")] == column
    assert run_prove_real.run_real(arguments, command=fake) == 0
    assert (tmp_path / "out" / "real.md").read_bytes() == first
    fewer = build_parser().parse_args([*words[:3], "--only", "square", "--out", str(tmp_path / "out")])
    assert run_prove_real.run_real(fewer, command=fake) == 0  # what was diagnosed before stays in the table
    assert {case["name"] for case in json.loads((tmp_path / "out" / "real.json").read_text())["cases"]} == {
        "mit_rect1_v20", "square_drops",
    }  # fmt: skip


@pytest.mark.parametrize("content", ["", "[]", '{"position_m": "x", "rotation_rad": 1}', '{"position_m": 1}'])
def test_errors_that_somebody_changed_are_one_line(tmp_path, content):
    (tmp_path / "fresh.json").write_text(content)
    with pytest.raises(ProofError, match=r"fresh\.json' cannot be read: .*; delete it, and it is written again\.$"):
        _fresh(tmp_path / "fresh.json")
    assert all(map(math.isnan, _fresh(tmp_path / "none")))
