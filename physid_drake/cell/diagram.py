"""The Drake diagram of table, object and hand."""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.common import MemoryFile
from pydrake.geometry import (
    AddCompliantHydroelasticPropertiesForHalfSpace,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    CollisionFilterDeclaration,
    GeometryId,
    GeometrySet,
    HalfSpace,
    InMemoryMesh,
    Mesh,
    ProximityProperties,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, MultibodyPlant, MultibodyPlantConfig
from pydrake.multibody.tree import PdControllerGains, PrismaticJoint, RigidBody, SpatialInertia, UnitInertia
from pydrake.systems.framework import DiagramBuilder

from physid_drake.cell.config import CellConfig
from physid_drake.cell.outline import Disc, Outline
from physid_drake.cell.solid import Solid
from physid_drake.cell.support import FrictionGrid, PressureGrid, Support, axis_support, support_of

Array = NDArray[np.float64]

GRAVITY = 9.81  # m/s^2, as Drake's default gravity field
TABLE_FRICTION = 1e6  # so rough that each pair's friction is set by the other side alone (see `paired_friction`)
SLENDER = 2.5  # height over radius above which an object leans notably under load transfer
FOOT_RADIUS = 3e-3  # m, of a support sphere; only its lowest point matters
HAND_MASS = 1e5  # kg, at most: see ``Stepper``, which chooses it for each push
DRIVEN_MASS = 1.0  # kg of each link of a hand that actuators move
DRIVEN_FREQUENCY = 1000.0  # rad/s at which it follows what is wanted: 10 N move it by 3 to 10 micrometres
DRIVEN_DISSIPATION = 30.0  # s/m (Hunt and Crossley) of its contact: at 0.1 m/s, as good as no bounce
SLAB_THICKNESS = 0.01  # m of the compliant table; only modulus / thickness matters
FACET_SHARE = 0.2  # of its cell's width: a facet's side, so small that its pressure is that of one point

logging.getLogger("drake").setLevel(logging.ERROR)  # silences a remark on half spaces and deformables


def paired_friction(mu: float) -> float:
    """The coefficient that gives exactly ``mu`` against ``TABLE_FRICTION`` in Drake's mean 2ab/(a+b)."""
    return mu * TABLE_FRICTION / (2.0 * TABLE_FRICTION - mu)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """The parts of a cell's diagram that the setters and the rollout speak to.

    Attributes:
        plant: named ``plant``, which CENIC asks for.
        scene_graph: registered with the plant.
        object: the pushed body, frame B.
        table_geometry: the half space.
        feet: geometry ids under the object, each with the indices of the support points it carries.
        foot_cells: the friction cell of each of ``feet``.
        hand_geometry: the tip's sphere; None without a hand.
        face_geometries: what the hand touches.
        support: the quadrature.
        solid: the object's shape.
        joints: the hand's prismatic joints x, y, z; empty without a hand.
        gravity: m/s^2.
        rest_depth: how deep an evenly loaded underside is in the table [m].
        lifts: whether friction follows depths that are larger than the loads (`ObjectState.lifts`): hydroelastic
            contact under CENIC's lagged approximation.
        driven: whether actuators move the hand, and not the rollout.
        edge: lower and upper corner of a table that ends, x + iy [m]; None where it does not.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    object: RigidBody
    table_geometry: GeometryId
    feet: tuple[tuple[GeometryId, tuple[int, ...]], ...]
    foot_cells: tuple[int, ...]
    hand_geometry: GeometryId | None
    face_geometries: tuple[GeometryId, ...]
    support: Support
    solid: Solid
    joints: tuple[PrismaticJoint, ...]
    gravity: float
    rest_depth: float
    lifts: bool
    driven: bool = False
    edge: tuple[complex, complex] | None = None


def contact_properties(*, friction: float, static_friction: float | None = None, stiffness: float | None = None,
                       dissipation: float = 0.0) -> ProximityProperties:  # fmt: skip
    """Proximity properties of a contact material; stiffness in N/m, dissipation in s/m."""
    properties = ProximityProperties()
    mu = CoulombFriction(max(static_friction or friction, friction), friction)
    if stiffness is None:
        AddContactMaterial(dissipation=dissipation, friction=mu, properties=properties)
    else:
        AddContactMaterial(dissipation=dissipation, point_stiffness=stiffness, friction=mu, properties=properties)
    return properties


def add_scene(
    builder: DiagramBuilder,
    config: CellConfig,
    solid: Solid,
    hand_radius: float | None,
    *,
    edge: Array | None,
    pressure: PressureGrid | None = None,
    gravity: float = GRAVITY,
    inertia: SpatialInertia | None = None,
    driven: bool = False,
) -> Scene:
    """Add plant and scene graph of a cell to a diagram builder.

    Args:
        builder: the root diagram's builder (CENIC wants the plant right below the root).
        config: the cell's configuration.
        solid: the object.
        hand_radius: of the tip [m]; None without a hand.
        edge: (2, 2) lower and upper corner of the table top [m] for a table that an object can fall from;
            None for an endless one, which is faster.
        pressure: under the object, where it is not even.
        gravity: m/s^2.
        inertia: M_BBo_B of the object in every Context; None for one that a setter replaces.
        driven: whether actuators move the hand; they take discrete steps.
    """
    discrete = config.solver.scheme != "cenic"
    hydroelastic = config.contact.model == "hydroelastic" and edge is None and solid.rolling_radius is None
    plant, scene_graph = AddMultibodyPlant(
        MultibodyPlantConfig(
            time_step=config.solver.time_step_s if discrete else 0.0,
            contact_model="hydroelastic_with_fallback" if hydroelastic else "point",
            discrete_contact_approximation=config.solver.scheme if discrete else "lagged",
            stiction_tolerance=config.contact.stiction_tolerance_mps,
        ),
        builder,
    )
    plant.set_name("plant")
    plant.mutable_gravity_field().set_gravity_vector(np.array([0.0, 0.0, -gravity]))
    grid = FrictionGrid(nx=config.friction_cells[0], ny=config.friction_cells[1])
    support = support_of(solid.underside, grid, config.contact.support_points, pressure=pressure)
    if solid.rolling_radius is not None:
        support = axis_support(support, grid, solid.underside)

    table = _add_table(plant, edge, hydroelastic)
    body, feet, foot_cells = _add_object(plant, solid, support, hydroelastic, inertia)
    rough = contact_properties(friction=TABLE_FRICTION, stiffness=1e3)
    faces = tuple(
        plant.RegisterCollisionGeometry(body, X_BG, shape, f"face_{i}", rough)
        for i, (shape, X_BG) in enumerate(solid.faces)
    )  # fmt: skip
    for i, (shape, X_BG) in enumerate(solid.visual):
        plant.RegisterVisualGeometry(body, X_BG, shape, f"look_{i}", np.array([0.35, 0.55, 0.8, 1.0]))
    joints, hand = _add_hand(plant, hand_radius, driven) if hand_radius is not None else ((), None)
    plant.Finalize()
    _filter_collisions(scene_graph, table, [gid for gid, _ in feet], faces, hand)
    return Scene(
        plant=plant, scene_graph=scene_graph, object=body, table_geometry=table, feet=feet, foot_cells=foot_cells,
        hand_geometry=hand, face_geometries=faces, support=support, solid=solid, joints=joints, gravity=gravity,
        rest_depth=config.contact.rest_depth_m * _stiffer(solid), lifts=hydroelastic and not discrete,
        driven=driven,
        edge=None if edge is None else (complex(*edge[0]), complex(*edge[1])),
    )  # fmt: skip


def _stiffer(solid: Solid) -> float:
    """Share of the rest depth that a slender object gets: it leans in proportion to depth and slenderness squared."""
    if solid.rolling_radius is not None:
        return 1.0
    x0, y0, x1, y1 = solid.underside.extent()
    radius = 0.5 * min(x1 - x0, y1 - y0)
    return float(np.clip((SLENDER * radius / solid.height) ** 2, 1.0 / 3.0, 1.0))


def _add_table(plant: MultibodyPlant, edge: Array | None, hydroelastic: bool) -> GeometryId:
    world = plant.world_body()
    properties = contact_properties(friction=TABLE_FRICTION, stiffness=1e12)
    if hydroelastic:
        # The modulus is written by the support's setter, which knows the weight.
        AddCompliantHydroelasticPropertiesForHalfSpace(SLAB_THICKNESS, 1e4, properties)
    if edge is None:
        return plant.RegisterCollisionGeometry(world, RigidTransform(), HalfSpace(), "table", properties)
    size = edge[1] - edge[0]
    centre = np.array([*(0.5 * (edge[0] + edge[1])), -0.05])
    top = Box(float(size[0]), float(size[1]), 0.1)
    return plant.RegisterCollisionGeometry(world, RigidTransform(centre), top, "table", properties)


def _add_object(
    plant: MultibodyPlant, solid: Solid, support: Support, hydroelastic: bool, inertia: SpatialInertia | None
) -> tuple[RigidBody, tuple[tuple[GeometryId, tuple[int, ...]], ...], tuple[int, ...]]:
    body = plant.AddRigidBody("object", inertia or spatial_inertia(solid, 1.0, (0.0, 0.0), 1.0))
    bottom = -0.5 * solid.height
    feet, foot_cells = [], []
    if hydroelastic:
        for cell in np.unique(support.cells):
            members = tuple(int(i) for i in np.flatnonzero(support.cells == cell))
            properties = contact_properties(friction=paired_friction(0.3))
            AddRigidHydroelasticProperties(properties)
            mesh = _facets(support, members, solid.underside)
            gid = plant.RegisterCollisionGeometry(
                body, RigidTransform([0.0, 0.0, bottom]), mesh, f"cell_{cell}", properties
            )
            feet.append((gid, members))
            foot_cells.append(int(cell))
        return body, tuple(feet), tuple(foot_cells)
    radius = solid.rolling_radius or FOOT_RADIUS
    for i, (x, y) in enumerate(support.points):
        gid = plant.RegisterCollisionGeometry(
            body, RigidTransform([x, y, bottom + radius]), Sphere(radius), f"foot_{i}",
            contact_properties(friction=paired_friction(0.3), stiffness=1e3),
        )  # fmt: skip
        feet.append((gid, (i,)))
        foot_cells.append(int(support.cells[i]))
    return body, tuple(feet), tuple(foot_cells)


def spatial_inertia(solid: Solid, mass: float, com: tuple[float, float], ratio: float) -> SpatialInertia:
    """M_BBo_B of a solid.

    Args:
        solid: its shape.
        mass: kg.
        com: centre of mass in B, at half height [m].
        ratio: inertia over that of uniform density [-].
    """
    p_BBcm = np.array([*com, 0.0])
    central = UnitInertia(*(ratio * np.array(solid.gyration)))
    return SpatialInertia(mass, p_BBcm, central.ShiftFromCenterOfMass(p_BBcm))


def _extent_area(outline: Outline) -> float:
    """Area of a disc, or of the rectangle about a polygon [m^2]: the scale of the facets, which need not tile it."""
    if isinstance(outline, Disc):
        return math.pi * outline.radius**2
    x0, y0, x1, y1 = outline.extent()
    return (x1 - x0) * (y1 - y0)


def facet_areas(support: Support, outline: Outline) -> Array:
    """Areas (n,) of the hydroelastic facets: small, in proportion to the quadrature's weights [m^2]."""
    return support.weights * _extent_area(outline) * FACET_SHARE**2


def _facets(support: Support, members: tuple[int, ...], outline: Outline) -> Mesh:
    """One small triangle per quadrature point, facing down: Drake integrates pressure at its centroid.

    The facets need not tile the underside: the pressure under a rigid face on a compliant table is linear,
    and areas in proportion to Gauss weights integrate it exactly, with a tenth of the faces of a tiling.
    """
    areas = facet_areas(support, outline)
    vertices, faces = [], []
    for i in members:
        x, y = support.points[i]
        reach = math.sqrt(areas[i] * 4.0 / (3.0 * math.sqrt(3.0)))  # circumradius of an equilateral triangle
        for k in range(3):
            # Clockwise from above, so that the outward normal points down into the table.
            angle = -2.0 * math.pi * k / 3.0
            vertices.append(f"v {x + reach * math.cos(angle):.12g} {y + reach * math.sin(angle):.12g} 0")
        n = len(vertices)
        faces.append(f"f {n - 2} {n - 1} {n}")
    text = "\n".join([*vertices, *faces]) + "\n"
    return Mesh(mesh_data=InMemoryMesh(mesh_file=MemoryFile(text, ".obj", "facets")))


def _add_hand(plant: MultibodyPlant, radius: float, driven: bool) -> tuple[tuple[PrismaticJoint, ...], GeometryId]:
    """A sphere at the contact height: against vertical faces it is an upright cylinder without its ambiguity."""
    hand = plant.AddModelInstance("hand")
    plant.set_gravity_enabled(hand, False)
    mass = DRIVEN_MASS if driven else HAND_MASS
    inertia = SpatialInertia(mass, np.zeros(3), UnitInertia.SolidSphere(radius))
    parent = plant.world_frame()
    joints = []
    for name, axis in (("hand_x", [1, 0, 0]), ("hand_y", [0, 1, 0]), ("hand_z", [0, 0, 1])):
        link = plant.AddRigidBody(name, hand, inertia)
        joints.append(plant.AddJoint(PrismaticJoint(name, parent, link.body_frame(), axis)))
        parent = link.body_frame()
        if driven:
            actuator = plant.AddJointActuator(name, joints[-1])
            carried = (3 - len(joints) + 1) * mass
            gains = PdControllerGains(p=carried * DRIVEN_FREQUENCY**2, d=2.0 * carried * DRIVEN_FREQUENCY)
            actuator.set_controller_gains(gains)
    properties = contact_properties(friction=paired_friction(0.3), stiffness=1e12)
    geometry = plant.RegisterCollisionGeometry(link, RigidTransform(), Sphere(radius), "tip", properties)
    plant.RegisterVisualGeometry(link, RigidTransform(), Sphere(radius), "tip_look", np.array([0.9, 0.5, 0.2, 1.0]))
    return tuple(joints), geometry


def _filter_collisions(
    scene_graph: SceneGraph,
    table: GeometryId,
    feet: list[GeometryId],
    faces: tuple[GeometryId, ...],
    hand: GeometryId | None,
) -> None:
    """Feet meet the table only, faces meet the hand only."""
    collisions = scene_graph.collision_filter_manager()
    upper = [*faces, *([hand] if hand is not None else [])]
    collisions.Apply(CollisionFilterDeclaration().ExcludeBetween(GeometrySet(upper), GeometrySet([table])))
    if hand is not None:
        collisions.Apply(CollisionFilterDeclaration().ExcludeBetween(GeometrySet(feet), GeometrySet([hand])))
