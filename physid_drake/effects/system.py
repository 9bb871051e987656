"""The effects' forces as a system of the cell's diagram, for users who simulate the diagram themselves.

It calls the same laws as ``Cell.rollout``, and like it once for every time step, with the state that the time step
begins with: a Python law that the solver evaluated and linearised within its steps would cost many times as much.
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
    """Forces of laws on the object, as they are when a step of the plant begins.

    Ports: ``object.state_estimated`` (13,) in, the object's positions and velocities;
    ``object.force_commanded`` out, for the plant's applied spatial forces.
    """

    def __init__(
        self,
        scene: Scene,
        reader: StateReader,
        time_step: float,
        laws: Sequence[ForceLaw],
        frictions: Sequence[FrictionLaw],
    ) -> None:
        """Prepare.

        Args:
            scene: whose object is pushed.
            reader: sees the object's state.
            time_step: s.
            laws: forces.
            frictions: friction laws; the contact must hold their largest friction.
        """
        LeafSystem.__init__(self)
        self.set_name(NAME)
        self._reader, self._time_step, self._laws, self._frictions = reader, time_step, tuple(laws), tuple(frictions)
        # A liquid has a motion of its own: it is the Context's, whose clones copy it; each simulation begins anew.
        self.DeclareAbstractState(AbstractValue.Make(self._fresh()))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._begin)
        self._body = scene.object.index()
        self.DeclareVectorInputPort("object.state_estimated", 13)
        self.DeclarePeriodicUnrestrictedUpdateEvent(time_step, 0.0, self._advance)
        # Of the state when the plant's step begins: held from the step before, a spring would gain energy.
        self.DeclareAbstractOutputPort(
            "object.force_commanded",
            lambda: AbstractValue.Make([ExternallyAppliedSpatialForce()]),
            self._forces,
            {self.input_port_ticket(self.get_input_port().get_index()), self.all_state_ticket(), self.time_ticket()},
        )

    def _fresh(self) -> list[ForceLaw]:
        return copy.deepcopy(list(self._laws))

    def _begin(self, context: Context, state: State) -> None:
        del context
        state.get_mutable_abstract_state(0).set_value(self._fresh())

    def _advance(self, context: Context, state: State) -> None:
        """Let what moves with the laws move on by a time step."""
        self._total(context, state.get_mutable_abstract_state(0).get_mutable_value())

    def _total(self, context: Context, laws: list[ForceLaw]) -> list[float]:
        """Sum of the laws' wrenches over the next time step, of which laws with a motion of their own take a step."""
        x = self.get_input_port().Eval(context).tolist()
        seen = self._reader.at(context.get_time(), self._time_step, x[:7], x[7:])
        wrenches = total_wrenches(seen, laws, self._frictions)
        return [sum(parts) for parts in zip(*map(dc.astuple, wrenches), strict=True)]

    def _forces(self, context: Context, output: Value[List[ExternallyAppliedSpatialForce]]) -> None:
        laws = copy.deepcopy(context.get_abstract_state(0).get_value())
        fx, fy, torque, tip_x, tip_y = self._total(context, laws)
        force = ExternallyAppliedSpatialForce()
        force.body_index = self._body
        force.p_BoBq_B = [self._reader.p_BBcm.real, self._reader.p_BBcm.imag, 0.0]
        force.F_Bq_W = SpatialForce(tau=[tip_x, tip_y, torque], f=[fx, fy, 0.0])
        output.set_value([force])


def add_effect_forces(
    builder: DiagramBuilder,
    scene: Scene,
    body: Body,
    time_step: float,
    laws: Sequence[ForceLaw],
    frictions: Sequence[FrictionLaw],
) -> EffectForces:
    """Add the system to a cell's diagram and connect it to the plant.

    Args:
        builder: of the cell's diagram.
        scene: the cell's.
        body: the object's parameters, without the friction laws' surplus.
        time_step: s.
        laws: forces.
        frictions: friction laws.
    """
    plant = scene.plant
    # Drake's step moves by the velocity at its end, not as a rollout does: see ``ObjectState.p_WBcm_held``. And it
    # is Drake's own, with the friction of its contact as it is.
    reader = dc.replace(reader_of(body, scene), lead=0.0, lifted=False)
    system: EffectForces = builder.AddSystem(EffectForces(scene, reader, time_step, laws, frictions))
    builder.Connect(plant.get_state_output_port(scene.object.model_instance()), system.get_input_port())
    builder.Connect(system.get_output_port(), plant.get_applied_spatial_force_input_port())
    return system
