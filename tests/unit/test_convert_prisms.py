"""Meshes and boxes become prisms: outline with notches, height, middle; any unit, any axis up; else one line."""

from __future__ import annotations

import warnings
from pathlib import Path

import foreign
import numpy as np
import pytest

pytest.importorskip("trimesh")
pytest.importorskip("shapely")

import trimesh
from scipy.spatial.transform import Rotation

from physid_drake.convert import convert_table
from physid_drake.convert.mapping import BoxPart, MeshFrame
from physid_drake.convert.prisms import prism_of, prism_of_boxes
from physid_drake.errors import RecordingError
from physid_drake.recording import Prism, Recording, outline_distance, polygon_centroid, read_recording
from physid_drake.recording.outlines import _triangles

SEALED = Path(__file__).parents[2] / "recordings" / "sealed_01"
TEE = np.array([[-2, 1], [-2, 0], [-0.5, 0], [-0.5, -3], [0.5, -3], [0.5, 0], [2, 0], [2, 1]]) * 40.0
"""mm; the middle of the bar's upper edge is above the origin."""
HEIGHT = 30.0


def extruded(outline: np.ndarray, height: float, base: float = 0.0) -> trimesh.Trimesh:
    n = len(outline)
    vertices = np.vstack([np.column_stack([outline, np.full(n, z)]) for z in (base, base + height)])
    faces = [[c, b, a] for a, b, c in _triangles(outline)] + [
        [a + n, b + n, c + n] for a, b, c in _triangles(outline)
    ]
    for k in range(n):
        j = (k + 1) % n
        faces += [[k, j, j + n], [k, j + n, k + n]]
    return trimesh.Trimesh(vertices=vertices, faces=faces, process=False)


@pytest.fixture
def tee() -> trimesh.Trimesh:
    return extruded(TEE, HEIGHT)


@pytest.mark.parametrize("ending", [".stl", ".obj", ".glb", ".ply", ".off"])
def test_a_tee_of_any_format_is_its_prism(ending: str, tee: trimesh.Trimesh, tmp_path: Path) -> None:
    tee.export(tmp_path / f"tee{ending}")
    made = prism_of(tmp_path / f"tee{ending}", 1e-3, MeshFrame())
    centre = polygon_centroid(TEE)
    assert len(made.shape.polygon) == 8 and made.shape.height == pytest.approx(0.03)
    assert np.abs(outline_distance(1e-3 * (TEE - centre), np.array(made.shape.polygon))).max() < 1e-6
    assert made.offset.translation == pytest.approx([*(1e-3 * centre), 0.015], abs=1e-6)
    assert "a prism of 8 corners, 160.0 by 160.0 mm, 30.0 mm high" in made.says


def test_another_axis_up_and_a_tracked_frame_of_its_own(tee: trimesh.Trimesh, tmp_path: Path) -> None:
    """The frame's pose of the prism is the same whichever way the mesh lies."""
    frame = MeshFrame(
        translation=(10.0, -20.0, 35.0), rotation=tuple(np.roll(Rotation.from_euler("z", 0.4).as_quat(), 1))
    )
    tee.export(tmp_path / "z.stl")
    upright = prism_of(tmp_path / "z.stl", 1e-3, frame)
    axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # z, x, y of a mesh whose y is up
    lying = tee.copy()
    lying.vertices = tee.vertices @ axes
    lying.export(tmp_path / "y.stl")
    turned = MeshFrame(axes=axes, translation=tuple(np.array(frame.translation) @ axes), rotation=frame.rotation)
    other = prism_of(tmp_path / "y.stl", 1e-3, turned)
    assert other.offset.translation == pytest.approx(upright.offset.translation, abs=1e-6)
    assert other.offset.rotation == pytest.approx(upright.offset.rotation, abs=1e-9)
    # By hand: from the frame's origin to the middle, in the frame's axes.
    to_middle = 1e-3 * (np.array([*polygon_centroid(TEE), 15.0]) - frame.translation)
    expected = Rotation.from_euler("z", -0.4).apply(to_middle)
    assert upright.offset.translation == pytest.approx(expected, abs=1e-6)


def test_a_round_one_has_as_many_corners_as_a_tip_feels(tmp_path: Path) -> None:
    trimesh.creation.cylinder(radius=0.05, height=0.1, sections=720).export(tmp_path / "mug.stl")
    shape = prism_of(tmp_path / "mug.stl", 1.0, MeshFrame()).shape
    radii = np.linalg.norm(shape.polygon, axis=1)
    assert 20 < len(radii) < 100 and np.abs(radii - 0.05).max() < 2e-4


def cone() -> trimesh.Trimesh:
    return trimesh.creation.cone(radius=0.05, height=0.1)


def ring() -> trimesh.Trimesh:
    return trimesh.creation.annulus(r_min=0.02, r_max=0.05, height=0.03)


def two() -> trimesh.Trimesh:
    return trimesh.util.concatenate([extruded(TEE, 30.0), extruded(TEE + np.array([500.0, 0.0]), 30.0)])


@pytest.mark.parametrize(
    ("make", "said"), [(cone, "it is no upright prism"), (ring, "it has a hole"), (two, "it is in several parts")]
)
def test_what_is_no_prism(make, said: str, tmp_path: Path) -> None:
    make().export(tmp_path / "x.stl")
    with pytest.raises(RecordingError, match=said) as caught:
        prism_of(tmp_path / "x.stl", 1.0, MeshFrame())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("x.stl", b"", "mesh"), ("x.stl", b"solid x\n", "mesh"), ("x.glb", b"glTF\x02\0\0\0" + b"\xff" * 40, "mesh"),
        ("x.gltf", b'{"asset":{"version":"2.0"},"buffers":[{"uri":"../secret.bin","byteLength":36}]}', "mesh"),
        ("x.obj", b"mtllib ../secret.mtl\nv 0 0 0\n", "mesh"), ("x.step", b"ISO", "must end in"),
    ],
)  # fmt: skip
def test_broken_meshes_are_one_line(name: str, content: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(RecordingError, match=said) as caught:
        prism_of(tmp_path / name, 1.0, MeshFrame())
    assert "\n" not in str(caught.value)


BAR = BoxPart(size=(160.0, 40.0, HEIGHT), centre=(0.0, 20.0, 15.0), yaw=0.0)
STEM = BoxPart(size=(40.0, 120.0, HEIGHT), centre=(0.0, -60.0, 15.0), yaw=0.0)


def test_two_boxes_are_a_tee() -> None:
    made = prism_of_boxes((BAR, STEM), 1e-3, MeshFrame())
    centre = polygon_centroid(TEE)
    assert len(made.shape.polygon) == 8 and made.shape.height == pytest.approx(0.03)
    assert np.abs(outline_distance(1e-3 * (TEE - centre), np.array(made.shape.polygon))).max() < 1e-6
    assert made.offset.translation == pytest.approx([*(1e-3 * centre), 0.015], abs=1e-6)


def test_boxes_may_be_turned() -> None:
    """A square and one turned by 45 degrees are a star of eight points and sixteen corners."""
    square = BoxPart(size=(2.0, 2.0, 1.0), centre=(0.0, 0.0, 0.0), yaw=0.0)
    turned = BoxPart(size=(2.0, 2.0, 1.0), centre=(0.0, 0.0, 0.0), yaw=np.pi / 4.0)
    radii = np.linalg.norm(prism_of_boxes((square, turned), 0.05, MeshFrame()).shape.polygon, axis=1)
    assert len(radii) == 16 and radii.max() == pytest.approx(0.05 * np.sqrt(2.0), abs=1e-6)
    # An edge of one crosses an edge of the other half way between two points of the star.
    assert radii.min() == pytest.approx(0.05 / np.cos(np.pi / 8.0), abs=1e-6)


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (
            BoxPart(size=(40.0, 120.0, 20.0), centre=(0.0, -60.0, 10.0), yaw=0.0),
            r"reach from 0\.0 to 30\.0, 0\.0 to 20",
        ),
        (BoxPart(size=(40.0, 20.0, HEIGHT), centre=(0.0, -60.0, 15.0), yaw=0.0), "it is in several parts"),
    ],
)
def test_boxes_that_are_no_prism(other: BoxPart, said: str) -> None:
    with pytest.raises(RecordingError, match=said) as caught:
        prism_of_boxes((BAR, other), 1e-3, MeshFrame())
    assert "\n" not in str(caught.value)


BOXES = "boxes: [{size: [160, 40, 30], centre: [0, 20, 15]}, {size: [40, 120, 30], centre: [0, -60, 15], yaw_deg: 0}]"


@pytest.mark.parametrize("given", ["mesh", "boxes"])
def test_a_map_with_a_mesh_or_boxes(given: str, tee: trimesh.Trimesh, tmp_path: Path) -> None:
    sealed: Recording = read_recording(SEALED).subset([0, 1])
    chart = foreign.german(sealed, tmp_path / "log.csv")
    tee.export(tmp_path / "tee.stl")
    ours = "object: {shape: cylinder, radius_m: 0.0356, length_m: 0.0459, axis: z, mass_kg: 0.90393}"
    assert ours in chart
    parts = {"mesh": "shape: mesh, file: tee.stl", "boxes": f"shape: boxes, {BOXES}"}[given]
    mesh = f"object: {{{parts}, unit: mm, mass_kg: 0.4, frame: {{translation: [0, 0, 15]}}}}"
    (tmp_path / "map.yaml").write_text(chart.replace(ours, mesh))
    with pytest.warns(UserWarning, match=r"(tee.stl|2 boxes): a prism of 8 corners"):
        found = convert_table(tmp_path / "log.csv", tmp_path / "out", tmp_path / "map.yaml")
    assert isinstance(found.object.shape, Prism) and found.object.mass == 0.4
    shift = 1e-3 * polygon_centroid(TEE)
    for push, other in zip(sealed.pushes, found.pushes, strict=True):
        turn = Rotation.from_quat(np.roll(push.object.quaternions, -1, axis=1))
        assert np.abs(push.object.positions + turn.apply([*shift, 0.0]) - other.object.positions).max() < 2e-5
    (tmp_path / "both.yaml").write_text(
        chart.replace(ours, mesh).replace("object:\n  position", "object:\n  offset: {yaw_deg: 3}\n  position")
    )
    with warnings.catch_warnings(), pytest.raises(RecordingError, match="offset stands beside"):
        warnings.simplefilter("ignore")
        convert_table(tmp_path / "log.csv", tmp_path / "again", tmp_path / "both.yaml")


@pytest.mark.parametrize(
    "boxes",
    [
        "[]",
        "3",
        "[{size: [1, 1, 1]}]",
        "[{size: [1, 1, -1], centre: [0, 0, 0]}]",
        "[{size: [1, 1], centre: [0, 0, 0]}]",
        "[{size: [1, 1, .inf], centre: [0, 0, 0]}]",
        "[{size: [1, 1, 1], centre: [0, 0, 0], roll: 3}]",
        "[{size: [1, 1, true], centre: [0, 0, 0]}]",
    ],
)
def test_boxes_that_are_none(boxes: str, tmp_path: Path) -> None:
    chart = foreign.german(read_recording(SEALED).subset([0]), tmp_path / "log.csv")
    ours = "object: {shape: cylinder, radius_m: 0.0356, length_m: 0.0459, axis: z, mass_kg: 0.90393}"
    (tmp_path / "map.yaml").write_text(chart.replace(ours, f"object: {{shape: boxes, boxes: {boxes}}}"))
    with pytest.raises(RecordingError, match=r"object\.boxes: must be a list of \{size: \[x, y, z\]"):
        convert_table(tmp_path / "log.csv", tmp_path / "out", tmp_path / "map.yaml")
