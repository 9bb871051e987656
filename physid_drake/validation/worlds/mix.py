"""Which worlds a set has: the kind of each, and the names of its effects."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from physid_drake.errors import ParameterError
from physid_drake.validation.worlds.effects.catalogue import CATALOGUED, OTHERS

Kind: TypeAlias = Literal["none", "effect", "other", "pair", "notched"]
KINDS: Final[tuple[Kind, ...]] = get_args(Kind)
BLOCK: Final[tuple[Kind, ...]] = ("none",) * 5 + ("effect",) * 10 + ("other",) * 3 + ("pair",) * 2
"""Each twenty worlds are these, shuffled."""
GRAINS: Final = {"anisotropic_table", "anisotropic_object"}
"""Never in one world: MuJoCo's contacts have one grain."""


@dataclass(frozen=True, kw_only=True)
class Assignment:
    """What world ``index`` shall be: its kind, the names of its effects, and whether its object has notches."""

    index: int
    kind: Kind
    effects: tuple[str, ...]
    notched: bool = False


def assign(index: int, seed: int, kind: Kind | None = None, effect: str | None = None) -> Assignment:
    """The mix: a quarter nothing, half one effect of the catalogue in turn, the rest others and pairs.

    Args:
        index: of the world.
        seed: of the whole set.
        kind: instead of the mix; of ``notched``, objects are a T, an L or a plus, and worlds have one effect or none.
        effect: instead of taking effects in turn; for a pair, its first.
    """
    if kind == "notched":
        # Every fourth without an effect: what the outline alone does must be no mismatch.
        plain = index % 4 == 3
        return replace(assign(index, seed, "none" if plain else "effect", None if plain else effect), notched=True)
    block, within = divmod(index, len(BLOCK))
    kinds = [BLOCK[k] for k in np.random.default_rng([seed, block, 1]).permutation(len(BLOCK)).tolist()]
    if effect is not None and kind is None:
        kind = "effect" if effect in CATALOGUED else "other"
    chosen = kinds[within] if kind is None else kind
    turn = index if kind is not None else block * BLOCK.count(chosen) + kinds[:within].count(chosen)
    if chosen == "none":
        return Assignment(index=index, kind=chosen, effects=())
    pool = list(OTHERS if chosen == "other" else CATALOGUED)
    order = np.random.default_rng([seed, 2, chosen == "other"]).permutation(len(pool)).tolist()
    first = effect if effect is not None else pool[order[turn % len(pool)]]
    if first not in pool:
        raise ParameterError(f"no effect {first!r} of kind {chosen}; there are {', '.join(pool)}.")
    if chosen != "pair":
        return Assignment(index=index, kind=chosen, effects=(first,))
    rest = [name for name in pool if name != first]
    drawn = int(np.random.default_rng([seed, index, 3]).integers(len(rest)))
    second = rest[drawn]
    if {first, second} == GRAINS:
        second = rest[(drawn + 1) % len(rest)]
    return Assignment(index=index, kind=chosen, effects=(first, second))
