"""Whatever is recorded is read back as it was written, by any clock; whatever is damaged is refused in one line."""

import copy
import csv
import dataclasses as dc
import io
import warnings

import numpy as np
import yaml
from drawn import costly, folder, generators, numbers, recordings
from hypothesis import assume, example, given
from hypothesis import strategies as st
from written import HEADER, ROWS, YAML, write

from physid_drake.errors import RecordingError
from physid_drake.recording import PoseStream, read_recording, write_recording
from physid_drake.recording.reading import YAW_DIGITS, unit_quaternions
from physid_drake.recording.screening import screen_poses
from physid_drake.recording.turns import unwrapped


def as_read(stream):
    """A stream of which the reader has nothing to add: of norm 1, signs that go on, a yaw of so many digits."""
    if stream is None or stream.rotation == "none":
        return stream
    if stream.rotation == "full":
        return dc.replace(stream, quaternions=unit_quaternions(stream.quaternions))
    w, _, _, z = stream.quaternions.T
    yaw = np.round(np.arctan2(2.0 * w * z, 1.0 - 2.0 * z * z), YAW_DIGITS)
    quaternions = np.column_stack([np.cos(0.5 * yaw), np.zeros((len(yaw), 2)), np.sin(0.5 * yaw)])
    return dc.replace(stream, quaternions=unit_quaternions(quaternions))


def written_and_read(recording):
    with folder() as place:
        write_recording(recording, place / "new")
        return read_recording(place / "new")


@costly
@given(recordings())
def test_what_is_written_is_read_back_to_the_last_digit(recording):
    pushes = [dc.replace(p, object=as_read(p.object), hand=as_read(p.hand)) for p in recording.pushes]
    found = written_and_read(recording)
    for push, other in zip(pushes, found.pushes, strict=True):
        if push.object.rotation == "yaw":  # a round number of digits, within a rounding of one
            apart = np.abs(np.sum(push.object.quaternions * other.object.quaternions, axis=1))
            assert np.all(apart > 1.0 - 1e-15)
            other = dc.replace(other, object=dc.replace(other.object, quaternions=push.object.quaternions))  # noqa: PLW2901
        assert push == other
    assert dc.replace(found, pushes=recording.pushes) == recording
    assert written_and_read(found) == found


@given(generators(), st.integers(5, 10), numbers(0.01, 0.5))
def test_a_yaw_that_turns_at_any_rate_about_a_gap_is_read_back(rng, count, gap):
    """How often it turned in between is a guess, and not written."""
    times = np.cumsum(np.append(np.full(count, 1e-4), [gap, *np.full(count, 1e-4)]))
    yaws = np.cumsum(rng.uniform(0.0, 1.5, len(times)))
    zeros = np.zeros((len(times), 2))
    stream = PoseStream(
        times=times, positions=np.full((len(times), 3), 0.1), rotation="yaw",
        quaternions=np.column_stack([np.cos(0.5 * yaws), zeros, np.sin(0.5 * yaws)]),
    )  # fmt: skip
    with folder() as place:
        plain = read_recording(write(place))
    pushes = (dc.replace(plain.pushes[0], object=stream),)
    (found,) = written_and_read(dc.replace(plain, pushes=pushes)).pushes
    assert np.abs(np.exp(1j * found.object.headings) - np.exp(1j * yaws)).max() < 1e-12


def tracks():
    """A body on its way as trackers see it: with pauses, leaps there and back, stalls, repeats and lost samples."""

    def made(rng, count, period):
        rows = np.arange(count)
        away = np.where(rows > count // 3, 0.003 * (rows - count // 3), 0.0)[:, None]
        positions = away * rng.normal(size=3) + 1e-5 * rng.normal(size=(count, 3)) + rng.normal(size=3)
        turns = rng.normal() * np.cumsum(rng.uniform(size=count) < 0.3)
        quaternions = np.column_stack([np.cos(turns), np.zeros((count, 2)), np.sin(turns)])
        for _ in range(rng.integers(0, 4)):
            first, span = rng.integers(0, count), rng.integers(1, 9)
            match rng.integers(0, 4):
                case 0:  # lost
                    positions[first : first + span], quaternions[first : first + span] = 0.0, 0.0
                case 1:  # away
                    positions[first : first + span] += rng.normal(size=3)
                case 2:  # held
                    positions[first : first + span], quaternions[first : first + span] = (
                        positions[first], quaternions[first]
                    )  # fmt: skip
                case _:  # another body
                    positions[first:] += 0.3 * rng.normal(size=3)
        # Whole time steps of a clock of 1024 Hz, which floating-point numbers hold exactly since 1970.
        ticks = np.cumsum(np.where(rng.uniform(size=count) < 0.03, 300, 5))
        held = period * (rows // period)
        return ticks / 1024.0, positions[held], quaternions[held]

    return st.builds(made, generators(), st.integers(25, 120) | st.integers(1, 30), st.sampled_from((1, 1, 2, 3)))


def screened(times, positions, quaternions, what="object"):
    found = screen_poses(times, positions, quaternions, range(len(times)), what)
    return found.keep.tolist(), found.warnings


@given(tracks(), st.integers(-(2**20), 2**31), st.sampled_from(("object", "hand")))
def test_what_is_left_out_of_a_stream_does_not_depend_on_when_its_clock_began(track, seconds, what):
    times, positions, quaternions = track
    assert screened(times, positions, quaternions, what) == screened(times + seconds, positions, quaternions, what)


@given(tracks())
def test_what_is_left_out_of_a_stream_does_not_depend_on_which_way_the_world_points(track):
    times, positions, quaternions = track
    w, x, y, z = quaternions.T
    half_turn = positions * [-1.0, -1.0, 1.0], np.column_stack([-z, -y, x, w])
    assert screened(times, positions, quaternions) == screened(times, *half_turn)


@given(tracks())
def test_a_tracker_that_writes_all_rotations_with_one_sign_of_w_has_the_same_stream(track):
    times, positions, quaternions = track
    other = np.where(quaternions[:, :1] < 0.0, -1.0, 1.0) * quaternions
    assert screened(times, positions, quaternions) == screened(times, positions, other)
    seen = (quaternions != 0.0).any(axis=1)
    assume(seen.any())
    one, same = unit_quaternions(quaternions[seen]), unit_quaternions(other[seen])
    assert np.array_equal(same, one if same[0] @ one[0] > 0.0 else -one)
    assert (np.sum(one[1:] * one[:-1], axis=1) >= 0.0).all()


@given(generators(), st.integers(2, 60), st.integers(-3, 3))
def test_a_heading_recorded_within_one_turn_goes_on_over_many(rng, count, turns):
    headings = 2.0 * np.pi * turns + np.cumsum(rng.uniform(-3.1, 3.1, count))
    times = np.cumsum(rng.uniform(0.008, 0.012, count))
    found = unwrapped(times, np.remainder(headings + np.pi, 2.0 * np.pi) - np.pi)
    assert np.abs(np.diff(found) - np.diff(headings)).max() < 1e-12  # measured 4e-14


# ------------------------------------------------------------------------------------------------------------ damage

BYTES = st.binary(max_size=6) | st.sampled_from(
    (b"\xff\xfe", b"\0", b"\r", b'"', b"'", b"\xe2\x80\xa8", b"- ", b"&a *a")
)
SCALARS = (
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.dates() | st.binary(max_size=4)
    | st.sampled_from((1e308, -1e-308, 10**400, "1e3", "nan", "../..", "/", "~", "pushes", "box", "none"))
)  # fmt: skip
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4) | st.integers(), inner, max_size=3)
    ),
    max_leaves=5,
)
FIELDS = st.text(max_size=6) | st.floats().map(repr) | st.integers().map(str) | st.sampled_from(
    ("1e400", "1_0", "0x1", "nan", "-inf", "\uff11", " 1 ", "1,5", '"', "1e-320", "-0.0", "", "1e308", "9" * 400)
)  # fmt: skip


def read_or_refused(place):
    """Read: then it can be written, and is the same again. Refused: in one line that names a file."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # neither does numpy stumble over what was written
        try:
            found = read_recording(place)
        except RecordingError as error:
            said = str(error)
            assert said.isprintable() and str(place) in said and len(said) < 2000
            return None
        assert written_and_read(found) == found
    return found


@given(st.sampled_from(("recording.yaml", "pushes/001.csv")), numbers(0.0, 1.0), st.integers(0, 12), BYTES)
@example("pushes/001.csv", 0.9, 0, b',"')
@example("recording.yaml", 0.2, 0, b"\xff")
def test_a_file_with_other_bytes_in_it_is_read_or_refused_in_one_line(name, share, span, other):
    with folder() as place:
        file = write(place) / name
        content = file.read_bytes()
        first = round(share * len(content))
        file.write_bytes(content[:first] + other + content[first + span :])
        read_or_refused(place)


def keys_of(values, path=()):
    """Paths to all values of nested mappings and lists."""
    inner = values.items() if isinstance(values, dict) else enumerate(values) if isinstance(values, list) else ()
    return [path, *(one for key, value in inner for one in keys_of(value, (*path, key)))]


DESCRIBED = yaml.safe_load(YAML.replace("1e-2", "0.01"))
KEYS = keys_of(DESCRIBED)[1:]


@given(st.sampled_from(KEYS), VALUES, st.booleans())
@example(("object", "mass_kg"), 10**400, True)
@example(("pushes", 0, "file"), "pushes/\udc80.csv", True)
@example(("hand",), None, False)
def test_a_description_with_any_other_value_in_it_is_read_or_refused_in_one_line(path, value, there):
    described = copy.deepcopy(DESCRIBED)
    *above, key = path
    at = described
    for one in above:
        at = at[one]
    if there:
        at[key] = value
    else:
        at.pop(key)
    with folder() as place:
        write(place, yaml=yaml.safe_dump(described, allow_unicode=True))
        read_or_refused(place)


@given(st.integers(0, 2), st.integers(0, 10), FIELDS)
def test_a_table_with_any_other_field_in_it_is_read_or_refused_in_one_line(row, column, field):
    rows = [one.split(",") for one in ROWS]
    rows[row][column] = field
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(rows)
    with folder() as place:
        write(place)
        (place / "pushes/001.csv").write_text(f"{HEADER}\n{text.getvalue()}", encoding="utf-8", errors="replace")
        found = read_or_refused(place)
    if found is not None:  # what is no number is nowhere taken for one
        assert not field.strip() or np.isfinite(float(field))


@costly
@given(st.integers(-(2**20), 2**31))
def test_the_clock_of_a_table_may_begin_at_any_time(seconds):
    with folder() as place:
        write(place, rows=[f"{seconds + 0.125 * k!r},{row.split(',', 1)[1]}" for k, row in enumerate(ROWS)])
        (push,) = read_recording(place).pushes
    with folder() as place:
        write(place, rows=[f"{0.125 * k!r},{row.split(',', 1)[1]}" for k, row in enumerate(ROWS)])
        (other,) = read_recording(place).pushes
    assert push.warnings == other.warnings
    for late, early in ((push.object, other.object), (push.hand, other.hand)):
        assert dc.replace(late, times=late.times - seconds) == early
