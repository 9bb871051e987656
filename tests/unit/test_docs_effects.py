"""The catalogue in docs/effects.md is the code's."""

import re
from pathlib import Path

from physid_drake.effects.catalogue import SHIPPED

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")


def parameters(kind):
    """Name, unit and null value of each, as the page writes them."""
    units, nulls = kind.units(), kind.nulls()
    said = {name: None if null is None else "all equal" if isinstance(null, tuple) else f"{null:g}"
            for name, null in nulls.items()}  # fmt: skip
    return [(name, unit, said[name]) for name, unit in units.items()]


def test_every_effect_is_listed_with_its_element_and_parameters():
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \| .* \| (.*) \|$", PAGE, re.MULTILINE)
    listed = [
        (name, element, re.findall(r"`(\w+)` \[([^,\]]+)(?:, null:? ([\w. ]+))?\]", cell))
        for name, element, cell in rows
    ]
    told = [(n, e, [(p, u, null or None) for p, u, null in ps]) for n, e, ps in listed]
    assert told == [(k.name, k.element, parameters(k)) for k in SHIPPED]
