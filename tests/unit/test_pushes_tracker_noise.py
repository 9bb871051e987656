"""Noise of the tracker as seen at rest, and the windows that pushes are compared in."""

import dataclasses as dc
import math
from types import SimpleNamespace

import numpy as np
import pytest
from recovery.worlds import POSITION_STD, endpoints, pushes_of, recorded
from reference.scenes import OBJECTS, Theta

from physid_drake.diagnose.decide import most_noise_scale
from physid_drake.pushes import tracker_noise as noise_module
from physid_drake.pushes.features import features_of
from physid_drake.pushes.problem import problems_of
from physid_drake.pushes.tracker_noise import _jitter, _roughness, tracker_noise
from physid_drake.recording import PoseStream, Push, rest_segments
from physid_drake.recording.rest_noise import SeenNoise, seen_noise

RNG = np.random.default_rng(7)

ERASER = OBJECTS["eraser"]


def rests(rng, count, length, rho, sigma=2.0):
    """Rests of first-order autoregressive noise about means of their own, at 100 Hz."""
    pieces = []
    for _ in range(count):
        noise = np.empty(length)
        noise[0] = rng.standard_normal()
        for k in range(1, length):
            noise[k] = rho * noise[k - 1] + np.sqrt(1 - rho**2) * rng.standard_normal()
        pieces.append((0.01 * np.arange(length), 5.0 * rng.standard_normal() + sigma * noise))
    return pieces


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.85])
def test_short_rests_tell_a_slow_noise(rho):
    seen = seen_noise(rests(np.random.default_rng(1), 40, 20, rho), 1e-5)
    assert seen.std == pytest.approx(2.0, rel=0.1 if rho > 0.8 else 0.05)
    found = np.exp(-0.01 / seen.correlation_time) if seen.correlation_time > 0.0 else 0.0
    assert found == pytest.approx(rho, abs=0.05)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.82])
def test_how_large_a_noise_is_is_known_as_well_as_is_said(rho):
    rng = np.random.default_rng(4)
    every = [seen_noise(rests(rng, 20, 25, rho), 1e-5) for _ in range(40)]
    off = np.array([2.0 * np.log(seen.std / 2.0) for seen in every])
    doubts = np.array([seen.doubt for seen in every])
    assert abs(off.mean()) < 0.08  # of the variance
    assert np.mean((off / doubts) ** 2) == pytest.approx(1.0, abs=0.4)
    assert doubts.mean() == pytest.approx({0.0: 0.06, 0.5: 0.09, 0.82: 0.2}[rho], rel=0.2)


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.8])
def test_noise_that_one_short_rest_tells_is_called_a_mismatch_as_seldom_as_is_said(rho):
    """Fourteen samples of x and y; what is judged has 88 numbers of the same noise."""
    rng, called = np.random.default_rng(4), []
    for _ in range(300):
        seen = seen_noise([*rests(rng, 2, 14, rho)], 1e-3)
        noise_scale = float(np.sqrt(np.mean((2.0 / seen.std * rng.standard_normal(88)) ** 2)))
        called.append(noise_scale > most_noise_scale(SimpleNamespace(known=True, doubt=seen.doubt)))
    assert np.mean(called) <= 0.02


@pytest.mark.parametrize("gap", [1e-6, 1e-4, 2e-3])
@pytest.mark.parametrize("every", [1, 10])
def test_white_noise_of_samples_that_come_in_pairs_is_as_loud_as_it_is(gap, every):
    """Stamped a microsecond apart, it was said to be 30 times as loud."""
    rng = np.random.default_rng(4)
    even = 0.01 * np.arange(60)
    times = np.sort(np.append(even, even[::every] + gap))
    seen = seen_noise([(times, 2.0 * rng.standard_normal(len(times))) for _ in range(20)], 1e-5)
    assert seen.std == pytest.approx(2.0, rel=0.05)


def test_pairs_of_samples_are_compared_as_independently_as_others(recording):
    noise = dc.replace(tracker_noise(recording)[0], correlation_time=(0.005, 0.005))
    even = 0.01 * np.arange(20)
    pairs = np.sort(np.append(even, even + 1e-5))
    np.testing.assert_array_equal(noise.correlation(even, 0)[0, :2], [1.0, np.exp(-2.0)])
    assert np.linalg.cond(noise.correlation(pairs, 0)) < 20.0


def test_a_stream_that_stands_still_at_rest_tells_no_noise():
    still = [(t, 0.0 * v + 0.3) for t, v in rests(np.random.default_rng(1), 10, 20, 0.0)]
    assert seen_noise(still, 1e-5) is None
    faint = [(t, 2e-6 * v) for t, v in rests(np.random.default_rng(1), 10, 20, 0.0, sigma=1.0)]
    assert seen_noise(faint, 1e-5).std == 1e-5


@pytest.fixture(scope="module")
def recording():
    return recorded(ERASER, Theta(), pushes_of(ERASER, 4, 3), 5)


def test_a_stated_noise_is_taken_where_it_is_seen(recording):
    noise, plain = tracker_noise(recording)
    assert noise.stated and noise.position == POSITION_STD == plain.position and noise.doubt == 0.0


def test_a_stated_noise_that_the_rests_contradict_is_not_believed(recording):
    wrong = dc.replace(recording, sensors=dc.replace(recording.sensors, object_position_std=POSITION_STD / 5))
    noise, _ = tracker_noise(wrong)
    assert noise.position == pytest.approx(POSITION_STD, rel=0.15) and 0.0 < noise.doubt < 0.2
    assert "position" in noise.warnings[0]


@pytest.mark.parametrize(("share", "believed"), [(1.0, True), (0.9, True), (0.75, False), (0.65, False)])
def test_what_is_believed_of_a_stated_noise_depends_on_how_surely_rests_are_louder(share, believed):
    """A fixed factor of 1.5 believed 1.45 times as much, whose square is all that a cost can tell."""
    push = recorded(ERASER, Theta(), pushes_of(ERASER, 1, 3), 5)
    many = dc.replace(push, pushes=tuple(resting(push.pushes[0], k) for k in range(8)),
                      sensors=dc.replace(push.sensors, object_position_std=share * POSITION_STD))  # fmt: skip
    noise, _ = tracker_noise(many)
    assert noise.stated is believed and (noise.doubt == 0.0) is believed
    assert noise.position == pytest.approx(share * POSITION_STD if believed else POSITION_STD, rel=0.1)
    few, _ = tracker_noise(dc.replace(many, pushes=(short_rest(many.pushes[0]),)))
    assert few.stated and few.position == share * POSITION_STD  # so few samples cannot be sure


def resting(push, seed):
    """A push whose object stands still for 200 samples, with the noise that is stated."""
    rng = np.random.default_rng(seed)
    noise = POSITION_STD * rng.standard_normal((200, 3))
    times = 0.01 * np.arange(200)
    quaternions = np.repeat(push.object.quaternions[:1], 200, axis=0)
    still = dc.replace(push.object, times=times, positions=push.object.positions[0] + noise, quaternions=quaternions)
    return dc.replace(push, name=f"pushes/{seed}.csv", object=still)


def short_rest(push):
    some = push.object
    return dc.replace(
        push,
        object=dc.replace(
            some, times=some.times[:12], positions=some.positions[:12], quaternions=some.quaternions[:12]
        ),
    )


def test_rests_far_quieter_than_stated_are_said_and_the_stated_noise_is_believed(recording):
    loud = dc.replace(recording, sensors=dc.replace(recording.sensors, object_position_std=3.0 * POSITION_STD))
    noise, _ = tracker_noise(loud)
    assert noise.stated and noise.position == 3.0 * POSITION_STD and noise.doubt == 0.0
    assert [w for w in noise.warnings if "position noise at rest" in w and "far less" in w]


@pytest.mark.parametrize(("stated", "said"), [(5e-5, "times what the recording states"), (0.0, "states none")])
def test_a_hands_noise_that_its_stream_contradicts_is_said(recording, stated, said):
    loud = [
        dc.replace(
            p, hand=dc.replace(p.hand, positions=p.hand.positions + 5e-4 * RNG.standard_normal((len(p.hand), 3)))
        )
        for p in recording.pushes
    ]
    sensors = dc.replace(recording.sensors, hand_position_std=stated)
    noise, plain = tracker_noise(dc.replace(recording, pushes=tuple(loud), sensors=sensors))
    assert plain.hand == pytest.approx(5e-4, rel=0.3)
    assert "hand's noise" in noise.warnings[0] and said in noise.warnings[0] and noise.stated


def test_a_rotation_that_is_neither_stated_nor_seen_is_not_known(recording):
    ends = endpoints(dc.replace(recording, sensors=dc.replace(recording.sensors, object_rotation_std=None)))
    assert not tracker_noise(ends)[0].known
    assert tracker_noise(endpoints(recording))[0].known


@pytest.mark.parametrize("rate", [30, 60, 120])
def test_slides_that_come_to_rest_are_not_taken_for_noise(recording, rate):
    """Let go at 0.2 m/s and recorded until half a second after they stopped: no rest is where they began."""
    rng, pushes = np.random.default_rng(3), []
    for k in range(8):
        speed, braking = 0.2 * rng.uniform(0.7, 1.3), 0.27 * 9.81
        times = np.arange(0.0, speed / braking + 0.5, 1.0 / rate)
        moving = np.minimum(times, speed / braking)
        x = speed * moving - 0.5 * braking * moving**2 + POSITION_STD * rng.standard_normal(len(times))
        y, yaw = (std * rng.standard_normal(len(times)) for std in (POSITION_STD, 3e-3))
        zeros = np.zeros(len(times))
        quaternions = np.column_stack([np.cos(yaw / 2), zeros, zeros, np.sin(yaw / 2)])
        stream = PoseStream(times=times, positions=np.column_stack([x, y, zeros]), quaternions=quaternions)
        pushes.append(Push(name=f"{k}", object=stream, hand=None, force=None))
    noise, _ = tracker_noise(dc.replace(recording, hand=None, pushes=tuple(pushes)))
    assert noise.position < 1.5 * POSITION_STD  # up to 17 times before, from one slide of eight


@pytest.mark.parametrize("std", [0.0, None])
def test_a_simulation_without_noise_has_the_finest_or_an_unknown_one(recording, std):
    pushes = [
        dc.replace(push, object=dc.replace(push.object, positions=positions, quaternions=quaternions))
        for push in recording.pushes
        for positions, quaternions in [_still(push)]
    ]
    sensors = dc.replace(recording.sensors, object_position_std=std, object_rotation_std=std)
    noise, _ = tracker_noise(dc.replace(recording, pushes=tuple(pushes), sensors=sensors))
    assert noise.known is (std == 0.0) and noise.warnings == ()
    assert noise.position == pytest.approx(1e-5 if std == 0.0 else 5e-4)


@pytest.mark.parametrize("stated", [True, False])
def test_what_is_rounded_is_as_noisy_as_its_steps_are_wide(recording, stated):
    """Within a rest all are off by the same: it hardly shows there."""

    def coarse(push):
        quaternions = push.object.planar[:, 2].round(2)
        turned = np.column_stack([np.cos(quaternions / 2), 0 * quaternions, 0 * quaternions, np.sin(quaternions / 2)])
        return dc.replace(
            push, object=dc.replace(push.object, positions=push.object.positions.round(3), quaternions=turned)
        )

    pushes = tuple(coarse(push) for push in recording.pushes)
    sensors = dc.replace(
        recording.sensors, object_position_std=1e-4 if stated else None, object_rotation_std=1e-3 if stated else None
    )
    noise, _ = tracker_noise(dc.replace(recording, pushes=pushes, sensors=sensors))
    assert 1e-3 / math.sqrt(12.0) < 1.001 * noise.position < 6e-4
    assert 1e-2 / math.sqrt(12.0) < 1.001 * noise.rotation < 6e-3


def _still(push):
    """Its poses with every rest at one pose."""
    positions, quaternions = push.object.positions.copy(), push.object.quaternions.copy()
    for rest in rest_segments(push):
        positions[rest], quaternions[rest] = positions[rest][0], quaternions[rest][0]
    return positions, quaternions


def test_a_rest_too_short_for_one_stream_tells_yaw_what_it_tells_of_the_place(recording, monkeypatch):
    # As many samples as two streams (x and y) need together.
    seen = {2: SeenNoise(std=POSITION_STD, correlation_time=0.02, doubt=0.1), 1: None}
    monkeypatch.setattr(noise_module, "seen_noise", lambda pieces, _: seen[len(pieces) // rests_of(recording)])
    noise, _ = tracker_noise(recording)
    assert noise.correlation_time == (0.02, 0.02)


def rests_of(recording):
    return sum(len(rest_segments(push)) for push in recording.pushes)


def test_a_noise_that_is_neither_stated_nor_seen_is_not_known(recording):
    bare = dc.replace(recording.sensors, object_position_std=None, object_rotation_std=None)
    ends = endpoints(dc.replace(recording, sensors=bare))
    noise, _ = tracker_noise(ends)
    assert not noise.known
    louder = noise.louder(3.0)
    assert louder.position == pytest.approx(3.0 * noise.position)
    assert "neither stated nor seen" in louder.warnings[-1]
    assert tracker_noise(recording)[0].known and tracker_noise(dc.replace(recording, sensors=bare))[0].known


def test_features_of_pure_noise_have_the_covariance_that_is_written_down(recording):
    noise, plain = tracker_noise(recording)
    push = recording.pushes[0]
    problem = problems_of(recording, plain, 0.03)[0]
    features = features_of(push, problem, noise)
    rng, n = np.random.default_rng(2), len(problem.times)
    vectors = [
        features._vector(noise.sigmas * rng.standard_normal((n, 3)), np.zeros((0, 2))) for _ in range(4000)
    ]  # fmt: skip
    spread = np.cov(np.array(vectors).T)
    floor = features.noise - spread
    # What is written down beyond the tracker's noise is the cell's own error: smooth and small.
    assert np.abs(np.diag(floor)).max() < 0.2
    assert (np.linalg.eigvalsh(features.noise) > 0).all()


def streams(rng, jitter, *, stamped, dropout=0.0, noise=2e-4, count=10):
    """Slides of 0.2 to 0.3 m/s between two rests at 100 Hz, samples taken or stamped early and late [s]."""
    pushes = []
    for k in range(count):
        even = np.arange(0.0, 2.0, 0.01)
        late = jitter * rng.uniform(-(3.0**0.5), 3.0**0.5, len(even))
        taken, stamps = (even, even + late) if stamped else (even + late, even)
        moving = np.clip(taken - 0.5, 0.0, 1.0)
        way, heading = (0.2 + 0.1 * rng.random()) * moving, rng.uniform(0.0, 2.0 * np.pi)
        places = np.column_stack([way * np.cos(heading), way * np.sin(heading), 0.0 * way])
        places[:, :2] += noise * rng.standard_normal((len(even), 2))
        kept = rng.random(len(even)) >= dropout
        quaternions = np.tile([1.0, 0.0, 0.0, 0.0], (len(even), 1))
        stream = PoseStream(times=stamps[kept], positions=places[kept], quaternions=quaternions[kept])
        pushes.append(Push(name=f"{k}", object=stream, hand=None, force=None))
    return pushes


@pytest.mark.parametrize("stamped", [False, True])
@pytest.mark.parametrize("dropout", [0.0, 0.2])
def test_jitter_is_seen_in_samples_that_are_taken_or_stamped_early_and_late(stamped, dropout):
    seen = [
        _jitter(streams(np.random.default_rng(seed), 2e-3, stamped=stamped, dropout=dropout)) for seed in range(8)
    ]
    # Evenly spread jitter has a larger median square than normal one of the same deviation: 2.1 to 2.3 ms.
    assert np.mean(seen) == pytest.approx(2e-3, rel=0.2)


def test_where_stamps_are_right_pushes_seldom_agree_on_a_jitter():
    seen = [_jitter(streams(np.random.default_rng(seed), 0.0, stamped=True, dropout=0.2)) for seed in range(40)]
    assert np.mean(np.array(seen) > 0.0) <= 0.2  # 5 % by chance; rests are where it is quiet: 12 % of 200


@pytest.mark.filterwarnings("error")
def test_streams_without_noise_have_no_jitter():
    times = np.arange(256) / 128.0  # steps that are even to the last bit
    places = np.column_stack([0.25 * np.clip(times - 0.5, 0.0, 1.0), 0.0 * times, 0.0 * times])
    stream = PoseStream(times=times, positions=places, quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)))
    assert _jitter([Push(name=f"{k}", object=stream, hand=None, force=None) for k in range(6)]) == 0.0


def test_white_noise_is_as_rough_as_it_is_noisy():
    rng = np.random.default_rng(5)
    times = np.cumsum(rng.uniform(0.005, 0.05, 20000))
    parabola = np.column_stack([0.3 * times**2 - times, 2.0 * times])
    assert np.std(_roughness(times, rng.standard_normal((20000, 2)))) == pytest.approx(1.0, rel=0.03)
    assert np.abs(_roughness(times[:50], parabola[:50])).max() < 1e-12
