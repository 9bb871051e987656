"""First maps of logs in many layouts: which columns are whose."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from physid_drake.convert import convert_table, guess_map

N = 1200
BEGIN = 1772359200.0
XYZ = ("x", "y", "z")


def take() -> dict[str, np.ndarray]:
    """Three pushes at 100 Hz: the hand comes, pushes, and goes back while the object rests. SI units."""
    t = 0.01 * np.arange(N)
    phase = (t % 4.0) / 4.0
    hand = np.interp(phase, [0.0, 0.2, 0.35, 0.6, 0.7, 0.9], [-0.2, -0.2, -0.05, 0.1, 0.1, -0.2])
    push = np.interp(phase, [0.35, 0.6], [0.0, 0.15]) + 0.15 * np.floor(t / 4.0)
    noise = 1e-5 * np.random.default_rng(0).normal(size=(N, 7))
    yaw = 0.5 + 2.0 * push
    objects = np.column_stack([push, 0.3 * push, 0.02 + 0.0 * t]) + noise[:, :3]
    places = np.column_stack([hand + 0.15 * np.floor(t / 4.0), 0.1 * hand, 0.03 + 0.0 * t]) + noise[:, 3:6]
    quaternions = Rotation.from_euler("ZYX", np.column_stack([yaw, noise[:, 6], 0.0 * yaw])).as_quat()
    return {"t": t, "object": objects, "hand": places, "xyzw": quaternions, "yaw": yaw}


TAKE = take()
TURN = Rotation.from_quat(TAKE["xyzw"])
STILL = np.tile([0.0, 0.0, 0.0, 1.0], (N, 1))
WXYZ = np.roll(TAKE["xyzw"], 1, axis=1)
ONES, ZEROS = np.ones(N), np.zeros(N)


def csv(columns: Mapping[str, np.ndarray], *, header: bool = True) -> str:
    lines = [",".join(columns)] if header else []
    rows = np.column_stack(list(columns.values()))
    return "\n".join([*lines, *(",".join(f"{v:.12g}" for v in row) for row in rows)]) + "\n"


def named(prefix: str, axes: tuple[str, ...], values: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{prefix}{axis}": column for axis, column in zip(axes, values.T, strict=True)}


def guessed(path: Path) -> dict[str, Any]:
    return dict(yaml.safe_load(guess_map(path).text))


def assert_poses(
    chart: dict[str, Any], objects: list[str], hands: list[str], turns: list[str] | None, kind: str
) -> None:
    assert chart["object"]["position"]["columns"] == objects
    assert chart["hand"]["position"]["columns"] == hands
    if turns is None:
        assert chart["object"]["rotation"] == "none"
    else:
        assert chart["object"]["rotation"]["columns"] == turns
        assert chart["object"]["rotation"]["as"] == kind


QS = ("qx", "qy", "qz", "qw")
OBJECT, HAND = TAKE["object"], TAKE["hand"]
TIP = np.column_stack([HAND, np.tile([0.0, 3.1416, 0.0], (N, 1))])
ROTVEC = TURN.as_rotvec()
SIX = tuple(map(str, range(6)))


def by_columns() -> np.ndarray:
    """Franka's sixteen numbers of a transform, column by column."""
    matrix = np.tile(np.eye(4), (N, 1, 1))
    matrix[:, :3, :3], matrix[:, :3, 3] = np.diag([1.0, -1.0, -1.0]), HAND
    return matrix.transpose(0, 2, 1).reshape(N, 16)


LAYOUTS = {
    "robot": (
        {
            "timestamp": TAKE["t"],
            **named("target_q_", SIX, np.ones((N, 6))),
            **named("target_TCP_pose_", SIX, TIP + 0.001),
            **named("target_TCP_speed_", SIX, np.ones((N, 6))),
            **named("actual_q_", SIX, np.ones((N, 6))),
            **named("actual_TCP_pose_", SIX, TIP),
            **named("actual_TCP_force_", SIX, np.ones((N, 6))),
            **named("object_", (*XYZ, "rx", "ry", "rz"), np.hstack([OBJECT, ROTVEC])),
        },
        [f"object_{a}" for a in XYZ],
        [f"actual_TCP_pose_{k}" for k in range(3)],
        [f"object_r{a}" for a in XYZ],
        "rotation_vector",
    ),
    "letters": (
        {"t": TAKE["t"], **named("p_ee_", SIX[:3], HAND), **named("q_ee_", SIX[:4], STILL),
         **named("p_obj_", SIX[:3], OBJECT), **named("q_obj_", SIX[:4], TAKE["xyzw"])},
        [f"p_obj_{k}" for k in range(3)], [f"p_ee_{k}" for k in range(3)], [f"q_obj_{k}" for k in range(4)], "xyzw",
    ),
    "franka": (
        {"time": TAKE["t"], **named("q[", tuple(f"{k}]" for k in range(7)), np.ones((N, 7)) * 0.1),
         **named("O_T_EE[", tuple(f"{k}]" for k in range(16)), by_columns()),
         **named("O_T_EE_d[", tuple(f"{k}]" for k in range(16)), by_columns()),
         **named("obj_", (*XYZ, *QS), np.hstack([OBJECT, TAKE["xyzw"]]))},
        [f"obj_{a}" for a in XYZ], [f"O_T_EE[{k}]" for k in (12, 13, 14)], [f"obj_{q}" for q in QS], "xyzw",
    ),
    "kuka": (
        {"Zeit [ms]": 1e3 * TAKE["t"],
         **named("", tuple(f"{a}_ACT [mm]" for a in "XYZ"), 1e3 * HAND),
         **named("", tuple(f"{a}_ACT [deg]" for a in "ABC"), np.tile([0.0, 0.0, 180.0], (N, 1))),
         **named("OBJ_", ("X", "Y", "Z"), 1e3 * OBJECT),
         **named("OBJ_", ("A", "B", "C"), TURN.as_euler("ZYX", degrees=True))},
        ["OBJ_X", "OBJ_Y", "OBJ_Z"], [f"{a}_ACT [mm]" for a in "XYZ"], ["OBJ_A", "OBJ_B", "OBJ_C"], "euler",
    ),
    "drake": (
        {"sample_times": TAKE["t"],
         **named("eraser_state[", tuple(f"{k}]" for k in range(13)), np.hstack([WXYZ, OBJECT, np.zeros((N, 6))])),
         **named("hand_position[", tuple(f"{k}]" for k in range(3)), HAND)},
        [f"eraser_state[{k}]" for k in (4, 5, 6)], [f"hand_position[{k}]" for k in range(3)],
        [f"eraser_state[{k}]" for k in range(4)], "wxyz",
    ),
    "set points in front of the axes": (
        {"t": TAKE["t"], **named("", tuple(f"{a}_des" for a in XYZ), HAND), **named("", XYZ, HAND),
         **named("obj_", XYZ, OBJECT), "obj_vx": ONES, "obj_vy": ONES},
        [f"obj_{a}" for a in XYZ], list(XYZ), None, "",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LAYOUTS)
def test_measured_poses_are_told_by_their_names(name: str, tmp_path: Path) -> None:
    columns, objects, hands, turns, kind = LAYOUTS[name]
    (tmp_path / "log.csv").write_text(csv(columns))
    guess = guess_map(tmp_path / "log.csv")
    assert_poses(yaml.safe_load(guess.text), objects, hands, turns, kind)
    said = guess.text.split("# not used: ")[-1].splitlines()[0].split(", ") if "# not used" in guess.text else []
    assert all((f'"{column}"' in guess.text) != (column in said) for column in columns)


def test_a_transform_by_columns_is_read_row_by_row(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(csv(LAYOUTS["franka"][0]))
    rotation = guessed(tmp_path / "log.csv")["hand"]["rotation"]
    assert rotation == {"columns": [f"O_T_EE[{i + 4 * j}]" for i in range(3) for j in range(3)], "as": "matrix"}


@pytest.mark.parametrize("first", ["body_1", "body_2"])
def test_what_moves_alone_is_the_hand(first: str, tmp_path: Path) -> None:
    second = {"body_1": "body_2", "body_2": "body_1"}[first]
    bodies = {first: np.hstack([OBJECT, TAKE["xyzw"]]), second: np.hstack([HAND, STILL])}
    columns = {"time": TAKE["t"]}
    for body in sorted(bodies):
        columns |= named(f"{body}/position/", XYZ, bodies[body][:, :3])
        columns |= named(f"{body}/orientation/", (*XYZ, "w"), bodies[body][:, 3:])
    (tmp_path / "log.csv").write_text(csv(columns))
    assert_poses(
        guessed(tmp_path / "log.csv"),
        [f"{first}/position/{a}" for a in XYZ], [f"{second}/position/{a}" for a in XYZ],
        [f"{first}/orientation/{a}" for a in (*XYZ, "w")], "xyzw",
    )  # fmt: skip


def test_what_moves_first_is_the_hand_though_the_object_slides_on(tmp_path: Path) -> None:
    t = 0.01 * np.arange(300)
    hand = np.interp(t, [0.5, 1.0, 1.5], [-0.1, 0.0, 0.1])
    slid = np.interp(t, [1.0, 1.5, 2.9], [0.05, 0.15, 0.3])
    flat = np.zeros((300, 2))
    columns = {"t": t, **named("a_", XYZ, np.column_stack([slid, flat])),
               **named("b_", XYZ, np.column_stack([hand, flat]))}  # fmt: skip
    (tmp_path / "log.csv").write_text(csv(columns))
    chart = guessed(tmp_path / "log.csv")
    assert chart["hand"]["position"]["columns"] == ["b_x", "b_y", "b_z"]


def test_bodies_that_move_alike_are_doubted(tmp_path: Path) -> None:
    apart = OBJECT + np.column_stack([ZEROS, 0.05 * np.sin(TAKE["t"]) + 0.3, ZEROS])
    columns = {"time": TAKE["t"], **named("one_", XYZ, apart), **named("two_", XYZ, apart[:, [1, 0, 2]])}
    (tmp_path / "log.csv").write_text(csv(columns))
    assert "# CHANGE? neither names nor motion tell object and hand apart" in guess_map(tmp_path / "log.csv").text


def test_columns_without_names(tmp_path: Path) -> None:
    """TUM's order: time, place, quaternion, and a second place."""
    table = np.column_stack([BEGIN + TAKE["t"], OBJECT, TAKE["xyzw"], HAND])
    np.savetxt(tmp_path / "log.txt", table, fmt="%.9f")
    table[:, 0] -= BEGIN
    np.save(tmp_path / "log.npy", table)
    for name, column in (("log.txt", "column {}"), ("log.npy", "array[{}]")):
        numbers = [column.format(k + name.endswith("txt")) for k in range(11)]
        text = guess_map(tmp_path / name).text
        chart = yaml.safe_load(text)
        assert_poses(chart, numbers[1:4], numbers[8:], numbers[4:8], "xyzw")
        assert chart["time"] == {"column": numbers[0], "unit": "s"}
        assert "# CHANGE? taken by its numbers alone: the columns have no names" in text


def test_a_transform_in_every_row_without_times(tmp_path: Path) -> None:
    rows = np.concatenate([TURN.as_matrix(), OBJECT[:, :, None]], axis=2).reshape(N, 12)
    np.savetxt(tmp_path / "poses.txt", rows)
    chart = guessed(tmp_path / "poses.txt")
    assert chart["object"]["position"]["columns"] == [f"column {k}" for k in (4, 8, 12)]
    assert chart["time"] == {"rate_hz": 100}


NDI = ["Frame", "State", "Q0", "Qx", "Qy", "Qz", "Tx", "Ty", "Tz"]


def test_names_that_come_again_are_of_the_next_body(tmp_path: Path) -> None:
    rows = np.column_stack(
        [np.arange(N), ZEROS, WXYZ, 1e3 * OBJECT, np.arange(N), ZEROS, np.roll(STILL, 1, 1), 1e3 * HAND]
    )
    text = "\n".join([",".join(NDI * 2), *(",".join(f"{v:.7g}" for v in row) for row in rows)])
    (tmp_path / "log.csv").write_text(text)
    chart = guessed(tmp_path / "log.csv")
    again = [f"T{a} (column {16 + k})" for k, a in enumerate(XYZ)]
    assert_poses(chart, ["Tx", "Ty", "Tz"], again, ["Q0", "Qx", "Qy", "Qz"], "wxyz")
    assert chart["time"]["rate_hz"] == 100


def test_a_name_over_the_first_column_of_each_body(tmp_path: Path) -> None:
    """Qualisys' 6D files."""
    head = ["{} X", "Y", "Z", "Rot[0]", *[f"Rot[{k}]" for k in range(1, 9)]]
    columns = [name.format("eraser") for name in head] + [name.format("tip") for name in head]
    rows = np.hstack(
        [1e3 * OBJECT, TURN.inv().as_matrix().reshape(N, 9), 1e3 * HAND, np.tile(np.eye(3).ravel(), (N, 1))]
    )
    text = "\n".join(["\t".join(columns), *("\t".join(f"{v:.9g}" for v in row) for row in rows)])
    (tmp_path / "log.tsv").write_text(text)
    chart = guessed(tmp_path / "log.tsv")
    assert_poses(
        chart,
        ["eraser X", "Y", "Z"], ["tip X", "Y (column 14)", "Z (column 15)"], [f"Rot[{k}]" for k in range(9)],
        "matrix",
    )  # fmt: skip


def test_torques_and_counters_are_neither_places_nor_times(tmp_path: Path) -> None:
    wrench = np.ones((N, 6)) + np.random.default_rng(1).normal(size=(N, 6))
    columns = {"RDT Sequence": np.arange(N), "F/T Sequence": 14.0 * np.arange(N),
               **named("", ("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"), wrench)}  # fmt: skip
    stamps = [f"10:00:{t:09.6f} AM" for t in TAKE["t"]]
    lines = csv(columns).splitlines()
    (tmp_path / "netft.csv").write_text(
        "\n".join([f"{lines[0]},Time", *(f"{row},{stamp}" for row, stamp in zip(lines[1:], stamps, strict=True))])
    )
    text = guess_map(tmp_path / "netft.csv").text
    assert 'time: {column: "Time", unit: s}' in text and 'force: {columns: ["Fx", "Fy", "Fz"]' in text
    assert "# not used: RDT Sequence, F/T Sequence, Tx, Ty, Tz" in text and '["?", "?", "?"]' in text


def test_each_body_has_the_clock_that_is_called_after_it(tmp_path: Path) -> None:
    columns = {"__time": TAKE["t"]}
    for body, places in (("eraser", OBJECT), ("tip", HAND)):
        columns[f"/vrpn/{body}/pose/header/stamp"] = TAKE["t"] - 0.01
        columns |= named(f"/vrpn/{body}/pose/pose/position/", XYZ, places)
    (tmp_path / "log.csv").write_text(csv(columns))
    chart = guessed(tmp_path / "log.csv")
    for key, body in (("object", "eraser"), ("hand", "tip")):
        assert chart[key]["time"]["column"] == f"/vrpn/{body}/pose/header/stamp"


def test_seconds_and_nanoseconds(tmp_path: Path) -> None:
    ns = np.round(1e9 * (TAKE["t"] + 0.123)).astype(int)
    columns = {"stamp.sec": BEGIN + ns // 10**9, "stamp.nanosec": ns % 10**9, **named("obj.", XYZ, OBJECT)}
    (tmp_path / "log.csv").write_text(csv(columns))
    assert guessed(tmp_path / "log.csv")["time"] == {"columns": ["stamp.sec", "stamp.nanosec"]}


class TestParts:
    """Logs of several tables, and tables of several bodies."""

    def test_rows_of_bodies_in_turn(self, tmp_path: Path) -> None:
        """Markers of a camera, each in a row of its own: rotation vectors and translations."""
        seen = {3: np.hstack([ROTVEC, OBJECT]), 7: np.hstack([0.0 * ROTVEC, HAND])}
        lines = ["t_ns,frame_idx,marker_id,rvec_x,rvec_y,rvec_z,tvec_x,tvec_y,tvec_z"]
        for k, t in enumerate(TAKE["t"]):
            for marker, values in seen.items():
                lines.append(f"{int(1e9 * (BEGIN + t))},{k},{marker}," + ",".join(f"{v:.9g}" for v in values[k]))
        (tmp_path / "log.csv").write_text("\n".join(lines))
        chart = guessed(tmp_path / "log.csv")
        for key, marker in (("object", 3), ("hand", 7)):
            stream = chart[key]
            assert stream["where"] == {"marker_id": marker}
            assert stream["position"]["columns"] == ["tvec_x", "tvec_y", "tvec_z"]
            assert stream["rotation"]["as"] == "rotation_vector"
        assert chart["time"] == {"column": "t_ns", "unit": "ns"}

    def test_sections_of_a_text(self, tmp_path: Path) -> None:
        frames = {"Frame": np.arange(N)}
        tables = [csv(frames | named("obj ", XYZ, OBJECT)), csv(frames | named("tip ", XYZ, HAND))]
        (tmp_path / "log.csv").write_text("\n".join(f"Devices {k}\n100\n{table}" for k, table in enumerate(tables)))
        chart = guessed(tmp_path / "log.csv")
        assert "section" not in chart["object"]
        assert chart["hand"]["section"] == 2

    def test_a_section_that_no_role_needs_is_named(self, tmp_path: Path) -> None:
        frames = {"Frame": np.arange(N)}
        tables = [csv(frames | named("obj ", XYZ, OBJECT)), csv(frames | {"button": ONES})]
        (tmp_path / "log.csv").write_text("\n".join(f"Devices {k}\n100\n{table}" for k, table in enumerate(tables)))
        said = "# not used of section 2: Frame, button ('section: 2' in a stream reads them)"
        assert said in guess_map(tmp_path / "log.csv").text

    def test_sections_of_the_same_columns_are_no_other_bodies(self, tmp_path: Path) -> None:
        table = csv({"t": TAKE["t"], **named("x_", XYZ, OBJECT)})
        (tmp_path / "log.csv").write_text("\n".join(f"Trial {k}\n{table}" for k in range(2)))
        text = guess_map(tmp_path / "log.csv").text
        assert "hand:" not in text and "# not used of section 2: t, x_x" in text

    def write(self, folder: Path, name: str, places: np.ndarray, turns: np.ndarray, begin: float) -> None:
        head = "# timestamp tx ty tz qx qy qz qw"
        table = np.column_stack([begin + TAKE["t"], places, turns])
        np.savetxt(folder / name, table, fmt="%.9f", header=head[2:])

    def test_a_file_of_each_body(self, tmp_path: Path) -> None:
        """TUM's: the same columns, by one clock that did not begin with them."""
        self.write(tmp_path, "alpha.txt", HAND, STILL, BEGIN)
        self.write(tmp_path, "beta.txt", OBJECT, TAKE["xyzw"], BEGIN)
        chart = guessed(tmp_path)
        assert chart["object"]["file"] == "beta.txt" and chart["hand"]["file"] == "alpha.txt"
        assert chart["pushes"] == {"cut": "rest"} and "time" not in chart["hand"]

    def test_clocks_that_have_no_time_in_common(self, tmp_path: Path) -> None:
        self.write(tmp_path, "mug.txt", OBJECT, TAKE["xyzw"], BEGIN)
        (tmp_path / "robot.csv").write_text(csv({"timestamp": TAKE["t"] + 812.0, **named("tool_", XYZ, HAND)}))
        text = guess_map(tmp_path).text
        assert 'time: {column: "timestamp", unit: s, offset_s: 0.0}   # CHANGE: at no time of the object\'s' in text

    def test_files_of_each_body_and_push(self, tmp_path: Path) -> None:
        for k in range(3):
            self.write(tmp_path, f"push_{k}_tip.txt", HAND, STILL, 0.0)
            self.write(tmp_path, f"push_{k}_mug.txt", OBJECT, TAKE["xyzw"], 0.0)
        (tmp_path / "a_note.csv").write_text("t,temperature\n0,21\n1,21\n2,22\n")
        chart = guessed(tmp_path)
        assert chart["object"]["file"] == "push_*_mug.txt" and chart["hand"]["file"] == "push_*_tip.txt"
        assert chart["pushes"] == {"cut": "whole"}

    def test_other_columns_and_another_clock(self, tmp_path: Path) -> None:
        self.write(tmp_path, "tracker.txt", OBJECT, TAKE["xyzw"], 0.0)
        robot = {"Time [ms]": 1e3 * TAKE["t"], **named("tool_", XYZ, HAND), **named("f", XYZ, HAND)}
        (tmp_path / "robot.csv").write_text(csv(robot))
        text = guess_map(tmp_path).text
        chart = yaml.safe_load(text)
        assert chart["hand"]["file"] == "robot.csv"
        assert chart["hand"]["time"] == {"column": "Time [ms]", "unit": "ms"}
        assert chart["force"]["file"] == "robot.csv" and chart["force"]["columns"] == ["fx", "fy", "fz"]

    def test_one_push_in_each_file_stays_so(self, tmp_path: Path) -> None:
        for name in ("a.txt", "b.txt"):
            self.write(tmp_path, name, OBJECT, TAKE["xyzw"], 0.0)
        chart = guessed(tmp_path)
        assert "file" not in chart["object"] and chart["pushes"] == {"cut": "whole"}


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_log_of_json_is_converted_by_its_guess(tmp_path: Path) -> None:
    records = [
        {"t": t, "object": {"position": p, "quaternion": q}, "hand": {"position": h}}
        for t, p, q, h in zip(*(TAKE[key].tolist() for key in ("t", "object", "xyzw", "hand")), strict=True)
    ]
    (tmp_path / "log.jsonl").write_text("\n".join(map(json.dumps, records)))
    (tmp_path / "map.yaml").write_text(guess_map(tmp_path / "log.jsonl").text)
    found = convert_table(tmp_path / "log.jsonl", tmp_path / "out", tmp_path / "map.yaml")
    assert len(found.pushes) == 3 and found.pushes[0].object.rotation == "full"


def test_zarr_is_refused_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / ".zgroup").write_text("{}")
    with pytest.raises(ValueError, match="holds zarr, which is not read; save its arrays as npz"):
        guess_map(tmp_path)
