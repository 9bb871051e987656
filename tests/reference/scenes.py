"""Named objects, drawn pushes, and recordings of them, all made with the planar reference."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from .planar import TIME_STEP, Hand, HandPath, Motion, PlanarObject, box, simulate_planar

TIP_HEIGHT = 0.03  # m, on tall objects
LEAD = 0.2  # s of rest before the hand moves
TAIL = 0.2  # s of rest after the object has stopped
SAMPLE_TIME = 0.01

_TRIANGLE = np.array([[-0.05, -0.03], [0.07, -0.03], [-0.02, 0.06]])  # its centroid is 0

OBJECTS = {
    b.name: b
    for b in (
        box("eraser", (0.127, 0.051, 0.030), 0.054),
        box("box", (0.10, 0.08, 0.06), 0.4),
        PlanarObject(name="bottle", radius=0.033, height=0.2, mass=0.5),
        box("book", (0.22, 0.15, 0.03), 0.6),
        PlanarObject(name="can", radius=0.033, height=0.1, mass=0.35),
        PlanarObject(name="triangle", polygon=_TRIANGLE, height=0.04, mass=0.2),
    )
}

# A bottle whose centre of mass is at 3 radii tips where mu exceeds 0.33; lifting begins at mu = 0.08.
SUPPORT_FRICTION = {"eraser": (0.25, 0.35), "bottle": (0.15, 0.25)}


@dataclass(frozen=True, kw_only=True)
class Theta:
    """What is true of a scene; `mass` None: the object's own."""

    support_friction: float = 0.3
    hand_friction: float = 0.3
    restitution: float = 0.0
    mass: float | None = None
    com_offset: tuple[float, float] = (0.0, 0.0)
    inertia_ratio: float = 1.0

    def applied_to(self, body: PlanarObject) -> PlanarObject:
        """The object with this mass, centre of mass and inertia."""
        mass = body.mass if self.mass is None else self.mass
        return replace(body, mass=mass, com_offset=self.com_offset, inertia_ratio=self.inertia_ratio)


@dataclass(frozen=True, kw_only=True)
class PlanarPush:
    """One push: where the object starts (x, y, yaw of Bo), and the exact path of the tip."""

    pose: tuple[float, float, float]
    path: HandPath
    tip_radius: float = 0.010
    tip_height: float = 0.015
    speed: float = 0.0
    face: str = ""


def draw_theta(rng: np.random.Generator, body: PlanarObject) -> Theta:
    """Friction of the table 0.15 to 0.5 (less where the object says so), of the hand 0.1 to 0.5."""
    low, high = SUPPORT_FRICTION.get(body.name, (0.15, 0.5))
    return Theta(support_friction=rng.uniform(low, high), hand_friction=rng.uniform(0.1, 0.5))


def draw_push(
    rng: np.random.Generator,
    body: PlanarObject,
    *,
    speed: float | None = None,
    offset: float | None = None,
    heading: float | None = None,
    tip_radius: float | None = None,
    push_time: float | None = None,
    pose: tuple[float, float, float] | None = None,
) -> PlanarPush:
    """A push as people record them: rest, ramp, constant speed through the touch, brake, rest.

    Args:
        rng: Source of what is not given.
        body: What is pushed.
        speed: 0.05 to 0.6 m/s.
        offset: Of the aim along the face, part of its half width, -0.6 to 0.6.
        heading: Off the face's normal, rad, up to 25 degrees.
        tip_radius: 5, 10 or 15 mm.
        push_time: From the touch to the brake at constant speed, s; below 0.05 s it is a single hit.
        pose: Of the object; within 5 cm of the origin, any yaw.
    """
    drawn_speed = rng.uniform(0.05, 0.6)
    drawn_offset, drawn_heading = rng.uniform(-0.6, 0.6), math.radians(rng.uniform(-25, 25))
    drawn_radius = float(rng.choice([0.005, 0.010, 0.010, 0.015]))
    drawn_pose = (*rng.uniform(-0.05, 0.05, 2).tolist(), float(rng.uniform(-math.pi, math.pi)))
    middle, inward, half, face = _face(rng, body)
    clearance, ramp_share = rng.uniform(0.005, 0.020), rng.uniform(0.5, 0.9)
    drawn_time, brake = rng.uniform(0.15, 0.35), rng.uniform(0.02, 0.08)

    v = drawn_speed if speed is None else speed
    radius = drawn_radius if tip_radius is None else tip_radius
    start = drawn_pose if pose is None else pose
    turn = drawn_heading if heading is None else heading
    tangent = np.array([-inward[1], inward[0]])
    along = (drawn_offset if offset is None else offset) * half
    aim = middle + along * tangent
    if body.polygon is None:
        aim = along * tangent - math.sqrt(body.radius**2 - along**2) * inward
        inward = -aim / body.radius
    cos, sin = math.cos(turn), math.sin(turn)
    ahead = np.array([cos * inward[0] - sin * inward[1], sin * inward[0] + cos * inward[1]])
    touch = aim - radius * inward  # the tip's centre at the touch
    run_up = clearance / cos
    ramp = min(2 * ramp_share * run_up / v, 0.15)
    cruise = (run_up - v * ramp / 2) / v + (drawn_time if push_time is None else push_time)
    c, s = math.cos(start[2]), math.sin(start[2])
    R_WB = np.array([[c, -s], [s, c]])
    times = np.cumsum([LEAD, ramp, cruise, brake])
    path = HandPath(
        times=times,
        p0=np.array(start[:2]) + R_WB @ (touch - run_up * ahead),
        velocities=np.outer([0, v, v, 0], R_WB @ ahead),
    )
    height = min(body.height / 2, TIP_HEIGHT)
    return PlanarPush(pose=start, path=path, tip_radius=radius, tip_height=height, speed=v, face=face)


def _face(rng: np.random.Generator, body: PlanarObject) -> tuple[np.ndarray, np.ndarray, float, str]:
    """Middle, inward normal and half width of a face, in B."""
    if body.polygon is None:
        angle = rng.uniform(-math.pi, math.pi)
        inward = np.array([math.cos(angle), math.sin(angle)])
        return -body.radius * inward, inward, body.radius, f"{angle:.2f} rad"
    k = int(rng.integers(len(body.polygon)))
    a, b = body.polygon[k], body.polygon[(k + 1) % len(body.polygon)]
    length = float(np.hypot(*(b - a)))
    return (a + b) / 2, np.array([-(b - a)[1], (b - a)[0]]) / length, length / 2, f"face {k}"


def sixty_pushes(seed: int = 0) -> list[tuple[PlanarObject, Theta, PlanarPush]]:
    """Sixty pushes, twelve each of eraser, box, bottle, book and can; each draw has its own stream."""
    names = [name for name in OBJECTS if name != "triangle"]
    drawn = []
    for k in range(60):
        rng = np.random.default_rng([seed, k])
        body = OBJECTS[names[k % len(names)]]
        drawn.append((body, draw_theta(rng, body), draw_push(rng, body)))
    return drawn


def simulate(
    body: PlanarObject,
    theta: Theta,
    push: PlanarPush,
    times: np.ndarray | None = None,
    *,
    time_step: float = TIME_STEP,
    support_points: int = 600,
    friction_of_points: np.ndarray | None = None,
    force: tuple[float, float] = (0.0, 0.0),
) -> Motion:
    """The reference motion of one push.

    Args:
        body: The object as measured, before theta.
        theta: What is true of it.
        push: Start pose and path.
        times: Where poses are wanted, from 0; absent: 100 Hz until 0.2 s after object and hand have stopped.
        time_step: Longest step, s.
        support_points: About how many points carry the object.
        friction_of_points: One coefficient per point of `body.support(support_points)`, else uniform.
        force: A constant force in W, N: the table is not level.
    """
    hand = Hand(
        path=push.path,
        radius=push.tip_radius,
        height=push.tip_height,
        friction=theta.hand_friction,
        restitution=theta.restitution,
    )
    until_stopped = times is None
    if times is None:
        times = np.arange(0.0, push.path.times[-1] + 3.0, SAMPLE_TIME)
    true_body = theta.applied_to(body)
    motion = simulate_planar(
        true_body,
        theta.support_friction if friction_of_points is None else friction_of_points,
        times,
        hand=hand,
        pose=push.pose,
        force=force,
        support=true_body.support(support_points),
        time_step=time_step,
    )
    if not until_stopped:
        return motion
    stopped = max(motion.rest_time, float(push.path.times[-1]))
    keep = motion.times <= stopped + TAIL
    series = ("times", "poses", "velocities", "forces", "in_contact", "lifted")
    return replace(motion, **{name: getattr(motion, name)[keep] for name in series})


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations of one sample; `correlation` is the AR(1) factor from sample to sample."""

    object_position: float = 0.0003
    object_rotation: float = 0.003
    hand_position: float = 0.00005
    correlation: float = 0.0
    friction_scatter: float = 0.01  # of support_friction, relative, push to push


QUIET = Noise(object_position=0.0, object_rotation=0.0, hand_position=0.0, friction_scatter=0.0)


def write_reference_recording(
    folder: Path | str,
    body: PlanarObject,
    pushes: Sequence[tuple[Theta, PlanarPush]],
    noise: Noise,
    rng: np.random.Generator,
    *,
    time_step: float = TIME_STEP,
) -> list[Motion]:
    """Writes a `physid-recording/1` folder, both streams at 100 Hz, and returns the noise-free motions.

    Raises:
        ValueError: if the pushes differ in the radius of the tip.
    """
    radii = {push.tip_radius for _, push in pushes}
    if len(radii) != 1:
        raise ValueError(f"one recording has one tip, but the pushes have radii {sorted(radii)} m")
    folder = Path(folder)
    (folder / "pushes").mkdir(parents=True, exist_ok=True)
    motions, files = [], []
    for number, (theta, push) in enumerate(pushes, start=1):
        scatter = 1 + noise.friction_scatter * rng.standard_normal()
        actual = replace(theta, support_friction=theta.support_friction * max(0.1, scatter))
        motion = simulate(body, actual, push, time_step=time_step)
        name = f"pushes/{number:03d}.csv"
        _write_push(folder / name, body, push, motion, noise, rng)
        motions.append(motion)
        files.append({"file": name})
    with (folder / "recording.yaml").open("w", encoding="utf-8") as stream:
        yaml.safe_dump(_header(folder.name, body, radii.pop(), noise, files), stream, sort_keys=False)
    return motions


def _header(name: str, body: PlanarObject, radius: float, noise: Noise, files: list) -> dict:
    sensors = {
        "object_position_std_m": noise.object_position,
        "object_rotation_std_rad": noise.object_rotation,
        "hand_position_std_m": noise.hand_position,
    }
    header = {
        "format": "physid-recording/1",
        "name": name,
        "description": f"{body.name}, from the planar reference of the tests",
        "object": _shape(body) | {"mass_kg": float(body.mass)},
        "table": {"size_m": [2.0, 2.0], "centre_m": [0.0, 0.0]},
        "hand": {"tip": "sphere", "radius_m": float(radius), "stream": "measured"},
        "sensors": {key: float(value) for key, value in sensors.items() if value > 0},
        "pushes": files,
    }
    return header if header["sensors"] else {k: v for k, v in header.items() if k != "sensors"}


def _shape(body: PlanarObject) -> dict:
    if body.polygon is None:
        return {"shape": "cylinder", "radius_m": body.radius, "length_m": body.height, "axis": "z"}
    low, high = body.polygon.min(axis=0), body.polygon.max(axis=0)
    corners = [[float(x), float(y)] for x, y in body.polygon]
    if len(corners) == 4 and all(x in (low[0], high[0]) and y in (low[1], high[1]) for x, y in corners):
        size = [float(high[0] - low[0]), float(high[1] - low[1]), body.height]
        return {"shape": "box", "size_m": size}
    return {"shape": "prism", "polygon_m": corners, "height_m": body.height}


def _write_push(
    file: Path, body: PlanarObject, push: PlanarPush, motion: Motion, noise: Noise, rng: np.random.Generator
) -> None:
    n = len(motion.times)
    hand = push.path.position(motion.times) + _noise(rng, n, 2, noise.correlation) * noise.hand_position
    place = motion.poses[:, :2] + _noise(rng, n, 2, noise.correlation) * noise.object_position
    yaw = motion.poses[:, 2] + _noise(rng, n, 1, noise.correlation)[:, 0] * noise.object_rotation
    zeros = np.zeros(n)
    columns = {
        "time_s": motion.times,
        "hand_x_m": hand[:, 0],
        "hand_y_m": hand[:, 1],
        "hand_z_m": np.full(n, push.tip_height),
        "object_x_m": place[:, 0],
        "object_y_m": place[:, 1],
        "object_z_m": np.full(n, body.height / 2),
        "object_qw": np.cos(yaw / 2),
        "object_qx": zeros,
        "object_qy": zeros,
        "object_qz": np.sin(yaw / 2),
    }
    table = np.column_stack(list(columns.values()))
    np.savetxt(file, table, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")


def _noise(rng: np.random.Generator, n: int, width: int, correlation: float) -> np.ndarray:
    """(n, width) of unit variance, AR(1)."""
    series = rng.standard_normal((n, width))
    for k in range(1, n):
        series[k] = correlation * series[k - 1] + math.sqrt(1 - correlation**2) * series[k]
    return series
