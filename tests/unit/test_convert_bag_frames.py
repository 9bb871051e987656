"""Frames of a bag: what is in another one, trees of transforms, and what a guess makes of them."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign.common import DESCRIPTION, EPOCH, HAND
from foreign.frame_trees import CAMERA, OPTICAL, Pose, Writing, inside
from scipy.spatial.transform import Rotation

pytest.importorskip("rosbags")

from physid_drake.convert import convert_bag, guess_map
from physid_drake.convert.bag import read_bag, read_whole_bag
from physid_drake.errors import RecordingError
from physid_drake.recording import Recording

TIMES = np.arange(0.0, 6.0, 0.01)
UPRIGHT = Rotation.identity()


def push(time: float) -> tuple[Pose, Pose]:
    """Poses in W of an object that is pushed along x for a second, and of the hand that comes from behind."""
    way = 0.1 * np.clip(time - 3.0, 0.0, 1.0)
    behind = 0.05 * np.clip(time - 1.0, 0.0, 1.0)
    turn = Rotation.from_euler("z", 3.0 * way)
    return (np.array([way, 0.0, 0.05]), turn), (np.array([way + behind - 0.1, 0.0, 0.05]), UPRIGHT)


BASE: Pose = (np.array([0.06, -0.02, 0.0]), Rotation.from_euler("z", 20, degrees=True))


def apart(path: Path, *, static: bool = False, **options: Any) -> Path:
    """The object in W, the hand in a robot's base; perhaps with the transform between them."""
    with Writing(path, options) as bag:
        if static:
            bag.transform("/tf_static", 0.0, "world", "base", BASE)
        for time in TIMES.tolist():
            body, hand = push(time)
            bag.pose("/mug", time, "world", body)
            bag.pose("/tip", time, "base", inside(BASE, hand))
            bag.force("/ft", time, "base", inside((np.zeros(3), BASE[1]), (np.array([1.0, 0.0, 0.0]), UPRIGHT))[0])
    return path


def deep(path: Path) -> Path:
    """A tree: a tag below a camera that is bolted to the world, and a tip on a robot's moving slide."""
    tf = "tf" if path.suffix == ".bag" else "tf2_msgs"
    with Writing(path) as bag:

        def link(topic: str, time: float, parent: str, child: str, pose: Pose) -> None:
            bag.transform(topic, time, parent, child, pose, tf)

        link("/tf_static", 0.0, "/world", "/camera", (CAMERA[0], CAMERA[1] * OPTICAL.inv()))
        link("/tf_static", 0.0, "/camera", "/optical", (np.zeros(3), OPTICAL))
        link("/tf_static", 0.0, "/world", "/link0", BASE)
        link("/tf_static", 0.0, "/slide", "/tool", (np.array([0.0, 0.0, -0.2]), UPRIGHT))
        for k, time in enumerate(TIMES.tolist()):
            body, hand = push(time)
            if k % 3 == 0:
                link("/tf", time, "/optical", "/tag_7", inside(CAMERA, body))
            link("/tf", time, "/link0", "/link1", (np.array([0.0, 0.0, 0.3]), UPRIGHT))
            place, turn = inside(BASE, hand)
            link("/tf", time, "/link1", "/slide", (place - [0.0, 0.0, 0.1], turn))
    return path


def converted(source: Path, chart: str, folder: Path) -> tuple[Recording, list[str]]:
    (folder / "map.yaml").write_text(DESCRIPTION.format(name="mug") + HAND + chart)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = convert_bag(source, folder / "recording", folder / "map.yaml")
    return found, [str(one.message) for one in caught]


def largest_miss(found: Recording) -> float:
    """m: how far places are from those of the push."""
    (one,) = found.pushes
    assert one.hand is not None
    misses = []
    for stream, which in ((one.object, 0), (one.hand, 1)):
        places = np.array([push(time)[which][0] for time in stream.times])
        misses.append(np.abs(stream.positions - places).max())
    return float(max(misses))


PLAIN = "object: {topic: /mug}\nhand: {topic: /tip}\n"


def test_a_hand_in_another_frame_is_said(tmp_path: Path) -> None:
    _, said = converted(apart(tmp_path / "bag"), PLAIN, tmp_path)
    assert said[0].startswith("hand: it is in frame 'base' and the object in 'world', and no transforms")
    assert "give hand a world: of its own, which says where W lies in 'base'" in said[0]


@pytest.mark.parametrize("static", [True, False])
def test_a_world_of_its_own_is_enough(static: bool, tmp_path: Path) -> None:
    world = "{pose: {translation: [0.06, -0.02, 0], yaw_deg: 20}}"
    chart = f"object: {{topic: /mug}}\nhand: {{topic: /tip, world: {world}}}\n"
    found, said = converted(apart(tmp_path / "bag", static=static), chart, tmp_path)
    assert largest_miss(found) < 1e-6
    assert not any("frame" in line for line in said)


def test_fixed_transforms_bring_hand_and_force_to_the_object(tmp_path: Path) -> None:
    chart = f"{PLAIN}force: {{topic: /ft, acts_on: object}}\n"
    found, said = converted(apart(tmp_path / "bag", static=True), chart, tmp_path)
    assert largest_miss(found) < 1e-6
    assert found.pushes[0].force is not None
    assert found.pushes[0].force.forces == pytest.approx(np.tile([1.0, 0.0, 0.0], (len(TIMES), 1)), abs=1e-9)
    assert [line[:42] for line in said[:2]] == [
        "hand: brought from frame 'base' into the o", "force: brought from frame 'base' into the ",
    ]  # fmt: skip


@pytest.mark.parametrize(("axes", "count"), [("world", 1), ("hand", 0)])
def test_a_force_in_another_frame_is_said(axes: str, count: int, tmp_path: Path) -> None:
    chart = f"{PLAIN}force: {{topic: /ft, axes: {axes}}}\n"
    _, said = converted(apart(tmp_path / "bag"), chart, tmp_path)
    said = [line for line in said if line.startswith("force: it is in frame 'base'")]
    assert len(said) == count
    assert all("write axes: hand if it turns with the hand" in line for line in said)


def test_a_topic_whose_frame_changes_is_said(tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        for time in TIMES.tolist():
            body, hand = push(time)
            bag.pose("/mug", time, "odom" if time > 4.0 else "map", body)
            bag.pose("/tip", time, "map", hand)
    _, said = converted(tmp_path / "bag", PLAIN, tmp_path)
    assert said[0].startswith("object: topic /mug (PoseStamped) changes its frame along the way ('map', 'odom')")
    assert "cut the bag where the frame changes" in guess_map(tmp_path / "bag").text


@pytest.mark.parametrize("name", ["bag", "tree.bag"])
def test_a_tree_is_composed_up_to_its_root(name: str, tmp_path: Path) -> None:
    chart = "object: {topic: /tf, frame: tag_7}\nhand: {topic: /tf, frame: tool, offset: {translation: [0, 0, 0]}}\n"
    found, said = converted(deep(tmp_path / name), chart, tmp_path)
    assert largest_miss(found) < 1e-6
    assert np.diff(found.pushes[0].object.times) == pytest.approx(0.03, abs=1e-6)
    assert said[:2] == [
        "object: its transforms are composed through 'optical', 'camera'; it is in frame 'world'.",
        "hand: its transforms are composed through 'slide', 'link1', 'link0'; it is in frame 'world'.",
    ]


def test_what_moves_above_is_taken_between_its_samples(tmp_path: Path) -> None:
    """A camera on a cart: seen at 100 Hz, the cart at 7 Hz and for four of the six seconds."""
    with Writing(tmp_path / "bag") as bag:
        for time in np.arange(1.0, 5.0, 1.0 / 7.0).tolist():
            turn = Rotation.from_euler("z", 0.1 * time)
            bag.transform("/tf", time, "world", "cart", (np.array([0.2 * time, 0.0, 0.0]), turn))
        for time in TIMES.tolist():
            cart = (np.array([0.2 * time, 0.0, 0.0]), Rotation.from_euler("z", 0.1 * time))
            bag.transform("/tf", time, "cart", "mug", inside(cart, push(time)[0]))
    columns = read_bag(tmp_path / "bag", [("/tf", "mug")]).tracks["/tf", "mug"].columns.numbers
    times = columns["stamp"] - EPOCH
    assert times[0] == pytest.approx(1.0, abs=0.02) and times[-1] == pytest.approx(4.86, abs=0.02)
    assert columns["x"] == pytest.approx([push(time)[0][0][0] for time in times], abs=1e-6)
    assert columns["y"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("links", "said"),
    [
        ([("a", "mug"), ("b", "mug")], "frame 'mug' has several parents, 'a', 'b'"),
        ([("a", "mug"), ("b", "a"), ("c", "a")], "frame 'a' has several parents, 'b', 'c'"),
        ([("a", "mug"), ("mug", "a")], "frame 'mug' hangs in a loop of 'mug', 'a'"),
        ([("mug", "mug")], "frame 'mug' hangs in a loop of 'mug'"),
        ([("f0", "mug"), *((f"f{k + 1}", f"f{k}") for k in range(40))], "more than 32 transforms below its root"),
    ],
)
def test_trees_that_are_none(links: list[tuple[str, str]], said: str, tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        for k, time in enumerate(TIMES[:100].tolist()):
            for parent, child in links:
                bag.transform("/tf", time, parent, child, (np.array([0.01 * k, 0.0, 0.0]), UPRIGHT))
            bag.pose("/tip", time, "a", push(time)[1])
    with pytest.raises(RecordingError, match=said) as caught:
        converted(tmp_path / "bag", "object: {topic: /tf, frame: mug}\nhand: {topic: /tip}\n", tmp_path)
    assert "\n" not in str(caught.value) and not (tmp_path / "recording").exists()
    guess = guess_map(tmp_path / "bag").text
    assert "# not read: /tf " in guess and said in guess


def test_transforms_that_never_met(tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        for k, time in enumerate(TIMES[:100].tolist()):
            place = np.array([0.01 * k, 0.0, 0.0])
            bag.transform("/tf", time, "world", "cart", (place, UPRIGHT))
            bag.transform("/tf", time + 2.0, "cart", "mug", (place, UPRIGHT))
    with pytest.raises(RecordingError, match="the transforms above frame 'mug' were never recorded at the same time"):
        read_bag(tmp_path / "bag", [("/tf", "mug")])


def test_a_fixed_transform_that_changes_is_refused(tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        for k, time in enumerate(TIMES[:100].tolist()):
            bag.transform("/tf_static", time, "world", "camera", (np.array([float(k > 50), 0.0, 1.0]), UPRIGHT))
            bag.transform("/tf", time, "camera", "mug", (np.array([0.01 * k, 0.0, -1.0]), UPRIGHT))
    with pytest.raises(RecordingError, match="frame 'camera' changes its place among transforms that never change"):
        read_bag(tmp_path / "bag", [("/tf", "mug")])


def test_a_guess_goes_by_what_moves(tmp_path: Path) -> None:
    guess = guess_map(deep(tmp_path / "bag"))
    assert 'object: {topic: "/tf", frame: "tag_7"}' in guess.text
    assert '# object: in frame "world", through "optical", "camera"' in guess.text
    assert 'hand: {topic: "/tf", frame: "tool"}' in guess.text
    assert "/tf link1 in world" in {row[0] for row in guess.rows}


def test_the_hand_moves_first(tmp_path: Path) -> None:
    """Names say nothing; what is seen first never moves."""
    with Writing(tmp_path / "bag") as bag:
        for time in TIMES.tolist():
            body, hand = push(time)
            bag.pose("/a", time, "world", (np.array([0.3, 0.3, 0.05 + 1e-4 * np.sin(1e3 * time)]), UPRIGHT))
            bag.pose("/b", time, "world", body)
            bag.pose("/c", time, "world", hand)
    text = guess_map(tmp_path / "bag").text
    assert 'object: {topic: "/b"}' in text and 'hand: {topic: "/c"}' in text


@pytest.mark.parametrize("name", ["box", "whatever"])
def test_a_word_in_all_names_tells_nothing(name: str, tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        for time in TIMES.tolist():
            body, hand = push(time)
            bag.pose(f"/robot/{name}", time, "world", body)
            bag.pose("/robot/probe", time, "world", hand)
    text = guess_map(tmp_path / "bag").text
    assert f'object: {{topic: "/robot/{name}"}}' in text and 'hand: {topic: "/robot/probe"}' in text


@pytest.mark.parametrize("static", [True, False])
def test_a_guess_names_frames(static: bool, tmp_path: Path) -> None:
    guess = guess_map(apart(tmp_path / "bag", static=static))
    assert {row[0] for row in guess.rows} >= {"/mug in world", "/tip in base", "/ft in base"}
    assert '# object: in frame "world"' in guess.text and '# hand: in frame "base"' in guess.text
    assert ("fixed transforms bring it into the object's" in guess.text) == static
    assert ('CHANGE: the object is in "world", and no fixed transform joins the two' in guess.text) != static


def test_messages_that_are_compressed_one_by_one(tmp_path: Path) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode

    packed = {"mode": CompressionMode.MESSAGE, "fmt": CompressionFormat.ZSTD}
    one, other = (read_whole_bag(apart(tmp_path / name, **how)) for name, how in (("packed", packed), ("plain", {})))
    assert one.tracks.keys() == other.tracks.keys() and len(one.tracks) == 3
    for key, track in one.tracks.items():
        for name, values in track.columns.numbers.items():
            assert (values == other.tracks[key].columns.numbers[name]).all()


def test_a_message_that_unpacks_to_too_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode

    from physid_drake.convert import bag_reading

    bag = apart(tmp_path / "bag", mode=CompressionMode.MESSAGE, fmt=CompressionFormat.ZSTD)
    monkeypatch.setattr(bag_reading, "LARGEST_MESSAGE", 20)
    with pytest.raises(RecordingError, match=r"bag\.db3: a message is cut off, or unpacks to more than 20 bytes"):
        guess_map(bag)


def test_files_that_are_packed_as_a_whole(tmp_path: Path) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode

    bag = apart(tmp_path / "bag", mode=CompressionMode.FILE, fmt=CompressionFormat.ZSTD)
    for source in (bag, *bag.glob("*.zstd")):
        with pytest.raises(RecordingError, match="packed as a whole; unpack its files with `zstd -d`"):
            guess_map(source)


@pytest.mark.parametrize("steady", [True, False])
def test_poses_of_an_array_by_their_index(steady: bool, tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        for time in TIMES.tolist():
            body, hand = push(time)
            other = (np.array([0.3, 0.3, 0.02]), UPRIGHT)
            bag.pose("/seen", time, "world", other, body, *([] if steady or time < 4.0 else [other]))
            bag.pose("/tip", time, "world", hand)
    guess = guess_map(tmp_path / "bag").text
    assert 'object: {topic: "/seen", frame: "[1]"}' in guess and ("more poses at times" in guess) != steady
    found, said = converted(tmp_path / "bag", 'object: {topic: /seen, frame: "[1]"}\nhand: {topic: /tip}\n', tmp_path)
    assert largest_miss(found) < 1e-6
    assert any("topic /seen (PoseArray) has more poses at times" in line for line in said) != steady
    with pytest.raises(RecordingError, match=r"topic '/seen' holds poses of '\[0\]', '\[1\]'.*; add the one"):
        converted(tmp_path / "bag", "object: {topic: /seen}\nhand: {topic: /tip}\n", tmp_path)


def test_a_type_that_is_only_called_like_one(tmp_path: Path) -> None:
    """Its definition is the bag's, which is not read."""
    from rosbags.typesys import get_types_from_msg

    with Writing(tmp_path / "bag") as bag:
        kind = "turtlesim/msg/Pose"
        bag.store.register(get_types_from_msg("float32 x\nfloat32 y\n", kind))
        for time in TIMES.tolist():
            body, hand = push(time)
            bag.rows.append((time, "/turtle", kind, bag.make(kind, 1.0, 2.0)))
            bag.pose("/mug", time, "world", body)
            bag.pose("/tip", time, "world", hand)
    guess = guess_map(tmp_path / "bag")
    assert 'object: {topic: "/mug"}' in guess.text and ("/turtle", "600", "", kind, "") in guess.rows
    with pytest.raises(RecordingError, match=r"'/turtle' is of turtlesim/msg/Pose, no standard type"):
        converted(tmp_path / "bag", PLAIN.replace("/mug", "/turtle"), tmp_path)


def test_roots_without_a_name_are_not_the_same(tmp_path: Path) -> None:
    with Writing(tmp_path / "bag") as bag:
        bag.transform("/tf_static", 0.0, "", "mocap", BASE)
        bag.transform("/tf_static", 0.0, "", "base", CAMERA)
        bag.pose("/mug", 0.0, "mocap", BASE)
    tree = read_bag(tmp_path / "bag", [("/mug", None)]).tree
    assert set(tree.links) == {"mocap", "base"} and tree.joined("mocap", "base") is None
