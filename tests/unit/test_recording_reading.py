import math

import numpy as np
import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording import MeshShape, read_recording

YAML = """\
format: physid-recording/1
name: eraser
description: free text
object:
  shape: box
  size_m: [0.1, 0.05, 0.03]
  mass_kg: 0.05
table:
  size_m: [1.2, 0.8]
  centre_m: [0, 0]
hand:
  tip: sphere
  radius_m: 1e-2
  stream: measured
sensors:
  force_std_n: 0.02
pushes:
  - file: pushes/001.csv
    note: first
"""
HEADER = "time_s,hand_x_m,hand_y_m,hand_z_m,object_x_m,object_y_m,object_z_m,object_qw,object_qx,object_qy,object_qz"
ROWS = ["0.0,0,0,0.015,0.1,0,0.015,1,0,0,0", "0.1,0.01,0,0.015,,,,,,,", "0.2,,,,0.12,0,0.015,1,0,0,0"]


@pytest.fixture
def written(tmp_path):
    def write(yaml=YAML, header=HEADER, rows=ROWS):
        (tmp_path / "pushes").mkdir(exist_ok=True)
        (tmp_path / "recording.yaml").write_text(yaml, encoding="utf-8")
        (tmp_path / "pushes/001.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
        return tmp_path

    return write


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
    (folder / "bunny.obj").write_text("v 0 0 0\n")
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


def long_table(change, count=80, noise=0.0):
    rng = np.random.default_rng(0)
    x = 0.01 * np.maximum(0, np.arange(count) - 20) * 0.1 + noise * rng.standard_normal(count)
    poses = np.zeros((count, 8))
    poses[:, 0], poses[:, 1], poses[:, 4] = np.arange(count) * 0.01, 0.1 + x, 1.0
    poses = change(poses)
    return [f"{float(p[0])!r},0,0,0,{','.join(repr(float(v)) for v in p[1:])}" for p in poses]


def lose(poses):
    poses[[30, 31, 50], 1:] = 0.0
    return poses


def lose_with_a_quaternion(poses):
    poses[:, 3] += 0.02
    poses[[30, 31, 50], 1:4] = 0.0
    poses[[30, 31, 50], 4:] = [1.0, 0.0, 0.0, 0.0]
    return poses


def jump_for_two(poses):
    poses[40:42, 2] += 0.05
    return poses


def jump(poses):
    poses[40, 2] += 0.05
    return poses


def jump_in_yaw(poses):
    poses[40, 4:] = [math.cos(0.5), 0, 0, math.sin(0.5)]
    return poses


def leap_and_stay(poses):
    poses[40:, 2] += 0.05
    return poses


def leap_before_it_moves(poses):
    poses[10:, 2] += 0.05
    return poses


def leap_of_a_slow_tracker(poses):
    poses[:, 0] *= 10.0
    return leap_and_stay(poses)


def stall(poses):
    poses[40:50, 1:] = poses[40, 1:]
    return poses


def pause(poses):
    return np.delete(poses, slice(40, 50), axis=0)


@pytest.mark.parametrize(("rate", "left"), [(0.5, 40), (0.6, 48), (0.25, 20)])
def test_a_tracker_that_is_slower_than_the_log_shows_each_pose_once(written, rate, left):
    def held(poses):
        frame = np.floor(rate * np.arange(len(poses)) + 1e-9)
        first = np.searchsorted(frame, frame)
        poses[:, 1:] = poses[first, 1:]
        return poses

    push = read_recording(written(rows=long_table(held, noise=2e-4))).pushes[0]
    assert len(push.object) == left
    assert any("by a tracker slower than the log; repeats left out" in w for w in push.warnings)


def test_an_object_that_was_never_tracked_is_one_line(written):
    def never(poses):
        poses[:, 1:4], poses[:, 4:] = 0.0, 0.0
        return poses

    with pytest.raises(RecordingError, match="at least two object poses are needed"):
        read_recording(written(rows=long_table(never)))


@pytest.mark.parametrize("seed", range(5))
def test_a_camera_that_is_held_in_a_log_with_a_jittery_clock_loses_no_track(written, seed):
    """30 Hz in 125 Hz: the object is pushed at 0.5 m/s, and each frame is a leap between poses that are held."""

    def held(poses):
        rng = np.random.default_rng(seed)
        poses[:, 0] = 0.008 * np.arange(len(poses))
        poses[:, 1] = 0.1 + 0.5 * np.clip(poses[:, 0] - 0.3, 0.0, 0.6)
        frames = np.sort(np.arange(0.0, poses[-1, 0], 1 / 30) + 4e-3 * rng.standard_normal(len(poses) * 30 // 125))
        shown = np.maximum(np.searchsorted(frames, poses[:, 0]) - 1, 0)
        poses[:, 1] = (
            np.interp(frames[shown], poses[:, 0], poses[:, 1]) + 1e-5 * rng.standard_normal(len(frames))[shown]
        )
        return poses

    push = read_recording(written(rows=long_table(held, count=200))).pushes[0]
    assert np.ptp(push.object.positions[:, 0]) == pytest.approx(0.3, abs=1e-3)
    assert not any("left out" in w and "jumps" in w for w in push.warnings)


@pytest.mark.parametrize("noise", [0.0, 5e-4])
def test_a_rest_before_a_swap_is_not_taken_for_the_push(written, noise):
    def swapped_at_rest(poses):
        poses[60:, 2] += 0.05
        poses[:, 1] = 0.1 + 0.001 * np.clip(np.arange(len(poses)) - 80, 0, 60)
        poses[:, 1] += noise * np.random.default_rng(1).standard_normal(len(poses))
        return poses

    push = read_recording(written(rows=long_table(swapped_at_rest, count=200))).pushes[0]
    assert len(push.object) == 140


@pytest.mark.parametrize("step", [2e-5, 1e-4, 1e-3])
def test_rounded_poses_are_not_taken_for_those_of_a_slow_tracker(written, step):
    def rounded(poses):
        poses[:, 1] = step * np.round(poses[:, 1] / step)
        return poses

    assert len(read_recording(written(rows=long_table(rounded, noise=1e-5, count=400))).pushes[0].object) == 400


@pytest.mark.parametrize("noise", [0.0, 1e-5])
@pytest.mark.parametrize(
    ("change", "expected", "left"),
    [
        (lose, "object: rows 32-33, 52: track lost (all zeros), left out.", 77),
        (lose_with_a_quaternion, "object: rows 32-33, 52: track lost (all zeros), left out.", 77),
        (jump_for_two, "object: rows 42-43: jumps 0.05 m away and comes straight back, left out.", 78),
        (jump, "object: row 42: jumps 0.05 m away and comes straight back, left out.", 79),
        (jump_in_yaw, "object: row 42: jumps 0.001 m and 57 degrees away and comes straight back, left out.", 79),
        (leap_and_stay, "object: row 42: jumps 0.05 m and stays there; what comes after is left out.", 40),
        (leap_before_it_moves, "object: row 12: jumps 0.05 m and stays there; what comes before is left out.", 70),
        (leap_of_a_slow_tracker, "object: row 42: jumps 0.05 m and stays there, kept.", 80),
        (stall, "object: rows 42-51: stalls (same pose 10 times, then catches up), kept.", 80),
        (pause, "object: rows 41-42: gap of 0.11 s, kept.", 70),
    ],
)
def test_what_a_tracker_does_wrong_is_named_by_row(written, change, expected, left, noise):
    push = read_recording(written(rows=long_table(change, noise=noise))).pushes[0]
    warnings = [w for w in push.warnings if w.startswith("object")]
    assert warnings[0].startswith(expected[:22])
    if noise == 0.0:
        assert warnings[0].startswith(expected)
    assert len(push.object) == left


@pytest.mark.parametrize("noise", [0.0, 1e-5, 3e-4])
def test_a_clean_push_raises_no_warning(written, noise):
    rows = long_table(lambda poses: poses, count=400, noise=noise)
    assert read_recording(written(rows=rows)).pushes[0].warnings == ()


def test_a_bounce_is_no_jump(written):
    def bounce(poses):
        poses[:, 3] = np.abs(0.5 - 0.02 * np.arange(len(poses)))
        return poses

    assert read_recording(written(rows=long_table(bounce))).pushes[0].warnings == ()


@pytest.mark.parametrize("period", [2, 3])
def test_rests_of_a_slow_tracker_that_rounds_stay(written, period):
    """All poses of a rest are one: without them, nothing says how long it rested."""

    def slow(poses):
        times, count = poses[:, 0].copy(), len(poses)
        way = np.clip((np.arange(count) - 120) / 160, 0.0, 1.0)
        poses[:, 1] = np.round(0.1 * way**2 * (3 - 2 * way), 4)
        poses[:, 1:] = poses[period * (np.arange(count) // period), 1:]
        poses[:, 0] = times
        return poses

    push = read_recording(written(rows=long_table(slow, count=400))).pushes[0]
    assert len(push.object) == pytest.approx(400 / period, abs=4)
    assert np.diff(push.object.times).max() < 2.1 * period * np.diff(push.object.times).min()


@pytest.mark.parametrize(("size", "samples"), [(0.010, 9), (0.005, 8)])
def test_a_tap_is_no_jump(written, size, samples):
    def tap(poses):
        turn = np.clip((np.arange(len(poses)) - 60.0) / samples, 0.0, 1.0)
        poses[:, 1] = 0.5 * size * (1.0 - np.cos(2.0 * np.pi * turn))
        return poses

    push = read_recording(written(rows=long_table(tap, noise=5e-5, count=200))).pushes[0]
    assert not any("left out" in w for w in push.warnings) and len(push.object) == 200


def test_too_few_poses_left_after_track_loss_are_refused(written):
    rows = [ROWS[0], "0.1,,,,0,0,0,0,0,0,0", "0.2,,,,0,0,0,0,0,0,0"]
    assert "at least two object poses" in refusal(written(rows=rows))
