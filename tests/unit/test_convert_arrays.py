"""Arrays as they are kept: matrices, MATLAB's files, and what is refused in one line."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy.spatial.transform import Rotation

from physid_drake.convert import guess_map, matlab
from physid_drake.convert.arrays import PUSH, read_array_table
from physid_drake.convert.conventions import rotation_of
from physid_drake.convert.mapping import Turn, World
from physid_drake.errors import RecordingError

TURN = Rotation.from_euler("ZYX", [0.4, -0.3, 1.1])


class TestMatrices:
    def test_entries_by_row_and_column(self, tmp_path: Path) -> None:
        pose = np.tile(np.eye(4), (5, 1, 1))
        pose[:, :3, :3], pose[:, :3, 3] = TURN.as_matrix(), [1.0, 2.0, 3.0]
        np.savez(tmp_path / "log.npz", T=pose, t=np.arange(5.0))
        numbers = read_array_table(tmp_path / "log.npz").numbers
        rows = np.column_stack([numbers[f"T[{i},{j}]"] for i in range(3) for j in range(3)])
        assert (rotation_of(Turn(kind="matrix"), rows, 1.0, World()) * TURN.inv()).magnitude().max() < 1e-12
        assert [numbers[f"T[{i},3]"][0] for i in range(3)] == [1.0, 2.0, 3.0] and PUSH not in numbers

    def test_pushes_of_matrices(self, tmp_path: Path) -> None:
        np.savez(tmp_path / "log.npz", R=np.tile(np.eye(3), (2, 5, 1, 1)))
        numbers = read_array_table(tmp_path / "log.npz").numbers
        assert numbers[PUSH].tolist() == [0.0] * 5 + [1.0] * 5 and numbers["R[2,2]"].tolist() == [1.0] * 10

    @pytest.mark.parametrize(
        ("matrix", "said"),
        [
            (np.eye(3) * 1.1, "1 of 1 matrices are no rotations .* are these nine columns of one rotation"),
            (np.diag([1.0, -1.0, 1.0]), r"mirror \(determinant -1\)"),
            (np.ones((3, 3)), "no rotations"),
        ],
    )
    def test_what_is_no_rotation(self, matrix: np.ndarray, said: str) -> None:
        with pytest.raises(RecordingError, match=said):
            rotation_of(Turn(kind="matrix"), matrix.reshape(1, 9), 1.0, World())


class TestMatlab:
    def test_variables_and_structures(self, tmp_path: Path) -> None:
        scipy.io.savemat(
            tmp_path / "log.mat", {"t": np.arange(4.0)[:, None], "s": {"x": np.ones((4, 2))}, "rate": 3.0}
        )
        numbers = read_array_table(tmp_path / "log.mat").numbers
        assert sorted(numbers) == ["s/x[0]", "s/x[1]", "t"] and numbers["t"].tolist() == [0.0, 1.0, 2.0, 3.0]

    def test_version_7_3_is_the_other_way_round(self, tmp_path: Path) -> None:
        h5py = pytest.importorskip("h5py")
        with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as opened:
            opened["t"], opened["x"] = np.arange(4.0)[None, :], np.arange(8.0).reshape(2, 4)
        with (tmp_path / "log.mat").open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
        numbers = read_array_table(tmp_path / "log.mat").numbers
        assert numbers["t"].tolist() == [0.0, 1.0, 2.0, 3.0] and numbers["x[1]"].tolist() == [4.0, 5.0, 6.0, 7.0]

    def test_what_unpacks_to_more_than_a_log_is(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(matlab, "MOST_UNPACKED", 10_000_000)
        packed = zlib.compress(bytes(11_000_000))
        head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
        element = (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed
        (tmp_path / "log.mat").write_bytes(head + element)
        with pytest.raises(RecordingError, match="unpacks to more than 10 MB"):
            read_array_table(tmp_path / "log.mat")

    @pytest.mark.parametrize("at", [128, 152, 168, 184])
    def test_a_code_that_matlab_does_not_have(self, at: int, tmp_path: Path) -> None:
        """SciPy takes what lies beside its table of types for one of them, which may end the process that reads."""
        scipy.io.savemat(tmp_path / "log.mat", {"times": np.arange(9.0)[:, None]})
        content = bytearray((tmp_path / "log.mat").read_bytes())
        assert int.from_bytes(content[at : at + 4], "little") in (14, 5, 0x50001, 9, 1)
        content[at : at + 4] = (77).to_bytes(4, "little")
        (tmp_path / "log.mat").write_bytes(content)
        with pytest.raises(RecordingError, match=r"log\.mat: cannot be read: damaged|log\.mat: holds no columns"):
            read_array_table(tmp_path / "log.mat")

    @pytest.mark.parametrize(
        "content", [b"", b"x" * 300, b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"y" * 99]
    )
    def test_what_is_none(self, content: bytes, tmp_path: Path) -> None:
        (tmp_path / "log.mat").write_bytes(content)
        with pytest.raises(RecordingError, match=r"log\.mat: ") as caught:
            read_array_table(tmp_path / "log.mat")
        assert "\n" not in str(caught.value)


STAMPS = 1_750_000_000_123_456_000 + 20_000_000 * np.arange(5)  # ns since 1970
PLACES = np.linspace(0.0, 0.1, 5)


class TestTimes:
    """Dates, times of the day and durations are times; what is no column is said by name."""

    @pytest.mark.parametrize("unit", ["ns", "us", "ms"])
    def test_dates_of_numpy_are_seconds_since_1970(self, unit: str, tmp_path: Path) -> None:
        stamps = STAMPS.astype("M8[ns]").astype(f"M8[{unit}]")
        stamps[3] = np.datetime64("NaT")
        np.savez(tmp_path / "log.npz", when=stamps, since=stamps - stamps[0], x=PLACES)
        columns = read_array_table(tmp_path / "log.npz")
        when, since = columns.numbers["when"], columns.numbers["since"]
        assert np.isnan([when[3], since[3]]).all() and columns.units == {"when": "s", "since": "s"}
        assert when[[0, 4]] == pytest.approx(STAMPS[[0, 4]] * 1e-9, rel=0.0, abs=1.1e-3 if unit == "ms" else 3e-7)
        assert since[4] == pytest.approx(0.08, abs=1e-12)

    def test_months_have_no_length(self, tmp_path: Path) -> None:
        np.savez(tmp_path / "log.npz", when=np.arange(5).astype("M8[M]"), x=PLACES)
        with pytest.raises(RecordingError, match=r"'when' cannot be read: it holds datetime64\[M\], which is no"):
            read_array_table(tmp_path / "log.npz").find("when")

    @pytest.mark.parametrize(
        ("kind", "values"),
        [
            (("timestamp", "ns"), STAMPS), (("timestamp", "us", "UTC"), STAMPS // 1000),
            (("duration", "us"), 20_000 * np.arange(5)), (("time64", "us"), 20_000 * np.arange(5)),
            (("time32", "ms"), 20 * np.arange(5, dtype=np.int32)), (("decimal128", 10, 2), None),
        ],
    )  # fmt: skip
    def test_columns_of_arrow(self, kind: tuple[object, ...], values: np.ndarray | None, tmp_path: Path) -> None:
        arrow = pytest.importorskip("pyarrow")
        parquet = pytest.importorskip("pyarrow.parquet")
        name, *rest = kind
        whole = arrow.array(0.02 * np.arange(5) if values is None else values)
        stamps = whole.cast(getattr(arrow, str(name))(*rest))
        parquet.write_table(arrow.table({"timestamps": stamps, "x": PLACES}), tmp_path / "log.parquet")
        columns = read_array_table(tmp_path / "log.parquet")
        assert np.diff(columns.numbers["timestamps"]) == pytest.approx(0.02, abs=3e-7)
        assert columns.units == ({} if name == "decimal128" else {"timestamps": "s"})
        text = guess_map(tmp_path / "log.parquet").text
        assert 'time: {column: "timestamps", unit: s}' in text

    def test_categories_are_what_they_stand_for(self, tmp_path: Path) -> None:
        arrow = pytest.importorskip("pyarrow")
        parquet = pytest.importorskip("pyarrow.parquet")
        table = {"x": arrow.array(PLACES).dictionary_encode(), "who": arrow.array(["a"] * 5).dictionary_encode()}
        parquet.write_table(arrow.table(table), tmp_path / "log.parquet")
        columns = read_array_table(tmp_path / "log.parquet")
        assert columns.numbers["x"].tolist() == PLACES.tolist() and columns.texts == {"who": ["a"] * 5}

    def test_what_is_no_column_is_said(self, tmp_path: Path) -> None:
        arrow = pytest.importorskip("pyarrow")
        parquet = pytest.importorskip("pyarrow.parquet")
        odd = {
            "timestamps": ([{"sec": 1, "nanosec": 2}] * 5, "it holds struct<sec: int64, nanosec: int64>, which"),
            "image": ([[0.0] * 100] * 5, "it has 100 numbers in a row, and a column at most 64"),
            "words": ([[0.0], [0.0, 1.0]] + [[0.0]] * 3, "its lists are not equally long"),
        }
        table = {name: arrow.array(values) for name, (values, _) in odd.items()}
        parquet.write_table(arrow.table({**table, "x": PLACES}), tmp_path / "log.parquet")
        columns = read_array_table(tmp_path / "log.parquet")
        for name, (_, why) in odd.items():
            with pytest.raises(RecordingError, match=f"column '{name}' cannot be read: {why}"):
                columns.find(name)
        guess = guess_map(tmp_path / "log.parquet")
        assert "# not read: timestamps (it holds struct<" in guess.text
        assert ("image", "", "", "not read", "") in guess.rows
        with pytest.raises(RecordingError, match="did you mean 'timestamps'"):
            columns.find("timestamp")

    def test_groups_that_hold_text_too_are_joined(self, tmp_path: Path) -> None:
        h5py = pytest.importorskip("h5py")
        with h5py.File(tmp_path / "log.h5", "w") as opened:
            for k in range(2):
                opened[f"demo_{k}/x"], opened[f"demo_{k}/who"] = PLACES, "me"
        columns = read_array_table(tmp_path / "log.h5")
        assert columns.numbers["x"].tolist() == 2 * PLACES.tolist() and PUSH in columns.numbers
        assert columns.unread == {"who": "it holds object, which is no number"}
