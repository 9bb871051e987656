"""Looks at a log and writes a first map of it, with what it doubts as comments.

Names tell most: what ends in x, y, z is a place, what ends in qw or holds four columns of norm 1 is a rotation,
what is called force or wrench is one. Numbers tell the rest: which axis is up, m or mm, the order of a quaternion,
and what moves by itself.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from physid_drake.convert.bag_reading import ENDINGS, is_packed
from physid_drake.convert.bodies import Body
from physid_drake.convert.columns import Array
from physid_drake.convert.guess_bag import guess_bag
from physid_drake.convert.log_parts import Log, Table, log_of
from physid_drake.convert.map_text import Guess, force_lines, head_lines, pose_lines, quoted, set_units
from physid_drake.convert.roles import Roles, roles_of
from physid_drake.convert.times import FRAMES, fits, own_times, step_of
from physid_drake.progress import Progress
from physid_drake.wording import named

PUSH_WORDS: Final = ("push", "episode", "trial", "run", "rep", "versuch", "segment")

MOST_UNREAD: Final = 8
"""Of what a log holds and is no column: so many are named in a map."""


@np.errstate(over="ignore", invalid="ignore")  # numbers out of all proportion are looked at as well
def guess_map(source: Path, progress: Progress | None = None) -> Guess:
    """Looks at a table, a bag, or a folder of tables.

    Args:
        source: a file or a folder.
        progress: of a large bag, called with the file that is read, messages read and messages in all.

    Raises:
        RecordingError: if it cannot be read.
    """
    source = Path(source)
    return guess_bag(source, progress) if is_bag(source) else _guess_log(source, log_of(source))


def is_bag(source: Path) -> bool:
    """Whether a file or a folder looks like a bag, packed or not, by its endings."""
    files = list(source.iterdir()) if source.is_dir() else [source]
    return any(file.suffix in ENDINGS or is_packed(file) for file in files)


def _guess_log(source: Path, log: Log) -> Guess:
    tables = {id(body): table for table in log.tables for body in table.bodies}
    bodies = [body for table in log.tables for body in table.bodies]
    roles = roles_of(bodies, lambda body: tables[id(body)].columns, lambda body: _seconds(body, tables[id(body)]))
    _give_rotation(roles, bodies, tables)
    _share_order(bodies)
    main = log.tables[0] if roles.object is None else tables[id(roles.object)]
    posed = [one for one in (roles.object, roles.hand) if one is not None]
    doubts = {
        id(table): set_units([one for one in posed if tables[id(one)] is table], table.columns)
        for table in log.tables
    }
    lines = [*head_lines(source, roles.object, main.columns, roles.hand is not None), _time_line(main)]
    for key, body in (("object", roles.object), ("hand", roles.hand)):
        if body is not None or key == "object":
            table = main if body is None else tables[id(body)]
            others = [name for one in table.bodies if one is not body for name in one.position]
            lines += pose_lines(key, body, table.columns, doubts[id(table)], _own_lines(body, others, table, main))
    if roles.force is not None:
        table = tables[id(roles.force)]
        timed = table.times is not None and table is not main and table.times != main.times
        own = [*table.keys, *([f"time: {table.times.text()}"] if timed and table.times else [])]
        lines += force_lines(roles.force, table.columns, own)
    lines.append(_cut_line(log, main))
    lines += _not_used(log, "\n".join(lines), [tables[id(one)] for one in _there(roles)])
    return Guess(text="\n".join(lines) + "\n", rows=tuple(row for table in log.tables for row in _rows(table)))


def _there(roles: Roles) -> list[Body]:
    return [body for body in (roles.object, roles.hand, roles.force) if body is not None]


def _seconds(body: Body, table: Table) -> Array | None:
    """The times of a body's places in s, as far as they are known."""
    return (
        table.times.seconds(table.columns)
        if table.times and fits(body.position, table.columns, table.times)
        else None
    )


def _give_rotation(roles: Roles, bodies: Sequence[Body], tables: dict[int, Table]) -> None:
    """A rotation that has no name is the object's, if it lies in the same table."""
    body = roles.object
    nameless = next((one for one in bodies if not one.position and one.rotation), None)
    if body is None or nameless is None or body.rotation or tables[id(body)] is not tables[id(nameless)]:
        return
    body.rotation, body.kind, body.order = nameless.rotation, nameless.kind, nameless.order
    body.sure, body.named = nameless.sure, nameless.named


def _share_order(bodies: Sequence[Body]) -> None:
    """Of quaternions whose order cannot be told it is that of the others: one program wrote them all."""
    sure = [one.kind for one in bodies if len(one.rotation) == 4 and one.sure]
    for body in bodies:
        if len(body.rotation) == 4 and not body.sure and len(set(sure)) == 1:
            body.kind = sure[0]


def _time_line(table: Table) -> str:
    if table.times is None:
        return "time: {rate_hz: 100}   # CHANGE: no column looks like times; at which rate are the rows?"
    if table.times.unit == FRAMES:
        return f"time: {table.times.text()}   # CHANGE: it counts frames; at which rate?"
    return f"time: {table.times.text()}"


def _own_lines(body: Body | None, others: Sequence[str], table: Table, main: Table) -> list[str]:
    """What a stream says of where its columns are, and of a clock of its own."""
    if body is None:
        return []
    own = own_times(body.position, others, table.columns, table.times)
    lines = list(table.keys)
    if own is not None:
        lines.append(f"time: {own.text(', offset_s: 0.0')}   # is it the same clock?")
    elif not fits(body.position, table.columns, table.times):
        lines.append('time: {column: "?", unit: s}   # CHANGE: it has times of its own')
    elif table.times is not None and _is_elsewhere(table, main):
        lines.append(f"time: {table.times.text(', offset_s: 0.0')}   # CHANGE: at no time of the object's clock")
    elif table is not main and table.times != main.times:
        lines.append(_time_line(table))
    return lines


def _is_elsewhere(table: Table, main: Table) -> bool:
    """Whether two tables have no time in common, by the clocks that they were written by."""
    clocks = [None if one.times is None else one.times.seconds(one.columns) for one in (table, main)]
    spans = [(np.nanmin(clock), np.nanmax(clock)) for clock in clocks if clock is not None]
    return len(spans) > 1 and bool(max(span[0] for span in spans) > min(span[1] for span in spans))


def _cut_line(log: Log, main: Table) -> str:
    if log.whole:
        return "pushes: {cut: whole}   # one file is one push"
    numbers = main.columns.numbers
    clock = None
    if main.times is not None:
        seconds = main.times.seconds(main.columns)
        clock = numbers[main.times.columns[0]] if seconds is None else seconds
    usual = len(clock) if clock is not None else max(map(len, numbers.values()))
    for name, values in numbers.items():
        called = any(word in name.lower() for word in PUSH_WORDS) and len(values) == usual
        if called and np.isfinite(values).all() and (values == np.round(values)).all() and len(set(values)) > 1:
            return f"pushes: {{cut: column, column: {quoted(name)}}}"
    if clock is not None and len(log.tables) == 1:
        steps = np.diff(clock)
        if (steps > 50.0 * np.median(steps)).any():
            return "pushes: {cut: gap, gap_s: 0.5}"
    return "pushes: {cut: rest}   # between two rests of the object"


def _not_used(log: Log, text: str, used: Sequence[Table]) -> Iterator[str]:
    """What is left, so that nobody takes it for used."""
    for table in log.tables:
        names = [*table.columns.numbers, *table.columns.texts]
        is_used = any(table is one for one in used)
        left = names if not is_used else [name for name in names if quoted(name) not in text]
        of = f" of {table.label}" if table.label else ""
        reads = f" ('{table.keys[0]}' in a stream reads them)" if table.keys and not is_used else ""
        if left:
            yield f"# not used{of}: {', '.join(left)}{reads}"
        unread = list(table.columns.unread.items())
        yield from (f"# not read: {named(name)} ({why})" for name, why in unread[:MOST_UNREAD])


def _rows(table: Table) -> Iterator[tuple[str, ...]]:
    columns = table.columns
    clock = None if table.times is None else table.times.seconds(columns)
    before = f"{table.label}: " if table.label else ""
    for name, values in columns.numbers.items():
        yield (before + name, *_seen(values, clock))
    yield from ((before + name, str(len(texts)), "", "text", "") for name, texts in columns.texts.items())
    yield from ((before + name, "", "", "not read", "") for name in columns.unread)


def _seen(values: Array, times: Array | None) -> tuple[str, ...]:
    """Count, rate [Hz], least and largest of the samples of a column."""
    seen = values[np.isfinite(values)]
    if not len(seen):
        return "0", "", "empty", ""
    step = np.nan
    if times is not None and len(times) == len(values) and len(seen) > 2:
        step = step_of(times[np.isfinite(values)])
    return str(len(seen)), f"{1.0 / step:.4g}" if np.isfinite(step) else "", f"{seen.min():.6g}", f"{seen.max():.6g}"
