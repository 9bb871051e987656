"""The Drake cell's twin of a reference scene: the same object, push and parameters, and how far they part."""

import math
from functools import cache

import numpy as np
from reference.planar import PlanarObject
from reference.scenes import OBJECTS, PlanarPush, Theta

from physid_drake.cell import Body, Cell, CellConfig, ContactConfig, HandPath, Motion, SolverConfig, Start
from physid_drake.recording import Box, Cylinder, Prism, Shape

MODELS = ("point", "hydroelastic")
SIGMA = np.array([3e-4, 3e-4, 3e-3])  # the tracker's noise: m, m, rad


def shape_of(body: PlanarObject) -> Shape:
    if body.polygon is None:
        return Cylinder(radius=body.radius, length=body.height, axis="z")
    corners = tuple((float(x), float(y)) for x, y in body.polygon)
    low, high = body.polygon.min(axis=0), body.polygon.max(axis=0)
    if len(corners) == 4 and all(x in (low[0], high[0]) and y in (low[1], high[1]) for x, y in corners):
        return Box(size=(float(high[0] - low[0]), float(high[1] - low[1]), body.height))
    return Prism(polygon=corners, height=body.height)


def config_of(model: str = "point", *, cells: tuple[int, int] = (1, 1), **solver: object) -> CellConfig:
    return CellConfig(
        contact=ContactConfig(model=model),
        solver=SolverConfig(**solver),  # type: ignore[arg-type]
        friction_cells=list(cells),
    )


@cache
def cell_of(
    name: str,
    model: str,
    hand_radius: float | None = None,
    cells: tuple[int, int] = (1, 1),
    solver: tuple[tuple[str, object], ...] = (),
) -> Cell:
    """A cell of a named object, shared by the tests of a session."""
    return Cell(
        shape_of(OBJECTS[name]), hand_radius=hand_radius, config=config_of(model, cells=cells, **dict(solver))
    )


def body_of(
    mass: float = 0.4,
    friction: float | np.ndarray = 0.3,
    *,
    com: tuple[float, float] = (0.0, 0.0),
    inertia_ratio: float = 1.0,
    hand_friction: float = 0.3,
    static_ratio: float = 1.0,
    restitution: float = 0.0,
) -> Body:
    return Body(
        mass=mass,
        p_BBcm=np.array(com),
        inertia_ratio=inertia_ratio,
        hand_friction=hand_friction,
        support_friction=np.atleast_1d(np.asarray(friction, dtype=float)),
        static_ratio=static_ratio,
        restitution=restitution,
    )


def twin_body(body: PlanarObject, theta: Theta) -> Body:
    true_body = theta.applied_to(body)
    return body_of(
        true_body.mass,
        theta.support_friction,
        com=theta.com_offset,
        inertia_ratio=theta.inertia_ratio,
        hand_friction=theta.hand_friction,
        restitution=theta.restitution,
    )


def path_of(push: PlanarPush) -> HandPath:
    return HandPath(times=push.path.times, velocities=push.path.velocities, start=push.path.p0)


def twin(
    body: PlanarObject,
    theta: Theta,
    push: PlanarPush,
    end: float,
    model: str,
    solver: tuple[tuple[str, object], ...] = (),
) -> Motion:
    """The cell's motion of a reference push."""
    cell = cell_of(body.name, model, push.tip_radius, solver=solver)
    return cell.rollout(
        twin_body(body, theta),
        start=Start(pose=push.pose),
        path=path_of(push),
        begin=0.0,
        end=end,
        hand_height=push.tip_height,
    )


def parting(motion: Motion, times: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Difference (n, 3) of a motion from reference poses in sigma, yaw wrapped."""
    difference = motion.planar_at(times) - poses
    difference[:, 2] = (difference[:, 2] + math.pi) % (2 * math.pi) - math.pi
    return difference / SIGMA


def rms(series: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(series))))
