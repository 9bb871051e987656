"""The vocabulary's laws as the compiled integrator evaluates them: friction of points, forces at Bcm."""

from __future__ import annotations

import math

from physid_drake.twin.compiled import compiled
from physid_drake.twin.plane import copied, length
from physid_drake.twin.records import (
    ATTRACTION,
    ELLIPSE,
    FALLING,
    FORCE_TABLE,
    GRADIENT,
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
    u = min(max((x - law.d) / law.f, 0.0), nx - 1.0)
    v = min(max((y - law.e) / law.g, 0.0), ny - 1.0)
    i, j = min(int(u), max(nx - 2, 0)), min(int(v), max(ny - 2, 0))
    du, dv, i1, j1 = u - i, v - j, min(i + 1, nx - 1), min(j + 1, ny - 1)
    low = tables[first + i * ny + j] * (1.0 - dv) + tables[first + i * ny + j1] * dv
    high = tables[first + i1 * ny + j] * (1.0 - dv) + tables[first + i1 * ny + j1] * dv
    return low * (1.0 - du) + high * du


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
    count = int(law.b)
    u = min(max((0.5 * math.log(max(square, SLOWEST * SLOWEST)) - law.c) / law.d, 0.0), count - 1.0)
    i = min(int(u), max(count - 2, 0))
    j, first = min(i + 1, count - 1), int(law.a)
    return tables[first + i] * (1.0 - (u - i)) + tables[first + j] * (u - i)


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
