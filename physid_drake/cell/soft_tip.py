"""A tip that gives way: a light mass on a planar spring and damper, which meets the object on its outline.

Drake's own hand goes where it is told. A sprung one needs a contact of its own, solved here in the plane and in
closed form: Coulomb friction between two points, each of which answers an impulse linearly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from physid_drake.cell.impact import impulse_between
from physid_drake.cell.setters import Body
from physid_drake.cell.touch import Planar, Tip, Touch

Plane = tuple[float, float]

SUBSTEP = 1e-3  # s, at most
MENDED = 2e-4  # m: a gap within which a held tip is put back on the outline, which a linear step leaves by less
NEAR = 2.0  # steps ahead at which a tip that coasts counts as arriving
HAIR = 1e-6  # m


@dataclass(frozen=True, kw_only=True)
class Mount:
    """What holds the tip in the plane, alike in all directions.

    Attributes:
        stiffness: N/m.
        damping: N s/m.
        mass: that moves with the tip [kg]; 0 is allowed.
    """

    stiffness: float
    damping: float
    mass: float


class TipImpulse(NamedTuple):
    """Impulse of the tip on the object over a time step in W [N s], and its angular one about Bcm [N m s]."""

    jx: float
    jy: float
    spin: float


class SoftTip:
    """The tip's own motion over a rollout.

    Over a time step the object is taken to keep the acceleration that everything but the tip gave it in the time step
    before, friction with the table above all; the tip's impulse then acts at the time step's start.
    """

    def __init__(self, mount: Mount, tip: Tip, body: Body, inertia: float) -> None:
        """Prepare.

        Args:
            mount: what holds the tip.
            tip: its shape, beside the object's outline.
            body: mass, centre of mass, friction with the tip and restitution.
            inertia: of the object about z through Bcm [kg m^2].
        """
        self._mount, self._tip, self._body, self._inertia = mount, tip, body, inertia
        self.place: list[float] = [0.0, 0.0]
        self.velocity: Plane = (0.0, 0.0)
        self._held = False
        self._last: tuple[float, Planar, Planar] | None = None  # span, twist before, what the push gave

    def begin(self, pose: Planar, place: list[float], velocity: Plane) -> None:
        """Start unloaded at a place [m], or on the outline where the object is in the way."""
        gap, nx, ny = self._tip.gap(*pose, *place)
        overlap = max(0.0, -gap)
        self.place = [place[0] - overlap * nx, place[1] - overlap * ny]
        self.velocity, self._held, self._last = velocity, overlap > 0.0, None

    @property
    def held(self) -> bool:
        """Whether the tip pressed on the object at the end of the last time step."""
        return self._held

    def gap(self, pose: Planar) -> float:
        """To the object [m]."""
        return self._tip.gap(*pose, *self.place)[0]

    def arrives(self, pose: Planar, span: float) -> bool:
        """Whether it may meet an object at rest within a few time steps of ``span`` [s]."""
        return self.gap(pose) < HAIR + NEAR * span * math.hypot(*self.velocity)

    def coast(self, goal: list[float], velocity: Plane, span: float) -> None:
        """Move freely over a time step, at the end of which the mount is at ``goal`` [m]."""
        self._held, self._last = False, None
        ex, ey = self._stretch(goal, velocity, span)
        flow = _Flow(self._mount, span)
        ex, ux = flow.free(ex, self.velocity[0], velocity[0])
        ey, uy = flow.free(ey, self.velocity[1], velocity[1])
        self.place, self.velocity = [goal[0] - ex, goal[1] - ey], (ux, uy)

    def step(self, touch: Touch, goal: list[float], velocity: Plane, span: float) -> TipImpulse | None:
        """Move over a time step beside the object; returns what it gives to the object, if it touches.

        Args:
            touch: of object and tip as they are.
            goal: where the mount is at the end [m].
            velocity: of the mount [m/s].
            span: of the time step [s].
        """
        pull = self._pull(touch)
        touch = self._mended(touch)
        body, inertia, (vx, vy, wz) = self._body, self._inertia, touch.twist
        c, s = math.cos(touch.pose[2]), math.sin(touch.pose[2])
        cx, cy = float(body.p_BBcm[0]), float(body.p_BBcm[1])
        bx, by = c * cx - s * cy, s * cx + c * cy
        mx, my = touch.rx - bx, touch.ry - by  # contact point from Bcm

        def turned(x: float, y: float) -> Plane:
            return touch.nx * x + touch.ny * y, touch.nx * y - touch.ny * x

        lever_n, lever_t = turned(mx, my)
        meeting = _Meeting(
            gap=touch.gap,
            stretch=turned(*self._stretch(goal, velocity, span)),
            tip=turned(*self.velocity),
            mount=turned(*velocity),
            face=turned(vx - wz * touch.ry, vy + wz * touch.rx),
            pull=turned(pull[0] - pull[2] * touch.ry, pull[1] + pull[2] * touch.rx),
            yields=(
                1.0 / body.mass + lever_t * lever_t / inertia,
                1.0 / body.mass + lever_n * lever_n / inertia,
                lever_n * lever_t / inertia,
            ),
            friction=body.hand_friction,
            restitution=0.0 if self._held else body.restitution,
        )
        jn, jt = meeting.run(_Flow(self._mount, span))
        self._held = meeting.held

        def back(n: float, t: float) -> Plane:
            return touch.nx * n - touch.ny * t, touch.ny * n + touch.nx * t

        ex, ey = back(*meeting.stretch)
        self.place, self.velocity = [goal[0] - ex, goal[1] - ey], back(*meeting.tip)
        jx, jy = back(jn, jt)
        spin = mx * jy - my * jx
        gain = spin / inertia
        self._last = (span, touch.twist, (jx / body.mass + gain * by, jy / body.mass - gain * bx, gain))
        return TipImpulse(jx, jy, spin) if jn > 0.0 else None

    def _stretch(self, goal: list[float], velocity: Plane, span: float) -> Plane:
        """From the tip to the mount at the start of a time step [m]."""
        return goal[0] - span * velocity[0] - self.place[0], goal[1] - span * velocity[1] - self.place[1]

    def _pull(self, touch: Touch) -> Planar:
        """Acceleration of the object in the time step before, less what the tip gave it."""
        if self._last is None:
            return 0.0, 0.0, 0.0
        span, before, given = self._last
        ax, ay, turn = (
            (now - then - gift) / span for now, then, gift in zip(touch.twist, before, given, strict=True)
        )
        return ax, ay, turn

    def _mended(self, touch: Touch) -> Touch:
        """The touch with a tip on the outline if it is held there, or was driven into it."""
        if touch.gap < 0.0 or (self._held and touch.gap < MENDED):
            self.place = [self.place[0] + touch.gap * touch.nx, self.place[1] + touch.gap * touch.ny]
            return touch._replace(gap=0.0)
        return touch


class _Flow:
    """Steps of the tip on its mount in one direction: the trapezoidal rule, for a light or stiff tip implicit Euler.

    Between the two the weight of the end is the least that lets no step swing through.
    """

    def __init__(self, mount: Mount, span: float) -> None:
        self.count = max(1, math.ceil(span / SUBSTEP - 1e-6))
        h = self.step = span / self.count
        mass, damper, spring = mount.mass, h * mount.damping, h * h * mount.stiffness
        end = self.end = max(0.5, 1.0 - mass / (damper + spring))
        drag = damper + end * spring
        self.yields = 1.0 / (mass + end * drag)
        self._keep = self.yields * (mass - (1.0 - end) * drag)
        self._spring, self._drag = self.yields * h * mount.stiffness, self.yields * drag

    def velocity(self, stretch: float, tip: float, mount: float) -> float:
        """The free tip's velocity after a step that begins with the mount ``stretch`` [m] before it."""
        return self._keep * tip + self._spring * stretch + self._drag * mount

    def free(self, stretch: float, tip: float, mount: float) -> tuple[float, float]:
        """Stretch [m] and velocity, over the time step, of a tip that meets nothing."""
        for _ in range(self.count):
            after = self.velocity(stretch, tip, mount)
            stretch += self.step * (mount - self.way(tip, after))
            tip = after
        return stretch, tip

    def way(self, before: float, after: float) -> float:
        """Mean velocity over a step, of the free tip."""
        return before + self.end * (after - before)


@dataclass(kw_only=True)
class _Meeting:
    """Tip and object over a time step, along the normal into the object and the tangent, n turned by +90 degrees.

    Attributes:
        gap: m.
        stretch: mount before tip [m].
        tip: velocity of the tip [m/s].
        mount: velocity of the mount [m/s].
        face: velocity of the object's contact point [m/s].
        pull: its acceleration without the tip [m/s^2].
        yields: what the contact point gains by impulses, normal by normal, tangent by tangent, and less crosswise,
            as in ``routh_impulse`` [1/kg].
        friction: Coulomb coefficient [-].
        restitution: of a first touch [-].
        held: whether the tip presses at the end.
    """

    gap: float
    stretch: Plane
    tip: Plane
    mount: Plane
    face: Plane
    pull: Plane
    yields: tuple[float, float, float]
    friction: float
    restitution: float
    held: bool = False

    def run(self, flow: _Flow) -> Plane:
        """Advance over the time step; returns the impulse on the object [N s]."""
        h, tip_yields = flow.step, flow.yields
        (en, et), (un, ut), (vn, vt), (cn, ct) = self.stretch, self.tip, self.face, self.mount
        normal, tangent, cross = self.yields
        sum_n = sum_t = 0.0
        for _ in range(flow.count):
            new_un, new_ut = flow.velocity(en, un, cn), flow.velocity(et, ut, ct)
            new_vn, new_vt = vn + h * self.pull[0], vt + h * self.pull[1]
            room = self.gap + h * (0.5 * (vn + new_vn) - flow.way(un, new_un))
            need = new_un - new_vn
            self.held = room < 0.0 < need
            if self.held:
                jn, jt = self._impulse(need, new_vt - new_ut, (normal + tip_yields, tangent + tip_yields, cross))
                sum_n, sum_t = sum_n + jn, sum_t + jt
                new_un, new_ut = new_un - tip_yields * jn, new_ut - tip_yields * jt
                new_vn, new_vt = new_vn + normal * jn - cross * jt, new_vt + tangent * jt - cross * jn
                # It ends on the outline, wherever in the step it came there.
                room, way = 0.0, self.gap / h + 0.5 * (vn + new_vn)
                self.restitution = 0.0
            else:
                way = flow.way(un, new_un)
            en, et = en + h * (cn - way), et + h * (ct - flow.way(ut, new_ut))
            un, ut, vn, vt, self.gap = new_un, new_ut, new_vn, new_vt, room
        self.stretch, self.tip, self.face = (en, et), (un, ut), (vn, vt)
        return sum_n, sum_t

    def _impulse(self, need: float, slip: float, yields: tuple[float, float, float]) -> Plane:
        """Normal and tangent impulse [N s] that part the points, or throw them apart; as of ``_coulomb``."""
        if self.restitution == 0.0:
            return _coulomb(need, slip, yields, self.friction)
        impulse = impulse_between(
            yields=yields, approach=-need, slip=slip, friction=self.friction, restitution=self.restitution
        )  # fmt: skip
        return impulse.normal, impulse.tangent


def _coulomb(need: float, slip: float, yields: tuple[float, float, float], friction: float) -> Plane:
    """Normal and tangent impulse [N s] that part two points.

    Args:
        need: normal velocity to gain [m/s].
        slip: tangent velocity of the object against the tip [m/s].
        yields: as of ``_Meeting``, of object and tip together [1/kg].
        friction: Coulomb coefficient [-].
    """
    normal, tangent, cross = yields
    least = normal * tangent - cross * cross
    jn, jt = (tangent * need - cross * slip) / least, (cross * need - normal * slip) / least
    if abs(jt) <= friction * jn:
        return jn, jt
    ratio = math.copysign(friction, jt)
    rate = normal - cross * ratio
    if rate <= 0.0:  # wedged: no slip parts them
        return jn, jt
    jn = need / rate
    return jn, ratio * jn
