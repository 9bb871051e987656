"""Effects of a package of one's own are found by its entry point, and pass the contract tests by being there."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest
from own_wind import OwnWind
from own_world import recorded

from physid_drake.effects import GROUP, SHIPPED, Coordinate, Effect, Surroundings, known_effects, of_models
from physid_drake.effects.catalogue import _effects_of, _fault_of, _try, sources_of_effects
from physid_drake.errors import ConfigError
from physid_drake.pushes import kept_rollouts
from physid_drake.recording import read_recording, write_recording

TESTS = Path(__file__).parents[1]


@pytest.fixture
def installed(tmp_path):
    """An environment in which a package names its effect."""
    shutil.copy(TESTS / "own_wind.py", tmp_path / "somebodys_wind.py")
    info = tmp_path / "somebodys_wind-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: somebodys-wind\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{GROUP}]\nwind = somebodys_wind:OwnWind\n")
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(TESTS.parent)])}


def run(arguments, env):
    return subprocess.run(
        [sys.executable, "-m", *arguments], check=False, capture_output=True, text=True, env=env, cwd=TESTS.parent,
        timeout=500,
    )  # fmt: skip


def test_the_command_line_knows_an_installed_effect(installed):
    assert "own_wind" in run(["physid_drake", "diagnose", "--help"], installed).stdout
    assert "own_wind" not in run(["physid_drake", "diagnose", "--help"], dict(os.environ)).stdout


def test_the_contract_tests_take_an_installed_effect(installed):
    words = ["pytest", "-p", "no:cacheprovider", "-n", "0", "-k", "own_wind", "-v", "tests/contract/test_effects.py"]
    done = run(words, installed)
    assert done.returncode == 0, done.stdout
    assert "9 passed" in done.stdout, done.stdout


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("no_such_module:Wind", "ModuleNotFoundError"),
        ("math:pi", "TypeError"),
        ("collections:OrderedDict", "is no class of physid_drake.effects.Effect"),
    ],
)
def test_what_is_no_effect_is_refused_in_one_line(value, said):
    with pytest.raises(ConfigError, match=said) as refused:
        _effects_of(EntryPoint(name="wind", value=value, group=GROUP))
    assert value in str(refused.value) and "\n" not in str(refused.value)


def test_an_effect_of_a_known_name_is_refused(monkeypatch):
    twice = EntryPoint(name="again", value="physid_drake.effects.fields:TableTilt", group=GROUP)
    known_effects.cache_clear()
    monkeypatch.setattr("physid_drake.effects.catalogue.entry_points", lambda group: [twice])
    with pytest.raises(ConfigError, match=r"'table_tilt' of physid_drake\.effects\.fields:TableTilt: there is one"):
        known_effects()
    monkeypatch.undo()
    assert known_effects()[: len(SHIPPED)] == SHIPPED and len(of_models()) == len(known_effects()) + 1


class NoAmplitudes(Effect):
    name, element, statement, frame = "twist", "world", "a twist", "world"


class WrongFrame(OwnWind):
    frame = "body"


class WrongAmplitudes(OwnWind):
    amplitudes = ("x", "z")


class NotNull(OwnWind):
    def __init__(self):
        super().__init__(x=1.0, y=0.0)


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        (NoAmplitudes, "has no 'amplitudes'"), (WrongFrame, "has the frame 'body', which is none of world"),
        (WrongAmplitudes, "names amplitudes that are no fields of it: z"), (NotNull, "is not null at its defaults"),
    ],
)  # fmt: skip
def test_what_an_effect_lacks_is_said_before_anything_is_simulated(kind, said):
    assert _fault_of(OwnWind) is None
    assert said in _fault_of(kind)


class WrongChart(OwnWind):
    @classmethod
    def chart(cls, around):
        return (Coordinate(name="torque", step=1.0),)


class NoWrench(OwnWind):
    def laws(self, facts):
        return (object(),)


@pytest.mark.parametrize(("kind", "said"), [(WrongChart, "do not fit: TypeError"), (NoWrench, "has no 'wrench'")])
def test_a_chart_and_laws_are_tried_before_the_first_fit(kind, said):
    scene = Surroundings(
        mass=0.2, friction=0.3, size=np.array([0.1, 0.06]), height=0.04, region=np.array([[-0.5, -0.5], [0.5, 0.5]]),
        top_speed=0.3, pushes=12, has_hand=True, rolls=False,
    )  # fmt: skip
    _try(OwnWind, scene)
    with pytest.raises(ConfigError, match=said):
        _try(kind, scene)


def test_rollouts_with_another_law_of_an_installed_effect_are_others(monkeypatch, tmp_path):
    source = tmp_path / "law.py"
    source.write_text("FORCE = 1.0\n")
    monkeypatch.setattr(kept_rollouts, "sources_of_effects", lambda: {source})
    before = kept_rollouts.magic.__wrapped__()
    source.write_text("FORCE = 2.0\n")
    assert kept_rollouts.magic.__wrapped__() != before
    assert sources_of_effects() == set()  # nothing is installed here


def test_pushes_of_a_world_of_ones_own_are_a_recording(tmp_path):
    write_recording(recorded(OwnWind(x=-0.04, y=0.015), count=2), tmp_path / "own")
    with_wind, without = (recorded(OwnWind(x=x), count=2).pushes for x in (-0.1, 0.0))
    assert len(read_recording(tmp_path / "own").pushes) == 2
    ends = [np.array([push.object.positions[-1] for push in pushes]) for pushes in (with_wind, without)]
    assert np.abs(ends[0] - ends[1]).max(axis=1).min() > 1e-3  # measured: 2 and 24 mm
