import dataclasses as dc
import subprocess
import sys

import numpy as np
import pytest

from physid_drake import cli, run_inspect
from physid_drake.errors import RecordingError
from physid_drake.recording import (
    Box,
    Cylinder,
    Hand,
    ObjectModel,
    PoseStream,
    Prism,
    Push,
    Recording,
    Sensors,
    Table,
    planar_poses,
    write_recording,
)
from physid_drake.report.inspection import alike_as_one, draw_pushes

COLUMNS = (
    "start_object_x_m,start_object_y_m,start_object_yaw_rad,end_object_x_m,end_object_y_m,end_object_yaw_rad,"
    "start_tip_x_m,start_tip_y_m,end_tip_x_m,end_tip_y_m"
)


def some_recording(count=3):
    times = np.arange(40) * 0.05
    path = np.column_stack([0.1 * times, 0 * times, 0 * times + 0.02])
    quaternions = np.tile([1.0, 0, 0, 0], (40, 1))
    stream = PoseStream(times=times, positions=path, quaternions=quaternions)
    gap = np.delete(np.arange(40), slice(20, 30))
    lossy = PoseStream(times=times[gap], positions=path[gap], quaternions=quaternions[gap])
    pushes = tuple(Push(name=f"p{k}", object=lossy, hand=stream, force=None) for k in range(count))
    return Recording(
        name="some_$pushes",
        description="",
        object=ObjectModel(shape=Box(size=(0.1, 0.05, 0.04))),
        table=Table(size=(1.0, 1.0)),
        hand=Hand(tip="sphere", radius=0.01),
        sensors=Sensors(),
        pushes=pushes,
    )


def test_inspect_shows_every_push_and_warns_on_stderr(tmp_path, capsys):
    write_recording(some_recording(), tmp_path / "r")
    assert cli.main(["inspect", "--no-fit", str(tmp_path / "r"), "--out", str(tmp_path / "top.png")]) == 0
    shown = capsys.readouterr()
    assert "some_$pushes" in shown.out and "p2" in shown.out and "[mm/s]" in shown.out
    assert "warning: pushes/p0.csv: object: rows 21-32: gap" in shown.err
    assert "(2 similar warnings, in 3 pushes)" in shown.err and shown.err.count("gap") == 1
    assert (tmp_path / "top.png").read_bytes().startswith(b"\x89PNG")


def test_inspect_says_what_a_diagnosis_would_refuse(tmp_path, capsys):
    recording = some_recording()
    beside = dc.replace(recording, table=Table(size=(1.0, 1.0), centre=(5.0, 0.0)))
    heavy = dc.replace(beside, object=dc.replace(recording.object, mass=50.0))
    write_recording(heavy, tmp_path / "r")
    assert cli.main(["inspect", "--no-fit", str(tmp_path / "r")]) == 1
    shown = capsys.readouterr()
    assert "some_$pushes" in shown.out  # what is in it is shown all the same
    assert shown.err.splitlines()[-1].startswith("error: recording 'some_$pushes': with 50 kg")
    assert "ERROR: push 'pushes/p0.csv': the object starts at" in shown.err


def test_a_broken_recording_is_one_line_and_status_one(tmp_path, capsys):
    (tmp_path / "recording.yaml").write_text("format: [\n")
    assert cli.main(["inspect", "--no-fit", str(tmp_path)]) == 1
    shown = capsys.readouterr()
    assert shown.out == "" and shown.err.startswith("error: ") and shown.err.count("\n") == 1


@pytest.mark.parametrize("out", ["nowhere/top.png", "top.nonsense"])
def test_a_plot_that_cannot_be_written_is_an_error(tmp_path, capsys, out):
    write_recording(some_recording(), tmp_path / "r")
    assert cli.main(["inspect", "--no-fit", str(tmp_path / "r"), "--out", str(tmp_path / out)]) == 1
    assert str(tmp_path / out) in capsys.readouterr().err


@pytest.mark.parametrize("name", ["top", "top.pgf", "top.html", ".png"])
def test_what_is_no_picture_is_refused_before_anything_is_drawn(tmp_path, capsys, name):
    write_recording(some_recording(), tmp_path / "r")
    assert cli.main(["inspect", "--no-fit", str(tmp_path / "r"), "--out", str(tmp_path / name)]) == 1
    assert "must end in .png, .svg, .pdf" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["r"]


@pytest.mark.parametrize("name", ["top.png", "top.svg", "top.pdf"])
def test_a_picture_replaces_only_one_that_was_drawn_before(tmp_path, capsys, name):
    write_recording(some_recording(), tmp_path / "r")
    command = ["inspect", "--no-fit", str(tmp_path / "r"), "--out", str(tmp_path / name)]
    assert cli.main(command) == cli.main(command) == 0
    (tmp_path / name).write_bytes(b"my photograph")
    assert cli.main(command) == 1
    assert "was not drawn by this command" in capsys.readouterr().err
    assert (tmp_path / name).read_bytes() == b"my photograph"


def test_convert_writes_a_recording_that_inspect_reads(tmp_path, capsys):
    table = tmp_path / "abs_tri2_v10.csv"
    table.write_text(COLUMNS + "\n" + "0.3,0,3.1,0.33,0,-3.1,0.2,0,0.25,0\n" * 5)
    assert cli.main(["convert", "mit", str(table), str(tmp_path / "r"), "--seed", "-1"]) == 1
    assert cli.main(["convert", "mit", str(table), str(tmp_path / "r"), "--limit", "2"]) == 0
    assert "mit_tri2_abs: 2 pushes written" in capsys.readouterr().out
    assert cli.main(["inspect", "--no-fit", str(tmp_path / "r")]) == 0
    assert cli.main(["convert", "mit", str(table), str(tmp_path / "r")]) == 1
    assert "not an empty folder" in capsys.readouterr().err


def test_an_interrupt_is_status_130(monkeypatch, capsys):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(run_inspect, "read_recording", interrupt)
    assert cli.main(["inspect", "--no-fit", "anywhere"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


def test_a_message_of_several_lines_is_shown_as_one(monkeypatch, capsys):
    def refuse(_):
        raise RecordingError("first\nsecond")

    monkeypatch.setattr(run_inspect, "read_recording", refuse)
    assert cli.main(["inspect", "--no-fit", "anywhere"]) == 1
    assert capsys.readouterr().err == "error: first second\n"


@pytest.mark.parametrize("argv", [[], ["inspect"], ["convert", "other", "a", "b"]])
def test_wrong_usage_is_status_two(argv, capsys):
    with pytest.raises(SystemExit) as caught:
        cli.main(argv)
    assert caught.value.code == 2
    capsys.readouterr()


def test_the_command_line_and_recordings_do_without_drake(tmp_path):
    write_recording(some_recording(1), tmp_path / "r")
    code = (
        "import sys; from physid_drake.cli import build_parser; from physid_drake.recording import read_recording; "
        "read_recording(build_parser().parse_args(sys.argv[1:]).recording); sys.exit('pydrake' in sys.modules)"
    )
    run = subprocess.run(
        [sys.executable, "-c", code, "inspect", str(tmp_path / "r")], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr


def test_axes_are_equal_and_in_metres():
    axes = draw_pushes(some_recording(20)).axes[0]
    assert axes.get_aspect() == 1.0
    assert axes.get_xlabel() == "x [m]" and axes.get_ylabel() == "y [m]"


def test_what_is_refused_of_many_pushes_is_said_once():
    names = [f"pushes/{k:03d}.csv" for k in range(1, 22)]
    lines = [f"push '{name}': the hand is {k}.5 mm above" for k, name in enumerate(names)]
    assert alike_as_one([*lines, "another"], names) == [f"{lines[0]} (and 20 more pushes)", "another"]


def rounded(recording, step, turn):
    """The same with places and yaw on a grid [m, rad], and rests before and after."""

    def on_grid(push):
        times = np.arange(200) * 0.01
        x = 0.2 * np.clip(times - 0.5, 0.0, 1.0)
        planar = np.column_stack([x, 0.3 * x, 2.0 * x])
        planar = np.round(planar / [step, step, turn]) * [step, step, turn]
        hand = dc.replace(push.hand, times=np.linspace(0.0, 2.0, len(push.hand)))
        return dc.replace(push, object=planar_poses(times, planar, 0.02), hand=hand)

    return dc.replace(recording, pushes=tuple(map(on_grid, recording.pushes)))


def test_a_stream_on_a_grid_has_the_grids_noise(tmp_path, capsys):
    write_recording(rounded(some_recording(1), 0.01, np.radians(1.0)), tmp_path / "r")
    cli.main(["inspect", "--no-fit", str(tmp_path / "r")])
    shown = capsys.readouterr().out
    assert "2.887" in shown and "0.289" in shown and "0.000" not in shown
    assert "rounded: places to 10 mm, yaw to 1 deg" in " ".join(shown.split())


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (Box(size=(0.1, 0.05, 0.03)), "a box, 100.0 by 50.0 mm, 30.0 mm high"),
        (Cylinder(radius=0.02, length=0.1, axis="y"), "a lying cylinder, 40.0 by 100.0 mm, 40.0 mm high"),
        (
            Prism(polygon=((-0.02, -0.02), (0.04, -0.02), (-0.02, 0.04)), height=0.03),
            "a prism of 3 corners, 60.0 by 60.0 mm, 30.0 mm high",
        ),
    ],
)
def test_inspect_says_what_the_object_is_taken_for(shape, said, tmp_path, capsys):
    recording = some_recording(1)
    write_recording(dc.replace(recording, object=dc.replace(recording.object, shape=shape)), tmp_path / "r")
    cli.main(["inspect", "--no-fit", str(tmp_path / "r")])
    assert f"object: {said}" in capsys.readouterr().out
