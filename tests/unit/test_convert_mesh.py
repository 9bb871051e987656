"""Meshes become prisms: outline with notches, height, middle; in any unit, with any axis up; else one line."""

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
from physid_drake.convert.mapping import MeshFrame
from physid_drake.convert.mesh import prism_of
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


def test_a_map_with_a_mesh(tee: trimesh.Trimesh, tmp_path: Path) -> None:
    sealed: Recording = read_recording(SEALED).subset([0, 1])
    chart = foreign.german(sealed, tmp_path / "log.csv")
    tee.export(tmp_path / "tee.stl")
    ours = "object: {shape: cylinder, radius_m: 0.0356, length_m: 0.0459, axis: z, mass_kg: 0.90393}"
    assert ours in chart
    mesh = "object: {shape: mesh, file: tee.stl, unit: mm, mass_kg: 0.4, frame: {translation: [0, 0, 15]}}"
    (tmp_path / "map.yaml").write_text(chart.replace(ours, mesh))
    with pytest.warns(UserWarning, match=r"tee.stl: a prism of 8 corners"):
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
