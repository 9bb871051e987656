"""What the way in which pushes are recorded costs: recording_styles.py [STYLE ...] [--jobs N].

Six pushes of a box in the planar integrator of the tests, 0.06 to 0.57 m/s, without an effect, and with a friction
that does not scatter. They are sampled, rounded, stamped and cut as people's recordings are, written and read back,
and the baseline model is fitted to them as a diagnosis does it. What costs much more than the plain
style (0.3 mm, 3 mrad, a hand of 0.1 mm, 100 Hz), also with what the hand's path and the cell itself may be off by,
would be called missing physics.
"""

import argparse
import dataclasses as dc
import math
import sys
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.planar import Hand, simulate_planar
from reference.scenes import OBJECTS, TIME_STEP, draw_push
from twin import shape_of

from physid_drake.identify.baseline import baseline, with_tolerances
from physid_drake.inference.fit import Fitter
from physid_drake.inference.predictions import Predictor
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Hand as Tip
from physid_drake.recording import (
    ObjectModel,
    Push,
    Recording,
    Sensors,
    planar_poses,
    read_recording,
    write_recording,
)
from physid_drake.recording import Table as TableTop

SPEEDS = (0.06, 0.1, 0.18, 0.3, 0.45, 0.57)  # m/s
FRICTION, HAND_FRICTION = 0.2, 0.3
POSITION, ROTATION, HAND = 3e-4, 3e-3, 1e-4  # standard deviations [m, rad, m]
TIP, SEED = 0.01, 11
BODY = OBJECTS["box"]

Gap = Callable[[float, float], tuple[float, float]]  # of touch and stop [s]: from when to when nothing is logged


@dc.dataclass(frozen=True, kw_only=True)
class Style:
    """How pushes are recorded.

    Attributes:
        rate: of both streams [Hz].
        hand_rate: of the hand's alone, if it is another one [Hz].
        twins: by how much later every tenth sample is taken once more [s].
        jitter: standard deviation of when a sample is taken, beside its stamp [s].
        stamps: what these are rounded to [s].
        place, turn: what the object's poses are rounded to [m, rad].
        hand_place: what the hand's are [m].
        hand: its noise [m].
        stated: whether the sensors' noise is.
        unseen: of the hand.
    """

    rate: float = 100.0
    hand_rate: float | None = None
    twins: float = 0.0
    jitter: float = 0.0
    stamps: float = 0.0
    place: float = 0.0
    turn: float = 0.0
    hand_place: float = 0.0
    hand: float = HAND
    stated: bool = True
    unseen: Gap | None = None


STYLES = {
    "plain": Style(),
    "hand 0.5 mm": Style(hand=5e-4),
    "hand 1 mm": Style(hand=1e-3),
    "15 Hz": Style(rate=15.0),
    "hand 10 Hz": Style(hand_rate=10.0),
    "twins 0.1 ms": Style(twins=1e-4),
    "1 kHz": Style(rate=1000.0),
    "jitter 2 ms": Style(jitter=2e-3),
    "jitter 5 ms": Style(jitter=5e-3),
    "stamps 10 ms, 60 Hz": Style(rate=60.0, stamps=0.01),
    "1 mm and 1 deg": Style(place=1e-3, turn=math.radians(1.0), stated=False),
    "hand 1 mm, said exact": Style(hand=0.0, hand_place=1e-3),
    "hand from the touch": Style(unseen=lambda touch, stop: (-math.inf, touch - 0.002)),
    "hand lost in contact": Style(unseen=lambda touch, stop: (touch + 0.06, math.inf)),
    "hand lost in its brake": Style(unseen=lambda touch, stop: (stop - 0.025, math.inf)),
    "gap over the brake": Style(unseen=lambda touch, stop: (stop - 0.1, stop + 0.05)),
    "gap at the touch": Style(unseen=lambda touch, stop: (touch - 0.05, touch + 0.05)),
}


@cache
def world():
    """Per push its drawn path, times (n,) each millisecond, and true poses (n, 3)."""
    rng, made = np.random.default_rng(SEED), []
    for speed in SPEEDS:
        push = draw_push(
            rng, BODY, speed=speed, tip_radius=TIP, pose=(*rng.uniform(-0.1, 0.1, 2), rng.uniform(-3.0, 3.0))
        )
        times = np.arange(0.0, push.path.times[-1] + 2.0, 1e-3)
        hand = Hand(path=push.path, radius=TIP, height=push.tip_height, friction=HAND_FRICTION)
        motion = simulate_planar(
            BODY, FRICTION, times, hand=hand, pose=push.pose, support=BODY.support(200), time_step=TIME_STEP
        )
        seen = times <= max(min(motion.rest_time, 3.0), push.path.times[-1]) + 0.4
        made.append((push, times[seen], motion.poses[seen]))
    return made


def recorded(style):
    """The recording in a style."""
    rng = np.random.default_rng(SEED)
    sensors = Sensors(object_position_std=POSITION, object_rotation_std=ROTATION, hand_position_std=style.hand)
    return Recording(
        name="styles", description="", object=ObjectModel(shape=shape_of(BODY), mass=BODY.mass),
        table=TableTop(size=(4.0, 4.0)), hand=Tip(tip="sphere", radius=TIP),
        sensors=sensors if style.stated else Sensors(),
        pushes=tuple(push_in(style, rng, k, *made) for k, made in enumerate(world())),
    )  # fmt: skip


def push_in(style, rng, k, push, times, poses):
    """One push, as it is logged."""
    stamps, taken = sampled(style, rng, times, style.rate)
    seen = np.column_stack([np.interp(taken, times, column) for column in poses.T])
    seen = rounded(seen + [POSITION, POSITION, ROTATION] * rng.standard_normal(seen.shape), style.place)
    seen[:, 2] = rounded(seen[:, 2], style.turn) if style.turn else seen[:, 2]
    hand_stamps, taken = sampled(style, rng, times, style.hand_rate or style.rate)
    places = rounded(push.path.position(taken) + style.hand * rng.standard_normal((len(taken), 2)), style.hand_place)
    places = np.column_stack([places, np.zeros(len(places))])
    if style.unseen is not None:
        moved = np.linalg.norm(poses - poses[0], axis=1) > 1e-5
        low, high = style.unseen(float(times[moved.argmax()]), float(push.path.times[-1]))
        kept = (hand_stamps < low) | (hand_stamps > high)
        hand_stamps, places = hand_stamps[kept], places[kept]
    return Push(
        name=f"pushes/{k:03d}.csv", object=planar_poses(stamps, seen, BODY.height / 2), force=None,
        hand=planar_poses(hand_stamps, places, push.tip_height),
    )  # fmt: skip


def sampled(style, rng, times, rate):
    """Stamps (n,) of samples, and when they are taken (n,) [s]."""
    stamps = np.arange(times[0], times[-1], 1.0 / rate)
    if style.twins:
        stamps = np.sort(np.append(stamps, stamps[:-1:10] + style.twins))
    taken = np.clip(stamps + style.jitter * rng.standard_normal(len(stamps)), times[0], times[-1])
    stamps, first = np.unique(rounded(stamps, style.stamps), return_index=True)
    return stamps, taken[first]


def rounded(values, step):
    """Values to the nearest multiples of a step; 0 leaves them."""
    return np.round(values / step) * step if step else values


def row(name, style, jobs):
    """What the baseline model leaves, without and with its guard, its friction, and what is said of the recording."""
    with tempfile.TemporaryDirectory() as folder:
        write_recording(recorded(style), Path(folder) / "styles")
        recording = read_recording(Path(folder) / "styles")
    case = case_of(recording, cell_config(recording), ThetaConfig(), jobs=jobs)
    space = case.thetas.space
    fitter = Fitter(case, Predictor(case))
    fits = [baseline(fitter, np.random.default_rng(0))]
    fits.append(with_tolerances(fitter, fits[0]))
    friction = dict(zip(space.names, fits[0].hypothesis.theta(fits[0].point.z), strict=True))["support_friction"]
    costs = [f"{left(fit):.2f}" for fit in fits]
    return name, *costs, f"{friction:.4f}", "; ".join(w[:60] for w in case.warnings)


def left(fit):
    """Squares that a model leaves, in units of noise, per number."""
    return sum(one.square for one in fit.weighed) / sum(len(push.residual) for push in fit.pushes)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("styles", nargs="*", metavar="STYLE", help=f"of {', '.join(STYLES)} (default: all)")
    parser.add_argument("--jobs", type=int, default=0, help="processes (default: one a core)")
    given = parser.parse_args()
    unknown = [name for name in given.styles if name not in STYLES]
    if unknown:
        parser.error(f"there is no style {unknown[0]!r}; there are {', '.join(STYLES)}.")
    console = Console(width=150, markup=False)
    made = Table("style", "cost", "guarded", f"friction ({FRICTION})", "said", title="six pushes, recorded otherwise")
    for name in given.styles or STYLES:
        cells = row(name, STYLES[name], given.jobs)
        console.print(*cells, sep=" | ")
        made.add_row(*cells)
    console.print(made)


if __name__ == "__main__":
    main()
