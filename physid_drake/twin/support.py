"""Sums over the support points: Coulomb friction under a pressure that carries the weight and balances moments.

Everything is in the object's frame B, about Bcm. Friction of a point is -mu N s / sqrt(s^2 + eps^2), with slip s.
"""

from __future__ import annotations

import math

from physid_drake.twin.compiled import compiled, compiled_inside, compiled_sum

CREEP = 1e-5  # m/s: slip at which friction fades
MOST_CHANGES = 25  # of the set of points that carry something
SINGULAR = 1e-12
NO_SLIP2 = 1e-30  # m^2/s^2: of slip that has no direction
# Slip that turns about a place within what a point stands for: see physid_drake.cell.turning.
LEAVES_ALL, OWN_ARM, OWN_TORQUE = 1.1, 0.35, 1.2
TURNS_WITHIN = 2.0  # of the radius of what a point stands for, beyond the outermost points


@compiled
def moments(x, y, w, into):
    """Sums of the weights with 1, x, y, x^2, x y, y^2."""
    into[:] = 0.0
    for i in range(len(x)):
        into[0] += w[i]
        into[1] += w[i] * x[i]
        into[2] += w[i] * y[i]
        into[3] += w[i] * x[i] * x[i]
        into[4] += w[i] * x[i] * y[i]
        into[5] += w[i] * y[i] * y[i]


@compiled
def headings(x, y, vx, vy, spin, yaw, turns):
    """Headings (n,) of the slips in W, in whole turns; right to 3e-9, and for many at once.

    The arc tangent is that of Abramowitz and Stegun, Handbook of Mathematical Functions, 4.4.49.

    Args:
        x, y, vx, vy, spin: as of `grips`.
        yaw: of B in W [rad].
        turns: (n,), filled in.
    """
    for i in range(x.shape[0]):
        sx, sy = vx - spin * y[i], vy + spin * x[i]
        along, across = abs(sx), abs(sy)
        steep = across > along
        r = along / across if steep else across / (along if along > 0.0 else 1.0)
        q = r * r
        far = -0.0752896400 + q * (0.0429096138 + q * (-0.0161657367 + q * 0.0028662257))
        near = -0.3333314528 + q * (0.1999355085 + q * (-0.1420889944 + q * (0.1065626393 + q * far)))
        angle = r * (1.0 + q * near)
        angle = 0.5 * math.pi - angle if steep else angle
        angle = math.pi - angle if sx < 0.0 else angle
        turns[i] = ((-angle if sy < 0.0 else angle) + yaw) / (2.0 * math.pi)


@compiled_sum
def round_grips(x, y, vx, vy, spin, grip, soft):
    """`grips` of a circle where slip turns about no place near: most of the time, and twice as fast."""
    for i in range(x.shape[0]):
        sx, sy = vx - spin * y[i], vy + spin * x[i]
        inverse = 1.0 / (sx * sx + sy * sy + CREEP * CREEP)
        grip[i] = math.sqrt(inverse)
        soft[i] = inverse


@compiled_sum
def grips(x, y, vx, vy, spin, disc8, turns8, mxx, mxy, myy, grip, soft):
    """What friction takes roots and quotients for, once for all sums.

    Args:
        x, y: (n,) support points from Bcm [m].
        vx, vy, spin: of Bcm [m/s, rad/s].
        disc8: (n,) eighth power of the radius within which slip that turns cancels [m^8].
        turns8: eighth power of the spin [rad^8/s^8]; 0 where slip turns about no place near.
        mxx, mxy, myy: squared ellipse of friction M; 1, 0, 1 of a circle.
        grip: (n,) friction of a point is -mu N grip M s with slip s; filled in [s/m].
        soft: (n,) its slope is -mu N grip (M - soft M s (M s)'); filled in [s^2/m^2].
    """
    for i in range(x.shape[0]):
        sx, sy = vx - spin * y[i], vy + spin * x[i]
        s2 = sx * sx + sy * sy + CREEP * CREEP
        u2 = mxx * sx * sx + 2.0 * mxy * sx * sy + myy * sy * sy + CREEP * CREEP
        s8 = (s2 * s2) * (s2 * s2)
        d8 = disc8[i] * turns8 + s8
        grip[i] = math.sqrt(s2 / (u2 * math.sqrt(math.sqrt(d8))))
        soft[i] = s8 / (d8 * u2)


@compiled
def soften(x, y, vx, vy, spin, mxx, mxy, myy, mu, stiff, soft):
    """Correct `grips` so that friction with coefficients ``stiff`` has the slope along the slip of that with ``mu``.

    Args:
        x, y, vx, vy, spin, mxx, mxy, myy, soft: as of `grips`.
        mu: (n,) coefficients of what brakes [-].
        stiff: (n,) of what resists a change across the slip [-].
    """
    for i in range(len(x)):
        if stiff[i] != mu[i]:
            sx, sy = vx - spin * y[i], vy + spin * x[i]
            u2 = mxx * sx * sx + 2.0 * mxy * sx * sy + myy * sy * sy
            soft[i] = (1.0 - (1.0 - soft[i] * u2) * mu[i] / stiff[i]) / max(u2, NO_SLIP2)


@compiled_sum
def unloaded_friction(x, y, w, mu, grip, vx, vy, spin, mxx, mxy, myy):
    """Friction per load: sums of mu times the direction of slip, with 1, x and y, along x and along y.

    Args:
        x, y, vx, vy, spin, mxx, mxy, myy: as of `grips`.
        w: (n,) weights; 0 of those that carry nothing.
        mu: (n,) coefficients [-].
        grip: of `grips`.
    """
    gx0 = gx1 = gx2 = gy0 = gy1 = gy2 = 0.0
    for i in range(x.shape[0]):
        sx, sy = vx - spin * y[i], vy + spin * x[i]
        k = w[i] * mu[i] * grip[i]
        fx, fy = k * (mxx * sx + mxy * sy), k * (mxy * sx + myy * sy)
        gx0 += fx
        gx1 += fx * x[i]
        gx2 += fx * y[i]
        gy0 += fy
        gy1 += fy * x[i]
        gy2 += fy * y[i]
    return gx0, gx1, gx2, gy0, gy1, gy2


@compiled_sum
def friction(x, y, w, mu, grip, soft, vx, vy, spin, mxx, mxy, myy, p0, px, py, full):
    """Force and torque of friction, and how they resist a change of (vx, vy, spin): xx, xy, yy, xw, yw, ww.

    Args:
        x, y, w, mu, vx, vy, spin, mxx, mxy, myy: as of `unloaded_friction`.
        grip, soft: of `grips`.
        p0, px, py: load of a point with weight 1, p0 + px x + py y [N].
        full: 1 for the slope of the whole law; 0 without the part that makes it soft along the slip.
    """
    fx = fy = torque = xx = xy = yy = xw = yw = ww = 0.0
    for i in range(x.shape[0]):
        sx, sy = vx - spin * y[i], vy + spin * x[i]
        dx, dy = mxx * sx + mxy * sy, mxy * sx + myy * sy
        k = w[i] * mu[i] * grip[i] * (p0 + px * x[i] + py * y[i])
        q = full * k * soft[i]
        fx -= k * dx
        fy -= k * dy
        torque -= k * (x[i] * dy - y[i] * dx)
        a, b, c = k * mxx - q * dx * dx, k * mxy - q * dx * dy, k * myy - q * dy * dy
        xx += a
        xy += b
        yy += c
        xw += b * x[i] - a * y[i]
        yw += c * x[i] - b * y[i]
        ww += a * y[i] * y[i] - 2.0 * b * x[i] * y[i] + c * x[i] * x[i]
    return fx, fy, torque, xx, xy, yy, xw, yw, ww


@compiled_sum
def torque_of_discs(x, y, mu, w, radii, vx, vy, spin, p0, px, py):
    """Torque [N m], against the spin, that is left within what points stand for where slip turns about them."""
    torque = 0.0
    for i in range(x.shape[0]):
        sx, sy = vx - spin * y[i], vy + spin * x[i]
        limit = OWN_TORQUE * radii[i] * spin
        left = max(0.0, 1.0 - (sx * sx + sy * sy) / (limit * limit + 1e-300))
        torque += OWN_ARM * radii[i] * left * mu[i] * w[i] * (p0 + px * x[i] + py * y[i])
    return torque


@compiled_inside
def plane_of_loads(sums, g, height, arm_x, arm_y, weight):
    """The plane p0 + px x + py y of loads [N] that carries the weight and balances the moments about Bcm.

    Args:
        sums: of `moments`.
        g: of `unloaded_friction`.
        height: of Bcm above the table [m].
        arm_x, arm_y: moments of the tip's force [N m].
        weight: N.

    Returns:
        Whether there is one, and p0, px, py.
    """
    a00, a01, a02 = sums[0], sums[1], sums[2]
    a10, a11, a12 = sums[1] - height * g[0], sums[3] - height * g[1], sums[4] - height * g[2]
    a20, a21, a22 = sums[2] - height * g[3], sums[4] - height * g[4], sums[5] - height * g[5]
    c0, c1, c2 = a11 * a22 - a12 * a21, a12 * a20 - a10 * a22, a10 * a21 - a11 * a20
    det = a00 * c0 + a01 * c1 + a02 * c2
    if abs(det) <= SINGULAR * (abs(a00 * c0) + abs(a01 * c1) + abs(a02 * c2)):
        return False, 0.0, 0.0, 0.0
    p0 = (c0 * weight + (a02 * a21 - a01 * a22) * arm_x + (a01 * a12 - a02 * a11) * arm_y) / det
    px = (c1 * weight + (a00 * a22 - a02 * a20) * arm_x + (a02 * a10 - a00 * a12) * arm_y) / det
    py = (c2 * weight + (a01 * a20 - a00 * a21) * arm_x + (a00 * a11 - a01 * a10) * arm_y) / det
    return True, p0, px, py


@compiled
def unloading(x, y, w, loaded, p0, px, py):
    """Take the weight off points that would pull, and give it back to those that would press: how many changed."""
    changed = 0
    for i in range(len(x)):
        now = w[i] if p0 + px * x[i] + py * y[i] > 0.0 else 0.0
        if now != loaded[i]:
            changed += 1
            loaded[i] = now
    return changed
