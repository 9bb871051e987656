"""The catalogue: every effect that a diagnosis knows, those of this package and of others that are installed.

A new effect here is one class and one line; a package of one's own names its effects in the entry point group
``physid_drake.effects``.
"""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Sequence
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.effects.body import ComOffset, Restitution, RotationalInertia, SizeError, UnevenSupport
from physid_drake.effects.drag import QuadraticDrag, RollingResistance, ViscousDrag
from physid_drake.effects.effect import Effect, PushFacts, Surroundings
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
from physid_drake.wording import named, one_line, shown

SHIPPED: tuple[type[Effect], ...] = (
    StribeckFriction, ViscousDrag, QuadraticDrag, AnisotropicTable, AnisotropicObject, FrictionPatch,
    FrictionGradient, FrictionDrift, TableTilt, UnevenSupport, ComOffset, RotationalInertia, Sloshing,
    RollingResistance, Tether, Magnet, Restitution, HandCompliance, ActuatorLag, HandOffset, TrackerLatency,
    TrackerBias, TrackerScale, SizeError,
)  # fmt: skip
"""The effects of this package."""
ELEMENTS: Final = ("table", "object", "world", "hand", "sensor")
"""What an effect can belong to."""
FRAMES: Final = (
    "world", "object", "hand", "contact", "object_velocity", "object_acceleration", "push_order", "time",
)  # fmt: skip
"""In which missing physics can be constant."""
GROUP: Final = "physid_drake.effects"
"""Of entry points, each of which is an effect or an iterable of effects."""


@cache
def known_effects() -> tuple[type[Effect], ...]:
    """The effects that ship, and then those of installed packages, by the names of their entry points.

    Raises:
        ConfigError: if an entry point cannot be imported, is no effect, or has the name of another one.
    """
    known = list(SHIPPED)
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: (entry.name, entry.value)):
        for kind in _effects_of(entry):
            if any(other.name == kind.name for other in known):
                raise ConfigError(f"effect '{named(kind.name)}' of {entry.value}: there is one of this name already.")
            known.append(kind)
    return tuple(known)


def sources_of_effects() -> set[Path]:
    """The files that the effects of installed packages come from, and what lies beside and below them."""
    found: set[Path] = set()
    for kind in known_effects():
        if kind in SHIPPED:
            continue
        file = inspect.getsourcefile(kind)
        if file is not None:
            path = Path(file).resolve()
            alone = "." not in kind.__module__  # a module of its own, maybe among many others in one folder
            found |= {path} if alone else set(path.parent.rglob("*.py"))
    return found


def of_models() -> tuple[type[Effect], ...]:
    """What a model may hold."""
    return (*known_effects(), UnnamedForce)


def _effects_of(entry: EntryPoint) -> tuple[type[Effect], ...]:
    """What an entry point names.

    Raises:
        ConfigError: if that is no effect.
    """
    try:
        found = entry.load()
        kinds = (found,) if isinstance(found, type) else tuple(found)
    except Exception as error:  # whatever a package of somebody else raises
        raise ConfigError(f"effects of {entry.value}: {type(error).__name__}: {one_line(error)}.") from error
    for kind in kinds:
        if not (isinstance(kind, type) and issubclass(kind, Effect)):
            raise ConfigError(f"effects of {entry.value}: {shown(kind)} is no class of physid_drake.effects.Effect.")
        fault = _fault_of(kind)
        if fault is not None:
            raise ConfigError(f"effects of {entry.value}: {kind.__name__} {fault}.")
    return kinds


def _fault_of(kind: type[Effect]) -> str | None:
    """What an effect of somebody else lacks, before anything is simulated with it."""
    for name in ("name", "element", "statement", "frame", "amplitudes"):
        if not hasattr(kind, name):
            return f"has no '{name}'; every effect states name, element, statement, frame and amplitudes"
    if kind.element not in ELEMENTS:
        return f"has the element {shown(kind.element)}, which is none of {', '.join(ELEMENTS)}"
    if kind.frame not in FRAMES:
        return f"has the frame {shown(kind.frame)}, which is none of {', '.join(FRAMES)}"
    try:
        fields = kind.units()
        null = kind()
    except Exception as error:  # whatever a class of somebody else raises
        return f"cannot be made from its defaults: {type(error).__name__}: {one_line(error)}"
    strange = [name for name in kind.amplitudes if name not in fields]
    if strange:
        return f"names amplitudes that are no fields of it: {named(', '.join(strange))}"
    return None if null.is_null else "is not null at its defaults, which must be its null values"


def effect_named(name: str, among: Sequence[type[Effect]] | None = None) -> type[Effect]:
    """The effect of a name.

    Args:
        name: of the effect.
        among: which; None for the catalogue.

    Raises:
        ConfigError: if there is none.
    """
    among = known_effects() if among is None else among
    for kind in among:
        if kind.name == name:
            return kind
    known = ", ".join(kind.name for kind in among)
    raise ConfigError(f"effect '{named(name)}' is unknown; known are {known}. Is its package installed?")


def applicable(around: Surroundings, names: Sequence[str] | None = None) -> tuple[type[Effect], ...]:
    """The effects, all or those named, that can be in a recording.

    Raises:
        ConfigError: if a name is unknown, or none of those named can be in it.
    """
    kinds: Iterable[type[Effect]] = (
        known_effects() if names is None else [effect_named(name) for name in dict.fromkeys(names)]
    )
    found = tuple(kind for kind in kinds if kind.applies(around))
    for kind in found:
        if kind not in SHIPPED:
            _try(kind, around)
    if names and not found:
        raise ConfigError(f"effects {', '.join(names)}: none of them can be in this recording.")
    return found


def _try(kind: type[Effect], around: Surroundings) -> None:
    """Make an effect of somebody else at the null of each of its families, with its laws.

    Raises:
        ConfigError: if that fails, or a law says no force.
    """
    facts = PushFacts(order=0, mass=around.mass, polar=float((around.size**2).sum()) / 12.0)
    try:
        for family in kind.families(around):
            effect = kind.at(np.array(family.point, dtype=np.float64), around)
            laws = [*effect.laws(facts), *effect.frictions(facts)]
            unknown = [law for law in laws if not any(hasattr(law, name) for name in ("wrench", "brake", "ratio"))]
            if unknown:
                raise ConfigError(f"effect '{kind.name}': its law {type(unknown[0]).__name__} has no 'wrench'.")
    except ConfigError:
        raise
    except Exception as error:
        raise ConfigError(
            f"effect '{kind.name}': chart, families and fields do not fit: {type(error).__name__}: {one_line(error)}."
        ) from error


def tolerated(around: Surroundings) -> tuple[type[Effect], ...]:
    """The effects that can be in a recording and of which a little is no physics (``Coordinate.tolerance``)."""
    return tuple(kind for kind in applicable(around) if any(c.tolerance > 0.0 for c in kind.chart(around)))
