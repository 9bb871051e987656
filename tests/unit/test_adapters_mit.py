import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording import Prism, outline_distance
from physid_drake.recording.adapters import convert_mit
from physid_drake.recording.adapters.mit_shapes import OBJECTS, TIP_RADIUS

SHARED = Path(os.environ.get("PHYSID_SHARED_DATA", Path(__file__).parents[2] / "../shared/data"))
TABLES = SHARED / "mit_push_endpoints"
OFFSET = np.array([0.5, -0.3])


def raw_name(shape="rect1", surface="abs", side=0.5):
    return f"motion_surface={surface}_shape={shape}_a=0_v=20_i=1.000_s={side:.3f}_t=0.000"


def raw_push():
    """A rod pushes rect1 along +x at 20 mm/s from 20 mm away; three streams on clocks of their own."""
    rng = np.random.default_rng(0)
    clocks = [1.5e9 + np.cumsum(rng.uniform(0.003, 0.005, n)) for n in (900, 880, 870)]
    start = clocks[0][0]
    contact = 0.3 - 0.045 - TIP_RADIUS
    tip_x = [contact - 0.02 + 0.02 * (clock - start) for clock in clocks]
    moved = [np.maximum(0.0, x - contact) for x in tip_x]
    zero = [np.zeros(len(clock)) for clock in clocks]
    tip = np.column_stack([clocks[0], tip_x[0], zero[0], zero[0]])
    yaw = np.angle(np.exp(1j * (np.pi - 0.01 + 20.0 * moved[1] * 0.05)))
    pose = np.column_stack([clocks[1], 0.3 + moved[1], zero[1], yaw])
    pressed = 2.0 * (moved[2] > 0.0)
    wrench = np.column_stack([clocks[2], -pressed + OFFSET[0], zero[2] + OFFSET[1], zero[2]])
    return {"tip_pose": tip, "object_pose": pose, "ft_wrench": wrench}


def write_json(folder, streams, name=None):
    path = folder / f"{name or raw_name()}.json"
    path.write_text(json.dumps({key: np.asarray(rows).tolist() for key, rows in streams.items()}))
    return path


def write_hdf5(folder, streams, name=None):
    h5py = pytest.importorskip("h5py")
    path = folder / f"{name or raw_name()}.h5"
    with h5py.File(path, "w") as file:
        for key, rows in streams.items():
            file[key] = rows
    return path


@pytest.mark.parametrize("write", [write_json, write_hdf5])
@pytest.mark.filterwarnings("ignore:.*offset:UserWarning")
def test_a_raw_push_is_read_with_its_three_clocks(tmp_path, write):
    streams = raw_push()
    recording = convert_mit(write(tmp_path, streams), tmp_path / "r")
    push = recording.pushes[0]
    assert recording.name == "mit_rect1_abs"
    assert [len(push.hand), len(push.object), len(push.force)] == [900, 880, 870]
    assert push.start_time == 0.0
    assert np.allclose(push.object.positions[:, 2], 0.0065)
    assert recording.object.mass == 0.8374 and recording.hand.radius == 0.00475


@pytest.mark.filterwarnings("ignore:.*offset:UserWarning")
def test_force_is_that_on_the_object_without_the_sensors_offset(tmp_path):
    push = convert_mit(write_json(tmp_path, raw_push()), tmp_path / "r").pushes[0]
    assert np.allclose(push.force.forces[-1], [2.0, 0.0, 0.0])
    assert np.allclose(push.force.forces[0], 0.0)
    assert "constant offset of (-0.500, 0.300) N" in push.note


@pytest.mark.filterwarnings("ignore:.*offset:UserWarning")
def test_a_wrapped_angle_gives_a_smooth_turn(tmp_path):
    streams = raw_push()
    assert np.abs(np.diff(streams["object_pose"][:, 3])).max() > 6.0
    push = convert_mit(write_json(tmp_path, streams), tmp_path / "r").pushes[0]
    assert np.abs(np.diff(push.object.planar[:, 2])).max() < 0.01
    assert np.abs(np.diff(push.object.quaternions, axis=0)).max() < 0.01


def test_repeated_times_and_gaps_are_named(tmp_path):
    streams = raw_push()
    streams["object_pose"] = np.delete(streams["object_pose"], slice(400, 450), axis=0)
    streams["tip_pose"][11, 0] = streams["tip_pose"][10, 0]
    streams["ft_wrench"][5, 1] = np.nan
    with pytest.warns(UserWarning) as caught:
        push = convert_mit(write_json(tmp_path, streams), tmp_path / "r").pushes[0]
    text = "\n".join(str(warning.message) for warning in caught)
    assert "tip_pose: row 11: time stamp not after the one before, left out" in text
    assert "object_pose: rows 399-400: gap of 0." in text
    assert "ft_wrench: row 5: not finite, left out" in text
    assert [len(push.hand), len(push.force)] == [899, 869]
    assert any("gap" in warning for warning in push.warnings)


def test_a_push_that_starts_in_contact_says_that_the_offset_stays(tmp_path):
    streams = raw_push()
    streams["ft_wrench"] = streams["ft_wrench"][400:]
    with pytest.warns(UserWarning, match="too few to read the sensor's offset"):
        convert_mit(write_json(tmp_path, streams), tmp_path / "r")


@pytest.mark.filterwarnings("ignore:.*offset:UserWarning")
def test_a_folder_of_pushes_is_drawn_from_by_seed(tmp_path):
    for side in range(6):
        write_json(tmp_path, raw_push(), raw_name(side=0.1 * side))
    first, again = (convert_mit(tmp_path, tmp_path / f"r{k}", limit=2, seed=3) for k in range(2))
    assert first == again and len(first.pushes) == 2
    assert first.pushes[0].note < first.pushes[1].note


def break_shape(streams):
    streams["tip_pose"] = streams["tip_pose"][:, :3]
    return streams


def break_key(streams):
    del streams["ft_wrench"]
    return streams


def break_length(streams):
    streams["object_pose"] = streams["object_pose"][:1]
    return streams


def break_size(streams):
    streams["ft_wrench"][3, 1] = 1e300
    return streams


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (break_shape, r"tip_pose: must have shape \(n, 4\)"),
        (break_key, "missing"),
        (break_length, "at least two"),
        (break_size, "ft_wrench: every number must be at most"),
    ],
)
@pytest.mark.parametrize("write", [write_json, write_hdf5])
def test_a_file_without_the_three_streams_is_refused(tmp_path, change, message, write):
    with pytest.raises(RecordingError, match=message):
        convert_mit(write(tmp_path, change(raw_push())), tmp_path / "r")


def test_files_that_are_not_what_their_name_says_are_refused(tmp_path):
    for suffix in (".json", ".h5"):
        path = tmp_path / (raw_name() + suffix)
        path.write_text("{")
        with pytest.raises(RecordingError, match="not a readable"):
            convert_mit(path, tmp_path / "r")


def test_a_missing_h5py_is_named_with_its_cure(tmp_path, monkeypatch):
    path = tmp_path / f"{raw_name()}.h5"
    path.write_bytes(b"")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(RecordingError, match=r"pip install physid_drake\[mit\]"):
        convert_mit(path, tmp_path / "r")


@pytest.mark.parametrize(
    ("name", "message"),
    [(raw_name("butter"), "not convex"), (raw_name("cube"), "unknown shape"), ("push_1", "is named motion_")],
)
def test_an_object_that_is_no_known_convex_one_is_refused(tmp_path, name, message):
    with pytest.raises(RecordingError, match=message):
        convert_mit(write_json(tmp_path, raw_push(), name), tmp_path / "r")


def test_a_mix_of_objects_is_refused(tmp_path):
    write_json(tmp_path, raw_push())
    write_json(tmp_path, raw_push(), raw_name("rect2"))
    with pytest.raises(RecordingError, match="one object on one surface"):
        convert_mit(tmp_path, tmp_path / "r")


COLUMNS = (
    "start_object_x_m,start_object_y_m,start_object_yaw_rad,end_object_x_m,end_object_y_m,end_object_yaw_rad,"
    "start_tip_x_m,start_tip_y_m,end_tip_x_m,end_tip_y_m,quadratic_end_object_x_m"
)


def test_end_points_become_a_straight_path_at_the_speed_in_the_name(tmp_path):
    table = tmp_path / "abs_rect1_v10.csv"
    table.write_text(f"{COLUMNS}\n0.3,0,3.1,0.33,0,-3.1,0.2,0,0.25,0,9\n")
    recording = convert_mit(table, tmp_path / "r")
    push = recording.pushes[0]
    assert recording.hand.stream == "commanded" and push.force is None and push.endpoint_only
    assert push.duration == pytest.approx(5.0)
    speeds = np.linalg.norm(np.diff(push.hand.positions, axis=0), axis=1) / np.diff(push.hand.times)
    assert np.allclose(speeds, 0.01) and len(push.hand) == 251
    assert push.object.planar[1, 2] - push.object.planar[0, 2] == pytest.approx(2 * np.pi - 6.2)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        (
            "abs_rect1_v10.csv",
            f"{COLUMNS}\n0.3,0,3.1,1e300,0,0,0.2,0,0.25,0,9\n",
            "from -1000 to 1000, but got '1e300'",
        ),
        (
            "abs_rect1_v1.csv",
            f"{COLUMNS}\n0.3,0,3.1,0,0,0,0.2,0,20,0,9\n",
            "row 2: the tip .* within 600 s, .* 1.98e.04 s",
        ),
        ("abs_rect1_v10.csv", f"{COLUMNS}\n0.3,0,3.1,x,0,0,0.2,0,0.25,0,9\n", "row 2: column end_object_x_m"),
        ("abs_rect1_v10.csv", f"{COLUMNS}\n0.3,0\n", "row 2: column start_object_yaw_rad"),
        ("abs_rect1_v10.csv", f"{COLUMNS}\n", "no pushes"),
        ("abs_rect1_v10.csv", "a,b\n1,2\n", "column start_object_x_m: is missing"),
        ("abs_rect1_v0.csv", f"{COLUMNS}\n", "must be positive"),
        ("pushes.csv", f"{COLUMNS}\n", "is named <surface>"),
        ("abs_butter_v10.csv", f"{COLUMNS}\n", "not convex"),
    ],
)
def test_a_table_of_end_points_that_breaks_a_rule_is_refused(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(RecordingError, match=message):
        convert_mit(tmp_path / name, tmp_path / "r")


def test_every_prism_is_about_its_centroid():
    assert len(OBJECTS) == 10
    assert sum(isinstance(item.shape, Prism) for item in OBJECTS.values()) == 7


@pytest.mark.skipif(not TABLES.is_dir(), reason=f"the published MIT end points are not at {TABLES}")
@pytest.mark.parametrize("shape", ["rect3", "tri1", "tri2", "tri3", "hex", "ellip3"])
def test_the_published_pusher_ends_one_radius_from_the_outline(tmp_path, shape):
    recording = convert_mit(TABLES / f"abs_{shape}_v10.csv", tmp_path / "r", limit=120)
    outline = OBJECTS[shape].outline
    gaps = []
    for push in recording.pushes:
        x, y, yaw = push.object.planar[-1]
        c, s = np.cos(yaw), np.sin(yaw)
        local = (push.hand.positions[-1, :2] - [x, y]) @ np.array([[c, -s], [s, c]])
        gaps.append(outline_distance(outline, [local])[0])
    # Some pushes slide past the object; half of them end in contact.
    assert np.quantile(gaps, 0.35) == pytest.approx(TIP_RADIUS, abs=0.7e-3)


def hostile(path, make):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for key, rows in raw_push().items():
            if key != "tip_pose":
                file[key] = rows
        make(h5py, file)
    return path


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda h5py, file: file.create_dataset("tip_pose", shape=(10**9, 4), chunks=(1000, 4)),
            "at most 1000000 rows",
        ),
        (lambda h5py, file: file.create_dataset("tip_pose", shape=(10, 10**8), chunks=(1, 1000)), r"shape \(n, 4\)"),
        (lambda h5py, file: file.create_dataset("tip_pose", data=h5py.Empty("f8")), r"shape \(n, 4\)"),
        (lambda h5py, file: file.create_dataset("tip_pose", data=[[b"x"] * 4] * 4), "a table of numbers"),
        (lambda h5py, file: file.create_group("tip_pose"), "a table of numbers"),
        (
            lambda h5py, file: file.create_dataset(
                "tip_pose", shape=(10, 4), dtype="f8", external=[("/etc/passwd", 0, 320)]
            ),
            "in another file",
        ),
        (lambda h5py, file: file.__setitem__("tip_pose", h5py.ExternalLink("/etc/passwd", "/a")), "is a link"),
        (lambda h5py, file: file.__setitem__("tip_pose", h5py.SoftLink("/ft_wrench")), "is a link"),
    ],
    ids=range(8),
)
@pytest.mark.filterwarnings("ignore:.*left out:UserWarning")
def test_a_stream_is_as_large_as_it_says_and_in_its_own_file(tmp_path, make, said):
    with pytest.raises(RecordingError, match=said):
        convert_mit(hostile(tmp_path / f"{raw_name()}.h5", make), tmp_path / "r")


@pytest.mark.parametrize("suffix", [".h5", ".json"])
@pytest.mark.filterwarnings("ignore:.*left out:UserWarning")
def test_a_pipe_is_no_push(tmp_path, suffix):
    path = tmp_path / f"{raw_name()}{suffix}"
    os.mkfifo(path)
    with pytest.raises(RecordingError, match="it is a named pipe"):
        convert_mit(path, tmp_path / "r")


@pytest.mark.parametrize(
    "text",
    ["[" * 100_000, "[]", "3", '{"tip_pose": 3}', '{"tip_pose": [[1e999]]}', "1" * 70_000, '{"tip_pose": {"a": 1}}'],
)
@pytest.mark.filterwarnings("ignore:.*left out:UserWarning")
def test_what_is_no_push_in_json_is_one_line(tmp_path, text):
    path = tmp_path / f"{raw_name()}.json"
    path.write_text(text)
    with pytest.raises(RecordingError) as caught:
        convert_mit(path, tmp_path / "r")
    assert str(caught.value).isprintable() and len(str(caught.value)) < 400 + len(str(tmp_path))
