import math
import re
import runpy
from itertools import pairwise

import numpy as np
import pytest
import yaml
from pydrake.geometry import Box as DrakeBox
from pydrake.geometry import Role, SceneGraph, Sphere
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from physid_drake.cell.hand_model import Preshape, hand_looks, hand_model_sdf
from physid_drake.cell.solid import solid_of
from physid_drake.errors import CellError
from physid_drake.recording import Box, Cylinder, Prism
from physid_drake.resources import shipped

MODELS = shipped("models")
CATALOGUE = yaml.safe_load((MODELS / "objects" / "catalogue.yaml").read_text())
REACH = yaml.safe_load((MODELS / "robots" / "reach.yaml").read_text())
SDFS = sorted(path.relative_to(MODELS).as_posix() for path in MODELS.rglob("*.sdf"))
PRESHAPES = {
    "pointing": Preshape(),
    "open": Preshape(proximal=(0.3, 0.3, 0.3), distal=(0.2, 0.2, 0.2)),
    "spread": Preshape(spread=0.5 * math.pi, yaw=-2.0),
    "bent": Preshape(spread=0.4, proximal=(1.9, 0.0, math.pi), distal=(0.7, 0.0, 2.2), yaw=0.7),
}


def parsed(*, url=None, text=None):
    scene_graph = SceneGraph()
    plant = MultibodyPlant(time_step=0.0)
    plant.RegisterAsSourceForSceneGraph(scene_graph)
    parser = Parser(plant)
    parser.package_map().AddPackageXml(str(MODELS / "package.xml"))
    (model,) = parser.AddModels(url=url) if url else parser.AddModelsFromString(text, "sdf")
    plant.Finalize()
    return plant, scene_graph.model_inspector(), model


def shape_of(block):
    match block["shape"]:
        case "box":
            return Box(size=tuple(block["size_m"]))
        case "cylinder":
            return Cylinder(radius=block["radius_m"], length=block["length_m"], axis=block["axis"])
        case "prism":
            polygon = tuple((x, y) for x, y in block["polygon_m"])
            return Prism(polygon=polygon, height=block["height_m"])


# ------------------------------------------------------------------------------------------------- objects, table


@pytest.mark.parametrize("path", SDFS)
def test_every_sdf_parses_through_the_package(path):
    plant, inspector, model = parsed(url=f"package://physid_drake_models/{path}")
    assert inspector.NumGeometriesWithRole(Role.kIllustration) > 0
    assert plant.GetModelInstanceName(model) == path.split("/")[-1].removesuffix(".sdf")


def test_every_object_has_an_entry_in_the_catalogue_and_the_other_way_round():
    assert sorted(CATALOGUE) == sorted(path.stem for path in (MODELS / "objects").glob("*.sdf"))


@pytest.mark.parametrize("name", CATALOGUE)
def test_mass_and_moments_of_inertia_are_those_of_the_uniform_solid(name):
    plant, _, model = parsed(url=f"package://physid_drake_models/objects/{name}.sdf")
    inertia = plant.GetBodyByName("object", model).default_spatial_inertia()
    block = CATALOGUE[name]
    assert inertia.get_mass() == block["mass_kg"]
    np.testing.assert_array_equal(inertia.get_com(), np.zeros(3))
    expected = block["mass_kg"] * np.array(solid_of(shape_of(block)).gyration)
    np.testing.assert_allclose(inertia.CalcRotationalInertia().get_moments(), expected, rtol=1e-8)


def test_only_the_triangle_has_a_product_of_inertia():
    for name, block in CATALOGUE.items():
        plant, _, model = parsed(url=f"package://physid_drake_models/objects/{name}.sdf")
        products = (
            plant.GetBodyByName("object", model).default_spatial_inertia().CalcRotationalInertia().get_products()
        )
        # A right triangle about its centroid: I_xy = -m * mean(x y) = m a b / 36.
        ixy = block["mass_kg"] * 0.150**2 / 36.0 if name == "cmu_triangle" else 0.0
        np.testing.assert_allclose(products, [ixy, 0.0, 0.0], rtol=1e-8)


def test_published_inertias_are_met():
    def about_z(name):
        plant, _, model = parsed(url=f"package://physid_drake_models/objects/{name}.sdf")
        return plant.GetBodyByName("object", model).default_spatial_inertia().CalcRotationalInertia().get_moments()[2]

    assert about_z("mit_rect1") == pytest.approx(0.001131, rel=1e-3)  # Yu and others 2016; ours is 0.045 % below
    assert math.sqrt(about_z("cmu_triangle") / 1.518) == pytest.approx(0.050, abs=1e-9)  # Zhou and others 2016


@pytest.mark.parametrize("name", CATALOGUE)
def test_an_objects_collision_shape_reaches_from_the_table_to_its_height(name):
    plant, inspector, model = parsed(url=f"package://physid_drake_models/objects/{name}.sdf")
    (gid,) = plant.GetCollisionGeometriesForBody(plant.GetBodyByName("object", model))
    half_height = 0.5 * solid_of(shape_of(CATALOGUE[name])).height
    shape, X_BG = inspector.GetShape(gid), inspector.GetPoseInFrame(gid)
    if isinstance(shape, DrakeBox):
        reach = 0.5 * shape.size()[2]
    elif name == "cmu_triangle":
        vertices = np.array(_vertices("objects/cmu_triangle.obj"))
        np.testing.assert_allclose(vertices[:3, :2], CATALOGUE[name]["polygon_m"], atol=1e-12)
        reach = vertices[:, 2].max()
    else:
        axis = np.abs(X_BG.rotation().matrix()[:, 2])
        reach = 0.5 * shape.length() * axis[2] + shape.radius() * math.sqrt(max(0.0, 1.0 - axis[2] ** 2))
    assert reach == pytest.approx(half_height, abs=1e-9)


def _vertices(path):
    lines = (MODELS / path).read_text().splitlines()
    return [[float(word) for word in line.split()[1:]] for line in lines if line.startswith("v ")]


def test_the_table_tops_face_is_at_zero_and_it_ends_at_an_edge():
    plant, inspector, model = parsed(url="package://physid_drake_models/table/table.sdf")
    body = plant.GetBodyByName("table", model)
    (gid,) = plant.GetCollisionGeometriesForBody(body)
    size, centre = inspector.GetShape(gid).size(), inspector.GetPoseInFrame(gid).translation()
    np.testing.assert_allclose(size[:2], REACH["table"]["size_m"])
    np.testing.assert_allclose(centre, [0.0, 0.0, -0.5 * size[2]], atol=1e-12)
    np.testing.assert_allclose(plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), body).translation(), 0.0)


def test_the_meshes_are_what_their_script_makes():
    made = runpy.run_path(str(MODELS / "make_meshes.py"))["meshes"]()
    assert sorted(made) == sorted(path.relative_to(MODELS).as_posix() for path in MODELS.rglob("*.obj"))
    for path, text in made.items():
        assert (MODELS / path).read_text() == text


# ------------------------------------------------------------------------------------------------- reach


def test_reach_regions_do_not_meet_on_the_table_even_with_the_gripper():
    robots = REACH["robots"]
    reaches = {name: robot.get("gripper_reach_m", robot["reach_m"]) for name, robot in robots.items()}
    for a, b in pairwise(robots):
        distance = math.dist(robots[a]["base_m"], robots[b]["base_m"])
        assert reaches[a] + reaches[b] < distance  # discs apart: then so are their parts on the table


@pytest.mark.parametrize("name", REACH["robots"])
def test_a_reach_region_lies_on_the_table_within_the_robots_reach(name):
    robot, half = REACH["robots"][name], 0.5 * np.array(REACH["table"]["size_m"])
    vertices = np.array(_vertices(f"robots/{name}_reach.obj"))
    assert (np.abs(vertices[:, :2]) <= half + 1e-9).all()
    distances = np.linalg.norm(vertices[:, :2] - robot["base_m"], axis=1)
    assert distances.max() == pytest.approx(robot["reach_m"], abs=1e-6)
    assert 0.0 < vertices[:, 2].min() < vertices[:, 2].max() < 0.002


@pytest.mark.parametrize("name", REACH["robots"])
def test_a_robot_is_only_seen(name):
    plant, _, model = parsed(url=f"package://physid_drake_models/robots/{name}.sdf")
    assert plant.num_collision_geometries() == 0
    figure = plant.GetBodyByName("figure", model)
    x, y, _ = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), figure).translation()
    assert [x, y] == REACH["robots"][name]["base_m"]


# ------------------------------------------------------------------------------------------------- hand


def hands():
    yield from ((tip, length, None) for tip, length in (("cylinder", 0.06), ("capsule", 0.06), ("sphere", None)))
    yield from (("reflex_sf", None, preshape) for preshape in PRESHAPES.values())


@pytest.mark.parametrize(("tip", "length", "preshape"), list(hands()))
@pytest.mark.parametrize("forearm", [True, False])
def test_p_is_at_the_centre_of_the_tip_and_upright(tip, length, preshape, forearm):
    plant, inspector, model = parsed(text=hand_model_sdf(tip, 0.012, length, preshape, forearm=forearm))
    context = plant.CreateDefaultContext()
    X_WP = plant.GetFrameByName("P", model).CalcPoseInWorld(context)
    np.testing.assert_allclose(X_WP.GetAsMatrix4(), np.eye(4), atol=1e-12)
    (gid,) = inspector.GetAllGeometryIds(Role.kProximity)
    body = plant.GetBodyFromFrameId(inspector.GetFrameId(gid))
    X_WG = plant.EvalBodyPoseInWorld(context, body) @ inspector.GetPoseInFrame(gid)
    np.testing.assert_allclose(X_WG.translation(), np.zeros(3), atol=1e-12)
    shape = inspector.GetShape(gid)
    assert shape.radius() == pytest.approx(0.012)
    if length is not None:
        assert shape.length() == pytest.approx(length)
        np.testing.assert_allclose(X_WG.rotation().matrix()[:, 2], [0.0, 0.0, 1.0], atol=1e-12)


@pytest.mark.parametrize("preshape", PRESHAPES.values(), ids=PRESHAPES.keys())
def test_the_reflex_hand_hangs_palm_down_and_nothing_in_it_moves(preshape):
    plant, _, model = parsed(text=hand_model_sdf("reflex_sf", 0.01, preshape=preshape))
    palm = plant.GetBodyByName("palm", model)
    R_WH = plant.EvalBodyPoseInWorld(plant.CreateDefaultContext(), palm).rotation().matrix()
    np.testing.assert_allclose(R_WH[:, 2], [0.0, 0.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(R_WH[:2, 0], [math.cos(preshape.yaw), math.sin(preshape.yaw)], atol=1e-12)
    assert plant.num_velocities(model) == 6  # of the free palm
    assert {f"{link}_{k}" for link in ("proximal", "distal") for k in (1, 2, 3)} <= {
        plant.get_body(i).name() for i in plant.GetBodyIndices(model)
    }


def test_the_default_tip_points_straight_down_and_is_the_lowest_part():
    plant, inspector, model = parsed(text=hand_model_sdf("reflex_sf", 0.01))
    context = plant.CreateDefaultContext()
    distal = plant.EvalBodyPoseInWorld(context, plant.GetBodyByName("distal_1", model))
    np.testing.assert_allclose(distal.rotation().matrix()[:, 0], [0.0, 0.0, -1.0], atol=1e-12)
    lowest = {}
    for index in plant.GetBodyIndices(model):
        body = plant.get_body(index)
        for gid in plant.GetVisualGeometriesForBody(body):
            box = inspector.GetObbInGeometryFrame(gid)
            X_WO = plant.EvalBodyPoseInWorld(context, body) @ inspector.GetPoseInFrame(gid) @ box.pose()
            reach = np.abs(X_WO.rotation().matrix()[2]) @ box.half_width()
            lowest[inspector.GetName(gid)] = X_WO.translation()[2] - reach
    finger = re.compile(r".*(_1|tip)$")
    assert min(z for name, z in lowest.items() if name.endswith("tip")) == pytest.approx(-0.01)
    assert min(z for name, z in lowest.items() if not finger.match(name)) > 0.05  # clears the eraser and plates


def test_spread_turns_fingers_one_and_two_apart_and_leaves_the_third():
    def directions(spread):
        text = hand_model_sdf("reflex_sf", 0.01, preshape=Preshape(spread=spread, proximal=(0.0, 0.0, 0.0)))
        plant, _, model = parsed(text=text)
        context = plant.CreateDefaultContext()
        palm = plant.GetFrameByName("palm", model)
        return [
            plant.GetFrameByName(f"proximal_{k}", model).CalcPose(context, palm).rotation().matrix()[:, 0]
            for k in (1, 2, 3)
        ]

    np.testing.assert_allclose(directions(0.0), [[1, 0, 0], [1, 0, 0], [-1, 0, 0]], atol=1e-12)
    s, c = math.sin(0.5), math.cos(0.5)
    np.testing.assert_allclose(directions(0.5), [[c, -s, 0], [c, s, 0], [-1, 0, 0]], atol=1e-12)


@pytest.mark.parametrize(("tip", "length", "preshape"), list(hands()))
def test_a_hands_looks_have_their_tip_at_p(tip, length, preshape):
    looks = {one.name: one for one in hand_looks(tip, 0.01, length, preshape)}
    np.testing.assert_allclose(looks["tip"].X_PG.translation(), np.zeros(3), atol=1e-12)
    assert (looks["tip"].rgba.r(), looks["tip"].rgba.g(), looks["tip"].rgba.b()) == pytest.approx((0.9, 0.5, 0.2))


def test_the_looks_stand_as_in_the_parsed_model():
    looks = {one.name: one for one in hand_looks("reflex_sf", 0.01, preshape=PRESHAPES["bent"])}
    other, other_inspector, model = parsed(text=hand_model_sdf("reflex_sf", 0.01, preshape=PRESHAPES["bent"]))
    context = other.CreateDefaultContext()
    count = 0
    for index in other.GetBodyIndices(model):
        body = other.get_body(index)
        for gid in other.GetVisualGeometriesForBody(body):
            X_WG = other.EvalBodyPoseInWorld(context, body) @ other_inspector.GetPoseInFrame(gid)
            name = other_inspector.GetName(gid).rpartition("::")[2]
            assert looks[name].X_PG.IsNearlyEqualTo(X_WG, 1e-12)
            count += 1
    assert count == len(looks) > 20
    assert isinstance(looks["tip"].shape, Sphere)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("paw", 0.01), r"one of cylinder, sphere, capsule, reflex_sf, but got 'paw'"),
        (("sphere", 0.0), r"positive radius, but got 0.0 m"),
        (("cylinder", 0.01), r"positive length, but got None m"),
        (("capsule", 0.01, math.nan), r"positive length, but got nan m"),
        (("sphere", 0.01, 0.06), r"has no length"),
        (("reflex_sf", 0.01, 0.06), r"has no length"),
        (("sphere", 0.01, None, Preshape()), r"has no fingers"),
    ],
)
def test_a_hand_that_cannot_be_is_refused(arguments, message):
    with pytest.raises(CellError, match=message):
        hand_model_sdf(*arguments)


@pytest.mark.parametrize(
    ("angles", "message"),
    [
        ({"spread": 2.0}, r"spread must lie in \[0, 1.571\] rad, but got 2.0 rad"),
        ({"proximal": (0.1, 0.2)}, r"proximal needs 3 angles"),
        ({"distal": (0.1, -0.2, 0.1)}, r"distal must lie in \[0, 2.2\] rad, but got -0.2 rad"),
        ({"yaw": math.inf}, r"yaw must be finite"),
    ],
)
def test_a_pre_shape_beyond_the_joints_is_refused(angles, message):
    with pytest.raises(CellError, match=message):
        Preshape(**angles)


def test_a_yaw_turns_the_hand_about_its_tip():
    looks = {one.name: one.X_PG for one in hand_looks("reflex_sf", 0.01)}
    turned = {one.name: one.X_PG for one in hand_looks("reflex_sf", 0.01, preshape=Preshape(yaw=1.0))}
    X_PP = RigidTransform(RollPitchYaw(0.0, 0.0, 1.0), np.zeros(3))
    for name, X_PG in looks.items():
        assert turned[name].IsNearlyEqualTo(X_PP @ X_PG, 1e-12)
    assert looks["palm"].translation()[0] < -0.02  # the palm is behind a push along x
