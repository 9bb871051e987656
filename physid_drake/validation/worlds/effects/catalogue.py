"""Every effect by name: those of the catalogue, and physics that is in none."""

from __future__ import annotations

from typing import Final

from physid_drake.validation.worlds.effects.body import (
    AnisotropicObject,
    ComOffset,
    RotationalInertia,
    SizeError,
    Sloshing,
    UnevenSupport,
)
from physid_drake.validation.worlds.effects.effect import Effect
from physid_drake.validation.worlds.effects.hand import ActuatorLag, HandCompliance, HandOffset, Restitution
from physid_drake.validation.worlds.effects.others import (
    Adhesion,
    Gust,
    HandBacklash,
    HandClock,
    HandVibration,
    HeadingFriction,
    Lift,
    MarkerWobble,
    Perspective,
    Ratchet,
    Ridges,
    Rotor,
    Seam,
    Swirl,
    TableVibration,
    TrackerOvershoot,
    Trough,
    Turntable,
    Warming,
)
from physid_drake.validation.worlds.effects.table import (
    AnisotropicTable,
    FrictionDrift,
    FrictionGradient,
    FrictionPatch,
    StribeckFriction,
    TableTilt,
    ViscousDrag,
)
from physid_drake.validation.worlds.effects.tracker import TrackerBias, TrackerLatency, TrackerScale
from physid_drake.validation.worlds.effects.world import Magnet, QuadraticDrag, Tether

_CATALOGUED: Final[tuple[type[Effect], ...]] = (
    StribeckFriction,
    ViscousDrag,
    QuadraticDrag,
    AnisotropicTable,
    AnisotropicObject,
    FrictionPatch,
    FrictionGradient,
    FrictionDrift,
    TableTilt,
    UnevenSupport,
    ComOffset,
    RotationalInertia,
    Sloshing,
    Tether,
    Magnet,
    Restitution,
    HandCompliance,
    ActuatorLag,
    HandOffset,
    TrackerLatency,
    TrackerBias,
    TrackerScale,
    SizeError,
)
_OTHERS: Final[tuple[type[Effect], ...]] = (
    Ridges,
    Adhesion,
    Warming,
    Ratchet,
    HeadingFriction,
    Lift,
    Gust,
    Seam,
    Trough,
    Rotor,
    Swirl,
    TableVibration,
    Turntable,
    HandVibration,
    HandClock,
    HandBacklash,
    Perspective,
    TrackerOvershoot,
    MarkerWobble,
)
CATALOGUED: Final = {effect.name: effect for effect in _CATALOGUED}
"""Effects of the catalogue, by name."""
OTHERS: Final = {effect.name: effect for effect in _OTHERS}
"""Physics that is in no catalogue, by name."""
