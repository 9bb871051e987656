"""A fine planar integrator of one rigid object that slides on a table and is pushed by a prescribed tip.

Independent of physid_drake and of pydrake. The scheme: velocities by implicit Euler (friction at the end of
the step, Newton), positions by the trapezoid, the hand as a unilateral constraint with Coulomb friction (no
stiffness), touches as events with Routh's planar impact law. Steps end at the knots of the hand's path.

Conventions: `B` sits at the centroid of the outline; poses are (x, y, yaw) of Bo in W; velocities are those
of Bcm, (vx, vy, w) in W. The yaw inertia about Bcm is `inertia_ratio` times that of uniform density about
Bo: a `com_offset` moves the centre of mass and leaves the inertia about it alone. The table gives no impulse
in an impact, the hand no vertical force.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from reference.steps import integrate, tip_at

TIME_STEP = 2e-5
SLIP_EPSILON = 1e-6  # m/s; a hold at 0.9 of the limit creeps 2e-6 m/s


@dataclass(frozen=True, kw_only=True)
class PlanarObject:
    """A prism (`polygon` (k, 2) in B: convex, counter-clockwise, centroid at 0) or a standing disc; SI."""

    name: str
    height: float
    mass: float
    polygon: np.ndarray | None = None
    radius: float = 0.0
    com_offset: tuple[float, float] = (0.0, 0.0)
    com_height: float | None = None
    inertia_ratio: float = 1.0

    @property
    def area(self) -> float:
        if self.polygon is None:
            return math.pi * self.radius**2
        return float(_cross(self.polygon).sum() / 2)

    @property
    def second_moments(self) -> np.ndarray:
        """(2, 2) mean of r r^T over the base, about Bo, m^2."""
        if self.polygon is None:
            return np.eye(2) * self.radius**2 / 4
        a, b, c = self.polygon, np.roll(self.polygon, -1, axis=0), _cross(self.polygon)
        s = a[:, :, None] * a[:, None] + b[:, :, None] * b[:, None]
        s = s + (a[:, :, None] * b[:, None] + b[:, :, None] * a[:, None]) / 2
        return np.asarray((c[:, None, None] * s).sum(axis=0) / 12 / self.area)

    @property
    def inertia(self) -> float:
        """Yaw inertia about Bcm, kg m^2."""
        return float(self.inertia_ratio * self.mass * np.trace(self.second_moments))

    @property
    def height_of_com(self) -> float:
        return self.height / 2 if self.com_height is None else self.com_height

    def support(self, n: int = 600) -> tuple[np.ndarray, np.ndarray]:
        """About n middles of equal cells of the base: points (m, 2) in B, and weights (m,) that sum to 1.

        The points are stretched (by a part 1/cells^2) so that their second moments are the exact ones.
        """
        points, weights = self._cells(n)
        have = (weights[:, None, None] * points[:, :, None] * points[:, None]).sum(axis=0)
        stretch = _root(self.second_moments) @ np.linalg.inv(_root(have))
        return points @ stretch.T, weights

    def _cells(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        if self.polygon is None:
            points = _disc_cells(self.radius, n)
        elif _is_rectangle(self.polygon):
            lx, ly = np.ptp(self.polygon, axis=0)
            nx = max(2, round(math.sqrt(n * lx / ly)))
            ny = max(2, round(n / nx))
            x, y = np.meshgrid((np.arange(nx) + 0.5) / nx - 0.5, (np.arange(ny) + 0.5) / ny - 0.5)
            points = np.column_stack([lx * x.ravel(), ly * y.ravel()])
        elif len(self.polygon) == 3:
            points = _triangle_cells(*self.polygon, round(math.sqrt(n)))
        else:
            corners = list(zip(self.polygon, np.roll(self.polygon, -1, axis=0), strict=True))
            k = round(math.sqrt(n / len(corners)))
            fans = [_triangle_cells(np.zeros(2), a, b, k) for a, b in corners]
            areas = _cross(self.polygon) / 2
            weights = np.concatenate([np.full(len(f), s / len(f)) for f, s in zip(fans, areas, strict=True)])
            return np.vstack(fans), weights / weights.sum()
        return points, np.full(len(points), 1 / len(points))


def box(name: str, size: tuple[float, float, float], mass: float, **more: object) -> PlanarObject:
    """A box of size (lx, ly, lz), m."""
    x, y = size[0] / 2, size[1] / 2
    polygon = np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    return PlanarObject(name=name, polygon=polygon, height=size[2], mass=mass, **more)  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True)
class HandPath:
    """A piecewise-linear velocity: knot `times` (k,), `velocities` (k, 2), start `p0` (2,).

    Before the first knot and after the last one the hand stands still, so both end velocities should be 0.
    """

    times: np.ndarray
    p0: np.ndarray
    velocities: np.ndarray
    knots: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        if np.any(np.diff(self.times) <= 0):
            raise ValueError(f"knot times must increase, got {self.times} s")
        step = np.diff(self.times)[:, None] * (self.velocities[1:] + self.velocities[:-1]) / 2
        object.__setattr__(self, "knots", np.vstack([self.p0, self.p0 + np.cumsum(step, axis=0)]))

    def position(self, times: np.ndarray) -> np.ndarray:
        """Exact positions (n, 2), m."""
        return np.array([tip_at(t, self.times, self.knots, self.velocities)[:2] for t in np.atleast_1d(times)])

    def velocity(self, times: np.ndarray) -> np.ndarray:
        """Exact velocities (n, 2), m/s."""
        return np.array([tip_at(t, self.times, self.knots, self.velocities)[2:] for t in np.atleast_1d(times)])


@dataclass(frozen=True, kw_only=True)
class Hand:
    """An upright circle of `radius` that touches at `height` above the table; `friction`, `restitution`."""

    path: HandPath
    radius: float = 0.010
    height: float = 0.015
    friction: float = 0.3
    restitution: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Motion:
    """What a run gives, at `times` (n,)."""

    times: np.ndarray
    poses: np.ndarray  # (n, 3) x, y, yaw of Bo
    velocities: np.ndarray  # (n, 3) of Bcm
    forces: np.ndarray  # (n, 2) N of the hand on the object in W, impulses left out
    in_contact: np.ndarray  # (n,) bool
    lifted: np.ndarray  # (n,) bool: part of the base carries nothing
    impacts: np.ndarray  # (k, 5) time, approach speed, slip speed (m/s), normal and tangential impulse (N s)
    rest_time: float  # when object and hand came to rest for good; inf if they did not
    tipped: bool  # no pressure balances the moments: the planar model ends here
    steps: int
    unconverged: int


def simulate_planar(
    body: PlanarObject,
    support_friction: float | np.ndarray,
    times: np.ndarray,
    *,
    hand: Hand | None = None,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    force: tuple[float, float] = (0.0, 0.0),
    support: tuple[np.ndarray, np.ndarray] | None = None,
    time_step: float = TIME_STEP,
    slip_epsilon: float = SLIP_EPSILON,
) -> Motion:
    """The motion from `times[0]`, where Bo is at `pose` and Bcm moves with `velocity`.

    Args:
        body: What slides.
        support_friction: One coefficient, or one for each point of `support`.
        times: (n,) increasing, s; also the span of the run.
        hand: What pushes.
        pose: x, y, yaw of Bo at the start.
        velocity: Of Bcm, and yaw rate, at the start.
        force: A constant force at Bcm in W, N (a tilted table, a pull).
        support: Points (m, 2) in B and weights (m,); `body.support()` if absent.
        time_step: Longest step, s.
        slip_epsilon: Friction is mu N s / sqrt(|s|^2 + slip_epsilon^2), m/s.
    """
    points, weights = body.support() if support is None else support
    mu = np.ascontiguousarray(np.broadcast_to(np.asarray(support_friction, float), weights.shape))
    local = points - np.asarray(body.com_offset)
    if hand is None:
        still, tip = np.zeros((1, 2)), np.zeros(5)
        knots = (np.zeros(1), still, still)
    else:
        tip = np.array([1.0, hand.radius, hand.height, hand.friction, hand.restitution])
        knots = (hand.path.times, hand.path.knots, hand.path.velocities)
    frame = np.array([body.mass, body.inertia, body.height_of_com, body.radius, *body.com_offset, *force])
    polygon = np.zeros((0, 2)) if body.polygon is None else body.polygon
    out, impacts, rest_time, tipped, steps, unconverged = integrate(
        *(np.ascontiguousarray(a, dtype=float) for a in (local[:, 0], local[:, 1], weights / weights.sum(), mu)),
        frame,
        *(np.ascontiguousarray(a, dtype=float) for a in (polygon, *knots, tip, pose, velocity, times)),
        float(time_step),
        float(slip_epsilon),
    )
    return Motion(
        times=np.asarray(times, float),
        poses=out[:, :3],
        velocities=out[:, 3:6],
        forces=out[:, 6:8],
        in_contact=out[:, 8] > 0,
        lifted=out[:, 9] > 0,
        impacts=impacts,
        rest_time=rest_time,
        tipped=tipped,
        steps=steps,
        unconverged=unconverged,
    )


def _cross(polygon: np.ndarray) -> np.ndarray:
    after = np.roll(polygon, -1, axis=0)
    return np.asarray(polygon[:, 0] * after[:, 1] - polygon[:, 1] * after[:, 0])


def _root(moments: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(moments)
    return np.asarray(vectors @ np.diag(np.sqrt(values)) @ vectors.T)


def _is_rectangle(polygon: np.ndarray) -> bool:
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    on_edge = np.isclose(polygon, low) | np.isclose(polygon, high)
    return len(polygon) == 4 and bool(on_edge.all())


def _disc_cells(radius: float, n: int) -> np.ndarray:
    """Rings of equal width with 3 (2 k + 1) equal cells each: all cells have the same area."""
    rings = max(2, round(math.sqrt(n / 3)))
    points = []
    for k in range(rings):
        count = 3 * (2 * k + 1)
        r = radius * math.sqrt((k**2 + (k + 1) ** 2) / 2) / rings
        angle = 2 * math.pi * (np.arange(count) + 0.5) / count
        points.append(r * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.vstack(points)


def _triangle_cells(a: np.ndarray, b: np.ndarray, c: np.ndarray, k: int) -> np.ndarray:
    """The centroids of the k^2 congruent triangles that fill a triangle."""
    shares = [((i + 1 / 3) / k, (j + 1 / 3) / k) for i in range(k) for j in range(k - i)]
    shares += [((i + 2 / 3) / k, (j + 2 / 3) / k) for i in range(k - 1) for j in range(k - 1 - i)]
    s = np.array(shares)
    return np.asarray(a + s[:, :1] * (b - a) + s[:, 1:] * (c - a))
