"""A run's configuration: one YAML file with named scenarios, read by Drake's typed loader."""

from __future__ import annotations

import dataclasses as dc
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args, get_origin

import yaml
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

from physid_drake.cell.checks import check_config
from physid_drake.errors import ConfigError
from physid_drake.policies import POLICIES
from physid_drake.resources import shipped
from physid_drake.run_folder import named_after
from physid_drake.scenario_schema import Scenario
from physid_drake.search import SEARCHES
from physid_drake.yaml_text import parsed, read_yaml

DEFAULT = "sealed.yaml"


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
        name, scenario, where = named_after(Path(recording).resolve().name), Scenario(), "the defaults"
    else:
        name, scenario, where = _named_scenario(config or DEFAULT)
    if override is not None:
        scenario = _typed(parsed(override, "--set"), scenario, "--set")
    if recording is not None:
        scenario.recording = recording
    if seed is not None:
        scenario.seed = seed
    return name, _checked(scenario, where)


def _named_scenario(config: str) -> tuple[str, Scenario, str]:
    """A scenario's name, its values, and where they are from, in words."""
    path, name = _locate(config)
    scenarios = _read_yaml(path)
    if name is None:
        name = next(iter(scenarios))
    if name not in scenarios:
        raise ConfigError(f"config '{path}': there is no scenario '{name}'; it holds {', '.join(scenarios)}.")
    where = f"config '{path}', scenario '{name}'"
    return name, _typed(scenarios[name], Scenario(), where), where


def dump_scenario(name: str, scenario: Scenario) -> str:
    """The scenario as YAML that ``load_scenario`` reads."""
    return str(yaml_dump_typed({name: scenario}, schema=dict[str, Scenario]))


def _locate(config: str) -> tuple[Path, str | None]:
    file, _, name = (config, "", "") if Path(config).exists() else config.rpartition(":")
    file, name = (file, name) if file else (name, "")
    path = Path(file)
    if not path.exists() and path.parent == Path():
        for candidate in (shipped("configs") / file, shipped("configs") / f"{file}.yaml"):
            if candidate.exists():
                path = candidate
                break
    return path, name or None


def _read_yaml(path: Path) -> dict[str, Any]:
    content = read_yaml(path, f"config '{path}'")
    if not isinstance(content, dict) or not content:
        raise ConfigError(f"config '{path}': needs named scenarios at the top level, 'name: {{...}}'.")
    # Keys that start with an underscore are for anchors and templates.
    scenarios = {str(key): value for key, value in content.items() if not str(key).startswith("_")}
    if not scenarios:
        raise ConfigError(f"config '{path}': holds no scenario; names that start with '_' are templates.")
    return scenarios


def _typed(content: Any, defaults: Scenario, where: str) -> Scenario:
    if content is None:
        return defaults
    _refuse_wrong(content, Scenario, where)
    try:
        loaded: Scenario = yaml_load_typed(schema=Scenario, data=yaml.safe_dump(content), defaults=defaults)
    except (RuntimeError, ValueError, TypeError, KeyError, AssertionError) as error:
        raise ConfigError(f"{where}: {_one_line(error)}.") from error
    return loaded


def _refuse_wrong(content: Any, schema: Any, where: str, key: str = "") -> None:
    """Refuse unknown keys and values of a wrong kind; Drake's loader names neither the file nor the key.

    Args:
        content: parsed YAML.
        schema: a dataclass, ``list[...]``, ``dict[str, ...]``, ``str``, ``int``, ``float`` or ``bool``.
        where: file and scenario, for the message.
        key: dotted path of the content.
    """
    place = f"{where}, key '{key}'" if key else where
    if dc.is_dataclass(schema):
        if not isinstance(content, dict):
            raise ConfigError(f"{place}: needs keys and values, but got {content!r}.")
        fields = {field.name: field.type for field in dc.fields(schema)}
        for name, value in content.items():
            if name not in fields:
                raise ConfigError(f"{place}: the key '{name}' is unknown; known are {', '.join(fields)}.")
            _refuse_wrong(value, fields[name], where, f"{key}.{name}".lstrip("."))
        return
    origin, inner = get_origin(schema), get_args(schema)
    if origin is not None:
        if not isinstance(content, origin):
            raise ConfigError(f"{place}: needs a {'list' if origin is list else 'mapping'}, but got {content!r}.")
        for name, value in content.items() if isinstance(content, dict) else enumerate(content):
            _refuse_wrong(value, inner[-1], where, f"{key}.{name}")
        return
    kind, fits = _KINDS[schema]
    if not fits(content):
        raise ConfigError(f"{place}: needs {kind}, but got {content!r}.")


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


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
    int: ("a whole number", _is_whole),
    float: ("a number", _is_number),
    bool: ("true or false", lambda value: isinstance(value, bool)),
}


def _checked(scenario: Scenario, where: str) -> Scenario:
    """Refuse values that no run can use."""
    try:
        check_config(scenario.cell)
    except ConfigError as error:
        raise ConfigError(f"{where}, {error}") from error
    search, plan = scenario.search, scenario.plan
    rules: list[tuple[str, object, bool, str]] = [
        ("search.method", search.method, search.method in SEARCHES, f"one of {', '.join(SEARCHES)}"),
        ("search.refine_every", search.refine_every, search.refine_every >= 0, "at least 0"),
        ("search.candidates", search.candidates, search.candidates >= 2, "at least 2"),
        ("search.budget", search.budget, search.budget >= 1, "at least 1"),
        ("search.batch", search.batch, search.batch >= 1, "at least 1"),
        ("search.patience", search.patience, search.patience >= 1, "at least 1"),
        ("search.jobs", search.jobs, search.jobs >= 0, "at least 0"),
        ("search.entropy_tolerance_nats", search.entropy_tolerance_nats, search.entropy_tolerance_nats >= 0.0,
         "at least 0 nats"),
        ("plan.policy", plan.policy, plan.policy in POLICIES, f"one of {', '.join(POLICIES)}"),
        ("plan.goal_m", plan.goal_m, len(plan.goal_m) in (0, 2), "[x, y], or empty"),
        ("plan.start_m", plan.start_m, len(plan.start_m) in (0, 2), "[x, y], or empty"),
        ("plan.budget", plan.budget, plan.budget >= 1, "at least 1"),
        ("plan.sweep", plan.sweep, plan.sweep >= 0, "at least 0"),
        ("plan.draws", plan.draws, plan.draws >= 0, "at least 0"),
        ("plan.tolerance_m", plan.tolerance_m, plan.tolerance_m > 0.0, "above 0 m"),
        ("seed", scenario.seed, scenario.seed >= 0, "at least 0"),
        ("held_out_share", scenario.held_out_share, 0.0 <= scenario.held_out_share < 1.0, "in [0, 1)"),
    ]  # fmt: skip
    for key, value, fine, rule in rules:
        if not fine:
            raise ConfigError(f"{where}, key '{key}': must be {rule}, but is {value!r}.")
    return scenario


def _one_line(error: BaseException) -> str:
    return re.sub(r"\s+", " ", str(error)).strip().rstrip(".")
