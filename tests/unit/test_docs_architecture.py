"""The packages, files and classes that docs/architecture.md names are the code's."""

import ast
import re
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PAGE = (PROJECT / "docs" / "architecture.md").read_text(encoding="utf-8")
FILES = sorted((PROJECT / "physid_drake").rglob("*.py"))
DRAKE = {"ConstantVectorSource"}


def test_the_layers_are_those_that_are_checked():
    drawn = re.findall(r"^layer \d+ +(.+?)(?:  .*)?$", PAGE, re.MULTILINE)
    layers = [set(re.findall(r"\w+", part)) for row in drawn for part in row.split(" > ")]
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text(encoding="utf-8"))
    checked = project["tool"]["importlinter"]["contracts"][0]["layers"]
    assert layers == [set(re.findall(r"\w+", layer)) for layer in checked]


def test_every_file_is_there():
    named = set(re.findall(r"`([\w/]+\.py)`", PAGE))
    paths = [f"/{file.relative_to(PROJECT)}" for file in [*FILES, *(PROJECT / "tests").rglob("*.py")]]
    assert len(named) > 60
    assert [name for name in named if not any(path.endswith(f"/{name}") for path in paths)] == []


def test_every_class_is_there():
    named = set(re.findall(r"`(?:\w+\.)*([A-Z][a-z]\w+)`", PAGE))
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in FILES]
    known = {node.name for tree in trees for node in tree.body if isinstance(node, ast.ClassDef)}
    assert len(named) > 60
    assert named - DRAKE - known == set()
