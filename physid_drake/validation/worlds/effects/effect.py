"""What an effect of these worlds is, and the state of a push that it may depend on."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import ClassVar

import numpy as np

from physid_drake.validation.worlds.shapes import Array
from physid_drake.validation.worlds.world_plan import Plan


@dataclass(kw_only=True)
class Moment:
    """The state of a push at the start of a step, in W: what laws of friction and force may depend on.

    Attributes:
        time: since the recording of this push began [s].
        push: its index.
        pushes: how many there are.
        mass: of the object [kg].
        gyration_squared: of the uniform object [m^2].
        x: of Bo [m].
        y: of Bo [m].
        yaw: rad.
        com_x: of the centre of mass [m].
        com_y: of the centre of mass [m].
        vx: of the centre of mass [m/s].
        vy: of the centre of mass [m/s].
        spin: rad/s.
        slid: path length of the centre of mass in this push [m].
        slid_time: time in this push during which it moved [s].
        foot_places: (n, 2) in W [m].
        foot_velocities: (n, 2) in W [m/s].
    """

    push: int
    pushes: int
    mass: float
    gyration_squared: float
    time: float = 0.0
    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    com_x: float = 0.0
    com_y: float = 0.0
    vx: float = 0.0
    vy: float = 0.0
    spin: float = 0.0
    slid: float = 0.0
    slid_time: float = 0.0
    foot_places: Array = field(default_factory=lambda: np.empty((0, 2)))
    foot_velocities: Array = field(default_factory=lambda: np.empty((0, 2)))


class Effect:
    """Physics, or a fault of a sensor, that the baseline model leaves out. What is not overridden does nothing."""

    name: ClassVar[str]
    strengths: ClassVar[tuple[str, ...]] = ()
    """Parameters whose defaults, all of them, make it nothing."""

    @property
    def is_null(self) -> bool:
        """Whether its parameters make it nothing; then it is not built in at all."""
        return all(getattr(self, name) == getattr(type(self), name) for name in self.strengths)

    def build(self, plan: Plan) -> Plan:
        """What it changes before the world is built."""
        return plan

    def friction(self, moment: Moment) -> Array | float:
        """Factor on the friction of every foot (n,) or of all."""
        raise NotImplementedError

    def wrench(self, moment: Moment) -> tuple[float, float, float]:
        """Force at the centre of mass in W [N] and torque about z [N m]."""
        raise NotImplementedError

    def tip(self, times: Array, places: Array) -> Array:
        """Where the tip (its carriage) really goes (n, 2), given where the recording says it is, on even times."""
        return places

    def tracked(self, times: Array, poses: Array) -> Array:
        """What the tracker says (n, 3) of a motion on even times."""
        return poses


def parameters_of(effect: Effect) -> dict[str, object]:
    """Name to value."""
    return asdict(effect)  # type: ignore[call-overload, no-any-return]
