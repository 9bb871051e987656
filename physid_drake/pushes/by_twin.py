"""The twins of a process, and where they must not be believed."""

from __future__ import annotations

import math
import sys
from collections import OrderedDict
from functools import cache

import numpy as np

from physid_drake.cell.solid import solid_of
from physid_drake.cell.support import FrictionGrid
from physid_drake.effects.rollout import Geometry
from physid_drake.errors import CellError
from physid_drake.pushes.problem import CellSpec
from physid_drake.twin.compiled import is_compiled
from physid_drake.twin.twin import Trace, Twin

MOST_TWINS = 24  # kept by a process: effects of shape and pressure have their own

_twins: OrderedDict[str, Twin] = OrderedDict()


@cache
def say_that_it_compiles() -> None:
    """On standard error, once, where no earlier process left its machine code."""
    if not is_compiled():
        print("compiling the twin for this machine, once: some twenty seconds", file=sys.stderr, flush=True)


def stays(spec: CellSpec, twin: Twin, trace: Trace) -> bool:
    """Whether all of the object was on the table all the while."""
    low, high = np.array(spec.table)
    x0, y0, x1, y1 = twin.solid.underside.extent()
    reach = math.hypot(max(abs(x0), abs(x1)), max(abs(y0), abs(y1)))
    least, most = trace.poses[:, :2].min(axis=0) - reach, trace.poses[:, :2].max(axis=0) + reach
    return bool((least >= low).all() and (most <= high).all())


def twin_for(spec: CellSpec, geometry: Geometry) -> Twin | None:
    """This process's twin for a geometry, built at the first call; None of what rolls."""
    key = repr((geometry, spec.hand_radius, spec.config.friction_cells))
    if key not in _twins:
        try:
            _twins[key] = Twin(
                solid=solid_of(geometry.shape), hand_radius=spec.hand_radius, pressure=geometry.pressure,
                gravity=geometry.gravity,
                grid=FrictionGrid(nx=spec.config.friction_cells[0], ny=spec.config.friction_cells[1]),
            )  # fmt: skip
        except CellError:
            return None
        if len(_twins) > MOST_TWINS:
            _twins.popitem(last=False)
    _twins.move_to_end(key)
    return _twins[key]
