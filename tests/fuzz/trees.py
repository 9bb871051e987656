"""Damage to values in values: what YAML and JSON hold, and text of it that no library would write."""

from __future__ import annotations

import json
from random import Random
from typing import Any


class Raw(str):
    """Text that stands in the file as it is."""


Place = tuple[Any, ...]

NUMBERS = ("0", "-0", "0.0", "-0.0", "1", "-1", "2", "3", "7", "1000", "1e-3", "1.0e-12", "1.0e+12", "1e-320",
           "1.0e-320",
           "1e308", "-1.0e+308", "5e-324", "0.5", "-0.5", "0.9999999", "1.0000001", "255", "4294967296",
           "9223372036854775808", "-9223372036854775809", "1" + "0" * 25, "1" + "0" * 400,
           "1" + "0" * 5000)  # fmt: skip
YAML_ONLY = ("1e400", "-1.0e+400", ".nan", ".inf", "-.inf", "+1", "0x1F", "010", "0o17", "1:30", "1:30:00.5", "1_000",
             "2020-02-30", "2020-01-01", "2020-01-01 25:61:00", "~", "yes", "off", "", "=", "<<", "- - - 1",
             "!!float abc",
             "!!int x", "!!int ''", "!!bool maybe", "!!timestamp x", "!!null 5", "!!str", "!!binary abc=",
             "!!binary '!!!'",
             "!!set {a, b}", "!!omap [a: 1]", "!!pairs [[a, b]]",
             "!!python/object/apply:os.system ['touch ../pwned']",
             "!!python/name:os.system", "!unknown 3", "&a [*a]", "*nothing", "&b 3", "{<<: {a: 1}}", "{<<: 3}",
             "{? [a, b] : c}", "{? {a: 1} : c}", '"\\ud800"', '"\\udfff x"', '"\\e[31mred"', '"\\0"',
             '"\\u202E"', '"\\N"',
             "'" + "x" * 70000 + "'", "[" * 60 + "]" * 60, "[" * 3000 + "]" * 3000, "{a: " * 90 + "1" + "}" * 90,
             "[&a [x,x,x,x,x,x,x,x,x], &b [*a,*a,*a,*a,*a,*a,*a,*a,*a], &c [*b,*b,*b,*b,*b,*b,*b,*b,*b],"
             " &d [*c,*c,*c,*c,*c,*c,*c,*c,*c], [*d,*d,*d,*d,*d,*d,*d,*d,*d]]",
             "|\n    text\n   less", ">-\n    folded", "? x", "%YAML 9.9", "- 1\n  - 2", "@at", "`tick")  # fmt: skip
JSON_ONLY = ("NaN", "Infinity", "-Infinity", "1e400", "-1e400", '"\\ud800"', '"\\u0000"', '"\\u001b[2J"',
             '"' + "x" * 70000 + '"',
             "[" * 3000 + "]" * 3000, "[" * 100_000, '{"a":' * 2000 + "1" + "}" * 2000, "tru", "'x'", "", "01",
             "1.", ".5",
             "undefined", "// no", "{a: 1}", "[1,]")  # fmt: skip
VALUES = (None, True, False, "", " ", "x", "null", "nan", "1", "1e3", "../x", "/", ".", "..", "~", "a\nb",
          "a\tb", "\x1b[31m",
          "\u202eabc", "名前", "[bold]x[/bold]", "[/]", "$\\frac{", "%s%n", "{0}", "<script>alert(1)</script>",
          "-", "--help",
          "x" * 300, [], {}, [[]], [{}], {"": ""}, {"a": {"b": {"c": [1]}}}, [1, 2], [1.0, 2.0, 3.0], ["a", "b"],
          [None, None], [[0.0, 0.0], [0.0, 0.0]], [[1, 2], [3]], [True, False], {"x": 1, "y": 2}, [0] * 10_001,
          [[0.1, 0.1]] * 2000)  # fmt: skip


FACTORS = (-1.0, 1e-3, 1e3, 1e-12, 1e12, 1e300, 0.0, 2.0, 1.0 + 1e-12, 57.29577951308232)


def nasty(rng: Random, form: str) -> Any:
    """A value that hardly anybody expects; ``form`` is ``yaml`` or ``json``."""
    what = rng.random()
    if what < 0.4:
        return Raw(rng.choice(NUMBERS))
    if what < 0.7:
        return Raw(rng.choice(YAML_ONLY if form == "yaml" else JSON_ONLY))
    return rng.choice(VALUES)


def places(tree: Any, at: Place = ()) -> list[Place]:
    """Where there is a value in a value, itself first."""
    found = [at]
    inner = tree.items() if isinstance(tree, dict) else enumerate(tree) if isinstance(tree, list) else ()
    for key, value in inner:
        found += places(value, (*at, key))
    return found


def get(tree: Any, at: Place) -> Any:
    for key in at:
        tree = tree[key]
    return tree


def put(tree: Any, at: Place, value: Any) -> Any:
    """The tree with another value somewhere; what is not on the way is shared."""
    if not at:
        return value
    copy = dict(tree) if isinstance(tree, dict) else list(tree)
    copy[at[0]] = put(tree[at[0]], at[1:], value)
    return copy


def mutated(rng: Random, tree: Any, form: str, *, times: int | None = None) -> Any:
    """The tree with one to three changes."""
    for _ in range(times or rng.choice((1, 1, 1, 2, 3))):
        tree = _changed(rng, tree, form)
    return tree


def _changed(rng: Random, tree: Any, form: str) -> Any:  # noqa: PLR0911
    every = places(tree)
    at = rng.choice(every)
    value = get(tree, at)
    match rng.randrange(9):
        case 1 | 2 | 3:
            return put(tree, at, nasty(rng, form))
        case 4:
            return _without(tree, at)
        case 5:
            return put(tree, at, rng.choice(([value], {"x": value}, [value, value], [value] * 30)))
        case 6:
            return put(tree, at, get(tree, rng.choice(every)))
        case 7 if isinstance(value, dict):
            key = rng.choice(("x", "", "format", "file", 3, None, "\x1b[2J", "a" * 300, "<<", True, "__class__"))
            return put(tree, at, {**value, key: nasty(rng, form)})
        case 7 if isinstance(value, list) and value:
            return put(tree, at, value + [rng.choice(value)] * rng.choice((1, 2, 200)))
        case 8 | 0 if isinstance(value, int | float) and not isinstance(value, bool):
            factor = rng.uniform(0.3, 3.0) if rng.random() < 0.5 else rng.choice(FACTORS)
            return put(tree, at, value * factor)
        case _:
            return put(tree, at, nasty(rng, form))


def _without(tree: Any, at: Place) -> Any:
    if not at:
        return None
    *path, last = at
    inside = get(tree, tuple(path))
    if isinstance(inside, dict):
        return put(tree, tuple(path), {key: value for key, value in inside.items() if key != last})
    return put(tree, tuple(path), [value for k, value in enumerate(inside) if k != last])


def json_text(tree: Any) -> str:
    """As JSON, with raw text in it."""
    match tree:
        case Raw():
            return str(tree)
        case dict():
            return "{" + ", ".join(f"{json.dumps(str(key))}: {json_text(value)}" for key, value in tree.items()) + "}"
        case list() | tuple():
            return "[" + ", ".join(map(json_text, tree)) + "]"
        case _:
            return json.dumps(tree)


def yaml_text(tree: Any, indent: int = 0) -> str:
    """As YAML in blocks, with raw text in it."""
    pad = "  " * indent
    if isinstance(tree, dict) and tree:
        return "".join(f"{pad}{_key(key)}:{_below(value, indent)}" for key, value in tree.items())
    if isinstance(tree, list | tuple) and tree and not all(isinstance(one, int | float) for one in tree):
        return "".join(f"{pad}-{_below(value, indent)}" for value in tree)
    return f"{pad}{_flow(tree)}\n"


def _below(value: Any, indent: int) -> str:
    whole = isinstance(value, list | tuple) and all(isinstance(one, int | float) for one in value)
    if isinstance(value, dict | list | tuple) and value and not whole:
        return "\n" + yaml_text(value, indent + 1)
    return f" {_flow(value)}\n"


def _flow(value: Any) -> str:
    if isinstance(value, float) and "e" in repr(value) and "." not in repr(value):
        return repr(value).replace("e", ".0e")  # YAML 1.1 takes 1e-05 for text
    return json_text(value)


def _key(key: Any) -> str:
    plain = (
        isinstance(key, str)
        and key.isidentifier()
        and key not in ("y", "n", "yes", "no", "on", "off", "true", "null")
    )
    return str(key) if plain else json.dumps(key)
