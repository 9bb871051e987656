"""A push from begin to end: L-stable steps, touches found in time, blows, rests that are held."""

from __future__ import annotations

import math

import numpy as np

from physid_drake.twin.compiled import compiled
from physid_drake.twin.contact import blow
from physid_drake.twin.hand import gap_between, hand_at
from physid_drake.twin.laws import force_by_place, friction_by_place
from physid_drake.twin.stage import solve_stage
from physid_drake.twin.support import CREEP, LEAVES_ALL, moments

GAMMA = 1.0 - 1.0 / math.sqrt(2.0)  # of SDIRK2, L-stable (Alexander 1977)
TOLERANCE = 1e-7  # m, of a step; at 1e-6 derivatives by the restitution are 12 % off
GENTLE = 1e-3  # m/s: slower touches are no blows
SHORTEST, LONGEST, LONGEST_TOUCHING = 2.5e-4, 0.02, 0.02  # s
FARTHEST_TOUCHING = 2e-3  # m that the tip goes in a step while it touches
AFTER_BLOW = 5e-4  # s
AT_KNOT = 1e-9  # s
STILL = 3.0 * CREEP  # m/s
HELD = 0.9  # of what friction holds
NEAR, NEARLY_TOUCHING = 2e-4, 1e-7  # s, m
CORRECTED = 5e-4  # m of a gap that a step leaves
FASTEST = 50.0  # m/s: faster is diverged
MOST_STEPS = 200_000
COMPLETED, DIVERGED, STUCK = 0, 1, 2

STATE = np.dtype([(name, np.float64) for name in (
    "t", "x", "y", "yaw", "vx", "vy", "spin",  # of Bcm in W
    "ax", "ay", "aspin",                       # its acceleration, for the next guess
    "fx", "fy",                                # of the tip on the object [N]
    "touching", "next",                        # whether it does; length of the next step [s]
)])  # fmt: skip
COUNTS = np.dtype([(name, np.int64) for name in (
    "outcome", "steps", "stages", "rounds", "unconverged", "lifted", "tipped", "blows",
)])  # fmt: skip


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
    knots, done, knot, loops = hand[0], 0, 0, 0
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
                state.t, state.touching = until, 0.0
                continue
            if rest == 0.0 and state.touching == 0.0:
                _strike(body, object_, hand, state, counts)
        elif at_knot and state.touching > 0.0:
            _jerk(body, object_, hand, state)
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
    for i in range(len(px)):
        disc8[i] = (LEAVES_ALL * radii[i]) ** 8
    moments(px, py, w, room[3][:6])
    room[3][12], room[3][13] = np.abs(px).max(), np.abs(py).max()
    c, s = math.cos(start[2]), math.sin(start[2])
    rx, ry = c * body.com_x - s * body.com_y, s * body.com_x + c * body.com_y
    state.t, state.yaw, state.spin = body.begin, start[2], start[5]
    state.x, state.y = start[0] + rx, start[1] + ry
    state.vx, state.vy = start[3] - start[5] * ry, start[4] + start[5] * rx
    state.ax = state.ay = state.aspin = state.fx = state.fy = state.touching = 0.0
    state.next = 1e-3
    solved.partly = 0.0
    counts.outcome = COMPLETED
    counts.steps = counts.stages = counts.rounds = counts.unconverged = counts.lifted = counts.tipped = 0
    counts.blows = 0
    if len(hand[0]) > 0:
        hx, hy, _, _ = hand_at(state.t, False, hand[0], hand[1], hand[2])
        gap, nx, ny, _, _ = gap_between(state.x, state.y, state.yaw, hx, hy, body, edges)
        if gap < 0.0:
            state.x, state.y = state.x - gap * nx, state.y - gap * ny


@compiled
def _rest(body, object_, hand, laws, tables, room, state, limit):
    """For how long an object at rest surely stays so [s]; 0 where the tip is at it, below 0 where it slides."""
    fx, fy = force_by_place(laws, tables, state.x, state.y)
    pull = math.hypot(fx, fy)
    if pull > 0.0:
        px, py, w, mu0, radii, _, _ = object_
        friction_by_place(laws, tables, px, py, radii, state.x, state.y, state.yaw, mu0, room[0])
        if pull > HELD * body.weight * np.dot(w, room[0]) / room[3][0]:
            return -1.0
    times, places, velocities = hand
    if len(times) == 0 or state.t >= times[-1] - AT_KNOT:
        return np.inf
    hx, hy, hvx, hvy = hand_at(state.t, False, times, places, velocities)
    if state.touching > 0.0:
        _, _, evx, evy = hand_at(min(limit, body.end), True, times, places, velocities)
        stands = hvx == 0.0 and hvy == 0.0 and evx == 0.0 and evy == 0.0
        return limit - state.t if stands and limit - state.t > AT_KNOT else -1.0
    gap, nx, ny, _, _ = gap_between(state.x, state.y, state.yaw, hx, hy, body, object_[6])
    if gap <= NEARLY_TOUCHING:
        return 0.0 if nx * hvx + ny * hvy > 0.0 else max(min(limit - state.t, 1e-3), 1e-7)
    fastest = 0.0
    for k in range(len(times)):
        fastest = max(fastest, math.hypot(velocities[k, 0], velocities[k, 1]))
    soon = gap / fastest
    if soon < NEAR:  # go up to it along its own velocity
        rate = nx * hvx + ny * hvy
        soon = min(NEAR, max(0.999999 * gap / rate, 1e-7)) if rate > 1e-9 else NEAR
    return soon if limit - state.t < AT_KNOT else min(soon, limit - state.t)


@compiled
def _strike(body, object_, hand, state, counts):
    """The tip meets the object: a blow, or a touch that stays where it is gentle or does not rebound."""
    hx, hy, hvx, hvy = hand_at(state.t, False, hand[0], hand[1], hand[2])
    gap, nx, ny, rx, ry = gap_between(state.x, state.y, state.yaw, hx, hy, body, object_[6])
    if gap < 0.0:
        state.x, state.y = state.x - gap * nx, state.y - gap * ny
    ux, uy = state.vx - state.spin * ry - hvx, state.vy + state.spin * rx - hvy
    un = ux * nx + uy * ny
    state.ax = state.ay = state.aspin = 0.0
    if un >= 0.0:
        state.touching = 1.0
        return
    restitution = body.restitution if un < -GENTLE else 0.0
    _kick(body, state, nx, ny, rx, ry, un, uy * nx - ux * ny, restitution)
    counts.blows += 1 if un < -GENTLE else 0
    state.next = AFTER_BLOW
    state.touching = 1.0 if restitution == 0.0 else 0.0


@compiled
def _jerk(body, object_, hand, state):
    """The hand's velocity jumps at a knot while it touches: a blow without rebound before the step, not within it."""
    hx, hy, hvx, hvy = hand_at(state.t, False, hand[0], hand[1], hand[2])
    _, nx, ny, rx, ry = gap_between(state.x, state.y, state.yaw, hx, hy, body, object_[6])
    ux, uy = state.vx - state.spin * ry - hvx, state.vy + state.spin * rx - hvy
    un = ux * nx + uy * ny
    if un < -1e-7:
        _kick(body, state, nx, ny, rx, ry, un, uy * nx - ux * ny, 0.0)
        state.ax = state.ay = state.aspin = 0.0


@compiled
def _kick(body, state, nx, ny, rx, ry, un, ut, restitution):
    rn, rt = rx * ny - ry * nx, rx * nx + ry * ny
    pn, pt = blow(body.mass, body.inertia, rn, rt, un, ut, body.hand_friction, restitution, 0.0)
    state.vx += (nx * pn - ny * pt) / body.mass
    state.vy += (ny * pn + nx * pt) / body.mass
    state.spin += (rn * pn + rt * pt) / body.inertia


@compiled
def _step(body, object_, hand, laws, tables, times, done, poses, forces, counts, room, contact, solved, state, limit):
    """One step, cut where the tip meets the object; samples are taken within it."""
    h = _length(body, object_, hand, state, limit)
    edges, has_hand = object_[6], len(hand[0]) > 0
    struck, cut, tries = False, False, 0
    t, x, y, yaw, vx, vy, spin = state.t, state.x, state.y, state.yaw, state.vx, state.vy, state.spin
    while True:
        tries += 1
        x1, y1, yaw1, a, err = _two_stages(body, object_, hand, laws, tables, counts, room, contact, solved, state, h)
        scale = (TOLERANCE / max(err, 1e-15)) ** (1.0 / 3.0)
        if err > 4.0 * TOLERANCE and h > 1.01 * SHORTEST and tries == 1:
            h = max(SHORTEST, h * max(0.2, 0.9 * scale))
            continue
        if not cut:
            state.next = min(LONGEST, max(SHORTEST, h * min(2.0, 0.9 * scale)))
        if not has_hand or state.touching > 0.0 or cut:
            break
        into = _meeting(body, edges, hand, state, h, x1, y1, yaw1)
        if into >= 1.0:
            break
        struck = True
        if into * h < 1e-9:
            h = 0.0
            break
        h, cut = into * h, True
    if h > 0.0:
        counts.steps += 1
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
        state.t = t + h
    if struck:
        _strike(body, object_, hand, state, counts)
    elif state.touching > 0.0:
        _keep_touching(body, edges, hand, solved, state)
    return done


@compiled
def _length(body, object_, hand, state, limit):
    """How long the next step is [s]: to the next knot at most, and short beside the tip."""
    h = min(LONGEST, state.next)
    if len(hand[0]) > 0 and state.t < hand[0][-1]:
        hx, hy, hvx, hvy = hand_at(state.t, False, hand[0], hand[1], hand[2])
        if state.touching > 0.0:
            speed = math.hypot(hvx, hvy) + 0.05 * abs(state.spin)
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
    _contact_at(body, edges, hand, state.t + g, xa, ya, yawa, touching, contact)
    solve_stage(body, object_, laws, tables, room, g, xa, ya, yawa, vx, vy, spin, contact, solved)
    _count(counts, solved)
    a = (solved.vx, solved.vy, solved.spin, solved.fx, solved.fy)
    aax, aay, aaspin = (a[0] - vx) / g, (a[1] - vy) / g, (a[2] - spin) / g
    rest = (1.0 - GAMMA) * h
    solved.vx, solved.vy, solved.spin = vx + h * aax, vy + h * aay, spin + h * aaspin
    xb = state.x + rest * a[0] + g * solved.vx
    yb = state.y + rest * a[1] + g * solved.vy
    yawb = state.yaw + rest * a[2] + g * solved.spin
    _contact_at(body, edges, hand, state.t + h, xb, yb, yawb, touching, contact)
    solve_stage(
        body, object_, laws, tables, room, g, xb, yb, yawb,
        vx + rest * aax, vy + rest * aay, spin + rest * aaspin, contact, solved,
    )  # fmt: skip
    _count(counts, solved)
    size = math.sqrt(body.inertia / body.mass)
    ex, ey = solved.vx - vx - h * aax, solved.vy - vy - h * aay
    espin = (solved.spin - spin - h * aaspin) * size
    error = h * math.sqrt(ex * ex + ey * ey + espin * espin)
    return (
        state.x + rest * a[0] + g * solved.vx,
        state.y + rest * a[1] + g * solved.vy,
        state.yaw + rest * a[2] + g * solved.spin,
        a,
        error,
    )


@compiled
def _contact_at(body, edges, hand, t, x, y, yaw, touching, contact):
    """The tip's contact at a time, with the object at a pose; the hand's velocity is that before a knot."""
    contact.gives = 0.0
    contact.touching = 1.0 if touching else 0.0
    if touching:
        hx, hy, hvx, hvy = hand_at(t, True, hand[0], hand[1], hand[2])
        _, nx, ny, rx, ry = gap_between(x, y, yaw, hx, hy, body, edges)
        contact.nx, contact.ny, contact.rx, contact.ry, contact.vx, contact.vy = nx, ny, rx, ry, hvx, hvy


@compiled
def _count(counts, solved):
    counts.stages += 1
    counts.rounds += int(solved.rounds)
    counts.unconverged += 0 if solved.converged > 0.0 else 1
    counts.lifted += 1 if solved.partly > 0.0 else 0
    counts.tipped += 1 if solved.tipped > 0.0 else 0


@compiled
def _meeting(body, edges, hand, state, h, x1, y1, yaw1):
    """The share of a step after which the tip meets the object; 1 or more where it does not."""
    hx, hy, _, _ = hand_at(state.t + h, True, hand[0], hand[1], hand[2])
    after, _, _, _, _ = gap_between(x1, y1, yaw1, hx, hy, body, edges)
    if after >= 0.0:
        return 2.0
    hx, hy, hvx, hvy = hand_at(state.t, False, hand[0], hand[1], hand[2])
    before, nx, ny, rx, ry = gap_between(state.x, state.y, state.yaw, hx, hy, body, edges)
    if before <= 1e-10:
        rate = nx * (state.vx - state.spin * ry - hvx) + ny * (state.vy + state.spin * rx - hvy)
        return 2.0 if rate > 0.0 and before < after else 0.0
    low, high, gap_low, gap_high = 0.0, 1.0, before, after
    for _ in range(40):
        u = low + (high - low) * min(max(gap_low / (gap_low - gap_high), 0.02), 0.98)
        hx, hy, _, _ = hand_at(state.t + u * h, False, hand[0], hand[1], hand[2])
        gap, _, _, _, _ = gap_between(
            _between(u, h, state.x, state.vx, x1), _between(u, h, state.y, state.vy, y1),
            _between(u, h, state.yaw, state.spin, yaw1), hx, hy, body, edges,
        )  # fmt: skip
        if gap > 0.0:
            low, gap_low = u, gap
        else:
            high, gap_high = u, gap
        if (high - low) * h < 1e-10 or gap_low < 1e-10:
            break
    return low


@compiled
def _between(u, h, q, v, q1):
    """Within a step, from where and how fast it began to where it ended."""
    return q + u * h * v + u * u * (q1 - q - h * v)


@compiled
def _hermite(u, h, q, v, q1, v1):
    u2, u3 = u * u, u * u * u
    return (2 * u3 - 3 * u2 + 1) * q + (u3 - 2 * u2 + u) * h * v + (3 * u2 - 2 * u3) * q1 + (u3 - u2) * h * v1


@compiled
def _keep_touching(body, edges, hand, solved, state):
    """Let go where nothing presses any more; else take back what the gap has drifted by."""
    hx, hy, _, _ = hand_at(state.t, True, hand[0], hand[1], hand[2])
    gap, nx, ny, _, _ = gap_between(state.x, state.y, state.yaw, hx, hy, body, edges)
    apart = solved.normal <= 0.0
    if apart:
        state.touching = state.fx = state.fy = state.ax = state.ay = state.aspin = 0.0
    if gap < 0.0 if apart else abs(gap) < CORRECTED:
        state.x, state.y = state.x - gap * nx, state.y - gap * ny


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
