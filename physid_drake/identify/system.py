"""Identification as Drake systems: a player of recorded pushes, and the system that learns from them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from physid_drake.identify.identify import Identification
from physid_drake.recording import Push

PUSH_PERIOD = 1.0  # s of diagram time between two pushes

Identify = Callable[[tuple[Push, ...]], Identification]


class RecordingPlayer(LeafSystem):
    """Plays recorded pushes, one per ``PUSH_PERIOD``.

    .. pydrake_system::
        name: recording_player
        output_ports:
        - push.measured
    """

    def __init__(self, pushes: tuple[Push, ...]) -> None:
        """Prepare to play ``pushes``."""
        LeafSystem.__init__(self)
        self.set_name("recording_player")
        self._pushes = pushes
        self.DeclareAbstractOutputPort("push.measured", Value[object], self._play)

    def _play(self, context: Context, output: AbstractValue) -> None:
        index = int(np.floor(context.get_time() / PUSH_PERIOD + 1e-9))
        output.set_value(self._pushes[min(index, len(self._pushes) - 1)])


class IdentificationSystem(LeafSystem):
    """Collects pushes as they arrive, and runs the search over repeated rollouts once it has enough.

    Its state holds the pushes so far and the latest identification.

    .. pydrake_system::
        name: identification
        input_ports:
        - push.measured
        output_ports:
        - theta.estimated
        - identification.estimated
    """

    def __init__(self, identify: Identify, *, after: int, dimension: int, nominal: np.ndarray) -> None:
        """Prepare.

        Args:
            identify: what to run on the pushes collected so far.
            after: number of pushes that it waits for.
            dimension: of theta.
            nominal: (dimension,) theta before the first identification.
        """
        LeafSystem.__init__(self)
        self.set_name("identification")
        self._identify, self._after, self._nominal = identify, after, nominal
        self.DeclareAbstractInputPort("push.measured", Value[object]())
        start: tuple[tuple[Push, ...], Identification | None] = ((), None)
        self._memory = self.DeclareAbstractState(Value[object](start))
        self.DeclareVectorOutputPort("theta.estimated", dimension, self._theta)
        self.DeclareAbstractOutputPort("identification.estimated", Value[object], self._copy)
        self.DeclarePeriodicUnrestrictedUpdateEvent(PUSH_PERIOD, 0.0, self._receive)

    def identification(self, context: Context) -> Identification | None:
        """The latest identification held in the state; None before the first."""
        latest: Identification | None = context.get_abstract_state(self._memory).get_value()[1]
        return latest

    def _receive(self, context: Context, state: State) -> EventStatus:
        pushes, latest = context.get_abstract_state(self._memory).get_value()
        if len(pushes) < self._after:
            pushes = (*pushes, self.GetInputPort("push.measured").Eval(context))
            if len(pushes) == self._after:
                latest = self._identify(pushes)
            state.get_mutable_abstract_state(self._memory).set_value((pushes, latest))
        return EventStatus.Succeeded()

    def _theta(self, context: Context, output: BasicVector) -> None:
        latest = self.identification(context)
        output.SetFromVector(self._nominal if latest is None else latest.theta)

    def _copy(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.identification(context))
