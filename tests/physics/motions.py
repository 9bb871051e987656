"""Motions with effects, let go with a velocity or pushed along x, and closed forms to compare them with.

With the point contact model, whose plain slide is right to 1e-5; the friction and force laws are the same in both.
"""

import math
from functools import cache

import numpy as np
from scipy.integrate import quad, solve_ivp
from twin import body_of, config_of

from physid_drake.cell import Cell, HandPath, Outcome, Start
from physid_drake.effects import effect_named
from physid_drake.effects.rollout import Geometry, Rollout, roll
from physid_drake.recording import Box

G, MU, MASS = 9.81, 0.3, 0.35
SIZE = (0.10, 0.08, 0.06)
BOX = Geometry(shape=Box(size=SIZE))
POLAR = (SIZE[0] ** 2 + SIZE[1] ** 2) / 12  # of the box [m^2]
TIP = 0.01  # m
SLOW = {"speed": 0.02, "until": 1.0, "rise": 0.2, "brake": 0.2}  # a push along x in which nothing swings


@cache
def built(geometry, hand, model="point", points=30, time_step=2e-3):
    config = config_of(model)
    config.solver.time_step_s, config.solver.slide_time_step_s = min(config.solver.time_step_s, time_step), time_step
    config.contact.support_points = points
    return Cell(
        geometry.shape, hand_radius=TIP if hand else None, config=config, pressure=geometry.pressure,
        gravity=geometry.gravity,
    )  # fmt: skip


def make(name, **parameters):
    return effect_named(name)(**parameters)


def slide(*effects, velocity=(0.5, 0.0, 0.0), pose=(0.0, 0.0, 0.0), seconds=1.0, geometry=BOX, order=0,
          friction=MU, model="point", points=30, time_step=2e-3):  # fmt: skip
    """The motion of an object that is let go with a velocity."""
    start = Start(pose=pose, velocity=velocity)
    push = Rollout(start=start, path=None, begin=0.0, end=seconds, hand_height=None, order=order)
    body = body_of(MASS, friction)
    motion = roll(lambda g: built(g, False, model, points, time_step), geometry, body, push, effects)
    assert motion.outcome is Outcome.COMPLETED
    return motion


def push_along_x(
    *effects,
    speed=0.3,
    side=0.0,
    gap=0.005,
    until=0.3,
    brake=0.04,
    rise=0.05,
    seconds=0.3,
    friction=MU,
    height=None,
):
    """The motion of the box that is pushed along x, ``side`` off its middle."""
    first = -0.5 * SIZE[0] - TIP - gap
    path = HandPath(
        times=np.array([0.0, rise, until, until + brake]),
        velocities=np.outer([0.0 if rise > 1e-3 else speed, speed, speed, 0.0], [1.0, 0.0]),
        start=np.array([first, side]),
    )
    push = Rollout(start=Start(pose=(0, 0, 0)), path=path, begin=0.0, end=until + brake + seconds, hand_height=height)
    motion = roll(lambda g: built(g, True), BOX, body_of(MASS, friction, hand_friction=0.3), push, effects)
    assert motion.outcome is Outcome.COMPLETED
    return motion, path


def end(motion):
    return motion.planar_at(motion.times[-1:])[0]


def at(motion, times):
    return motion.planar_at(np.atleast_1d(times))


def velocities(motion):
    """Mean planar velocities (n - 1, 3) over the time steps."""
    return np.diff(motion.planar_at(motion.times), axis=0) / np.diff(motion.times)[:, None]


def distance(deceleration, speed=0.5):
    """How far a point slides whose deceleration depends on its speed [m]."""
    return quad(lambda v: v / deceleration(v), 0.0, speed)[0]


def point_path(acceleration, velocity, seconds=1.0):
    """Where a point ends (2,) under an acceleration of place and velocity, which stops it."""

    def stopped(t, state):
        return math.hypot(state[2], state[3]) - 1e-5

    stopped.terminal = True
    found = solve_ivp(
        lambda t, s: [s[2], s[3], *acceleration(s[:2], s[2:])], (0.0, seconds), [0.0, 0.0, *velocity],
        events=stopped, rtol=1e-9, atol=1e-10, max_step=2e-3,
    )  # fmt: skip
    return found.y[:2, -1]
