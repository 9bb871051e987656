"""What no object, hand, table or sensor has is refused in one line that asks for the unit; texts are plain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from runs import shipped_pushes
from written import HEADER, ROWS, YAML, write

from physid_drake import cli
from physid_drake.errors import RecordingError
from physid_drake.recording import (
    Box,
    Cylinder,
    ForceStream,
    Hand,
    MeshShape,
    PoseStream,
    Prism,
    Sensors,
    Table,
    read_recording,
)
from physid_drake.recording.limits import check_text

TRIANGLE = np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]])


def prism(size):
    return Prism(polygon=tuple(map(tuple, (size * TRIANGLE).tolist())), height=0.03)


@pytest.mark.parametrize("size", [1e-9, 1e300, 5e-324, 127.0, 8e307])
@pytest.mark.parametrize(
    "make",
    [
        lambda size: Box(size=(0.1, size, 0.1)),
        lambda size: Cylinder(radius=size, length=0.1, axis="z"),
        lambda size: Cylinder(radius=0.1, length=size, axis="y"),
        prism,
        lambda size: Prism(polygon=prism(0.05).polygon, height=size),
        lambda size: Hand(tip="sphere", radius=size),
        lambda size: Hand(tip="capsule", radius=0.01, length=size),
        lambda size: Table(size=(size, 1.0)),
    ],
)
def test_a_length_in_another_unit_is_refused(make, size):
    with pytest.raises(RecordingError, match=r"must be between 0.0001 and 100? m, but got .* m; is it in m\?$"):
        make(size)


def test_lengths_at_the_edge_of_what_is_pushed_are_not_refused():
    assert Box(size=(1e-4, 10.0, 0.1)) and Table(size=(100.0, 20.0), centre=(900.0, 0.0))
    assert MeshShape(file=Path("/a.obj"), scale=1e-3)


def test_a_table_that_is_kilometres_away_is_refused():
    with pytest.raises(RecordingError, match="centre_m must be within 1000 m"):
        Table(size=(1.0, 1.0), centre=(0.0, -1e300))


@pytest.mark.parametrize("far", [1e4, -1e300])
def test_a_place_that_is_kilometres_away_is_refused(far):
    with pytest.raises(RecordingError, match=r"row 1 is .* m away; are they in m"):
        PoseStream(times=[0.0, 1.0], positions=[[0, 0, 0], [0, far, 0]], quaternions=[[1, 0, 0, 0]] * 2)
    with pytest.raises(RecordingError, match=r"row 1 has .* N; are they in N"):
        ForceStream(times=[0.0, 1.0], forces=[[0, 0, 0], [0, 1e3 * far, 0]])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("row", "said"),
    [
        ("0.2,,,,0.12,-1e300,0.015,1,0,0,0", "001.csv: row 4: column object_y_m: must be between -1000 and 1000 m"),
        ("0.2,,,,0.12,0,0.015,1e300,0,0,0", "001.csv: row 4: column object_qw: the quaternion's norm must be 1"),
        ("0.2,0,0,1e5,0.12,0,0.015,1,0,0,0", "001.csv: row 4: column hand_z_m: must be between -1000 and 1000 m"),
    ],
)
def test_a_number_out_of_all_proportion_is_refused_by_row_and_column(tmp_path, row, said):
    with pytest.raises(RecordingError) as caught:
        read_recording(write(tmp_path, rows=[*ROWS[:2], row]))
    assert said in str(caught.value)


def test_a_force_out_of_all_proportion_is_refused_by_row_and_column(tmp_path):
    header, rows = HEADER + ",force_x_n,force_y_n,force_z_n", [row + ",0,1e9,0" for row in ROWS]
    with pytest.raises(RecordingError, match=r"row 2: column force_y_n: must be between -1e\+06 and 1e\+06 N"):
        read_recording(write(tmp_path, header=header, rows=rows))


@pytest.mark.parametrize(
    ("sensor", "std", "unit"),
    [("object_position_std", 0.3, "m"), ("object_rotation_std", 3.0, "rad"), ("hand_position_std", 0.09, "m"),
     ("force_std", 200.0, "N")],
)  # fmt: skip
def test_a_noise_that_no_sensor_of_pushes_has_is_refused(sensor, std, unit):
    """0.3 mm stated as 300 mm made the baseline model explain everything."""
    with pytest.raises(
        RecordingError, match=f"{sensor}.* one standard deviation, but got {std:g} {unit}; is it in {unit}"
    ):
        Sensors(**{sensor: std})
    assert Sensors(**{sensor: 1e-2 * std})


UNWRITABLE = ["\ud800", "a\x1b[31mb", "a\x00", "a\x7f", "a\x9bb", "a\u202eb", "a\u2066b", "a\u2028b", "a\rb"]


@pytest.mark.parametrize("text", UNWRITABLE, ids=ascii)
def test_a_text_that_no_terminal_should_get_is_refused_escaped(text, tmp_path):
    recording = shipped_pushes(1)
    push = recording.pushes[0]
    for make in (
        lambda: replace(recording, name=text),
        lambda: replace(recording, description=text),
        lambda: replace(push, name=text),
        lambda: replace(push, note=text),
    ):
        with pytest.raises(RecordingError) as caught:
            make()
        assert str(caught.value).isascii() and str(caught.value).isprintable()


@pytest.mark.parametrize("key", ["name", "description", "note", "file"])
@pytest.mark.parametrize("text", UNWRITABLE, ids=ascii)
def test_the_reader_refuses_it_by_file_and_line(text, key, tmp_path, capsys):
    described = yaml.safe_load(YAML)
    (described["pushes"][0] if key in ("file", "note") else described)[key] = text
    write(tmp_path, yaml=yaml.safe_dump(described))  # escapes what is not plain
    assert cli.main(["inspect", str(tmp_path)]) != 0
    said = capsys.readouterr().err
    assert "recording.yaml: line " in said and key in said and "must be plain text" in said
    assert said.strip().isprintable() and said.isascii()


def test_descriptions_and_notes_may_have_lines_and_all_languages():
    text = "Radiergummi, 80 °C — 橡皮擦\n\tממחק"
    check_text("it", text, lines=True)
    check_text("it", text.partition("\n")[0])
    with pytest.raises(RecordingError, match="has '\\\\n', a control character"):
        check_text("it", text)
