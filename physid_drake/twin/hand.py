"""Where the hand is: a path of piecewise linear velocity, and how far its tip is from the object's outline."""

from __future__ import annotations

import math

import numpy as np

from physid_drake.twin.compiled import compiled
from physid_drake.twin.plane import length

AT_ONCE = 1e-12  # s


@compiled
def places_of_knots(times, velocities, start, places):
    """Where the hand is at the knots: (k, 2), filled in.

    Args:
        times: (k,) knots [s].
        velocities: (k, 2) at them [m/s].
        start: (2,) place at the first [m].
        places: (k, 2) at all of them [m], filled in.
    """
    wx = wy = 0.0
    for i in range(len(times)):
        if i > 0:
            half = (times[i] - times[i - 1]) * 0.5
            wx += half * (velocities[i, 0] + velocities[i - 1, 0])
            wy += half * (velocities[i, 1] + velocities[i - 1, 1])
        places[i, 0], places[i, 1] = start[0] + wx, start[1] + wy


@compiled
def hand_at(t, before, times, places, velocities):
    """Place and velocity of the hand, which stands before the first knot and after the last.

    Args:
        t: time [s].
        before: whether the velocity is that just before ``t``, or from then on; at a knot it may jump.
        times: (k,) knots [s].
        places: (k, 2) at them [m].
        velocities: (k, 2) at them [m/s].
    """
    last = len(times) - 1
    if t < times[0] or (before and t <= times[0]):
        return places[0, 0], places[0, 1], 0.0, 0.0
    if t > times[last] + AT_ONCE or (not before and t >= times[last]):
        return places[last, 0], places[last, 1], 0.0, 0.0
    asked = t - AT_ONCE if before else t
    k = min(max(np.searchsorted(times, asked, side="right") - 1, 0), last - 1)
    into, span = t - times[k], times[k + 1] - times[k]
    vx, vy = velocities[k, 0], velocities[k, 1]
    ax, ay = (velocities[k + 1, 0] - vx) / span, (velocities[k + 1, 1] - vy) / span
    return (
        places[k, 0] + into * (vx + 0.5 * ax * into),
        places[k, 1] + into * (vy + 0.5 * ay * into),
        vx + ax * into,
        vy + ay * into,
    )


@compiled
def nearest(x, y, edges, radius, notched):
    """Signed distance [m] from a point to an outline in B, negative inside, and the outward normal there.

    Args:
        x, y: the point in B [m].
        edges: (k, 5) of a polygon, counter-clockwise: corner x, y [m], direction x, y, length [m]; none of a disc.
        radius: of a disc about Bo [m].
        notched: 1 where the polygon is not convex.
    """
    if len(edges) == 0:
        r = length(x, y)
        return (r - radius, x / r, y / r) if r > 0.0 else (-radius, 1.0, 0.0)
    if notched > 0.0:
        return _nearest_of_all(x, y, edges)
    height, face = -np.inf, 0
    for i in range(len(edges)):
        above = (x - edges[i, 0]) * edges[i, 3] - (y - edges[i, 1]) * edges[i, 2]
        if above > height:
            height, face = above, i
    along = (x - edges[face, 0]) * edges[face, 2] + (y - edges[face, 1]) * edges[face, 3]
    if height <= 0.0 or 0.0 <= along <= edges[face, 4]:
        return height, edges[face, 3], -edges[face, 2]
    return _corner(x, y, edges)


@compiled
def _nearest_of_all(x, y, edges):
    """The same of an outline with notches: every edge is asked, and a ray along x says whether it is inside."""
    least, nx, ny, crossings = np.inf, 1.0, 0.0, 0
    for i in range(len(edges)):
        ax, ay, tx, ty, long = edges[i, 0], edges[i, 1], edges[i, 2], edges[i, 3], edges[i, 4]
        along = min(max((x - ax) * tx + (y - ay) * ty, 0.0), long)
        dx, dy = x - ax - along * tx, y - ay - along * ty
        r = length(dx, dy)
        if r < least:
            least = r
            nx, ny = (dx / r, dy / r) if r > 0.0 else (ty, -tx)
        by = ay + ty * long
        if (ay > y) != (by > y) and x < ax + tx * (y - ay) / ty:
            crossings += 1
    return (-least, -nx, -ny) if crossings % 2 == 1 else (least, nx, ny)


@compiled
def _corner(x, y, edges):
    """The same where a corner is nearest: beyond the end of the most separated face."""
    least, dx, dy = np.inf, 1.0, 0.0
    for i in range(len(edges)):
        ex, ey = x - edges[i, 0], y - edges[i, 1]
        r = length(ex, ey)
        if r < least:
            least, dx, dy = r, ex, ey
    return (least, dx / least, dy / least) if least > 0.0 else (0.0, 1.0, 0.0)


@compiled
def gap_between(x, y, yaw, tip_x, tip_y, body, edges):
    """Gap between tip and object [m], its normal from tip to object in W, and the arm from Bcm to the contact [m].

    Args:
        x, y, yaw: of Bcm in W [m, rad].
        tip_x, tip_y: the tip's axis [m].
        body: record of the object.
        edges: of its outline.
    """
    c, s = math.cos(yaw), math.sin(yaw)
    dx, dy = tip_x - x, tip_y - y
    distance, bx, by = nearest(
        c * dx + s * dy + body.com_x, c * dy - s * dx + body.com_y, edges, body.outline_radius, body.notched
    )
    nx, ny = -(c * bx - s * by), -(s * bx + c * by)
    gap = distance - body.tip_radius
    reach = body.tip_radius + gap
    return gap, nx, ny, dx + reach * nx, dy + reach * ny
