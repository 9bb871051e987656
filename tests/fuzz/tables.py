"""Tables of pushes: a valid one with columns, cells, clocks and poses changed as loggers and people change them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from random import Random

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.reading import inspect

Rows = list[list[str]]
"""The header and the rows, as text."""
CELLS = ("nan", "NaN", "inf", "-inf", "1e308", "-1e308", "1e-320", "010", "1_000", "1e", "0x1F", "", " ", "'1",
         '"1"', "1,5",
         "\u0661", "\uff11", "1e400", "--1", "+1", "1.", ".5", "1e5", "9" * 400, "true", "None", "#N/A", "1;2",
         "\t3\t",
         "1\x00", "=1+1", "1e-5000", "0", "-0", '"', '"a\nb"', "\x1b[2J", "1" * 70_000, "NULL", "1d3",
         "\u22121")  # fmt: skip


def make(rng: Random, folder: Path) -> Case:
    """A recording whose first table is changed."""
    files = dict(seeds.recording())
    name = sorted(name for name in files if name.endswith(".csv"))[rng.randrange(2)]
    rows = [line.split(",") for line in files[name].decode().splitlines()]
    for _ in range(rng.choice((1, 1, 1, 2))):
        rows = rng.choice(CHANGES)(rng, rows)
    content = "\n".join(",".join(row) for row in rows).encode("utf-8", "surrogatepass") + b"\n"
    files[name] = damaged(rng, content) if rng.random() < 0.15 else content
    seeds.lay(folder / "r", files)
    if rng.random() < 0.02:
        replaced(rng, folder / "r" / name, secret=folder.parent / "secret.csv")
    more = {"picture": rng.random() < 0.01, "prepared": rng.random() < 0.4 and len(rows) < 150}
    return Case(partial(inspect, folder / "r", folder / "written", **more))


def _column(rng: Random, rows: Rows, what: str = "") -> int:
    found = [k for k, name in enumerate(rows[0]) if name.strip().startswith(what)] if rows else []
    return rng.choice(found) if found else 0


def _each(rows: Rows, columns: list[int], change: Callable[[float, int], float]) -> Rows:
    """All cells of some columns that are numbers, changed by value and row."""
    changed = [list(row) for row in rows]
    for k, row in enumerate(changed[1:]):
        for column in columns:
            try:
                row[column] = repr(change(float(row[column]), k))
            except (ValueError, IndexError, OverflowError):
                continue
    return changed


def _named(rows: Rows, *starts: str) -> list[int]:
    return [k for k, name in enumerate(rows[0]) if name.startswith(starts)] if rows else []


def cells(rng: Random, rows: Rows) -> Rows:
    changed = [list(row) for row in rows]
    for _ in range(rng.choice((1, 1, 3, 20))):
        row = changed[rng.randrange(len(changed))]
        row[rng.randrange(len(row))] = rng.choice(CELLS)
    return changed


def header(rng: Random, rows: Rows) -> Rows:
    first = list(rows[0])
    at = rng.randrange(len(first))
    match rng.randrange(8):
        case 0:
            first[at] = rng.choice(
                ("", "x", "time", "time_s", "TIME_S", "hand_x_mm", "\ufefftime_s", "a" * 70_000, "\x1b[2J")
            )
        case 1:
            first[at] = f'"{first[at]}"'
        case 2:
            first[at] = f" {first[at]}\t"
        case 3:
            first.pop(at)
        case 4:
            first.append(rng.choice(first))
        case 5:
            rng.shuffle(first)
        case 6:
            first = [rng.choice((";", "\t", " ", "|")).join(first)]
        case _:
            return rows[1:] or rows
    return [first, *rows[1:]]


def whole_column(rng: Random, rows: Rows) -> Rows:
    at, kind = _column(rng, rows), rng.randrange(5)
    changed = [list(row) for row in rows]
    for row in changed if kind == 0 else changed[1:]:
        if at >= len(row):
            continue
        if kind == 0:
            row.pop(at)
        else:
            row[at] = ("", "0", "1", rows[1][at] if len(rows) > 1 and at < len(rows[1]) else "")[kind - 1]
    return changed


def clock(rng: Random, rows: Rows) -> Rows:
    columns, rate = _named(rows, "time"), rng.choice((1e3, 1e6, 1e9, 1e-3, 1e-9, -1.0, 0.0, 60.0, 1e300, 1e-300))
    since = rng.choice((0.0, 0.0, 1.7e9, 1.7e12, 1.7e18, -5.0, 1e16, 1e300, 0.1))
    return _each(rows, columns, lambda value, k: value * rate + since)


def bursts(rng: Random, rows: Rows) -> Rows:
    size = rng.choice((2, 3, 10))
    gap = rng.choice((1e-7, 1e-12, 5e-324, 1e-4))
    return _each(rows, _named(rows, "time"), lambda value, k: 0.02 * (k // size) + gap * (k % size))


def gap(rng: Random, rows: Rows) -> Rows:
    at, long = rng.randrange(len(rows)), rng.choice((0.3, 1.5, 100.0, 1e9, 1e18, 1e300, -0.5))
    return _each(rows, _named(rows, "time"), lambda value, k: value + long * (k >= at))


def order(rng: Random, rows: Rows) -> Rows:
    first, body = rows[:1], rows[1:]
    match rng.randrange(5):
        case 0:
            body = body[::-1]
        case 1:
            rng.shuffle(body)
        case 2:
            body = body[: rng.choice((0, 1, 2, 3, 5))]
        case 3 if body:
            at = rng.randrange(len(body))
            body = body[:at] + [body[at]] * rng.choice((1, 3)) + body[at:]
        case _:
            body = body[:: rng.choice((2, 5, 20))]
    return first + body


def longer(rng: Random, rows: Rows) -> Rows:
    """The same motion over and over, later and later."""
    times = rng.choice((3, 10, 40))
    columns = _named(rows, "time")
    parts = [_each(rows, columns, lambda value, k, n=n: value + 2.0 * n)[1:] for n in range(times)]
    return rows[:1] + [row for part in parts for row in part]


def scaled(rng: Random, rows: Rows) -> Rows:
    what = rng.choice(("object_x", "object_", "hand_", "hand_z", "object_z", "force_", "force_x"))
    columns = [k for k in _named(rows, what) if "_q" not in rows[0][k]]
    factor = rng.choice((1e3, 1e-3, 1e300, -1.0, 0.0, 1e-300, 100.0, 1e12))
    return _each(rows, columns, lambda value, k: value * factor)


def shifted(rng: Random, rows: Rows) -> Rows:
    columns = _named(rows, rng.choice(("object_x", "object_z", "hand_z", "hand_x")))
    at, by = rng.randrange(len(rows)), rng.choice((0.05, 0.5, 10.0, -0.02, 1e6, 1e-9))
    until = rng.choice((at + 1, at + 3, len(rows)))
    return _each(rows, columns, lambda value, k: value + by * (at <= k < until))


def turned(rng: Random, rows: Rows) -> Rows:
    columns = _named(rows, rng.choice(("object_q", "hand_q")))
    columns = columns[:4]
    if len(columns) < 4:
        return rows
    kind = rng.randrange(5)
    if kind == 0:
        other = columns[1:] + columns[:1] if rng.random() < 0.5 else rng.sample(columns, 4)
        return rows[:1] + [
            [row[dict(zip(columns, other, strict=True)).get(k, k)] if k < len(row) else "" for k in range(len(row))]
            for row in rows[1:]
        ]
    factor = rng.choice((0.0, 2.0, 0.99, 1.0005, 1e300, 1e-300, -1.0))
    odd = rng.choice((1, 2, 3, 1000))
    return _each(rows, columns, lambda value, k: value * factor if k % odd == 0 else value)


def spin(rng: Random, rows: Rows) -> Rows:
    """Poses with noise, so that nothing is smooth."""
    columns = _named(rows, rng.choice(("object_x", "hand_x", "object_y", "force_")))
    loud = rng.choice((1e-6, 1e-3, 0.05, 3.0))
    return _each(rows, columns, lambda value, k: value + rng.gauss(0.0, loud))


def holes(rng: Random, rows: Rows) -> Rows:
    """Samples that are missing, of one stream or of single cells."""
    columns = _named(rows, rng.choice(("object_", "hand_", "force_", "object_qz")))
    share = rng.choice((0.05, 0.5, 0.95, 1.0))
    changed = [list(row) for row in rows]
    for row in changed[1:]:
        if rng.random() < share:
            for column in columns:
                if column < len(row):
                    row[column] = ""
    return changed


def lost(rng: Random, rows: Rows) -> Rows:
    """What a tracker writes that has lost its object."""
    columns = _named(rows, "object_")
    share, written = rng.choice((0.02, 0.3, 1.0)), rng.choice(("0", "0.0", "-1", "nan", "999"))
    changed = [list(row) for row in rows]
    for row in changed[1:]:
        if rng.random() < share:
            for column in columns:
                if column < len(row):
                    row[column] = written
    return changed


CHANGES = (cells, cells, header, whole_column, clock, bursts, gap, order, longer, scaled, scaled, shifted,
           turned, turned,
           spin, holes, lost)  # fmt: skip
