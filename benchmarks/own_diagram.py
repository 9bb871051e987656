"""How near the diagram of a model comes to its rollouts on a recording's pushes: ``own_diagram.py MODEL RECORDING``.

MODEL is a folder that holds model.yaml, RECORDING what it was learnt from. Prints the median and the largest distance
of the pushes' ends for several time steps of the plant, and how long a second of simulation takes.
"""

import argparse
import math
import time

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from physid_drake import load_model
from physid_drake.model import Model
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.problem import PushProblem
from physid_drake.recording import read_recording, recording_folder

TIME_STEPS = (1e-3, 5e-4, 2.5e-4)


def played(model: Model, problem: PushProblem, time_step: float) -> tuple[float, float, float]:
    """Distance of the ends [m], their angle [rad], and wall time over simulated time."""
    built, begin, end = model.build(time_step=time_step), float(problem.times[0]), float(problem.times[-1])
    motion = built.rollout(
        start=problem.start, path=problem.path, begin=begin, end=end, hand_height=problem.hand_height,
        order=problem.order,
    )  # fmt: skip
    times = np.linspace(begin, end, 2000)
    places = np.column_stack([problem.path.positions(times), np.full(len(times), problem.hand_height)])
    builder = DiagramBuilder()
    cell = builder.AddSystem(built.diagram)
    wanted = builder.AddSystem(TrajectorySource(PiecewisePolynomial.FirstOrderHold(times - begin, places.T), 1))
    builder.Connect(wanted.get_output_port(), cell.GetInputPort("hand.state_desired"))
    simulator = Simulator(builder.Build())
    plant, body = built.scene.plant, built.scene.object
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    rest, (x, y, yaw) = plant.GetFreeBodyPose(context, body), problem.start.pose
    R_WB = RotationMatrix.MakeZRotation(yaw) @ rest.rotation()
    plant.SetFreeBodyPose(context, body, RigidTransform(R_WB, [x, y, rest.translation()[2]]))
    for joint, place in zip(built.scene.joints, places[0], strict=True):
        joint.set_translation(context, place)
    since = time.perf_counter()
    simulator.AdvanceTo(end - begin)
    spent = time.perf_counter() - since
    X_WB = plant.GetFreeBodyPose(context, body)
    want = motion.planar_at(np.array([end]))[0]
    turn = math.remainder(X_WB.rotation().ToRollPitchYaw().yaw_angle() - want[2], 2.0 * math.pi)
    return float(np.hypot(*(X_WB.translation()[:2] - want[:2]))), abs(turn), spent / (end - begin)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model")
    parser.add_argument("recording")
    arguments = parser.parse_args()
    model, recording = load_model(arguments.model), read_recording(recording_folder(arguments.recording))
    config = cell_config(recording)
    problems = [p for p in case_of(recording, config, ThetaConfig()).problems if p.path is not None]
    print(f"{len(problems)} pushes\ntime step  median             largest            of real time")
    for step in TIME_STEPS:
        rows = np.array([played(model, problem, step) for problem in problems])
        parts = [
            f"{1e3 * d:5.2f} mm {math.degrees(a):5.2f} deg" for d, a in (np.median(rows, 0)[:2], rows.max(0)[:2])
        ]
        print(f"{1e3 * step:6.2f} ms  {'  '.join(parts)}  {np.median(rows[:, 2]):.2f}")


if __name__ == "__main__":
    main()
