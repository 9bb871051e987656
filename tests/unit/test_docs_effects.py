"""The catalogue in docs/effects.md is the code's, and its pictures are those of the script."""

import importlib
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from physid_drake.effects.catalogue import SHIPPED

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "effects.md").read_text(encoding="utf-8")
PICTURES = DOCS / "images" / "effects"
SVG = "{http://www.w3.org/2000/svg}"
CLOSE = 0.5  # of 504 units of a picture's width: what another machine's rounding may change
LARGEST = 40_000  # bytes of a picture

every_effect = pytest.mark.parametrize("kind", SHIPPED, ids=lambda kind: kind.name)


def parameters(kind):
    """Name, unit and null value of each, as the page writes them."""
    units, nulls = kind.units(), kind.nulls()
    said = {name: None if null is None else "all equal" if isinstance(null, tuple) else f"{null:g}"
            for name, null in nulls.items()}  # fmt: skip
    return [(name, unit, said[name]) for name, unit in units.items()]


def section(kind):
    """What the page says under the effect's heading."""
    return re.search(rf"^### `{kind.name}`\n(.*?)(?=^#|\Z)", PAGE, re.MULTILINE | re.DOTALL)[1]


def symbols(kind):
    """Name, unit and null value of each parameter in the section, and its symbol."""
    found = re.findall(r"^- `(\w+)` \$([^$]+)\$ \[([^,\]]+)(?:, null:? ([\w. ]+))?\]: ", section(kind), re.MULTILINE)
    return [(name, unit, null or None) for name, _, unit, null in found], [symbol for _, symbol, _, _ in found]


@pytest.fixture(scope="module")
def script():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(DOCS)
        yield importlib.import_module("catalogue_pictures")


def test_every_effect_is_listed_with_its_element_and_parameters():
    rows = re.findall(r"^\| `(\w+)` \| (\w+) \| .* \| (.*) \|$", PAGE, re.MULTILINE)
    listed = [
        (name, element, re.findall(r"`(\w+)` \[([^,\]]+)(?:, null:? ([\w. ]+))?\]", cell))
        for name, element, cell in rows
    ]
    told = [(n, e, [(p, u, null or None) for p, u, null in ps]) for n, e, ps in listed]
    assert told == [(k.name, k.element, parameters(k)) for k in SHIPPED]


def test_every_effect_has_a_section_in_the_order_of_the_catalogue():
    assert re.findall(r"^### `(\w+)`$", PAGE, re.MULTILINE) == [kind.name for kind in SHIPPED]


@every_effect
def test_a_section_has_the_formula_of_its_parameters_a_picture_and_what_is_alike(kind):
    formulas = re.findall(r"^\$\$\n(.+?)\n\$\$$", section(kind), re.MULTILINE | re.DOTALL)
    listed, found = symbols(kind)
    assert listed == parameters(kind)
    assert len(set(found)) == len(found)
    assert len(formulas) == 1
    assert formulas[0].count("{") == formulas[0].count("}")
    for symbol in found:
        assert re.search(rf"(?<![\\\w]){re.escape(symbol)}(?![a-zA-Z_])", formulas[0]), symbol
    assert f"](images/effects/{kind.name}.svg)" in section(kind)
    looks = re.search(r"^\*\*Looks like:\*\* (.+)\Z", section(kind), re.MULTILINE | re.DOTALL)[1]
    others = [name for name in re.findall(r"`(\w+)`", looks) if name != "support_friction"]
    assert others
    assert set(others) <= {other.name for other in SHIPPED} - {kind.name}


def test_the_page_mentions_each_picture_once_and_there_are_no_others():
    mentioned = re.findall(r"\]\(images/effects/(\w+)\.svg\)", PAGE)
    assert sorted(mentioned) == sorted(kind.name for kind in SHIPPED)
    assert sorted(file.name for file in PICTURES.iterdir()) == sorted(f"{name}.svg" for name in mentioned)


@every_effect
def test_a_section_says_the_values_of_its_picture_and_the_picture_does(kind, script):
    values = script.PICTURES[kind.name].values
    assert type(script.PICTURES[kind.name].effect) is kind
    said = "With the weights as drawn." if kind.name == "uneven_support" else f"With {values}."
    assert said in " ".join(section(kind).split())
    assert values in texts(PICTURES / f"{kind.name}.svg")


@every_effect
def test_a_picture_is_small_and_says_what_its_axes_are(kind):
    file = PICTURES / f"{kind.name}.svg"
    assert file.stat().st_size < LARGEST
    assert sum("[" in text or "/ weight" in text or text == "number of the push" for text in texts(file)) >= 4
    assert not re.search(r"\d\.\d{4,}", re.sub(r"<text.*?</text>", "", file.read_text(encoding="utf-8")))


def texts(file):
    return [text.text for text in ElementTree.parse(file).iter(f"{SVG}text")]


def curves(file):
    """The lines (n, 2) of a picture, by their names."""
    groups = [g for g in ElementTree.parse(file).iter(f"{SVG}g") if re.match(r"(law|pushes)-", g.get("id", ""))]
    assert groups
    numbers = {g.get("id"): [re.findall(r"-?[\d.]+", p.get("d", "")) for p in g.iter(f"{SVG}path")] for g in groups}
    return {name: np.array([float(n) for path in paths for n in path]) for name, paths in numbers.items()}


def same_as_drawn_now(script, names, folder):
    for file in script.write(names, folder):
        kept, now = PICTURES / file.name, curves(file)
        assert texts(kept) == texts(file)
        assert curves(kept).keys() == now.keys()
        for name, line in curves(kept).items():
            np.testing.assert_allclose(line, now[name], atol=CLOSE, err_msg=f"{file.name} {name}")


def test_pictures_are_those_that_the_script_draws(script, tmp_path):
    same_as_drawn_now(script, ["stribeck_friction", "anisotropic_table", "tracker_bias"], tmp_path)


@pytest.mark.slow
def test_all_pictures_are_those_that_the_script_draws(script, tmp_path):
    same_as_drawn_now(script, [kind.name for kind in SHIPPED], tmp_path)
    first = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    script.write([kind.name for kind in SHIPPED], tmp_path)
    assert first == {file.name: file.read_bytes() for file in tmp_path.iterdir()}
