"""An effect of the tests that hands over laws as they are, null ones too; and grids of numbers for tables."""

import dataclasses as dc
from typing import ClassVar

from physid_drake.cell.laws import Law
from physid_drake.cell.tables import Places
from physid_drake.effects import Effect

GRID = Places(x=-0.3, y=-0.3, step_x=0.1, step_y=0.1)


def over_grid(value):
    """Rows of numbers at the places of `GRID`, of a function of x and y."""
    return tuple(
        tuple(float(value(GRID.x + GRID.step_x * i, GRID.y + GRID.step_y * j)) for j in range(8)) for i in range(7)
    )


@dc.dataclass(frozen=True, kw_only=True)
class BareLaws(Effect):
    name: ClassVar[str] = "bare_laws"
    element: ClassVar[str] = "table"
    statement: ClassVar[str] = "laws as they are"
    frame: ClassVar[str] = "table"
    amplitudes: ClassVar[tuple[str, ...]] = ()

    all: tuple[Law, ...]

    @property
    def is_null(self):
        return False

    def laws(self, facts):
        return tuple(law for law in self.all if hasattr(law, "wrench"))

    def frictions(self, facts):
        return tuple(law for law in self.all if hasattr(law, "ratio"))
