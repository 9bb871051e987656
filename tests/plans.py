"""A model to plan with, and small, quick plans of it."""

from dataclasses import replace

import numpy as np
from runs import COARSE
from twin import body_of

from physid_drake.effects.fields import TableTilt
from physid_drake.model import Model
from physid_drake.plan import DistanceToGoal, Situation, plan
from physid_drake.plan.task import policy_for
from physid_drake.recording import Box

START, GOAL = (0.0, 0.0, 0.0), (0.25, 0.0)
MODEL = Model(
    recording="eraser",
    shape=Box(size=(0.127, 0.051, 0.03)),
    hand_radius=0.01,
    table=((-0.5, -0.4), (0.5, 0.4)),
    config=COARSE,
    body=body_of(0.054, 0.27, hand_friction=0.22),
    intervals={"theta.support_friction": [0.25, 0.29], "theta.hand_friction": [0.2, 0.24]},
)
TILTED = replace(MODEL, effects=(TableTilt(x=0.04),), intervals={**MODEL.intervals, "table_tilt.x": [0.03, 0.05]})


def made(model=MODEL, name="push_speed", goal=GOAL, *, seed=0, choices=None, **more):
    given = {"budget": 12, "draws": 4, "sweep": 3, "situation": Situation(start=START)} | more
    return plan(
        model, policy_for(name, model, START, goal, choices), DistanceToGoal(goal=goal),
        rng=np.random.default_rng(seed), **given,
    )  # fmt: skip
