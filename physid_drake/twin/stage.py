"""One implicit stage: the velocity at its end, with friction, pressure and the tip's contact all taken there."""

from __future__ import annotations

import math

import numpy as np

from physid_drake.twin.compiled import compiled, compiled_inside
from physid_drake.twin.contact import resting_contact
from physid_drake.twin.laws import (
    drags,
    ellipse,
    force_by_motion,
    force_by_place,
    friction_by_heading,
    friction_by_place,
    friction_by_speed,
    has,
)
from physid_drake.twin.plane import copied, differ, length, turned_back
from physid_drake.twin.records import HEADING_TABLE
from physid_drake.twin.support import (
    CREEP,
    MOST_CHANGES,
    friction,
    grips,
    headings,
    moments,
    plane_of_loads,
    round_grips,
    soften,
    torque_of_discs,
    unloaded_friction,
    unloading,
)
from physid_drake.twin.swing import pull_of, torque_of

MOST_ROUNDS = 60  # of Newton's method
STUCK = 12  # rounds after which it begins anew from rest
CONVERGED = 1e-8  # m/s
# Rows of the space for the points: friction by place, loaded weights, friction by speed, `grips`, of friction by
# heading these, what is along the slip, what is across it and what of it resists, and loads.
MU, LOADED, FAST, GRIP, SOFT, TURNS, ALONG, ACROSS, STIFF, PRESSED = range(10)
SPACES = 10
CONTACT = np.dtype([(name, np.float64) for name in (
    "touching", "nx", "ny", "rx", "ry",  # normal from tip to object and arm from Bcm, in W
    "vx", "vy",                          # of the tip, were there no contact
    "hand_vx", "hand_vy",                # of the hand that holds it
    "gives",                             # velocity that a tip which gives way loses per impulse [1/kg]
)])  # fmt: skip
"""The tip's contact as a stage sees it."""
SOLVED = np.dtype([(name, np.float64) for name in (
    "vx", "vy", "spin",       # of Bcm in W
    "fx", "fy", "normal",     # of the tip on the object in W [N], and the impulse along the normal [N s]
    "tipped",
    "partly",                 # whether some points carry nothing
    "p0", "px", "py",         # the plane of loads in B [N, N/m]
)])  # fmt: skip
"""What a stage found; on entry, the guess."""


@compiled
def solve_stage(body, object_, laws, tables, room, h, x, y, yaw, ax, ay, spin0, swing, contact, solved):
    """Implicit Euler over ``h`` from velocity (ax, ay, spin0) at the pose predicted for its end.

    Newton's method on the velocity, in B. The contact with the tip is solved in closed form in every round, and the
    pressure for the velocity and the tip's force of the round before.

    Args:
        body: record of object and tip.
        object_: (px, py, w, mu, radii, disc8, edges) of the support points about Bcm, and the outline.
        laws, tables: the vocabulary's.
        room: (SPACES, n) space for the points, and (14,) for sums of moments: of all points, of the loaded ones, and
            how far points are along x and y at most.
        h: length of the stage [s].
        x, y, yaw: of Bcm at its end [m, rad].
        ax, ay, spin0: velocity at its start, in W.
        swing: (dx, dy, wx, wy) of what swings inside, likewise.
        contact: record of `CONTACT`.
        solved: record of `SOLVED`; holds the guess, and afterwards what was found.
    """
    px, py, _, mu0, radii, _, _ = object_
    c, s = math.cos(yaw), math.sin(yaw)
    friction_by_place(laws, tables, px, py, radii, x, y, yaw, mu0, room[0][MU])
    if body.rough != 1.0:
        for i in range(len(px)):
            room[0][MU, i] *= body.rough
    oval = ellipse(laws, yaw)
    wx, wy = force_by_place(laws, tables, x, y)
    swing_x, swing_y, swing_drag = pull_of(body, h, swing, spin0)
    ex, ey = turned_back(c, s, wx + swing_x + body.push_x, wy + swing_y + body.push_y)
    linear, turning_drag, quadratic = drags(laws)
    headed = has(laws, HEADING_TABLE)
    arms = turned_back(c, s, body.swing_load * swing[0], body.swing_load * swing[1])
    vx, vy = turned_back(c, s, solved.vx, solved.vy)
    spin = solved.spin
    bx, by = turned_back(c, s, ax, ay)
    touching = contact.touching > 0.0
    tip = _tip_in(c, s, contact)
    hx, hy = turned_back(c, s, solved.fx, solved.fy) if touching else (0.0, 0.0)
    size = math.sqrt(body.inertia / body.mass)
    full, before, pn, again, rounds = 1.0, np.inf, 0.0, False, 0
    for rounds in range(1, MOST_ROUNDS + 1):
        fx, fy, torque, xx, xy, yy, xw, yw, ww = _friction(
            body, object_, laws, tables, room, headed, yaw, vx, vy, spin, oval, hx, hy, arms, solved, full
        )
        torque += body.push_torque + torque_of(body, swing, c * vx - s * vy, s * vx + c * vy, spin)
        drag = linear + quadratic * length(vx, vy) + swing_drag
        mx, my, mxx, mxy, myy = force_by_motion(laws, tables, vx, vy)
        inverse = _inverse(
            body.mass + h * (xx + mxx + drag), h * (xy + mxy), h * xw, body.mass + h * (yy + myy + drag), h * yw,
            body.inertia + h * (ww + turning_drag),
        )  # fmt: skip
        d0, d1, d2 = _times(
            inverse,
            h * (fx + mx + ex - drag * vx) + body.mass * (bx - vx),
            h * (fy + my + ey - drag * vy) + body.mass * (by - vy),
            h * (torque - turning_drag * spin) + body.inertia * (spin0 - spin),
        )  # fmt: skip
        fhx = fhy = 0.0
        if touching:
            d0, d1, d2, pn, pt = _held(
                tip, inverse, vx + d0, vy + d1, spin + d2, d0, d1, d2, contact.gives, body.grip * body.hand_friction
            )
            fhx, fhy = (tip[0] * pn - tip[1] * pt) / h, (tip[1] * pn + tip[0] * pt) / h
        moved = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2 * size * size)
        pressed = length(fhx - hx, fhy - hy) * h / body.mass
        vx, vy, spin, hx, hy = vx + d0, vy + d1, spin + d2, fhx, fhy
        if moved + 0.1 * pressed < CONVERGED:
            break
        to_and_fro = moved > 0.5 * before
        # Where it jumps to and fro, the slope without its soft part helps, and the whole one again.
        full = 1.0 - full if to_and_fro else 1.0
        if to_and_fro and rounds > STUCK and not again and not touching:
            again, full, vx, vy, spin = True, 1.0, 0.0, 0.0, 0.0
        before = moved
    solved.vx, solved.vy, solved.spin = c * vx - s * vy, s * vx + c * vy, spin
    solved.fx, solved.fy, solved.normal = c * hx - s * hy, s * hx + c * hy, pn


@compiled_inside
def _friction(body, object_, laws, tables, room, headed, yaw, vx, vy, spin, oval, hx, hy, arms, solved, full):
    """`friction` at a velocity in B, under the plane of loads that balances it and a tip's force (hx, hy) there.

    ``headed`` says whether friction is by the heading of the slip; ``arms`` and ``full`` are as of `_balance` and
    `friction`.
    """
    px, py, w, _, _, _, _ = object_
    space, _ = room
    turns8 = spin**8 if vx * vx + vy * vy < (spin * body.reach) ** 2 else 0.0
    mu = space[FAST] if friction_by_speed(laws, tables, px, py, vx, vy, spin, space[MU], space[FAST]) else space[MU]
    stiff = mu
    if headed:
        headings(px, py, vx, vy, spin, yaw, space[TURNS])
        friction_by_heading(laws, tables, space[TURNS], mu, space[ALONG], space[ACROSS], space[STIFF])
        mu, stiff = space[ALONG], space[STIFF]
    _grips(object_, vx, vy, spin, turns8, oval, space[GRIP], space[SOFT])
    if headed:
        soften(px, py, vx, vy, spin, oval[0], oval[1], oval[2], mu, stiff, space[SOFT])
    _balance(body, object_, room, headed, mu, vx, vy, spin, oval, hx, hy, arms, solved)
    carrying = space[LOADED] if solved.partly > 0.0 else w
    fx, fy, torque, xx, xy, yy, xw, yw, ww = friction(
        px, py, carrying, stiff, space[GRIP], space[SOFT], vx, vy, spin, oval[0], oval[1], oval[2],
        solved.p0, solved.px, solved.py, full,
    )  # fmt: skip
    if headed:
        fx, fy, torque, _, _, _, _, _, _ = friction(
            px, py, carrying, mu, space[GRIP], space[SOFT], vx, vy, spin, oval[0], oval[1], oval[2],
            solved.p0, solved.px, solved.py, full,
        )  # fmt: skip
        left_x, left_y, left_torque = _friction_to_the_left(object_, space, carrying, vx, vy, spin, oval, solved)
        fx, fy, torque = fx + left_x, fy + left_y, torque + left_torque
    if turns8 > 0.0:
        torque -= _torque_within(body, object_, mu, carrying, vx, vy, spin, solved)
    return fx, fy, torque, xx, xy, yy, xw, yw, ww


@compiled_inside
def _grips(object_, vx, vy, spin, turns8, oval, grip, soft):
    """`grips`, or those of a circle that does not turn about a place near."""
    px, py, _, _, _, disc8, _ = object_
    if turns8 == 0.0 and oval[0] == 1.0 and oval[1] == 0.0:
        round_grips(px, py, vx, vy, spin, grip, soft)
    else:
        grips(px, py, vx, vy, spin, disc8, turns8, oval[0], oval[1], oval[2], grip, soft)


@compiled_inside
def _friction_to_the_left(object_, space, carrying, vx, vy, spin, oval, solved):
    """Force and torque of what friction has to the left of where it brakes, under the plane of loads."""
    px, py, _, _, _, _, _ = object_
    pressed = space[PRESSED]
    for i in range(len(px)):
        pressed[i] = carrying[i] * (solved.p0 + solved.px * px[i] + solved.py * py[i])
    gx0, _, gx2, gy0, gy1, _ = _unloaded_to_the_left(object_, space, pressed, vx, vy, spin, oval)
    return -gx0, -gy0, gx2 - gy1


@compiled_inside
def _unloaded_to_the_left(object_, space, carrying, vx, vy, spin, oval):
    """The same per load: as `unloaded_friction`."""
    px, py, _, _, _, _, _ = object_
    gx0, gx1, gx2, gy0, gy1, gy2 = unloaded_friction(
        px, py, carrying, space[ACROSS], space[GRIP], vx, vy, spin, oval[0], oval[1], oval[2]
    )
    return -gy0, -gy1, -gy2, gx0, gx1, gx2


@compiled_inside
def _torque_within(body, object_, mu, carrying, vx, vy, spin, solved):
    """Torque [N m], against the spin, within what single points stand for where slip turns about them."""
    px, py, _, _, radii, _, _ = object_
    left = torque_of_discs(px, py, mu, carrying, radii, vx, vy, spin, solved.p0, solved.px, solved.py)
    return left * spin / length(spin, CREEP / body.reach)


@compiled_inside
def _balance(body, object_, room, headed, mu, vx, vy, spin, oval, hx, hy, arms, solved):
    """The plane of loads for a velocity and a tip's force (hx, hy) in B: into ``solved``, and which points carry.

    ``arms`` are the moments of a weight that has moved [N m]; ``headed`` says whether friction is by heading.
    """
    px, py, w, _, _, _, _ = object_
    space, sums = room
    loaded = space[LOADED]
    partly = solved.partly > 0.0
    solved.tipped = 1.0
    for _ in range(MOST_CHANGES):
        carrying = loaded if partly else w
        g = unloaded_friction(px, py, carrying, mu, space[GRIP], vx, vy, spin, oval[0], oval[1], oval[2])
        if headed:
            a = _unloaded_to_the_left(object_, space, carrying, vx, vy, spin, oval)
            g = (g[0] + a[0], g[1] + a[1], g[2] + a[2], g[3] + a[3], g[4] + a[4], g[5] + a[5])
        stands, p0, p1, p2 = plane_of_loads(
            sums[6:12] if partly else sums[:6],
            g,
            body.com_height,
            body.tip_arm * hx + arms[0],
            body.tip_arm * hy + arms[1],
            body.weight,
        )
        if not stands:
            break
        solved.p0, solved.px, solved.py = p0, p1, p2
        if not partly:
            if p0 > abs(p1) * sums[12] + abs(p2) * sums[13]:  # surely all of them press
                solved.tipped = 0.0
                break
            copied(w, loaded)
        if unloading(px, py, w, loaded, p0, p1, p2) == 0:
            solved.tipped = 0.0
            partly = partly and differ(loaded, w)
            break
        partly = True
        moments(px, py, loaded, sums[6:12])
    if solved.tipped > 0.0:  # nothing balances it: the plane is no model of this any more
        partly = False
        solved.p0, solved.px, solved.py = body.weight / sums[0], 0.0, 0.0
    solved.partly = 1.0 if partly else 0.0


@compiled_inside
def _tip_in(c, s, contact):
    """Of the contact in B: normal, its torque, that of the tangent (normal turned left), the tip's velocities."""
    nx, ny = turned_back(c, s, contact.nx, contact.ny)
    torque_n = contact.rx * contact.ny - contact.ry * contact.nx
    torque_t = contact.rx * contact.nx + contact.ry * contact.ny
    along = contact.vx * contact.nx + contact.vy * contact.ny
    across = contact.vy * contact.nx - contact.vx * contact.ny
    return nx, ny, torque_n, torque_t, along, across


@compiled_inside
def _held(tip, inverse, vx, vy, spin, d0, d1, d2, gives, friction_of_tip):
    """The change (d0, d1, d2) of a velocity with the contact's impulses, and these, from the one without."""
    nx, ny, torque_n, torque_t, along, across = tip
    y0, y1, y2 = _times(inverse, nx, ny, torque_n)
    z0, z1, z2 = _times(inverse, -ny, nx, torque_t)
    un = nx * vx + ny * vy + torque_n * spin - along
    ut = nx * vy - ny * vx + torque_t * spin - across
    pn, pt = resting_contact(
        un, ut, nx * y0 + ny * y1 + torque_n * y2 + gives, nx * z0 + ny * z1 + torque_n * z2,
        nx * z1 - ny * z0 + torque_t * z2 + gives, friction_of_tip,
    )  # fmt: skip
    return d0 + y0 * pn + z0 * pt, d1 + y1 * pn + z1 * pt, d2 + y2 * pn + z2 * pt, pn, pt


@compiled_inside
def _inverse(k00, k01, k02, k11, k12, k22):
    """Of a symmetric 3 x 3 matrix: its six entries."""
    i00, i01, i02 = k11 * k22 - k12 * k12, k02 * k12 - k01 * k22, k01 * k12 - k02 * k11
    i11, i12, i22 = k00 * k22 - k02 * k02, k01 * k02 - k00 * k12, k00 * k11 - k01 * k01
    det = k00 * i00 + k01 * i01 + k02 * i02
    return i00 / det, i01 / det, i02 / det, i11 / det, i12 / det, i22 / det


@compiled_inside
def _times(inverse, b0, b1, b2):
    i00, i01, i02, i11, i12, i22 = inverse
    return i00 * b0 + i01 * b1 + i02 * b2, i01 * b0 + i11 * b1 + i12 * b2, i02 * b0 + i12 * b1 + i22 * b2
