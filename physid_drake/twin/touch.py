"""How tip and object meet, strike, stay together and part."""

from __future__ import annotations

from physid_drake.twin.compiled import compiled
from physid_drake.twin.contact import blow
from physid_drake.twin.hand import gap_between, hand_at
from physid_drake.twin.tip import part, tip_at

GENTLE = 1e-3  # m/s: slower touches are no blows
AFTER_BLOW = 5e-4  # s
CORRECTED = 5e-4  # m of a gap that a step leaves


@compiled
def strike(body, object_, hand, state):
    """The tip meets the object: a blow, or a touch that stays where it is gentle or does not rebound."""
    hx, hy, hvx, hvy = tip_at(body, hand, state, state.t, False)
    gap, nx, ny, rx, ry = gap_between(state.x, state.y, state.yaw, hx, hy, body, object_[6])
    if gap < 0.0:
        part(body, state, gap, nx, ny)
    ux, uy = state.vx - state.spin * ry - hvx, state.vy + state.spin * rx - hvy
    un = ux * nx + uy * ny
    state.ax = state.ay = state.aspin = 0.0
    if un >= 0.0:
        state.touching = 1.0
        return
    restitution = body.restitution if un < -GENTLE else 0.0
    _kick(body, state, nx, ny, rx, ry, un, uy * nx - ux * ny, restitution)
    state.next = AFTER_BLOW
    state.touching = 1.0 if restitution == 0.0 else 0.0


@compiled
def jerk(body, object_, hand, state):
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
    gives = 1.0 / body.tip_mass if body.tip_stiffness > 0.0 else 0.0
    pn, pt = blow(body.mass, body.inertia, rn, rt, un, ut, body.hand_friction, restitution, gives)
    state.ux -= gives * (nx * pn - ny * pt)
    state.uy -= gives * (ny * pn + nx * pt)
    state.vx += (nx * pn - ny * pt) / body.mass
    state.vy += (ny * pn + nx * pt) / body.mass
    state.spin += (rn * pn + rt * pt) / body.inertia


@compiled
def keep_touching(body, edges, hand, solved, state):
    """Let go where nothing presses any more; else take back what the gap has drifted by."""
    hx, hy, _, _ = tip_at(body, hand, state, state.t, True)
    gap, nx, ny, _, _ = gap_between(state.x, state.y, state.yaw, hx, hy, body, edges)
    apart = solved.normal <= 0.0
    if apart:
        state.touching = state.fx = state.fy = state.ax = state.ay = state.aspin = 0.0
    if gap < 0.0 if apart else abs(gap) < CORRECTED:
        part(body, state, gap, nx, ny)


@compiled
def meeting(body, edges, hand, state, h, x1, y1, yaw1, tip):
    """The share of a step after which the tip meets the object; 1 or more where it does not."""
    hx, hy, _, _ = hand_at(state.t + h, True, hand[0], hand[1], hand[2])
    after, _, _, _, _ = gap_between(x1, y1, yaw1, hx - tip[0], hy - tip[1], body, edges)
    if after >= 0.0:
        return 2.0
    hx, hy, ux, uy = tip_at(body, hand, state, state.t, False)
    before, nx, ny, rx, ry = gap_between(state.x, state.y, state.yaw, hx, hy, body, edges)
    if before <= 1e-10:
        rate = nx * (state.vx - state.spin * ry - ux) + ny * (state.vy + state.spin * rx - uy)
        return 2.0 if rate > 0.0 and before < after else 0.0
    _, _, hvx, hvy = hand_at(state.t, False, hand[0], hand[1], hand[2])
    stretch_x, stretch_y = (hvx - ux, hvy - uy) if body.tip_stiffness > 0.0 else (0.0, 0.0)
    low, high, gap_low, gap_high = 0.0, 1.0, before, after
    for _ in range(40):
        u = low + (high - low) * min(max(gap_low / (gap_low - gap_high), 0.02), 0.98)
        hx, hy, _, _ = hand_at(state.t + u * h, False, hand[0], hand[1], hand[2])
        gap, _, _, _, _ = gap_between(
            _between(u, h, state.x, state.vx, x1), _between(u, h, state.y, state.vy, y1),
            _between(u, h, state.yaw, state.spin, yaw1),
            hx - _between(u, h, state.ex, stretch_x, tip[0]), hy - _between(u, h, state.ey, stretch_y, tip[1]),
            body, edges,
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
