"""``model.yaml``, read and checked: whatever is wrong with it is one line."""

from __future__ import annotations

import dataclasses as dc
import math
import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from physid_drake.cell import Body, CellConfig
from physid_drake.cell.checks import MOST_CELLS, check_config
from physid_drake.cell.config import ContactConfig, SolverConfig
from physid_drake.cell.solid import solid_of
from physid_drake.effects import Effect, effect_named, of_models
from physid_drake.effects.unnamed import FRICTIONS, OVER_PLACES, UnnamedForce
from physid_drake.errors import CellError, ConfigError, PhysidError, RecordingError
from physid_drake.model import AS_W, COMPLETE, FORMAT, SHAPES, Correlation, Model
from physid_drake.pushes.theta import RANGES
from physid_drake.ranges import ANY, NOT_NEGATIVE, POSITIVE, Range
from physid_drake.recording import Shape
from physid_drake.wording import named, one_line, shown
from physid_drake.yaml_text import read_yaml

LARGEST = 1e9  # of any number, in SI units
LONGEST = 10.0  # m: of a tip, or of a place on the object
FURTHEST = 1100.0  # m: of a table's corner
FASTEST = 1000.0  # m/s: of a hand
MOST_LOG = 10.0  # of a friction's factor
LIGHTEST, HEAVIEST = 1e-6, 1e6  # kg: of an object
UNIT = Range(least=-1.001, most=1.001)  # of a unit vector's components, with round-off


def load_model(path: Path | str) -> Model:
    """Read ``model.yaml``.

    Args:
        path: the file, or the folder of a diagnosis that holds it.

    Raises:
        ConfigError: if it cannot be read, is of another version, or holds what no model has.
    """
    file = Path(path)
    file = file / "model.yaml" if os.path.isdir(file) else file  # noqa: PTH112  # raises for no name
    where = f"model '{named(file)}'"
    content = read_yaml(file, where, aliases=False)
    found = content.get("format") if isinstance(content, dict) else None
    if found != FORMAT:
        raise ConfigError(f"{where}: the format must be '{FORMAT}', but is {shown(found)}; diagnose again.")
    if content.get(COMPLETE) is not True:
        raise ConfigError(
            f"{where}: is cut off, or of an earlier revision: its last line must be '{COMPLETE}: true'."
        )
    try:
        return _model(content, file)
    except PhysidError as error:
        raise ConfigError(f"{where}: {error}") from error
    except (TypeError, ValueError, AttributeError, LookupError, ArithmeticError, RuntimeError, OSError) as error:
        raise ConfigError(f"{where}: {type(error).__name__}: {one_line(error)}.") from error


def _model(content: dict[str, Any], file: Path) -> Model:
    config = _config(_mapping("cell", _given(content, "cell")))
    effects = _effects(_given(content, "effects"))
    intervals = _intervals(content.get("intervals", {}), effects)
    radius = _given(content, "hand_radius_m")
    shape, height = _shape(_mapping("object", _given(content, "object")), file.parent)
    # The contact is at the object; an upright tip's P may be above it.
    ranges = {
        "tip_height_m": Range(above=0.0, most=LONGEST),
        "contact_height_m": Range(above=0.0, most=height),
        "top_speed_mps": Range(least=0.0, most=FASTEST),
    }
    hand = {
        key.rpartition("_")[0]: None if (value := content.get(key)) is None else _number(key, value, allowed)
        for key, allowed in ranges.items()
    }
    return Model(
        recording=_text("recording", _given(content, "recording")),
        shape=shape,
        hand_radius=None if radius is None else _number("hand_radius_m", radius, Range(above=0.0, most=LONGEST)),
        table=_table(_given(content, "table_m")),
        config=config,
        body=_body(_given(content, "theta"), cells=config.friction_cells[0] * config.friction_cells[1]),
        effects=effects,
        intervals=intervals,
        correlation=_correlation(content.get("correlation"), intervals),
        hand_axes=_axes(content.get("hand_axes")),
        hand_turns=_truth("hand_turns", content.get("hand_turns", False)),
        **hand,
    )


def _given(content: Mapping[str, Any], key: str, place: str = "") -> Any:
    """The value of a key that must be there; it may be null.

    Raises:
        ConfigError: if it is not.
    """
    if key not in content:
        raise ConfigError(f"key '{place}{key}' is missing; diagnose again.")
    return content[key]


def _mapping(key: str, value: Any, known: Iterable[str] | None = None) -> dict[str, Any]:
    """Keys and values, of which no key is unknown.

    Raises:
        ConfigError: naming the key and the rule.
    """
    if not (isinstance(value, dict) and all(isinstance(name, str) for name in value)):
        raise ConfigError(f"key '{named(key)}': must be keys and values, but is {shown(value)}.")
    unknown = [] if known is None else [name for name in value if name not in known]
    if unknown:
        raise ConfigError(f"key '{named(f'{key}.{unknown[0]}')}' is unknown; known are {', '.join(known or ())}.")
    return value


def _text(key: str, value: Any) -> str:
    if not isinstance(value, str):
        raise ConfigError(f"key '{key}': must be text, but is {shown(value)}.")
    return value


def _truth(key: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ConfigError(f"key '{key}': must be true or false, but is {shown(value)}.")
    return value


def _number(key: str, value: Any, allowed: Range = ANY) -> float:
    """A finite number of those that are allowed; where nothing else is said, of a size that is not absurd.

    Raises:
        ConfigError: naming the key and the rule.
    """
    if allowed.most == allowed.below == math.inf:
        allowed = dc.replace(allowed, most=LARGEST)
    if allowed.least == allowed.above == -math.inf:
        allowed = dc.replace(allowed, least=-LARGEST)
    if not (isinstance(value, int | float) and not isinstance(value, bool) and allowed.holds(value)):
        raise ConfigError(f"key '{named(key)}': must be a finite number {allowed.rule}, but is {shown(value)}.")
    return float(value)


def _numbers(key: str, values: Any, count: int, allowed: Range = ANY) -> list[float]:
    if not isinstance(values, list) or len(values) != count:
        raise ConfigError(f"key '{key}': must be a list of {count} numbers, but is {shown(values)}.")
    return [_number(key, value, allowed) for value in values]


def _rows(key: str, found: Any, allowed: Range = ANY) -> tuple[tuple[float, float], tuple[float, float]]:
    """Two rows of two numbers."""
    if not (isinstance(found, list) and len(found) == 2):
        raise ConfigError(f"key '{key}': must be two rows of two numbers, but is {shown(found)}.")
    (a, b), (c, d) = (_numbers(key, row, 2, allowed) for row in found)
    return (a, b), (c, d)


def _config(cell: dict[str, Any]) -> CellConfig:
    inner: dict[str, Any] = {}
    for key, kind in (("contact", ContactConfig), ("solver", SolverConfig)):
        values = _mapping(f"cell.{key}", _given(cell, key, "cell."), [f.name for f in dc.fields(kind)])
        inner[key] = kind(**values)
    known = [f.name for f in dc.fields(CellConfig)]
    config = CellConfig(**{**_mapping("cell", cell, known), **inner})
    check_config(config)
    return config


def _table(found: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower and upper corner."""
    places = Range(least=-FURTHEST, most=FURTHEST)
    (x0, y0), (x1, y1) = _rows("table_m", found, places)
    upper = [
        _number("table_m", high, Range(above=low, most=FURTHEST)) for low, high in ((x0, x1), (y0, y1))
    ]  # fmt: skip
    return (x0, y0), (upper[0], upper[1])


def _body(found: Any, *, cells: int) -> Body:
    fields = dc.fields(Body)
    theta = _mapping("theta", found, [f.name for f in fields])
    for field in fields:
        if field.default is dc.MISSING:
            _given(theta, field.name, "theta.")
    # The cell can be without friction at the hand, though no push tells so.
    allowed = RANGES | {"hand_friction": NOT_NEGATIVE, "mass": Range(above=0.0, least=LIGHTEST, most=HEAVIEST)}
    given = {
        name: _number(f"theta.{name}", value, allowed[name])
        for name, value in theta.items() if name not in ("p_BBcm", "support_friction")
    }  # fmt: skip
    place = _numbers("theta.p_BBcm", theta["p_BBcm"], 2, Range(least=-LONGEST, most=LONGEST))
    friction = _numbers("theta.support_friction", theta["support_friction"], cells, POSITIVE)
    return Body(p_BBcm=np.array(place), support_friction=np.array(friction), **given)


def _effects(found: Any) -> tuple[Effect, ...]:
    if not isinstance(found, list):
        raise ConfigError(f"key 'effects': must be a list, but is {shown(found)}.")
    effects = tuple(_effect(_mapping("effects", content, ("name", "parameters"))) for content in found)
    names = [effect.name for effect in effects]
    if len(set(names)) < len(names):
        raise ConfigError(f"key 'effects': none may be there twice, but they are {named(', '.join(names))}.")
    return effects


def _effect(content: Mapping[str, Any]) -> Effect:
    kind = effect_named(_text("effects.name", _given(content, "name", "effects.")), of_models())
    nulls, ranges = {f.name: f.default for f in dc.fields(kind)}, kind.ranges()
    place = f"effects.{kind.name}"
    parameters: dict[str, Any] = {}
    for name, value in _mapping(place, _given(content, "parameters", f"{place}."), nulls).items():
        key = f"{place}.{name}"
        if kind is UnnamedForce:
            parameters[name] = _table_of(key, name, value)
        elif isinstance(nulls[name], tuple):
            parameters[name] = _grid(key, value)
        else:
            parameters[name] = _number(key, value, ranges.get(name, ANY))
    for name in nulls:
        _given(parameters, name, f"{place}.")
    if kind is UnnamedForce:
        _refuse_uneven(place, parameters)
    return kind(**parameters)


def _table_of(key: str, name: str, value: Any) -> Any:
    """Rows of numbers, a row, or none, of what has no name; or where they stand."""
    if name == "places":
        x, y, step_x, step_y = _numbers(key, value, 4, Range(least=-FURTHEST, most=FURTHEST))
        return (x, y, *(_number(key, step, POSITIVE) for step in (step_x, step_y)))
    if name == "speeds":
        slowest, fastest = _numbers(key, value, 2, POSITIVE)
        return slowest, _number(key, fastest, Range(above=slowest))
    if not isinstance(value, list) or len(value) > MOST_CELLS:
        raise ConfigError(f"key '{key}': must be a list of at most {MOST_CELLS}, but is {shown(value)}.")
    allowed = Range(least=-MOST_LOG, most=MOST_LOG) if name in FRICTIONS else ANY
    if name not in OVER_PLACES:
        return tuple(_numbers(key, value, len(value), allowed))
    if not all(isinstance(row, list) and 0 < len(row) == len(value[0]) <= MOST_CELLS for row in value):
        raise ConfigError(f"key '{key}': must be rows of one length, at most {MOST_CELLS}, but is {shown(value)}.")
    return tuple(tuple(_numbers(key, row, len(row), allowed)) for row in value)


def _refuse_uneven(place: str, parameters: Mapping[str, Any]) -> None:
    """Two components of one force have as many numbers.

    Raises:
        ConfigError: if they have not.
    """
    for first, second in (("force_x", "force_y"), ("along", "across")):
        a, b = parameters.get(first, ()), parameters.get(second, ())
        if a and b and np.shape(a) != np.shape(b):
            raise ConfigError(f"keys '{place}.{first}' and '{place}.{second}': must have as many numbers.")


def _grid(key: str, rows: Any) -> tuple[tuple[float, ...], ...]:
    """Weights, not negative and not all 0, in rows of one length."""
    even = isinstance(rows, list) and rows and all(isinstance(r, list) and len(r) == len(rows[0]) for r in rows)
    if not even or max(len(rows), len(rows[0])) > MOST_CELLS:
        raise ConfigError(
            f"key '{key}': must be rows of equally many numbers, at most {MOST_CELLS} of each, but is {shown(rows)}."
        )
    grid = tuple(tuple(_number(key, value, NOT_NEGATIVE) for value in row) for row in rows)
    if not sum(map(sum, grid)) > 0.0:
        raise ConfigError(f"key '{key}': must have a weight above 0, but is {shown(rows)}.")
    return grid


def _intervals(found: Any, effects: tuple[Effect, ...]) -> dict[str, Any]:
    if not (isinstance(found, dict) and all(isinstance(name, str) for name in found)):
        raise ConfigError(f"key 'intervals': must be names with two numbers each, but is {shown(found)}.")
    units = {effect.name: effect.units() for effect in effects}
    for name, interval in found.items():
        owner, _, parameter = name.partition(".")
        if owner in units and parameter not in units[owner]:
            raise ConfigError(f"key 'intervals': '{named(name)}' belongs to no parameter.")
        if not (isinstance(interval, list) and interval and _holds_numbers(interval)):
            raise ConfigError(f"key 'intervals.{named(name)}': must be two numbers, but is {shown(interval)}.")
    return found


def _holds_numbers(value: Any) -> bool:
    """Whether it is a number, or lists of numbers: of a grid, every cell has an interval."""
    if isinstance(value, list):
        return all(_holds_numbers(inner) for inner in value)
    return isinstance(value, int | float) and not isinstance(value, bool) and not abs(value) > sys.float_info.max


def _correlation(found: Any, intervals: Mapping[str, Any]) -> Correlation | None:
    if found is None:
        return None
    content = _mapping("correlation", found, ("names", "matrix"))
    names, matrix = (_given(content, key, "correlation.") for key in ("names", "matrix"))
    if not (isinstance(names, list) and all(isinstance(name, str) for name in names)):
        raise ConfigError(f"key 'correlation.names': must be a list of names, but is {shown(names)}.")
    unknown = [name for name in names if name not in intervals]
    if unknown:
        raise ConfigError(f"correlation: '{named(unknown[0])}' has no interval.")
    if not (isinstance(matrix, list) and all(isinstance(row, list) for row in matrix)):
        raise ConfigError(f"key 'correlation.matrix': must be rows of numbers, but is {shown(matrix)}.")
    share = Range(least=-1.0, most=1.0)
    rows = tuple(tuple(_number("correlation.matrix", value, share) for value in row) for row in matrix)
    return Correlation(names=tuple(names), matrix=rows)


def _axes(found: Any) -> tuple[tuple[float, float], tuple[float, float]]:
    return AS_W if found is None else _rows("hand_axes", found, UNIT)


def _shape(content: Mapping[str, Any], folder: Path) -> tuple[Shape, float]:
    """The object's shape, and its height [m]."""
    name = _text("object.shape", _given(content, "shape", "object."))
    if name not in SHAPES:
        raise ConfigError(f"key 'object.shape': must be one of {', '.join(SHAPES)}, but is {shown(name)}.")
    kind = SHAPES[name]
    _mapping("object", content, ["shape", *(f.name for f in dc.fields(kind))])
    fields = {f.name: _shape_value(f.name, content, folder) for f in dc.fields(kind) if _is_needed(f, content)}
    try:
        shape = kind(**fields)
        return shape, solid_of(shape).height
    except (RecordingError, CellError) as error:
        raise ConfigError(f"key 'object': {error}") from error


def _is_needed(field: dc.Field[Any], content: Mapping[str, Any]) -> bool:
    return field.name in content or field.default is dc.MISSING


def _shape_value(name: str, content: Mapping[str, Any], folder: Path) -> Any:
    key, value = f"object.{name}", _given(content, name, "object.")
    match name:
        case "file":
            return Path(os.path.abspath(folder / _text(key, value)))  # noqa: PTH100  # resolve raises for no name
        case "axis":
            return _text(key, value)
        case "size":
            return tuple(_numbers(key, value, 3, POSITIVE))
        case "polygon":
            if not isinstance(value, list):
                raise ConfigError(f"key '{key}': must be a list of [x, y] pairs, but is {shown(value)}.")
            return tuple(tuple(_numbers(key, place, 2)) for place in value)
        case _:
            return _number(key, value, POSITIVE)
