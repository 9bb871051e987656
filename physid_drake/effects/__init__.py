"""The catalogue of effects: physics that the plain cell leaves out, each at the seams of the rollout."""

from physid_drake.effects.catalogue import CATALOGUE, OF_MODELS, applicable, effect_named, tolerated
from physid_drake.effects.effect import Coordinate, Effect, Family, PushFacts, Surroundings

__all__ = [
    "CATALOGUE", "OF_MODELS", "Coordinate", "Effect", "Family", "PushFacts", "Surroundings", "applicable",
    "effect_named", "tolerated",
]  # fmt: skip
