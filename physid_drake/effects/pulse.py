"""A wrench that comes and goes: no physics, a question of what would change if there were one."""

from __future__ import annotations

import dataclasses as dc
from typing import ClassVar

from physid_drake.cell.forces import ForceLaw, Wrench
from physid_drake.cell.object_state import ObjectState
from physid_drake.effects.effect import Effect, PushFacts


@dc.dataclass(frozen=True, kw_only=True)
class Pulse(Effect):
    """A hat over time of a force in W and a torque: largest at ``middle``, nothing ``width`` before and after it [s].

    Times are from the beginning of the rollout. The twin has it in its `Wander`.
    """

    name: ClassVar[str] = "pulse"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = ""
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("fx", "fy", "torque")

    fx: float = 0.0
    fy: float = 0.0
    torque: float = 0.0
    middle: float = 0.0
    width: float = 1.0

    def laws(self, facts: PushFacts) -> tuple[ForceLaw, ...]:
        """The wrench at a time step's beginning."""
        del facts
        return (_PulseLaw(self),)


@dc.dataclass(frozen=True)
class _PulseLaw:
    pulse: Pulse

    def wrench(self, state: ObjectState) -> Wrench:
        p = self.pulse
        share = max(0.0, 1.0 - abs(state.time - p.middle) / p.width)
        return Wrench(fx=share * p.fx, fy=share * p.fy, torque=share * p.torque)
