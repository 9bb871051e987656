"""What a plan is worth on worlds of the planar integrator: with the world's tilt, without it, and without a model.

    python benchmarks/plan.py [--worlds N]

Every world draws friction, a tilt of the table of 20 to 50 mrad and a goal 0.3 m away. The models know friction
exactly; one knows the tilt. Greedy entropy search tries 40 settings of ``push`` in simulation, and one push
is made. PoWER knows nothing: it makes 50 pushes in the world, and its last settings count.
"""

import argparse
import math
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.planar import Hand, HandPath, simulate_planar
from reference.scenes import OBJECTS
from twin import body_of, config_of, shape_of

from physid_drake.effects.fields import TableTilt
from physid_drake.model import Model
from physid_drake.plan import DistanceToGoal, Situation, plan
from physid_drake.plan.task import policy_for
from physid_drake.plan.trajectory import path_of
from physid_drake.search import search_by_power

OBJECT = OBJECTS["box"]
RADIUS, HAND_FRICTION, GRAVITY = 0.010, 0.25, 9.81
TRIALS = 40  # of greedy entropy search
TABLE = ((-0.6, -0.6), (0.6, 0.6))


class World:
    """Friction, tilt and goal; the object's face looks where the goal lies."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([7, seed])
        self.friction = float(rng.uniform(0.2, 0.4))
        size, slope, heading = rng.uniform(0.02, 0.05), rng.uniform(-math.pi, math.pi), rng.uniform(-math.pi, math.pi)
        self.tilt = TableTilt(x=float(size * math.cos(slope)), y=float(size * math.sin(slope)))
        self.goal = (0.3 * math.cos(heading), 0.3 * math.sin(heading))
        self.start = (0.0, 0.0, float(heading))

    def model(self, *effects: TableTilt) -> Model:
        """The world's friction, with effects or without."""
        return Model(
            recording="box", shape=shape_of(OBJECT), hand_radius=RADIUS, table=TABLE, config=config_of("point"),
            body=body_of(OBJECT.mass, self.friction, hand_friction=HAND_FRICTION), effects=effects,
        )  # fmt: skip

    def error(self, path) -> float:
        """Distance of the object from the goal after a push [m]."""
        hand = HandPath(times=path.times, p0=path.start, velocities=path.velocities)
        weight = OBJECT.mass * GRAVITY
        motion = simulate_planar(
            OBJECT, self.friction, np.array([0.0, float(path.times[-1]) + 2.0]), pose=self.start,
            force=(weight * math.sin(self.tilt.x), weight * math.sin(self.tilt.y)), time_step=1e-4,
            hand=Hand(path=hand, radius=RADIUS, height=0.5 * OBJECT.height, friction=HAND_FRICTION),
            support=OBJECT.support(150),
        )  # fmt: skip
        return math.dist(motion.poses[-1, :2], self.goal)

    def planned(self, model: Model, seed: int) -> float:
        """Error of the push that a model plans [m]."""
        made = plan(
            model, policy_for("push", model, self.start, self.goal), DistanceToGoal(goal=self.goal),
            situation=Situation(start=self.start), rng=np.random.default_rng(seed), budget=TRIALS, draws=0, sweep=0,
        )  # fmt: skip
        return self.error(made.predicted.paths[0])

    def learnt(self, seed: int) -> float:
        """Error of PoWER's last settings [m]."""
        model = self.model()
        policy = policy_for("push", model, self.start, self.goal)

        def errors(settings: np.ndarray) -> np.ndarray:
            return np.array([self.error(path_of(model, policy.pushes(s)[0], self.start)) for s in settings])

        result = search_by_power(errors, policy.space, rng=np.random.default_rng(seed))
        return float(errors(result.means[-1:])[0])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--worlds", type=int, default=10, metavar="N")
    worlds = [World(seed) for seed in range(parser.parse_args().worlds)]
    rows = {
        "friction and tilt, greedy entropy search": [w.planned(w.model(w.tilt), k) for k, w in enumerate(worlds)],
        "friction only, greedy entropy search": [w.planned(w.model(), k) for k, w in enumerate(worlds)],
        "no model, PoWER, 50 pushes": [w.learnt(k) for k, w in enumerate(worlds)],
    }
    table = Table(title=f"distance to the goal, {len(worlds)} worlds", title_justify="left")
    for header in ("known", "median mm", "worst mm", "within 10 mm"):
        table.add_column(header, justify="left" if header == "known" else "right")
    for name, errors in rows.items():
        values = 1e3 * np.array(errors)
        table.add_row(name, f"{np.median(values):.1f}", f"{values.max():.1f}", f"{int((values < 10).sum())}")
    Console(width=100).print(table)


if __name__ == "__main__":
    main()
