"""The cell as a person sees it: Meshcat with the recorded pushes as ghosts beside the simulated ones."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydrake.common.eigen_geometry import Quaternion
from pydrake.geometry import (
    Box,
    Cylinder,
    Meshcat,
    MeshcatCone,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
    Shape,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.multibody.tree import SpatialInertia, default_model_instance
from pydrake.systems.framework import DiagramBuilder

from physid_drake.cell.hand_model import add_hand_visual
from physid_drake.cell.motion import Motion
from physid_drake.cell.solid import Solid, solid_of
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.errors import ConfigError
from physid_drake.recording import Push, Recording
from physid_drake.resources import shipped

Array = NDArray[np.float64]

RECORDED = np.array([0.95, 0.55, 0.15, 0.45])  # the ghost
SIMULATED = np.array([0.20, 0.45, 0.80, 1.0])
MISSING = (0.80, 0.10, 0.20)
NOTHING = (0.45, 0.48, 0.55)  # what is within two standard deviations of it
ARROW = 0.05  # m
LEAST_ARROW, MOST_ARROW = 0.1, 3.0  # in that length
FAINT = 0.25
FRAMES_PER_SECOND = 32.0
PAUSE = 0.4  # s between two pushes
LONGEST = 60.0  # s of the whole animation; longer recordings are shown faster
PLAIN_TABLE = (1.20, 0.80)  # m: the shipped model with its legs and robots

LOOPBACK = "127.0.0.1"
LISTENS = "0A"  # a socket's state in /proc/net/tcp

# Drake aborts the process where a Meshcat is destroyed by another thread than the one that made it. A diagram is a
# cycle of references, and Python collects cycles in any thread (that of a pool of processes, say): none is destroyed.
_kept: list[Meshcat] = []


def served(host: str = LOOPBACK) -> Meshcat:
    """A Meshcat that listens on a free port; whoever reaches it sees the scene.

    Args:
        host: address to listen on; ``*`` is every network of this machine.

    Raises:
        ConfigError: if there is no such address here.
    """
    try:
        return Meshcat(MeshcatParams(host=host, show_stats_plot=False))
    except RuntimeError as error:
        raise ConfigError(f"--host {host!r}: Meshcat cannot listen there; give this machine's address.") from error


def silent() -> Meshcat:
    """A Meshcat for files: nobody can connect to it.

    Drake's has no mode without a server, so its listening socket is replaced by one that does not listen.
    """
    before = _listening()
    meshcat = served()
    for descriptor in _listening() - before:
        with socket.socket() as mute:
            os.dup2(mute.fileno(), descriptor, inheritable=False)
    return meshcat


def _listening() -> set[int]:
    """Descriptors of this process's listening TCP sockets; none where the system does not tell."""
    inodes = set()
    for table in ("tcp", "tcp6"):
        with suppress(OSError):
            rows = [line.split() for line in Path(f"/proc/self/net/{table}").read_text().splitlines()[1:]]
            inodes |= {f"socket:[{row[9]}]" for row in rows if row[3] == LISTENS}
    found = set()
    with suppress(OSError):
        for entry in Path("/proc/self/fd").iterdir():
            with suppress(OSError):  # the one that reads this folder is gone
                if os.readlink(entry) in inodes:  # noqa: PTH115
                    found.add(int(entry.name))
    return found


@dataclass(frozen=True, kw_only=True)
class ShownMotion:
    """One push to be shown: what was recorded and what was simulated."""

    push: Push
    motion: Motion


class Stage:
    """Meshcat with table, hand, object and ghost."""

    def __init__(self, recording: Recording, meshcat: Meshcat | None = None) -> None:
        """Put the scene on the stage.

        Args:
            recording: whose table, object and hand are shown.
            meshcat: a running one, as of `served`; None takes one that nobody can connect to.
        """
        self.meshcat = meshcat or silent()
        if self.meshcat not in _kept:
            _kept.append(self.meshcat)
        self._recording = recording
        self._solid: Solid = solid_of(recording.object.shape)
        builder = DiagramBuilder()
        plant, _ = AddMultibodyPlantSceneGraph(builder, 0.0)
        _add_surroundings(plant, recording)
        simulated = _add_look(plant, self._solid, "simulated", SIMULATED)
        recorded = _add_look(plant, self._solid, "recorded", RECORDED)
        hand = None
        if recording.hand is not None:
            hand = plant.AddRigidBody("hand", default_model_instance(), SpatialInertia.SolidSphereWithMass(1.0, 0.01))
            tip = recording.hand
            lift = max(0.0, 0.5 * (tip.length or 0.0) - 0.5 * self._solid.height)
            add_hand_visual(plant, hand, tip.tip, tip.radius, tip.length, height=lift)
        plant.Finalize()
        self._plant, self._bodies = plant, (simulated, recorded, hand)
        MeshcatVisualizer.AddToBuilder(
            builder,
            _scene_graph(builder),
            self.meshcat,
            MeshcatVisualizerParams(publish_period=1.0 / FRAMES_PER_SECOND),
        )
        self._diagram = builder.Build()
        self._root = self._diagram.CreateDefaultContext()
        self._context = plant.GetMyMutableContextFromRoot(self._root)
        for clutter in ("/Axes", "/Grid"):
            self.meshcat.SetProperty(clutter, "visible", False)
        centre = np.array([*recording.pushes[0].object.positions[0][:2], 0.0])
        self.meshcat.SetCameraPose(centre + np.array([-0.10, -0.45, 0.32]), centre)

    def show_start(self) -> None:
        """Show the first push's first moment, before anything is known."""
        push = self._recording.pushes[0]
        self._pose(_pose_at(push, push.start_time), _pose_at(push, push.start_time), _hand_at(push, push.start_time))
        self._root.SetTime(0.0)
        self._diagram.ForcedPublish(self._root)

    def play(self, scenes: Sequence[ShownMotion]) -> list[tuple[str, float]]:
        """Record all pushes one after the other as an animation.

        Returns:
            Name and start [s of the animation] of every push.
        """
        total = sum(scene.push.duration + PAUSE for scene in scenes)
        speed = max(1.0, total / LONGEST)
        self.meshcat.DeleteRecording()
        self.meshcat.StartRecording(frames_per_second=FRAMES_PER_SECOND, set_visualizations_while_recording=False)
        clock, marks = 0.0, []
        for scene in scenes:
            marks.append((scene.push.name, clock))
            self._trace(scene)
            clock = self._play_one(scene, clock, speed)
        self.meshcat.StopRecording()
        self.meshcat.PublishRecording()
        return marks

    def _play_one(self, scene: ShownMotion, clock: float, speed: float) -> float:
        push = scene.push
        span = push.duration + PAUSE
        for k in range(max(2, round(span / speed * FRAMES_PER_SECOND))):
            time = push.start_time + k * speed / FRAMES_PER_SECOND
            self._pose(_motion_at(scene.motion, time), _pose_at(push, time), _hand_at(push, time))
            self._root.SetTime(clock + k / FRAMES_PER_SECOND)
            self._diagram.ForcedPublish(self._root)
        return clock + span / speed

    def _trace(self, scene: ShownMotion) -> None:
        """Paths on the table: recorded and simulated."""
        name = scene.push.name.replace("/", "_")
        lift = np.array([[0.0], [0.0], [2e-3]])
        recorded = scene.push.object.positions.T * [[1.0], [1.0], [0.0]] + lift
        simulated = scene.motion.poses[:, 4:7].T * [[1.0], [1.0], [0.0]] + lift
        self.meshcat.SetLine(f"paths/recorded/{name}", recorded, 3.0, Rgba(*RECORDED[:3], 1.0))
        self.meshcat.SetLine(
            f"paths/simulated/{name}", simulated[:, :: max(1, simulated.shape[1] // 300)], 2.0, Rgba(*SIMULATED)
        )

    def show_missing(self, wrenches: Sequence[MissingWrench], unit_force: float) -> None:
        """Arrows of the force that is missing from the plain cell, where the object was when it was missing.

        Args:
            wrenches: window by window; those within two standard deviations of nothing are drawn faint.
            unit_force: that is drawn as long as ``ARROW`` [N].
        """
        self.meshcat.Delete("missing")
        height = 1.1 * self._solid.height
        for count, wrench in enumerate(wrenches):
            force = np.hypot(*wrench.wrench[:2])
            heading = wrench.heading + float(np.arctan2(wrench.wrench[1], wrench.wrench[0]))
            length = ARROW * float(np.clip(force / unit_force, LEAST_ARROW, MOST_ARROW))
            colour = Rgba(*MISSING, 1.0) if wrench.stands_out else Rgba(*NOTHING, FAINT)
            self._arrow(f"missing/{count}", np.array([*wrench.place, height]), heading, length, colour)

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

    def _pose(self, simulated: RigidTransform, recorded: RigidTransform, hand: RigidTransform | None) -> None:
        for body, pose in zip(self._bodies, (simulated, recorded, hand), strict=True):
            if body is not None and pose is not None:
                self._plant.SetFreeBodyPose(self._context, body, pose)


def _scene_graph(builder: DiagramBuilder) -> object:
    return builder.GetSubsystemByName("scene_graph")


def _add_surroundings(plant: object, recording: Recording) -> None:
    """The shipped table with the two robots where it is that table; else a plain top of the recorded size."""
    table = recording.table
    if np.allclose(table.size, PLAIN_TABLE) and np.allclose(table.centre, 0.0):
        models = shipped("models")
        parser = Parser(plant)
        parser.package_map().AddPackageXml(str(models / "package.xml"))
        for file in (
            "table/table.sdf",
            *(f"robots/{path.name}" for path in sorted((models / "robots").glob("*.sdf"))),
        ):
            parser.AddModels(str(models / file))
        return
    top = Box(table.size[0], table.size[1], 0.02)
    X_WT = RigidTransform([table.centre[0], table.centre[1], -0.0101])
    plant.RegisterVisualGeometry(plant.world_body(), X_WT, top, "table_top", np.array([0.75, 0.68, 0.58, 1.0]))  # type: ignore[attr-defined]


def _add_look(plant: object, solid: Solid, name: str, colour: Array) -> object:
    body = plant.AddRigidBody(name, default_model_instance(), SpatialInertia.SolidSphereWithMass(1.0, 0.01))  # type: ignore[attr-defined]
    for i, (shape, X_BG) in enumerate(solid.visual):
        plant.RegisterVisualGeometry(body, X_BG, shape, f"{name}_{i}", colour)  # type: ignore[attr-defined]
    front = _mark(solid)
    if front is not None:
        shape, X_BG = front
        plant.RegisterVisualGeometry(body, X_BG, shape, f"{name}_front", np.array([0.1, 0.1, 0.1, float(colour[3])]))  # type: ignore[attr-defined]
    return body


def _mark(solid: Solid) -> tuple[Shape, RigidTransform] | None:
    """A dot on the top, so that a round object's turning is seen; None on one that rolls."""
    if solid.rolling_radius is not None:
        return None
    x0, _, x1, _ = solid.outline.extent()
    reach = 0.15 * (x1 - x0)
    return Cylinder(0.3 * reach, 1e-3), RigidTransform([0.5 * x1, 0.0, 0.5 * solid.height])


def _motion_at(motion: Motion, time: float) -> RigidTransform:
    k = int(np.clip(np.searchsorted(motion.times, time), 0, len(motion.times) - 1))
    return _transform(motion.poses[k, :4], motion.poses[k, 4:7])


def _pose_at(push: Push, time: float) -> RigidTransform:
    stream = push.object
    k = int(np.clip(np.searchsorted(stream.times, time, side="right") - 1, 0, len(stream) - 1))
    # A hair above: where ghost and object coincide, neither would be seen.
    return _transform(stream.quaternions[k], stream.positions[k] + [0.0, 0.0, 1e-3])


def _hand_at(push: Push, time: float) -> RigidTransform | None:
    if push.hand is None:
        return None
    position = [float(np.interp(time, push.hand.times, column)) for column in push.hand.positions.T]
    return RigidTransform(np.array(position))


def _transform(quaternion: Array, position: Array) -> RigidTransform:
    return RigidTransform(Quaternion(quaternion / np.linalg.norm(quaternion)), position)
