"""A run's configuration: one YAML file with named scenarios, read by Drake's typed loader."""

from __future__ import annotations

import dataclasses as dc
import functools
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args, get_origin

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from physid_drake.cell.checks import check_config
from physid_drake.errors import ConfigError
from physid_drake.files import is_there
from physid_drake.identify.config import INTEGRATORS
from physid_drake.policies import POLICIES
from physid_drake.ranges import Range, is_whole
from physid_drake.resources import shipped
from physid_drake.run_folder import named_after
from physid_drake.scenario_schema import Scenario
from physid_drake.search import SEARCHES
from physid_drake.wording import named, one_line, shown
from physid_drake.yaml_text import parsed, read_yaml

DEFAULT = "sealed.yaml"
FARTHEST = 100.0  # m: of a goal or a start
LARGEST = 1e6  # of theta, in SI units
Rule = tuple[str, object, bool, str]  # key, value, whether it is fine, and what it must be
WHOLE = {
    "search.refine_every": (0, 10_000), "search.candidates": (2, 20_000), "search.budget": (1, 2_000),
    "search.batch": (1, 1_000), "search.patience": (1, 10_000), "search.jobs": (0, 1_000),
    "plan.budget": (1, 2_000), "plan.sweep": (0, 1_000), "plan.draws": (0, 1_000), "seed": (0, 2**32 - 1),
    "pushes": (1, 10_000),
}  # fmt: skip
"""From, to. Beyond, memory or patience end before the run does."""
REAL = {
    "search.entropy_tolerance_nats": (Range(least=0.0, most=100.0), "from 0 to 100 nats"),
    "plan.tolerance_m": (Range(above=0.0, most=10.0), "above 0, at most 10 m"),
    "plan.start_deg": (Range(least=-3600.0, most=3600.0), "from -3600 to 3600 degrees"),
    "theta.cell_spread": (Range(least=1e-3, most=10.0), "from 0.001 to 10"),
    "theta.cell_length": (Range(least=1e-3, most=100.0), "from 0.001 to 100"),
}


def load_scenario(
    config: str | None, override: str | None, *, recording: str | None = None, seed: int | None = None
) -> tuple[str, Scenario]:
    """Read a scenario.

    Args:
        config: ``FILE`` or ``FILE:NAME``; a bare name is looked up among the shipped ones. None is the first shipped
            one; of a recording that is named, the defaults, since a shipped scenario's plan suits its own recording.
        override: one line of YAML laid over it, such as ``{search: {budget: 20}}``.
        recording: instead of the scenario's.
        seed: instead of the scenario's.

    Returns:
        The scenario's name and its values.

    Raises:
        ConfigError: naming the file and the key.
    """
    if config is None and recording is not None:
        name, scenario, where = _name_of(recording), Scenario(), "the defaults"
    else:
        name, scenario, where = _named_scenario(config or DEFAULT)
    if override is not None:
        before, scenario = scenario, _typed(parsed(override, "--set"), scenario, "--set")
        try:
            _checked(scenario, where)
        except ConfigError:
            _checked(before, where)  # what is wrong is the file's own; or else:
            where = "--set"
    if recording is not None:
        scenario.recording = recording
    if seed is not None:
        scenario.seed = seed
    return name, _checked(scenario, where)


def _name_of(recording: str) -> str:
    """Of a run: that of the recording's folder.

    Raises:
        ConfigError: if nothing can have such a name.
    """
    try:
        return named_after(Path(os.path.realpath(recording)).name)
    except (OSError, ValueError) as error:
        raise ConfigError(f"recording {shown(recording)}: nothing can have such a name.") from error


def config_folders(config: str | None) -> tuple[Path, ...]:
    """The folder of the CONFIG that was given, which is somebody's own; none where none was."""
    return () if config is None else (_locate(config)[0].absolute().parent,)


def _named_scenario(config: str) -> tuple[str, Scenario, str]:
    """A scenario's name, its values, and where they are from, in words."""
    path, name = _locate(config)
    scenarios = _read_yaml(path)
    if name is None:
        name = next(iter(scenarios))
    if name not in scenarios:
        raise ConfigError(
            f"config '{named(path)}': there is no scenario '{named(name)}'; it holds {named(', '.join(scenarios))}."
        )
    where = f"config '{named(path)}', scenario '{named(name)}'"
    return name, _typed(scenarios[name], Scenario(), where), where


def dump_scenario(name: str, scenario: Scenario) -> str:
    """The scenario as YAML that ``load_scenario`` reads."""
    return str(yaml_dump_typed({name: scenario}, schema=dict[str, Scenario]))


def _locate(config: str) -> tuple[Path, str | None]:
    file, _, name = (config, "", "") if is_there(Path(config)) else config.rpartition(":")
    file, name = (file, name) if file else (name, "")
    path = Path(file)
    if not is_there(path) and path.parent == Path():
        for candidate in (shipped("configs") / file, shipped("configs") / f"{file}.yaml"):
            if is_there(candidate):
                path = candidate
                break
    return path, name or None


def _read_yaml(path: Path) -> dict[str, Any]:
    content = read_yaml(path, f"config '{named(path)}'")
    if not isinstance(content, dict) or not content:
        raise ConfigError(f"config '{named(path)}': needs named scenarios at the top level, 'name: {{...}}'.")
    # Keys that start with an underscore are for anchors and templates.
    scenarios = {str(key): value for key, value in content.items() if not str(key).startswith("_")}
    for name, content in scenarios.items():
        if content is not None and not isinstance(content, dict):
            raise ConfigError(
                f"config '{path}': scenario {shown(name)} needs keys and values below it, but is {shown(content)}."
            )
    if not scenarios:
        raise ConfigError(f"config '{named(path)}': holds no scenario; names that start with '_' are templates.")
    return scenarios


def _typed(content: Any, defaults: Scenario, where: str) -> Scenario:
    if content is None:
        return defaults
    _refuse_wrong(content, Scenario, where)
    try:
        loaded: Scenario = yaml_load_typed(schema=Scenario, data=yaml.safe_dump(content), defaults=defaults)
    except (RuntimeError, ValueError, TypeError, KeyError, AssertionError, OverflowError) as error:
        raise ConfigError(f"{where}: {one_line(error)}.") from error
    return loaded


def _refuse_wrong(content: Any, schema: Any, where: str, key: str = "") -> None:
    """Refuse unknown keys and values of a wrong kind; Drake's loader names neither the file nor the key.

    Args:
        content: parsed YAML.
        schema: a dataclass, ``list[...]``, ``dict[str, ...]``, ``str``, ``int``, ``float`` or ``bool``.
        where: file and scenario, for the message.
        key: dotted path of the content.
    """
    place = f"{where}, key '{named(key)}'" if key else where
    if dc.is_dataclass(schema):
        if not isinstance(content, dict):
            raise ConfigError(f"{place}: needs keys and values, but got {shown(content)}.")
        fields = {field.name: field.type for field in dc.fields(schema)}
        for name, value in content.items():
            if name not in fields:
                raise ConfigError(f"{place}: the key '{named(name)}' is unknown; known are {', '.join(fields)}.")
            _refuse_wrong(value, fields[name], where, f"{key}.{name}".lstrip("."))
        return
    origin, inner = get_origin(schema), get_args(schema)
    if origin is not None:
        if not isinstance(content, origin):
            raise ConfigError(
                f"{place}: needs a {'list' if origin is list else 'mapping'}, but got {shown(content)}."
            )
        for name, value in content.items() if isinstance(content, dict) else enumerate(content):
            _refuse_wrong(value, inner[-1], where, f"{key}.{name}")
        return
    kind, fits = _KINDS[schema]
    if not fits(content):
        raise ConfigError(f"{place}: needs {kind}, but got {shown(content)}.")


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_number(value: Any) -> bool:
    """YAML reads 1e-3 as text and 1 as a whole number; both are fine where a number is wanted."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return False
    try:
        return math.isfinite(float(value))
    except (ValueError, OverflowError):
        return False


_KINDS: dict[Any, tuple[str, Callable[[Any], bool]]] = {
    str: ("text", _is_text),
    int: ("a whole number", is_whole),
    float: ("a number", _is_number),
    bool: ("true or false", lambda value: isinstance(value, bool)),
}


def _checked(scenario: Scenario, where: str) -> Scenario:
    """Refuse values that no run can use."""
    try:
        check_config(scenario.cell)
    except ConfigError as error:
        raise ConfigError(f"{where}, {error}") from error
    for key, value, fine, rule in (*_words(scenario), *_numbers(scenario), *_places(scenario)):
        if not fine:
            raise ConfigError(f"{where}, key '{key}': must be {rule}, but is {shown(value)}.")
    return scenario


def _words(scenario: Scenario) -> list[Rule]:
    method, policy = scenario.search.method, scenario.plan.policy
    return [
        ("search.method", method, method in SEARCHES, f"one of {', '.join(SEARCHES)}"),
        (
            "search.integrator",
            scenario.search.integrator,
            scenario.search.integrator in INTEGRATORS,
            f"one of {', '.join(INTEGRATORS)}",
        ),
        ("plan.policy", policy, policy in POLICIES, f"one of {', '.join(POLICIES)}"),
    ]


def _numbers(scenario: Scenario) -> list[Rule]:
    rules: list[Rule] = []
    for key, (least, most) in WHOLE.items():
        value = _at(scenario, key)
        rules.append((key, value, least <= value <= most, f"from {least} to {most}"))
    for key, (allowed, rule) in REAL.items():
        value = _at(scenario, key)
        rules.append((key, value, allowed.holds(value), rule))
    return rules


def _places(scenario: Scenario) -> list[Rule]:
    rule = f"[x, y], each from {-FARTHEST:g} to {FARTHEST:g} m, or empty"
    places = {key: _at(scenario, key) for key in ("plan.goal_m", "plan.start_m")}
    theta = scenario.theta
    numbers = {f"theta.bounds.{name}": ends for name, ends in theta.bounds.items()}
    numbers |= {f"theta.nominal.{name}": [value] for name, value in theta.nominal.items()}
    large: list[Rule] = [
        (key, values, all(abs(value) <= LARGEST for value in values), f"numbers from {-LARGEST:g} to {LARGEST:g}")
        for key, values in numbers.items()
    ]
    return large + [
        (key, place, len(place) in (0, 2) and all(abs(value) <= FARTHEST for value in place), rule)
        for key, place in places.items()
    ]


def _at(scenario: Scenario, key: str) -> Any:
    """The value at a dotted path."""
    return functools.reduce(getattr, key.split("."), scenario)
