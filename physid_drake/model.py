"""The model that is exported: ``model.yaml`` holds cell, parameters and effects, and builds the Drake diagram."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram

from physid_drake.cell import Body, Cell, CellConfig, HandPath, Motion, Start
from physid_drake.cell.diagram import Scene
from physid_drake.effects import Effect
from physid_drake.effects.diagram import augmented_diagram
from physid_drake.effects.rollout import (
    Geometry,
    Rollout,
    body_with,
    facts_of,
    frictions_of,
    geometry_with,
    roll,
    tracked,
)
from physid_drake.errors import ConfigError
from physid_drake.recording import Box, Cylinder, MeshShape, Prism, Shape

Array = NDArray[np.float64]

FORMAT = "physid-model/1"
COMPLETE = "complete"
ROUND_OFF = 1e-9  # of a correlation's roots
SHAPES: dict[str, type[Box] | type[Cylinder] | type[Prism] | type[MeshShape]] = {
    "box": Box, "cylinder": Cylinder, "prism": Prism, "mesh": MeshShape,
}  # fmt: skip


Axes = tuple[tuple[float, float], tuple[float, float]]
AS_W: Axes = ((1.0, 0.0), (0.0, 1.0))


@dc.dataclass(frozen=True, kw_only=True)
class Correlation:
    """How estimates vary together: the correlation of their normal scores, the parameter of a Gaussian copula.

    The width of each estimate's distribution is given by its interval. The correlation is the same for a value and
    for its logarithm.

    Attributes:
        names: of the estimates, as in the intervals.
        matrix: (n, n) rows [-].

    Raises:
        ConfigError: if names repeat, or the matrix is no correlation.

    Source: R. B. Nelsen, An Introduction to Copulas, 2nd ed., 2006, section 2.3 (Sklar).
    """

    names: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]

    @classmethod
    def of(cls, names: Sequence[str], matrix: Array) -> Correlation:
        """From a matrix (n, n) that may be asymmetric by round-off."""
        even = np.clip(0.5 * (matrix + matrix.T), -1.0, 1.0)
        np.fill_diagonal(even, 1.0)
        return cls(names=tuple(names), matrix=tuple(tuple(row) for row in even.tolist()))

    def __post_init__(self) -> None:
        count = len(self.names)
        if len(set(self.names)) != count:
            raise ConfigError(f"correlation: names must be unique, but are {', '.join(self.names)}.")
        if len(self.matrix) != count or any(len(row) != count for row in self.matrix):
            raise ConfigError(f"correlation: {count} names need a matrix of {count} rows of {count} numbers.")
        matrix = np.array(self.matrix, dtype=np.float64).reshape(count, count)
        even = np.array_equal(matrix, matrix.T) and np.array_equal(np.diag(matrix), np.ones(count))
        known = even and bool(np.isfinite(matrix).all())
        if not known or (count and float(np.linalg.eigvalsh(matrix)[0]) < -ROUND_OFF):
            raise ConfigError("correlation: the matrix must be symmetric, 1 on its diagonal, without negative roots.")

    def among(self, names: Sequence[str]) -> Array:
        """The correlation (k, k) of the named estimates; 0 for pairs that it does not hold."""
        matrix = np.eye(len(names))
        held = [(i, self.names.index(name)) for i, name in enumerate(names) if name in self.names]
        for i, a in held:
            for j, b in held:
                matrix[i, j] = self.matrix[a][b]
        return matrix


@dc.dataclass(frozen=True, kw_only=True)
class Model:
    """An object, a hand and a table with their physics.

    Attributes:
        recording: name of the recording from which it was learned.
        shape: of the object.
        hand_radius: of the tip where it touches the object [m]; None without a hand.
        table: (2, 2) lower and upper corner of the table top in W [m].
        config: of the cell.
        body: the parameters theta.
        effects: physics beyond the baseline model.
        intervals: 90 % intervals, by ``theta.<name>`` and ``<effect>.<parameter>``.
        correlation: of the estimates whose interval is two numbers; None where it is not known.
        hand_axes: (2, 2) the axes of P, as columns, along x and y of W; the identity where the pushes had no common
            axes.
        hand_turns: whether the hand turns with its pushes: then ``hand_axes`` are relative to a push's heading.
        tip_height: of P above the table in the recording [m]; None where it is not known.
        contact_height: of where the tip touched the object [m]; None where it is not known.
        top_speed: of the hand in the fastest recorded push [m/s]; None where it is not known.
    """

    recording: str
    shape: Shape
    hand_radius: float | None
    table: tuple[tuple[float, float], tuple[float, float]]
    config: CellConfig
    body: Body
    effects: tuple[Effect, ...] = ()
    intervals: dict[str, Any] = dc.field(default_factory=dict)
    correlation: Correlation | None = None
    hand_axes: Axes = AS_W
    hand_turns: bool = False
    tip_height: float | None = None
    contact_height: float | None = None
    top_speed: float | None = None

    def axes_on(self, path: HandPath | None) -> Array:
        """The axes (2, 2) of P, as columns, along x and y of W, in a push along a path; None for no push."""
        axes = np.array(self.hand_axes)
        return axes if path is None or not self.hand_turns else turned(path.heading) @ axes

    def build(self, *, time_step: float | None = None) -> ModelCell:
        """The Drake cell with theta in its Context and the effects in its diagram.

        Args:
            time_step: of the diagram's plant [s]; None for the cell's, usually a millisecond. Rollouts keep the
                cell's.

        Raises:
            CellError: if Drake cannot represent the shape.
        """
        return ModelCell(self, time_step=time_step)

    def baseline(self) -> Model:
        """The same model without its effects."""
        return dc.replace(self, effects=())

    def dump(self) -> str:
        """The text of ``model.yaml``; a mesh is given by its absolute path."""
        content: dict[str, Any] = {
            "format": FORMAT,
            "recording": self.recording,
            "object": _dump_shape(self.shape),
            "hand_radius_m": self.hand_radius,
            "table_m": [list(corner) for corner in self.table],
            "cell": dc.asdict(self.config),
            "theta": {
                f.name: _plain(getattr(self.body, f.name)) for f in dc.fields(self.body)
            },
            "effects": [{"name": e.name, "parameters": _plain(dc.asdict(e))} for e in self.effects],
            "intervals": _plain(self.intervals),
        }  # fmt: skip
        if self.correlation is not None:
            content["correlation"] = _plain(dc.asdict(self.correlation))
        if self.hand_axes != AS_W:
            content["hand_axes"] = _plain(self.hand_axes)
        if self.hand_turns:
            content["hand_turns"] = True
        if self.tip_height is not None:
            content["tip_height_m"] = self.tip_height
        if self.contact_height is not None:
            content["contact_height_m"] = self.contact_height
        if self.top_speed is not None:
            content["top_speed_mps"] = self.top_speed
        content[COMPLETE] = True  # the last line: a file that was cut off has not got it
        return str(yaml.safe_dump(content, sort_keys=False))


class ModelCell:
    """A model, built: its diagram, and rollouts with all its physics.

    The diagram is for simulations and larger diagrams of your own. A ``Simulator`` of it begins with the identified
    theta, the object at rest on the table and the hand away from it. Its table has no edges, and effects that depend
    on the push's number are those of the first push. Rollouts, instead, lose the object at an edge and take the
    push's number.

    Attributes:
        model: from which it was built.
        cell: with which rollouts are made, with the effects' geometry.
        diagram: the Drake diagram, with the effects' forces as a system; ``effects.diagram.PORTS`` lists its ports.
        scene: plant and bodies of the diagram.
        body: theta, as the effects change it.
        simulator: of the diagram.
    """

    diagram: Diagram
    scene: Scene

    def __init__(self, model: Model, *, time_step: float | None = None) -> None:
        self.model = model
        geometry = geometry_with(model.effects, Geometry(shape=model.shape))
        self.cell = Cell(
            geometry.shape, hand_radius=model.hand_radius, config=model.config, table=np.array(model.table),
            pressure=geometry.pressure, gravity=geometry.gravity,
        )  # fmt: skip
        self.cell.set_body(model.body)
        effects = [e for e in model.effects if not e.is_null]
        facts = facts_of(self.cell, model.body, np.array(model.table), order=0)
        height = 0.5 * self.cell.solid.height if model.contact_height is None else model.contact_height
        self.body = body_with(effects, model.body, facts)
        self.diagram, self.scene = augmented_diagram(
            geometry, self.cell, self.body, model.config, model.hand_radius,
            laws=[law for e in effects for law in e.laws(facts)], frictions=frictions_of(effects, facts),
            hand_height=height, time_step=model.config.solver.time_step_s if time_step is None else time_step,
        )  # fmt: skip
        self.simulator = Simulator(self.diagram)

    def rollout(
        self,
        *,
        start: Start,
        path: HandPath | None,
        begin: float,
        end: float,
        hand_height: float | None = None,
        order: int = 0,
        hand_axes: Array | None = None,
    ) -> Motion:
        """Simulate a push with the model's theta and effects.

        Args:
            start: the object's state, as the tracker would report it.
            path: the hand's path; None without a hand.
            begin: start time [s].
            end: end time [s].
            hand_height: of the tip's contact above the table [m]; None for half the object's height.
            order: number of the push, for effects that depend on it.
            hand_axes: (2, 2) the axes of P, as columns, along x and y of W; None takes the model's.

        Returns:
            The motion of the object.
        """
        axes = self.model.axes_on(path) if hand_axes is None else hand_axes
        push = Rollout(
            start=start, path=path, begin=begin, end=end, hand_height=hand_height, order=order, hand_axes=axes
        )
        return roll(lambda _: self.cell, Geometry(shape=self.model.shape), self.model.body, push, self.model.effects)

    def tracked(self, motion: Motion, times: Array) -> Array:
        """What the recording's tracker would report (n, 3), x, y [m], yaw [rad], at times (n,) [s]."""
        return tracked(motion, times, self.model.effects)


def turned(angle: float) -> Array:
    """The rotation matrix (2, 2) of an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s], [s, c]])


def _dump_shape(shape: Shape) -> dict[str, Any]:
    kind = next(name for name, cls in SHAPES.items() if isinstance(shape, cls))
    fields = {f.name: getattr(shape, f.name) for f in dc.fields(shape)}
    if isinstance(shape, MeshShape):
        fields["file"] = str(Path(shape.file).resolve())
    return {"shape": kind, **_plain(fields)}


def _plain(value: Any) -> Any:
    """YAML's own types."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(v) for v in value]
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.floating):
        return float(value)
    return value
