"""The catalogue: every effect that a diagnosis knows. A new effect is one class and one line here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from physid_drake.effects.body import ComOffset, Restitution, RotationalInertia, SizeError, UnevenSupport
from physid_drake.effects.drag import QuadraticDrag, RollingResistance, ViscousDrag
from physid_drake.effects.effect import Effect, Surroundings
from physid_drake.effects.fields import Magnet, TableTilt, Tether
from physid_drake.effects.friction import (
    AnisotropicObject,
    AnisotropicTable,
    FrictionDrift,
    FrictionGradient,
    FrictionPatch,
    StribeckFriction,
)
from physid_drake.effects.hand import ActuatorLag, HandCompliance, HandOffset
from physid_drake.effects.liquid import Sloshing
from physid_drake.effects.tracker import TrackerBias, TrackerLatency, TrackerScale
from physid_drake.effects.unnamed import UnnamedForce
from physid_drake.errors import ConfigError
from physid_drake.wording import named

CATALOGUE: tuple[type[Effect], ...] = (
    StribeckFriction, ViscousDrag, QuadraticDrag, AnisotropicTable, AnisotropicObject, FrictionPatch,
    FrictionGradient, FrictionDrift, TableTilt, UnevenSupport, ComOffset, RotationalInertia, Sloshing,
    RollingResistance, Tether, Magnet, Restitution, HandCompliance, ActuatorLag, HandOffset, TrackerLatency,
    TrackerBias, TrackerScale, SizeError,
)  # fmt: skip


OF_MODELS = (*CATALOGUE, UnnamedForce)
"""What a model may hold."""


def effect_named(name: str, among: Sequence[type[Effect]] = CATALOGUE) -> type[Effect]:
    """The effect of a name.

    Raises:
        ConfigError: if there is none.
    """
    for kind in among:
        if kind.name == name:
            return kind
    raise ConfigError(f"effect '{named(name)}' is unknown; known are {', '.join(kind.name for kind in among)}.")


def applicable(around: Surroundings, names: Sequence[str] | None = None) -> tuple[type[Effect], ...]:
    """The effects, all or those named, that can be in a recording.

    Raises:
        ConfigError: if a name is unknown, or none of those named can be in it.
    """
    kinds: Iterable[type[Effect]] = (
        CATALOGUE if names is None else [effect_named(name) for name in dict.fromkeys(names)]
    )
    found = tuple(kind for kind in kinds if kind.applies(around))
    if names and not found:
        raise ConfigError(f"effects {', '.join(names)}: none of them can be in this recording.")
    return found


def tolerated(around: Surroundings) -> tuple[type[Effect], ...]:
    """The effects that can be in a recording and of which a little is no physics (``Coordinate.tolerance``)."""
    return tuple(kind for kind in applicable(around) if any(c.tolerance > 0.0 for c in kind.chart(around)))
