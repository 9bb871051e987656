"""The catalogue of effects: physics that the baseline model leaves out, each at the seams of the rollout."""

from physid_drake.effects.catalogue import (
    GROUP,
    SHIPPED,
    applicable,
    effect_named,
    known_effects,
    of_models,
    tolerated,
)
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings

__all__ = [
    "GROUP",
    "SHIPPED",
    "Coordinate",
    "Effect",
    "Family",
    "PushFacts",
    "Surroundings",
    "applicable",
    "effect_named",
    "known_effects",
    "of_models",
    "tolerated",
]  # fmt: skip
