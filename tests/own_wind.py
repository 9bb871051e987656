"""An effect of one's own, as a user's package has it; ``tests/unit/test_effects_installed.py`` installs it."""

import dataclasses as dc
from typing import ClassVar

from physid_drake.cell.forces import Wrench
from physid_drake.effects import Coordinate, Effect
from physid_drake.effects.effect import parameter


@dc.dataclass(frozen=True)
class Blow:
    """A constant force along x and y of W [N]."""

    x: float
    y: float

    def wrench(self, state):
        """The force, whatever the object does."""
        del state
        return Wrench(fx=self.x, fy=self.y, torque=0.0)


@dc.dataclass(frozen=True, kw_only=True)
class OwnWind(Effect):
    """A wind that pushes the object: a constant force at its centre of mass."""

    name: ClassVar[str] = "own_wind"
    element: ClassVar[str] = "world"
    statement: ClassVar[str] = "a wind that blows over the table"
    frame: ClassVar[str] = "world"
    amplitudes: ClassVar[tuple[str, ...]] = ("x", "y")

    x: float = parameter(0.0, "N")
    y: float = parameter(0.0, "N")

    @classmethod
    def chart(cls, around):
        """Both components."""
        return tuple(Coordinate(name=name, step=around.slight) for name in ("x", "y"))

    def laws(self, facts):
        """The force."""
        del facts
        return (Blow(self.x, self.y),)
