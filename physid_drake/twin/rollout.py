"""A push from begin to end: L-stable steps, touches found in time, blows, rests that are held."""

from __future__ import annotations

import math

import numpy as np

from physid_drake.twin.compiled import compiled
from physid_drake.twin.hand import gap_between, hand_at
from physid_drake.twin.laws import force_by_place, friction_by_place, least_friction
from physid_drake.twin.plane import largest, length, product
from physid_drake.twin.stage import MU, solve_stage
from physid_drake.twin.support import CREEP, LEAVES_ALL, TURNS_WITHIN, moments
from physid_drake.twin.swing import strongest, swing_after, swing_at_rest
from physid_drake.twin.tip import contact_at, part, tip_after, tip_at
from physid_drake.twin.touch import jerk, keep_touching, meeting, strike

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)  # of SDIRK2, L-stable (Alexander 1977)
TOLERANCE = 1e-7  # m, of a step; at 1e-6 derivatives by the restitution are 12 % off
SHORTEST, LONGEST, LONGEST_TOUCHING = 2.5e-4, 0.02, 0.02  # s
FARTHEST_TOUCHING = 2e-3  # m that the tip goes in a step while it touches
AT_KNOT = 1e-9  # s
STILL = 3.0 * CREEP  # m/s
STILL_TIP = 1e-7  # m, and tenths of m/s: a tip that gives way hangs where the hand is
LONGEST_SWINGING = 2e-3  # s, of a tip that gives way
HELD = 0.9  # of what friction holds
NEAR, NEARLY_TOUCHING = 2e-4, 1e-7  # s, m
FASTEST = 50.0  # m/s: faster is diverged
MOST_STEPS = 200_000
COMPLETED, DIVERGED, STUCK = 0, 1, 2

STATE = np.dtype([(name, np.float64) for name in (
    "t", "x", "y", "yaw", "vx", "vy", "spin",  # of Bcm in W
    "ax", "ay", "aspin",                       # its acceleration, for the next guess
    "fx", "fy",                                # of the tip on the object [N]
    "touching", "next",                        # whether it does; length of the next step [s]
    "dx", "dy", "wx", "wy",                    # what swings inside: its place less that of Bcm [m], its velocity
    "ex", "ey", "ux", "uy",                    # a tip that gives way: the hand's place less its own [m], its velocity
)])  # fmt: skip
COUNTS = np.dtype([(name, np.int64) for name in ("outcome", "lifted", "tipped")])


@compiled
def roll(body, object_, hand, start, laws, tables, times, poses, forces, counts, room, contact, solved, state):
    """Simulate one push and sample it.

    Args:
        body: record of object and tip.
        object_: (px, py, w, mu, radii, disc8, edges) of the support points about Bcm, and the outline.
        hand: (times, places, velocities) of its path; of no knots where there is none.
        start: (6,) pose and velocity of Bo [m, rad, m/s, rad/s].
        laws, tables: the vocabulary's.
        times: (n,) at which poses are asked for, increasing [s].
        poses: (n, 3) of Bo, filled in.
        forces: (n, 2) of the tip on the object [N], filled in.
        counts: record, filled in.
        room, contact, solved, state: space for the work.
    """
    _begin(body, object_, hand, start, room, state, solved, counts)
    knots, knot, loops = hand[0], 0, 0
    done = np.int64(0)  # of a plain 0, which has a type of its own, `_step` would be compiled once more
    while done < len(times) and state.t < body.end + AT_KNOT:
        loops += 1
        if loops > MOST_STEPS:
            counts.outcome = STUCK
            break
        at_knot = False
        while knot < len(knots) and knots[knot] <= state.t + AT_KNOT:
            knot, at_knot = knot + 1, True
        limit = knots[knot] if knot < len(knots) else np.inf
        if abs(state.vx) + abs(state.vy) + abs(state.spin) * body.reach < STILL:
            rest = _rest(body, object_, hand, laws, tables, room, state, limit)
            if rest > 0.0:
                until = min(state.t + rest, body.end + 1.0)
                done = _sample_rest(body, state, times, done, until, poses, forces)
                swing_at_rest(body, state, until - state.t)
                state.t, state.touching = until, 0.0
                continue
            if rest == 0.0 and state.touching == 0.0:
                strike(body, object_, hand, state)
        elif at_knot and state.touching > 0.0 and body.tip_stiffness == 0.0:
            jerk(body, object_, hand, state)
        done = _step(
            body, object_, hand, laws, tables, times, done, poses, forces, counts, room, contact, solved, state, limit
        )
        if not abs(state.vx) + abs(state.vy) + 1e-3 * abs(state.spin) < FASTEST:
            counts.outcome = DIVERGED
            break
    if counts.outcome == COMPLETED:
        _sample_rest(body, state, times, done, np.inf, poses, forces)
    return done


@compiled
def _begin(body, object_, hand, start, room, state, solved, counts):
    """Put the object at its start, out of the tip."""
    px, py, w, _, radii, disc8, edges = object_
    body.reach = 0.0
    for i in range(len(px)):
        disc8[i] = (LEAVES_ALL * radii[i]) ** 8
        body.reach = max(body.reach, length(px[i], py[i]) + TURNS_WITHIN * radii[i])
    _, sums = room
    moments(px, py, w, sums[:6])
    sums[12], sums[13] = largest(px), largest(py)
    c, s = math.cos(start[2]), math.sin(start[2])
    rx, ry = c * body.com_x - s * body.com_y, s * body.com_x + c * body.com_y
    state.t, state.yaw, state.spin = body.begin, start[2], start[5]
    state.x, state.y = start[0] + rx, start[1] + ry
    state.vx, state.vy = start[3] - start[5] * ry, start[4] + start[5] * rx
    state.ax = state.ay = state.aspin = state.fx = state.fy = state.touching = 0.0
    state.next = 1e-3
    solved.partly = 0.0
    counts.outcome = COMPLETED
    counts.lifted = counts.tipped = 0
    state.ex = state.ey = state.ux = state.uy = state.dx = state.dy = 0.0
    state.wx, state.wy = state.vx, state.vy
    if len(hand[0]) > 0:
        hx, hy, state.ux, state.uy = hand_at(state.t, False, hand[0], hand[1], hand[2])
        gap, nx, ny, _, _ = gap_between(state.x, state.y, state.yaw, hx, hy, body, edges)
        if gap < 0.0:
            part(body, state, gap, nx, ny)


@compiled
def _rest(body, object_, hand, laws, tables, room, state, limit):
    """For how long an object at rest surely stays so [s]; 0 where the tip is at it, below 0 where it slides."""
    fx, fy = force_by_place(laws, tables, state.x, state.y)
    pull = length(fx, fy) + strongest(body, state)
    if pull > 0.0:
        px, py, w, mu0, radii, _, _ = object_
        space, sums = room
        friction_by_place(laws, tables, px, py, radii, state.x, state.y, state.yaw, mu0, space[MU])
        held = HELD * least_friction(laws, tables)
        if pull > held * body.weight * product(w, space[MU]) / sums[0]:
            return -1.0
    times, places, velocities = hand
    swings = body.tip_stiffness > 0.0 and len(times) > 0
    if swings and length(state.ex, state.ey) + 0.1 * length(state.ux, state.uy) > STILL_TIP:
        return -1.0
    if len(times) == 0 or state.t >= times[-1] - AT_KNOT:
        return np.inf
    hx, hy, hvx, hvy = hand_at(state.t, False, times, places, velocities)
    if state.touching > 0.0 or swings:
        _, _, evx, evy = hand_at(min(limit, body.end), True, times, places, velocities)
        stands = hvx == 0.0 and hvy == 0.0 and evx == 0.0 and evy == 0.0
        return limit - state.t if stands and limit - state.t > AT_KNOT else -1.0
    gap, nx, ny, _, _ = gap_between(state.x, state.y, state.yaw, hx, hy, body, object_[6])
    if gap <= NEARLY_TOUCHING:
        return 0.0 if nx * hvx + ny * hvy > 0.0 else max(min(limit - state.t, 1e-3), 1e-7)
    fastest = 0.0
    for k in range(len(times)):
        fastest = max(fastest, length(velocities[k, 0], velocities[k, 1]))
    soon = gap / fastest
    if soon < NEAR:  # go up to it along its own velocity
        rate = nx * hvx + ny * hvy
        soon = min(NEAR, max(0.999999 * gap / rate, 1e-7)) if rate > 1e-9 else NEAR
    return soon if limit - state.t < AT_KNOT else min(soon, limit - state.t)


@compiled
def _step(body, object_, hand, laws, tables, times, done, poses, forces, counts, room, contact, solved, state, limit):
    """One step, cut where the tip meets the object; samples are taken within it."""
    h = _length(body, object_, hand, state, limit)
    edges, has_hand = object_[6], len(hand[0]) > 0
    struck, cut, tries = False, False, 0
    t, x, y, yaw, vx, vy, spin = state.t, state.x, state.y, state.yaw, state.vx, state.vy, state.spin
    while True:
        tries += 1
        x1, y1, yaw1, a, tip, swing, err = _two_stages(
            body, object_, hand, laws, tables, counts, room, contact, solved, state, h
        )
        scale = (TOLERANCE / max(err, 1e-15)) ** (1.0 / 3.0)
        if err > 4.0 * TOLERANCE and h > 1.01 * SHORTEST and tries == 1:
            h = max(SHORTEST, h * max(0.2, 0.9 * scale))
            continue
        if not cut:
            state.next = min(LONGEST, max(SHORTEST, h * min(2.0, 0.9 * scale)))
        if not has_hand or state.touching > 0.0 or cut:
            break
        into = meeting(body, edges, hand, state, h, x1, y1, yaw1, tip)
        if into >= 1.0:
            break
        struck = True
        if into * h < 1e-9:
            h = 0.0
            break
        h, cut = into * h, True
    if h > 0.0:
        nvx, nvy, nspin = solved.vx, solved.vy, solved.spin
        fx = (1.0 - GAMMA) * a[3] + GAMMA * solved.fx
        fy = (1.0 - GAMMA) * a[4] + GAMMA * solved.fy
        while done < len(times) and times[done] <= t + h + 1e-12:
            u = min(1.0, max(0.0, (times[done] - t) / h))
            _sample(
                body, poses, done, _hermite(u, h, x, vx, x1, nvx), _hermite(u, h, y, vy, y1, nvy),
                _hermite(u, h, yaw, spin, yaw1, nspin),
            )  # fmt: skip
            forces[done, 0], forces[done, 1] = fx, fy
            done += 1
        rest = (1.0 - GAMMA) * h
        state.ax, state.ay, state.aspin = (nvx - a[0]) / rest, (nvy - a[1]) / rest, (nspin - a[2]) / rest
        state.x, state.y, state.yaw, state.vx, state.vy, state.spin = x1, y1, yaw1, nvx, nvy, nspin
        state.fx, state.fy = solved.fx, solved.fy
        state.ex, state.ey, state.ux, state.uy = tip
        state.dx, state.dy, state.wx, state.wy = swing
        state.t = t + h
    if struck:
        strike(body, object_, hand, state)
    elif state.touching > 0.0:
        keep_touching(body, edges, hand, solved, state)
    return done


@compiled
def _length(body, object_, hand, state, limit):
    """How long the next step is [s]: to the next knot at most, and short beside the tip."""
    h = min(LONGEST, state.next)
    swings = body.tip_stiffness > 0.0 and len(hand[0]) > 0
    if swings:
        h = min(h, LONGEST_SWINGING)
    if len(hand[0]) > 0 and (swings or state.t < hand[0][-1]):
        hx, hy, hvx, hvy = tip_at(body, hand, state, state.t, False)
        if state.touching > 0.0:
            speed = length(hvx, hvy) + 0.05 * abs(state.spin)
            h = min(h, LONGEST_TOUCHING, max(FARTHEST_TOUCHING / max(speed, 1e-9), SHORTEST))
        else:
            gap, nx, ny, rx, ry = gap_between(state.x, state.y, state.yaw, hx, hy, body, object_[6])
            rate = nx * (state.vx - state.spin * ry - hvx) + ny * (state.vy + state.spin * rx - hvy)
            if gap + min(rate, 0.0) * 3.0 * h <= 0.0:
                h = min(h, 1e-3)
    left = limit - state.t
    if left < 1.2 * h:  # no sliver before a knot
        h = left
    return min(h, max(body.end - state.t, 1e-7))


@compiled
def _two_stages(body, object_, hand, laws, tables, counts, room, contact, solved, state, h):
    """SDIRK2: the pose at its end, what the first stage found, and the error [m]; the velocity is in ``solved``."""
    g = GAMMA * h
    edges, touching = object_[6], state.touching > 0.0
    vx, vy, spin = state.vx, state.vy, state.spin
    solved.vx, solved.vy, solved.spin = vx + g * state.ax, vy + g * state.ay, spin + g * state.aspin
    solved.fx, solved.fy = state.fx, state.fy
    xa = state.x + g * (vx + 0.5 * g * state.ax)
    ya = state.y + g * (vy + 0.5 * g * state.ay)
    yawa = state.yaw + g * (spin + 0.5 * g * state.aspin)
    tip0 = (state.ex, state.ey, state.ux, state.uy)
    _wander(body, state.t + g)
    contact_at(body, edges, hand, state.t + g, g, xa, ya, yawa, tip0, state.ux, state.uy, touching, contact)
    swing0 = (state.dx, state.dy, state.wx, state.wy)
    solve_stage(body, object_, laws, tables, room, g, xa, ya, yawa, vx, vy, spin, swing0, contact, solved)
    _count(counts, solved)
    tipa = tip_after(g, tip0, contact, solved)
    swinga = swing_after(body, g, swing0, spin, solved.vx, solved.vy)
    a = (solved.vx, solved.vy, solved.spin, solved.fx, solved.fy)
    aax, aay, aaspin = (a[0] - vx) / g, (a[1] - vy) / g, (a[2] - spin) / g
    rest = (1.0 - GAMMA) * h
    solved.vx, solved.vy, solved.spin = vx + h * aax, vy + h * aay, spin + h * aaspin
    xb = state.x + rest * a[0] + g * solved.vx
    yb = state.y + rest * a[1] + g * solved.vy
    yawb = state.yaw + rest * a[2] + g * solved.spin
    # From where the second stage starts, and how fast the tip will about be at its end.
    tips = (
        state.ex + rest / g * (tipa[0] - state.ex), state.ey + rest / g * (tipa[1] - state.ey),
        state.ux + rest / g * (tipa[2] - state.ux), state.uy + rest / g * (tipa[3] - state.uy),
    )  # fmt: skip
    swings = (
        state.dx + rest / g * (swinga[0] - state.dx), state.dy + rest / g * (swinga[1] - state.dy),
        state.wx + rest / g * (swinga[2] - state.wx), state.wy + rest / g * (swinga[3] - state.wy),
    )  # fmt: skip
    later_x, later_y = state.ux + (tipa[2] - state.ux) / GAMMA, state.uy + (tipa[3] - state.uy) / GAMMA
    _wander(body, state.t + h)
    contact_at(body, edges, hand, state.t + h, g, xb, yb, yawb, tips, later_x, later_y, touching, contact)
    solve_stage(
        body, object_, laws, tables, room, g, xb, yb, yawb,
        vx + rest * aax, vy + rest * aay, spin + rest * aaspin, swings, contact, solved,
    )  # fmt: skip
    _count(counts, solved)
    size = math.sqrt(body.inertia / body.mass)
    ex, ey = solved.vx - vx - h * aax, solved.vy - vy - h * aay
    espin = (solved.spin - spin - h * aaspin) * size
    error = h * math.sqrt(ex * ex + ey * ey + espin * espin)
    tipb = tip_after(g, tips, contact, solved)
    swingb = swing_after(body, g, swings, spin + rest * aaspin, solved.vx, solved.vy)
    if body.swing_mass > 0.0:
        soon_x, soon_y = state.wx + (swinga[2] - state.wx) / GAMMA, state.wy + (swinga[3] - state.wy) / GAMMA
        error = max(error, h * length(swingb[2] - soon_x, swingb[3] - soon_y))
    if body.tip_stiffness > 0.0:
        error = max(error, h * length(tipb[2] - later_x, tipb[3] - later_y))
    return (
        state.x + rest * a[0] + g * solved.vx,
        state.y + rest * a[1] + g * solved.vy,
        state.yaw + rest * a[2] + g * solved.spin,
        a,
        tipb,
        swingb,
        error,
    )


@compiled
def _wander(body, t):
    """Frictions at a time [s]: a share more or less in the middle of a while, less before and after."""
    share = max(0.0, 1.0 - abs(t - body.wander_middle) / body.wander_width)
    body.rough, body.grip = 1.0 + share * body.wander_support, 1.0 + share * body.wander_hand
    body.push_x, body.push_y = share * body.wander_x, share * body.wander_y
    body.push_torque = share * body.wander_torque


@compiled
def _count(counts, solved):
    counts.lifted += 1 if solved.partly > 0.0 else 0
    counts.tipped += 1 if solved.tipped > 0.0 else 0


@compiled
def _hermite(u, h, q, v, q1, v1):
    u2, u3 = u * u, u * u * u
    return (2 * u3 - 3 * u2 + 1) * q + (u3 - 2 * u2 + u) * h * v + (3 * u2 - 2 * u3) * q1 + (u3 - u2) * h * v1


@compiled
def _sample(body, poses, k, x, y, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    poses[k, 0], poses[k, 1] = x - c * body.com_x + s * body.com_y, y - s * body.com_x - c * body.com_y
    poses[k, 2] = yaw


@compiled
def _sample_rest(body, state, times, done, until, poses, forces):
    """Sample an object that rests up to a time; how many samples are done then."""
    state.vx = state.vy = state.spin = state.ax = state.ay = state.aspin = 0.0
    while done < len(times) and times[done] <= until + 1e-12:
        _sample(body, poses, done, state.x, state.y, state.yaw)
        forces[done, 0] = forces[done, 1] = 0.0
        done += 1
    return done
