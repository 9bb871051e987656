"""Theta: the cell's unknowns as a parameter space, and the way from a point in it to a physical body."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body
from physid_drake.cell.checks import HEAVIEST, LIGHTEST
from physid_drake.cell.solid import Solid
from physid_drake.cell.support import FrictionGrid, axis_support, support_of
from physid_drake.errors import ConfigError
from physid_drake.pushes.config import ThetaConfig
from physid_drake.ranges import ANY, COEFFICIENT, POSITIVE, Range
from physid_drake.recording import ObjectModel
from physid_drake.space import Parameter, ParameterSpace
from physid_drake.wording import named, shown

Array = NDArray[np.float64]

# Of theta, relative: what the cell's own error (0.3 to 0.4 of a usual tracker's noise) moves an estimate by. Of
# thirty worlds of MuJoCo, frictions that pushes tell to 0.3 % by their noise alone came out 1 to 2 % off.
CELL_ERROR = 0.01
EXACT = 1e-4  # of a mass: a scale is not believed to be better
UNWEIGHED = 0.8  # standard deviation of the logarithm of a mass that nobody weighed
RANGES = {
    "mass": POSITIVE, "hand_friction": POSITIVE, "inertia_ratio": POSITIVE, "com_x": ANY, "com_y": ANY,
    "static_ratio": Range(above=0.0, least=1.0), "restitution": COEFFICIENT,
}  # fmt: skip
"""Of theta; all frictions with the table are positive, too."""


def range_of(name: str) -> Range:
    """What physics allows of a parameter of theta."""
    return POSITIVE if name.startswith("support_friction") else RANGES[name]


@dc.dataclass(frozen=True, kw_only=True)
class ThetaMap:
    """A parameter space with the values of what is not in it.

    Attributes:
        space: the unknowns.
        nominal: every physical parameter's value where the space does not hold it.
        cells: ``(nx, ny)`` friction cells.
    """

    space: ParameterSpace
    nominal: dict[str, float]
    cells: tuple[int, int]

    def body(self, theta: Array, *, friction_scale: float = 1.0, restitution: float = 0.0) -> Body:
        """The body that theta (d,) describes.

        Args:
            theta: a point of the space.
            friction_scale: this push's support friction over that of theta [-].
            restitution: added to theta's [-].
        """
        values = {**self.nominal, **self.space.as_dict(theta)}
        frictions = np.array([values[name] for name in friction_names(self.cells)])
        return Body(
            mass=values["mass"],
            p_BBcm=np.array([values["com_x"], values["com_y"]]),
            inertia_ratio=values["inertia_ratio"],
            hand_friction=values["hand_friction"],
            support_friction=frictions * friction_scale,
            static_ratio=values["static_ratio"],
            restitution=min(1.0, max(0.0, values["restitution"] + restitution)),
        )


def friction_names(cells: tuple[int, int]) -> list[str]:
    """Parameter names of the friction cells: ``support_friction``, or ``support_friction_i_j`` on a grid."""
    if cells == (1, 1):
        return ["support_friction"]
    return [f"support_friction_{i}_{j}" for i in range(cells[0]) for j in range(cells[1])]


def theta_map(
    model: ObjectModel, solid: Solid, cells: tuple[int, int], config: ThetaConfig, density: float
) -> ThetaMap:
    """The parameter space of a recording's object.

    Args:
        model: the recorded object; a mass that a scale gave is its prior.
        solid: its shape, which bounds its centre of mass and its mass.
        cells: friction cells.
        config: the choice of parameters.
        density: of the box around the object, where the recording gives no mass [kg/m^3].

    Raises:
        ConfigError: if a name is unknown or bounds are not a pair.
    """
    known = _catalogue(model, solid, cells, density, config.bounds.get("mass"))
    for name in [*config.parameters, *config.bounds, *config.nominal]:
        if name not in known and name != "support_friction":
            raise ConfigError(f"theta: there is no parameter '{named(name)}'; known are {', '.join(known)}.")
    wanted = [
        n
        for name in config.parameters
        for n in (_bearing_cells(cells, solid) if name == "support_friction" else [name])
    ]
    chosen = tuple(_adjusted(known[name], config) for name in dict.fromkeys(wanted))
    nominal = {name: _adjusted(parameter, config).prior_mean for name, parameter in known.items()}
    return ThetaMap(space=ParameterSpace(parameters=chosen), nominal=nominal, cells=cells)


def _bearing_cells(cells: tuple[int, int], solid: Solid) -> list[str]:
    """Names of the cells in which there is something of the object: no push tells of others, and none needs to."""
    names = friction_names(cells)
    grid = FrictionGrid(nx=cells[0], ny=cells[1])
    support = support_of(solid.underside, grid, points=len(names))
    if solid.rolling_radius is not None:
        support = axis_support(support, grid, solid.underside)
    return [names[k] for k in np.unique(support.cells).tolist()]


def _adjusted(parameter: Parameter, config: ThetaConfig) -> Parameter:
    family = "support_friction" if parameter.name.startswith("support_friction") else parameter.name
    bounds = config.bounds.get(parameter.name, config.bounds.get(family))
    nominal = config.nominal.get(parameter.name, config.nominal.get(family))
    if bounds is not None:
        if len(bounds) != 2:
            raise ConfigError(f"theta.bounds.{family}: needs [lower, upper], but got {shown(bounds)}.")
        lower, upper = float(bounds[0]), float(bounds[1])
        middle = min(max(parameter.prior_mean, lower), upper)
        parameter = dc.replace(parameter, lower=lower, upper=upper, prior_mean=middle)
        allowed = range_of(parameter.name)
        if not (allowed.holds(lower) and allowed.holds(upper)):
            raise ConfigError(f"theta.bounds.{family}: needs numbers {allowed.rule}, but got {shown(bounds)}.")
    if nominal is not None:
        parameter = dc.replace(parameter, prior_mean=float(nominal))
    return parameter


def _catalogue(
    model: ObjectModel,
    solid: Solid,
    cells: tuple[int, int],
    density: float,
    mass_bounds: Sequence[float] | None,
) -> dict[str, Parameter]:
    x0, y0, x1, y1 = solid.outline.extent()
    friction = [
        Parameter(
            name=name, unit="-", lower=0.02, upper=1.2, prior_mean=0.3, scale="log",
            description="kinetic friction between object and table",
        )
        for name in friction_names(cells)
    ]  # fmt: skip
    hand = Parameter(
        name="hand_friction", unit="-", lower=0.02, upper=1.2, prior_mean=0.3, scale="log",
        description="friction between the hand's tip and the object",
    )  # fmt: skip
    com = [
        Parameter(
            name=name, unit="m", lower=0.6 * low, upper=0.6 * high, prior_mean=0.0, prior_std=0.1 * (high - low),
            description=f"centre of mass along {name[-1]} of the object",
        )
        for name, low, high in (("com_x", x0, x1), ("com_y", y0, y1))
    ]  # fmt: skip
    rest = [
        Parameter(name="inertia_ratio", unit="-", lower=0.3, upper=2.5, prior_mean=1.0, prior_std=0.3, scale="log",
                  description="inertia over that of uniform density"),
        Parameter(name="static_ratio", unit="-", lower=1.0, upper=2.0, prior_mean=1.0,
                  description="static over kinetic friction with the table"),
        Parameter(name="restitution", unit="-", lower=0.0, upper=0.9, prior_mean=0.0,
                  description="restitution between hand and object"),
    ]  # fmt: skip
    everything = [_mass(model, solid, density, mass_bounds), hand, *friction, *com, *rest]
    return {parameter.name: parameter for parameter in everything}


def _mass(model: ObjectModel, solid: Solid, density: float, bounds: Sequence[float] | None) -> Parameter:
    """A weighed mass is as well known as the scale says; any other to its order, from foam to steel."""
    if model.mass is not None and model.mass_std is not None:
        share = max(model.mass_std / model.mass, EXACT)
        reach = max(1.1, math.exp(6.0 * share))
        return Parameter(name="mass", unit="kg", lower=model.mass / reach, upper=model.mass * reach,
                         prior_mean=model.mass, prior_std=share, scale="log", description="mass")  # fmt: skip
    x0, y0, x1, y1 = solid.outline.extent()
    volume = (x1 - x0) * (y1 - y0) * solid.height
    std = None if bounds else UNWEIGHED
    return Parameter(name="mass", unit="kg", lower=LIGHTEST * volume, upper=HEAVIEST * volume,
                     prior_mean=density * volume, prior_std=std, scale="log", description="mass")  # fmt: skip


def cell_error(space: ParameterSpace, theta: Array, j: int) -> float:
    """The cell's own error of the j-th parameter of theta (d,), in the unit cube."""
    parameter, moved = space.parameters[j], theta.copy()
    size = abs(float(theta[j]))
    if parameter.scale == "linear" and parameter.prior_std is not None:  # which may be nothing, and so is 1 % of it
        size = max(size, parameter.prior_std)
    moved[j] = theta[j] - CELL_ERROR * size
    if moved[j] < parameter.lower:
        moved[j] = theta[j] + CELL_ERROR * size
    return float(abs(np.asarray(space.to_unit(moved))[j] - np.asarray(space.to_unit(theta))[j]))
