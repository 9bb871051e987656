"""First maps of logs in more layouts: units in words, quaternions of any name, arrays, what never moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from test_convert_guess import (
    HAND,
    OBJECT,
    STILL,
    TAKE,
    TURN,
    WXYZ,
    XYZ,
    N,
    assert_poses,
    by_columns,
    csv,
    guessed,
    named,
)

from physid_drake.convert import convert_table, guess_map


class TestUnits:
    """Words for units are their symbols."""

    def test_words_in_brackets(self, tmp_path: Path) -> None:
        columns = {
            "time [sec]": TAKE["t"], **named("obj_", tuple(f"{a} [Meters]" for a in XYZ), OBJECT),
            "obj_yaw [degrees]": np.degrees(TAKE["yaw"]),
            **named("tip_", tuple(f"{a} (millimetres)" for a in XYZ), 1e3 * HAND),
        }  # fmt: skip
        (tmp_path / "log.csv").write_text(csv(columns))
        chart = guessed(tmp_path / "log.csv")
        assert chart["object"]["position"]["unit"] == "m" and chart["hand"]["position"]["unit"] == "mm"
        assert chart["object"]["rotation"] == {"columns": ["obj_yaw [degrees]"], "as": "yaw", "unit": "deg"}

    def test_a_wrong_unit_is_refused(self, tmp_path: Path) -> None:
        columns = {"t": TAKE["t"], **named("obj_", tuple(f"{a} [meters]" for a in XYZ), OBJECT)}
        (tmp_path / "log.csv").write_text(csv(columns))
        text = guess_map(tmp_path / "log.csv").text
        assert "unit: m}" in text
        (tmp_path / "map.yaml").write_text(text.replace("unit: m}", "unit: mm}"))
        with pytest.raises(ValueError, match="the map says mm, but the table's header says m"):
            convert_table(tmp_path / "log.csv", tmp_path / "out", tmp_path / "map.yaml")


@pytest.mark.parametrize(
    ("names", "turns", "kind"),
    [
        (("rx", "ry", "rz", "rw"), TAKE["xyzw"], "xyzw"),
        (("obj_a", "obj_b", "obj_c", "obj_d"), TAKE["xyzw"], "xyzw"),
        (("obj_q1", "obj_q2", "obj_q3", "obj_q4"), WXYZ, "wxyz"),
        (("objRotationX", "objRotationY", "objRotationZ", "objRotationW"), TAKE["xyzw"], "xyzw"),
    ],
)
def test_four_columns_of_norm_one_are_a_quaternion(
    names: tuple[str, ...], turns: np.ndarray, kind: str, tmp_path: Path
) -> None:
    place = "" if names[0] == "rx" else "obj_" if "_" in names[0] else "objTranslation"
    axes = ("tx", "ty", "tz") if not place else XYZ if place == "obj_" else ("X", "Y", "Z")
    columns = {"t": TAKE["t"], **named(place, axes, OBJECT), **named("", names, turns), **named("tip_", XYZ, HAND)}
    (tmp_path / "log.csv").write_text(csv(columns))
    chart = guessed(tmp_path / "log.csv")
    assert_poses(chart, [f"{place}{a}" for a in axes], [f"tip_{a}" for a in XYZ], list(names), kind)


@pytest.mark.parametrize("summary", ["push,surface,operator\n1,oak,AB\n2,oak,AB\n", "push,speed\n1,50\n2,50\n3,50\n"])
def test_files_of_another_kind_beside_those_of_the_pushes(summary: str, tmp_path: Path) -> None:
    columns = {"t": TAKE["t"], **named("obj_", XYZ, OBJECT), **named("tip_", XYZ, HAND)}
    for k in range(3):
        (tmp_path / f"push_{k:02d}.csv").write_text(csv(columns))
    assert "file" not in guessed(tmp_path)["object"]
    (tmp_path / "a_summary.csv").write_text(summary)
    chart = guessed(tmp_path)
    assert chart["object"]["file"] == chart["hand"]["file"] == "push_*.csv"
    assert chart["pushes"] == {"cut": "whole"}


def test_bodies_that_are_told_apart_by_words(tmp_path: Path) -> None:
    lines = ["time,x,y,z,role,valid"]
    for k, t in enumerate(TAKE["t"]):
        for role, places in (("alpha", OBJECT), ("beta", HAND)):
            lines.append(
                f"{t:.2f}," + ",".join(f"{v:.9g}" for v in places[k]) + f",{role},{'yes' if k % 50 else 'no'}"
            )
    (tmp_path / "log.csv").write_text("\n".join(lines))
    text = guess_map(tmp_path / "log.csv").text
    chart = yaml.safe_load(text)
    assert chart["object"]["where"] == {"role": "alpha"} and chart["hand"]["where"] == {"role": "beta"}
    assert "# not used of role alpha: valid" in text


@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_what_never_moves_has_no_role(scale: float, tmp_path: Path) -> None:
    """The ground, or a table, which is tracked as well."""
    still = np.tile([0.3, 0.0, 0.2], (N, 1)) + 1e-4 * np.random.default_rng(2).normal(size=(N, 3))
    columns = {"t": TAKE["t"]}
    for body, places in (("ground_plane", still), ("eraser", OBJECT), ("stick", HAND)):
        columns |= named(f"{body}.position.", XYZ, scale * places)
        columns |= named(f"{body}.orientation.", (*XYZ, "w"), TAKE["xyzw"] if body == "eraser" else STILL)
    (tmp_path / "log.csv").write_text(csv(columns))
    chart = guessed(tmp_path / "log.csv")
    assert chart["object"]["position"]["columns"][0] == "eraser.position.x"
    assert chart["hand"]["position"]["columns"][0] == "stick.position.x"


class TestArrays:
    """Columns of one quantity are of one array."""

    def test_arrays_of_several_bodies_and_of_a_state(self, tmp_path: Path) -> None:
        """MuJoCo's: places of sites, rotations of bodies, and a state that holds a pose."""
        lifted = HAND + np.outer(0.1 * (HAND[:, 0] < -0.1), [0.0, 0.0, 1.0])
        sites = np.stack([lifted, lifted + np.array([0.0, 0.0, 0.1]), np.tile([0.5, 0.5, 0.0], (N, 1))], axis=1)
        states = np.hstack([lifted - 0.01, OBJECT, WXYZ])
        arrays = {"time": TAKE["t"], "qpos": states, "site_xpos": sites, "xmat": TURN.as_matrix()}
        np.savez(tmp_path / "log.npz", **arrays)
        assert_poses(
            guessed(tmp_path / "log.npz"),
            [f"qpos[{k}]" for k in (3, 4, 5)], [f"site_xpos[0,{k}]" for k in range(3)],
            [f"qpos[{k}]" for k in range(6, 10)], "wxyz",
        )  # fmt: skip

    def test_a_transform_is_not_cut_into_quaternions(self, tmp_path: Path) -> None:
        """Franka's, as rostopic writes it."""
        columns = {"t": TAKE["t"], **named("O_T_EE", tuple(map(str, range(16))), by_columns())}
        (tmp_path / "log.csv").write_text(csv(columns))
        assert guessed(tmp_path / "log.csv")["hand"]["position"]["columns"] == [f"O_T_EE{k}" for k in (12, 13, 14)]

    def test_arrays_that_count_from_one(self, tmp_path: Path) -> None:
        one, four = ("1", "2", "3"), ("1", "2", "3", "4")
        columns = {"t": TAKE["t"], **named("objPos_", one, OBJECT), **named("objQuat_", four, WXYZ),
                   **named("tip_", one, HAND)}  # fmt: skip
        (tmp_path / "log.csv").write_text(csv(columns))
        chart = guessed(tmp_path / "log.csv")
        assert_poses(
            chart, [f"objPos_{k}" for k in one], [f"tip_{k}" for k in one], [f"objQuat_{k}" for k in four], "wxyz"
        )
