"""A push with effects as the twin sees it: each effect acts at its seams, as in the cell."""

from __future__ import annotations

import dataclasses as dc
from collections.abc import Sequence
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from physid_drake.cell import Body
from physid_drake.cell.laws import Law
from physid_drake.effects import Effect, PushFacts
from physid_drake.effects.liquid import Swing
from physid_drake.effects.rollout import (
    Geometry,
    Rollout,
    body_with,
    contact_height,
    frictions_of,
    lateness_of,
    mount_of,
    reported,
    true_start,
)
from physid_drake.twin.twin import Trace, Twin, TwinPush

Array = NDArray[np.float64]

EVERYWHERE = np.array([[-100.0, -100.0], [100.0, 100.0]])  # m: the twin gives no friction back, wherever it comes
VOCABULARY = get_args(Law)


def push_with(
    twin: Twin, plain: Geometry, body: Body, push: Rollout, effects: Sequence[Effect], times: Array
) -> TwinPush | None:
    """The rollout to make; None where an effect speaks no law of the vocabulary: then the cell has to.

    Args:
        twin: of the geometry with the effects.
        plain: the geometry without them.
        body: plain parameters.
        push: what is simulated.
        effects: the physics that is added; at their null values they change nothing.
        times: (n,) at which the tracker reports [s].
    """
    present = [effect for effect in effects if not effect.is_null]
    facts = PushFacts(order=push.order, mass=body.mass, polar=twin.polar, region=EVERYWHERE, hand_axes=push.hand_axes)
    body = body_with(present, body, facts)
    path = push.path
    if path is not None:
        for effect in present:
            path = effect.hand(path, facts)
    laws, swings, others = _laws(present, facts)
    if others or len(swings) > 1:
        return None
    height = contact_height(twin.solid, plain, push.hand_height)
    return TwinPush(
        body=body, start=true_start(present, push.start), path=path, begin=push.begin, end=push.end,
        times=times - lateness_of(present), hand_height=height, laws=laws,
        swing=swings[0] if swings else None, mount=mount_of(present, facts),
    )  # fmt: skip


def knows(effects: Sequence[Effect]) -> bool:
    """Whether all laws of some effects are of the twin's vocabulary: else it is the cell that rolls them out."""
    facts = PushFacts(order=0, mass=1.0, polar=1e-3, region=EVERYWHERE, hand_axes=np.eye(2))
    return not _laws([effect for effect in effects if not effect.is_null], facts)[2]


def _laws(effects: Sequence[Effect], facts: PushFacts) -> tuple[list[Law], list[Swing], int]:
    """Laws of the vocabulary, what swings, and how many are neither."""
    asked = [*(law for effect in effects for law in effect.laws(facts)), *frictions_of(effects, facts)]
    laws = [law for law in asked if isinstance(law, VOCABULARY)]
    swings = [law for law in asked if isinstance(law, Swing)]
    return laws, swings, len(asked) - len(laws) - len(swings)


def as_reported(trace: Trace, effects: Sequence[Effect]) -> Trace:
    """The trace with the poses that the tracker reports."""
    return dc.replace(trace, poses=reported(trace.poses, effects))
