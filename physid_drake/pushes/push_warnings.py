"""What of a recording hardly fits its description: no reason to refuse it, but one to look again."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial import ConvexHull

from physid_drake.cell.solid import solid_of
from physid_drake.pushes.force_windows import WINDOW, too_seldom
from physid_drake.pushes.frame_checks import AT_A_TIME, SELDOM, UNSEEN_WAY, depths_at_touch, moved_by_nothing, moves
from physid_drake.pushes.hand_stream import touching_radius
from physid_drake.pushes.plausible import implausible, some_names
from physid_drake.pushes.standing import LEANS, RISES, misread, standing_of
from physid_drake.pushes.stated import too_loud
from physid_drake.pushes.tracker_noise import tracker_noise
from physid_drake.recording import Cylinder, MeshShape, Push, Recording
from physid_drake.recording.mesh_outline import prism_outline
from physid_drake.recording.obj import read_obj

FILLS = 0.95  # of its convex hull: a mesh that fills less has notches, or a hole
BESIDE = 3e-3  # m between tip and face as objects begin to move: 1 mm at most where description and frames agree


def doubts(recording: Recording) -> tuple[str, ...]:
    """What to look at again, in words; nothing else where what is up is not."""
    odd = misread(recording)
    if odd:  # refused, where the object tips
        return () if standing_of(recording).tipped else (odd,)
    return (
        *_leaning(recording),
        *_rising(recording),
        *_beside_the_tip(recording),
        *_sparse_forces(recording),
        *_hand_seldom_seen(recording),
        *_moved_by_nothing(recording),
        *_notched_mesh(recording),
        *implausible(recording),
        *too_loud(recording),
    )


def _leaning(recording: Recording) -> tuple[str, ...]:
    """Objects that lean this way and that: a quaternion whose w comes last turns a heading into a lean."""
    shape = recording.object.shape
    if isinstance(shape, Cylinder) and shape.axis == "y":
        return ()
    names = [push.name for push in recording.pushes if _lean_changes(push) > LEANS]
    if not names:
        return ()
    return (
        f"the object's lean changes by more than {LEANS:.0f} degrees while it is on the table; are its quaternions in"
        f" the order that was said, and is z of W the table's normal? {some_names(names)}",
    )


def _rising(recording: Recording) -> tuple[str, ...]:
    """Objects that are lifted, carried or thrown, or frames whose z is not the table's normal."""
    names = [push.name for push in recording.pushes if _height_change(push) > RISES]
    if not names:
        return ()
    return (
        f"the object's height changes by more than {1e3 * RISES:.0f} mm; is it on the table all the time, and is z of"
        f" W the table's normal? {some_names(names)}",
    )


def _notched_mesh(recording: Recording) -> tuple[str, ...]:
    """A mesh that does not fill its convex hull: a tip may reach into what the hull covers."""
    shape = recording.object.shape
    if not isinstance(shape, MeshShape):
        return ()
    mesh = read_obj(shape.file)
    if prism_outline(mesh, shape.scale) is not None:
        return ()
    corners = mesh.vertices[mesh.triangles][:, :, :2]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # What overhangs counts twice: the true share is no larger.
    facing_up = 0.5 * np.maximum(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0], 0.0).sum()
    share = facing_up / ConvexHull(mesh.vertices[:, :2]).volume
    if not 0.0 < share < FILLS:
        return ()
    return (
        f"seen from above, the object's mesh fills {100.0 * share:.0f} % of its convex hull, which is what counts:"
        " give its outline as a prism, or convert with a map whose object is the mesh",
    )


def _height_change(push: Push) -> float:
    """By how much the object's height changes [m], but for a few samples."""
    return float(np.ptp(median_filter(push.object.positions[:, 2], AT_A_TIME, mode="reflect")))


def _sparse_forces(recording: Recording) -> tuple[str, ...]:
    """Forces of which nothing is compared."""
    names = [push.name for push in recording.pushes if too_seldom(push)]
    if not names:
        return ()
    return (
        f"forces are compared as means over {WINDOW:g} s, but no such window has two samples: {some_names(names)};"
        " these forces are not used",
    )


def _hand_seldom_seen(recording: Recording) -> tuple[str, ...]:
    """Hands that go far from sample to sample: nobody knows when they touch the object and when they brake."""
    names = [push.name for push in recording.pushes if not push.endpoint_only and _goes_unseen(push)]
    if not names:
        return ()
    return (
        f"the hand is sampled less often than every {SELDOM:g} s and moves more than {1e3 * UNSEEN_WAY:.0f} mm in"
        f" between: {some_names(names)}; the times of contact and of braking are uncertain; record it at 100 Hz",
    )


def _moved_by_nothing(recording: Recording) -> tuple[str, ...]:
    """Objects that set out by themselves in some pushes; where they do in all, that is refused."""
    if all(push.hand is not None for push in recording.pushes):
        return ()
    names = moved_by_nothing(recording, tracker_noise(recording)[0].position)
    if not names or len(names) == sum(map(moves, recording.pushes)):
        return ()
    return (
        f"some pushes have no hand, but their object starts from rest and moves: {some_names(names)}; is the hand's"
        " stream missing, or read as another push?",
    )


def _goes_unseen(push: Push) -> bool:
    if push.hand is None:
        return False
    intervals, steps = np.diff(push.hand.times), np.diff(push.hand.positions[:, :2], axis=0)
    seldom = float(np.median(intervals)) > SELDOM
    return seldom and float(np.linalg.norm(steps, axis=1).max()) > UNSEEN_WAY


def _lean_changes(push: Push) -> float:
    """By how many degrees the object's lean changes, but for a few samples."""
    _, x, y, _ = push.object.quaternions.T
    leans = np.degrees(np.arccos(np.clip(np.abs(1.0 - 2.0 * (x * x + y * y)), 0.0, 1.0)))
    low, high = np.quantile(leans, [0.05, 0.95]).tolist()
    return float(high - low)


def _beside_the_tip(recording: Recording) -> tuple[str, ...]:
    """A tip that is not at the face of the objects that it sets moving, by as much in most pushes.

    Of a frame that is off its place, it is inside from one side and away from the other.
    """
    depths = np.array(depths_at_touch(recording))
    if recording.hand is not None:
        wide = touching_radius(recording, solid_of(recording.object.shape).height)
        depths -= recording.hand.radius - wide
    if not len(depths) or float(np.median(np.abs(depths))) <= BESIDE:
        return ()
    middle, usual = float(np.median(depths)), float(np.median(np.abs(depths)))
    if abs(middle) <= BESIDE:
        return (
            f"as objects begin to move, the hand's tip is {1e3 * usual:.0f} mm inside some and away from others"
            " (median); the object's frame is turned or off its place in it, or its size along x or y is not as"
            " stated",
        )
    where = "inside the object" if middle > 0.0 else "away from the object"
    return (
        f"as objects begin to move, the hand's tip is {1e3 * abs(middle):.0f} mm {where} (median);"
        " its radius, the object's size or a frame is not as stated, or the tip lags or is compliant",
    )
