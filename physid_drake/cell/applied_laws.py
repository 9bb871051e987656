"""Force and friction laws at work on the object over a rollout: their impulses, and whether friction holds them."""

from __future__ import annotations

import dataclasses as dc
import math
from collections.abc import Sequence

from physid_drake.cell.forces import ForceLaw, FrictionLaw, Frictions, Wrench, swings, total_wrenches
from physid_drake.cell.object_state import SLOWEST, ObjectState
from physid_drake.cell.plant_state import PlantState

SURELY_HELD = 0.5  # of the friction: a resting object under less does not slide
CREEP = 10.0 * SLOWEST  # m/s: slow, and friction does not fade


class AppliedLaws:
    """The laws of one rollout."""

    def __init__(self, laws: Sequence[ForceLaw], frictions: Sequence[FrictionLaw]) -> None:
        """``frictions`` give back what the contact, which holds their largest friction, has too much."""
        self._laws, self._frictions = laws, frictions
        self._largest = Frictions(tuple(frictions)).largest

    def act(self, state: PlantState, time: float, span: float) -> None:
        """Add the laws' impulses over a time step [s] to the object's velocities, less what the contact overdoes."""
        state.give_back_lift(span, self._largest)
        if not (self._laws or self._frictions or state.turns()):
            return
        seen = state.object_state(time, span)
        for wrench in total_wrenches(seen, self._laws, self._frictions):
            state.kick(seen.yaw, span * wrench.fx, span * wrench.fy, span * wrench.torque)
            if wrench.tip_x or wrench.tip_y:
                state.rock(seen.yaw, span * wrench.tip_x, span * wrench.tip_y)

    def are_held(self, state: PlantState, time: float, span: float) -> bool:
        """Whether friction surely holds a resting object against the laws' forces over a time step [s]."""
        if not self._laws:
            return True
        seen = state.object_state(time, span)
        reach = math.sqrt(seen.inertia / seen.mass)
        wrenches = [law.wrench(seen) for law in self._laws]
        pull = sum(math.hypot(w.fx, w.fy) + abs(w.torque) / reach for w in wrenches)
        pull += sum(law.strongest() for law in self._laws if swings(law))
        return pull < SURELY_HELD * self._friction_at_a_creep(seen, wrenches)

    def _friction_at_a_creep(self, seen: ObjectState, wrenches: Sequence[Wrench]) -> float:
        """What bears an object that begins to slide where the forces pull it [N]: of a slippery patch, little."""
        force = complex(sum(w.fx for w in wrenches), sum(w.fy for w in wrenches))
        if not self._frictions or force == 0.0:
            return float(seen.holding.sum())
        creeping = dc.replace(seen, v_WBo=CREEP * force / abs(force), yaw_rate=0.0)
        return float(seen.holding @ Frictions(tuple(self._frictions)).ratio(creeping).real)
