"""Meshes: what is taken from an OBJ file, and what is refused before Drake sees it."""

import os

import numpy as np
import pytest

from physid_drake.errors import RecordingError
from physid_drake.recording.obj import check_solid, read_obj

TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\n"


@pytest.fixture
def obj(tmp_path):
    def write(text):
        file = tmp_path / "object.obj"
        file.write_text(text, encoding="utf-8")
        return file

    return write


def refusal(file, scale=1.0):
    with pytest.raises(RecordingError) as caught:
        check_solid(read_obj(file), scale, file)
    message = str(caught.value)
    assert "object.obj" in message and "\n" not in message and len(message) < 400
    return message


@pytest.mark.parametrize(
    "face", ["1 2 3", "1/1 2/2 3/3", "1//1 2//2 3//3", "1/1/1 2/2/2 3/3/3", "-4 -3 -2", "+1 2 3"]
)
def test_a_face_is_of_its_vertices_however_it_names_them(obj, face):
    mesh = read_obj(obj(f"{TETRAHEDRON}f {face}\n"))
    assert mesh.triangles.tolist() == [[0, 1, 2]]
    assert mesh.vertices.tolist()[1] == [0.1, 0.0, 0.0]


def test_a_polygon_is_a_fan(obj):
    assert read_obj(obj(TETRAHEDRON + "f 1 2 3 4\n")).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_a_vertex_may_have_a_weight_or_a_colour_and_a_face_may_come_first(obj):
    text = "f 1 2 3\n" + TETRAHEDRON.replace("0 0 0.1", "0 0 0.1 1.0").replace("0.1 0 0\n", "0.1 0 0 1 0 0\n", 1)
    assert read_obj(obj(text)).triangles.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_of_all_systems_comments_and_long_lines_are_read(obj, end, tmp_path):
    text = "# a mesh\n" + TETRAHEDRON + "f 1 2 \\\n 3 # the first\ng part\nusemtl red\ns off\nvn 0 0 1\nvt 0 0\n"
    file = tmp_path / "object.obj"
    file.write_bytes(text.replace("\n", end).encode())
    assert read_obj(file).triangles.tolist() == [[0, 1, 2]]


def test_a_mesh_without_faces_is_its_vertices(obj):
    mesh = read_obj(obj(TETRAHEDRON))
    assert mesh.triangles.shape == (0, 3)


def test_what_was_parsed_is_written_and_parsed_again(obj):
    mesh = read_obj(obj(TETRAHEDRON + "mtllib own.mtl\nusemtl red\nf 1 2 3 4\n"))
    again = read_obj(obj(mesh.text()))
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.triangles, mesh.triangles)
    assert "mtl" not in mesh.text()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("f 1 2 9", "a face is of vertex 9, but there are 4"),
        ("f 1 2 999999999", "from 1 to 4"),
        ("f 0 1 2", "from 1 to 4"),
        ("f -1 -2 -100000000", "or from -4 to -1"),
        ("f -1 -2 -5", "or from -4 to -1"),
        ("f 1 2 " + "9" * 400, "must be whole numbers"),
        ("f 1 2", "at least 3 corners, but has 2"),
        ("f", "at least 3 corners"),
        ("f 1 2 x", "must be whole numbers"),
        ("f" + " 1" * 60_000, "at most 100000 characters"),
        ("f 1 2 3 \\\n" * 20_000, "at most 100000 characters"),
        ("f 1 2 3.0", "must be whole numbers"),
        ("f 1/2/3/4 2 3", "must be whole numbers"),
        ("f 1/x 2 3", "must be whole numbers"),
        ("f / / /", "must be whole numbers"),
        ("f 1 2 ١", "must be whole numbers"),
        ("v 1 2", "a vertex must be 'v x y z'"),
        ("v 1 2 3 4 5 6 7 8", "a vertex must be 'v x y z'"),
        ("v 1 2 x", "a coordinate must be a number"),
        ("v nan 2 3", "a coordinate must be a number"),
        ("v 1 -inf 3", "a coordinate must be a number"),
        ("v 1e400 2 3", "a coordinate must be a number"),
        ("v 1e10 2 3", "a coordinate must be a number"),
        ("v 1_0 2 3", "a coordinate must be a number"),
        (f"v {'x' * 400} 2 3", "a coordinate must be a number"),
    ],
    ids=lambda value: value[:20],
)
def test_a_line_that_breaks_a_rule_is_refused_with_its_number(obj, line, said):
    message = refusal(obj(f"{TETRAHEDRON}{line}\n"))
    assert said in message
    assert "line 5" in message or "there are 4" in message


@pytest.mark.parametrize(
    "name",
    [
        "/etc/passwd",
        "../other.mtl",
        "a/../../b.mtl",
        "..\\b.mtl",
        "C:\\b.mtl",
        "\\\\server\\b.mtl",
        "own.mtl /etc/passwd",
        "~/b",
    ],
)
@pytest.mark.parametrize("keyword", ["mtllib", "maplib", "call"])
def test_a_mesh_names_nothing_outside_its_folder(obj, keyword, name):
    assert f"line 5: {keyword} must name a file beside the mesh" in refusal(obj(f"{TETRAHEDRON}{keyword} {name}\n"))


@pytest.mark.parametrize(
    ("text", "scale", "said"),
    [
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n", 1.0, "thick"),
        ("v 0 0 0\nv 1 0 1\nv 1 1 1\nv 0 1 0\n", 1.0, "thick"),
        ("v 0 0 0\nv 1 0 1\nv 2 0 2\nv 3 0 3\n", 1.0, "thick"),
        ("v 1 2 3\n" * 8, 1.0, "thick"),
        (TETRAHEDRON, 1e-8, "thick"),
        (TETRAHEDRON, 1e-320, "thick"),
        (TETRAHEDRON, 1000.0, "long"),
        (TETRAHEDRON, 1e308, "long"),
        ("v 0 0 0\nv 1e-320 0 0\nv 0 1e-320 0\nv 0 0 1e-320\n", 1.0, "thick"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", 1.0, "at least 4 vertices"),
        ("", 1.0, "at least 4 vertices"),
    ],
)
def test_a_mesh_that_is_no_solid_is_refused(obj, text, scale, said):
    assert said in refusal(obj(text), scale)


def test_what_is_no_mesh_file_is_refused(tmp_path):
    for name, said in (("object.obj", "no such file"), ("object.stl", "convert it to .obj")):
        with pytest.raises(RecordingError, match=said):
            read_obj(tmp_path / name)
    os.mkfifo(tmp_path / "object.obj")
    assert "it is a named pipe" in refusal(tmp_path / "object.obj")
    (tmp_path / "object.obj").unlink()
    (tmp_path / "object.obj").write_bytes(bytes(range(128, 256)) * 4)
    assert "line 1 is not UTF-8" in refusal(tmp_path / "object.obj")


def test_a_mesh_of_too_many_vertices_is_refused(obj, monkeypatch):
    monkeypatch.setattr("physid_drake.recording.obj.MOST_VERTICES", 3)
    assert "at most 3 vertices" in refusal(obj(TETRAHEDRON))
    monkeypatch.undo()
    monkeypatch.setattr("physid_drake.recording.obj.MOST_TRIANGLES", 1)
    assert "at most 1 triangles" in refusal(obj(TETRAHEDRON + "f 1 2 3 4\n"))
