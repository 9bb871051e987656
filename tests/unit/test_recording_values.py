import numpy as np
import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording import (
    Box,
    Cylinder,
    ForceStream,
    Hand,
    ObjectModel,
    PoseStream,
    Prism,
    Push,
    Recording,
    Sensors,
    Table,
    outline_distance,
    polygon_centroid,
)

IDENTITY = [1.0, 0.0, 0.0, 0.0]


def yaw_stream(yaws):
    yaws = np.asarray(yaws, dtype=float)
    quaternions = np.column_stack([np.cos(yaws / 2), 0 * yaws, 0 * yaws, np.sin(yaws / 2)])
    return PoseStream(times=np.arange(len(yaws)), positions=np.zeros((len(yaws), 3)), quaternions=quaternions)


def still(times):
    return PoseStream(times=times, positions=np.zeros((len(times), 3)), quaternions=[IDENTITY] * len(times))


def recording_of(*pushes, hand=None):
    return Recording(
        name="r",
        description="",
        object=ObjectModel(shape=Box(size=(0.1, 0.1, 0.1))),
        table=Table(size=(1.0, 1.0)),
        hand=hand,
        sensors=Sensors(),
        pushes=pushes,
    )


def test_planar_yaw_counts_full_turns():
    yaws = np.linspace(0.0, 15.0, 40)
    assert np.allclose(yaw_stream(yaws).planar[:, 2], yaws)


def test_planar_yaw_does_not_depend_on_the_quaternions_sign():
    stream = yaw_stream(np.linspace(0.0, 2.0, 20))
    signs = np.where(np.arange(20) % 2, -1.0, 1.0)[:, None]
    flipped = PoseStream(times=stream.times, positions=stream.positions, quaternions=stream.quaternions * signs)
    assert np.allclose(flipped.planar, stream.planar)


def test_arrays_are_read_only_copies():
    times = np.array([0.0, 1.0])
    stream = still(times)
    times[0] = 9.0
    assert stream.times[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        stream.positions[0, 0] = 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"times": [0.0, 0.0]}, r"times must increase, but times\[1\]"),
        ({"times": [0.0]}, "equally long"),
        ({"times": [[0.0], [1.0]]}, "shape"),
        ({"positions": [[0, 0, 0], [0, np.nan, 0]]}, "row 1"),
        ({"positions": [[0, 0], [0, 0]]}, r"shape \(n, 3\)"),
        ({"quaternions": [[1.01, 0, 0, 0], IDENTITY]}, "norm"),
    ],
)
def test_a_pose_stream_refuses_what_is_no_motion(change, message):
    good = {"times": [0.0, 1.0], "positions": [[0, 0, 0], [1, 0, 0]], "quaternions": [IDENTITY, IDENTITY]}
    with pytest.raises(RecordingError, match=message):
        PoseStream(**(good | change))


def test_a_push_lasts_over_all_its_streams():
    push = Push(
        name="a",
        object=still([1.0, 2.0]),
        hand=still([0.5, 1.0, 1.5]),
        force=ForceStream(times=[0.2, 2.5], forces=np.zeros((2, 3))),
    )
    assert (push.start_time, push.end_time, push.duration) == (0.2, 2.5, 2.3)
    assert push.endpoint_only


def test_a_push_needs_two_object_poses():
    with pytest.raises(RecordingError, match="at least two object poses"):
        Push(name="a", object=still([1.0]), hand=None, force=None)


@pytest.mark.parametrize(
    ("polygon", "message"),
    [
        (((-1, -1), (-1, 1), (1, 1), (1, -1)), "counter-clockwise"),
        (((-1, -1), (1, -1), (0, -0.5), (0, 1)), "centroid"),
        (((0, 0), (1, 0), (1, 1), (0, 1)), "centroid"),
        (((0, 0), (1, 0)), "three"),
        (((-1, -1), (0, -1), (1, -1), (1, 1), (-1, 1)), "collinear"),
        ([(np.cos(2.4 * np.pi * k / 3), np.sin(2.4 * np.pi * k / 3)) for k in range(5)], "cross or touch itself"),
    ],
)
def test_a_prism_refuses_a_polygon_that_breaks_the_rule(polygon, message):
    with pytest.raises(RecordingError, match=message):
        Prism(polygon=tuple(polygon), height=0.1)


def test_a_triangles_centroid_is_the_mean_of_its_corners():
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 6.0]])
    assert np.allclose(polygon_centroid(corners), corners.mean(axis=0))


def test_distance_from_an_outline_is_negative_inside():
    square = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    assert np.allclose(outline_distance(square, [[0, 0], [2, 0], [4, 5]]), [-1.0, 1.0, 5.0])


def test_a_mass_without_a_deviation_is_known_to_one_percent():
    assert ObjectModel(shape=Box(size=(1, 1, 1)), mass=2.0).mass_std == 0.02


@pytest.mark.parametrize(
    "make",
    [
        lambda: Box(size=(0.1, -0.1, 0.1)),
        lambda: Cylinder(radius=0.0, length=1.0, axis="z"),
        lambda: Cylinder(radius=1.0, length=1.0, axis="x"),
        lambda: ObjectModel(shape=Box(size=(1, 1, 1)), mass=None, mass_std=0.1),
        lambda: ObjectModel(shape=Box(size=(1, 1, 1)), mass=0.054, mass_std=10.0),
        lambda: Hand(tip="cylinder", radius=0.01, stream="measured"),
        lambda: Hand(tip="sphere", radius=0.01, length=0.1, stream="measured"),
        lambda: Sensors(force_std=-1.0),
    ],
)
def test_values_refuse_what_cannot_exist(make):
    with pytest.raises(RecordingError):
        make()


def test_a_subset_keeps_the_order_asked_for():
    pushes = [Push(name=name, object=still([0.0, 1.0]), hand=None, force=None) for name in "abc"]
    recording = recording_of(*pushes)
    assert [p.name for p in recording.subset(["c", 0, -2]).pushes] == ["c", "a", "b"]
    for wrong in (["d"], [3], [], ["a", 0]):
        with pytest.raises(RecordingError):
            recording.subset(wrong)


def test_a_hand_is_described_if_and_only_if_it_is_recorded():
    push = Push(name="a", object=still([0.0, 1.0]), hand=None, force=None)
    with pytest.raises(RecordingError, match="no hand path"):
        recording_of(push, hand=Hand(tip="reflex_sf"))
