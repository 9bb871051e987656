"""What of a recording hardly fits its description is said, and a force that brakes is refused."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from runs import shipped_pushes

from physid_drake.errors import RecordingError
from physid_drake.identify.doubts import doubts
from physid_drake.identify.frames import check_force_direction, refusals
from physid_drake.identify.identify import Estimate
from physid_drake.recording import ForceStream, PoseStream
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


def test_a_quaternion_whose_w_comes_last_is_doubted(recording):
    def ros(stream):
        return PoseStream(
            times=stream.times, positions=stream.positions, quaternions=np.roll(stream.quaternions, -1, axis=1)
        )

    (said,) = doubts(with_objects(recording, ros))[:1]
    assert "in the order w, x, y, z" in said


@pytest.mark.parametrize(("radius", "said"), [(2.0, "inside the object"), (0.1, "away from the object")])
def test_a_tip_that_is_not_where_it_touches_is_doubted(recording, radius, said):
    """A diameter for a radius, say."""
    hand = replace(recording.hand, radius=radius * recording.hand.radius)
    (doubt,) = doubts(replace(recording, hand=hand))
    assert said in doubt and any(depth in doubt for depth in ("9 mm", "10 mm"))


def test_a_force_on_the_sensor_instead_of_the_object_is_refused(recording):
    check_force_direction(with_forces(recording, 1.0))
    wrong = with_forces(recording, -1.0)
    with pytest.raises(RecordingError, match="force of the hand on the object"):
        check_force_direction(wrong)
    assert any("force of the hand on the object" in said for said in refusals(wrong))
    check_force_direction(replace(wrong, pushes=wrong.pushes[:2]))  # two pushes tell no rule


def test_an_estimate_at_its_bound_is_said_to_be():
    estimate = Estimate(
        name="support_friction", unit="-", value=1.2, ci90=(0.9, 1.2), identifiable=True, prior=0.3, at_bound=True
    )
    others = replace(estimate, at_bound=False), replace(estimate, identifiable=False)
    first, second, third = estimates_table(SimpleNamespace(estimates=(estimate, *others)), "made").columns[3].cells
    assert first.startswith("at its bound") and second == "yes" and third.startswith("no")


def test_pushes_that_fit_by_frictions_alone_are_not_said_to_be_explained():
    told = SimpleNamespace(reduced_chi2=1.1, explains=False, polished=SimpleNamespace(friction_scatter=0.14))
    assert "frictions that differ by 14 %" in verdict(told)
    told.explains = True
    assert verdict(told).startswith("The plain cell explains")
