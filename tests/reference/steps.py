"""The compiled steps of the planar integrator: friction, contact with the hand, impacts, events."""

# Compiled loops take plain numbers by position and stay in one piece.
# ruff: noqa: PLR0912, PLR0915

import math

import numpy as np
from numba import njit

GRAVITY = 9.81
RESTITUTION_FLOOR = 1e-3  # m/s; slower touches are inelastic, else bounces never end
DRIFT_GAIN = 0.1  # part of the gap's drift that is taken back in one step
REST_SPEED = 1e-8  # m/s


@njit(cache=True)
def tip_at(t, times, knots, velocities):
    """Position and velocity of the tip at t."""
    last = len(times) - 1
    if t <= times[0]:
        return knots[0, 0], knots[0, 1], 0.0, 0.0
    if t >= times[last]:
        return knots[last, 0], knots[last, 1], 0.0, 0.0
    k = np.searchsorted(times, t, side="right") - 1
    s, span = t - times[k], times[k + 1] - times[k]
    ax = (velocities[k + 1, 0] - velocities[k, 0]) / span
    ay = (velocities[k + 1, 1] - velocities[k, 1]) / span
    vx, vy = velocities[k, 0], velocities[k, 1]
    return knots[k, 0] + s * (vx + ax * s / 2), knots[k, 1] + s * (vy + ay * s / 2), vx + ax * s, vy + ay * s


@njit(cache=True)
def _gap(x, y, polygon, radius, tip_radius):
    """Gap, normal (hand to object) and touched point, all in B, for a tip centre at (x, y) in B."""
    if len(polygon) == 0:
        d = math.hypot(x, y)
        return d - radius - tip_radius, -x / d, -y / d, x / d * radius, y / d * radius
    best, bx, by = 1e300, 0.0, 0.0
    deep, dx, dy = -1e300, 0.0, 0.0  # signed distance to the nearest face line, for a centre inside
    k = len(polygon)
    for i in range(k):
        ax, ay = polygon[i]
        ex, ey = polygon[(i + 1) % k, 0] - ax, polygon[(i + 1) % k, 1] - ay
        s = min(1.0, max(0.0, ((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey)))
        qx, qy = ax + s * ex, ay + s * ey
        d = math.hypot(x - qx, y - qy)
        if d < best:
            best, bx, by = d, qx, qy
        length = math.hypot(ex, ey)
        out = ((x - ax) * ey - (y - ay) * ex) / length
        if out > deep:
            deep, dx, dy = out, -ey / length, ex / length
    if deep <= 0.0:
        return deep - tip_radius, dx, dy, bx, by
    return best - tip_radius, (bx - x) / best, (by - y) / best, bx, by


@njit(cache=True)
def routh_impact(mass, inertia, rn, rt, un, ut, mu, e):
    """Impulses (pn, pt) of a touch on a free body by a tip of infinite mass.

    Args: mass, yaw inertia; arms rn = r x n and rt = r x t; relative velocity (un < 0: approach, ut) of the
    touched point; friction; Poisson restitution. Source: Routh (1860), by marching through the phases of the
    normal impulse.
    """
    wnn, wtt, wnt = 1 / mass + rn * rn / inertia, 1 / mass + rt * rt / inertia, rn * rt / inertia
    pn, pt, end = 0.0, 0.0, np.inf
    for _ in range(4):
        if abs(ut) > 1e-15:
            ratio = -mu if ut > 0 else mu
        elif abs(wnt) <= mu * wtt:
            ratio = -wnt / wtt
        else:
            ratio = -mu if wnt > 0 else mu
        slip_rate, rate = wnt + wtt * ratio, wnn + wnt * ratio
        stop = -ut / slip_rate if ut * slip_rate < 0 else np.inf
        if end == np.inf:
            turn = -un / rate if rate > 0 else np.inf
            if turn <= stop:
                end = (1 + e) * (pn + turn)
        step = min(stop, end - pn)
        pn, pt, un = pn + step, pt + ratio * step, un + rate * step
        ut = 0.0 if step == stop else ut + slip_rate * step
        if pn >= end:
            break
    return pn, pt


@njit(cache=True, fastmath=True)
def _moments(px, py, w, mu, loaded, vx, vy, om, eps, hc, coef, inverse, out):
    """Slip factors of each point, and the 3 x 3 system of the pressure a + b x + c y on the loaded points."""
    s00 = s01 = s02 = s10 = s11 = s12 = s20 = s21 = s22 = 0.0
    for i in range(len(px)):
        x, y = px[i], py[i]
        sx, sy = vx - om * y, vy + om * x
        inv = 1.0 / (sx * sx + sy * sy + eps * eps)
        c = mu[i] * math.sqrt(inv)
        inverse[i] = inv
        coef[i] = c
        u = w[i] * loaded[i]
        q, r = u * (x - hc * c * sx), u * (y - hc * c * sy)
        s00 += u
        s01 += u * x
        s02 += u * y
        s10 += q
        s11 += q * x
        s12 += q * y
        s20 += r
        s21 += r * x
        s22 += r * y
    out[0, 0], out[0, 1], out[0, 2] = s00, s01, s02
    out[1, 0], out[1, 1], out[1, 2] = s10, s11, s12
    out[2, 0], out[2, 1], out[2, 2] = s20, s21, s22


@njit(cache=True, fastmath=True)
def _friction(px, py, w, loaded, abc, vx, vy, om, theta, coef, inverse, out):
    """Force, torque and their slope; returns how many points changed between loaded and lifted."""
    fx = fy = tz = xx = xy = yy = xw = yw = ww = 0.0
    a0, a1, a2 = abc[0], abc[1], abc[2]
    changed = 0.0
    for i in range(len(px)):
        x, y = px[i], py[i]
        p = a0 + a1 * x + a2 * y
        now = 1.0 if p > 0.0 else 0.0
        changed += abs(now - loaded[i])
        loaded[i] = now
        sx, sy = vx - om * y, vy + om * x
        k = coef[i] * w[i] * p * now
        kt = theta * k * inverse[i]
        fx -= k * sx
        fy -= k * sy
        tz -= k * (x * sy - y * sx)
        a, b, c = k - kt * sx * sx, -kt * sx * sy, k - kt * sy * sy
        xx += a
        xy += b
        yy += c
        xw += b * x - a * y
        yw += c * x - b * y
        ww += a * y * y - 2 * b * x * y + c * x * x
    out[0], out[1], out[2] = fx, fy, tz
    out[3], out[4], out[5], out[6], out[7], out[8] = xx, xy, yy, xw, yw, ww
    return changed


@njit(cache=True)
def _solve3(a, b, out):
    """out = a^-1 b by Cramer's rule; False if singular."""
    c0 = a[1, 1] * a[2, 2] - a[1, 2] * a[2, 1]
    c1 = a[1, 2] * a[2, 0] - a[1, 0] * a[2, 2]
    c2 = a[1, 0] * a[2, 1] - a[1, 1] * a[2, 0]
    det = a[0, 0] * c0 + a[0, 1] * c1 + a[0, 2] * c2
    scale = abs(a[0, 0] * c0) + abs(a[0, 1] * c1) + abs(a[0, 2] * c2)
    if not abs(det) > 1e-12 * scale:
        return False
    d0 = a[0, 2] * a[2, 1] - a[0, 1] * a[2, 2]
    d1 = a[0, 0] * a[2, 2] - a[0, 2] * a[2, 0]
    d2 = a[0, 1] * a[2, 0] - a[0, 0] * a[2, 1]
    e0 = a[0, 1] * a[1, 2] - a[0, 2] * a[1, 1]
    e1 = a[0, 2] * a[1, 0] - a[0, 0] * a[1, 2]
    e2 = a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0]
    out[0] = (c0 * b[0] + d0 * b[1] + e0 * b[2]) / det
    out[1] = (c1 * b[0] + d1 * b[1] + e1 * b[2]) / det
    out[2] = (c2 * b[0] + d2 * b[1] + e2 * b[2]) / det
    return True


@njit(cache=True)
def _contact(free, yn, yt, jn, jt, want_n, want_t, mu):
    """Impulses (pn, pt) so that J (free + K^-1 J^T p) meets the tip: separate, stick or slip."""
    un = jn[0] * free[0] + jn[1] * free[1] + jn[2] * free[2] - want_n
    ut = jt[0] * free[0] + jt[1] * free[1] + jt[2] * free[2] - want_t
    if un >= 0.0:
        return 0.0, 0.0
    wnn = jn[0] * yn[0] + jn[1] * yn[1] + jn[2] * yn[2]
    wnt = jn[0] * yt[0] + jn[1] * yt[1] + jn[2] * yt[2]
    wtt = jt[0] * yt[0] + jt[1] * yt[1] + jt[2] * yt[2]
    det = wnn * wtt - wnt * wnt
    pn, pt = (-un * wtt + ut * wnt) / det, (-ut * wnn + un * wnt) / det
    if pn > 0.0 and abs(pt) <= mu * pn:
        return pn, pt
    for first in (1, -1):
        sign = first if pt > 0 else -first
        slope = wnn + sign * mu * wnt
        if slope > 0.0:
            pn = -un / slope
            if (ut + (wnt + sign * mu * wtt) * pn) * sign <= 1e-15:
                return pn, sign * mu * pn
    return max(0.0, -un / max(wnn, 1e-300)), 0.0


@njit(cache=True)
def _step(px, py, w, mu, m, inertia, hc, start, pull, h, eps, touch, jn, jt, want, arm, mu_hand, loaded, work, out):
    """One implicit step in the frame of B; out = new velocity (3), force of the hand (2), lifted, tipped.

    Newton on the friction; where Newton turns in circles (the step in which sliding ends) one pass with the
    secant slope, which never overshoots.
    """
    coef, inverse = work
    system, rhs, abc = np.empty((3, 3)), np.empty(3), np.empty(3)
    f, k, b = np.empty(9), np.empty((3, 3)), np.empty(3)
    free, yn, yt = np.empty(3), np.zeros(3), np.zeros(3)
    v = start.copy()
    size = math.sqrt(inertia / m)
    theta, before = 1.0, np.inf
    lifted, tipped, converged = 0.0, 0.0, False
    for iteration in range(80):
        for tries in range(25):
            _moments(px, py, w, mu, loaded, v[0], v[1], v[2], eps, hc, coef, inverse, system)
            rhs[0], rhs[1], rhs[2] = m * GRAVITY, arm * out[3], arm * out[4]
            if not _solve3(system, rhs, abc) or (tries == 24 and iteration == 0):
                tipped = 1.0
                loaded[:] = 1.0
                abc[0], abc[1], abc[2] = m * GRAVITY, 0.0, 0.0
                _friction(px, py, w, loaded, abc, v[0], v[1], v[2], theta, coef, inverse, f)
                break
            if _friction(px, py, w, loaded, abc, v[0], v[1], v[2], theta, coef, inverse, f) == 0.0:
                break
        k[0, 0], k[1, 1], k[2, 2] = m + h * f[3], m + h * f[5], inertia + h * f[8]
        k[0, 1] = k[1, 0] = h * f[4]
        k[0, 2] = k[2, 0] = h * f[6]
        k[1, 2] = k[2, 1] = h * f[7]
        for i in range(3):
            inertial = inertia if i == 2 else m
            b[i] = h * f[i] + h * pull[i] + inertial * (start[i] - v[i])
        _solve3(k, b, free)
        pn = pt = 0.0
        if touch:
            _solve3(k, jn, yn)
            _solve3(k, jt, yt)
            for i in range(3):
                free[i] += v[i]
            pn, pt = _contact(free, yn, yt, jn, jt, want[0], want[1], mu_hand)
            for i in range(3):
                free[i] += yn[i] * pn + yt[i] * pt - v[i]
        moved = math.sqrt(free[0] ** 2 + free[1] ** 2 + (free[2] * size) ** 2)
        force_x, force_y = (jn[0] * pn + jt[0] * pt) / h, (jn[1] * pn + jt[1] * pt) / h
        drift = math.hypot(force_x - out[3], force_y - out[4]) * h / m
        for i in range(3):
            v[i] += free[i]
        out[3], out[4] = force_x, force_y
        if moved + drift < 1e-11:
            converged = True
            break
        theta = 1.0 if moved < 0.5 * before else 0.0
        before = moved
    for i in range(len(loaded)):
        if loaded[i] == 0.0:
            lifted = 1.0
            break
    out[0], out[1], out[2], out[5], out[6] = v[0], v[1], v[2], lifted, tipped
    return converged, pn


@njit(cache=True)
def _gap_at(q, t, com, polygon, radius, tip_radius, kt, kp, kv):
    """Gap, normal and arm (touched point minus Bcm) in W, for Bcm at q."""
    hx, hy, _, _ = tip_at(t, kt, kp, kv)
    c, s = math.cos(q[2]), math.sin(q[2])
    x, y = hx - q[0], hy - q[1]
    gap, nx, ny, rx, ry = _gap(c * x + s * y + com[0], -s * x + c * y + com[1], polygon, radius, tip_radius)
    rx, ry = rx - com[0], ry - com[1]
    return gap, c * nx - s * ny, s * nx + c * ny, c * rx - s * ry, s * rx + c * ry


@njit(cache=True)
def _part_until_touch(q, mean, t, h, new_q, com, polygon, radius, tip_radius, kt, kp, kv):
    """Share of a step after which the tip touches, by bisection along the straight step; new_q is left nearby."""
    low, high = 0.0, 1.0
    for _ in range(45):
        mid = (low + high) / 2
        for i in range(3):
            new_q[i] = q[i] + mid * h * mean[i]
        gap, _, _, _, _ = _gap_at(new_q, t + mid * h, com, polygon, radius, tip_radius, kt, kp, kv)
        low, high = (mid, high) if gap > 0 else (low, mid)
    return low


@njit(cache=True)
def _struck(v, contact, tip, m, inertia, mu_hand, restitution):
    """Changes v by the impact of a first touch; the speeds before it, its impulse, and whether they stay in touch."""
    _, nx, ny, rx, ry = contact
    _, _, hvx, hvy = tip
    ux, uy = v[0] - v[2] * ry - hvx, v[1] + v[2] * rx - hvy
    un, ut = ux * nx + uy * ny, -ux * ny + uy * nx
    if un >= 0.0:
        return un, ut, 0.0, 0.0, True
    e = restitution if -un > RESTITUTION_FLOOR else 0.0
    rn, rt = rx * ny - ry * nx, rx * nx + ry * ny
    pn, pt = routh_impact(m, inertia, rn, rt, un, ut, mu_hand, e)
    v[0] += (nx * pn - ny * pt) / m
    v[1] += (ny * pn + nx * pt) / m
    v[2] += (rn * pn + rt * pt) / inertia
    return un, ut, pn, pt, e == 0.0


@njit(cache=True)
def _write_pose(row, q, new_q, part, com):
    """Pose of Bo into the first three of row, where part of the step from q to new_q (of Bcm) is done."""
    yaw = q[2] + part * (new_q[2] - q[2])
    c, s = math.cos(yaw), math.sin(yaw)
    row[0] = q[0] + part * (new_q[0] - q[0]) - c * com[0] + s * com[1]
    row[1] = q[1] + part * (new_q[1] - q[1]) - s * com[0] - c * com[1]
    row[2] = yaw


@njit(cache=True)
def integrate(px, py, w, mu, frame, polygon, kt, kp, kv, tip, pose, velocity, times, time_step, eps):
    m, inertia, hc, radius = frame[0], frame[1], frame[2], frame[3]
    com, fext = frame[4:6], frame[6:8]
    has_hand, tip_radius, arm, mu_hand, restitution = tip[0] > 0, tip[1], tip[2] - hc, tip[3], tip[4]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    q = np.array([pose[0] + c * com[0] - s * com[1], pose[1] + s * com[0] + c * com[1], pose[2]])
    v = velocity.copy()
    new_q, mean = np.empty(3), np.empty(3)
    local, pull, want = np.empty(3), np.zeros(3), np.zeros(2)
    jn, jt, solved = np.zeros(3), np.zeros(3), np.zeros(7)
    loaded, work = np.ones(len(px)), np.empty((2, len(px)))
    out, impacts = np.zeros((len(times), 10)), []
    t, t_end, done, rest_time = times[0], times[-1], 0, np.inf
    touching, tipped, steps, unconverged, knot = False, False, 0, 0, 0
    size, pulled = math.sqrt(inertia / m), fext[0] != 0.0 or fext[1] != 0.0
    fastest = 0.0
    for k in range(len(kt)):
        fastest = max(fastest, math.hypot(kv[k, 0], kv[k, 1]))
    fx = fy = 0.0
    while done < len(times):
        while knot < len(kt) and kt[knot] <= t + 1e-12:
            knot += 1
        limit = kt[knot] if knot < len(kt) else np.inf
        resting = not pulled and math.hypot(math.hypot(v[0], v[1]), v[2] * size) < REST_SPEED
        h, lifted, moved = time_step, 0.0, True
        new_q[:] = q
        if resting and has_hand:
            v[:] = 0.0
            _, _, hvx, hvy = tip_at(t, kt, kp, kv)
            _, _, evx, evy = tip_at(min(limit, t_end) - 1e-9, kt, kp, kv)
            still = hvx == 0.0 and hvy == 0.0 and evx == 0.0 and evy == 0.0
            if still:  # nothing moves before the next knot
                h, moved, fx, fy = np.inf, False, 0.0, 0.0
                if limit == np.inf:
                    rest_time = min(rest_time, t)
                    touching = False
            elif not touching:
                gap, _, _, _, _ = _gap_at(q, t, com, polygon, radius, tip_radius, kt, kp, kv)
                if gap / fastest > 2 * time_step:  # the hand cannot arrive earlier
                    h, moved = 0.9 * gap / fastest, False
        elif resting:
            v[:] = 0.0
            h, moved, rest_time = np.inf, False, min(rest_time, t)
        h = min(h, limit - t, max(t_end - t, 1e-9))
        if moved:
            steps += 1
            struck = False
            for attempt in range(2):
                yaw = q[2] + h * v[2]
                c, s = math.cos(yaw), math.sin(yaw)
                local[0], local[1], local[2] = c * v[0] + s * v[1], -s * v[0] + c * v[1], v[2]
                pull[0], pull[1] = c * fext[0] + s * fext[1], -s * fext[0] + c * fext[1]
                if touching:
                    for i in range(3):
                        new_q[i] = q[i] + h * v[i]
                    gap, nx, ny, rx, ry = _gap_at(new_q, t + h, com, polygon, radius, tip_radius, kt, kp, kv)
                    _, _, hvx, hvy = tip_at(t + h, kt, kp, kv)
                    want[0] = hvx * nx + hvy * ny - DRIFT_GAIN * gap / time_step
                    want[1] = -hvx * ny + hvy * nx
                    jn[0], jn[1], jn[2] = c * nx + s * ny, -s * nx + c * ny, rx * ny - ry * nx
                    jt[0], jt[1], jt[2] = -jn[1], jn[0], rx * nx + ry * ny
                solved[3], solved[4] = (c * fx + s * fy, -s * fx + c * fy) if touching else (0.0, 0.0)
                good, pn = _step(
                    px, py, w, mu, m, inertia, hc, local, pull, h, eps, touching, jn, jt, want, arm, mu_hand,
                    loaded, work, solved,
                )  # fmt: skip
                wx, wy = c * solved[0] - s * solved[1], s * solved[0] + c * solved[1]
                mean[0], mean[1], mean[2] = (v[0] + wx) / 2, (v[1] + wy) / 2, (v[2] + solved[2]) / 2
                for i in range(3):
                    new_q[i] = q[i] + h * mean[i]
                if touching or not has_hand or attempt == 1:
                    break
                gap, nx, ny, rx, ry = _gap_at(new_q, t + h, com, polygon, radius, tip_radius, kt, kp, kv)
                if gap >= 0.0:
                    break
                start_gap, _, _, _, _ = _gap_at(q, t, com, polygon, radius, tip_radius, kt, kp, kv)
                if start_gap <= gap:  # already leaving
                    break
                struck = True
                if start_gap > 0:
                    h *= _part_until_touch(q, mean, t, h, new_q, com, polygon, radius, tip_radius, kt, kp, kv)
                else:
                    h = 0.0
                h = max(h, 1e-12)
            tipped = tipped or solved[6] > 0
            unconverged += 0 if good else 1
            lifted = solved[5]
            fx, fy = c * solved[3] - s * solved[4], s * solved[3] + c * solved[4]
            if touching and pn <= 0.0:
                touching = False
            v[0], v[1], v[2] = wx, wy, solved[2]
            if struck:
                contact = _gap_at(new_q, t + h, com, polygon, radius, tip_radius, kt, kp, kv)
                un, ut, pn, pt, touching = _struck(
                    v, contact, tip_at(t + h, kt, kp, kv), m, inertia, mu_hand, restitution
                )
                if un < 0.0:
                    impacts.append((t + h, -un, ut, pn, pt))
        while done < len(times) and (times[done] <= t + h + 1e-12):
            part = min(1.0, max(0.0, (times[done] - t) / h)) if h < np.inf else 0.0
            _write_pose(out[done], q, new_q, part, com)
            out[done, 3:6] = v
            out[done, 6], out[done, 7], out[done, 8], out[done, 9] = fx, fy, 1.0 if touching else 0.0, lifted
            done += 1
        q[:] = new_q
        t += h
    hits = np.zeros((len(impacts), 5))
    for i in range(len(impacts)):
        hits[i, 0], hits[i, 1], hits[i, 2], hits[i, 3], hits[i, 4] = impacts[i]
    return out, hits, rest_time, tipped, steps, unconverged
