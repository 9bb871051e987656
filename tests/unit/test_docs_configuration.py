"""The table of docs/configuration.md has every key of a scenario, with its default."""

import dataclasses as dc
import re
from pathlib import Path

import yaml

from physid_drake.scenario_schema import Scenario

PAGE = Path(__file__).resolve().parents[2] / "docs" / "configuration.md"
ROWS = re.findall(r"^\| `([\w.]+)` \| `([^`]+)` \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def leaves(value, key=""):
    if not dc.is_dataclass(value):
        return {key: value}
    found = {}
    for field in dc.fields(value):
        found |= leaves(getattr(value, field.name), f"{key}.{field.name}".lstrip("."))
    return found


def test_every_key_and_default_is_the_schemas():
    assert {key: yaml.safe_load(default) for key, default in ROWS} == leaves(Scenario())
