"""Identification as Drake systems: a player of recorded pushes, and the system that learns from them."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.systems.framework import BasicVector, Context, EventStatus, LeafSystem, State

from physid_drake.identify.identify import Identification
from physid_drake.optional import boxed, unboxed
from physid_drake.recording import Push

PUSH_PERIOD = 1.0  # s of diagram time between two pushes

Identify = Callable[[tuple[Push, ...]], Identification]
Known = TypeVar("Known")


class RecordingPlayer(LeafSystem):
    """Plays recorded pushes, one per ``PUSH_PERIOD``.

    .. pydrake_system::
        name: recording_player
        output_ports:
        - push.measured
    """

    def __init__(self, pushes: tuple[Push, ...]) -> None:
        """Play these pushes, in their order."""
        LeafSystem.__init__(self)
        self.set_name("recording_player")
        self._pushes = pushes
        self.DeclareAbstractOutputPort("push.measured", Value[object], self._play)

    def _play(self, context: Context, output: AbstractValue) -> None:
        index = int(np.floor(context.get_time() / PUSH_PERIOD + 1e-9))
        output.set_value(boxed(self._pushes[min(index, len(self._pushes) - 1)]))


class Learner(Protocol[Known]):
    """Learns theta from pushes.

    What it has learned is a value that the Drake system's state holds; the learner itself keeps nothing.
    """

    def start(self) -> Known:
        """What is known before any push."""
        ...

    def learn(self, belief: Known, push: Push) -> Known:
        """What is known after one more push."""
        ...

    def identification(self, belief: Known) -> Identification | None:
        """The identification from what is known; None where it is too early for one."""
        ...


@dc.dataclass(frozen=True, kw_only=True)
class Collected:
    """The pushes so far, and the identification from all of them once there are enough."""

    pushes: tuple[Push, ...] = ()
    latest: Identification | None = None


class BatchLearner:
    """Collects pushes, and identifies from all of them at once when there are enough."""

    def __init__(self, identify: Identify, *, after: int) -> None:
        """Prepare.

        Args:
            identify: called with the pushes once there are enough.
            after: number of pushes to wait for.
        """
        self._identify, self._after = identify, after

    def start(self) -> Collected:
        """No pushes."""
        return Collected()

    def learn(self, belief: Collected, push: Push) -> Collected:
        """What is known with one more push; pushes beyond ``after`` are ignored."""
        if len(belief.pushes) >= self._after:
            return belief
        pushes = (*belief.pushes, push)
        return Collected(pushes=pushes, latest=self._identify(pushes) if len(pushes) == self._after else None)

    def identification(self, belief: Collected) -> Identification | None:
        """The identification from all pushes; None before there are enough."""
        return belief.latest


class IdentificationSystem(LeafSystem):
    """Learns from each push that arrives at its input port.

    Its abstract state holds what the learner knows, and the name of the push that it last learned from; a push with
    another name is new.

    .. pydrake_system::
        name: identification
        input_ports:
        - push.measured
        output_ports:
        - theta.estimated
        - identification.estimated
    """

    def __init__(self, learner: Learner[Any], *, dimension: int, nominal: np.ndarray) -> None:
        """Prepare.

        Args:
            learner: ``BatchLearner`` or ``OnlineIdentifier``.
            dimension: d, of theta.
            nominal: (d,) theta before the first identification, each entry in its unit.
        """
        LeafSystem.__init__(self)
        self.set_name("identification")
        self._learner, self._nominal = learner, nominal
        self.DeclareAbstractInputPort("push.measured", Value[object]())
        start: tuple[Any, str | None] = (learner.start(), None)
        self._memory = self.DeclareAbstractState(Value[object](start))
        # Of the state alone: a loop through robot and policy has no algebraic loop in it.
        state = {self.all_state_ticket()}
        self.DeclareVectorOutputPort("theta.estimated", dimension, self._theta, state)
        self.DeclareAbstractOutputPort("identification.estimated", Value[object], self._copy, state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(PUSH_PERIOD, 0.0, self._receive)

    def belief(self, context: Context) -> Any:
        """What the learner knows, from the state."""
        return context.get_abstract_state(self._memory).get_value()[0]

    def identification(self, context: Context) -> Identification | None:
        """The latest identification, from the state; None before the first."""
        return self._learner.identification(self.belief(context))

    def _receive(self, context: Context, state: State) -> EventStatus:
        belief, last = context.get_abstract_state(self._memory).get_value()
        push: Push | None = unboxed(self.GetInputPort("push.measured").Eval(context))
        if push is not None and push.name != last:
            learned = (self._learner.learn(belief, push), push.name)
            state.get_mutable_abstract_state(self._memory).set_value(learned)
        return EventStatus.Succeeded()

    def _theta(self, context: Context, output: BasicVector) -> None:
        latest = self.identification(context)
        output.SetFromVector(self._nominal if latest is None else latest.theta)

    def _copy(self, context: Context, output: AbstractValue) -> None:
        output.set_value(boxed(self.identification(context)))
