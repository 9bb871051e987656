"""The hand's tip: moved as its path says, or on a spring and a damper that give way."""

from __future__ import annotations

from physid_drake.twin.compiled import compiled
from physid_drake.twin.hand import gap_between, hand_at


@compiled
def tip_at(body, hand, state, t, before):
    """Place and velocity of the tip: the hand's, or its own where it gives way."""
    hx, hy, hvx, hvy = hand_at(t, before, hand[0], hand[1], hand[2])
    if body.tip_stiffness > 0.0:
        return hx - state.ex, hy - state.ey, state.ux, state.uy
    return hx, hy, hvx, hvy


@compiled
def part(body, state, gap, nx, ny):
    """Close a gap [m], or an overlap: by the tip's place where it gives way, else by the object's."""
    if body.tip_stiffness > 0.0:
        state.ex, state.ey = state.ex - gap * nx, state.ey - gap * ny
    else:
        state.x, state.y = state.x - gap * nx, state.y - gap * ny


@compiled
def contact_at(body, edges, hand, t, g, x, y, yaw, tip, later_x, later_y, touching, contact):
    """The tip's contact at the end of a stage, with the object at a pose; the hand's velocity is that before a knot.

    A tip that gives way obeys m u' = k e + d (v - u) - F, e' = v - u, with the hand's velocity v. Over a stage of
    length g from (e, u), its velocity is that without a contact, less ``gives`` per impulse.

    Args:
        body, edges, hand: of the rollout.
        t: when the stage ends [s].
        g: length of the stage [s].
        x, y, yaw: of Bcm then.
        tip: (ex, ey, ux, uy) where the stage starts.
        later_x, later_y: about the tip's velocity at its end [m/s].
        touching: whether it touches.
        contact: record, filled in.
    """
    contact.gives = 0.0
    contact.touching = 1.0 if touching else 0.0
    if (not touching and body.tip_stiffness == 0.0) or len(hand[0]) == 0:
        return
    hx, hy, hvx, hvy = hand_at(t, True, hand[0], hand[1], hand[2])
    contact.hand_vx, contact.hand_vy = hvx, hvy
    if body.tip_stiffness > 0.0:
        k, d = body.tip_stiffness, body.tip_damping
        contact.gives = 1.0 / (body.tip_mass + g * d + g * g * k)
        hx, hy = hx - tip[0] - g * (hvx - later_x), hy - tip[1] - g * (hvy - later_y)
        hvx = contact.gives * (body.tip_mass * tip[2] + g * k * tip[0] + (g * d + g * g * k) * hvx)
        hvy = contact.gives * (body.tip_mass * tip[3] + g * k * tip[1] + (g * d + g * g * k) * hvy)
    contact.vx, contact.vy = hvx, hvy
    if touching:
        _, contact.nx, contact.ny, contact.rx, contact.ry = gap_between(x, y, yaw, hx, hy, body, edges)


@compiled
def tip_after(g, tip, contact, solved):
    """Of a tip that gives way, at the end of a stage: (ex, ey, ux, uy)."""
    if contact.gives == 0.0:
        return tip
    touching = contact.touching > 0.0
    ux = contact.vx - (contact.gives * g * solved.fx if touching else 0.0)
    uy = contact.vy - (contact.gives * g * solved.fy if touching else 0.0)
    return tip[0] + g * (contact.hand_vx - ux), tip[1] + g * (contact.hand_vy - uy), ux, uy
