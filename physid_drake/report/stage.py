"""The cell as a person sees it: Meshcat with the recorded object as a ghost beside the simulated ones.

What can be switched lies below one path each, so that a page, or Meshcat's own controls, switches it: ``bodies``,
``paths``, ``missing``, ``mismatch``, ``hand``, ``reach``, ``table``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    Box,
    Cylinder,
    Meshcat,
    MeshcatCone,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    SceneGraph,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder

from physid_drake.cell.hand_model import hand_looks
from physid_drake.cell.outline import Outline
from physid_drake.cell.solid import Solid, solid_of
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.plan.reach import SHIPPED_TABLE, reaches
from physid_drake.recording import Hand, Shape
from physid_drake.report.meshcat_server import silent
from physid_drake.report.outline import outline_of
from physid_drake.resources import shipped

Array = NDArray[np.float64]
Corners = tuple[tuple[float, float], tuple[float, float]]
Colour = tuple[float, float, float, float]

RECORDED, BASELINE, CORRECTED = "recorded", "baseline", "corrected"
COLOURS: Final[Mapping[str, Colour]] = {
    RECORDED: (0.93, 0.47, 0.05, 0.2),  # a ghost with edges
    BASELINE: (0.72, 0.75, 0.80, 0.6),
    CORRECTED: (0.15, 0.39, 0.79, 1.0),
}
"""Of the object, as on the other pages; light, middle and dark in print."""
MISSING = (0.80, 0.10, 0.20)
NOTHING = (0.45, 0.48, 0.55)  # what is within two standard deviations of it
GOAL = (0.11, 0.48, 0.27, 0.8)
REACH: Final[Mapping[str, Colour]] = {"motoman": (0.20, 0.35, 0.75, 0.25), "baxter": (0.85, 0.20, 0.15, 0.25)}
ARROW = 0.05  # m
LEAST_ARROW, MOST_ARROW = 0.1, 3.0  # in that length
FAINT = 0.25
LOUDEST = 10.0  # standard deviations that have the darkest colour on the table
SPOT = 0.005  # m: radius of a spot of the mismatch
SCALES: Final[Mapping[str, float]] = {BASELINE: 0.985, CORRECTED: 1.0, RECORDED: 1.015}
"""Of the objects: where two have the same faces, both would flicker."""
LIFT = 1.5e-3  # m above the table, of what is painted on it
FRAMES_PER_SECOND = 32.0
CAMERA = (-0.12, -0.34, 0.25)  # m beside what it looks at
NEAR = 0.3  # m: ways that go so far are seen from there
PAUSE = 0.4  # s between two pushes
LONGEST = 60.0  # s of the whole animation; longer recordings are shown faster


@dataclass(frozen=True, kw_only=True, eq=False)
class Track:
    """Where something is: times (n,) [s], poses (n, 7) quaternion wxyz and position in W [m]."""

    times: Array
    poses: Array

    def at(self, time: float) -> RigidTransform:
        """The pose at the last sample that is not after a time [s]."""
        k = int(np.clip(np.searchsorted(self.times, time, side="right") - 1, 0, len(self.times) - 1))
        w = self.poses[k, :4]
        return RigidTransform(Quaternion(w / np.linalg.norm(w)), self.poses[k, 4:7])


@dataclass(frozen=True, kw_only=True, eq=False)
class Act:
    """One push to be played.

    Attributes:
        name: of it.
        begin, end: [s].
        bodies: where the object is, by who says so: ``RECORDED``, ``BASELINE``, ``CORRECTED``.
        hand: where P is; None without a hand.
        missing: what the baseline model lacks in this push.
        goal: x, y and the tolerance [m], of a push that is planned.
    """

    name: str
    begin: float
    end: float
    bodies: Mapping[str, Track]
    hand: Track | None = None
    missing: Sequence[MissingWrench] = ()
    goal: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Setting:
    """What stands on the stage.

    Attributes:
        table: lower and upper corner of its top [m].
        shapes: the object's, by who says so, as in ``Act.bodies``; effects may make it larger.
        hand: the hand; None without one.
        undersides: by who says so, values (nx, ny) of the cells under the object, painted on its underside.
    """

    table: Corners
    shapes: Mapping[str, Shape]
    hand: Hand | None = None
    undersides: Mapping[str, Array] = field(default_factory=dict)


class Stage:
    """Meshcat with table, hand and objects."""

    def __init__(self, setting: Setting, meshcat: Meshcat | None = None) -> None:
        """Put the scene on the stage.

        Args:
            setting: what stands there.
            meshcat: a running one, as of `served`; None takes one that nobody can connect to.
        """
        self.meshcat = meshcat or silent()
        self.setting = setting
        self._poses: dict[str, RigidTransform] = {}  # where everything was last
        self._visible: dict[str, bool] = {}
        self._solids: dict[str, Solid] = {kind: solid_of(shape) for kind, shape in setting.shapes.items()}
        for clutter in ("/Axes", "/Grid"):
            self.meshcat.SetProperty(clutter, "visible", False)
        for path in ("bodies", "acts", "hand", "mismatch", "reach"):
            self.meshcat.Delete(path)
        _add_table(self.meshcat, setting.table)
        for name, disc in reaches(setting.table).items():
            vertices, faces = _strip(disc.chords(setting.table))
            if faces.size:
                self.meshcat.SetTriangleMesh(f"reach/{name}", vertices, faces, Rgba(*REACH[name]))
        for kind, solid in self._solids.items():
            self._add_object(kind, solid)
        if setting.hand is not None:
            self._add_hand(setting.hand)

    def show_start(self, act: Act) -> None:
        """Show an act's first moment, before anything is known."""
        self._stand(act, act.begin, None)
        self._look([act])

    def play(self, acts: Sequence[Act], unit_force: float = 1.0) -> list[tuple[str, float]]:
        """Record all acts one after the other as an animation.

        Args:
            acts: at least one.
            unit_force: that is drawn as long as ``ARROW`` [N].

        Returns:
            Name and start [s of the animation] of every act.
        """
        speed = max(1.0, sum(act.end - act.begin + PAUSE for act in acts) / LONGEST)
        self.meshcat.DeleteRecording()
        self.meshcat.StartRecording(frames_per_second=FRAMES_PER_SECOND, set_visualizations_while_recording=False)
        clock, marks = 0.0, []
        for k, act in enumerate(acts):
            marks.append((act.name, clock))
            self._draw(k, act, unit_force)
            for other in range(len(acts)):
                self._show(f"acts/{other}", other == k, clock)
            clock = self._play_one(act, clock, speed)
        self._hold(clock)
        self.meshcat.StopRecording()
        self.meshcat.PublishRecording()
        self._stain([wrench for act in acts for wrench in act.missing])
        self._stand(acts[0], acts[0].begin, None)
        self._look(acts)
        return marks

    def _play_one(self, act: Act, clock: float, speed: float) -> float:
        span = act.end - act.begin + PAUSE
        for kind in self._solids:
            self._show(f"bodies/{kind}/here", kind in act.bodies, clock)
        self._show("hand/here", act.hand is not None, clock)
        for k in range(max(2, round(span / speed * FRAMES_PER_SECOND))):
            self._stand(act, act.begin + k * speed / FRAMES_PER_SECOND, clock + k / FRAMES_PER_SECOND)
        return clock + span / speed

    def _hold(self, clock: float) -> None:
        """Give everything a last moment at the end: Meshcat repeats each track when it is over."""
        for path, pose in self._poses.items():
            self.meshcat.SetTransform(path, pose, clock)
        for path, visible in self._visible.items():
            self.meshcat.SetProperty(path, "visible", visible, clock)

    def _stand(self, act: Act, time: float, clock: float | None) -> None:
        """Put all bodies where they are at a time of an act; ``clock``: of the animation, None for now."""
        for kind, track in act.bodies.items():
            self._move(f"bodies/{kind}/here", track.at(time), clock)
        if act.hand is not None:
            self._move("hand/here", act.hand.at(time), clock)

    def _move(self, path: str, pose: RigidTransform, clock: float | None) -> None:
        self._poses[path] = pose
        self.meshcat.SetTransform(path, pose, clock)

    def _show(self, path: str, visible: bool, clock: float) -> None:
        self._visible[path] = visible
        self.meshcat.SetProperty(path, "visible", visible, clock)

    def _look(self, acts: Sequence[Act]) -> None:
        """From where a person would, at the middle of all ways, and so far off that they are seen."""
        target, offset = view_of(acts)
        centre = np.array([*target, 0.0])
        self.meshcat.SetCameraPose(centre + offset, centre)

    def _add_object(self, kind: str, solid: Solid) -> None:
        path, colour = f"bodies/{kind}/here", Rgba(*COLOURS[kind])
        for i, (shape, X_BG) in enumerate(solid.visual):
            self.meshcat.SetObject(f"{path}/shape/{i}", shape, colour)
            self.meshcat.SetTransform(f"{path}/shape/{i}", X_BG)
        self.meshcat.SetProperty(f"{path}/shape", "scale", [SCALES[kind]] * 3)
        if kind == RECORDED:
            start, end = _edges(outline_of(self.setting.shapes[kind]), solid.height)
            self.meshcat.SetLineSegments(f"{path}/shape/edges", start, end, 2.0, Rgba(*COLOURS[kind][:3], 1.0))
        if solid.rolling_radius is None:
            # A dot on the top, so that a round object's turning is seen.
            x0, _, x1, _ = solid.outline.extent()
            self.meshcat.SetObject(
                f"{path}/front", Cylinder(0.045 * (x1 - x0), 1e-3), Rgba(0.1, 0.1, 0.1, colour.a())
            )
            self.meshcat.SetTransform(f"{path}/front", RigidTransform([0.5 * x1, 0.0, 0.5 * solid.height]))
        values = self.setting.undersides.get(kind)
        if values is not None:
            for i, (shape, centre, shade) in enumerate(_tiles(solid.underside, values)):
                self.meshcat.SetObject(f"{path}/underside/{i}", shape, shade)
                X_BG = RigidTransform([*centre, -0.5 * solid.height - 2e-4])
                self.meshcat.SetTransform(f"{path}/underside/{i}", X_BG)

    def _add_hand(self, hand: Hand) -> None:
        """The tip as it is, the rest so faint that it hides no object."""
        height = max(solid.height for solid in self._solids.values())
        lift = RigidTransform([0.0, 0.0, max(0.0, 0.5 * (hand.length or 0.0) - 0.5 * height)])
        for looks in hand_looks(hand.tip, hand.radius, hand.length):
            c = looks.rgba
            alpha = 1.0 if looks.name == "tip" else FAINT
            self.meshcat.SetObject(f"hand/here/{looks.name}", looks.shape, Rgba(c.r(), c.g(), c.b(), alpha))
            self.meshcat.SetTransform(f"hand/here/{looks.name}", lift @ looks.X_PG)

    def _draw(self, k: int, act: Act, unit_force: float) -> None:
        """What is seen while an act plays: paths on the table, arrows of what is missing, the goal."""
        for kind, track in act.bodies.items():
            line = track.poses[:: max(1, len(track.poses) // 300), 4:7].T.copy()
            line[2] = 2.0 * LIFT
            colour = Rgba(*COLOURS[kind][:3], 1.0)
            self.meshcat.SetLine(f"acts/{k}/paths/{kind}", line, 3.0, colour)
        height = 1.1 * max(solid.height for solid in self._solids.values())
        for count, wrench in enumerate(act.missing):
            force = float(np.hypot(*wrench.wrench[:2]))
            heading = wrench.heading + float(np.arctan2(wrench.wrench[1], wrench.wrench[0]))
            length = ARROW * float(np.clip(force / unit_force, LEAST_ARROW, MOST_ARROW))
            shade = Rgba(*MISSING, 1.0) if wrench.stands_out else Rgba(*NOTHING, FAINT)
            self._arrow(f"acts/{k}/missing/{count}", np.array([*wrench.place, height]), heading, length, shade)
        if act.goal is not None:
            x, y, radius = act.goal
            self.meshcat.SetObject(f"acts/{k}/goal", Cylinder(radius, 1e-3), Rgba(*GOAL))
            self.meshcat.SetTransform(f"acts/{k}/goal", RigidTransform([x, y, LIFT]))

    def _stain(self, wrenches: Sequence[MissingWrench]) -> None:
        """Spots on the table where the baseline model was seen, the darker the surer something is missing there."""
        shades = colormaps["Reds"]
        for k, wrench in enumerate(wrenches):
            noise_scale = float(np.linalg.norm(wrench.wrench / wrench.std))
            share = min(1.0, noise_scale / LOUDEST)
            self.meshcat.SetObject(
                f"mismatch/{k}", Cylinder(SPOT, 5e-4), Rgba(*shades(share)[:3], 0.15 + 0.85 * share)
            )
            self.meshcat.SetTransform(f"mismatch/{k}", RigidTransform([*wrench.place, LIFT]))

    def _arrow(self, path: str, start: Array, heading: float, length: float, colour: Rgba) -> None:
        """A horizontal arrow: a shaft with a cone, whose axes Meshcat draws along z."""
        turn = RotationMatrix.MakeZRotation(heading) @ RotationMatrix.MakeYRotation(0.5 * np.pi)
        ahead = np.array([np.cos(heading), np.sin(heading), 0.0])
        head = min(0.35 * length, 0.012)
        self.meshcat.SetObject(f"{path}/shaft", Cylinder(0.0012, length - head), colour)
        self.meshcat.SetTransform(f"{path}/shaft", RigidTransform(turn, start + 0.5 * (length - head) * ahead))
        self.meshcat.SetObject(f"{path}/head", MeshcatCone(head, 0.004, 0.004), colour)
        # A cone's tip is at its origin, its base above it.
        back = RotationMatrix.MakeZRotation(heading) @ RotationMatrix.MakeYRotation(-0.5 * np.pi)
        self.meshcat.SetTransform(f"{path}/head", RigidTransform(back, start + length * ahead))


def view_of(acts: Sequence[Act]) -> tuple[Array, Array]:
    """What the camera looks at, x, y (2,) on the table, and where it is beside that (3,) [m]."""
    ways = np.vstack([track.poses[:, 4:6] for act in acts for track in act.bodies.values()])
    low, high = ways.min(axis=0), ways.max(axis=0)
    away = max(1.0, float((high - low).max()) / NEAR)
    return 0.5 * (low + high), away * np.array(CAMERA)


def _add_table(meshcat: Meshcat, table: Corners) -> None:
    """The shipped table with the two robots where it is that table; else a plain top of the recorded size."""
    low, high = np.array(table)
    size, centre = high - low, 0.5 * (low + high)
    if not (np.allclose(size, SHIPPED_TABLE) and np.allclose(centre, 0.0)):
        meshcat.SetObject("table", Box(size[0], size[1], 0.02), Rgba(0.75, 0.68, 0.58, 1.0))
        meshcat.SetTransform("table", RigidTransform([*centre, -0.0101]))
        return
    models = shipped("models")
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlantSceneGraph(builder, 0.0)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(models / "package.xml"))
    robots = [f"robots/{path.name}" for path in sorted((models / "robots").glob("*.sdf"))]
    for file in ("table/table.sdf", *robots):
        parser.AddModels(str(models / file))
    plant.Finalize()
    _publish(builder, scene_graph, meshcat)
    for robot in ("baxter", "motoman_sda10f"):
        meshcat.SetProperty(f"table/{robot}/reach", "visible", False)  # drawn like any other table's


def _publish(builder: DiagramBuilder, scene_graph: SceneGraph, meshcat: Meshcat) -> None:
    """Show a diagram once, as it stands."""
    params = MeshcatVisualizerParams(prefix="table", delete_on_initialization_event=False)
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat, params)
    diagram = builder.Build()
    diagram.ForcedPublish(diagram.CreateDefaultContext())


def _edges(outline: Array | None, height: float) -> tuple[Array, Array]:
    """Starts and ends (3, m) of the edges of an upright prism over an outline (n, 2), about its middle [m]."""
    corners = np.zeros((0, 2)) if outline is None else outline
    bottom = np.column_stack([corners, np.full(len(corners), -0.5 * height)])
    top = bottom + np.array([0.0, 0.0, height])
    pillars = slice(None, None, max(1, len(corners) // 8))
    starts = np.vstack([bottom, top, bottom[pillars]])
    ends = np.vstack([np.roll(bottom, -1, axis=0), np.roll(top, -1, axis=0), top[pillars]])
    return starts.T, ends.T


def _strip(chords: Array) -> tuple[Array, NDArray[np.int32]]:
    """Vertices (3, 2n) and faces (3, m) of a strip on the table; chords (n, 3) of x and of y from and to [m]."""
    count = len(chords)
    x = np.repeat(chords[:, 0], 2)
    vertices = np.vstack([x, chords[:, 1:].ravel(), np.full(2 * count, LIFT)])
    first = 2 * np.arange(max(0, count - 1))
    faces = np.vstack(
        [np.column_stack([first, first + 2, first + 1]), np.column_stack([first + 1, first + 2, first + 3])]
    )
    return vertices, faces.T.astype(np.int32)


def _tiles(underside: Outline, values: Array) -> list[tuple[Box, Array, Rgba]]:
    """A tile for each cell (nx, ny) under the object: its box, its centre (2,) in B [m], its shade."""
    x0, y0, x1, y1 = underside.extent()
    nx, ny = values.shape
    wide, deep = (x1 - x0) / nx, (y1 - y0) / ny
    low, high = float(values.min()), float(values.max())
    tiles = []
    for i, j in np.ndindex(nx, ny):
        centre = np.array([x0 + (i + 0.5) * wide, y0 + (j + 0.5) * deep])
        if underside.nearest(*centre.tolist())[0] > 0.0:
            continue  # not under the object
        share = 0.5 if high == low else (float(values[i, j]) - low) / (high - low)
        shade = colormaps["viridis"](share)
        tiles.append((Box(0.96 * wide, 0.96 * deep, 2e-4), centre, Rgba(*shade[:3], 1.0)))
    return tiles
