"""A diagnosis of worlds that the planar reference made: what is missing is named, and nothing else."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import worlds
from reference.scenes import OBJECTS, Theta
from rich.console import Console
from worlds import endpoints, pushes_of, recorded, slides

from physid_drake import load_model
from physid_drake.diagnose import diagnose, model_of
from physid_drake.errors import RecordingError
from physid_drake.plan import Situation
from physid_drake.plan.draws import draws_of
from physid_drake.pushes.case import case_of, cell_config
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.kept_rollouts import KeptRollouts
from physid_drake.recording import Sensors
from physid_drake.report.diagnosis import diagnosis_json
from physid_drake.run_diagnose import show

pytestmark = pytest.mark.slow

ERASER = OBJECTS["eraser"]
THETA = Theta(support_friction=0.3, hand_friction=0.25)
LOOKED_AT = ("viscous_drag", "table_tilt", "tether", "friction_gradient", "friction_drift", "com_offset")


def case(recording, **cell):
    return case_of(recording, cell_config(recording, **cell), ThetaConfig())


def world(count=6, seed=11, **more):
    return recorded(ERASER, THETA, pushes_of(ERASER, count, seed), seed, **more)


@pytest.fixture(scope="module")
def tilted():
    """The table leans by 12 mrad along x, 4 % of the friction."""
    recording = world(pull=(ERASER.mass * 9.81 * 0.012, 0.0))
    made = case(recording)
    return (made, *diagnose(made, effects=LOOKED_AT))


def test_nothing_is_found_where_nothing_is_missing():
    diagnosis, _ = diagnose(case(world()), effects=LOOKED_AT)
    assert diagnosis.verdict == "consistent"
    assert diagnosis.effects == () and diagnosis.location is None
    assert diagnosis.theta["support_friction"].value == pytest.approx(0.3, rel=0.02)
    assert not diagnosis.theta["mass"].identifiable


def test_a_tilt_is_found_named_and_measured(tilted):
    _, diagnosis, _ = tilted
    assert diagnosis.verdict in ("explained", "ambiguous")
    (found,) = diagnosis.effects
    assert "table_tilt" in (found.name, *found.indistinguishable_from)
    assert len(found.indistinguishable_from) <= 1
    if found.name == "table_tilt":
        assert found.parameters["x"].value == pytest.approx(0.012, rel=0.1)
        assert abs(found.parameters["y"].value) < 0.0015
    assert diagnosis.fit.rms_after < 0.8 * diagnosis.fit.rms_before
    assert diagnosis.location is not None and diagnosis.location.frame == "world"


def test_the_model_that_leaves_predicts_what_the_diagnosis_says(tilted, tmp_path):
    made, _, evidence = tilted
    model = model_of(evidence)
    file = tmp_path / "model.yaml"
    file.write_text(model.dump(), encoding="utf-8")
    loaded = load_model(file)
    assert loaded.effects == model.effects and loaded.correlation == model.correlation
    assert {name for name, interval in model.intervals.items() if interval} == set(model.correlation.names)
    draws = draws_of(loaded, Situation(start=(0.0, 0.0, 0.0)), 128, np.random.default_rng(0))
    names = model.correlation.names
    i, j = names.index("theta.support_friction"), names.index("theta.hand_friction")
    drawn = np.corrcoef(
        [np.log(d.model.body.support_friction[0]) for d in draws], [np.log(d.model.body.hand_friction) for d in draws]
    )
    assert drawn[0, 1] == pytest.approx(model.correlation.matrix[i][j], abs=0.1)
    problem = made.problems[0]
    run = {"start": problem.start, "path": problem.path, "begin": problem.begin, "end": problem.end,
           "hand_height": problem.hand_height}  # fmt: skip
    again, first, plain = (m.build().rollout(**run).poses for m in (loaded, model, model.baseline()))
    np.testing.assert_array_equal(again, first)
    assert np.abs(first[-1] - plain[-1]).max() > 1e-4


def test_an_interrupted_diagnosis_goes_on_to_the_same_bytes(tmp_path):
    recording = world(count=3, pull=(ERASER.mass * 9.81 * 0.02, 0.0))
    made, again = (case(recording, time_step=4e-3) for _ in range(2))
    effects = ("table_tilt",)

    live, cut_off = tmp_path / "live.bin", tmp_path / "cut_off.bin"

    def copy(stage, done, total):
        if stage == "test for missing physics":  # what an interrupted run would leave here
            shutil.copy(live, cut_off)

    whole, _ = diagnose(made, effects=effects, progress=copy, kept=KeptRollouts(live))
    assert cut_off.exists()
    goes_on = KeptRollouts(cut_off)
    half, all_of_them = len(goes_on), len(KeptRollouts(live))
    resumed, _ = diagnose(again, effects=effects, kept=goes_on)
    assert diagnosis_json(resumed) == diagnosis_json(whole)
    assert 0 < half < len(goes_on) == all_of_them  # none was made twice


def test_a_diagnosis_prints_and_is_json(tilted, capsys):
    _, diagnosis, _ = tilted
    show(Console(), diagnosis)
    assert diagnosis.verdict in capsys.readouterr().out
    content = json.loads(diagnosis_json(diagnosis))
    keys = {"format", "recording", "verdict", "p_value", "alpha", "effects", "location", "fit", "theta", "next_push",
            "seed"}  # fmt: skip
    assert keys <= content.keys() and content["format"] == "physid-diagnosis/1"


def test_two_pushes_of_which_only_the_ends_are_known_cannot_tell():
    diagnosis, _ = diagnose(case(endpoints(world(count=2))), effects=LOOKED_AT)
    assert diagnosis.verdict == "underpowered"


def test_a_noise_that_nothing_tells_is_what_the_plain_cell_leaves():
    recording = endpoints(world(count=8))
    made = case(replace(recording, sensors=Sensors()))
    assert not made.noise.known
    diagnosis, evidence = diagnose(made, effects=("table_tilt",))
    assert diagnosis.verdict in ("consistent", "underpowered")
    # Two poses a push tell a noise of 0.3 mm to a few tens of percent.
    assert 0.15e-3 < evidence.case.noise.position < 1.2e-3
    assert any("as large as the errors of the baseline model" in warning for warning in diagnosis.warnings)


def test_where_no_noise_is_known_an_effect_is_found_by_the_quiet_that_it_leaves():
    recording = endpoints(world(count=10, pull=(ERASER.mass * 9.81 * 0.03, 0.0)))  # eight are too few
    made = case(replace(recording, sensors=Sensors()), time_step=2e-3)
    diagnosis, evidence = diagnose(made, effects=("table_tilt",))
    assert not made.noise.known
    assert diagnosis.verdict in ("explained", "ambiguous")
    (found,) = diagnosis.effects
    assert "table_tilt" in (found.name, *found.indistinguishable_from)
    assert evidence.best.noise_scale < 0.7 * evidence.baseline.noise_scale
    assert diagnosis.p_value < 0.01


def test_a_tracker_far_quieter_than_the_misfit_does_not_spoil_the_plain_cell(monkeypatch):
    """Slides on a leaning table, seen to 0.02 mm: the baseline model predicts as least squares do."""
    monkeypatch.setattr(worlds, "POSITION_STD", 2e-5)
    monkeypatch.setattr(worlds, "ROTATION_STD", 2e-4)
    heading = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    speed = np.array([0.4, 0.7, 0.5, 0.6, 0.7, 0.4, 0.6, 0.5])
    velocities = np.column_stack([speed * np.cos(heading), speed * np.sin(heading), np.linspace(-1.0, 1.0, 8)])
    pull = (0.05 * 9.81 * ERASER.mass, 0.0)
    recording = slides(ERASER, Theta(support_friction=0.25), velocities, seed=5, pull=pull)
    diagnosis, _ = diagnose(case(recording), effects=("viscous_drag",))
    assert diagnosis.verdict == "unexplained"
    # Headings on all sides: what is gained downhill is lost uphill.
    assert diagnosis.theta["support_friction"].value == pytest.approx(0.25, rel=0.05)
    way = speed**2 / (2.0 * 9.81 * 0.25)
    astray = way * np.hypot(0.2 * np.cos(heading), 0.1 * np.sin(heading))
    assert diagnosis.fit.position_before < np.sqrt(np.mean(astray**2))


def test_an_object_that_never_moves_is_refused():
    recording = world(count=1)
    push = recording.pushes[0]
    still = type(push.object)(
        times=push.object.times,
        positions=np.tile(push.object.positions[0], (len(push.object), 1)),
        quaternions=np.tile(push.object.quaternions[0], (len(push.object), 1)),
    )
    frozen = type(push)(name=push.name, object=still, hand=push.hand, force=None)
    with pytest.raises(RecordingError, match="never moves"):
        case(type(recording)(**{**vars(recording), "pushes": (frozen,)}))
