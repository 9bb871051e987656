from dataclasses import replace

import numpy as np
import pytest

from physid_drake.errors import OutputError
from physid_drake.recording import (
    Box,
    Cylinder,
    ForceStream,
    Hand,
    MeshShape,
    ObjectModel,
    PoseStream,
    Prism,
    Push,
    Recording,
    Sensors,
    Table,
    read_recording,
    write_recording,
)


def random_stream(rng, count):
    walk = np.cumsum(rng.normal(scale=0.1, size=(count, 4)), axis=0)
    quaternions = walk + np.array([1.0, 0, 0, 0])
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    times = 1.4e9 + np.cumsum(rng.uniform(0.01, 0.02, count))
    return PoseStream(times=times, positions=rng.normal(size=(count, 3)), quaternions=quaternions)


def random_recording(seed=0):
    rng = np.random.default_rng(seed)
    pushes = tuple(
        Push(
            name=f"pushes/{k:03d}.csv",
            object=random_stream(rng, 20),
            hand=random_stream(rng, 17),
            force=ForceStream(times=np.sort(rng.uniform(size=30)), forces=rng.normal(size=(30, 3))),
            note=": 'quoted', ä\nsecond line" if k == 1 else "",
        )
        for k in (3, 1, 2)
    )
    return Recording(
        name="round_trip",
        description="text: with # signs",
        object=ObjectModel(shape=Box(size=(0.1, 1 / 3, 0.07)), mass=0.1, mass_std=0.003),
        table=Table(size=(1.0, 2.0), centre=(0.1, -0.2)),
        hand=Hand(tip="capsule", radius=0.01, length=0.05, stream="commanded"),
        sensors=Sensors(object_position_std=1e-17, force_std=0.1),
        pushes=pushes,
    )


def test_what_is_written_is_read_back_exactly(tmp_path):
    recording = random_recording()
    write_recording(recording, tmp_path / "new/recording")
    assert read_recording(tmp_path / "new/recording") == recording


@pytest.mark.parametrize(
    "shape",
    [
        Cylinder(radius=0.1, length=0.2, axis="y"),
        Prism(polygon=((-0.05, -0.05), (0.1, -0.05), (-0.05, 0.1)), height=0.02),
    ],
)
def test_every_shape_is_read_back(tmp_path, shape):
    recording = replace(random_recording(), object=ObjectModel(shape=shape))
    write_recording(recording, tmp_path / "r")
    assert read_recording(tmp_path / "r") == recording


@pytest.mark.parametrize("name", ["66e70658", "1e-3", "0x1f", "12", "yes", "null", "2026-11-21"])
def test_a_name_that_looks_like_something_else_is_read_back(tmp_path, name):
    recording = replace(random_recording(), name=name)
    write_recording(recording, tmp_path / "r")
    assert read_recording(tmp_path / "r") == recording


def test_a_recording_without_hand_and_sensors_is_read_back(tmp_path):
    full = random_recording()
    pushes = tuple(replace(push, hand=None, force=None) for push in full.pushes)
    recording = replace(full, hand=None, sensors=Sensors(), pushes=pushes)
    write_recording(recording, tmp_path)
    assert read_recording(tmp_path) == recording


def test_a_mesh_travels_with_the_recording(tmp_path):
    (tmp_path / "a").mkdir()
    mesh = tmp_path / "a/bunny.obj"
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n")
    recording = replace(random_recording(), object=ObjectModel(shape=MeshShape(file=mesh, scale=0.5)))
    write_recording(recording, tmp_path / "b")
    shape = read_recording(tmp_path / "b").object.shape
    assert shape.file.is_relative_to(tmp_path / "b") and shape.file.read_text() == mesh.read_text()


def test_a_bare_push_name_becomes_a_file(tmp_path):
    full = random_recording()
    recording = replace(full, pushes=(replace(full.pushes[0], name="push_07"),))
    write_recording(recording, tmp_path / "r")
    assert read_recording(tmp_path / "r").pushes[0].name == "pushes/push_07.csv"


def test_a_folder_that_holds_something_is_not_touched(tmp_path):
    (tmp_path / "keep.txt").write_text("mine")
    with pytest.raises(OutputError, match="not an empty folder"):
        write_recording(random_recording(), tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["keep.txt"]


@pytest.mark.parametrize("name", ["../out.csv", "/out.csv"])
def test_a_push_cannot_be_written_outside_the_folder(tmp_path, name):
    full = random_recording()
    with pytest.raises(OutputError):
        write_recording(replace(full, pushes=(replace(full.pushes[0], name=name),)), tmp_path / "r")
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_left_behind_when_writing_fails(tmp_path):
    recording = replace(random_recording(), object=ObjectModel(shape=MeshShape(file=tmp_path / "gone.obj")))
    with pytest.raises(OutputError, match="cannot be written"):
        write_recording(recording, tmp_path / "r")
    assert list(tmp_path.iterdir()) == []


def test_a_file_in_the_way_is_an_output_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        write_recording(random_recording(), tmp_path / "file/r")
