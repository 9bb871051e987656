"""Parameter setters: small systems that hold theta in the diagram's Context and write it into the plant's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import (
    AddCompliantHydroelasticPropertiesForHalfSpace,
    AddRigidHydroelasticProperties,
    GeometryId,
    ProximityProperties,
    RoleAssign,
)
from pydrake.systems.framework import Context
from pydrake.systems.primitives import ConstantVectorSource

from physid_drake.cell.config import CellConfig
from physid_drake.cell.diagram import (
    DRIVEN_DISSIPATION,
    SLAB_THICKNESS,
    TABLE_FRICTION,
    Scene,
    contact_properties,
    facet_areas,
    paired_friction,
    spatial_inertia,
)
from physid_drake.errors import ParameterError

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Body:
    """The physical parameters of a cell, as the rollout uses them.

    Attributes:
        mass: kg.
        p_BBcm: (2,) centre of mass in B, at half height [m].
        inertia_ratio: inertia over that of uniform density [-].
        hand_friction: between hand and object [-].
        support_friction: (cells,) kinetic, between object and table [-].
        static_ratio: static over kinetic support friction [-], >= 1, against the hand; laws' forces, which act as
            impulses, meet the kinetic one. Discrete solvers know only that.
        restitution: Poisson's, between hand and object [-].
    """

    mass: float
    p_BBcm: Array
    inertia_ratio: float
    hand_friction: float
    support_friction: Array
    static_ratio: float = 1.0
    restitution: float = 0.0


class ParameterSetter:
    """Keeps a part of theta in the diagram's Context, and writes it from there into the plant's.

    The numbers are the numeric parameter of a Drake ``ConstantVectorSource`` named ``<parameter>_setter``, so that
    they are seen in the diagram and on an output port. (A system written in Python would do, but every one costs
    each of Drake's steps three microseconds, Drake 1.51.)

    Attributes:
        system: the source, to be added to the diagram.
        scene: what is written into.
    """

    def __init__(self, name: str, scene: Scene, size: int) -> None:
        self._name = name
        self.system = ConstantVectorSource(np.zeros(size))
        self.system.set_name(f"{name}_setter")
        self.scene = scene

    def value(self, root: Context) -> Array:
        """The numbers (size,) held in the diagram's Context."""
        value: Array = self.system.get_source_value(self.system.GetMyContextFromRoot(root)).CopyToVector()
        return value

    def apply(self, root: Context, body: Body) -> None:
        """Store this setter's part of ``body`` in its Context and write it into the plant's.

        Args:
            root: the diagram's Context.
            body: the parameters.
        """
        part = self.part_of(body)
        if np.array_equal(part, self.value(root)):
            return  # replacing the properties of all support points takes as long as twenty steps
        context = self.system.GetMyMutableContextFromRoot(root)
        self.system.get_mutable_source_value(context).SetFromVector(part)
        self.write(root, part)

    def make_default(self, body: Body) -> None:
        """Make this setter's part of ``body`` that of every Context that is made from now on; but for the inertia."""
        part = self.part_of(body)
        self.system = ConstantVectorSource(part)
        self.system.set_name(f"{self._name}_setter")
        self.write(None, part)

    def part_of(self, body: Body) -> Array:
        """This setter's numbers (size,)."""
        raise NotImplementedError

    def write(self, root: Context | None, value: Array) -> None:
        """Write the numbers into the plant's or the scene graph's Context; None: into what Contexts are made from."""
        raise NotImplementedError

    def replace(self, root: Context | None, geometry: GeometryId, properties: ProximityProperties) -> None:
        """Replace a geometry's proximity properties in this Context only, or in what Contexts are made from."""
        scene_graph, source = self.scene.scene_graph, self.scene.plant.get_source_id()
        if root is None:
            scene_graph.AssignRole(source, geometry, properties, RoleAssign.kReplace)
            return
        context = scene_graph.GetMyMutableContextFromRoot(root)
        scene_graph.AssignRole(context, source, geometry, properties, RoleAssign.kReplace)


class InertiaSetter(ParameterSetter):
    """Mass [kg], centre of mass x, y [m], inertia ratio [-]."""

    def __init__(self, scene: Scene) -> None:
        super().__init__("inertia", scene, 4)

    def part_of(self, body: Body) -> Array:
        """Mass, centre of mass, inertia ratio."""
        return np.array([body.mass, *body.p_BBcm, body.inertia_ratio])

    def write(self, root: Context | None, value: Array) -> None:
        """Write the object's spatial inertia M_BBo_B; that of every Context is given where the body is added."""
        if root is None:
            return
        mass, com_x, com_y, ratio = value.tolist()
        spatial = spatial_inertia(self.scene.solid, mass, (com_x, com_y), ratio)
        self.scene.object.SetSpatialInertiaInBodyFrame(self.scene.plant.GetMyMutableContextFromRoot(root), spatial)


class SupportSetter(ParameterSetter):
    """Static ratio, mass (the stiffness follows the weight), and kinetic friction per cell [-]."""

    def __init__(self, scene: Scene, config: CellConfig, cells: int) -> None:
        super().__init__("support_friction", scene, 2 + cells)
        self._dissipation = config.contact.dissipation_s_per_m
        self._hydroelastic = scene.solid.rolling_radius is None and any(len(points) > 1 for _, points in scene.feet)

    def part_of(self, body: Body) -> Array:
        """Static ratio, mass, frictions."""
        return np.array([body.static_ratio, body.mass, *body.support_friction])

    def write(self, root: Context | None, value: Array) -> None:
        """Write friction per foot, and the stiffness that gives the chosen rest depth."""
        ratio, mass, friction = value[0], value[1], value[2:]
        stiffness = mass * self.scene.gravity / self.scene.rest_depth
        if self._hydroelastic:
            self._write_modulus(root, stiffness)
        for (geometry, points), cell in zip(self.scene.feet, self.scene.foot_cells, strict=True):
            mu = paired_friction(float(friction[cell]))
            mu_static = paired_friction(float(friction[cell] * ratio))
            if self._hydroelastic:
                properties = contact_properties(friction=mu, static_friction=mu_static)
                AddRigidHydroelasticProperties(properties)
            else:
                share = float(self.scene.support.weights[points[0]])
                properties = contact_properties(
                    friction=mu,
                    static_friction=mu_static,
                    stiffness=stiffness * share,
                    dissipation=self._dissipation,
                )
            self.replace(root, geometry, properties)

    def _write_modulus(self, root: Context | None, stiffness: float) -> None:
        """The table's modulus [Pa]: stiffness = modulus / thickness * area of the facets."""
        area = float(facet_areas(self.scene.support, self.scene.solid.underside).sum())
        properties = contact_properties(friction=TABLE_FRICTION, dissipation=self._dissipation)
        AddCompliantHydroelasticPropertiesForHalfSpace(SLAB_THICKNESS, stiffness * SLAB_THICKNESS / area, properties)
        self.replace(root, self.scene.table_geometry, properties)


class HandContactSetter(ParameterSetter):
    """Hand friction [-] and mass [kg]: the contact's stiffness keeps its natural frequency."""

    def __init__(self, scene: Scene, config: CellConfig) -> None:
        super().__init__("hand_friction", scene, 2)
        self._frequency = config.contact.hand_frequency_rad_s

    def part_of(self, body: Body) -> Array:
        """Friction and mass."""
        return np.array([body.hand_friction, body.mass])

    def write(self, root: Context | None, value: Array) -> None:
        """Write the tip's friction and the faces' stiffness."""
        if self.scene.hand_geometry is None:
            return
        stiffness = float(value[1]) * self._frequency**2
        # A hand that Drake's contact moves touches without the cell's law of impact: it would bounce.
        dissipation = DRIVEN_DISSIPATION if self.scene.driven else 0.0
        tip = contact_properties(friction=paired_friction(float(value[0])), stiffness=1e6 * stiffness)
        self.replace(root, self.scene.hand_geometry, tip)
        for face in self.scene.face_geometries:
            rough = contact_properties(friction=TABLE_FRICTION, stiffness=stiffness, dissipation=dissipation)
            self.replace(root, face, rough)


def check_body(body: Body, cells: int) -> None:
    """Refuse parameters that no object has.

    Raises:
        ParameterError: naming the parameter, the rule and the value.
    """
    frictions = body.support_friction
    bad = frictions[~np.isfinite(frictions)]
    slippery = float(bad[0] if len(bad) else np.min(frictions))
    rules = [
        ("mass", body.mass, body.mass > 0.0, "above 0 kg"),
        ("inertia_ratio", body.inertia_ratio, body.inertia_ratio > 0.0, "above 0"),
        ("hand_friction", body.hand_friction, body.hand_friction >= 0.0, "at least 0"),
        ("support_friction", slippery, slippery >= 0.0, "at least 0"),
        ("com_x", float(body.p_BBcm[0]), True, "finite"),
        ("com_y", float(body.p_BBcm[1]), True, "finite"),
        ("static_ratio", body.static_ratio, body.static_ratio >= 1.0, "at least 1"),
        ("restitution", body.restitution, 0.0 <= body.restitution <= 1.0, "in [0, 1]"),
    ]  # fmt: skip
    for name, value, fine, rule in rules:
        if not (np.isfinite(value) and fine):
            raise ParameterError(f"{name} must be {rule}, but is {value:g}.")
    if len(body.support_friction) != cells:
        raise ParameterError(f"support_friction needs {cells} cells, but has {len(body.support_friction)}.")
