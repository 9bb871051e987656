"""The vocabulary's laws as the compiled integrator evaluates them: friction of points, forces at Bcm."""

from __future__ import annotations

import math

from physid_drake.twin.compiled import compiled, compiled_inside
from physid_drake.twin.plane import copied, length, within
from physid_drake.twin.records import (
    ATTRACTION,
    ELLIPSE,
    FALLING,
    FORCE_TABLE,
    GRADIENT,
    HEADING_TABLE,
    MOTION_TABLE,
    PATCH,
    PLACE_TABLE,
    PUSH,
    QUADRATIC,
    SPEED_TABLE,
    SPRING,
    VISCOUS,
)

SMALLEST_DISC = 1e-9  # m
CLOSEST = 1e-9  # m: a spring to where the object is has no direction
CLOSEST_ATTRACTION = 1e-6  # m
SLOWEST = 1e-9  # m/s: of whose logarithm a table is asked
SOFTEST = 0.25  # of a factor: what resists at least, where a table of headings bends inwards


@compiled
def share_inside(away, circle, disc):
    """The share of a disc that lies in a circle, their middles ``away`` from each other [m]."""
    if away + disc <= circle:
        return 1.0
    if away - disc >= circle:
        return 0.0
    d = max(away, SMALLEST_DISC)
    of_disc = min(1.0, max(-1.0, (d * d + disc * disc - circle * circle) / (2.0 * d * disc)))
    of_circle = min(1.0, max(-1.0, (d * d + circle * circle - disc * disc) / (2.0 * d * circle)))
    kite = (disc + circle - d) * (d + disc - circle) * (d - disc + circle) * (d + disc + circle)
    lens = disc * disc * math.acos(of_disc) + circle * circle * math.acos(of_circle)
    return min(1.0, max(0.0, (lens - 0.5 * math.sqrt(max(kite, 0.0))) / (math.pi * disc * disc)))


@compiled
def on_table(law, first, x, y, tables):
    """Bilinear between the numbers of a table over places, and constant beyond its edge."""
    nx, ny = int(law.b), int(law.c)
    u, v = within((x - law.d) / law.f, nx - 1.0), within((y - law.e) / law.g, ny - 1.0)
    i = int(u)
    low = on_line(first + i * ny, ny, v, tables)
    return low + (u - i) * (on_line(first + min(i + 1, nx - 1) * ny, ny, v, tables) - low)


@compiled
def on_line(first, count, u, tables):
    """Linear between ``count`` numbers, at a place u within 0 and count - 1."""
    i = int(u)
    low = tables[first + i]
    return low + (u - i) * (tables[first + min(i + 1, count - 1)] - low)


@compiled
def over_speed(law, first, square, tables):
    """Linear over the logarithm of a speed, of which the square is given [m^2/s^2], and constant beyond both ends."""
    count = int(law.b)
    logarithm = 0.5 * math.log(max(square, SLOWEST * SLOWEST))
    return on_line(first, count, within((logarithm - law.c) / law.d, count - 1.0), tables)


@compiled
def friction_by_place(laws, tables, px, py, radii, x, y, yaw, plain, mu):
    """The coefficients (n,) of points, with what the laws make of where they are.

    Args:
        laws: records.
        tables: numbers of all tables.
        px, py: (n,) points from Bcm in B [m].
        radii: (n,) of the discs that they stand for [m].
        x, y, yaw: of Bcm in W [m, rad].
        plain: (n,) without any law.
        mu: (n,) is filled in.
    """
    copied(plain, mu)
    c, s = math.cos(yaw), math.sin(yaw)
    for law in laws:
        if law.kind == PATCH:
            for i in range(len(px)):
                away = length(x + c * px[i] - s * py[i] - law.b, y + s * px[i] + c * py[i] - law.c)
                mu[i] *= 1.0 + (law.a - 1.0) * share_inside(away, law.d, max(radii[i], SMALLEST_DISC))
        elif law.kind == GRADIENT:
            for i in range(len(px)):
                wx, wy = x + c * px[i] - s * py[i], y + s * px[i] + c * py[i]
                mu[i] *= min(max(1.0 + law.a * wx + law.b * wy, 0.0), law.c)
        elif law.kind == PLACE_TABLE:
            for i in range(len(px)):
                wx, wy = x + c * px[i] - s * py[i], y + s * px[i] + c * py[i]
                mu[i] *= on_table(law, int(law.a), wx, wy, tables)


@compiled
def friction_by_speed(laws, tables, px, py, vx, vy, spin, mu, into):
    """What the laws make of the coefficients (n,) at the points' slips; whether any does."""
    found = False
    for law in laws:
        if law.kind in (FALLING, SPEED_TABLE):
            for i in range(len(px)):
                sx, sy = vx - spin * py[i], vy + spin * px[i]
                factor = _by_speed(law, tables, sx * sx + sy * sy)
                into[i] = (into[i] if found else mu[i]) * factor
            found = True
    return found


@compiled
def _by_speed(law, tables, square):
    if law.kind == FALLING:
        return 1.0 + law.a * math.exp(-square / (law.b * law.b))
    return over_speed(law, int(law.a), square, tables)


@compiled
def has(laws, kind):
    """Whether there is a law of a kind."""
    found = False
    for law in laws:
        found = found or law.kind == kind
    return found


@compiled
def friction_by_heading(laws, tables, turns, mu, along, across, stiff):
    """What the laws make of the coefficients (n,) of points by the heading of their slip.

    Args:
        laws, tables: records, numbers.
        turns: (n,) headings in W, in whole turns.
        mu: (n,) without them.
        along, across: (n,) of the friction that brakes, and of that which turns to the left of it; filled in.
        stiff: (n,) of what resists a change of velocity across the slip; filled in.
    """
    copied(mu, along)
    copied(mu, stiff)
    across[:] = 0.0
    for law in laws:
        if law.kind == HEADING_TABLE:
            first, count = int(law.a), int(law.b)
            for i in range(len(turns)):
                factor, turn, bend = _by_heading(tables, first, count, turns[i])
                along[i], across[i] = along[i] * factor - across[i] * turn, along[i] * turn + across[i] * factor
                along[i] = max(along[i], 0.0)
                stiff[i] *= max(factor + bend, SOFTEST * factor)


@compiled_inside
def _by_heading(tables, first, count, turns):
    """A factor, its slope, and that slope's own, at an angle in W of so many whole turns."""
    u = within((turns - math.floor(turns)) * count, float(count))
    part = u - int(u)
    i = int(u) if u < count else 0
    j = i + 1 if i + 1 < count else 0
    factor, turn = tables[first + i], tables[first + count + i]
    bend = tables[first + count + j] - turn
    return factor + part * (tables[first + j] - factor), turn + part * bend, bend * count / (2.0 * math.pi)


@compiled
def least_friction(laws, tables):
    """The least factor by which the laws of slip change the friction of what begins to slip."""
    least = 1.0
    for law in laws:
        if law.kind == ELLIPSE:
            least *= math.sqrt(min(law.a, 1.0 / law.a))
        elif law.kind == FALLING:
            least *= 1.0 + law.a
        elif law.kind == SPEED_TABLE:
            least *= tables[int(law.a)]
        elif law.kind == HEADING_TABLE:
            first = int(law.a)
            lowest = tables[first]
            for i in range(int(law.b)):
                lowest = min(lowest, tables[first + i])
            least *= lowest
    return least


@compiled
def ellipse(laws, yaw):
    """The squared ellipse of friction in B: xx, xy, yy; 1, 0, 1 of a circle.

    Of several, logarithms are added: what the order of two multiplications would change is of second order.
    """
    cosine, sine = 0.0, 0.0
    for law in laws:
        if law.kind == ELLIPSE:
            angle = 2.0 * (law.b - (0.0 if law.c > 0.0 else yaw))
            cosine += math.log(law.a) * math.cos(angle)
            sine += math.log(law.a) * math.sin(angle)
    size = length(cosine, sine)
    if size == 0.0:
        return 1.0, 0.0, 1.0
    mean, half = math.cosh(size), -math.sinh(size)
    return mean + half * cosine / size, half * sine / size, mean - half * cosine / size


@compiled
def force_by_place(laws, tables, x, y):
    """Force at Bcm that does not depend on velocity, in W [N]."""
    fx = fy = 0.0
    for law in laws:
        if law.kind == PUSH:
            fx += law.a
            fy += law.b
        elif law.kind == SPRING:
            dx, dy = law.b - x, law.c - y
            distance = length(dx, dy)
            pull = law.a * max(0.0, distance - law.d) / max(distance, CLOSEST)
            fx += pull * dx
            fy += pull * dy
        elif law.kind == ATTRACTION:
            dx, dy = law.b - x, law.c - y
            square = dx * dx + dy * dy
            pull = law.a / (square + law.d * law.d) / max(math.sqrt(square), CLOSEST_ATTRACTION)
            fx += pull * dx
            fy += pull * dy
        elif law.kind == FORCE_TABLE:
            fx += on_table(law, int(law.a), x, y, tables)
            fy += on_table(law, int(law.a + law.b * law.c), x, y, tables)
    return fx, fy


@compiled
def force_by_motion(laws, tables, vx, vy):
    """Force at Bcm along its velocity and across it, and how it resists a change of that: fx, fy, xx, xy, yy.

    Only brakes resist, below their slowest speed along the velocity and across it, above it across it.

    Args:
        laws, tables: records, numbers.
        vx, vy: in any frame that is turned about the vertical [m/s].
    """
    fx = fy = xx = xy = yy = 0.0
    square = vx * vx + vy * vy
    for law in laws:
        if law.kind == MOTION_TABLE:
            speed = max(math.sqrt(square), law.e)
            along = over_speed(law, int(law.a), square, tables) / speed
            across = over_speed(law, int(law.a + law.b), square, tables) / speed
            fx += along * vx - across * vy
            fy += along * vy + across * vx
            brake = max(0.0, -along)
            bent = brake / square if square > law.e * law.e else 0.0
            xx += brake - bent * vx * vx
            xy -= bent * vx * vy
            yy += brake - bent * vy * vy
    return fx, fy, xx, xy, yy


@compiled
def drags(laws):
    """Coefficients of drag: linear [N s/m], of turning [N m s], quadratic [N s^2/m^2]."""
    linear = turning = quadratic = 0.0
    for law in laws:
        if law.kind == VISCOUS:
            linear += law.a
            turning += law.b
        elif law.kind == QUADRATIC:
            quadratic += law.a
    return linear, turning, quadratic
