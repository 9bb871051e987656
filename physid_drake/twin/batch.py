"""All rollouts of a batch in one compiled loop."""

from __future__ import annotations

import numpy as np

from physid_drake.twin.compiled import compiled_outermost
from physid_drake.twin.hand import places_of_knots
from physid_drake.twin.rollout import STATE, roll
from physid_drake.twin.stage import CONTACT, SOLVED, SPACES


@compiled_outermost
def roll_all(
    bodies,
    base,
    friction,
    edges,
    knot_times,
    knot_velocities,
    path_starts,
    knot_ends,
    starts,
    laws,
    law_ends,
    tables,
    times,
    ends,
    poses,
    forces,
    counts,
):
    """Simulate each of n rollouts.

    Args:
        bodies: (n,) records.
        base: points (m, 2) in B [m], weights (m,) and radii (m,) [m]; the last may have no weight.
        friction: (n, m) of the points [-].
        edges: of the outline.
        knot_times: (k,) of all hand paths [s].
        knot_velocities: (k, 2) of the hands there [m/s].
        path_starts: (n, 2) where they start [m].
        knot_ends: (n + 1,) where each rollout's begin and end.
        starts: (n, 6) pose and velocity of Bo.
        laws, law_ends, tables: records, where each rollout's begin and end, numbers.
        times, ends: of the samples, where each rollout's begin and end.
        poses: (samples, 3), filled in.
        forces: (samples, 2), filled in.
        counts: (n,) records, filled in.
    """
    points, weights, radii = base
    count = len(weights)
    px, py, mu, disc8 = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    room = (np.empty((SPACES, count)), np.zeros(14))
    contact, solved, state = np.zeros(1, CONTACT), np.zeros(1, SOLVED), np.zeros(1, STATE)
    for k in range(len(bodies)):
        body = bodies[k]
        for i in range(count):
            px[i], py[i], mu[i] = points[i, 0] - body.com_x, points[i, 1] - body.com_y, friction[k, i]
        own_times = knot_times[knot_ends[k] : knot_ends[k + 1]]
        own_velocities = knot_velocities[knot_ends[k] : knot_ends[k + 1]]
        places = np.empty((len(own_times), 2))
        places_of_knots(own_times, own_velocities, path_starts[k], places)
        roll(
            body, (px, py, weights, mu, radii, disc8, edges), (own_times, places, own_velocities), starts[k],
            laws[law_ends[k] : law_ends[k + 1]], tables, times[ends[k] : ends[k + 1]],
            poses[ends[k] : ends[k + 1]], forces[ends[k] : ends[k + 1]],
            counts[k], room, contact[0], solved[0], state[0],
        )  # fmt: skip
