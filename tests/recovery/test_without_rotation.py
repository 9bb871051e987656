"""A recording without rotations is diagnosed by its places alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from physid_drake.diagnose import diagnose
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.recording import Push, read_recording, write_recording

SEALED = Path(__file__).parents[2] / "recordings" / "sealed_01"


def without_rotation(push: Push) -> Push:
    identity = np.tile([1.0, 0.0, 0.0, 0.0], (len(push.object), 1))
    return replace(push, object=replace(push.object, quaternions=identity, rotation="none"))


@pytest.mark.slow
def test_the_grain_of_a_table_is_found_by_places_alone(tmp_path: Path) -> None:
    sealed = read_recording(SEALED)
    write_recording(replace(sealed, pushes=tuple(map(without_rotation, sealed.pushes))), tmp_path / "places")
    recording = read_recording(tmp_path / "places")
    others = ("table_tilt", "friction_patch", "viscous_drag", "hand_offset")
    case = case_of(recording, cell_config(recording), ThetaConfig())
    found, evidence = diagnose(case, seed=0, effects=("anisotropic_table", *others))
    (effect,) = found.effects
    assert found.verdict == "explained" and effect.name == "anisotropic_table"
    ratio, angle = effect.parameters["ratio"], effect.parameters["angle"]
    assert abs(ratio.value - 1.19) < 0.02 and abs(angle.value - 1.68) < 0.05
    assert all(features.dofs == 2 for features in evidence.case.features)
