import os
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from written import HEADER, ROWS, YAML, write

from physid_drake.errors import RecordingError
from physid_drake.recording import MeshShape, digest_of, read_recording, write_recording


@pytest.fixture
def written(tmp_path):
    return partial(write, tmp_path)


def refusal(folder):
    with pytest.raises(RecordingError) as caught:
        read_recording(folder)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_streams_with_different_clocks_share_one_table(written):
    recording = read_recording(written())
    push = recording.pushes[0]
    assert push.name == "pushes/001.csv" and push.note == "first" and push.warnings == ()
    assert push.hand.times.tolist() == [0.0, 0.1]
    assert push.object.times.tolist() == [0.0, 0.2]
    assert push.force is None and recording.hand.radius == 0.01
    assert recording.object.mass_std == pytest.approx(0.0005)


@pytest.mark.parametrize("file", ["./pushes/001.csv", "pushes//001.csv", "pushes/../pushes/001.csv"])
def test_a_push_has_the_name_that_it_has_when_it_is_written(written, tmp_path, file):
    recording = read_recording(written(YAML.replace("pushes/001.csv", file)))
    assert recording.pushes[0].name == "pushes/001.csv"
    write_recording(recording, tmp_path / "again")
    assert digest_of(read_recording(tmp_path / "again")) == digest_of(recording)


def test_streams_whose_clocks_differ_by_round_off_share_one_table(written):
    rows = [*ROWS[:2], "0.10000000000000002,,,,0.11,0,0.015,1,0,0,0", ROWS[2]]
    assert len(read_recording(written(rows=rows)).pushes[0].object) == 3


def test_a_spreadsheets_byte_order_mark_and_line_ends_are_read(written):
    folder = written()
    text = "\r\n".join([HEADER, *ROWS, "", ""])
    (folder / "pushes/001.csv").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert len(read_recording(folder).pushes[0].object) == 2


@pytest.mark.parametrize("name", ["12345678", "344e4963", "0x1f", "on", "2026-11-22", "1_000"])
def test_a_name_is_what_was_written_whatever_else_it_looks_like(written, name):
    assert read_recording(written(YAML.replace("name: eraser", f"name: {name}"))).name == name


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("physid-recording/1", "physid-recording/2", "line 1: format: unknown format"),
        ("format: physid-recording/1\n", "", "unknown format None"),
        ("name: eraser", "name: [12]", "line 2: name: must be text"),
        ("name: eraser\n", "", "name: is required"),
        ("name: eraser", "colour: red\nname: eraser", "line 2: colour: unknown key"),
        ("name: eraser", "name: a\nname: b", "line 3: name: the key stands twice"),
        ("shape: box", "shape: ball", "line 5: object.shape: must be one of"),
        ("shape: box", "shape: [box]", "line 5: object.shape: must be one of"),
        ("[0.1, 0.05, 0.03]", "[0.1, 0.05]", "line 6: object.size_m: must be a list of 3"),
        ("[0.1, 0.05, 0.03]", "[0.1, -0.05, 0.03]", "size_m must be positive"),
        ("[0.1, 0.05, 0.03]", "[0.1, .nan, 0.03]", "object.size_m"),
        ("  size_m: [0.1, 0.05, 0.03]\n", "", "object.size_m: is required"),
        ("mass_kg: 0.05", "mass_kg: heavy", "line 7: object.mass_kg: must be a finite number"),
        ("mass_kg: 0.05", "mass_kg: yes", "object.mass_kg"),
        ("mass_kg: 0.05", "mass_kg: -1", "mass_kg must be positive"),
        ("mass_kg: 0.05", "mass_std_kg: 0.1", "without mass_kg"),
        ("mass_kg: 0.05", "radius_m: 1", "object.radius_m: unknown key"),
        ("tip: sphere", "tip: fist", "hand.tip: must be one of"),
        ("tip: sphere", "tip: capsule", "needs length_m"),
        ("  radius_m: 1e-2\n", "", "hand.radius_m: is required"),
        ("stream: measured", "stream: guessed", "hand.stream"),
        ("force_std_n: 0.02", "force_std_n: -0.02", "force_std_n must not be negative"),
        ("force_std_n: 0.02", "force_std: 0.02", "sensors.force_std: unknown key"),
        ("file: pushes/001.csv", "file: ../001.csv", "must lie inside"),
        ("file: pushes/001.csv", "file: /etc/passwd", "must lie inside"),
        ("file: pushes/001.csv", "file: pushes/002.csv", "line 18: pushes[0].file: missing file"),
        ("    note: first", "  - file: pushes/001.csv", "listed twice"),
        ("    note: first", "    remark: first", "pushes[0].remark: unknown key"),
        ("  - file: pushes/001.csv\n    note: first", "  []", "must not be empty"),
        ("  - file: pushes/001.csv\n    note: first", "  - pushes/001.csv", "pushes[0]: must be a mapping"),
        ("name: eraser", "name: [unclosed", "not valid YAML"),
        ("mass_kg: 0.05", "mass_kg: 2024-13-45", "not valid YAML"),
        ("name: eraser", "name: !!python/object:os.system x", "not valid YAML"),
        (YAML, "just text", "must be a mapping"),
        (YAML, "", "must be a mapping"),
        ("table:\n  size_m: [1.2, 0.8]", "table:\n  size_m: 1.2", "table.size_m"),
        ("  size_m: [0.1, 0.05, 0.03]", "  ? [1, 2]\n  : 3", "recording.yaml"),
    ],
)
def test_a_description_that_breaks_a_rule_is_refused_by_line_and_key(written, old, new, expected):
    assert old in YAML
    message = refusal(written(yaml=YAML.replace(old, new)))
    assert expected in message
    assert "recording.yaml: line" in message


BAD_TABLES = {
    "time repeats": ([*ROWS[:2], "0.1,,,,0.12,0,0.015,1,0,0,0"], "row 4: column time_s: times must increase"),
    "times are round-off apart": (
        [*ROWS, "0.2000000000001,,,,0.12,0,0.015,1,0,0,0"],
        "column time_s: the object's samples at 0.2 s and 0.2000000000001 s are less than a nanosecond apart",
    ),
    "time empty": ([*ROWS, ",,,,0.12,0,0.015,1,0,0,0"], "row 5: column time_s: is empty"),
    "not a number": ([*ROWS, "0.3,a,0,0,,,,,,,"], "row 5: column hand_x_m: must be a finite number, but got 'a'"),
    "infinite": ([*ROWS, "0.3,inf,0,0,,,,,,,"], "row 5: column hand_x_m: must be a finite"),
    "nan": ([*ROWS, "0.3,nan,0,0,,,,,,,"], "row 5: column hand_x_m: must be a finite"),
    "underscore": ([*ROWS, "0.3,1_0,0,0,,,,,,,"], "row 5: column hand_x_m"),
    "norm": ([*ROWS, "0.3,,,,0.1,0,0,1.002,0,0,0"], "row 5: column object_qw: the quaternion's norm"),
    "zero quaternion": ([*ROWS, "0.3,,,,0.1,0,0,0,0,0,0"], "row 5: column object_qw: the quaternion's norm"),
    "partial": ([*ROWS, "0.3,0.1,,0.1,,,,,,,"], "row 5: column hand_y_m: is empty"),
    "partial pose": ([*ROWS, "0.3,,,,0.1,0,0,,,,"], "row 5: column object_qw: is empty"),
    "one pose": (ROWS[:2], "at least two object poses"),
    "only the hand's rows": (["0.0,0,0,0,,,,,,,"], "at least two object poses"),
    "no hand sample": ([ROWS[2], "0.3,,,,0.1,0,0,1,0,0,0"], "no row has its position"),
    "one hand sample": ([ROWS[0], ROWS[2]], "a hand's path needs at least two samples"),
    "short row": ([*ROWS, "0.3,0"], "row 5: has 2 fields"),
    "long row": ([*ROWS, "0.3" + "," * 12], "row 5: has 13 fields"),
    "no rows": ([], "no samples"),
    "open quote": ([*ROWS, '0.3,"1'], "row 5"),
}


@pytest.mark.parametrize(("rows", "expected"), BAD_TABLES.values(), ids=BAD_TABLES)
def test_a_table_that_breaks_a_rule_is_refused_by_row_and_column(written, rows, expected):
    message = refusal(written(rows=rows))
    assert expected in message
    assert "001.csv: " in message


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("hand_x_m", "hand_x_mm", "column 'hand_x_mm': is unknown"),
        ("hand_x_m", "hand_y_m", "column hand_y_m: stands twice"),
        ("time_s", "force_x_n", "column time_s: is missing"),
        (",object_qz", "", "column object_qz: is missing"),
        (",", ";", "separate columns by commas"),
        ("hand_x_m,hand_y_m,hand_z_m", "force_x_n,force_y_n,force_z_n", "column hand_x_m: is missing"),
        ("hand_z_m", "hand_qw", "column hand_z_m: is missing"),
    ],
)
def test_a_header_that_breaks_a_rule_is_refused(written, old, new, expected):
    message = refusal(written(header=HEADER.replace(old, new)))
    assert expected in message
    assert "row 1" in message


def test_hand_columns_without_a_hand_are_refused(written):
    start, end = YAML.index("hand:"), YAML.index("sensors:")
    assert "describes no hand" in refusal(written(yaml=YAML[:start] + YAML[end:]))


def test_a_toss_without_a_hand_is_read(written):
    start, end = YAML.index("hand:"), YAML.index("sensors:")
    header = ",".join(HEADER.split(",")[:1] + HEADER.split(",")[4:])
    rows = ["0,0.1,0,0.1,1,0,0,0", "1,0.2,0,0.1,1,0,0,0"]
    recording = read_recording(written(yaml=YAML[:start] + YAML[end:], header=header, rows=rows))
    assert recording.hand is None and recording.pushes[0].hand is None


def test_columns_that_are_empty_throughout_are_as_good_as_absent(written):
    start, end = YAML.index("hand:"), YAML.index("sensors:")
    header = HEADER + ",force_x_n,force_y_n,force_z_n"
    free = ["0,,,,0.1,0,0.1,1,0,0,0,,,", "1,,,,0.2,0,0.1,1,0,0,0,,,"]
    recording = read_recording(written(yaml=YAML[:start] + YAML[end:], header=header, rows=free))
    assert recording.pushes[0].hand is None and recording.pushes[0].force is None
    header = HEADER + ",hand_qw,hand_qx,hand_qy,hand_qz"
    turned = read_recording(written(header=header, rows=[row + ",,,," for row in ROWS])).pushes[0].hand
    assert turned.quaternions.tolist() == [[1, 0, 0, 0]] * 2
    some = [ROWS[0] + ",1,0,0,0", *(row + ",,,," for row in ROWS[1:])]
    assert "row 3: column hand_qw: is empty" in refusal(written(header=header, rows=some))


def test_an_exact_sensor_has_no_deviation_and_a_sphere_no_length(written):
    exact = YAML.replace("force_std_n: 0.02", "force_std_n: 0").replace("stream:", "length_m: 0.05\n  stream:")
    recording = read_recording(written(exact))
    assert recording.sensors.force_std == 0.0 and recording.hand.length is None


def test_a_hand_that_is_lost_is_left_out_also_without_quaternions(written):
    rows = [*ROWS[:2], "0.15,0,0,0,,,,,,,", "0.17,0.02,0,0.015,,,,,,,", ROWS[2]]
    push = read_recording(written(rows=rows)).pushes[0]
    assert push.warnings == ("hand: row 4: track lost (all zeros), left out.",) and len(push.hand) == 3
    flat = [row.replace("0.015,0.1", "0,0.1").replace("0,0.015,,", "0,0,,") for row in ROWS]
    assert len(read_recording(written(rows=flat)).pushes[0].hand) == 2  # a planar hand that rests at the origin


def test_a_missing_folder_or_description_is_refused(tmp_path):
    assert "is not a folder" in refusal(tmp_path / "nowhere")
    assert "recording.yaml: missing file" in refusal(tmp_path)


def test_files_that_are_not_utf8_are_refused(written):
    folder = written()
    (folder / "pushes/001.csv").write_bytes(HEADER.encode() + b"\n0.0,\xff\n")
    assert "001.csv: line 2: not UTF-8" in refusal(folder)
    (folder / "recording.yaml").write_bytes(b"format: \xff")
    assert "recording.yaml: line 1: not UTF-8" in refusal(folder)


def test_a_link_out_of_the_folder_is_refused(written, tmp_path_factory):
    folder = written()
    outside = tmp_path_factory.mktemp("outside") / "a.csv"
    (folder / "pushes/001.csv").rename(outside)
    (folder / "pushes/001.csv").symlink_to(outside)
    assert "must lie inside" in refusal(folder)


def test_a_mesh_is_found_within_the_folder_only(written):
    yaml = YAML.replace("shape: box\n  size_m: [0.1, 0.05, 0.03]", "shape: mesh\n  file: bunny.obj")
    folder = written(yaml=yaml)
    assert "'bunny.obj' is missing" in refusal(folder)
    (folder / "bunny.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n")
    shape = read_recording(folder).object.shape
    assert isinstance(shape, MeshShape) and shape.file.is_absolute() and shape.scale == 1.0
    written(yaml=yaml.replace("bunny.obj", "../bunny.obj"))
    assert "must lie inside" in refusal(folder)


def test_reflex_sf_needs_no_radius(written):
    folder = written(yaml=YAML.replace("tip: sphere\n  radius_m: 1e-2", "tip: reflex_sf"))
    assert read_recording(folder).hand.radius == 0.010


def test_quaternions_are_normalised_and_keep_their_sign(written):
    rows = [*ROWS[:2], "0.2,,,,0.12,0,0.015,-1.0005,0,0,0"]
    quaternions = read_recording(written(rows=rows)).pushes[0].object.quaternions
    assert quaternions.tolist() == [[1, 0, 0, 0], [1, 0, 0, 0]]


MESHED = YAML.replace("shape: box\n  size_m: [0.1, 0.05, 0.03]", "shape: mesh\n  file: object.obj")
SOLID = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f 1 2 999999999\n", "line 5: a face's corner"),
        ("f 1 2 9\n", "a face is of vertex 9"),
        ("mtllib /etc/passwd\nusemtl a\nf 1 2 3\n", "line 5: mtllib must name a file beside the mesh"),
        ("v 1e9 0 0\n", "must be at most 10 m long"),
    ],
)
def test_a_mesh_is_refused_when_its_recording_is_read(written, text, said):
    folder = written(yaml=MESHED)
    (folder / "object.obj").write_text(SOLID + text)
    message = refusal(folder)
    assert said in message and "object.obj" in message and "recording.yaml: line 4: object" in message


@pytest.mark.parametrize("where", ["recording.yaml", "pushes/001.csv", "object.obj"])
def test_a_named_pipe_is_never_opened(written, where):
    folder = written(yaml=MESHED)
    (folder / "object.obj").write_text(SOLID)
    (folder / where).unlink()
    os.mkfifo(folder / where)
    message = refusal(folder)
    assert where in message and "it is a named pipe" in message


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("free text", "&a free text"),
        ("free text", "*a"),
        ("[0, 0]", "&a [*a]"),
        ("name: eraser", "name: eraser\nlol: &a [1]\nmore: [*a, *a]"),
    ],
)
def test_a_description_has_no_aliases(written, old, new):
    assert "the anchor or alias 'a' is not read here" in refusal(written(YAML.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("shape: box", f"shape: {'x' * 70_000}"),
        ("mass_kg: 0.05", f"mass_kg: {'x' * 70_000}"),
        ("mass_kg: 0.05", f"mass_kg: {'1' * 70_000}"),
        ("mass_kg: 0.05", f"mass_kg: 0x{'f' * 70_000}"),
        ("mass_kg: 0.05", f"{'x' * 70_000}: 0.05"),
        ("mass_kg: 0.05", f"mass_kg: 0.05\n  {'x' * 7_000}: 1\n  {'x' * 7_000}: 1"),
        ("pushes/001.csv", "x" * 70_000),
        ("pushes/001.csv", "../" + "x" * 200),
        ("name: eraser", f"name: [{'[' * 70_000}"),
        ("name: eraser", f"name: !{'x' * 70_000} 1"),
        ("physid-recording/1", "x" * 70_000),
    ],
    ids=range(11),
)
def test_a_value_of_many_letters_is_cut(written, old, new):
    folder = written(YAML.replace(old, new))
    assert len(refusal(folder)) < 500 + 2 * len(str(folder))


@pytest.mark.parametrize(("old", "new"), [("object_x_m", "x" * 70_000), ("0.1,0.01", "0.1," + "x" * 70_000)])
def test_a_field_of_many_letters_is_cut(written, old, new):
    folder = written(header=HEADER.replace(old, new), rows=[row.replace(old, new) for row in ROWS])
    assert len(refusal(folder)) < 300 + len(str(folder))


def test_a_folder_whose_name_cannot_be_is_refused(tmp_path):
    assert "is not a folder" in refusal(tmp_path / ("x" * 70_000))


YAW_HEADER = "time_s,object_x_m,object_y_m,object_z_m,object_yaw_rad,hand_x_m,hand_y_m,hand_z_m"


def yaw_rows(yaws):
    return [f"{0.1 * k:.1f},0.1,0,0.015,{yaw},0,0,0.015" for k, yaw in enumerate(yaws)]


def test_a_yaw_that_is_written_and_read_again_is_the_same(written, tmp_path):
    """Its digits and its whole turns are none of what is said."""
    rng = np.random.default_rng(0)
    yaws = np.cumsum(rng.normal(0.0, 0.4, size=400)) + 9.0
    recording = read_recording(written(header=YAW_HEADER, rows=yaw_rows([repr(float(yaw)) for yaw in yaws])))
    write_recording(recording, tmp_path / "again")
    assert digest_of(read_recording(tmp_path / "again")) == digest_of(recording)


def test_a_yaw_alone_is_a_rotation_of_which_no_more_is_said(written, tmp_path):
    recording = read_recording(written(header=YAW_HEADER, rows=yaw_rows([0.0, 3.0, 6.0])))
    stream = recording.pushes[0].object
    assert stream.rotation == "yaw" and stream.planar[:, 2] == pytest.approx([0.0, 3.0, 6.0])
    write_recording(recording, tmp_path / "again")
    assert (tmp_path / "again/pushes/001.csv").read_text().startswith("time_s,hand_x_m,hand_y_m,hand_z_m,object_x_m")
    again = read_recording(tmp_path / "again").pushes[0].object
    assert again.rotation == "yaw" and again.planar[:, 2] == pytest.approx([0.0, 3.0, 6.0])


def test_a_rotation_that_was_not_measured_is_none(written, tmp_path):
    header = YAW_HEADER.replace(",object_yaw_rad", "")
    recording = read_recording(written(header=header, rows=[row.replace(",y,", ",") for row in yaw_rows("yyy")]))
    assert recording.pushes[0].object.rotation == "none"
    write_recording(recording, tmp_path / "again")
    assert "qw" not in (tmp_path / "again/pushes/001.csv").read_text()
    assert read_recording(tmp_path / "again") == recording


@pytest.mark.parametrize(
    ("header", "rows", "expected"),
    [
        (YAW_HEADER.replace("yaw_rad", "qw"), yaw_rows([1, 1]), "column object_qx: is missing"),
        (
            f"{YAW_HEADER},object_qw,object_qx,object_qy,object_qz",
            [r + ",1,0,0,0" for r in yaw_rows([0, 1])],
            "beside",
        ),
        (YAW_HEADER, yaw_rows([0, 1e4]), "column object_yaw_rad: must be between -1000 and 1000 rad"),
        (YAW_HEADER, ["0,0.1,0,0.015,,0,0,0", "0.1,0.1,0,0.015,1,0,0,0"], "column object_yaw_rad: is empty"),
    ],
)
def test_a_rotation_is_said_in_one_way(written, header, rows, expected):
    assert expected in refusal(written(header=header, rows=rows))


def test_a_recording_that_ships_is_read_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert read_recording("eraser_reference").name == "eraser_reference"
    assert read_recording(Path("sealed_01")).folder.is_dir()
    assert refusal("eraser_referenz").endswith("or the name of a recording that ships, such as eraser_reference.")
    # What somebody has themselves goes first.
    (tmp_path / "sealed_01").mkdir()
    assert "missing file" in refusal("sealed_01")
    (tmp_path / "eraser_reference").write_text("no folder")
    assert "is not a folder" in refusal("eraser_reference")
