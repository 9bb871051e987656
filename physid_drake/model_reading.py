"""``model.yaml``, read and checked: whatever is wrong with it is one line."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from physid_drake.cell import Body, CellConfig
from physid_drake.cell.checks import check_config
from physid_drake.cell.config import ContactConfig, SolverConfig
from physid_drake.cell.solid import solid_of
from physid_drake.effects import Effect, effect_named
from physid_drake.errors import ConfigError
from physid_drake.identify.theta import RANGES
from physid_drake.model import AS_W, COMPLETE, FORMAT, SHAPES, Correlation, Model
from physid_drake.ranges import ANY, NOT_NEGATIVE, POSITIVE, Range
from physid_drake.recording import Shape
from physid_drake.yaml_text import read_yaml


def load_model(path: Path | str) -> Model:
    """Read ``model.yaml``.

    Args:
        path: the file, or the folder of a diagnosis that holds it.

    Raises:
        ConfigError: if it cannot be read, is of another version, or holds what no model has.
    """
    file = Path(path)
    file = file / "model.yaml" if file.is_dir() else file
    where = f"model '{file}'"
    content = read_yaml(file, where)
    found = content.get("format") if isinstance(content, dict) else None
    if found != FORMAT:
        raise ConfigError(f"{where}: the format must be '{FORMAT}', but is {found!r}; diagnose again.")
    if content.get(COMPLETE) is not True:
        raise ConfigError(
            f"{where}: is cut off, or of an earlier revision: its last line must be '{COMPLETE}: true'."
        )
    try:
        return _model(content, file)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error}") from error
    except KeyError as error:
        raise ConfigError(f"{where}: key {error} is missing.") from error
    except (TypeError, ValueError, AttributeError) as error:
        cause = " ".join(str(error).split()).rstrip(".")
        raise ConfigError(f"{where}: {type(error).__name__}: {cause}.") from error


def _model(content: dict[str, Any], file: Path) -> Model:
    cell = content["cell"]
    config = CellConfig(
        **{**cell, "contact": ContactConfig(**cell["contact"]), "solver": SolverConfig(**cell["solver"])}
    )  # fmt: skip
    check_config(config)
    effects = tuple(_effect(e) for e in content["effects"])
    names = [effect.name for effect in effects]
    if len(set(names)) < len(names):
        raise ConfigError(f"key 'effects': none may be there twice, but they are {', '.join(names)}.")
    intervals = _intervals(content.get("intervals", {}), effects)
    radius = content["hand_radius_m"]
    shape = _shape(content["object"], file.parent)
    # The contact is at the object; an upright tip's P may be above it.
    ranges = {
        "tip_height_m": POSITIVE,
        "contact_height_m": Range(above=0.0, most=solid_of(shape).height),
        "top_speed_mps": NOT_NEGATIVE,
    }
    hand = {
        key.rpartition("_")[0]: None if (value := content.get(key)) is None else _number(key, value, allowed)
        for key, allowed in ranges.items()
    }
    (x0, y0), (x1, y1) = _rows("table_m", content["table_m"])
    return Model(
        recording=str(content["recording"]),
        shape=shape,
        hand_radius=None if radius is None else _number("hand_radius_m", radius, POSITIVE),
        table=(
            (x0, y0),
            (_number("table_m", x1, Range(above=x0)), _number("table_m", y1, Range(above=y0))),
        ),
        config=config,
        body=_body(content["theta"], cells=config.friction_cells[0] * config.friction_cells[1]),
        effects=effects,
        intervals=intervals,
        correlation=_correlation(content, intervals),
        hand_axes=_axes(content.get("hand_axes")),
        hand_turns=bool(content.get("hand_turns", False)),
        **hand,
    )


def _number(key: str, value: Any, allowed: Range = ANY) -> float:
    """A finite number of those that are allowed.

    Raises:
        ConfigError: naming the key and the rule.
    """
    good = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    if not (good and allowed.holds(value)):
        rule = f" {allowed.rule}" if allowed.rule else ""
        raise ConfigError(f"key '{key}': must be a finite number{rule}, but is {value!r}.")
    return float(value)


def _body(theta: Mapping[str, Any], *, cells: int) -> Body:
    numbers = {f.name for f in dc.fields(Body)} - {"p_BBcm", "support_friction"}
    allowed = RANGES | {"hand_friction": NOT_NEGATIVE}  # the cell can be without, though no push tells so
    given = {
        name: _number(f"theta.{name}", value, allowed[name])
        for name, value in theta.items() if name in numbers
    }  # fmt: skip
    place = _numbers("theta.p_BBcm", theta["p_BBcm"], 2)
    friction = _numbers("theta.support_friction", theta["support_friction"], cells, POSITIVE)
    rest = {name: value for name, value in theta.items() if name not in {*given, "p_BBcm", "support_friction"}}
    return Body(p_BBcm=np.array(place), support_friction=np.array(friction), **given, **rest)


def _numbers(key: str, values: Any, count: int, allowed: Range = ANY) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise ConfigError(f"key '{key}': must be a list of {count} numbers, but is {values!r}.")
    return [_number(key, value, allowed) for value in values]


def _effect(content: Mapping[str, Any]) -> Effect:
    kind = effect_named(str(content["name"]))
    nulls, ranges = {f.name: f.default for f in dc.fields(kind)}, kind.ranges()
    parameters: dict[str, Any] = {}
    for name, value in content["parameters"].items():
        key = f"effects.{kind.name}.{name}"
        if isinstance(nulls.get(name, 0.0), tuple):
            parameters[name] = _grid(key, value)
        else:
            parameters[name] = _number(key, value, ranges.get(name, ANY))
    missing = [name for name in nulls if name not in parameters]
    if missing:
        raise ConfigError(f"key 'effects.{kind.name}.{missing[0]}' is missing.")
    return kind(**parameters)


def _grid(key: str, rows: Any) -> tuple[tuple[float, ...], ...]:
    """Weights, not negative and not all 0, in rows of one length."""
    even = isinstance(rows, list) and rows and all(isinstance(r, list) and len(r) == len(rows[0]) for r in rows)
    if not even:
        raise ConfigError(f"key '{key}': must be rows of equally many numbers, but is {rows!r}.")
    grid = tuple(tuple(_number(key, value, NOT_NEGATIVE) for value in row) for row in rows)
    if not sum(map(sum, grid)) > 0.0:
        raise ConfigError(f"key '{key}': must have a weight above 0, but is {rows!r}.")
    return grid


def _intervals(found: Any, effects: tuple[Effect, ...]) -> dict[str, Any]:
    if not (isinstance(found, dict) and all(isinstance(name, str) for name in found)):
        raise ConfigError(f"key 'intervals': must be names with two numbers each, but is {found!r}.")
    units = {effect.name: effect.units() for effect in effects}
    for name in found:
        owner, _, parameter = name.partition(".")
        if owner in units and parameter not in units[owner]:
            raise ConfigError(f"key 'intervals': '{name}' belongs to no parameter.")
    return found


def _correlation(content: Mapping[str, Any], intervals: Mapping[str, Any]) -> Correlation | None:
    found = content.get("correlation")
    if found is None:
        return None
    unknown = [name for name in found["names"] if name not in intervals]
    if unknown:
        raise ConfigError(f"correlation: '{unknown[0]}' has no interval.")
    rows = tuple(tuple(float(v) for v in row) for row in found["matrix"])
    return Correlation(names=tuple(str(name) for name in found["names"]), matrix=rows)


def _axes(found: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    if found is None:
        return AS_W
    return _rows("hand_axes", found)


def _rows(key: str, found: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """Two rows of two numbers."""
    if not (isinstance(found, list) and len(found) == 2):
        raise ConfigError(f"key '{key}': must be two rows of two numbers, but is {found!r}.")
    (a, b), (c, d) = (_numbers(key, row, 2) for row in found)
    return (a, b), (c, d)


def _shape(content: Mapping[str, Any], folder: Path) -> Shape:
    fields = {k: _tuples(v) for k, v in content.items() if k != "shape"}
    if content["shape"] == "mesh":
        fields["file"] = (folder / str(fields["file"])).resolve()
    return SHAPES[content["shape"]](**fields)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(v) for v in value) if isinstance(value, list) else value
