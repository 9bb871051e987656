"""What of a recording hardly fits its description is said, and a force that brakes is refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from problems import QUIET
from runs import shipped_pushes
from scipy.spatial.transform import Rotation

from physid_drake.errors import RecordingError
from physid_drake.identify.identify import Estimate
from physid_drake.pushes.frame_checks import _brakes_hardly_seen, check_force_direction
from physid_drake.pushes.problem import problems_of
from physid_drake.pushes.push_checks import refusals
from physid_drake.pushes.push_warnings import doubts
from physid_drake.recording import ForceStream, MeshShape, PoseStream
from physid_drake.report.tables import estimates_table, verdict


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(6)


def with_objects(recording, change):
    return replace(recording, pushes=tuple(replace(p, object=change(p.object)) for p in recording.pushes))


def with_forces(recording, sign):
    def forced(push):
        times = push.object.times
        velocities = np.gradient(push.object.positions, times, axis=0)
        return replace(push, force=ForceStream(times=times, forces=sign * velocities))

    return replace(recording, pushes=tuple(forced(p) for p in recording.pushes))


def test_a_recording_that_fits_its_description_leaves_no_doubt(recording):
    assert doubts(recording) == ()


def test_an_object_that_leans_by_every_reading_is_doubted(recording):
    def rocked(stream):
        lean = Rotation.from_rotvec(np.outer(np.radians(20.0) * np.sin(5.0 * stream.times), [0.6, 0.8, 0.0]))
        turned = lean * Rotation.from_quat(np.roll(stream.quaternions, -1, axis=1))
        return replace(stream, quaternions=np.roll(turned.as_quat(), 1, axis=1))

    said = doubts(with_objects(recording, rocked))
    assert any("lean changes by more than 8 degrees" in one and "in the order that was said" in one for one in said)


@pytest.mark.parametrize(("radius", "said"), [(2.0, "inside the object"), (0.1, "away from the object")])
def test_a_tip_that_is_not_where_it_touches_is_doubted(recording, radius, said):
    """A diameter for a radius, say."""
    hand = replace(recording.hand, radius=radius * recording.hand.radius)
    (doubt,) = doubts(replace(recording, hand=hand))
    assert said in doubt and any(depth in doubt for depth in ("9 mm", "10 mm"))


@pytest.mark.parametrize(("offset", "said"), [(0.02, "the object's frame is turned or off its place"), (2e-3, None)])
def test_a_frame_that_is_off_its_place_in_the_object_is_doubted(offset, said):
    """Pushes from both sides: the tip is inside from one, and away from the other."""
    both = shipped_pushes(12)
    across = np.array([0.0, offset, 0.0])

    def moved(stream):
        return replace(
            stream,
            positions=stream.positions + Rotation.from_quat(stream.quaternions, scalar_first=True).apply(across),
        )

    found = [doubt for doubt in doubts(with_objects(both, moved)) if "hand's tip" in doubt]
    assert found == [] if said is None else said in found[0]


def test_a_tip_that_hits_an_object_and_stays_behind_is_where_it_touched(recording):
    """The object is 10 mm away as its motion is sure."""

    def hit(push):
        touched = np.linalg.norm(push.object.positions - push.object.positions[0], axis=1) > 2e-3
        when = push.object.times[int(np.argmax(touched))]
        stays = push.hand.positions[int(np.searchsorted(push.hand.times, when))]
        positions = np.where((push.hand.times > when)[:, None], stays, push.hand.positions)
        return replace(push, hand=replace(push.hand, positions=positions))

    assert doubts(replace(recording, pushes=tuple(hit(p) for p in recording.pushes))) == ()


def test_an_object_that_is_carried_is_doubted(recording):
    def carried(push):
        up = np.clip(push.object.times - push.object.times[-1] + 0.1, 0.0, None)
        return replace(push.object, positions=push.object.positions + np.outer(up, [0.0, 0.0, 1.0]))

    pushes = (replace(recording.pushes[0], object=carried(recording.pushes[0])), *recording.pushes[1:])
    (doubt,) = doubts(replace(recording, pushes=pushes))
    assert "height changes by more than 8 mm" in doubt and doubt.endswith(pushes[0].name)


@pytest.mark.parametrize(("every", "said"), [(5, False), (10, True), (20, True)])
def test_a_hand_that_is_seen_too_seldom_is_doubted(recording, every, said):
    """Of 100 Hz."""
    seldom = replace(recording, pushes=tuple(replace(p, hand=thinned(p.hand, every)) for p in recording.pushes))
    assert any("the hand is sampled less often than every 0.09 s" in doubt for doubt in doubts(seldom)) == said


def test_poses_after_a_brake_that_is_hardly_seen_are_not_compared(recording):
    seldom = replace(recording, pushes=tuple(replace(p, hand=thinned(p.hand, 10)) for p in recording.pushes))
    for push, full, thin in zip(recording.pushes, problems(recording), problems(seldom), strict=True):
        begin, end = full.path.last_brake(*full.moving)
        assert push.object.times[-1] > full.path.times[end]
        assert full.path.times[begin] - 0.21 < thin.times[-1] < full.path.times[end]


@pytest.mark.parametrize("gap", [0.12, 0.2])
def test_a_gap_of_a_fast_stream_that_goes_on_is_no_brake(recording, gap):
    """The differences of neighbours are noise there."""
    rng = np.random.default_rng(2)
    times = 0.01 * np.arange(100)
    found = 0
    for _ in range(50):
        places = np.column_stack([0.1 * times, 0.0 * times, 0.0 * times]) + 3e-4 * rng.standard_normal((100, 3))
        kept = (times < 0.4) | (times >= 0.4 + gap)
        turns = np.tile([1.0, 0.0, 0.0, 0.0], (int(kept.sum()), 1))
        found += len(_brakes_hardly_seen(PoseStream(times=times[kept], positions=places[kept], quaternions=turns)))
    assert found == 0


def thinned(stream, every):
    return PoseStream(
        times=stream.times[::every], positions=stream.positions[::every], quaternions=stream.quaternions[::every]
    )


def problems(recording):
    return problems_of(recording, QUIET, 0.03)


def test_a_force_on_the_sensor_instead_of_the_object_is_refused(recording):
    check_force_direction(with_forces(recording, 1.0))
    wrong = with_forces(recording, -1.0)
    with pytest.raises(RecordingError, match="force of the hand on the object"):
        check_force_direction(wrong)
    assert any("force of the hand on the object" in said for said in refusals(wrong))
    check_force_direction(replace(wrong, pushes=wrong.pushes[:2]))  # two pushes tell no rule


def test_forces_that_are_too_seldom_to_be_used_are_said(recording):
    def forced(interval):
        first, *others = recording.pushes
        times = np.arange(first.object.times[0], first.object.times[-1], interval)
        force = ForceStream(times=times, forces=np.outer(times > times.mean(), [1.0, 0.0, 0.0]))
        return replace(recording, pushes=(replace(first, force=force), *others))

    assert doubts(forced(0.04)) == ()
    (said,) = doubts(forced(0.11))
    assert recording.pushes[0].name in said and "not used" in said


def test_inspect_says_every_hand_that_passes_over_its_object(recording):
    def lifted(push):
        hand = push.hand
        above = hand.positions + np.array([0.0, 0.0, 0.5])
        return replace(push, hand=PoseStream(times=hand.times, positions=above, quaternions=hand.quaternions))

    first, second, *others = recording.pushes
    wrong = replace(recording, pushes=(lifted(first), lifted(second), *others))
    said = refusals(wrong)
    assert [line.split("'")[1] for line in said] == [first.name, second.name]
    assert all("passes the object" in line for line in said)
    with pytest.raises(RecordingError, match="passes the object"):
        problems_of(wrong, QUIET, 0.03)


def test_inspect_says_every_free_motion_with_too_few_poses(recording):
    def free(push, count):
        part = (values[:count] for values in (push.object.times, push.object.positions, push.object.quaternions))
        times, positions, quaternions = part
        return replace(push, hand=None, object=PoseStream(times=times, positions=positions, quaternions=quaternions))

    wrong = replace(recording, hand=None, pushes=tuple(free(p, 2 + k // 4) for k, p in enumerate(recording.pushes)))
    said = refusals(wrong)
    assert len(said) == 4 and all("at least 3 poses" in line for line in said)
    with pytest.raises(RecordingError, match="at least 3 poses"):
        problems_of(wrong, QUIET, 0.03)


def test_an_estimate_at_its_bound_is_said_to_be():
    estimate = Estimate(
        name="support_friction", unit="-", value=1.2, ci90=(0.9, 1.2), identifiable=True, prior=0.3, at_bound=True
    )
    others = replace(estimate, at_bound=False), replace(estimate, identifiable=False)
    first, second, third = estimates_table(SimpleNamespace(estimates=(estimate, *others)), "made").columns[3].cells
    assert first.startswith("yes, at its bound") and second == "yes" and third.startswith("no")


def test_pushes_that_fit_by_frictions_alone_are_not_said_to_be_explained():
    told = SimpleNamespace(reduced_chi2=1.1, explains=False, friction_scatter=0.14)
    assert "friction scatter between pushes of 14 %" in verdict(told)
    told.explains = True
    assert verdict(told).startswith("The baseline model explains")


def _boxes_obj(*boxes):
    """Boxes (x0, y0, x1, y1), 30 mm high, as one OBJ file in m, every face wound outwards."""
    vertices, faces = [], []
    for x0, y0, x1, y1 in boxes:
        n = len(vertices)
        vertices += [(x, y, z) for z in (0.0, 0.03) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        quads = ((4, 3, 2, 1), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8))
        faces += [[n + k for k in quad] for quad in quads]
    rows = [f"v {x} {y} {z}" for x, y, z in vertices] + ["f " + " ".join(map(str, face)) for face in faces]
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize(
    ("boxes", "said"),
    [(((-0.05, -0.02, 0.05, 0.02),), []), (((-0.05, 0.0, 0.05, 0.02), (-0.01, -0.06, 0.01, 0.0)), ["fills 57 %"])],
)
def test_a_mesh_with_notches(boxes, said, recording, tmp_path):
    (tmp_path / "object.obj").write_text(_boxes_obj(*boxes))
    shape = MeshShape(file=tmp_path / "object.obj")
    meshed = replace(recording, object=replace(recording.object, shape=shape))
    found = [line for line in doubts(meshed) if "convex hull" in line]
    assert len(found) == len(said) and all(part in line for part, line in zip(said, found, strict=True))
