"""The diagnosis as a Drake system, which diagnoses identifications as they arrive."""

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
    """An identification and its diagnosis. It is immutable; a Drake port that copies its value gets the same object.

    Attributes:
        known: the identification.
        diagnosis: the answer; None where nothing was diagnosed.
        evidence: what the answer rests on; None where nothing was diagnosed.
    """

    known: Identification
    diagnosis: Diagnosis | None = None
    evidence: Evidence | None = None

    def __deepcopy__(self, memo: Any) -> Examined:
        return self

    @property
    def theta(self) -> Array:
        """The identified theta (d,), each entry in its unit."""
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
            examine: called with each new identification; returns its diagnosis.
            begin: time of the diagram [s] before which identifications are ignored, since they will soon be replaced.
        """
        LeafSystem.__init__(self)
        self.set_name("diagnosis")
        self._examine = examine
        self.DeclareAbstractInputPort("identification.estimated", Value[object]())
        self._memory = self.DeclareAbstractState(Value[object](boxed(None)))
        self.DeclareAbstractOutputPort("diagnosis.estimated", Value[object], self._copy, {self.all_state_ticket()})
        self.DeclarePeriodicUnrestrictedUpdateEvent(PUSH_PERIOD, begin, self._receive)

    def examined(self, context: Context) -> Examined | None:
        """The latest answer, from the state; None before the first."""
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
