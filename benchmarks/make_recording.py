"""Make the recording that ships with the project: twelve pushes of an eraser in a planar integrator.

    python benchmarks/make_recording.py recordings/eraser_reference

The integrator is the tests' own reference (tests/reference), not Drake; the truth is printed.
"""

import sys
from pathlib import Path

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from reference.scenes import OBJECTS, Noise, Theta, draw_push, write_reference_recording

SEED = 20
PUSHES = 12


def main() -> None:
    folder = Path(sys.argv[1])
    rng = np.random.default_rng(SEED)
    body = OBJECTS["eraser"]
    truth = Theta(support_friction=0.27, hand_friction=0.22)
    pushes = [(truth, draw_push(rng, body, tip_radius=0.010)) for _ in range(PUSHES)]
    write_reference_recording(folder, body, pushes, Noise(), rng)
    header = folder / "recording.yaml"
    content = yaml.safe_load(header.read_text())
    content["description"] = (
        f"{PUSHES} pushes of a whiteboard eraser, by the planar integrator of the project's tests (not Drake)"
        " with white tracker noise and 1 % scatter of friction: python benchmarks/make_recording.py."
    )
    content["table"] = {"size_m": [1.2, 0.8], "centre_m": [0.0, 0.0]}
    header.write_text(yaml.safe_dump(content, sort_keys=False))
    print(f"{PUSHES} pushes written to {folder}; truth: {truth}; noise: {Noise()}; seed {SEED}")


if __name__ == "__main__":
    main()
