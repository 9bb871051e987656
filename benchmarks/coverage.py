"""Whether the stated intervals hold the truth: coverage.py [--worlds 6] [--seed 77] [--hand 0.0006].

Each world is ten pushes of a named object with drawn friction, made by the tests' planar integrator with the
default tracker noise, of the hand another if one is given [m]; z is the error of the logarithm in standard deviations
of the stated 90 % interval.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.scenes import OBJECTS, Noise, draw_push, draw_theta, write_reference_recording

from physid_drake.cell import CellConfig
from physid_drake.identify import Identification, Identifier, SearchConfig
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import read_recording

NAMES = ("eraser", "box", "book", "can")
PUSHES = 10


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=6)
    parser.add_argument("--seed", type=int, default=77)
    parser.add_argument("--hand", type=float, default=Noise().hand_position, metavar="M", help="noise of its stream")
    arguments = parser.parse_args()
    inside, noise = [], Noise(hand_position=arguments.hand)
    for k in range(arguments.worlds):
        name = NAMES[k % len(NAMES)]
        rng = np.random.default_rng([arguments.seed, k])
        truth = draw_theta(rng, OBJECTS[name])
        result = identified(name, truth, noise, rng)
        for e, true in zip(result.estimates[1:], (truth.hand_friction, truth.support_friction), strict=True):
            inside.append(e.ci90[0] <= true <= e.ci90[1])
            z = 3.29 * np.log(e.value / true) / np.log(e.ci90[1] / e.ci90[0])
            print(f"{k} {name:7s} {e.name:17s} true {true:.3f} error {100 * (e.value / true - 1):+.2f} % z {z:+.2f}")
    print(f"{sum(inside)} of {len(inside)} 90 % intervals hold the truth")


def identified(name: str, truth: object, noise: Noise, rng: np.random.Generator) -> Identification:
    body = OBJECTS[name]
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "recording"
        pushes = [(truth, draw_push(rng, body, tip_radius=0.010)) for _ in range(PUSHES)]
        write_reference_recording(place, body, pushes, noise, rng)
        recording = read_recording(place)
        identifier = Identifier(recording, cell=CellConfig(), theta=ThetaConfig(), search=SearchConfig(), seed=0)
        return identifier.run()


if __name__ == "__main__":
    main()
