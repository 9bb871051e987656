"""Which file, which table and which rows are a stream's, by which clock; what of it is refused in one line."""

from __future__ import annotations

from pathlib import Path

import foreign
import numpy as np
import pytest

from physid_drake.convert import convert_table
from physid_drake.errors import RecordingError
from physid_drake.recording import Recording, read_recording

SEALED = Path(__file__).parents[2] / "recordings" / "sealed_01"
HEAD = foreign.DESCRIPTION.format(name="mug") + foreign.HAND


@pytest.fixture(scope="module")
def sealed() -> Recording:
    return read_recording(SEALED)


def changed(writer: str, recording: Recording, folder: Path, *changes: tuple[str, str]) -> Recording:
    """A foreign log, converted by its map with some of its text replaced."""
    text = foreign.TABLES[writer].write(recording, folder / writer)
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "map.yaml").write_text(text, encoding="utf-8")
    return convert_table(folder / writer, folder / "recording", folder / "map.yaml")


@pytest.mark.parametrize(
    ("writer", "changes", "said"),
    [
        ("trials", [("*_mug.csv", "*_cup.csv")], r"object: no file of the source is called '\*_cup.csv'; it holds "),
        ("trials", [("*_mug.csv", "00_mug.csv")], "equally many files, .* but object has 1 and hand has 11"),
        ("trials", [('file: "*_robot.csv", ', "")], "but object has 11 and hand has 23"),
        ("detections.csv", [("{marker_id: 3}", "{marker_id: 4}")], "no row has marker_id 4; there are 3"),
        ("detections.csv", [("where: {marker_id: 3}", "where: {marker: 3}")], "has no column 'marker'; did you mean"),
        ("detections.csv", [("where: {marker_id: 3}", "where: {}")], "object.where: must be columns, each with"),
        ("detections.csv", [("  where: {marker_id: 3}\n", "")],
         r"several bodies, which column 'marker_id' tells apart \(3, 7\); .* where: \{marker_id: 3\}"),
        ("detections.csv", [("time: {column: t_ns, unit: ns}", "time: {rate_hz: 100}")], "rows that are picked"),
        ("frames", [("time: {rate_hz: 200}\n", "")], "there are no times; name their column in time.column, or give"),
        ("frames", [("section: 2", "section: 3")], "has 2 table.s., but section 3 is asked for"),
        ("control.csv", [("[sec, nanosec]}", "[sec, nanosec], unit: s}")], "columns: are of seconds and nanosec"),
        ("control.csv", [("[tip_x, tip_y, tip_z]", "[mug_x, mug_y, mug_z]")], "hand: its columns are those of"),
        ("take.csv", [("(Seconds)}", "(Seconds), unit: ms}")], "the map says ms, but times in column .* are in s"),
        ("detections.csv", [("unit: ns", "unit: us")], "rest twice for 0.5 s in .* poses 10 s apart; correct the"),
    ],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_refused_in_one_line(
    writer: str, changes: list[tuple[str, str]], said: str, sealed: Recording, tmp_path: Path
) -> None:
    with pytest.raises(RecordingError, match=said) as refusal:
        changed(writer, sealed, tmp_path, *changes)
    assert "\n" not in str(refusal.value) and not (tmp_path / "recording").exists()


def test_a_file_that_is_no_streams_is_said(sealed: Recording, tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"no stream is in notes.csv: left out\."):
        changed("trials", sealed, tmp_path)


def test_files_of_other_trials_are_said_to_be_taken_together(sealed: Recording, tmp_path: Path) -> None:
    text = foreign.TABLES["trials"].write(sealed, tmp_path / "trials")
    (tmp_path / "map.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "trials" / "03_mug.csv").unlink()
    (tmp_path / "trials" / "05_robot.csv").unlink()
    with pytest.warns(UserWarning, match=r"such as 04_mug.csv and 03_robot.csv; do they belong together\?"):
        convert_table(tmp_path / "trials", tmp_path / "recording", tmp_path / "map.yaml")


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_rows_are_picked_by_a_text_too(sealed: Recording, tmp_path: Path) -> None:
    found = changed("detections.csv", sealed, tmp_path)
    text = (tmp_path / "detections.csv").read_text().replace(",3,", ",mug,").replace(",7,", ",tip,")
    (tmp_path / "detections.csv").write_text(text)
    chart = (tmp_path / "map.yaml").read_text()
    (tmp_path / "texts.yaml").write_text(chart.replace("marker_id: 3", "marker_id: mug").replace(": 7", ": tip"))
    again = convert_table(tmp_path / "detections.csv", tmp_path / "again", tmp_path / "texts.yaml")
    assert [push.object for push in again.pushes] == [push.object for push in found.pushes]


def test_files_apart_are_cut_by_the_same_column(sealed: Recording, tmp_path: Path) -> None:
    """Of a push in each file, the rows in which the column has the same value."""
    folder = tmp_path / "log"
    folder.mkdir()
    for name, which in (("mug.csv", "object"), ("tip.csv", "hand")):
        rows = ["trial,t,x,y,z,yaw"]
        for k, push in enumerate(sealed.pushes[:3]):
            stream = getattr(push, which)
            values = np.column_stack([stream.times, stream.positions, stream.planar[:, 2]])
            rows += [f"{k}," + ",".join(f"{v:.7g}" for v in row) for row in values]
        (folder / name).write_text("\n".join(rows), encoding="utf-8")
    chart = HEAD + "time: {column: t}\npushes: {cut: column, column: trial}\n" + (
        "object: {file: mug.csv, position: {columns: [x, y, z]}, rotation: {columns: yaw, as: yaw, unit: rad}}\n"
        "hand: {file: tip.csv, position: {columns: [x, y, z]}, rotation: none}\n"
    )  # fmt: skip
    (tmp_path / "map.yaml").write_text(chart, encoding="utf-8")
    found = convert_table(folder, tmp_path / "recording", tmp_path / "map.yaml")
    for push, other in zip(sealed.pushes[:3], found.pushes, strict=True):
        assert other.hand is not None and push.hand is not None and len(other.hand) == len(push.hand)
        assert np.abs(other.object.planar - push.object.planar).max() < 2e-6
    (folder / "tip.csv").write_text((folder / "tip.csv").read_text().replace("\n2,", "\n5,"))
    with pytest.raises(RecordingError, match="pushes: 'trial' has other values for hand than for object"):
        convert_table(folder, tmp_path / "other", tmp_path / "map.yaml")


def test_times_of_too_few_digits_are_said_once(sealed: Recording, tmp_path: Path) -> None:
    rows = ["push,t,x,y,z,hx,hy,hz"]
    for k, push in enumerate(sealed.pushes[:3]):
        assert push.hand is not None
        hand = [np.interp(push.object.times, push.hand.times, column) for column in push.hand.positions.T]
        values = np.column_stack([push.object.times, push.object.positions, *hand])
        rows += [f"{k},{row[0]:.2f}," + ",".join(f"{v:.6f}" for v in row[1:]) for row in values]
    (tmp_path / "log.csv").write_text("\n".join(rows), encoding="utf-8")
    (tmp_path / "map.yaml").write_text(
        HEAD + "time: {column: t}\npushes: {cut: column, column: push}\n"
        "object: {position: {columns: [x, y, z]}, rotation: none}\n"
        "hand: {position: {columns: [hx, hy, hz]}, rotation: none}\n",
        encoding="utf-8",
    )
    with pytest.warns(
        UserWarning, match=r"\d+ of \d+ rows have the time of the row before, .* \(5 more like it\)"
    ) as said:
        convert_table(tmp_path / "log.csv", tmp_path / "recording", tmp_path / "map.yaml")
    assert len([one for one in said if "have the time" in str(one.message)]) == 1


def test_a_unit_without_a_name_is_a_number(sealed: Recording, tmp_path: Path) -> None:
    """Pixels of 1.25 mm of a camera that looks down, at a rate."""
    rows = ["trial,x,y,hx,hy"]
    times = np.arange(0.0, 1.0, 0.02)
    for k, push in enumerate(sealed.pushes[:2]):
        assert push.hand is not None
        both = [np.interp(times, s.times, s.positions[:, c]) for s in (push.object, push.hand) for c in (0, 1)]
        rows += [f"{k}," + ",".join(f"{v / 0.00125:.4f}" for v in row) for row in np.column_stack(both)]
    (tmp_path / "log.csv").write_text("\n".join(rows), encoding="utf-8")
    chart = (
        HEAD + "time: {rate_hz: 50}\npushes: {cut: column, column: trial}\n"
        "object: {position: {columns: [x, y], unit: 0.00125}, rotation: none, height_m: 0.023}\n"
        "hand: {position: {columns: [hx, hy], unit: 0.00125}, rotation: none, height_m: 0.023}\n"
    )
    (tmp_path / "map.yaml").write_text(chart, encoding="utf-8")
    found = convert_table(tmp_path / "log.csv", tmp_path / "recording", tmp_path / "map.yaml")
    for push, other in zip(sealed.pushes[:2], found.pushes, strict=True):
        at = [np.interp(other.object.times, push.object.times, push.object.positions[:, c]) for c in (0, 1)]
        assert np.abs(np.column_stack(at) - other.object.positions[:, :2]).max() < 1e-6
        assert np.diff(other.object.times) == pytest.approx(0.02)
    (tmp_path / "map.yaml").write_text(chart.replace("0.00125", "-1"), encoding="utf-8")
    with pytest.raises(RecordingError, match=r"position.unit: must be positive, but got -1"):
        convert_table(tmp_path / "log.csv", tmp_path / "other", tmp_path / "map.yaml")


def times_and_places(recording: Recording, count: int) -> list[np.ndarray]:
    """Tables (n, 7) of pushes at 100 Hz: time, place of the object, place of the tip."""
    tables = []
    for push in recording.pushes[:count]:
        assert push.hand is not None
        times = np.arange(push.object.times[0], push.object.times[-1], 0.01)
        both = [np.interp(times, s.times, s.positions[:, c]) for s in (push.object, push.hand) for c in range(3)]
        tables.append(np.column_stack([times, *both]))
    return tables


PLAIN = (
    HEAD + "time: {column: t}\n"
    "object: {position: {columns: [x, y, z]}, rotation: none}\n"
    "hand: {position: {columns: [hx, hy, hz]}, rotation: none}\n"
)
NAMES = "t,x,y,z,hx,hy,hz"


def rows_of(table: np.ndarray) -> list[str]:
    return [",".join(f"{v:.6f}" for v in row) for row in table]


def test_tables_below_one_another_are_a_push_each_or_said(sealed: Recording, tmp_path: Path) -> None:
    tables = times_and_places(sealed, 3)
    text = "\n\n".join("\n".join([f"trial {k}", NAMES, *rows_of(table)]) for k, table in enumerate(tables))
    (tmp_path / "log.csv").write_text(text + "\n\nsummary\na,b\n1,2\n3,4\n", encoding="utf-8")
    (tmp_path / "map.yaml").write_text(PLAIN, encoding="utf-8")
    with pytest.warns(UserWarning, match=r"log.csv: 3 more tables are not read: .* \{cut: sections\} takes each"):
        assert len(convert_table(tmp_path / "log.csv", tmp_path / "first", tmp_path / "map.yaml").pushes) == 1
    (tmp_path / "map.yaml").write_text(PLAIN + "pushes: {cut: sections}\n", encoding="utf-8")
    with pytest.warns(UserWarning, match="section 4 hold no places of the object: left out"):
        found = convert_table(tmp_path / "log.csv", tmp_path / "all", tmp_path / "map.yaml")
    for table, push in zip(tables, found.pushes, strict=True):
        assert np.abs(push.object.positions - table[:, 1:4]).max() < 1e-6


def test_pushes_are_counted_by_a_text(sealed: Recording, tmp_path: Path) -> None:
    tables = times_and_places(sealed, 3)
    rows = [
        f"{name},{row}"
        for name, table in zip(("push_a", "", "push_b"), tables, strict=True)
        for row in rows_of(table)
    ]
    (tmp_path / "log.csv").write_text("\n".join([f"trial,{NAMES}", *rows]), encoding="utf-8")
    (tmp_path / "map.yaml").write_text(PLAIN + "pushes: {cut: column, column: trial}\n", encoding="utf-8")
    found = convert_table(tmp_path / "log.csv", tmp_path / "recording", tmp_path / "map.yaml")
    assert [push.note for push in found.pushes] == [
        "log.csv, trial push_a, from 0 s",
        "log.csv, trial push_b, from 0 s",
    ]
    assert np.abs(found.pushes[1].object.positions - tables[2][:, 1:4]).max() < 1e-6


@pytest.mark.parametrize("sign", [(0.0, 0.0, 0.0), (0.9999, 0.9999, 0.9999), (-1.0, 0.0, 0.0)])
def test_one_place_that_stands_for_none_is_left_out(
    sign: tuple[float, ...], sealed: Recording, tmp_path: Path
) -> None:
    """For a quarter of a second, in a log whose zero is 0.3 m below the table's top."""
    (table,) = times_and_places(sealed, 1)
    table[:, [3, 6]] += 0.3
    table[40:65, 1:4] = sign
    (tmp_path / "log.csv").write_text("\n".join([NAMES, *rows_of(table)]), encoding="utf-8")
    (tmp_path / "map.yaml").write_text(PLAIN + "world: {origin: [0, 0, 0.3]}\n", encoding="utf-8")
    with pytest.warns(
        UserWarning, match="25 rows hold one place far from those before and after: the track was lost"
    ):
        found = convert_table(tmp_path / "log.csv", tmp_path / "recording", tmp_path / "map.yaml")
    assert len(found.pushes[0].object) == len(table) - 25


def test_bodies_side_by_side_in_an_array(sealed: Recording, tmp_path: Path) -> None:
    (table,) = times_and_places(sealed, 1)
    np.savez(tmp_path / "log.npz", t=table[:, 0], p=table[:, 1:].reshape(-1, 2, 3), other=np.zeros(7))
    chart = (
        HEAD + "time: {column: t}\n"
        'object: {position: {columns: ["p[0,0]", "p[0,1]", "p[0,2]"]}, rotation: none}\n'
        'hand: {position: {columns: ["p[1,0]", "p[1,1]", "p[1,2]"]}, rotation: none}\n'
    )
    (tmp_path / "map.yaml").write_text(chart, encoding="utf-8")
    found = convert_table(tmp_path / "log.npz", tmp_path / "recording", tmp_path / "map.yaml")
    assert np.abs(found.pushes[0].object.positions - table[:, 1:4]).max() < 1e-12
    (tmp_path / "map.yaml").write_text(chart.replace("column: t}", "column: other}"), encoding="utf-8")
    with pytest.raises(RecordingError, match=r"object: column 'other' has 7 times, but there are \d+ rows"):
        convert_table(tmp_path / "log.npz", tmp_path / "again", tmp_path / "map.yaml")


@pytest.mark.parametrize(
    ("header", "unit", "said"),
    [
        ("yaw [degrees]", "rad", "the map says rad, but the table's header says deg"),
        ("yaw [degrees]", "degrees", None), ("yaw [deg]", "degrees", None), ("yaw [°]", "deg", None),
    ],
)  # fmt: skip
def test_units_in_words(header: str, unit: str, said: str | None, sealed: Recording, tmp_path: Path) -> None:
    (table,) = times_and_places(sealed, 1)
    rows = [f"{row},0" for row in rows_of(table)]
    (tmp_path / "log.csv").write_text("\n".join([f"{NAMES},{header}", *rows]), encoding="utf-8")
    turn = f'rotation: {{columns: ["{header}"], as: yaw, unit: {unit}}}'
    (tmp_path / "map.yaml").write_text(PLAIN.replace("rotation: none", turn, 1), encoding="utf-8")
    if said is None:
        assert convert_table(tmp_path / "log.csv", tmp_path / "recording", tmp_path / "map.yaml").pushes
        return
    with pytest.raises(RecordingError, match=said):
        convert_table(tmp_path / "log.csv", tmp_path / "recording", tmp_path / "map.yaml")
