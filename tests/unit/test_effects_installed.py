"""Effects of a package of one's own are found by its entry point, and pass the contract tests by being there."""

import os
import shutil
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from physid_drake.effects import GROUP, SHIPPED, known_effects, of_models
from physid_drake.effects.catalogue import _effects_of
from physid_drake.errors import ConfigError

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
