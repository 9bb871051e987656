"""The diagnosis as a Drake system: it looks at what an identification leaves once there is one."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from physid_drake.diagnose.evidence import Evidence
from physid_drake.diagnose.values import Diagnosis
from physid_drake.identify import Identification
from physid_drake.identify.system import PUSH_PERIOD
from physid_drake.optional import boxed, unboxed

Array = NDArray[np.float64]


@dc.dataclass(frozen=True, kw_only=True, eq=False)
class Examined:
    """An identification, and what a diagnosis says of it. It does not change, and ports need not copy it.

    Attributes:
        known: what was identified.
        diagnosis, evidence: what it says and what that rests on; None where nothing was diagnosed.
    """

    known: Identification
    diagnosis: Diagnosis | None = None
    evidence: Evidence | None = None

    def __deepcopy__(self, memo: Any) -> Examined:
        return self

    @property
    def theta(self) -> Array:
        """The identified theta (d,), by which a reader tells a new one."""
        return self.known.theta


class DiagnosisSystem(LeafSystem):
    """Diagnoses each new identification; its state holds the latest answer.

    .. pydrake_system::
        name: diagnosis
        input_ports:
        - identification.estimated
        output_ports:
        - diagnosis.estimated
    """

    def __init__(self, examine: Callable[[Identification], Examined], *, begin: float = 0.0) -> None:
        """Prepare.

        Args:
            examine: what to run on an identification.
            begin: when it first looks at one [s], so as not to diagnose what is soon replaced.
        """
        LeafSystem.__init__(self)
        self.set_name("diagnosis")
        self._examine = examine
        self.DeclareAbstractInputPort("identification.estimated", Value[object]())
        self._memory = self.DeclareAbstractState(Value[object](boxed(None)))
        self.DeclareAbstractOutputPort("diagnosis.estimated", Value[object], self._copy, {self.all_state_ticket()})
        self.DeclarePeriodicUnrestrictedUpdateEvent(PUSH_PERIOD, begin, self._receive)

    def examined(self, context: Context) -> Examined | None:
        """The latest answer held in the state; None before the first."""
        latest: Examined | None = unboxed(context.get_abstract_state(self._memory).get_value())
        return latest

    def _receive(self, context: Context, state: State) -> EventStatus:
        known: Identification | None = unboxed(self.GetInputPort("identification.estimated").Eval(context))
        latest = self.examined(context)
        if known is not None and (latest is None or latest.known is not known):
            state.get_mutable_abstract_state(self._memory).set_value(boxed(self._examine(known)))
        return EventStatus.Succeeded()

    def _copy(self, context: Context, output: AbstractValue) -> None:
        output.set_value(boxed(self.examined(context)))
