"""Groups of arrays that hold the same, one for each push, as robots' logs keep them: joined, one after the other."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

PUSH: Final = "[push]"
MATRICES: Final = ((3, 3), (3, 4), (4, 4))
"""Shapes of rotations and transforms."""

MOST_ODD: Final = 0.5
"""Of the arrays of groups that are joined: at most so many are in some of them only."""


@dataclass(frozen=True, kw_only=True)
class Unread:
    """What a file holds and no column can be made of, and why."""

    why: str


@dataclass(frozen=True, kw_only=True)
class _Groups:
    """Groups beside one another whose names differ in a number only.

    Attributes:
        parent: what stands before their names, with its slash.
        arrays: of each group, by its name, in the order of the numbers; each by its own name.
        shared: names that all of them have.
    """

    parent: str
    arrays: dict[str, dict[str, Any]]
    shared: list[str]


def joined(found: Mapping[str, Any]) -> dict[str, Any]:
    """Arrays of groups that hold the same, as ``data/demo_0`` and ``data/demo_1``, become one of all, in ``data/``.

    What is not as long as most of its group, or not in all groups, is no column. Pushes are counted in ``[push]``.
    """
    groups = _largest(found)
    if groups is None:
        return dict(found)
    of_groups = {f"{groups.parent}{head}/{name}" for head, arrays in groups.arrays.items() for name in arrays}
    rest = {name: array for name, array in found.items() if name not in of_groups}
    heads = list(groups.arrays)
    lengths = [_usual_length(groups.arrays[head], groups.shared) for head in heads]
    whole = rest | {
        f"{groups.parent}{name}": _of_all(name, list(groups.arrays.values()), lengths) for name in _names(groups)
    }
    if all(isinstance(whole[f"{groups.parent}{name}"], Unread) for name in groups.shared):
        return dict(found)
    return whole | {PUSH: np.repeat(np.arange(len(heads), dtype=np.float64), lengths)}


def _names(groups: _Groups) -> list[str]:
    return list(dict.fromkeys(name for arrays in groups.arrays.values() for name in arrays))


def _of_all(name: str, groups: Sequence[Mapping[str, Any]], lengths: Sequence[int]) -> Any:
    """One array of all groups, or why there is none."""
    arrays: list[Any] = [group.get(name) for group in groups]
    unread = next((array for array in arrays if isinstance(array, Unread)), None)
    if unread is not None:
        return unread
    if any(array is None for array in arrays):
        return Unread(why=f"{sum(array is None for array in arrays)} of {len(arrays)} groups do not hold it")
    if any(len(array) != length for array, length in zip(arrays, lengths, strict=True)):
        return Unread(why="it is not as long as the other arrays of its group")
    if len({(array.shape[1:], array.dtype.kind) for array in arrays}) > 1:
        return Unread(why="it is of another width or kind in other groups")
    if arrays[0].ndim > 2 and arrays[0].shape[-2:] not in MATRICES:
        return Unread(why=f"it has {arrays[0].ndim} axes within a push")
    return np.concatenate(arrays)


def _usual_length(arrays: Mapping[str, Any], shared: Sequence[str]) -> int:
    """How long most arrays of a group are; of two lengths that are as frequent, the larger."""
    counts = Counter(len(arrays[name]) for name in shared if not isinstance(arrays[name], Unread))
    return max(counts, key=lambda length: (counts[length], length))


def _largest(found: Mapping[str, Any]) -> _Groups | None:
    """Of all groups that hold the same, those with the most arrays; next to the top if several have as many."""
    beside: dict[tuple[str, str], dict[str, dict[str, Any]]] = {}
    for name, array in found.items():
        parts = name.split("/")
        for k in range(len(parts) - 1):
            alike = (f"{'/'.join(parts[:k])}/" if k else "", re.sub(r"\d+", "0", parts[k]))
            beside.setdefault(alike, {}).setdefault(parts[k], {})["/".join(parts[k + 1 :])] = array
    candidates = [groups for (parent, _), heads in beside.items() if (groups := _alike(parent, heads)) is not None]
    return max(candidates, key=lambda g: (sum(map(len, g.arrays.values())), -g.parent.count("/")), default=None)


def _alike(parent: str, heads: Mapping[str, dict[str, Any]]) -> _Groups | None:
    """Groups whose arrays are mostly the same; None if they are not, or if there is only one."""
    if len(heads) < 2:
        return None
    counts = Counter(name for arrays in heads.values() for name in arrays)
    shared = [
        name for name, count in counts.items()
        if count == len(heads) and not any(isinstance(arrays[name], Unread) for arrays in heads.values())
    ]  # fmt: skip
    usual = sum(counts.values()) / len(heads)
    if not shared or len(counts) - sum(count == len(heads) for count in counts.values()) > MOST_ODD * usual:
        return None
    order = sorted(heads, key=lambda head: ([int(n[:18]) for n in re.findall(r"\d+", head)], head))
    return _Groups(parent=parent, arrays={head: heads[head] for head in order}, shared=shared)
