"""``model.yaml`` as people may change it: whatever is wrong, one line says which key must be what."""

import copy
import os

import numpy as np
import pytest
import yaml

from physid_drake import model_reading
from physid_drake.cell import Body, CellConfig
from physid_drake.effects.body import UnevenSupport
from physid_drake.effects.drag import ViscousDrag
from physid_drake.effects.unnamed import UnnamedForce
from physid_drake.errors import ConfigError
from physid_drake.model import Correlation, Model
from physid_drake.model_reading import load_model
from physid_drake.recording import Box, Cylinder, Prism

DRAG = "viscous_drag.coefficient"
MODEL = Model(
    recording="triangle",
    shape=Prism(polygon=((-0.05, -0.03), (0.07, -0.03), (-0.02, 0.06)), height=0.04),
    hand_radius=0.01,
    table=((-1.0, -1.0), (1.0, 1.0)),
    config=CellConfig(),
    body=Body(
        mass=0.2,
        p_BBcm=np.array([0.001, 0.0]),
        inertia_ratio=1.0,
        hand_friction=0.2,
        support_friction=np.array([0.3]),
    ),
    effects=(
        ViscousDrag(coefficient=0.4),
        UnevenSupport(weights=((1.0, 2.0), (0.5, 0.5))),
        UnnamedForce(
            force_x=((0.1, 0.2),),
            force_y=((0.0, -0.1),),
            friction=((0.1,), (-0.2,)),
            by_speed=(0.1, 0.2),
            by_heading=(0.1, 0.0, 0.1),
            along=(-0.1, -0.2),
            places=(-0.1, 0.1, 0.2, 0.3),
            speeds=(0.01, 0.5),
        ),
    ),
    intervals={DRAG: [0.3, 0.5]},
    correlation=Correlation(names=(DRAG,), matrix=((1.0,),)),
    hand_axes=((0.0, 1.0), (1.0, 0.0)),
    hand_turns=True,
    tip_height=0.05,
    contact_height=0.02,
    top_speed=0.1,
)
CONTENT = yaml.safe_load(MODEL.dump())
NESTED = yaml.safe_load("[" * 40 + "]" * 40)
WRONG = (
    None, [], {}, "", "x" * 70_000, "\x1b[2J\n", "../..", "a\0b", True, -1, -1.0, 0, 5e-324, 1e308, 10**400,
    float("nan"), float("inf"), -float("inf"), [None], [[]], {"a": 1}, {3: 4}, [1.0, 2.0, 3.0], [[1.0, 2.0]] * 3,
    ["a", "b"], [[1e308] * 2] * 2, NESTED,
)  # fmt: skip
NO_ALIASES = type("Dumper", (yaml.CSafeDumper,), {"ignore_aliases": lambda self, value: True})


def paths(value, path=()):
    """Of all that is in it."""
    if path:
        yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from paths(inner, (*path, key))


def changed(path, value, content=CONTENT):
    content = copy.deepcopy(content)
    place = content
    for key in path[:-1]:
        place = place[key]
    if value is KeyError:
        del place[path[-1]]
    else:
        place[path[-1]] = value
    return content


@pytest.fixture
def said(tmp_path):
    def load(content):
        """The refusal of a model; None if it loads."""
        text = content if isinstance(content, str) else yaml.dump(content, Dumper=NO_ALIASES, allow_unicode=True)
        (tmp_path / "model.yaml").write_text(text, encoding="utf-8")
        try:
            load_model(tmp_path)
        except ConfigError as error:
            return str(error).removeprefix(f"model '{tmp_path / 'model.yaml'}': ")
        return None

    return load


@pytest.mark.parametrize("path", sorted({p[:3] for p in paths(CONTENT)}, key=str), ids=str)
def test_whatever_stands_at_a_key_is_read_or_refused_by_the_rules_words(said, path, monkeypatch):
    content: list[object] = []  # without YAML, whose reading takes twenty times as long as the rules do
    monkeypatch.setattr(model_reading, "read_yaml", lambda *_, **__: content[-1])
    for value in (*WRONG, KeyError):
        content.append(changed(path, value))
        message = said("")
        if message is None:
            continue
        assert message.isprintable() and len(message) < 650, message
        if path[0] not in ("format", "complete"):
            assert "key '" in message or message.startswith(("correlation: ", "effect ")), message
            assert "Error" not in message and "NoneType" not in message, message


@pytest.mark.parametrize(
    "shape",
    [
        {"shape": "box", "size": [0.1, 0.1]},
        {"shape": "box"},
        {"shape": "box", "size": [0.1, 0.1, -0.1]},
        {"shape": "box", "size": [0.1, 0.1, 0.1], "colour": 3},
        {"shape": "cylinder", "radius": 0.1, "length": 0.1, "axis": "x"},
        {"shape": "cylinder", "radius": None, "length": 0.1, "axis": "z"},
        {"shape": "mesh", "file": "nowhere.obj", "scale": 1.0},
        {"shape": "mesh", "file": "a\0b.obj", "scale": 1.0},
        {"shape": "mesh", "file": "x" * 5000 + ".obj"},
        {"shape": "mesh", "file": "/dev/zero"},
        {"shape": "mesh", "file": 3},
        {"shape": "mesh"},
        {"shape": ["box"]},
        {"size": [0.1, 0.1, 0.1]},
    ],
    ids=range(14),
)
def test_a_shape_that_cannot_be_is_refused_by_key(said, shape):
    message = said({**CONTENT, "object": shape})
    assert message.startswith("key 'object") and message.isprintable() and len(message) < 450
    assert "Error" not in message


@pytest.mark.parametrize("shape", [Box(size=(0.1, 0.1, 0.1)), Cylinder(radius=0.1, length=0.1, axis="y")])
def test_the_other_shapes_are_read(said, shape):
    content = yaml.safe_load(MODEL.dump())
    kind = "box" if isinstance(shape, Box) else "cylinder"
    fields = {"size": [0.1] * 3} if kind == "box" else {"radius": 0.1, "length": 0.1, "axis": "y"}
    assert said({**content, "object": {"shape": kind, **fields}}) is None


def test_a_model_has_no_aliases_and_none_hang(said):
    laughs = "\n".join(["a0: &a0 [lol]", *(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]" for k in range(9))])
    assert "the anchor or alias 'a0' is not read here" in said(laughs)


def test_a_pipe_and_a_name_that_is_too_long_are_no_models(tmp_path):
    os.mkfifo(tmp_path / "model.yaml")
    with pytest.raises(ConfigError, match="it is a named pipe"):
        load_model(tmp_path)
    with pytest.raises(ConfigError, match="cannot be read") as caught:
        load_model(tmp_path / ("x" * 70_000))
    assert len(str(caught.value)) < 400
