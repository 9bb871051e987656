"""Which parameters are unknown: plain data for Drake's typed YAML loader, no deferred annotations."""

import dataclasses as dc

PLAIN = ("mass", "hand_friction", "support_friction")


@dc.dataclass
class ThetaConfig:
    """Which parameters are unknown, and their bounds.

    Attributes:
        parameters: names out of ``mass``, ``hand_friction``, ``support_friction``, ``com_x``, ``com_y``,
            ``inertia_ratio``, ``static_ratio``, ``restitution``.
        bounds: ``[lower, upper]`` per name, in SI units, instead of the defaults.
        nominal: start values per name, instead of the defaults.
        cell_spread: standard deviation of a friction cell's ln friction about that of the whole underside.
        cell_length: distance over which friction cells forget each other, as a share of the underside's longer side.
    """

    parameters: list[str] = dc.field(default_factory=lambda: list(PLAIN))
    bounds: dict[str, list[float]] = dc.field(default_factory=dict)
    nominal: dict[str, float] = dc.field(default_factory=dict)
    cell_spread: float = 0.4
    cell_length: float = 0.5
