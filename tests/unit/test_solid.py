"""What the cell makes of a recorded shape."""

import math

import numpy as np
import pytest
from reference.scenes import OBJECTS
from twin import body_of, config_of

from physid_drake.cell import Cell, Start
from physid_drake.cell.outline import Disc
from physid_drake.cell.solid import solid_of
from physid_drake.cell.support import second_moments
from physid_drake.errors import CellError
from physid_drake.recording import Box, Cylinder, MeshShape, Prism, polygon_centroid

TRIANGLE = tuple((float(x), float(y)) for x, y in OBJECTS["triangle"].polygon)
HEXAGON = tuple((0.05 * math.cos(math.pi * k / 3), 0.05 * math.sin(math.pi * k / 3)) for k in range(6))
ELLIPSE = tuple((0.06 * math.cos(math.pi * k / 32), 0.04 * math.sin(math.pi * k / 32)) for k in range(64))
SQUARE = ((-0.04, -0.03), (0.04, -0.03), (0.04, 0.03), (-0.04, 0.03))
NEEDLE = ((-0.06, -0.01), (0.06, -0.01), (0.0, 0.02))
PRISMS = {"triangle": TRIANGLE, "hexagon": HEXAGON, "ellipse": ELLIPSE, "square": SQUARE, "needle": NEEDLE}

BOX_OBJ = """# a box of 100 x 80 x 60 mm, in millimetres, not centred
v 10 20 0
v 110 20 0
v 110 100 0
v 10 100 0
v 10 20 60
v 110 20 60
v 110 100 60
v 10 100 60
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
"""


def test_inertia_of_a_box_and_of_a_cylinder_are_the_textbooks():
    x, y, z = solid_of(Box(size=(0.1, 0.08, 0.06))).gyration
    assert (x, y, z) == pytest.approx(((0.0064 + 0.0036) / 12, (0.01 + 0.0036) / 12, (0.01 + 0.0064) / 12))
    standing = solid_of(Cylinder(radius=0.03, length=0.2, axis="z"))
    assert standing.gyration == pytest.approx((0.0009 / 4 + 0.04 / 12, 0.0009 / 4 + 0.04 / 12, 0.0009 / 2))
    assert isinstance(standing.outline, Disc)
    lying = solid_of(Cylinder(radius=0.03, length=0.2, axis="y"))
    assert lying.gyration == pytest.approx((standing.gyration[0], standing.gyration[2], standing.gyration[0]))
    assert lying.rolling_radius == 0.03
    assert lying.height == pytest.approx(0.06)


@pytest.mark.parametrize("name", ["triangle", "square", "hexagon"])
def test_gyration_of_a_polygon_is_that_of_its_points(name):
    polygon = np.array(PRISMS[name])
    rng = np.random.default_rng(0)
    low, high = polygon.min(axis=0), polygon.max(axis=0)
    points = rng.uniform(low, high, (400_000, 2))
    for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        points = points[(b - a)[0] * (points[:, 1] - a[1]) - (b - a)[1] * (points[:, 0] - a[0]) > 0]
    want = (points[:, 1] ** 2).mean(), (points[:, 0] ** 2).mean()
    xx, _, yy = second_moments(np.asarray(polygon))
    assert (yy, xx) == pytest.approx(want, rel=0.01)  # Monte Carlo of 2e5 points: 0.3 %


def test_a_square_prism_is_a_box():
    prism, want = solid_of(Prism(polygon=SQUARE, height=0.05)), solid_of(Box(size=(0.08, 0.06, 0.05)))
    assert prism.gyration == pytest.approx(want.gyration, rel=1e-12)
    assert prism.outline.extent() == pytest.approx(want.outline.extent())


def distance_to_faces(solid, point):
    """Signed distance of a point (2,) at half height to the union of the colliding boxes, negative inside."""
    nearest = math.inf
    for shape, X_BG in solid.faces:
        x, y, _ = X_BG.inverse() @ np.array([*point, 0.0])
        dx, dy = abs(x) - shape.width() / 2, abs(y) - shape.depth() / 2
        outside = math.hypot(max(dx, 0.0), max(dy, 0.0))
        nearest = min(nearest, outside if outside > 0.0 else max(dx, dy))
    return nearest


def along(polygon, n=41):
    corners = np.array(polygon)
    return np.vstack(
        [
            a + np.linspace(0, 1, n)[:, None] * (b - a)
            for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
        ]
    )


@pytest.mark.parametrize("name", list(PRISMS))
def test_the_faces_of_a_prism_cover_its_outline(name, request):
    solid = solid_of(Prism(polygon=PRISMS[name], height=0.04))
    gaps = [distance_to_faces(solid, point) for point in along(PRISMS[name])]
    # At acute corners the faces, 0.2 mm thick, end early: by 0.2 mm (45 degrees), 0.4 mm (27 degrees).
    assert max(gaps) < 5e-4, f"{max(gaps) * 1e3:.3f} mm of the outline are bare"


@pytest.mark.parametrize("name", list(PRISMS))
def test_no_face_of_a_prism_sticks_out(name):
    solid = solid_of(Prism(polygon=PRISMS[name], height=0.04))
    for shape, X_BG in solid.faces:
        for sx in (-0.5, 0.5):
            for sy in (-0.5, 0.5):
                corner = X_BG @ np.array([sx * shape.width(), sy * shape.depth(), 0.0])
                assert solid.outline.nearest(corner[0], corner[1])[0] < 1e-9


# ----------------------------------------------------------------------------------------------------- meshes


@pytest.fixture
def box_mesh(tmp_path):
    file = tmp_path / "box.obj"
    file.write_text(BOX_OBJ, encoding="utf-8")
    return MeshShape(file=file, scale=1e-3)


def test_a_mesh_of_a_box_is_the_box(box_mesh):
    mesh, want = solid_of(box_mesh), solid_of(Box(size=(0.1, 0.08, 0.06)))
    assert mesh.height == pytest.approx(want.height)
    assert mesh.gyration == pytest.approx(want.gyration, rel=1e-9)
    assert mesh.outline.extent() == pytest.approx(want.outline.extent())
    assert mesh.underside.extent() == pytest.approx(want.underside.extent())
    for point in np.random.default_rng(0).uniform(-0.1, 0.1, (100, 2)):
        assert mesh.outline.nearest(*point)[0] == pytest.approx(want.outline.nearest(*point)[0], abs=1e-12)


def prism_mesh(file, polygon, height, *, closed=True, caps=None):
    """An extruded polygon, away from the file's origin; its ends in convex pieces; open at the top if not closed."""
    n = len(polygon)
    lines = [f"v {x + 0.3} {y - 0.2} {z}" for z in (0.1, 0.1 + height) for x, y in polygon]
    caps = caps or [range(1, n + 1)]
    faces = [" ".join(str(k) for k in reversed(cap)) for cap in caps]
    faces += [" ".join(str(n + k) for k in cap) for cap in caps if closed]
    faces += [f"{k} {k % n + 1} {n + k % n + 1} {n + k}" for k in range(1, n + 1)]
    file.write_text("\n".join([*lines, *(f"f {face}" for face in faces)]) + "\n", encoding="utf-8")
    return MeshShape(file=file)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("corner", [0.0, 0.05], ids=["right", "isosceles"])
def test_a_mesh_of_a_triangle_is_the_prism(tmp_path, corner, closed):
    triangle = np.array([[0.0, 0.0], [0.1, 0.0], [corner, 0.09]])
    triangle -= triangle.mean(axis=0)
    want = solid_of(Prism(polygon=tuple(map(tuple, triangle.tolist())), height=0.03))
    mesh = solid_of(prism_mesh(tmp_path / "triangle.obj", triangle.tolist(), 0.03, closed=closed))
    assert mesh.gyration == pytest.approx(want.gyration, rel=1e-9)
    for outline, other in ((mesh.outline, want.outline), (mesh.underside, want.underside)):
        np.testing.assert_allclose(sorted(outline.vertices), sorted(other.vertices), atol=1e-12)


def test_a_mesh_that_is_not_convex_weighs_what_it_encloses(tmp_path):
    ell = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.02], [0.02, 0.02], [0.02, 0.1], [0.0, 0.1]])
    solid = solid_of(prism_mesh(tmp_path / "ell.obj", ell.tolist(), 0.03, caps=[(1, 2, 3, 4), (1, 4, 5, 6)]))
    # Two rectangles of 100 x 20 and 20 x 80 mm: centroids 50, 10 and 10, 60 mm, areas 20 and 16 cm^2.
    x, y = (20 * 0.05 + 16 * 0.01) / 36, (20 * 0.01 + 16 * 0.06) / 36
    assert solid.outline.extent() == pytest.approx((-x, -y, 0.1 - x, 0.1 - y))
    inertia = sum(
        area * ((a * a + b * b) / 12 + (px - x) ** 2 + (py - y) ** 2)
        for area, a, b, px, py in ((20, 0.1, 0.02, 0.05, 0.01), (16, 0.02, 0.08, 0.01, 0.06))
    )
    assert solid.gyration[2] == pytest.approx(inertia / 36)


TEE = np.array([[-2, 1], [-2, 0], [-0.5, 0], [-0.5, -3], [0.5, -3], [0.5, 0], [2, 0], [2, 1]]) * 0.04
TEE_CAPS = [(1, 2, 3, 6, 7, 8), (3, 4, 5, 6)]


def test_a_mesh_of_a_tee_is_the_prism_with_its_notches(tmp_path):
    centred = TEE - polygon_centroid(TEE)
    want = solid_of(Prism(polygon=tuple(map(tuple, centred.tolist())), height=0.03))
    mesh = solid_of(prism_mesh(tmp_path / "tee.obj", TEE.tolist(), 0.03, caps=TEE_CAPS))
    assert mesh.gyration == pytest.approx(want.gyration, rel=1e-9)
    for outline, other in ((mesh.outline, want.outline), (mesh.underside, want.underside)):
        np.testing.assert_allclose(sorted(outline.vertices), sorted(other.vertices), atol=1e-12)
    for point in np.random.default_rng(0).uniform(-0.1, 0.1, (100, 2)):
        assert mesh.outline.nearest(*point) == pytest.approx(want.outline.nearest(*point), abs=1e-9)
    places = [sorted(pose.translation().round(9).tolist() for _, pose in solid.faces) for solid in (mesh, want)]
    np.testing.assert_allclose(*places, atol=1e-9)


def test_a_vertex_on_a_straight_line_is_no_corner(tmp_path):
    square = np.array([[0.0, 0.0], [0.05, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]])
    assert len(solid_of(prism_mesh(tmp_path / "square.obj", square.tolist(), 0.03)).outline.vertices) == 4


def test_what_is_no_prism_has_its_hull(tmp_path):
    """A frame with a hole, a tee whose top is open, and a tee that is wound inside out."""
    ring = [(x, y, z) for z in (0.0, 0.03) for h in (0.05, 0.03) for x, y in ((-h, -h), (h, -h), (h, h), (-h, h))]
    faces = []
    for k in range(4):
        a, b = k + 1, (k + 1) % 4 + 1
        faces += [
            (b, a, a + 4, b + 4),
            (a + 8, b + 8, b + 12, a + 12),
            (a, b, b + 8, a + 8),
            (b + 4, a + 4, a + 12, b + 12),
        ]
    rows = [f"v {x} {y} {z}" for x, y, z in ring] + ["f " + " ".join(map(str, face)) for face in faces]
    (tmp_path / "ring.obj").write_text("\n".join(rows) + "\n", encoding="utf-8")
    assert len(solid_of(MeshShape(file=tmp_path / "ring.obj")).outline.vertices) == 4
    opened = prism_mesh(tmp_path / "opened.obj", TEE.tolist(), 0.03, caps=TEE_CAPS, closed=False)
    assert len(solid_of(opened).outline.vertices) == 6
    turned = prism_mesh(tmp_path / "turned.obj", TEE[::-1].tolist(), 0.03, caps=[(1, 2, 3, 6, 7, 8), (3, 4, 5, 6)])
    assert len(solid_of(turned).outline.vertices) == 6


def test_a_mesh_of_a_box_slides_like_the_box(box_mesh):
    ends = [
        Cell(shape, hand_radius=None, config=config_of("point"))
        .rollout(body_of(), start=Start(pose=(0, 0, 0), velocity=(0.4, 0.1, 3.0)), path=None, begin=0.0, end=0.5)
        .poses[-1]
        for shape in (box_mesh, Box(size=(0.1, 0.08, 0.06)))
    ]
    np.testing.assert_allclose(ends[0], ends[1], atol=1e-5)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("missing.obj", None),
        ("other.stl", "solid\n"),
        ("empty.obj", ""),
        ("words.obj", "v a b c\n" * 8),
        ("short.obj", "v 1 2\n" * 8),
        ("point.obj", "v 1 2 3\n" * 8),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"),
        ("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 1\nv 3 0 1\n"),
    ],
)
def test_a_mesh_that_is_no_solid_is_refused_by_name(tmp_path, name, text, request):
    file = tmp_path / name
    if text is not None:
        file.write_text(text, encoding="utf-8")
    with pytest.raises(CellError, match=name.replace(".", r"\.")):
        Cell(MeshShape(file=file, scale=1.0), hand_radius=None)


def test_a_mesh_of_noise_is_refused(tmp_path):
    file = tmp_path / "noise.obj"
    file.write_bytes(bytes(range(128, 256)) * 4)
    with pytest.raises(CellError, match=r"noise\.obj"):
        solid_of(MeshShape(file=file, scale=1.0))


def test_drake_gets_a_mesh_from_memory_and_follows_nothing_that_it_names(box_mesh):
    secret = box_mesh.file.parent / "secret.png"
    secret.write_bytes(b"what nobody is to see")
    (box_mesh.file.parent / "own.mtl").write_text(f"newmtl red\nmap_Kd {secret}\n", encoding="utf-8")
    box_mesh.file.write_text("mtllib own.mtl\nusemtl red\n" + BOX_OBJ, encoding="utf-8")
    ((shape, _),) = solid_of(box_mesh).visual
    source = shape.source()
    assert source.is_in_memory() and not source.in_memory().supporting_files
    assert b"mtl" not in source.in_memory().mesh_file.contents()


@pytest.mark.parametrize(
    "line", ["f 1 2 999999999", "f 1 2 9", "f -1 -2 -100000000", "f 0 0 0", "v nan 0 0", "mtllib /etc/passwd"]
)
def test_a_mesh_that_would_break_drake_never_gets_there(box_mesh, line):
    box_mesh.file.write_text(f"{BOX_OBJ}{line}\n", encoding="utf-8")
    with pytest.raises(CellError, match=r"box\.obj"):
        solid_of(box_mesh)


@pytest.mark.parametrize("scale", [1e-12, 1e-308, 1e6, 1e308])
def test_a_mesh_of_no_size_is_refused(box_mesh, scale):
    with pytest.raises(CellError, match=r"box\.obj.* scale"):
        solid_of(MeshShape(file=box_mesh.file, scale=scale))


def test_faces_that_enclose_nothing_leave_the_hull(box_mesh):
    want = solid_of(box_mesh)
    vertices, _, faces = BOX_OBJ.partition("\nf ")
    for other in ("", "f 1 1 1", "f 1 2 3", "f 1 2 3\nf 1 3 2", "f " + faces.replace("1", "2")):
        box_mesh.file.write_text(f"{vertices}\n{other}\n", encoding="utf-8")
        assert solid_of(box_mesh).gyration == pytest.approx(want.gyration, rel=0.5)
        Cell(box_mesh, hand_radius=None)
