"""Groups that hold one push each, JSON, and single arrays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from physid_drake.convert import guess_map, json_table
from physid_drake.convert.arrays import PUSH, read_array_table
from physid_drake.errors import RecordingError

COUNTS = [5, 4] + [6] * 9


def written(path: Path, arrays: dict[str, Any]) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as opened:
        for name, values in arrays.items():
            opened[name] = values
    return path


class TestGroups:
    @pytest.mark.parametrize("above", ["", "data/", "log/of/today/"])
    @pytest.mark.parametrize("below", ["", "obs/"])
    def test_at_any_depth_in_the_order_of_their_numbers(self, above: str, below: str, tmp_path: Path) -> None:
        arrays = {f"{above}demo_{k}/{below}x": np.full(n, k) for k, n in enumerate(COUNTS)}
        arrays |= {f"{above}demo_{k}/rewards": np.zeros(n) for k, n in enumerate(COUNTS)}
        numbers = read_array_table(written(tmp_path / "log.h5", arrays)).numbers
        assert sorted(numbers) == sorted([PUSH, f"{above}{below}x", f"{above}rewards"])
        assert numbers[f"{above}{below}x"].tolist() == np.repeat(np.arange(11), COUNTS).tolist()
        assert numbers[PUSH].tolist() == np.repeat(np.arange(11), COUNTS).tolist()

    def test_what_is_no_column_of_all_is_said_once(self, tmp_path: Path) -> None:
        arrays: dict[str, Any] = {}
        for k, n in enumerate(COUNTS):
            arrays |= {f"data/demo_{k}/{name}": np.zeros(n) for name in ("t", "x", "y")}
            arrays |= {f"data/demo_{k}/size": np.zeros(2), f"data/demo_{k}/image": np.zeros((n, 8, 8, 3))}
            arrays |= {f"data/demo_{k}/wide": np.zeros((n, 2 + (k == 3)))}
            arrays |= {f"data/demo_{k}/seldom": np.zeros(n)} if k else {}
        file = written(tmp_path / "log.h5", arrays | {"mask": np.zeros(11)})
        columns = read_array_table(file)
        assert sorted(columns.numbers) == [PUSH, "data/t", "data/x", "data/y", "mask"]
        assert columns.unread == {
            "data/size": "it is not as long as the other arrays of its group",
            "data/image": "it has 4 axes, as images have",
            "data/wide": "it is of another width or kind in other groups",
            "data/seldom": "1 of 11 groups do not hold it",
        }
        assert len(guess_map(file).rows) == len(columns.numbers) + len(columns.unread)

    def test_groups_of_bodies_are_no_pushes(self, tmp_path: Path) -> None:
        arrays = {f"{body}/{name}": np.arange(5.0) for body in ("mug", "tip") for name in ("t", "x")}
        columns = read_array_table(written(tmp_path / "log.h5", arrays))
        assert sorted(columns.numbers) == ["mug/t", "mug/x", "tip/t", "tip/x"]


RECORDS = [{"t": 0.1 * k, "obj": {"p": [k, 2.0, None], "who": "me"}, "tags": [{"id": 3}]} for k in range(5)]
EXPECTED = {"t": 0.4, "obj/p[0]": 4.0, "obj/p[1]": 2.0, "tags[0]/id": 3.0}


class TestJson:
    @pytest.mark.parametrize(
        ("name", "text"),
        [
            ("log.json", json.dumps(RECORDS)),
            ("log.json", json.dumps({"log": {"frames": RECORDS}, "rate": 10})),
            ("log.jsonl", "\n".join(map(json.dumps, RECORDS)) + "\n\n"),
        ],
    )
    def test_records(self, name: str, text: str, tmp_path: Path) -> None:
        (tmp_path / name).write_text(text)
        columns = read_array_table(tmp_path / name)
        assert {end: columns.numbers[columns.find(end)][4] for end in EXPECTED} == pytest.approx(EXPECTED)
        assert np.isnan(columns.numbers[columns.find("obj/p[2]")]).all()
        assert list(columns.texts.values()) == [["me"] * 5]

    def test_arrays_and_dates(self, tmp_path: Path) -> None:
        log = {"when": [f"2026-03-01T10:00:0{k}Z" for k in range(4)], "mug": {"p": [[k, 1, 2] for k in range(4)]}}
        (tmp_path / "log.json").write_text(json.dumps(log))
        columns = read_array_table(tmp_path / "log.json")
        assert columns.units == {"when": "s"} and np.diff(columns.numbers["when"]).tolist() == [1.0] * 3
        assert columns.numbers["mug/p[0]"].tolist() == [0.0, 1.0, 2.0, 3.0]

    def test_a_record_without_a_value_has_none(self, tmp_path: Path) -> None:
        (tmp_path / "log.jsonl").write_text('{"t": 0, "p": [1, 2]}\n{"t": 1}\n{"t": 2, "p": [3, 4]}\n')
        assert np.isnan(read_array_table(tmp_path / "log.jsonl").numbers["p[1]"]).tolist() == [False, True, False]

    def test_records_of_lists_are_pushes(self, tmp_path: Path) -> None:
        log = [{"t": list(range(n)), "p": [[k, 0.0]] * n} for k, n in enumerate(COUNTS)]
        (tmp_path / "log.json").write_text(json.dumps(log))
        numbers = read_array_table(tmp_path / "log.json").numbers
        assert numbers["p[0]"].tolist() == numbers[PUSH].tolist() == np.repeat(np.arange(11), COUNTS).tolist()

    @pytest.mark.parametrize(
        ("name", "text", "said"),
        [
            ("log.json", '{"t": [1, 2', "no JSON, or damaged"),
            ("log.jsonl", '{"t": 1}\n{"t": \n', "line 2: no JSON, or damaged"),
            ("log.json", "[" * 100_000, "nests deeper"),
            ("log.json", '{"a":' * 20 + "[1]" + "}" * 20, "it nests deeper"),
            (
                "log.json",
                '{"t": 3}',
                r"holds no columns of numbers; its arrays are 't' \(it is a single value\)|single",
            ),
            ("log.json", '{"t": [1, [2]]}', "its values are no numbers of one shape"),
            ("log.json", "\udcff", "no text in UTF-8"),
            ("log.json", f'{{"t": [{"9" * 400}, 1]}}', "its values are no numbers of one shape"),
        ],
    )
    def test_what_is_refused(self, name: str, text: str, said: str, tmp_path: Path) -> None:
        (tmp_path / name).write_bytes(text.encode("utf-8", "surrogateescape"))
        with pytest.raises(RecordingError, match=said) as caught:
            read_array_table(tmp_path / name)
        assert "\n" not in str(caught.value) and str(caught.value).startswith(str(tmp_path / name))

    def test_missing_values_take_room_too(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(json_table, "MOST_NUMBERS", 1000)
        (tmp_path / "log.jsonl").write_text("".join(f'{{"k{k}": 1}}\n' for k in range(100)))
        (tmp_path / "log.json").write_text(json.dumps([[0.0] * 60] + [None] * 100))
        for name in ("log.jsonl", "log.json"):
            with pytest.raises(RecordingError, match="more than 1,000 numbers"):
                read_array_table(tmp_path / name)


class TestNpy:
    def test_one_array(self, tmp_path: Path) -> None:
        np.save(tmp_path / "log.npy", np.arange(12.0).reshape(4, 3))
        assert read_array_table(tmp_path / "log.npy").numbers["array[2]"].tolist() == [2.0, 5.0, 8.0, 11.0]

    def test_a_structured_array(self, tmp_path: Path) -> None:
        array = np.zeros(4, dtype=[("t", "f8"), ("mug", [("p", "f4", 3), ("id", "i4")])])
        array["t"] = np.arange(4)
        np.save(tmp_path / "log.npy", array)
        numbers = read_array_table(tmp_path / "log.npy").numbers
        assert sorted(numbers) == ["mug/id", "mug/p[0]", "mug/p[1]", "mug/p[2]", "t"]
        assert numbers["t"].tolist() == [0.0, 1.0, 2.0, 3.0]

    def test_what_is_refused(self, tmp_path: Path) -> None:
        np.save(tmp_path / "log.npy", np.array([{"t": 1}], dtype=object), allow_pickle=True)
        with pytest.raises(RecordingError, match=r"log\.npy: cannot be read: it holds no numbers and no text"):
            read_array_table(tmp_path / "log.npy")
        for content in (b"", b"\x93NUMPY\x01\x00", b"x" * 100):
            (tmp_path / "log.npy").write_bytes(content)
            with pytest.raises(RecordingError, match=r"log\.npy: cannot be read"):
                read_array_table(tmp_path / "log.npy")

    def test_samples_along_the_second_axis(self, tmp_path: Path) -> None:
        np.savez(tmp_path / "log.npz", t=np.arange(100.0), p=np.zeros((3, 100)))
        assert "its shape is (3, 100): transposed?" in read_array_table(tmp_path / "log.npz").unread["p"]
