"""The effects' forces as a system of the cell's diagram, for users who simulate the diagram themselves.

It calls the same laws as ``Cell.rollout``, and like it samples them at every tick and holds them: a Python law that
the solver evaluated and linearised within its steps would cost many times as much.
"""

from __future__ import annotations

import copy
import dataclasses as dc
from collections.abc import Sequence

from pydrake.common.cpp_param import List
from pydrake.common.value import AbstractValue, Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.systems.framework import Context, DiagramBuilder, LeafSystem, State

from physid_drake.cell import Body
from physid_drake.cell.diagram import Scene
from physid_drake.cell.forces import ForceLaw, FrictionLaw, total_wrenches
from physid_drake.cell.object_state import StateReader, reader_of

NAME = "effect_forces"


class EffectForces(LeafSystem):
    """Forces of laws on the object, held over a tick.

    Ports: ``object.state_estimated`` (13,) in, the object's positions and velocities;
    ``object.force_commanded`` out, for the plant's applied spatial forces.
    """

    def __init__(
        self,
        scene: Scene,
        reader: StateReader,
        tick: float,
        laws: Sequence[ForceLaw],
        frictions: Sequence[FrictionLaw],
    ) -> None:
        """Prepare.

        Args:
            scene: whose object is pushed.
            reader: sees the object's state.
            tick: s.
            laws: forces.
            frictions: friction laws; the contact must hold their largest friction.
        """
        LeafSystem.__init__(self)
        self.set_name(NAME)
        self._reader, self._tick, self._laws, self._frictions = reader, tick, tuple(laws), tuple(frictions)
        # A liquid has a motion of its own: it is the Context's, whose clones copy it; each simulation begins anew.
        self.DeclareAbstractState(AbstractValue.Make(self._fresh()))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
        self._body = scene.object.index()
        self.DeclareVectorInputPort("object.state_estimated", 13)
        self.DeclareDiscreteState(5)  # the sum of the laws' wrenches
        self.DeclarePeriodicUnrestrictedUpdateEvent(tick, 0.0, self._sample)
        self.DeclareAbstractOutputPort(
            "object.force_commanded",
            lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]),
            self._forces,
            {self.xd_ticket()},
        )

    def _fresh(self) -> list[ForceLaw]:
        return copy.deepcopy(list(self._laws))

    def _begin(self, context: Context, state: State) -> None:
        del context
        state.get_mutable_abstract_state(0).set_value(self._fresh())

    def _sample(self, context: Context, state: State) -> None:
        x = self.get_input_port().Eval(context).tolist()
        seen = self._reader.at(context.get_time(), self._tick, x[:7], x[7:])
        laws = state.get_mutable_abstract_state(0).get_mutable_value()
        wrenches = total_wrenches(seen, laws, self._frictions)
        total = [sum(parts) for parts in zip(*map(dc.astuple, wrenches), strict=True)]
        state.get_mutable_discrete_state().set_value(total)

    def _forces(self, context: Context, output: Value[List[ExternallyAppliedSpatialForce]]) -> None:
        fx, fy, torque, tip_x, tip_y = context.get_discrete_state_vector().value().tolist()
        force = ExternallyAppliedSpatialForce()
        force.body_index = self._body
        force.p_BoBq_B = [self._reader.p_BBcm.real, self._reader.p_BBcm.imag, 0.0]
        force.F_Bq_W = SpatialForce(tau=[tip_x, tip_y, torque], f=[fx, fy, 0.0])
        output.set_value([force])


def add_effect_forces(
    builder: DiagramBuilder,
    scene: Scene,
    body: Body,
    tick: float,
    laws: Sequence[ForceLaw],
    frictions: Sequence[FrictionLaw],
) -> EffectForces:
    """Add the system to a cell's diagram and connect it to the plant.

    Args:
        builder: of the cell's diagram.
        scene: the cell's.
        body: the object's parameters, without the friction laws' surplus.
        tick: s.
        laws: forces.
        frictions: friction laws.
    """
    plant = scene.plant
    # Drake's step moves by the velocity at its end, not as a rollout does: see ``ObjectState.p_WBcm_held``. And it
    # is Drake's own, with the friction of its contact as it is.
    reader = dc.replace(reader_of(body, scene), lead=0.0, lifted=False)
    system: EffectForces = builder.AddSystem(EffectForces(scene, reader, tick, laws, frictions))
    builder.Connect(plant.get_state_output_port(scene.object.model_instance()), system.get_input_port())
    builder.Connect(system.get_output_port(), plant.get_applied_spatial_force_input_port())
    return system
