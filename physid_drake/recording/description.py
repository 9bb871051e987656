"""Turns ``recording.yaml`` into frozen values; every refusal names file, line and key."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar, cast

from physid_drake import files
from physid_drake.errors import RecordingError
from physid_drake.recording.limits import check_text
from physid_drake.recording.obj import check_solid, read_obj
from physid_drake.recording.object_model import Box, Cylinder, CylinderAxis, MeshShape, ObjectModel, Prism, Shape
from physid_drake.recording.values import REFLEX_SF_TIP_RADIUS, Conversion, Hand, HandStream, Sensors, Table, TipShape
from physid_drake.recording.yaml_lines import values_and_lines
from physid_drake.wording import named, shown
from physid_drake.yaml_text import MOST_BYTES

FORMAT: Final = "physid-recording/1"
DESCRIPTION_FILE: Final = "recording.yaml"

_SHAPE_KEYS: Final[Mapping[str, tuple[str, ...]]] = {
    "box": ("size_m",),
    "cylinder": ("radius_m", "length_m", "axis"),
    "prism": ("polygon_m", "height_m"),
    "mesh": ("file", "scale"),
}
_TOP_KEYS: Final = ("format", "name", "description", "object", "table", "hand", "sensors", "pushes", "converted")
_LINES_KEYS: Final = ("description", "note", "map")
_SENSOR_KEYS: Final = ("object_position_std", "object_rotation_std", "hand_position_std", "force_std")
_SENSOR_UNITS: Final = ("_m", "_rad", "_m", "_n")

_T = TypeVar("_T")


class _PlacedError(RecordingError):
    """A refusal that already says in which file and line."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """One mapping of the file, which knows where it stands so that it can refuse by name."""

    file: Path
    path: str
    values: Mapping[object, object]
    lines: Mapping[str, int]

    def _place(self, key: str) -> str:
        path = f"{self.path}.{key}".strip(".")
        line = self.lines.get(path, self.lines.get(self.path, 1))
        return f"{named(self.file)}: line {line}: {named(path) or 'the file'}"

    def refuse(self, key: str, message: str) -> RecordingError:
        """The error for one key."""
        return _PlacedError(f"{self._place(key)}: {message}")

    @contextmanager
    def naming(self, key: str = "") -> Iterator[None]:
        """Puts file, line and key before the message of a refusal inside."""
        try:
            yield
        except _PlacedError:
            raise
        except RecordingError as error:
            raise self.refuse(key, str(error)) from error

    def check_keys(self, *allowed: str) -> None:
        """Refuses a key that is not among those allowed here."""
        for key in self.values:
            if key not in allowed:
                raise self.refuse(str(key), f"unknown key; the keys here are {', '.join(allowed)}.")

    def has(self, key: str) -> bool:
        """Whether the key is there and not empty."""
        return self.values.get(key) is not None

    def get(self, key: str, kind: str, accept: Callable[[object], _T | None]) -> _T:
        """The value of a required key.

        Raises:
            RecordingError: if it is missing, or ``accept`` returns None for it.
        """
        if not self.has(key):
            raise self.refuse(key, f"is required, but missing; give {kind}.")
        value = accept(self.values[key])
        if value is None:
            raise self.refuse(key, f"must be {kind}, but got {shown(self.values[key])}; correct it.")
        return value

    def text(self, key: str, default: str | None = None) -> str:
        """A text; ``default`` where it is absent, required where that is None."""
        if default is not None and not self.has(key):
            return default
        text = self.get(key, "text", _as_text)
        with self.naming(key):
            check_text("it", text, lines=key in _LINES_KEYS)
        return text

    def choice(self, key: str, *choices: str) -> str:
        """One of some words."""
        return self.get(key, f"one of {', '.join(choices)}", lambda value: value if value in choices else None)

    def number(self, key: str) -> float:
        """A finite number."""
        return self.get(key, "a finite number", _as_number)

    def maybe_number(self, key: str) -> float | None:
        """A finite number, or None where the key is absent."""
        return self.number(key) if self.has(key) else None

    def numbers(self, key: str, count: int) -> tuple[float, ...]:
        """A list of so many finite numbers."""
        return self.get(key, f"a list of {count} finite numbers", lambda value: _as_numbers(value, count))

    def section(self, key: str, required: bool = True) -> Section | None:
        """The mapping under a key; None where it is absent and need not be there."""
        if not required and not self.has(key):
            return None
        values = self.get(key, "a mapping of keys to values", lambda v: v if isinstance(v, dict) else None)
        return Section(file=self.file, path=f"{self.path}.{key}".strip("."), values=values, lines=self.lines)


def load_description(folder: Path) -> Section:
    """Opens ``recording.yaml`` and checks its format and top-level keys.

    Raises:
        RecordingError: if it is missing, not UTF-8, not YAML, or of another format.
    """
    return load_section(folder / DESCRIPTION_FILE, FORMAT, _TOP_KEYS)


def load_section(file: Path, known: str, keys: Sequence[str]) -> Section:
    """Opens a file of YAML that says its format, and checks that and its top-level keys.

    Args:
        file: of text.
        known: the format that it must say.
        keys: that may stand at its top.

    Raises:
        RecordingError: if it is missing, not UTF-8, not YAML, or of another format.
    """
    return section_of(read_text(file, most=MOST_BYTES), file, known, keys)


def section_of(text: str, file: Path, known: str, keys: Sequence[str]) -> Section:
    """The same of a text; ``file`` is what messages call it.

    Raises:
        RecordingError: if it is not YAML, or of another format.
    """
    values, lines = values_and_lines(text, file)
    if not isinstance(values, dict):
        raise RecordingError(f"{named(file)}: line 1: must be a mapping of keys to values, but got {shown(values)}.")
    top = Section(file=file, path="", values=values, lines=lines)
    if top.values.get("format") != known:
        got = shown(top.values.get("format"))
        raise top.refuse("format", f"unknown format {got}; this reader knows {known!r}.")
    top.check_keys(*keys)
    return top


def read_text(file: Path, *, most: int = files.MOST_BYTES) -> str:
    """The text of a UTF-8 file, without the byte order mark that spreadsheets write.

    Raises:
        RecordingError: if it is missing, is no plain file, has more than ``most`` bytes, or is not UTF-8.
    """
    try:
        return files.read_text(file, most=most)
    except files.NotTextError as error:
        raise RecordingError(f"{named(file)}: line {error.line}: not UTF-8 text; save the file as UTF-8.") from error
    except files.MissingFileError as error:
        raise RecordingError(f"{named(file)}: missing file; a recording needs it.") from error
    except files.FileError as error:
        raise RecordingError(f"{named(file)}: {error}.") from error


def inside(folder: Path, relative: str) -> Path | None:
    """The absolute path of a file within ``folder``, or None if it leads outside."""
    root = folder.resolve()
    try:
        path = (root / relative).resolve()
    except (ValueError, OSError, RuntimeError):
        return None
    return path if path.is_relative_to(root) and path != root else None


def object_from(top: Section, folder: Path) -> ObjectModel:
    """The object that ``recording.yaml`` describes."""
    section = cast(Section, top.section("object"))
    kind = section.choice("shape", *_SHAPE_KEYS)
    section.check_keys("shape", "mass_kg", "mass_std_kg", *_SHAPE_KEYS[kind])
    with section.naming():
        shape = _shape_from(section, kind, folder)
    mass, mass_std = section.maybe_number("mass_kg"), section.maybe_number("mass_std_kg")
    with section.naming():
        return ObjectModel(shape=shape, mass=mass, mass_std=mass_std)


def table_from(top: Section) -> Table:
    """The table that ``recording.yaml`` describes."""
    section = cast(Section, top.section("table"))
    section.check_keys("size_m", "centre_m")
    size, centre = section.numbers("size_m", 2), section.numbers("centre_m", 2)
    with section.naming():
        return Table(size=(size[0], size[1]), centre=(centre[0], centre[1]))


def hand_from(top: Section) -> Hand | None:
    """The hand that ``recording.yaml`` describes, or None where it has none."""
    section = top.section("hand", required=False)
    if section is None:
        return None
    section.check_keys("tip", "radius_m", "length_m", "stream")
    tip = section.choice("tip", "cylinder", "sphere", "capsule", "reflex_sf")
    stream = section.choice("stream", "measured", "commanded")
    bare = tip == "reflex_sf" and not section.has("radius_m")
    radius = REFLEX_SF_TIP_RADIUS if bare else section.number("radius_m")
    # A sphere's or a fingertip's length says nothing; a capsule's and a cylinder's must be there.
    length = section.maybe_number("length_m") if tip in ("cylinder", "capsule") else None
    with section.naming():
        return Hand(tip=cast(TipShape, tip), radius=radius, length=length, stream=cast(HandStream, stream))


def sensors_from(top: Section) -> Sensors:
    """The sensors' standard deviations that ``recording.yaml`` gives."""
    section = top.section("sensors", required=False)
    if section is None:
        return Sensors()
    keys = [name + unit for name, unit in zip(_SENSOR_KEYS, _SENSOR_UNITS, strict=True)]
    section.check_keys(*keys)
    values = [section.maybe_number(key) for key in keys]
    with section.naming():
        return Sensors(**dict(zip(_SENSOR_KEYS, values, strict=True)))


def conversion_from(top: Section) -> Conversion | None:
    """What ``recording.yaml`` says it was converted from; None where nothing did."""
    section = top.section("converted", required=False)
    if section is None:
        return None
    section.check_keys("source", "source_sha256", "map", "map_sha256")
    with section.naming():
        return Conversion(
            source=section.text("source"),
            source_sha256=section.text("source_sha256"),
            map=section.text("map"),
            map_sha256=section.text("map_sha256"),
        )


def push_entries(top: Section, folder: Path) -> list[tuple[str, Path, str]]:
    """Name, file and note of every push, in order."""
    entries = top.get("pushes", "a list of pushes", lambda value: value if isinstance(value, list) else None)
    if not entries:
        raise top.refuse("pushes", "must not be empty; add at least one push.")
    found: list[tuple[str, Path, str]] = []
    taken: set[Path] = set()
    for k, entry in enumerate(entries):
        key = f"pushes[{k}]"
        if not isinstance(entry, dict):
            raise top.refuse(key, f"must be a mapping with the key file, but got {shown(entry)}.")
        section = Section(file=top.file, path=key, values=entry, lines=top.lines)
        section.check_keys("file", "note")
        name = section.text("file")
        path = inside(folder, name)
        if path is None:
            raise section.refuse("file", f"must lie inside the recording's folder, but got {shown(name)}; move it.")
        if not files.is_there(path):
            raise section.refuse("file", f"missing file {shown(name)}; add it or remove this push.")
        if path in taken:
            raise section.refuse("file", f"{shown(name)} is listed twice; remove one.")
        taken.add(path)
        found.append((_plain_name(name, path, folder), path, section.text("note", "")))
    return found


def _plain_name(name: str, path: Path, folder: Path) -> str:
    """A push's name as it is when the recording is written: within the folder, without ``./`` and ``//``."""
    return os.path.relpath(path, folder.resolve()) if os.path.isabs(name) else os.path.normpath(name)  # noqa: PTH117


def _shape_from(section: Section, kind: str, folder: Path) -> Shape:
    if kind == "box":
        size = section.numbers("size_m", 3)
        return Box(size=(size[0], size[1], size[2]))
    if kind == "cylinder":
        axis = cast(CylinderAxis, section.choice("axis", "z", "y"))
        return Cylinder(radius=section.number("radius_m"), length=section.number("length_m"), axis=axis)
    if kind == "prism":
        polygon = section.get("polygon_m", "a list of at least three [x, y] pairs", _as_polygon)
        return Prism(polygon=polygon, height=section.number("height_m"))
    name = section.text("file")
    path = inside(folder, name)
    if path is None or not files.is_there(path):
        problem = "must lie inside the recording's folder" if path is None else "is missing"
        raise RecordingError(f"the mesh {shown(name)} {problem}; put it into the folder.")
    shape = MeshShape(file=path, scale=section.number("scale") if section.has("scale") else 1.0)
    check_solid(read_obj(path), shape.scale, path)
    return shape


def _as_text(value: object) -> str | None:
    return value if isinstance(value, str) else None


def _as_number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def _as_numbers(value: object, count: int) -> tuple[float, ...] | None:
    if not isinstance(value, list) or len(value) != count:
        return None
    numbers = [_as_number(item) for item in value]
    return tuple(n for n in numbers if n is not None) if None not in numbers else None


def _as_polygon(value: object) -> tuple[tuple[float, float], ...] | None:
    if not isinstance(value, list):
        return None
    pairs = [_as_numbers(item, 2) for item in value]
    return tuple((p[0], p[1]) for p in pairs if p is not None) if len(pairs) > 2 and None not in pairs else None
