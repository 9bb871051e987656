"""What the names of columns say: whose they are, what is measured, and along which axis.

A name ends in an axis (``x``, ``qw``, ``Rot[4]``, ``pose_3``, ``T[0,3]``) or begins with one (``X_ACT``), and may
have a unit at its end. Beside the axis stands a word for what is measured, and what is left is the body's name.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace
from typing import Final

from physid_drake.convert.columns import Columns
from physid_drake.convert.units import ANGLES, FORCES, LENGTHS, WORDS, symbol_of

WANTED: Final = frozenset(
    ("desired", "des", "cmd", "command", "commanded", "setpoint", "goal", "ref", "reference", "planned", "next")
)
"""Words for what was to be, and was not measured."""
WANTED_BESIDE: Final = frozenset(("target", "d", "c"))
"""Words for it if the same is there without them: ``target`` may be what is pushed."""
MEASURED: Final = frozenset(("actual", "act", "measured", "meas", "real", "current"))

NO_PLACES: Final = frozenset(
    (
        "joint", "joints", "qpos", "qvel", "dq", "qd", "ddq", "qdd", "tau", "torque", "torques", "moment", "moments",
        "effort", "efforts", "currents", "voltage", "vel", "velocity", "velocities", "speed", "speeds", "twist", "v",
        "omega", "acc", "accel", "acceleration", "accelerations", "jerk", "gyro", "mag", "imu", "err", "error",
        "errors", "std", "cov", "covariance", "var", "variance", "residual", "quality", "confidence", "temperature",
        "pwm", "reward",
    )
)  # fmt: skip
"""Words for what is neither a place, nor a rotation, nor a force."""

_AXIS: Final = re.compile(
    r"^(?P<stem>.*?)[\s_./\-:]*"
    r"(?P<axis>q[wxyz]|(?<![a-z])q[0-4]|[rtf][xyz]|(?<![a-z])rw|(?<![a-z])[vw][xyz]|[xyzw](?=\d*$)|roll|pitch|yaw|phi|theta|heading"
    r"|(?<![a-z0-9])[abc]|\[\d+\]|\[\d+,\d+\]|(?<=_)\d+)"
    r"(?P<digit>\d*)$",
    re.IGNORECASE,
)
_LEADING: Final = re.compile(
    r"^(?P<axis>q[wxyz]|r[xyz]|[xyz]|roll|pitch|yaw|theta|[abc])[\s_.\-]+(?P<stem>[a-z].*)$", re.IGNORECASE
)
_UNIT: Final = re.compile(
    r"^(?P<name>.*?)[\s_]*(?:[\[(](?P<bracketed>{0})[\])]|(?<=[\s_])(?P<bare>{0}))$".format(
        "|".join(
            [f"(?i:{word})" for word in sorted(WORDS, key=len, reverse=True)]
            + sorted([*LENGTHS, *ANGLES, *FORCES], key=len, reverse=True)
        )
    )
)
_OVER: Final = re.compile(r"[\s_./:\-]x(\W.*)?$", re.IGNORECASE)
"""Of the first of a body's columns, over which its name stands."""
_SPEEDS: Final = frozenset(("vx", "vy", "vz", "wx", "wy", "wz"))
_AGAIN: Final = re.compile(r" \(column \d+\)$")
"""What the reader adds to a name that was there before."""

_BEGINS: Final = r"(?:\b|(?-i:(?<=[a-z0-9])(?=[A-Z])))"
"""Where a word begins, as in ``GlobalRotation``."""

_QUANTITIES: Final[Sequence[tuple[str, str]]] = (
    ("force", r"force|wrench|ft"),
    ("vector", r"rvec|rotvec|rodrigues|rotation vector|axis angle"),
    ("turn", r"rotation|rot|orientation|quat\w*|euler\w*|rpy"),
    ("place", r"position|x?pos|translation|place|xyz|tvec|p"),
    ("pose", r"pose|transform|state"),
    ("q", r"q"),
)
"""What a name's last or first word but the axis says is measured; q are joints' angles, or a quaternion."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """What a column's name says.

    Attributes:
        owner: the body's name; empty if none is there.
        quantity: ``force``, ``vector``, ``turn``, ``place``, ``pose``, ``q`` or nothing.
        axis: in small letters, without brackets.
    """

    owner: str
    quantity: str
    axis: str


def parts_of(columns: Columns) -> dict[str, Part]:
    """What the names say of the columns that have an axis, but for what is no place, no rotation and no force."""
    found: dict[str, Part] = {}
    bare = {name: unit_of(name, columns)[0] for name in columns.numbers}
    for name in columns.numbers:
        part = _fourth(bare[name], set(bare.values())) or _part(bare[name])
        if part is not None and not NO_PLACES & set(words_of(part.owner)) and part.axis not in _SPEEDS:
            found[name] = part
    return _with_owners(found)


def axis_of(name: str, columns: Columns) -> str | None:
    """The axis that a column's name says it is along; None if it says none."""
    part = _part(unit_of(name, columns)[0])
    return None if part is None else part.axis


def unit_of(name: str, columns: Columns) -> tuple[str, str | None]:
    """A column's name without its unit, and the unit, of a line of its own or of the name."""
    bare = _AGAIN.sub("", name)
    match = _UNIT.match(bare)
    stated = columns.units.get(name)
    unit = stated or (match and (match["bracketed"] or match["bare"]))
    return match["name"] if match else bare, symbol_of(unit) if unit else None


def words_of(name: str) -> list[str]:
    """The words of a name, in small letters."""
    return [word for word in re.split(r"[^a-z0-9]+", name.lower()) if word]


def is_wanted(name: str, others: Sequence[str]) -> bool:
    """Whether a body's name says that it is where something was to be; ``others`` are the names beside it."""
    words = set(words_of(name))
    if words & WANTED:
        return True
    bare = words - WANTED_BESIDE - MEASURED
    return bool(words & WANTED_BESIDE) and any(
        set(words_of(other)) - MEASURED == bare for other in others if other != name
    )


def _fourth(bare: str, names: Set[str]) -> Part | None:
    """What a name says that ends in ``d`` beside others in ``a``, ``b`` and ``c``: alone, it is what was desired."""
    siblings = [bare[:-1] + (letter if bare[-1:] == "d" else letter.upper()) for letter in "abc"]
    if bare[-1:] not in ("d", "D") or not set(siblings) <= names:
        return None
    first = _part(siblings[0])
    return None if first is None or first.axis != "a" else replace(first, axis="d")


def _part(bare: str) -> Part | None:
    match = _AXIS.match(bare)
    if match is not None:
        return _of_stem(match["stem"] + match["digit"], match["axis"].lower().strip("[]"))
    leading = _LEADING.match(bare)
    return None if leading is None else _of_stem(leading["stem"], leading["axis"].lower())


def _of_stem(stem: str, axis: str) -> Part:
    spaced = stem.replace("_", " ")
    for kind, words in _QUANTITIES:
        last = re.match(rf"^(?P<owner>.*?)[\s_./\-:]*{_BEGINS}(?:{words})$", spaced, re.IGNORECASE)
        if last:
            return Part(owner=stem[: len(last["owner"])], quantity=kind, axis=axis)
    for kind, words in _QUANTITIES:
        first = re.match(rf"^(?:{words})[\s./\-:]+(?P<owner>\S.*)$", spaced, re.IGNORECASE)
        if first:
            return Part(owner=stem[len(stem) - len(first["owner"]) :], quantity=kind, axis=axis)
    return Part(owner=stem, quantity="", axis=axis)


def _with_owners(found: dict[str, Part]) -> dict[str, Part]:
    """Owners of columns without one: that of the ``x`` before them, or the how-manieth of their name they are.

    Qualisys writes a body's name over its first column only; NDI writes the same names for each tool.
    """
    owned, lead, seen = {}, "", set[Part]()
    columns = Counter(part.owner for part in found.values())
    for name, part in found.items():
        if part.owner:
            lead = part.owner if columns[part.owner] == 1 and _OVER.search(name) else ""
        elif lead:
            part = replace(part, owner=lead)  # noqa: PLW2901
        count, bare = 1, part
        while part in seen:
            count += 1
            part = replace(bare, owner=f"{bare.owner} {count}".strip())  # noqa: PLW2901
        seen.add(part)
        owned[name] = part
    return owned
