"""Tables of others become recordings: the way there and back, and what is refused in one line."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import foreign
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from physid_drake import cli
from physid_drake.convert import convert_table, guess_map
from physid_drake.convert.conventions import forces_in_world, places_in_world, rotation_of, rotations_in_world
from physid_drake.convert.map_reading import read_map
from physid_drake.convert.mapping import ForceMap, Offset, Turn, World
from physid_drake.convert.text_table import read_text_table
from physid_drake.errors import RecordingError
from physid_drake.recording import Recording, read_recording

SEALED = Path(__file__).parents[2] / "recordings" / "sealed_01"
HEAD = foreign.DESCRIPTION.format(name="mug")
TABLE = "t,x,y,yaw,hx,hy\n" + "".join(
    f"{0.01 * k:.2f},{0.001 * k:.3f},0,0,{0.001 * k - 0.05:.3f},0\n" for k in range(9)
)
MAP = (
    HEAD
    + foreign.HAND
    + """\
time: {column: t}
object: {position: {columns: [x, y]}, rotation: {columns: yaw, as: yaw, unit: rad}, height_m: 0.023}
hand: {position: {columns: [hx, hy]}, rotation: none, height_m: 0.023}
"""
)


@pytest.fixture(scope="module")
def sealed() -> Recording:
    return read_recording(SEALED)


def converted(recording: Recording, writer: Callable[[Recording, Path], str], name: str, folder: Path) -> Recording:
    chart = folder / "map.yaml"
    chart.write_text(writer(recording, folder / name), encoding="utf-8")
    return convert_table(folder / name, folder / "recording", chart)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize("name", foreign.TABLES)
def test_foreign_layouts_come_back_as_they_were(name: str, sealed: Recording, tmp_path: Path) -> None:
    log = foreign.TABLES[name]
    pytest.importorskip(log.needs)
    found = converted(sealed, log.write, name, tmp_path)
    assert len(found.pushes) == len(sealed.pushes)
    for push, other in zip(sealed.pushes, found.pushes, strict=True):
        assert push.hand is not None and other.hand is not None
        if log.exact:
            assert np.abs(push.object.planar - other.object.planar).max() < 2e-5
            hand = [
                np.interp(other.hand.times, push.hand.times - push.object.times[0], c) for c in push.hand.positions.T
            ]
            assert np.abs(np.column_stack(hand) - other.hand.positions)[3:-3].max() < 5e-4
        else:  # resampled, with noise, and cut out of one take by the object's rests
            foreign.assert_rests_agree(push.object, other.object)
            assert np.abs(np.median(other.object.positions[:, 2]) - 0.02295) < 3e-3
    assert found.conversion is not None and found.conversion.source == name
    assert found.conversion.map == (tmp_path / "map.yaml").read_text(encoding="utf-8")
    assert found.pushes[0].object.rotation == log.rotation


def test_the_hand_of_padded_arrays_is_seen_where_it_is_filled(sealed: Recording, tmp_path: Path) -> None:
    found = converted(sealed, foreign.padded_npz, "padded.npz", tmp_path)
    for push, other in zip(sealed.pushes, found.pushes, strict=True):
        assert other.hand is not None and len(other.hand) == len(push.object) - len(range(3, len(push.object), 7))
        assert other.force is not None and other.force.forces[0] == pytest.approx([1.0, -2.0, -0.5])


def test_an_object_that_is_carried_back_is_left_out_and_said_once(sealed: Recording, tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"and 9 more like it, lifts the object; left out\.") as said:
        found = converted(sealed, foreign.motive, "take.csv", tmp_path)
    assert len(said) == 1 and len(found.pushes) == 11


def test_a_unit_that_is_wrong_shows_in_how_far_things_go(sealed: Recording, tmp_path: Path) -> None:
    chart = foreign.qualisys(sealed, tmp_path / "log.tsv")
    (tmp_path / "map.yaml").write_text(chart.replace("mug Z], unit: mm", "mug Z], unit: m"))
    with (
        pytest.warns(UserWarning, match=r"the object goes over 237, \d+, 104 m and the hand goes over 0\.25"),
        pytest.raises(RecordingError, match="no push was found"),
    ):
        convert_table(tmp_path / "log.tsv", tmp_path / "out", tmp_path / "map.yaml")


def test_written_in_the_recording_and_read_back(sealed: Recording, tmp_path: Path) -> None:
    found = converted(sealed, foreign.lerobot, "data.parquet", tmp_path) if _has("pyarrow") else None
    if found is None:
        pytest.skip("needs pyarrow")
    header = (tmp_path / "recording/pushes/001.csv").read_text().splitlines()[0]
    assert header.endswith("object_x_m,object_y_m,object_z_m,object_yaw_rad") and "hand_qw" not in header


def test_rows_by_ruler_are_pushes_of_which_the_ends_are_known(sealed: Recording, tmp_path: Path) -> None:
    found = converted(sealed, foreign.rulers, "rows.csv", tmp_path)
    assert len(found.pushes) == len(sealed.pushes)
    for push, other in zip(sealed.pushes, found.pushes, strict=True):
        assert other.endpoint_only and other.object.rotation == "yaw" and push.hand is not None
        assert np.abs(other.object.planar[:, :2] - push.object.planar[[0, -1], :2]).max() < 1e-5
        assert other.hand is not None and other.hand.positions[-1, :2] == pytest.approx(
            push.hand.positions[-1, :2], abs=1e-5
        )
        steps = np.linalg.norm(np.diff(other.hand.positions, axis=0), axis=1)
        moving = steps[1:-1] / np.diff(other.hand.times)[1:-1]
        assert np.ptp(moving) < 1e-3 * moving.max()


def test_a_video_without_rotation_on_a_clock_of_its_own(sealed: Recording, tmp_path: Path) -> None:
    found = converted(sealed, foreign.video, "tracks", tmp_path)
    for push, other in zip(sealed.pushes, found.pushes, strict=True):
        assert other.object.rotation == "none" and other.hand is not None and push.hand is not None
        late = other.hand.times[0] - other.object.times[0]
        assert late == pytest.approx(push.hand.times[0] - push.object.times[0], abs=1e-5)
        assert np.abs(other.object.positions[0, :2] - push.object.positions[0, :2]).max() < 1e-6


def _has(module: str) -> bool:
    try:
        __import__(module)
    except ImportError:
        return False
    return True


class TestText:
    def read(self, text: str | bytes, folder: Path, **dialect: object) -> dict[str, list[float]]:
        from physid_drake.convert.text_table import Dialect

        file = folder / "table.csv"
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        columns = read_text_table(file, Dialect(**dialect))  # type: ignore[arg-type]
        return {name: values.tolist() for name, values in columns.numbers.items()}

    @pytest.mark.parametrize("separator", [",", ";", "\t", "|", " "])
    def test_any_separator(self, separator: str, tmp_path: Path) -> None:
        text = "\n".join(
            separator.join(row) for row in (["a", "b", "c"], *[[str(k), "2.5", "-1e-3"] for k in range(5)])
        )
        assert self.read(text, tmp_path) == {"a": [0.0, 1.0, 2.0, 3.0, 4.0], "b": [2.5] * 5, "c": [-1e-3] * 5}

    @pytest.mark.parametrize("separator", [";", "\t"])
    def test_decimal_comma(self, separator: str, tmp_path: Path) -> None:
        text = "\n".join(separator.join(row) for row in (["a", "b"], *[["1.234,5", f"{k},25"] for k in range(5)]))
        assert self.read(text, tmp_path) == {"a": [1234.5] * 5, "b": [k + 0.25 for k in range(5)]}

    @pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
    def test_encodings(self, encoding: str, tmp_path: Path) -> None:
        text = "Höhe,b\n1,2\n1,2\n1,2\n".encode(encoding)
        assert self.read(text, tmp_path) == {"Höhe": [1.0] * 3, "b": [2.0] * 3}

    def test_no_header(self, tmp_path: Path) -> None:
        assert self.read("1,2\n3,4\n5,6\n", tmp_path) == {"column 1": [1.0, 3.0, 5.0], "column 2": [2.0, 4.0, 6.0]}

    def test_gaps_are_kept_and_text_is_no_number(self, tmp_path: Path) -> None:
        found = self.read("t,x,who\n0,1,a\n1,,b\n2,NaN,c\n3,4,d\n", tmp_path)
        assert found["t"] == [0.0, 1.0, 2.0, 3.0] and "who" not in found
        assert np.isnan(found["x"][1:3]).all()

    def test_several_tables_in_one_file(self, tmp_path: Path) -> None:
        text = "Objects\n100\nFrame,X\n,mm\n1,2\n2,3\n3,4\n\nTrajectories\n100\nFrame,Y\n,mm\n1,5\n2,6\n3,7\n"
        assert self.read(text, tmp_path)["X"] == [2.0, 3.0, 4.0]
        assert self.read(text, tmp_path, section=2)["Y"] == [5.0, 6.0, 7.0]

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            ("", "no table of numbers was found"),
            ("a,b\nx,y\nz,w\n", "no table of numbers was found"),
            (b"PK\x03\x04\0\0\0\0", "it is no text"),
            ("a,b\n1,2\n3,4\n5,bad\n6,7\n", "column 'b': must be a finite number, but got 'bad'"),
            ("a,b\n1,2\n3,inf\n5,6\n7,8\n", "column 'b': must be a finite number, but got 'inf'"),
            ("a,b\n1,2\n3,4,9\n5,6\n7,8\n", "has more fields than the table has columns"),
        ],
    )
    def test_what_is_refused(self, text: str | bytes, said: str, tmp_path: Path) -> None:
        with pytest.raises(RecordingError, match=said):
            self.read(text, tmp_path)


class TestConventions:
    def test_axes_of_a_left_handed_world_mirror_turns(self) -> None:
        world = World(axes=foreign.LEFT_HANDED)
        quarter = rotation_of(Turn(kind="yaw"), np.array([[0.5 * np.pi]]), 1.0, world)
        turned = rotations_in_world(quarter, world).as_rotvec()[0]
        assert turned == pytest.approx([0.0, 0.0, -0.5 * np.pi])
        # x to z, its up is y: by the left hand a quarter turn about y takes z to x.
        assert quarter.apply([0.0, 0.0, 1.0])[0] == pytest.approx([1.0, 0.0, 0.0])
        assert places_in_world(np.array([[1.0, 2.0, 3.0]]), world)[0] == pytest.approx([1.0, 3.0, 2.0])

    @pytest.mark.parametrize(
        ("force", "felt", "on_object"),
        [
            (ForceMap(), [1.0, 2.0, 3.0], [1.0, 2.0, 3.0]),
            (ForceMap(on_hand=True), [1.0, 2.0, 3.0], [-1.0, -2.0, -3.0]),
            (ForceMap(on_hand=True, weight=4.0), [0.0, 0.0, -4.0], [0.0, 0.0, 0.0]),
            (ForceMap(weight=4.0), [0.0, 0.0, 4.0], [0.0, 0.0, 0.0]),
            (
                ForceMap(offset=Offset(rotation=(np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))),
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 0.0],
            ),
        ],
    )
    def test_forces(self, force: ForceMap, felt: list[float], on_object: list[float]) -> None:
        assert forces_in_world(np.array([felt]), force, None, World())[0] == pytest.approx(on_object, abs=1e-12)

    def test_a_cameras_pose(self, tmp_path: Path) -> None:
        """p_W = R p_S + t, R_W = R R_S."""
        turn = Rotation.from_euler("ZYX", [0.3, -0.2, 2.9])
        w, x, y, z = np.roll(turn.as_quat(), 1).tolist()
        pose = f"world: {{pose: {{translation: [10, 20, 110], unit: cm, rotation_wxyz: [{w}, {x}, {y}, {z}]}}}}"
        (tmp_path / "map.yaml").write_text(f"{MAP}{pose}\n")
        world = read_map(tmp_path / "map.yaml").world
        point = np.array([[0.3, -0.1, 0.9]])
        assert places_in_world(point, world) == pytest.approx(turn.apply(point) + np.array([0.1, 0.2, 1.1]))
        body = Rotation.from_euler("z", 0.5)
        assert (rotations_in_world(body, world) * (turn * body).inv()).magnitude() < 1e-9

    def test_an_inverse_rotation_is_turned_back(self) -> None:
        values = np.array([[np.cos(0.3), 0.0, 0.0, np.sin(0.3)]])
        there = rotation_of(Turn(), values, 1.0, World())
        back = rotation_of(Turn(inverse=True), values, 1.0, World())
        assert (there * back).magnitude() == pytest.approx([0.0], abs=1e-12)


class TestRefusals:
    def convert(self, folder: Path, chart: str = MAP, table: str = TABLE) -> Recording:
        (folder / "log.csv").write_text(table)
        (folder / "map.yaml").write_text(chart)
        return convert_table(folder / "log.csv", folder / "out", folder / "map.yaml")

    def test_the_plain_case_is_none(self, tmp_path: Path) -> None:
        found = self.convert(tmp_path)
        assert len(found.pushes) == 1 and len(found.pushes[0].object) == 9

    @pytest.mark.parametrize(
        ("old", "new", "said"),
        [
            ("columns: [x, y]", "columns: [X, y]", "object: log.csv has no column 'X'; did you mean"),
            ("columns: [x, y]", "columns: [x]", "must be the names of 2 or 3 column"),
            ("column: t", "column: T0", "has no column 'T0'"),
            ("as: yaw, unit: rad", "as: yaw", "angles need a unit, rad or deg"),
            ("as: yaw, unit: rad", "as: yaw, unit: grad", "must be in one of rad, deg, mrad, but is in 'grad'"),
            ("as: yaw, unit: rad", "as: quat", "must be one of wxyz, xyzw, euler, rotation_vector, matrix, yaw"),
            ("format: physid-map/1", "format: physid-map/9", "unknown format 'physid-map/9'"),
            ("time: {column: t}", "tiem: {column: t}", "unknown key; the keys here are format, recording"),
            ("time: {column: t}", "world: {axes: [x, z, y]}\ntime: {column: t}", "these make a mirror image"),
            ("time: {column: t}", "world: {axes: [x, x, y]}\ntime: {column: t}", "must be three of x, y, z"),
            ("time: {column: t}", "pushes: {cut: rest}\ntime: {column: t}", "is not seen to rest twice for 0.5 s"),
            ("time: {column: t}", "pushes: {cut: gap, column: t}\ntime: {column: t}", "is of cut: column"),
            ("time: {column: t}", "pushes: {cut: times, times_s: [[5, 6]]}\ntime: {column: t}", "no push was found"),
            ("time: {column: t}", "force: {columns: [hx, hy], tare_s: 9}\ntime: {column: t}", "is longer than the"),
            ("hand: {position", "hand: {offset: {translation: [1, 0, 0]}, position", "its rotation was not measured"),
            ("yaw, as: yaw, unit: rad", "[x, y, yaw], as: euler, unit: rad", "order: is required"),
            ("time: {column: t}", "world: {pose: {translation: [0, 0, 1]}, axes: [x, y, z]}", "stands beside pose"),
            ("  hand: {tip", "  Hand: {tip", "unknown key; the keys here are name"),
            ("time: {column: t}", "pushes: {cut: rows}\ntime: {column: t}", "object: needs start and end"),
            ("time: {column: t}", "", "there are no times; name their column"),
            ("columns: [x, y]", "columns: [x, y], unit: furlong", "it must be in one of m, mm"),
        ],
    )  # fmt: skip
    @pytest.mark.filterwarnings("ignore::UserWarning")
    def test_maps(self, old: str, new: str, said: str, tmp_path: Path) -> None:
        assert old in MAP
        with pytest.raises(RecordingError, match=said) as caught:
            self.convert(tmp_path, MAP.replace(old, new))
        assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()

    def test_a_clock_that_begins_anew(self, tmp_path: Path) -> None:
        twice = TABLE + TABLE.split("\n", 1)[1]
        with pytest.raises(RecordingError, match=r"from 0\.08 to 0 s; if it begins anew with every push"):
            self.convert(tmp_path, table=twice)

    def test_what_the_reader_refuses_leaves_nothing(self, tmp_path: Path) -> None:
        far = MAP.replace("columns: [x, y]", "columns: [x, y], unit: m").replace("column: t}", "column: t, unit: ns}")
        with pytest.raises(RecordingError, match=r"what the map makes of 'log.csv' is refused: pushes/001.csv: "):
            self.convert(tmp_path, far)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["log.csv", "map.yaml"]

    def test_units_in_the_header_are_held_against_the_map(self, tmp_path: Path) -> None:
        table = TABLE.replace("hx,hy\n", "hx,hy\ns,mm,mm,rad,mm,mm\n")
        with pytest.raises(RecordingError, match="the map says m, but the table's header says mm"):
            self.convert(tmp_path, MAP.replace("columns: [x, y]", "columns: [x, y], unit: m"), table)
        with pytest.raises(RecordingError, match="the map says ms, but times in column 't' are in s"):
            self.convert(tmp_path, MAP.replace("column: t}", "column: t, unit: ms}"), table)
        found = self.convert(tmp_path, MAP, table)
        assert found.pushes[0].object.positions[-1, 0] == pytest.approx(8e-6)

    def test_units_in_brackets_are_held_against_the_map(self, tmp_path: Path) -> None:
        table = TABLE.replace("t,x,y,yaw,hx,hy", "t,x [mm],y [mm],yaw [rad],hx,hy")
        chart = MAP.replace("columns: [x, y]", "columns: ['x [mm]', 'y [mm]']")
        chart = chart.replace("columns: yaw", "columns: ['yaw [rad]']")
        with pytest.raises(RecordingError, match="the map says inch, but the table's header says mm"):
            self.convert(tmp_path, chart.replace("'y [mm]']", "'y [mm]'], unit: inch"), table)
        with pytest.raises(RecordingError, match="the map says deg, but the table's header says rad"):
            self.convert(tmp_path, chart.replace("unit: rad", "unit: deg"), table)
        found = self.convert(tmp_path, chart, table)
        assert found.pushes[0].object.positions[-1, 0] == pytest.approx(8e-6)

    def test_a_unit_of_time_in_brackets_is_that_of_the_times(self, tmp_path: Path) -> None:
        _, *rows = TABLE.splitlines()
        table = "t [ms],x,y,yaw,hx,hy\n" + "".join(f"{10 * k},{row.split(',', 1)[1]}\n" for k, row in enumerate(rows))
        chart = MAP.replace("column: t}", "column: 't [ms]'}")
        with pytest.raises(RecordingError, match=r"the map says us, but times in column 't \[ms\]' are in ms"):
            self.convert(tmp_path, chart.replace("'t [ms]'}", "'t [ms]', unit: us}"), table)
        assert self.convert(tmp_path, chart, table).pushes[0].object.times[-1] == pytest.approx(0.08)

    def test_motives_preamble_states_the_unit(self, tmp_path: Path) -> None:
        table = "Format Version,1.23,Length Units,Millimeters\n\n" + TABLE
        with pytest.raises(RecordingError, match="the map says m, but the table's header says mm"):
            self.convert(tmp_path, MAP.replace("columns: [x, y]", "columns: [x, y], unit: m"), table)
        found = self.convert(tmp_path, MAP, table)
        assert found.pushes[0].object.positions[-1, 0] == pytest.approx(8e-6)

    def test_degrees_that_are_called_rad(self, tmp_path: Path) -> None:
        chart = MAP.replace(
            "columns: yaw, as: yaw, unit: rad", "columns: [yaw, y, x], as: euler, order: ZYX, unit: rad"
        )
        table = TABLE.replace(",0,0,", ",0,-170,")
        with pytest.raises(RecordingError, match=r"said to be in rad, but one is 170; are they in deg\?"):
            self.convert(tmp_path, chart, table)

    @pytest.mark.parametrize(
        ("name", "said"), [("nothing.csv", "there is no such file or folder"), ("bag", "convert bag")]
    )
    def test_a_source_that_is_no_table(self, name: str, said: str, tmp_path: Path) -> None:
        (tmp_path / "bag").mkdir()
        (tmp_path / "bag/x.mcap").write_bytes(b"")
        (tmp_path / "map.yaml").write_text(MAP)
        with pytest.raises(RecordingError, match=said):
            convert_table(tmp_path / name, tmp_path / "out", tmp_path / "map.yaml")

    @pytest.mark.parametrize(("name", "package"), [("x.parquet", "pyarrow"), ("x.h5", "h5py")])
    def test_what_reads_it_is_not_installed(
        self, name: str, package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setitem(sys.modules, package, None)
        monkeypatch.setitem(sys.modules, f"{package}.parquet", None)
        (tmp_path / name).write_bytes(b"x")
        (tmp_path / "map.yaml").write_text(MAP)
        with pytest.raises(RecordingError) as caught:
            convert_table(tmp_path / name, tmp_path / "out", tmp_path / "map.yaml")
        assert f"needs {package}, which is not installed" in str(caught.value)
        assert "damaged" not in str(caught.value)

    def test_a_hdf5_link_is_not_followed(self, tmp_path: Path) -> None:
        h5py = pytest.importorskip("h5py")
        with h5py.File(tmp_path / "secret.h5", "w") as other:
            other["x"] = np.arange(5.0)
        with h5py.File(tmp_path / "log.h5", "w") as opened:
            opened["t"] = np.arange(5.0)
            opened["x"] = h5py.ExternalLink("secret.h5", "x")
        (tmp_path / "map.yaml").write_text(MAP)
        with pytest.raises(RecordingError, match="has no column 'x'"):
            convert_table(tmp_path / "log.h5", tmp_path / "out", tmp_path / "map.yaml")


def test_a_hand_in_the_frame_of_its_robot_is_brought_into_that_of_the_tracker(tmp_path: Path) -> None:
    rows = [line.split(",") for line in TABLE.splitlines()[1:]]
    # The robot's base is at (0.6, -0.1, 0.02) in W, turned by 90 degrees: p_robot = R^T (p_W - t).
    moved = [[t, x, y, yaw, f"{1e3 * (float(hy) + 0.1):.3f}", f"{-1e3 * (float(hx) - 0.6):.3f}"]
             for t, x, y, yaw, hx, hy in rows]  # fmt: skip
    (tmp_path / "log.csv").write_text("t,x,y,yaw,hx,hy\n" + "\n".join(map(",".join, moved)), encoding="utf-8")
    chart = MAP.replace(
        "hand: {position: {columns: [hx, hy]}, rotation: none, height_m: 0.023}",
        "hand: {position: {columns: [hx, hy], unit: mm}, rotation: none, height_m: 0.023,"
        " world: {pose: {translation: [600, -100, 20], unit: mm, yaw_deg: 90}}}",
    )
    (tmp_path / "map.yaml").write_text(chart, encoding="utf-8")
    hand = convert_table(tmp_path / "log.csv", tmp_path / "found", tmp_path / "map.yaml").pushes[0].hand
    assert hand is not None
    expected = [[float(hx), float(hy), 0.023] for *_, hx, hy in rows]
    np.testing.assert_allclose(hand.positions, expected, atol=1e-9)


def test_two_columns_lie_in_the_tables_plane_whichever_axis_is_up(tmp_path: Path) -> None:
    """They were taken for the log's x and y, so that with y up one of them was lost."""
    (tmp_path / "log.csv").write_text(TABLE.replace("t,x,y,yaw", "t,z,x,yaw"), encoding="utf-8")
    (tmp_path / "plain.csv").write_text(TABLE, encoding="utf-8")
    (tmp_path / "plain.yaml").write_text(MAP, encoding="utf-8")
    chart = MAP.replace("columns: [x, y]", "columns: [x, z]").replace("columns: [hx, hy]", "columns: [hy, hx]")
    (tmp_path / "map.yaml").write_text(f"{chart}world: {{axes: [z, x, y]}}\n", encoding="utf-8")
    found = convert_table(tmp_path / "log.csv", tmp_path / "found", tmp_path / "map.yaml").pushes[0]
    plain = convert_table(tmp_path / "plain.csv", tmp_path / "out", tmp_path / "plain.yaml").pushes[0]
    assert found.object == plain.object and found.hand == plain.hand
    (tmp_path / "map.yaml").write_text(
        f"{chart}world: {{pose: {{translation: [0, 0, 0], rotation_wxyz: [0.9, 0.43589, 0, 0]}}}}\n", encoding="utf-8"
    )
    with pytest.raises(RecordingError, match="no axis of the log is up; give three"):
        convert_table(tmp_path / "log.csv", tmp_path / "other", tmp_path / "map.yaml")


def test_rows_without_any_number_do_not_cut_a_push(tmp_path: Path) -> None:
    table = np.array([[float(v) for v in line.split(",")] for line in TABLE.splitlines()[1:]])
    table = np.insert(table, 4, np.nan, axis=0)
    trial = np.where(np.isnan(table[:, 0]), np.nan, 3.0)
    np.savez(tmp_path / "log.npz", trial=trial, **dict(zip(("t", "x", "y", "yaw", "hx", "hy"), table.T, strict=True)))
    (tmp_path / "map.yaml").write_text(MAP + "pushes: {cut: column, column: trial}\n", encoding="utf-8")
    found = convert_table(tmp_path / "log.npz", tmp_path / "found", tmp_path / "map.yaml")
    assert [len(push.object) for push in found.pushes] == [9]


def test_a_value_that_comes_again_is_said(tmp_path: Path) -> None:
    lines = TABLE.splitlines()
    numbered = [f"{line},{1 if k < 5 or k > 6 else 2}" for k, line in enumerate(lines[1:])]
    (tmp_path / "log.csv").write_text("\n".join([f"{lines[0]},trial", *numbered]), encoding="utf-8")
    (tmp_path / "map.yaml").write_text(MAP + "pushes: {cut: column, column: trial}\n", encoding="utf-8")
    with pytest.warns(UserWarning, match="trial 1 comes in 2 pieces, and each is taken for a push"):
        convert_table(tmp_path / "log.csv", tmp_path / "found", tmp_path / "map.yaml")


@pytest.mark.parametrize(("pair", "axes"), [("x,y", "[x, y, z]"), ("x,z", "[z, x, y]")])
def test_of_two_columns_the_missing_one_is_taken_for_up_and_said(pair: str, axes: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(TABLE.replace("t,x,y,yaw", f"t,{pair},yaw"), encoding="utf-8")
    text = guess_map(tmp_path / "log.csv").text
    (missing,) = set("xyz") - set(pair)
    assert f"# The object has no {missing}, which is taken for up.\nworld: {{axes: {axes}}}" in text


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_what_a_diagnosis_would_refuse_is_said_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    still = "".join(f"{0.01 * k:.2f},0,0,0,{0.001 * k - 0.05:.3f},0\n" for k in range(9))
    (tmp_path / "log.csv").write_text("t,x,y,yaw,hx,hy\n" + still, encoding="utf-8")
    (tmp_path / "map.yaml").write_text(MAP, encoding="utf-8")
    status = cli.main(
        ["convert", "table", str(tmp_path / "log.csv"), str(tmp_path / "r"), "--map", str(tmp_path / "map.yaml")]
    )
    shown = capsys.readouterr()
    assert status == 1 and "ERROR: " in shown.err
    assert "correct the map, and convert to another folder" in shown.out


def test_a_map_may_be_read_on_its_own(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(MAP)
    chart = read_map(tmp_path / "map.yaml")
    assert chart.name == "mug" and chart.object.turn == Turn(columns=("yaw",), kind="yaw", unit="rad")


OBJECT_LINE = "object: {shape: box, size_m: [0.1, 0.1, 0.1]}"
OURS = "object: {shape: cylinder, radius_m: 0.0356, length_m: 0.0459, axis: z, mass_kg: 0.90393}"


class TestGuess:
    @pytest.mark.filterwarnings("ignore::UserWarning")
    @pytest.mark.parametrize("name", ["take.csv", "vicon.csv", "versuche.csv", "padded.npz", "demos.h5"])
    def test_with_its_object_measured_it_is_the_map(self, name: str, sealed: Recording, tmp_path: Path) -> None:
        found = converted(sealed, foreign.TABLES[name].write, name, tmp_path)
        guess = guess_map(tmp_path / name)
        text = guess.text.replace(OBJECT_LINE, OURS).replace("radius_m: 0.01,", "radius_m: 0.0112,")
        (tmp_path / "guessed.yaml").write_text(text.replace("size_m: [1.2, 0.8]", "size_m: [1.6, 1.4]"))
        again = convert_table(tmp_path / name, tmp_path / "again", tmp_path / "guessed.yaml")
        assert len(again.pushes) == len(found.pushes)
        for push, other in zip(found.pushes, again.pushes, strict=True):
            assert push.object == other.object
            assert other.hand is not None and push.hand is not None
            assert np.array_equal(push.hand.positions, other.hand.positions)

    def test_a_yaw_without_a_name_is_the_objects_and_two_axes_say_which_is_up(self, tmp_path: Path) -> None:
        head = "t,obj x [in],obj z [in],yaw [deg],tip x [in],tip y [in],tip z [in]"
        rows = [f"{0.01 * k:.2f},{0.02 * k},{0.01 * k},{0.1 * k},{0.02 * k},0.8,{0.01 * k - 2}" for k in range(50)]
        (tmp_path / "log.csv").write_text("\n".join([head, *rows]))
        text = guess_map(tmp_path / "log.csv").text
        assert 'position: {columns: ["obj x [in]", "obj z [in]"], unit: in}' in text
        assert 'rotation: {columns: ["yaw [deg]"], as: yaw, unit: deg}' in text
        assert "world: {axes: [z, x, y]}" in text and "# not used" not in text

    def test_what_it_cannot_tell_is_a_question(self, sealed: Recording, tmp_path: Path) -> None:
        pytest.importorskip("pyarrow")
        foreign.lerobot(sealed, tmp_path / "data.parquet")
        guess = guess_map(tmp_path / "data.parquet")
        assert 'columns: ["?", "?", "?"], unit: m}   # CHANGE' in guess.text
        assert "# not used: observation.state[0]" in guess.text
        (tmp_path / "map.yaml").write_text(guess.text)
        with pytest.raises(RecordingError, match=r"has no column '\?'"):
            convert_table(tmp_path / "data.parquet", tmp_path / "out", tmp_path / "map.yaml")

    def test_it_shows_rates_and_ranges(self, sealed: Recording, tmp_path: Path) -> None:
        foreign.motive(sealed, tmp_path / "take.csv")
        rows = {row[0]: row for row in guess_map(tmp_path / "take.csv").rows}
        name, samples, rate, least, largest = rows["Rigid Body/Mug/9AC01F/Position/Y"]
        assert int(samples) > 4000 and rate == "120" and 0.01 < float(least) < float(largest) < 0.2 and name
