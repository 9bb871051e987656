"""Times in another unit than seconds are refused as they are read, and no stamps make what looks at them slow."""

import time
from dataclasses import replace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.errors import RecordingError
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.push_checks import refusals, refuse
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import ForceStream, PoseStream, estimate_noise, read_recording, thinned, write_recording
from physid_drake.recording.clocks import check_seconds, samples_within
from physid_drake.recording.reading import MOST_ROWS
from physid_drake.recording.rests import rests_of
from physid_drake.recording.screening import screen_poses

GRID = 0.01 * np.arange(100)
RNG = np.random.default_rng(0)


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(2)


def with_times(recording, change, *names):
    def timed(push):
        streams = {name: getattr(push, name) for name in names or ("object", "hand")}
        return replace(push, **{name: replace(s, times=change(s.times)) for name, s in streams.items()})

    return replace(recording, pushes=tuple(timed(push) for push in recording.pushes))


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1e3, "10 apart on the median: times look to be in milliseconds; give seconds"),
     (1e6, "10,000 apart on the median: times look to be in microseconds; give seconds"),
     (1e9, "apart on the median: times look to be in nanoseconds; give seconds")],
)  # fmt: skip
@pytest.mark.parametrize("since", [0.0, 1.7e9], ids=["from 0", "since 1970"])
def test_times_in_another_unit_are_refused_by_file_and_column(recording, tmp_path, factor, unit, since):
    write_recording(with_times(recording, lambda t: (t + since) * factor), tmp_path / "r")
    with pytest.raises(RecordingError) as caught:
        read_recording(tmp_path / "r")
    said = str(caught.value)
    assert "001.csv: column time_s: the object's samples are" in said and "\n" not in said
    assert unit in said


@pytest.mark.parametrize("stream", ["hand", "force"])
def test_the_clocks_of_hand_and_force_are_asked_too(recording, tmp_path, stream):
    def slowed(push):
        # One row of the object's clock stays between the others.
        times = 1e-3 + 1e3 * push.object.times
        force = ForceStream(times=times, forces=np.zeros((len(times), 3)))
        return (
            replace(push, force=force) if stream == "force" else replace(push, hand=replace(push.hand, times=times))
        )

    write_recording(replace(recording, pushes=tuple(slowed(p) for p in recording.pushes)), tmp_path / "r")
    with pytest.raises(RecordingError, match=f"the {stream}'s samples are 10 apart .* milliseconds"):
        read_recording(tmp_path / "r")


def test_seconds_since_1970_are_seconds(recording, tmp_path):
    write_recording(with_times(recording, lambda t: t + 1.7e9), tmp_path / "r")
    later = read_recording(tmp_path / "r")
    assert refusals(later) == () and doubts(later) == ()
    usual, seen = estimate_noise(recording), estimate_noise(later)
    assert seen.object_position_std == pytest.approx(usual.object_position_std, rel=0.05)
    assert [rests_of(p.object) for p in later.pushes] == [rests_of(p.object) for p in recording.pushes]


def test_two_poses_before_and_after_a_push_may_be_far_apart():
    check_seconds(np.array([0.0, 300.0]), "x")
    with pytest.raises(RecordingError, match=r"more than 600 s, but 4,000 are between 0.0 and 4000.0; give seconds"):
        check_seconds(np.array([0.0, 4000.0, 8000.0]), "x")


@pytest.mark.parametrize("interval", [2e-5, 1e-3, 1.0, 1.2])
def test_slow_and_fast_loggers_are_read(interval):
    check_seconds(interval * np.arange(200), "x")


def test_a_log_at_1_khz_in_milliseconds_is_refused():
    with pytest.raises(RecordingError, match="are 1 apart on the median: times look to be in milliseconds"):
        check_seconds(np.arange(2000.0), "x")


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (1e-7 * np.arange(100), "no sensor is sampled so fast"),
        (5e-324 * np.arange(1, 100), "no sensor is sampled so fast"),
        (1e300 * (1.0 + GRID), "times must be in seconds"),
        (1e308 * np.linspace(-1.7, 1.7, 30), "times must be in seconds"),
        (
            np.where(GRID > 0.5, GRID + 1e9, GRID),
            r"must not stop for more than 600 s, but 1e\+09 are between 0.5 and",
        ),
        (np.array([-1.7e308, 1.7e308]), "must not stop for more than 600 s, but inf are between"),
    ],
)
def test_stamps_that_are_none_are_refused(times, said):
    with pytest.raises(RecordingError, match=said):
        check_seconds(times, "the object's samples")


def test_a_table_of_hours_is_refused(recording, tmp_path, monkeypatch):
    monkeypatch.setattr("physid_drake.recording.reading.MOST_ROWS", 50)
    write_recording(recording, tmp_path / "r")
    with pytest.raises(RecordingError, match=r"row 52: a table must have at most 50 samples; cut the push"):
        read_recording(tmp_path / "r")
    assert MOST_ROWS >= 100_000  # a minute and a half at 1 kHz


@pytest.mark.parametrize(
    ("seconds", "interval", "count"),
    [(0.1, 0.01, 10), (0.1, 1e-320, 100), (0.1, 0.0, 100), (0.1, 1e300, 0), (0.1, 1e-4, 100)],
)
def test_how_many_samples_a_time_holds_is_bounded(seconds, interval, count):
    assert samples_within(seconds, interval, 100) == count


ODD_STAMPS = {
    "bursts": lambda k: 0.03 * (k // 3) + 1e-7 * (k % 3),
    "gap": lambda k: np.where(k > len(k) // 2, 1e9, 0.0) + 0.01 * k,
    "microseconds": lambda k: 1e4 * k,
    "nanoseconds": lambda k: 1e7 * k,
    "denormal": lambda k: 5e-324 * (k + 1.0),
    "huge": lambda k: 1e300 * (1.0 + k / len(k)),
    "every scale": lambda k: np.cumsum(10.0 ** RNG.uniform(-7.0, 0.0, len(k))),
}


@pytest.mark.filterwarnings("ignore:.*encountered:RuntimeWarning")
@pytest.mark.parametrize("name", ODD_STAMPS)
def test_no_stamps_make_rests_screening_or_thinning_slow(name):
    """Blocks of half a second were 1e9, and a window of a quarter was a matrix of the samples' square."""
    count = 20_000
    times = ODD_STAMPS[name](np.arange(count))
    positions = 3e-4 * RNG.standard_normal((count, 3)) + np.clip(np.linspace(-1.0, 2.0, count), 0.0, 1.0)[:, None]
    positions[RNG.random(count) < 0.05] += 0.1
    yaws = 3e-3 * RNG.standard_normal(count)
    quaternions = np.column_stack([np.cos(0.5 * yaws), np.zeros((count, 2)), np.sin(0.5 * yaws)])
    stream = PoseStream(times=times, positions=positions, quaternions=quaternions)
    begin = time.perf_counter()
    screened = screen_poses(times, positions, quaternions, range(count), "object")
    rests_of(stream)
    recording = shipped_pushes(1)
    push = replace(recording.pushes[0], object=stream, hand=None)
    alone = replace(recording, pushes=(push,), hand=None)
    estimate_noise(alone)
    thinned(alone)
    assert time.perf_counter() - begin < 10.0  # measured 0.3 s
    assert len(screened.warnings) < 100


def test_what_is_refused_is_refused_before_a_path_is_fitted(recording, monkeypatch):
    """In milliseconds, the fit of a hand's path took minutes."""

    def fitted(*_, **__):
        raise AssertionError("a path was fitted")

    monkeypatch.setattr("physid_drake.pushes.problem.fit_uncertain_paths", fitted)
    for wrong in (
        with_times(recording, lambda t: 1e3 * t),
        with_times(recording, lambda t: t + 1e4, "hand"),
        replace(recording, object=replace(recording.object, mass=1e3)),
        replace(recording, table=replace(recording.table, centre=(5.0, 0.0))),
    ):
        with pytest.raises(RecordingError):
            refuse(wrong)
        with pytest.raises(RecordingError):
            case_of(wrong, cell_config(wrong), ThetaConfig(), jobs=1)
        assert refusals(wrong)


def test_an_object_that_never_moves_is_refused_before_a_path_is_fitted(recording, monkeypatch):
    monkeypatch.delattr("physid_drake.pushes.problem.fit_uncertain_paths")

    def still(push):
        stream = push.object
        first = (np.tile(values[0], (len(stream), 1)) for values in (stream.positions, stream.quaternions))
        return replace(push, object=replace(stream, **dict(zip(("positions", "quaternions"), first, strict=True))))

    quiet = replace(recording, pushes=tuple(still(push) for push in recording.pushes))
    with pytest.raises(RecordingError, match="never moves"):
        case_of(quiet, cell_config(quiet), ThetaConfig(), jobs=1)
    assert any("never moves" in said for said in refusals(quiet))
