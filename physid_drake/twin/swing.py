"""A mass that swings inside the object on a spring and a damper: liquid in a bottle.

d = place of the mass less that of Bcm, w its velocity: m w' = -F, F = k d + c (w - v - spin x d), which acts on the
object; the damper's part acts where the mass is, and turns it.
"""

from __future__ import annotations

import math

from physid_drake.twin.compiled import compiled, compiled_inside


@compiled
def pull_of(body, g, swing, spin):
    """Over a stage of length g [s] the force on the object is fx, fy less ``drag`` times its velocity at the end.

    Args:
        body: record of the object.
        g: s.
        swing: (dx, dy, wx, wy) where the stage starts.
        spin: of the object then [rad/s].

    Returns:
        fx, fy [N], drag [N s/m].
    """
    if body.swing_mass == 0.0:
        return 0.0, 0.0, 0.0
    k, c = body.swing_stiffness, body.swing_damping
    alpha = g * (k * g + c) / body.swing_mass
    drag = (k * g + c) / (1.0 + alpha)
    fx = (k * swing[0] + c * spin * swing[1]) / (1.0 + alpha) + drag * swing[2]
    fy = (k * swing[1] - c * spin * swing[0]) / (1.0 + alpha) + drag * swing[3]
    return fx, fy, drag


@compiled
def swing_after(body, g, swing, spin, vx, vy):
    """(dx, dy, wx, wy) at the end of the stage, at which the object has the velocity (vx, vy) in W."""
    if body.swing_mass == 0.0:
        return swing
    fx, fy, drag = pull_of(body, g, swing, spin)
    wx = swing[2] - g * (fx - drag * vx) / body.swing_mass
    wy = swing[3] - g * (fy - drag * vy) / body.swing_mass
    return swing[0] + g * (wx - vx), swing[1] + g * (wy - vy), wx, wy


@compiled_inside
def torque_of(body, swing, vx, vy, spin):
    """Of the damper on the object [N m]."""
    if body.swing_mass == 0.0:
        return 0.0
    rx, ry = swing[2] - vx + spin * swing[1], swing[3] - vy - spin * swing[0]
    return body.swing_damping * (swing[0] * ry - swing[1] * rx)


@compiled
def strongest(body, state):
    """The largest force [N] that it may yet bring while the object rests."""
    if body.swing_mass == 0.0:
        return 0.0
    square = body.swing_stiffness / body.swing_mass
    away = state.dx * state.dx + state.dy * state.dy + (state.wx * state.wx + state.wy * state.wy) / square
    return body.swing_stiffness * math.sqrt(away)


@compiled
def swing_at_rest(body, state, span):
    """Let it swing for a time [s] in an object that rests: exactly."""
    if body.swing_mass == 0.0:
        return
    decay = 0.5 * body.swing_damping / body.swing_mass
    square = body.swing_stiffness / body.swing_mass - decay * decay
    root = math.sqrt(abs(square))
    left = math.exp(-decay * span)
    if square > 0.0:
        even, odd = math.cos(root * span), math.sin(root * span) / root
    elif root > 0.0:
        even, odd = math.cosh(root * span), math.sinh(root * span) / root
    else:
        even, odd = 1.0, span
    own = body.swing_stiffness / body.swing_mass
    state.dx, state.wx = _swung(state.dx, state.wx, decay, own, left * even, left * odd)
    state.dy, state.wy = _swung(state.dy, state.wy, decay, own, left * even, left * odd)


@compiled
def _swung(d, w, decay, own, even, odd):
    return d * even + (w + decay * d) * odd, w * even - (own * d + decay * w) * odd
