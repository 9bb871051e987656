"""Twelve recorded pushes of a world with an effect of one's own: own_world.py FOLDER."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from own_wind import OwnWind

from physid_drake.cell import Body, CellConfig
from physid_drake.model import Model
from physid_drake.plan import SimulatedRobot
from physid_drake.policies import PlannedPush
from physid_drake.recording import Box, Hand, ObjectModel, Recording, Sensors, Table, write_recording

BOX = Box(size=(0.12, 0.06, 0.04))
BODY = Body(mass=0.2, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=0.25, support_friction=np.array([0.3]))
SENSORS = Sensors(object_position_std=3e-4, object_rotation_std=2e-3, hand_position_std=5e-5)


def recorded(effect, count=12, seed=5):
    """Pushes of a box in which an effect acts, from several sides and at several speeds."""
    world = Model(
        recording="own", shape=BOX, hand_radius=0.01, table=((-0.6, -0.5), (0.6, 0.5)), config=CellConfig(),
        body=BODY, effects=(effect,),
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    pushes = []
    for k in range(count):
        pose = (*rng.uniform(-0.1, 0.1, 2).tolist(), float(rng.uniform(-np.pi, np.pi)))
        robot = SimulatedRobot(world, start=pose, sensors=SENSORS, rng=rng, pushes=k)
        push = PlannedPush(
            direction=pose[2] + 0.5 * np.pi * int(rng.integers(4)) + float(rng.uniform(-0.3, 0.3)),
            speed=float(rng.uniform(0.1, 0.4)), travel=0.06, contact_offset=float(rng.uniform(-0.01, 0.01)),
        )  # fmt: skip
        pushes.append(replace(robot.execute(push), name=f"pushes/{k + 1:03d}.csv"))
    return Recording(
        name="own", object=ObjectModel(shape=BOX, mass=0.2), table=Table(size=(1.2, 1.0)),
        hand=Hand(tip="sphere", radius=0.01), sensors=SENSORS, pushes=tuple(pushes),
    )  # fmt: skip


if __name__ == "__main__":
    write_recording(recorded(OwnWind(x=-0.04, y=0.015)), Path(sys.argv[1]))
