import os
import warnings
from pathlib import Path

import numpy as np
import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording import outline_distance
from physid_drake.recording.adapters import cmu, convert_cmu

SHARED = Path(os.environ.get("PHYSID_SHARED_DATA", Path(__file__).parents[2] / "../shared/data"))
LOGS = SHARED / "cmu_pushes/sensor_log"
START = 1439922972.0
S = np.sqrt(0.5)


def pose_line(x, y, z, yaw):
    return f"{x} {y} {z} {np.cos(yaw / 2):.12f} 0 0 {np.sin(yaw / 2):.12f}"


def synthetic_push(yaw=0.5, force_on_object=(4.0, 1.0), after_z=9.0, rows=220):
    """The finger pushes the leg x = 0 of the corner frame along its inward normal at 2.5 mm/s."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corner = np.array([600.0, 20.0])
    times = START + 0.03 * np.arange(rows)
    along = -2.5 + 2.5 * 0.03 * np.arange(rows)
    tool = corner + np.column_stack([along, np.full(rows, 50.0)]) @ turn.T
    unlogged = 2.5 * cmu.UNLOGGED_TIME
    after = corner + turn @ [along[-1] + unlogged, 0.0]
    force_times = START + 0.01 * np.arange(3 * rows)
    sensed = -np.array([[S, S], [S, -S]]) @ np.array(force_on_object)
    pressed = (np.arange(3 * rows) > 100)[:, None] * sensed + [0.3, -0.2]
    lines = [pose_line(*corner, 9.0, yaw), pose_line(*after, after_z, yaw), str(3 * rows)]
    lines += [f"{t:.9f} {f[0]!r} {f[1]!r}" for t, f in zip(force_times, pressed.tolist(), strict=True)]
    lines += [str(rows)]
    lines += [f"{t:.9f} {pose_line(*p, 21.0, yaw)}" for t, p in zip(times, tool.tolist(), strict=True)]
    return lines


def write_log(path, *pushes, declared=None):
    path.write_text("\n".join([str(declared or len(pushes)), *(line for push in pushes for line in push)]) + "\n")
    return path


def test_a_log_becomes_si_units_in_the_world_frame(tmp_path):
    log = write_log(tmp_path / "exp.txt", synthetic_push())
    push = convert_cmu(log, tmp_path / "r").pushes[0]
    assert push.endpoint_only
    expected = np.array([0.6, 0.02]) + 0.05 * np.array([np.cos(0.5) - np.sin(0.5), np.sin(0.5) + np.cos(0.5)])
    assert np.allclose(push.object.planar[0], [*expected, 0.5])
    assert np.allclose(push.object.positions[:, 2], 0.025)
    assert push.start_time == 0.0 and push.object.times[1] == push.end_time
    assert np.allclose(push.hand.quaternions, [1.0, 0.0, 0.0, 0.0])


def test_force_is_turned_into_the_world_by_the_hands_yaw(tmp_path):
    log = write_log(tmp_path / "exp.txt", synthetic_push(yaw=0.5), synthetic_push(yaw=2.0))
    for push, yaw in zip(convert_cmu(log, tmp_path / "r").pushes, (0.5, 2.0), strict=True):
        expected = [4 * np.cos(yaw) - np.sin(yaw), 4 * np.sin(yaw) + np.cos(yaw), 0.0]
        assert np.allclose(push.force.forces[-1], expected)
        assert np.allclose(push.force.forces[0], 0.0)


def test_the_earlier_mounting_is_told_from_the_later_one_by_the_force(tmp_path):
    # There the sensor's x reads the push itself: this is what the later mounting would make of (4, 0) N.
    lines = synthetic_push(force_on_object=-np.array([[S, S], [S, -S]]) @ [4.0, 0.0])
    push = convert_cmu(write_log(tmp_path / "exp.txt", lines), tmp_path / "r").pushes[0]
    assert np.allclose(push.force.forces[-1], [4 * np.cos(0.5), 4 * np.sin(0.5), 0.0])


def test_a_log_without_a_count_is_read(tmp_path):
    log = tmp_path / "exp.txt"
    log.write_text("\n".join(synthetic_push()))
    assert len(convert_cmu(log, tmp_path / "r").pushes) == 1


@pytest.mark.parametrize("lost", [1, 100, 300, 880])
def test_a_log_cut_short_keeps_what_is_whole_and_says_so(tmp_path, lost):
    log = write_log(tmp_path / "exp.txt", synthetic_push(), synthetic_push()[:-lost])
    with pytest.warns(UserWarning, match="exp.txt, push 2: the log is cut short"):
        recording = convert_cmu(log, tmp_path / "r")
    assert len(recording.pushes) == 1


def test_a_push_that_two_logs_share_is_taken_once(tmp_path):
    source = tmp_path / "logs"
    source.mkdir()
    write_log(source / "a.txt", synthetic_push())
    write_log(source / "b.txt", synthetic_push(), synthetic_push(yaw=1.0))
    with pytest.warns(UserWarning, match=r"b.txt: 1 pushes are copies"):
        recording = convert_cmu(source, tmp_path / "r")
    assert [push.note for push in recording.pushes] == ["a.txt, push 1", "b.txt, push 2"]


def test_a_tracker_error_is_left_out_by_name(tmp_path):
    log = write_log(tmp_path / "exp.txt", synthetic_push(), synthetic_push(after_z=29.0))
    with pytest.warns(UserWarning, match=r"exp.txt, push 2: tracker error: the object climbs by 20.0 mm"):
        assert len(convert_cmu(log, tmp_path / "r").pushes) == 1


def test_numbers_out_of_all_proportion_are_left_out_by_name(tmp_path):
    lines = synthetic_push()
    lines[0] = lines[0].replace("600.0", "1e300")
    with pytest.warns(UserWarning, match="push 1: a number that is not finite, or beyond"):
        recording = convert_cmu(write_log(tmp_path / "exp.txt", lines, synthetic_push()), tmp_path / "r")
    assert len(recording.pushes) == 1


def test_a_last_sample_long_after_the_others_does_not_stop_the_hand(tmp_path):
    lines = synthetic_push()
    lines[-1] = " ".join([f"{START + 100.0}", *lines[-1].split()[1:]])
    push = convert_cmu(write_log(tmp_path / "exp.txt", lines), tmp_path / "r").pushes[0]
    assert np.isfinite(push.hand.positions).all()


def test_the_name_of_the_logs_folder_does_not_enter_the_recording(tmp_path):
    source = tmp_path / "30_90_30_30_30_90"
    source.mkdir()
    write_log(source / "exp.txt", synthetic_push())
    for number, given in enumerate((source, source / "exp.txt")):
        folder = tmp_path / f"r{number}"
        convert_cmu(given, folder)
        written = "".join(str(f.relative_to(folder)) + f.read_text() for f in folder.rglob("*") if f.is_file())
        assert "30_90" not in written


@pytest.mark.parametrize("text", ["", "50\n", "hello\n", "1\n1 2 3\n"])
def test_a_file_that_is_no_log_is_refused(tmp_path, text):
    (tmp_path / "a.txt").write_text(text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        with pytest.raises(RecordingError, match="no usable push"):
            convert_cmu(tmp_path / "a.txt", tmp_path / "r")
    with pytest.raises(RecordingError, match=r"no \.txt file"):
        convert_cmu(tmp_path / "nowhere", tmp_path / "r")


def test_a_limit_draws_the_same_pushes_for_the_same_seed(tmp_path):
    log = write_log(tmp_path / "exp.txt", *[synthetic_push(yaw=0.1 * k) for k in range(6)])
    drawn = [convert_cmu(log, tmp_path / f"r{k}", limit=3, seed=4) for k in range(2)]
    assert drawn[0] == drawn[1] and len(drawn[0].pushes) == 3
    with pytest.raises(RecordingError, match="limit"):
        convert_cmu(log, tmp_path / "r", limit=0)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    log = LOGS / "patch/exp_08_18_1435_50.txt"
    return convert_cmu(log, tmp_path_factory.mktemp("cmu") / "r")


@pytest.mark.skipif(not LOGS.is_dir(), reason=f"the published CMU logs are not at {LOGS}")
class TestPublishedLogs:
    def test_all_fifty_pushes_are_read(self, recording):
        assert len(recording.pushes) == 50

    def test_force_on_the_object_points_along_the_hands_motion(self, recording):
        cosines = []
        for push in recording.pushes:
            forces = push.force.forces[:, :2]
            pressed = forces[np.linalg.norm(forces, axis=1) > 2.0].mean(axis=0)
            motion = push.hand.positions[-1, :2] - push.hand.positions[0, :2]
            cosines.append(pressed @ motion / np.linalg.norm(pressed) / np.linalg.norm(motion))
        assert min(cosines) > 0.7 and np.mean(cosines) > 0.9

    @pytest.mark.parametrize("pose", [0, -1])
    def test_the_tip_touches_the_objects_edge(self, recording, pose):
        gaps = []
        for push in recording.pushes:
            x, y, yaw = push.object.planar[pose]
            pressed = np.linalg.norm(push.force.forces, axis=1) > 0.3
            time = push.force.times[np.argmax(pressed)] if pose == 0 else push.hand.times[-1]
            tip = [np.interp(time, push.hand.times, push.hand.positions[:, k]) for k in (0, 1)]
            c, s = np.cos(yaw), np.sin(yaw)
            local = np.array([tip[0] - x, tip[1] - y]) @ np.array([[c, -s], [s, c]])
            gaps.append(outline_distance(cmu.OUTLINE, [local])[0] - cmu.TIP_RADIUS)
        assert abs(np.median(gaps)) < 0.3e-3 and np.std(gaps) < 0.8e-3

    def test_pushes_with_a_tracker_error_are_left_out(self, tmp_path):
        log = LOGS / "30_90_30_30_30_90/exp9_15.txt"
        with pytest.warns(UserWarning, match="exp9_15.txt, push 11: tracker error"):
            assert len(convert_cmu(log, tmp_path / "r").pushes) == 10
