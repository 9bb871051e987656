"""Tables of text as foreign programs write them: headers, times in words, lost samples, packed files."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from physid_drake.convert.columns import Columns
from physid_drake.convert.text_table import Dialect, read_text_table
from physid_drake.errors import RecordingError

ROWS = "0 1 2\n1 3 4\n2 5 6\n"


def read(text: str | bytes, folder: Path, **dialect: object) -> Columns:
    file = folder / "log.txt"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_text_table(file, Dialect(**dialect))  # type: ignore[arg-type]


class TestHeaders:
    @pytest.mark.parametrize(
        "header", ["# t x y\n", "#t x y\n", "## t x y\n", "# made by Anna\n# t x y\n", "t x y\n"]
    )
    @pytest.mark.parametrize("separator", [" ", ","])
    def test_a_comment_that_names_every_column_is_a_header(self, header: str, separator: str, tmp_path: Path) -> None:
        text = header.replace("t x y", "t x y".replace(" ", separator)) + ROWS.replace(" ", separator)
        found = read(text, tmp_path).numbers
        assert {name: values.tolist() for name, values in found.items()} == {
            "t": [0.0, 1.0, 2.0],
            "x": [1.0, 3.0, 5.0],
            "y": [2.0, 4.0, 6.0],
        }

    @pytest.mark.parametrize("comment", ["# recorded on a Monday\n", "# t x\n", "# 9 9 9\n", "#\n"])
    def test_any_other_comment_names_nothing(self, comment: str, tmp_path: Path) -> None:
        assert list(read(comment + ROWS, tmp_path).numbers) == ["column 1", "column 2", "column 3"]

    def test_a_column_may_be_called_so(self, tmp_path: Path) -> None:
        assert list(read("#,x,y\n" + ROWS.replace(" ", ","), tmp_path).numbers) == ["#", "x", "y"]
        assert list(read("#1,0,1\n#2,0,1\n#3,0,2\n", tmp_path).texts) == ["column 1"]

    def test_comments_between_rows_are_passed_over(self, tmp_path: Path) -> None:
        found = read("# t x y\n" + ROWS + "# stopped here\n" + ROWS, tmp_path).numbers
        assert found["t"].tolist() == [0.0, 1.0, 2.0] * 2

    @pytest.mark.parametrize(
        ("header", "rows", "names"),
        [("t,x,y,z", "0,1,2\n" * 3, 4), ("x,y", "0,1,2\n" * 3, 2), ("x,y", "0,1,2,\n0,1,2,3\n0,1,2,\n", 2)],
    )
    def test_names_that_are_no_columns_shift_nothing(
        self, header: str, rows: str, names: int, tmp_path: Path
    ) -> None:
        with pytest.raises(RecordingError, match=rf"row 2: has \d fields, but the header above it names {names}"):
            read(f"{header}\n{rows}", tmp_path)
        assert next(iter(read(f"{header}\n{rows}", tmp_path, header_lines=0).numbers)) == "column 1"

    @pytest.mark.parametrize("text", ["x,y\n" + "1,2,\n" * 3, "x,y,\n" + "1,2\n" * 3, "x,y,\n" + "1,2,\n" * 3])
    def test_a_separator_at_the_end_is_no_column(self, text: str, tmp_path: Path) -> None:
        found = read(text, tmp_path).numbers
        assert found["x"].tolist() == [1.0] * 3 and found["y"].tolist() == [2.0] * 3

    def test_rows_may_end_before_the_header_does(self, tmp_path: Path) -> None:
        found = read("t,x,y\n0,1\n1,2,3\n2,3\n3,4\n", tmp_path).numbers
        assert np.isnan(found["y"]).tolist() == [True, False, True, True]

    def test_rows_may_end_before_remarks_if_all_do(self, tmp_path: Path) -> None:
        found = read("t,x,Comment\n" + "0,1\n" * 3, tmp_path).numbers
        assert found["x"].tolist() == [1.0] * 3 and np.isnan(found["Comment"]).all()
        with pytest.raises(RecordingError, match="names 4 columns"):
            read("t,x,y,Comment\n" + "0,1\n" * 3, tmp_path)

    @pytest.mark.parametrize("word", ["lost", "--", "#N/A", "NaN", ""])
    def test_a_header_ends_where_nothing_is_seen_yet(self, word: str, tmp_path: Path) -> None:
        rows = f"0,{word},{word},{word}\n1,{word},{word},5\n2,3,4,5\n3,3,4,5\n"
        found = read(f"t,x,y,z\n{rows}", tmp_path).numbers
        assert list(found) == ["t", "x", "y", "z"] and found["t"].tolist() == [0.0, 1.0, 2.0, 3.0]
        assert np.isnan(found["x"]).tolist() == [True, True, False, False]

    def test_more_columns_than_a_log_has(self, tmp_path: Path) -> None:
        wide = ",".join("1" * 20_000)
        with pytest.raises(RecordingError, match="more than 10,000 columns"):
            read(f"{wide}\n{wide}\n", tmp_path)
        found = read("x,y" + "," * 100_000 + "\n" + "1,2\n" * 3, tmp_path).numbers
        assert list(found) == ["x", "y"]


class TestTimes:
    @pytest.mark.parametrize(
        "stamp",
        [
            "2026-03-01 10:00:{:06.3f}+00:00",
            "2026-03-01T11:00:{:06.3f}+01:00",
            "2026-03-01T10:00:{:06.3f}Z",
            "2026-03-01 10:00:{:06.3f}000000",
            "10:00:{:06.3f}",
        ],
    )
    def test_dates_and_times_of_iso_8601_are_seconds(self, stamp: str, tmp_path: Path) -> None:
        rows = "".join(f"{stamp.format(0.25 * k)},{k},2\n" for k in range(4))
        found = read(f"when,x,y\n{rows},5,2\n", tmp_path)
        assert found.units["when"] == "s" and np.isnan(found.numbers["when"][4])
        assert np.diff(found.numbers["when"][:4]) == pytest.approx(0.25)
        begin = 36000.0 + (1772323200.0 if stamp.startswith("2026") else 0.0)
        assert found.numbers["when"][0] == pytest.approx(begin, abs=1e-6)

    def test_a_text_among_them_is_none(self, tmp_path: Path) -> None:
        rows = "2026-03-01,1,2\nyesterday,1,2\n2026-03-02,1,2\n"
        assert list(read(f"when,x,y\n{rows}", tmp_path).texts) == ["when"]

    @pytest.mark.parametrize("sign", [".", ","])
    def test_minutes_and_seconds_have_a_fraction(self, sign: str, tmp_path: Path) -> None:
        stamps = ["00:58.50", "00:59.25", "01:00.00", "61:00.75"]
        rows = "".join(f"{stamp.replace('.', sign)};1.5;2.5\n" for stamp in stamps)
        assert read(f"t;x;y\n{rows}", tmp_path).numbers["t"].tolist() == [58.5, 59.25, 60.0, 3660.75]

    def test_hours_and_minutes_are_not_told_from_minutes_and_seconds(self, tmp_path: Path) -> None:
        assert list(read("t,x,y\n10:00,1,2\n10:01,1,2\n10:02,1,2\n", tmp_path).texts) == ["t"]

    @pytest.mark.parametrize(
        "stamp", ["01:00:00:{:02}", "01:00:00;{:02}", "01:00:00:{:03}", "2026-03-01 01:00:00:{:02}"]
    )
    def test_frames_of_a_timecode_are_no_part_of_a_second(self, stamp: str, tmp_path: Path) -> None:
        rows = "".join(f"{stamp.format(k)},1,2\n" for k in range(4))
        found = read(f"t,x,y\n{rows}", tmp_path)
        assert list(found.texts) == ["t"]
        with pytest.raises(
            RecordingError, match=r"'t' holds timecode, with frames .*; give a column that counts, or r"
        ):
            found.find("t")

    def test_milliseconds_behind_a_third_colon(self, tmp_path: Path) -> None:
        rows = "".join(f"01:00:00:{250 * k:03},1,2\n" for k in range(4))
        assert np.diff(read(f"t,x,y\n{rows}", tmp_path).numbers["t"]) == pytest.approx(0.25)


class TestNotation:
    @pytest.mark.parametrize(
        ("text", "x"),
        [
            ("t;x\n0.01;-8,990.5\n0.02;1,234,567.25\n0.03;8,990\n", [-8990.5, 1234567.25, 8990.0]),
            ("t\tx\n0.0001\t-8,990\n0.0002\t990\n0.0003\t8,990\n", [-8990.0, 990.0, 8990.0]),
            ("t;x\n0,01;-8.990\n0,02;990\n0,03;1.234.567,5\n", [-8990.0, 990.0, 1234567.5]),
            ("t;x\n0,01;-8 990,5\n0,02;990,5\n0,03;1 234 567,5\n", [-8990.5, 990.5, 1234567.5]),
            ("t;x\n0.01;-8'990.5\n0.02;990.5\n0.03;8'990\n", [-8990.5, 990.5, 8990.0]),
            ('t,x\n0.0,"1,234.5"\n0.1,"2,345.5"\n0.2,999.5\n', [1234.5, 2345.5, 999.5]),
            ('t,x\n"0,0","1,234"\n"0,1","2,345"\n"0,2","9,5"\n', [1.234, 2.345, 9.5]),
            ("t;x\n0;1.234\n1;2.345\n2;3.456\n", [1.234, 2.345, 3.456]),
            ("t;x\n0;1,234\n1;2,345\n2;3,456\n", [1.234, 2.345, 3.456]),
            ("t;x\n1.000;0.234\n2.000;0,345\n3.000;0.456\n", None),
        ],
    )
    def test_one_sign_is_before_decimals_in_a_table(self, text: str, x: list[float] | None, tmp_path: Path) -> None:
        if x is None:
            with pytest.raises(RecordingError, match="row 3: column 'x': '0,345' is no number where a point stands"):
                read(text, tmp_path)
        else:
            assert read(text, tmp_path).numbers["x"].tolist() == x

    def test_groups_have_three_digits(self, tmp_path: Path) -> None:
        with pytest.raises(RecordingError, match=r"row 3: column 'x': '1\.2345,6' is no number where a comma stands"):
            read("t;x\n0,01;1.234,5\n0,02;1.2345,6\n0,03;5\n0,04;5\n", tmp_path)
        with pytest.raises(RecordingError, match=r"column 'x': '0\.512' is no number"):
            read("t;x;y\n0,01;0.512;0,1\n0,02;0.513;0,1\n0,03;0.514;0,1\n", tmp_path)

    def test_what_nothing_tells_is_asked_for(self, tmp_path: Path) -> None:
        text = "t;x\n1.234;1,234\n2.234;2,345\n3.234;3,456\n"
        with pytest.raises(RecordingError, match=r"do not tell whether a comma .* give 'decimal: "):
            read(text, tmp_path)
        assert read(text, tmp_path, decimal=",").numbers["t"].tolist() == [1234.0, 2234.0, 3234.0]


def test_marks_of_lost_samples_are_empty_and_said(tmp_path: Path) -> None:
    """NDI writes -3.697314e28 where a tool is not seen."""
    text = "t_ns,x,y\n" + "".join(f"{1772359200123456768 + k},{-3.697314e28 if k == 2 else k},1\n" for k in range(5))
    with pytest.warns(
        UserWarning, match=r"log\.txt: 1 numbers beyond 1e\+20 in 'x' stand for samples that were lost"
    ):
        found = read(text, tmp_path).numbers
    assert np.isnan(found["x"][2]) and np.isfinite(found["t_ns"]).all()


def test_gzip(tmp_path: Path) -> None:
    packed = gzip.compress(("t x y\n" + ROWS).encode())
    assert read(packed, tmp_path).numbers["x"].tolist() == [1.0, 3.0, 5.0]
    for damaged in (packed[:-12], packed[:10] + b"\xff" * 20):
        with pytest.raises(RecordingError, match=r"gzip|cut off"):
            read(damaged, tmp_path)
