"""Bags of ROS 1 and 2 become recordings; what is cut off, empty or not there is one line."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import foreign
import numpy as np
import pytest

pytest.importorskip("rosbags")

from physid_drake.convert import convert_bag, guess_map, read_map
from physid_drake.errors import RecordingError
from physid_drake.recording import Recording, read_recording

SEALED = Path(__file__).parents[2] / "recordings" / "sealed_01"


@pytest.fixture(scope="module")
def sealed() -> Recording:
    return read_recording(SEALED).subset([0, 1, 2])


@pytest.fixture(scope="module")
def bags(sealed: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bags")
    for name, log in foreign.BAGS.items():
        (folder / f"{name}.yaml").write_text(log.write(sealed, folder / name))
    return folder


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", foreign.BAGS)
def test_bags_come_back_as_they_were(name: str, sealed: Recording, bags: Path, tmp_path: Path) -> None:
    found = convert_bag(bags / name, tmp_path / "recording", bags / f"{name}.yaml")
    assert len(found.pushes) == len(sealed.pushes)
    for push, other in zip(sealed.pushes, found.pushes, strict=True):
        foreign.assert_rests_agree(push.object, other.object)
        assert push.hand is not None and other.hand is not None
        assert other.hand.rotation == ("none" if name == "pushes.bag" else "full")
        if foreign.BAGS[name].exact:
            assert np.abs(push.object.planar - other.object.planar).max() < 1e-9
            shift = push.object.times[0] - other.object.times[0]
            assert np.abs(push.hand.times - other.hand.times - shift).max() < 1e-6
        else:
            # Stamps of the measurement, not of its arrival in bursts of 50 ms.
            assert np.abs(np.diff(other.object.times) - 0.01).max() < 1e-6


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(("name", "force"), [("mcap", 0.0), ("sqlite3", 0.0), ("pushes.bag", 0.5)])
def test_forces_of_a_bag(name: str, force: float, bags: Path, tmp_path: Path) -> None:
    for push in convert_bag(bags / name, tmp_path / "recording", bags / f"{name}.yaml").pushes:
        assert push.force is not None
        assert push.force.forces[0] == pytest.approx([force, 0.0, 0.0], abs=1e-9)


def test_times_of_arrival_where_there_is_no_stamp(bags: Path, tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"topic /ft \(Twist\) has no stamps of its own"):
        convert_bag(bags / "pushes.bag", tmp_path / "recording", bags / "pushes.bag.yaml")


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("topic: /tf, frame: mug", "topic: /tf", "holds transforms of 'finger', 'mug'; add the child frame"),
        ("frame: mug", "frame: cup", "topic '/tf' has no message of frame 'cup'"),
        ("topic: /ft/wrench", "topic: /ft", "has no topic '/ft'; it has '/ft/wrench', '/silent', '/tf'"),
        ("topic: /ft/wrench", "topic: /silent", "topic '/silent' has no message"),
        ("topic: /tf, frame: mug", "topic: /ft/wrench", "has no rotation; write 'rotation: none'"),
        ("cut: rest", "cut: column, column: x", "a bag has no columns; cut by rest"),
        ("{topic: /ft/wrench, axes", "{columns: [a, b], axes", "a bag's stream needs its topic"),
    ],
)
def test_what_a_map_names_in_vain(old: str, new: str, said: str, bags: Path, tmp_path: Path) -> None:
    chart = (bags / "mcap.yaml").read_text()
    assert old in chart
    (tmp_path / "map.yaml").write_text(chart.replace(old, new))
    with pytest.raises(RecordingError, match=said) as caught:
        convert_bag(bags / "mcap", tmp_path / "out", tmp_path / "map.yaml")
    assert "\n" not in str(caught.value) and [p.name for p in tmp_path.iterdir()] == ["map.yaml"]


@pytest.mark.parametrize("name", ["mcap/mcap.mcap", "sqlite3/sqlite3.db3", "pushes.bag"])
@pytest.mark.parametrize("share", [0.0, 0.001, 0.5, 0.95])
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_bag_that_is_cut_off_is_one_line(name: str, share: float, bags: Path, tmp_path: Path) -> None:
    whole = (bags / name).read_bytes()
    bag = tmp_path / Path(name).name
    bag.write_bytes(whole[: int(share * len(whole))])
    try:
        convert_bag(bag, tmp_path / "out", bags / f"{name.split('/', maxsplit=1)[0]}.yaml")
    except RecordingError as error:
        assert "\n" not in str(error) and bag.name in str(error)
        assert not (tmp_path / "out").exists()


def test_a_path_in_a_bags_metadata_is_not_followed(bags: Path, tmp_path: Path) -> None:
    shutil.copytree(bags / "mcap", tmp_path / "bag")
    (tmp_path / "bag/mcap.mcap").rename(tmp_path / "elsewhere.mcap")
    metadata = tmp_path / "bag/metadata.yaml"
    metadata.write_text(metadata.read_text().replace("mcap.mcap", "../elsewhere.mcap"))
    with pytest.raises(RecordingError, match="no bag here"):
        convert_bag(tmp_path / "bag", tmp_path / "out", bags / "mcap.yaml")


def test_a_name_is_no_option(bags: Path, tmp_path: Path) -> None:
    bag = tmp_path / "x?mode=rwc&.db3"
    shutil.copy(bags / "sqlite3/sqlite3.db3", bag)
    assert len(guess_map(bag).rows) == 4
    assert [p.name for p in tmp_path.iterdir()] == [bag.name]


@pytest.mark.parametrize("name", ["mcap", "sqlite3", "pushes.bag"])
def test_a_guess_is_a_map(name: str, bags: Path, tmp_path: Path) -> None:
    guess = guess_map(bags / name)
    (tmp_path / "map.yaml").write_text(guess.text)
    chart = read_map(tmp_path / "map.yaml")
    assert chart.object.topic == ("/mocap/mug" if name == "pushes.bag" else "/tf")
    assert chart.hand_path is not None and chart.force is not None
    assert chart.hand_path.frame == (None if name == "pushes.bag" else "finger")
    rates = {row[0].partition(" ")[0]: row[2] for row in guess.rows}
    assert rates[{"pushes.bag": "/ft"}.get(name, "/ft/wrench")] == {"pushes.bag": "100"}.get(name, "500")


def test_a_file_without_a_first_line_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader would look for its end in all of a file."""
    import rosbags.rosbag1

    monkeypatch.setattr(rosbags.rosbag1.Reader, "open", lambda _: pytest.fail("it was opened"))
    (tmp_path / "log.bag").write_bytes(bytes(1000))
    with pytest.raises(RecordingError, match=r"log\.bag: no bag that can be read"):
        guess_map(tmp_path / "log.bag")


@pytest.mark.parametrize(
    "change", ["topics SET name = x'00ff'", "topics SET type = NULL", "messages SET timestamp = x'00ff'"]
)
def test_columns_of_another_type(change: str, bags: Path, tmp_path: Path) -> None:
    shutil.copy(bags / "sqlite3/sqlite3.db3", tmp_path / "log.db3")
    with sqlite3.connect(tmp_path / "log.db3") as base:
        base.execute("PRAGMA ignore_check_constraints = ON")
        base.execute("PRAGMA writable_schema = ON")
        base.execute("UPDATE sqlite_schema SET sql = replace(sql, ' NOT NULL', '')")
    base.close()
    with sqlite3.connect(tmp_path / "log.db3") as base:
        base.execute(f"UPDATE {change}")
    base.close()
    with pytest.raises(RecordingError, match=r"log\.db3: no bag that can be read"):
        guess_map(tmp_path / "log.db3")
