"""docs/files.md against what the commands write."""

import json
import re
from pathlib import Path

import pytest
import yaml
from plans import TILTED, made

from physid_drake.report.plan import plan_json

TEXT = (Path(__file__).parents[2] / "docs" / "files.md").read_text(encoding="utf-8")


def told(file):
    """The keys in the first column of a file's table."""
    section = TEXT.split(f"## {file} ")[1].split("\n## ")[0]
    return {key for row in re.findall(r"^\| (.*?) \|", section, re.MULTILINE) for key in re.findall(r"`(\w+)`", row)}


def test_the_keys_of_a_plan():
    assert told("plan.json") | {"format"} == set(json.loads(plan_json(made(sweep=0), seed=0)))


def test_the_keys_of_a_model():
    must = set(yaml.safe_load(TILTED.dump())) - {"format"}
    assert must <= told("model.yaml")
    may = {"correlation", "hand_axes", "hand_turns", "tip_height_m", "contact_height_m", "top_speed_mps"}
    assert told("model.yaml") - must <= may


@pytest.mark.parametrize(("file", "module"), [("diagnosis.json", "diagnosis"), ("result.json", "result")])
def test_the_keys_of_the_other_answers(file, module):
    """Both are written as one literal, whose keys stand at one depth."""
    source = (Path(__file__).parents[2] / "physid_drake" / "report" / f"{module}.py").read_text(encoding="utf-8")
    literal = source.split('"format": FORMAT,')[1].split("\n    }")[0]
    written = set(re.findall(r'^        (?:\*\*.*?\{)?"(\w+)":', literal, re.MULTILINE))
    assert {"seed", "theta", "noise"} <= written
    assert written == told(file)
