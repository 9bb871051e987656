"""Which part of a hand's stream is the push."""

from dataclasses import replace

import numpy as np
import pytest
from problems import QUIET, ends, first, with_pushes
from runs import shipped_pushes

from physid_drake.errors import RecordingError
from physid_drake.pushes.hand_stream import touching_radius, while_pushing
from physid_drake.pushes.nuisance import nuisance_of
from physid_drake.pushes.problem import problems_of
from physid_drake.recording import Box, Cylinder, Hand, ObjectModel, PoseStream, Push


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(3)


@pytest.mark.parametrize("z", [0.2, 0.0351, -0.02])
def test_a_hand_that_passes_the_object_is_refused(recording, z):
    changed = with_pushes(
        recording, lambda p: replace(p, hand=replace(p.hand, positions=p.hand.positions * [1, 1, 0] + [0, 0, z]))
    )
    with pytest.raises(RecordingError, match=r"push 'pushes/001.csv': the hand at z = .* passes the object"):
        first(changed)


def test_a_hand_that_lifts_off_and_goes_back_above_the_object_pushes_as_if_it_had_stayed(recording):
    def lift(push):
        s, count = push.hand, 40
        times = s.times[-1] + 0.01 * np.arange(1, count + 1)
        back = s.positions[-1] + np.linspace(0.0, 1.0, count)[:, None] * (s.positions[0] - s.positions[-1])
        up = PoseStream(times=np.concatenate([s.times, times]),
                        positions=np.vstack([s.positions, back * [1, 1, 0] + [0, 0, 0.2]]),
                        quaternions=np.vstack([s.quaternions, s.quaternions[-1:].repeat(count, axis=0)]))  # fmt: skip
        return replace(push, hand=up)

    plain, lifted = first(recording), first(with_pushes(recording, lift))
    times = np.linspace(plain.begin, lifted.end, 50)
    assert lifted.end > plain.end and lifted.hand_height == plain.hand_height
    assert np.array_equal(lifted.path.positions(times), plain.path.positions(times))


@pytest.mark.parametrize(
    ("tip", "over", "share"),
    [("sphere", 0.4, 0.84), ("sphere", -0.3, 1.0), ("capsule", 0.4, 0.84), ("cylinder", 0.4, 1.0)],
)
def test_a_round_tip_above_an_edge_touches_it_nearer_to_its_axis(recording, tip, over, share):
    """With the circle that a plane at the height of the edge cuts out of a sphere."""
    height, radius = 0.02, 0.01
    length = None if tip == "sphere" else 0.03
    reach = 0.5 * length if length else 0.0
    z = height + reach + over * radius
    low = with_pushes(
        recording, lambda p: replace(p, hand=replace(p.hand, positions=p.hand.positions * [1, 1, 0] + [0, 0, z]))
    )
    hand = Hand(tip=tip, radius=radius, length=length, stream="measured")
    assert touching_radius(replace(low, hand=hand), height) == pytest.approx(radius * np.sqrt(share))


@pytest.mark.parametrize("off", [-0.012, 0.0, 0.012])
def test_a_round_tip_beside_a_lying_cylinder_touches_it_nearer_to_its_axis(recording, off):
    """With the distance in plan of two spheres that touch, whose middles are at different heights."""
    radius, tip = 0.033, 0.01
    beside = with_pushes(
        recording,
        lambda p: replace(p, hand=replace(p.hand, positions=p.hand.positions * [1, 1, 0] + [0, 0, radius + off])),
    )
    rolls = replace(
        beside, hand=Hand(tip="sphere", radius=tip, stream="measured"),
        object=replace(recording.object, shape=Cylinder(radius=radius, length=0.1, axis="y")),
    )  # fmt: skip
    assert touching_radius(rolls, 2.0 * radius) + radius == pytest.approx(np.sqrt((radius + tip) ** 2 - off**2))


def test_a_tip_high_on_a_wide_lying_cylinder_keeps_some_width(recording):
    """Its axis is within the outline."""
    high = with_pushes(
        recording, lambda p: replace(p, hand=replace(p.hand, positions=p.hand.positions * [1, 1, 0] + [0, 0, 0.0616]))
    )
    rolls = replace(
        high, hand=Hand(tip="sphere", radius=0.005, stream="measured"),
        object=replace(recording.object, shape=Cylinder(radius=0.04, length=0.1, axis="y")),
    )  # fmt: skip
    assert touching_radius(rolls, 0.08) == pytest.approx(5e-4)


def lifted(push, when):
    """The push with its hand 0.2 m higher where ``when`` of its times (n,) [s] says."""
    up = np.where(when(push.hand.times - push.hand.times[0]), 0.2, 0.0)
    return replace(push, hand=replace(push.hand, positions=push.hand.positions + np.outer(up, [0, 0, 1])))


def test_a_hand_whose_height_is_wrong_for_a_moment_is_where_it_is(recording):
    blinking = with_pushes(recording, lambda p: lifted(p, lambda t: (t > 0.25) & (t < 0.28)))
    plain, seen = first(recording), first(blinking)
    assert np.array_equal(plain.path.positions(plain.times), seen.path.positions(plain.times))


def test_a_hand_that_pushes_twice_is_taken_whole(recording):
    twice = with_pushes(recording, lambda p: lifted(p, lambda t: (t > 0.35) & (t < 0.5)))
    plain, seen = first(recording), first(twice)
    assert np.array_equal(plain.path.positions(plain.times), seen.path.positions(plain.times))


def there_and_back(noise):
    """A box of 0.1 m, 0.05 m high, pushed along x, and pushed back from the other side; the tip passes over it."""
    times = np.arange(0.0, 8.0, 0.01)
    knots = [0.0, 0.5, 2.5, 2.8, 3.2, 3.7, 4.1, 4.5, 6.5, 8.0]
    x = np.interp(times, knots, [-0.1, -0.1, 0.0, 0.0, 0.0, 0.21, 0.21, 0.21, 0.06, 0.06])
    z = np.interp(times, knots, [0.025] * 4 + [0.1] * 2 + [0.025] * 4)
    there = np.interp(times, [1.3, 2.5, 4.6, 6.5], [0.0, 0.06, 0.06, 0.0])
    places = np.column_stack([there, 0.0 * times, 0.025 + 0.0 * times])
    places[:, :2] += noise * np.random.default_rng(0).standard_normal((len(times), 2))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))
    box = PoseStream(times=times, positions=places, quaternions=still)
    tip = PoseStream(times=times, positions=np.column_stack([x, 0.0 * x, z]), quaternions=still)
    return Push(name="both ways", object=box, hand=tip, force=None)


@pytest.mark.parametrize("noise", [1e-4, 1e-3])
def test_a_hand_that_passes_over_the_object_between_two_pushes_is_refused(recording, noise):
    """Taken whole, its path would push the object on its way back."""
    both = replace(
        recording, pushes=(there_and_back(noise),), hand=Hand(tip="sphere", radius=0.01),
        object=ObjectModel(shape=Box(size=(0.1, 0.1, 0.05))),
    )  # fmt: skip
    with pytest.raises(RecordingError, match="record each as a push of its own"):
        problems_of(both, replace(QUIET, position=noise), 0.05)


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 2e-3])
def test_a_loud_tracker_does_not_hide_where_the_hand_lifts_off(recording, noise):
    def loud(push):
        s = lifted(push, lambda times: times > 0.8 * times[-1]).hand
        shaken = push.object.positions + noise * np.random.default_rng(0).standard_normal((len(push.object), 3))
        return replace(push, hand=s, object=replace(push.object, positions=shaken))

    cut = problems_of(with_pushes(recording, loud), replace(QUIET, position=noise), 0.03)[0]
    assert cut.path.times[-1] < recording.pushes[0].hand.times[-1] - 0.1


@pytest.mark.parametrize("low", [0.005, 0.04], ids=["one sample", "some samples"])
def test_a_hand_that_is_beside_the_object_before_the_push_only_is_refused(recording, low):
    with pytest.raises(RecordingError, match="passes the object"):
        first(with_pushes(recording, lambda p: lifted(p, lambda t: t > low)))


def test_a_hand_that_lifts_off_is_cut_where_only_the_ends_are_known_too(recording):
    def lift(push):
        return ends(lifted(push, lambda times: times > 0.8 * times[-1]))

    pushed = recording.pushes[0].hand
    cut, whole = first(with_pushes(recording, lift)), first(with_pushes(recording, ends))
    assert cut.path.knot_positions()[-1] @ [1.0, 0.0] < pushed.positions[:, 0].max() + 1e-3
    assert cut.hand_height == whole.hand_height


def visit(*, stands=0.5, halts=0.0, speed=0.02, travel=0.2):
    """A box that lies at 0 to 3 s and later, and a hand that comes, stands, pushes, stands and withdraws.

    Args:
        stands: for how long before the push, and after it [s].
        halts: for how long half way through the push [s].
        speed: of the push [m/s]; the hand comes and withdraws at 0.25 m/s.
        travel: how far it comes and withdraws [m].

    Returns:
        The push, and when its hand leaves the two standstills.
    """
    half, fast = 0.02 / speed, travel / 0.25
    lasts = [0.5, fast, stands, half, halts, half, stands, fast, 0.5]
    ways = [0.0, travel, 0.0, 0.02, 0.0, 0.02, 0.0, -travel, 0.0]
    ends = np.cumsum(lasts)
    times = np.arange(0.0, ends[-1], 0.005)
    hand = np.interp(times, np.r_[0.0, ends], np.cumsum([-0.05 - travel, *ways]))
    rng = np.random.default_rng(0)
    pushed = np.interp(times, ends[2:6], [0.0, 0.02, 0.02, 0.04])
    still = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))

    def stream(x, noise):
        places = np.column_stack([x, 0.0 * x, 0.025 + 0.0 * x])
        places[:, :2] += noise * rng.standard_normal((len(x), 2))
        return PoseStream(times=times, positions=places, quaternions=still)

    return Push(name="visit", object=stream(pushed, 2e-4), hand=stream(hand, 5e-5), force=None), ends[2], ends[6]


@pytest.mark.parametrize("halts", [0.0, 0.8])
@pytest.mark.parametrize("speed", [0.01, 0.05, 0.2])
def test_a_hand_that_comes_stands_pushes_and_withdraws_counts_from_stand_to_stand(speed, halts):
    push, begin, end = visit(speed=speed, halts=halts)
    part = while_pushing(push, push.hand)
    assert begin - 0.5 - 0.05 < part.times[0] < begin - 0.2
    assert end - 0.3 < part.times[-1] < end + 0.05
    kept = (push.hand.times >= part.times[0]) & (push.hand.times <= part.times[-1])
    np.testing.assert_array_equal(part.positions, push.hand.positions[kept])


@pytest.mark.parametrize("halts", [0.0, 0.8])
def test_a_hand_that_does_not_stand_before_or_after_a_push_counts_whole(halts):
    push, *_ = visit(stands=0.0, halts=halts)
    assert while_pushing(push, push.hand) is push.hand or len(while_pushing(push, push.hand)) == len(push.hand)


def test_where_only_the_ends_are_known_a_hand_counts_whole():
    push, *_ = visit()
    assert len(while_pushing(ends(push), push.hand)) == len(push.hand)


@pytest.mark.slow
@pytest.mark.parametrize("stands", [0.1, 0.5])
@pytest.mark.parametrize("travel", [0.002, 0.2])
def test_the_brake_that_may_vary_is_the_one_that_lets_the_object_go(recording, travel, stands):
    """Neither that of a faster hand that comes, nor that of one that withdraws, however shortly it stands between."""
    push, *_ = visit(travel=travel, stands=stands)
    shape = replace(recording, object=ObjectModel(shape=Box(size=(0.08, 0.08, 0.05))),
                    hand=Hand(tip="sphere", radius=0.01))  # fmt: skip
    problem = first(replace(shape, pushes=(push,)), height=0.05)
    stop = 0.5 + travel / 0.25 + stands + 0.04 / 0.02
    begins, _ = problem.path.last_brake(*problem.moving)
    assert problem.path.times[begins] == pytest.approx(stop, abs=0.06)
    assert nuisance_of(problem, 0.02).index("brake") >= 0
    brake = problem.path.last_brake(*problem.moving)
    longer, shorter = (problem.path.braking(share, brake).positions(problem.times) for share in (0.5, -0.5))
    moved = np.linalg.norm(longer - shorter, axis=1)
    assert abs(problem.times[np.argmax(moved)] - stop) < 0.15
