"""The table of docs/configuration.md has every key of a scenario, with its default, and every search."""

import dataclasses as dc
import re
from pathlib import Path

import yaml

from physid_drake.scenario_schema import Scenario
from physid_drake.search import SEARCHES

PAGE = Path(__file__).resolve().parents[2] / "docs" / "configuration.md"
TEXT = PAGE.read_text(encoding="utf-8")
ROWS = re.findall(r"^\| `([\w.]+)` \| `([^`]+)` \|", TEXT, re.MULTILINE)


def leaves(value, key=""):
    if not dc.is_dataclass(value):
        return {key: value}
    found = {}
    for field in dc.fields(value):
        found |= leaves(getattr(value, field.name), f"{key}.{field.name}".lstrip("."))
    return found


def test_every_key_and_default_is_the_schemas():
    assert {key: yaml.safe_load(default) for key, default in ROWS} == leaves(Scenario())


def test_every_search_is_listed():
    row = re.search(r"^\| `search\.method` \|(.*)\|$", TEXT, re.MULTILINE)[1]
    assert re.findall(r"`(\w+)`", row) == list(SEARCHES)
