"""Diagnoses of another simulator's worlds: planar_worlds.py [WORLD ...] [--jobs N] [--scatter 0.02].

The planar integrator of the tests, which is neither Drake nor what makes the worlds of ``prove``, pushes its objects
twelve times; each world has one effect of the catalogue, none, or physics that the catalogue does not have. Noise is
0.3 mm, 3 mrad and, of the hand, 0.1 mm; the mass is weighed. Prints what was put in and what is said of it.
"""

import argparse
import dataclasses as dc
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.planar import Hand, simulate_planar
from reference.scenes import OBJECTS, TIME_STEP, draw_push, draw_theta
from twin import shape_of

from physid_drake.diagnose import diagnose
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Hand as Tip
from physid_drake.recording import ObjectModel, Push, Recording, Sensors, planar_poses
from physid_drake.recording import Table as TableTop

PUSHES = 12
POSITION, ROTATION, HAND = 3e-4, 3e-3, 1e-4  # standard deviations [m, rad, m]
TIP = 0.01  # m
GRAVITY = 9.81


@dc.dataclass(frozen=True, kw_only=True)
class World:
    """One world.

    Attributes:
        body: the name of the object.
        seed: of theta, pushes and noise.
        effect: of the catalogue; or ``none``, or ``other``.
        size: what was put in, in words.
        theta: changes of what is true of the object, for the k-th push.
        force: at the centre of mass [N], for the k-th push of an object.
        pressure: share of the load of support points (n, 2), in units of the underside's half size.
        friction: of the k-th push with the table, over theta's.
        seen: what the tracker says, of times (n,) and poses (n, 3).
        tip_at: from the true tip to the recorded one [m].
        said: how much larger the recording says that the object is.
        tip_said: radius of the tip in the recording [m].
    """

    body: str
    seed: int
    effect: str
    size: str
    theta: Callable = lambda k, push: {}
    force: Callable = lambda k, body, rng: (0.0, 0.0)
    pressure: Callable = lambda places: np.ones(len(places))
    friction: Callable = lambda k: 1.0
    seen: Callable = lambda times, poses, rng: poses
    tip_at: tuple[float, float] = (0.0, 0.0)
    said: float = 1.0
    tip_said: float = TIP


def late(delay):
    """A tracker that is so late [s]."""
    return lambda times, poses, rng: at(times, poses, times - delay)


def at(times, poses, wanted):
    """Poses (n, 3) at other times."""
    return np.column_stack([np.interp(wanted, times, column) for column in poses.T])


def smoothed(times, poses, rng):
    """A first-order filter of 40 ms."""
    out, share = poses.copy(), 0.01 / 0.05
    for i in range(1, len(out)):
        out[i] = out[i - 1] + share * (out[i] - out[i - 1])
    return out


def swapped(times, poses, rng):
    """Three times for 40 ms the tracker takes one marker for another."""
    out = poses.copy()
    for i in rng.integers(20, len(times) - 5, 3):
        out[i : i + 4, 2] += 0.06
    return out


def draught(k, body, rng):
    """A force of a few percent of the weight, each time from another side."""
    angle = rng.uniform(0.0, 2.0 * math.pi)
    size = 0.036 * body.mass * GRAVITY
    return size * math.cos(angle), size * math.sin(angle)


def level(x, y):
    """The force of a table that leans [rad]."""
    return lambda k, body, rng: (body.mass * GRAVITY * math.sin(x), body.mass * GRAVITY * math.sin(y))


WORLDS = {
    "level": World(body="box", seed=120, effect="none", size=""),
    "tilt": World(body="box", seed=101, effect="table_tilt", size="6, -4 mrad", force=level(0.006, -0.004)),
    "centre": World(body="can", seed=102, effect="com_offset", size="6, -4 mm",
                    theta=lambda k, push: {"com_offset": (0.006, -0.004)}),
    "legs": World(body="book", seed=103, effect="uneven_support", size="two corners bear four times the others",
                  pressure=lambda places: np.where(places[:, 0] * places[:, 1] > 0.0, 1.6, 0.4)),
    "inertia": World(body="triangle", seed=104, effect="rotational_inertia", size="1.5",
                     theta=lambda k, push: {"inertia_ratio": 1.5}),
    "tip": World(body="eraser", seed=105, effect="hand_offset", size="-1.5, 1 mm", tip_at=(0.0015, -0.001)),
    "late": World(body="box", seed=106, effect="tracker_latency", size="15 ms", seen=late(0.015)),
    "size": World(body="book", seed=107, effect="size_error", size="1 / 1.03 = 0.971", said=1.03),
    "bounce": World(body="triangle", seed=108, effect="restitution", size="0.5",
                    theta=lambda k, push: {"restitution": 0.5}),
    "scale": World(body="box", seed=109, effect="tracker_scale", size="1.02",
                   seen=lambda times, poses, rng: poses * [1.02, 1.02, 1.0]),
    "wear": World(body="book", seed=111, effect="friction_drift", size="24 % from the first push to the last",
                  friction=lambda k: 0.88 + 0.24 * k / (PUSHES - 1)),
    "draught": World(body="can", seed=110, effect="other", size="a force from another side each time", force=draught),
    "faces": World(body="box", seed=201, effect="other", size="two faces of friction 0.1, two of 0.5",
                   theta=lambda k, push: {"hand_friction": 0.1 if push.face in ("face 0", "face 1") else 0.5}),
    "filter": World(body="book", seed=202, effect="other", size="a tracker that smooths by 40 ms", seen=smoothed),
    "clock": World(body="box", seed=203, effect="other", size="a tracker's clock that is 4 % slow",
                   seen=lambda times, poses, rng: at(times, poses, 1.04 * times)),
    "load": World(body="can", seed=204, effect="other", size="a centre of mass that slips by 9 mm half way",
                  theta=lambda k, push: {"com_offset": (0.008, 0.004) if k >= PUSHES // 2 else (0.0, 0.0)}),
    "thin tip": World(body="book", seed=205, effect="other", size="a tip 2 mm thicker than is said", tip_said=0.008),
    "turns": World(body="triangle", seed=206, effect="other", size="every other push on a table 25 % rougher",
                   friction=lambda k: 1.0 + 0.25 * (k % 2)),
    "markers": World(body="box", seed=207, effect="other", size="markers that are swapped", seen=swapped),
}  # fmt: skip


def recorded(name, world, scatter):
    """The world's recording."""
    rng, body = np.random.default_rng(world.seed), OBJECTS[world.body]
    theta, pushes = draw_theta(rng, body), []
    planned = [
        draw_push(rng, body, tip_radius=TIP, pose=(*rng.uniform(-0.15, 0.15, 2), rng.uniform(-3.0, 3.0)))
        for _ in range(PUSHES)
    ]
    for k, push in enumerate(planned):
        times, poses = simulated(world, body, theta, k, push, scatter, rng)
        tip = push.path.position(times) + world.tip_at + HAND * rng.standard_normal((len(times), 2))
        seen = world.seen(times, poses, rng)
        seen = seen + [POSITION, POSITION, ROTATION] * rng.standard_normal(seen.shape)
        pushes.append(
            Push(
                name=f"pushes/{k:03d}.csv", object=planar_poses(times, seen, body.height / 2),
                hand=planar_poses(times, np.column_stack([tip, np.zeros(len(tip))]), push.tip_height), force=None,
            )
        )  # fmt: skip
    said = body if world.said == 1.0 else dc.replace(body, polygon=world.said * body.polygon)
    weighed = ObjectModel(shape=shape_of(said), mass=body.mass, mass_std=0.01 * body.mass)
    return Recording(
        name=name, description="", object=weighed,
        table=TableTop(size=(4.0, 4.0)), hand=Tip(tip="sphere", radius=world.tip_said), pushes=tuple(pushes),
        sensors=Sensors(object_position_std=POSITION, object_rotation_std=ROTATION, hand_position_std=HAND),
    )  # fmt: skip


def simulated(world, body, theta, k, push, scatter, rng):
    """Times (n,) and true poses (n, 3) of the k-th push."""
    true = dc.replace(theta, **world.theta(k, push))
    moved = true.applied_to(body)
    points, weights = moved.support(600)
    weights = weights * world.pressure(points / np.abs(points).max(axis=0))
    friction = true.support_friction * world.friction(k) * (1.0 + scatter * rng.standard_normal())
    hand = Hand(path=push.path, radius=TIP, height=push.tip_height, friction=true.hand_friction,
                restitution=true.restitution)  # fmt: skip
    times = np.arange(0.0, push.path.times[-1] + 2.5, 0.01)
    motion = simulate_planar(
        moved, friction, times, hand=hand, pose=push.pose, force=world.force(k, moved, rng),
        support=(points, weights / weights.sum()), time_step=TIME_STEP,
    )  # fmt: skip
    keep = times <= max(min(motion.rest_time, 3.0), push.path.times[-1]) + 0.2
    return times[keep], motion.poses[keep]


def answer(recording, jobs):
    """The diagnosis."""
    return diagnose(case_of(recording, cell_config(recording), ThetaConfig(), jobs=jobs))[0]


def row(name, world, diagnosis):
    """What is said, beside what was put in."""
    found = "; ".join(
        " or ".join((e.name, *e.indistinguishable_from)) + " " + ", ".join(numbers(e)) for e in diagnosis.effects
    )
    fit = diagnosis.fit
    truth = world.size if world.effect == "other" else f"{world.effect} {world.size}".strip()
    errors = f"{1e3 * fit.position_before:.2f} -> {1e3 * fit.position_after:.2f}"
    return name, truth, diagnosis.verdict, found, errors


def numbers(effect):
    """The effect's single numbers, with their intervals."""
    for key, value in effect.parameters.items():
        if isinstance(value.value, float):
            low, high = value.ci90 or (math.nan, math.nan)
            yield f"{key} {value.value:.4g} [{low:.4g}, {high:.4g}]"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("worlds", nargs="*", metavar="WORLD", help=f"of {', '.join(WORLDS)} (default: all)")
    parser.add_argument("--jobs", type=int, default=0, help="processes (default: one a core)")
    parser.add_argument("--scatter", type=float, default=0.02, help="of friction, from push to push")
    given = parser.parse_args()
    unknown = [name for name in given.worlds if name not in WORLDS]
    if unknown:
        parser.error(f"there is no world {unknown[0]!r}; there are {', '.join(WORLDS)}.")
    made = Table("world", "put in", "verdict", "said", "left out [mm]", title="worlds of the planar integrator")
    console = Console(width=150, markup=False)
    for name in given.worlds or WORLDS:
        world = WORLDS[name]
        cells = row(name, world, answer(recorded(name, world, given.scatter), given.jobs))
        console.print(*cells, sep=" | ")
        made.add_row(*cells)
    console.print(made)


if __name__ == "__main__":
    main()
