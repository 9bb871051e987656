"""Scores of diagnoses against sealed truths."""

import dataclasses as dc
import json

import pytest

from physid_drake.errors import ProofError
from physid_drake.validation.scoring.figures import figures_of
from physid_drake.validation.scoring.score import Outcome, _holds, outcome, read_outcomes
from physid_drake.validation.scoring.tables import table


def truth(kind="effect", names=("viscous_drag",), size=8.0, value=0.4):
    effects = [{"name": n, "parameters": {"coefficient": value}} for n in names]
    theta = {"support_friction": 0.3, "hand_friction": 0.2, "mass": 0.25}
    return {"id": "0a", "kind": kind, "effects": effects, "size_sigma": size, "theta": theta}


def said(verdict="explained", names=("viscous_drag",), alike=(), value=0.42, ci90=(0.38, 0.46)):
    parameter = {"value": value, "unit": "N*s/m", "ci90": list(ci90), "null": 0.0}
    effects = [
        {
            "name": n,
            "indistinguishable_from": list(alike),
            "probability": 0.9,
            "parameters": {"coefficient": parameter},
        }
        for n in names
    ]
    fit = {"held_out_rms_before": 5.0, "held_out_rms_after": 1.1}
    theta = {
        "support_friction": {"value": 0.303, "ci90": [0.298, 0.308]},
        "hand_friction": {"value": 0.21, "ci90": [0.205, 0.215]},
        "mass": {"value": None, "ci90": None},
    }
    return {"verdict": verdict, "effects": effects, "fit": fit, "reduced_chi2_after": 1.0, "theta": theta}


def test_a_right_name_is_right_and_its_parameter_is_compared():
    o = outcome(truth(), said())
    assert o.found and o.right and o.both and not o.wrong_name
    assert o.errors == (pytest.approx(0.05),) and o.covered == (True,)


def test_what_the_pushes_tell_of_theta_is_compared_too():
    o = outcome(truth(), said())
    assert o.theta_errors == (pytest.approx(0.01), pytest.approx(0.05))
    assert o.theta_covered == (True, False)


def test_a_right_name_with_a_wrong_one_beside_it_is_not_right():
    both = Outcome(id="1", kind="effect", true=("tether",), size=9.0, verdict="explained",
                   classes=(("tether",), ("magnet",)), probabilities=(0.9, 0.9))  # fmt: skip
    assert both.wrong_name and not both.right and both.fault == "wrong name"
    assert dc.replace(both, classes=(("tether", "table_tilt"),), probabilities=(0.9,)).right


def test_an_end_that_json_has_no_number_for_is_infinite():
    assert _holds([None, 1.0], 0.5) and _holds([0.0, None], 0.5) and not _holds([None, 0.0], 0.5)


@pytest.mark.parametrize(
    ("alike", "right"), [(("viscous_drag",), True), (("viscous_drag", "magnet"), False), (("magnet",), False)]
)
def test_a_class_of_two_that_holds_the_truth_counts_and_a_larger_one_does_not(alike, right):
    o = outcome(truth(), said(names=("quadratic_drag",), alike=alike))
    assert o.right is right
    assert o.wrong_name is ("viscous_drag" not in alike)


def test_names_that_come_with_abstention_do_not_count():
    o = outcome(truth(kind="other", names=("other_swirl",)), said(verdict="unexplained"))
    assert o.found and not o.classes and not o.wrong_name


def test_a_pair_needs_both_names():
    pair = truth(kind="pair", names=("viscous_drag", "table_tilt"))
    assert not outcome(pair, said()).both
    assert outcome(pair, said(names=("table_tilt", "viscous_drag"))).both


@pytest.mark.parametrize(
    ("classes", "named"),
    [
        ([("table_tilt", "viscous_drag")], 1),  # one finding names one effect
        ([("table_tilt", "viscous_drag"), ("table_tilt", "viscous_drag")], 2),
        ([("magnet", "table_tilt"), ("viscous_drag",)], 2),
        ([("magnet", "tether", "table_tilt"), ("viscous_drag",)], 1),  # too large a class
        ([("table_tilt", "magnet", "tether"), ("viscous_drag",)], 2),
        ([], 0),
    ],
)
def test_each_effect_of_a_pair_needs_a_finding_of_its_own(classes, named):
    answer = said()
    answer["effects"] = [
        {"name": name, "indistinguishable_from": others, "probability": 0.5, "parameters": {}}
        for name, *others in classes
    ]
    answer["verdict"] = "ambiguous" if classes else "unexplained"
    found = outcome(truth(kind="pair", names=("viscous_drag", "table_tilt")), answer)
    assert (found.named, found.both) == (named, named == 2)


@pytest.mark.parametrize(
    ("ends", "covered"),
    [([0.0, 0.2], True), ([0.2, 0.3], False), ([3.1, 3.3], True), ([-3.1, -3.0], True)],
)
def test_an_angle_that_is_half_a_turn_off_is_right(ends, covered):
    true = truth(names=("anisotropic_table",))
    true["effects"][0]["parameters"] = {"ratio": 1.5, "angle": 0.1}
    answer = said(names=("anisotropic_table",))
    answer["effects"][0]["parameters"] = {
        "ratio": {"value": 1.5, "ci90": [1.4, 1.6], "null": 1.0, "unit": "-"},
        "angle": {"value": 0.1, "ci90": ends, "null": None, "unit": "rad"},
    }
    found = outcome(true, answer)
    assert found.covered == (True,) and found.others_covered == (covered,)


def test_the_table_counts_worlds(tmp_path):
    worlds = [
        ("none", (), "consistent", ()), ("none", (), "unexplained", ()),
        ("effect", ("viscous_drag",), "explained", ("viscous_drag",)),
        ("other", ("other_swirl",), "explained", ("magnet",)),
    ]  # fmt: skip
    (tmp_path / "sealed").mkdir()
    for k, (kind, names, verdict, found) in enumerate(worlds):
        (tmp_path / "sealed" / f"{k}.json").write_text(json.dumps(truth(kind, names)))
        (tmp_path / "diagnoses" / str(k)).mkdir(parents=True)
        (tmp_path / "diagnoses" / str(k) / "diagnosis.json").write_text(json.dumps(said(verdict, found)))
    (tmp_path / "sealed" / "not_diagnosed.json").write_text(json.dumps(truth()))
    outcomes = read_outcomes(tmp_path / "sealed", tmp_path / "diagnoses")
    rows: dict[str, str] = {}
    for what, figure, _, _ in table(figures_of(outcomes)):
        rows.setdefault(what.strip(), figure)
    assert len(outcomes) == 4
    assert rows["no effect: false alarms"] == "1 of 2 (50 %)"
    assert rows["named correctly, alone or in a class of two"] == "1 of 1 (100 %)"
    assert rows["effect below 5 sigma: found"] == "0 of 0"
    assert rows["not in the catalogue: unexplained"] == "0 of 1 (0 %)"
    assert rows["amplitudes (pairs included): coverage of the 90 % intervals"] == "1 of 1 (100 %)"


@pytest.mark.parametrize("value", [float("inf"), float("nan"), 1e308])
def test_figures_that_are_not_finite_are_not_as_a_diagnosis_writes_them(tmp_path, value):
    answer = said()
    answer["effects"][0]["parameters"]["coefficient"]["value"] = value
    (tmp_path / "sealed").mkdir()
    (tmp_path / "sealed/0a.json").write_text(json.dumps(truth(value=0.1)))
    (tmp_path / "diagnoses/0a").mkdir(parents=True)
    (tmp_path / "diagnoses/0a/attempt.json").write_text(json.dumps({"seconds": 1.0, "error": None}))
    (tmp_path / "diagnoses/0a/diagnosis.json").write_text(json.dumps(answer))
    with pytest.raises(ProofError, match="a probability or an error must be a finite number"):
        read_outcomes(tmp_path / "sealed", tmp_path / "diagnoses")


@pytest.mark.parametrize("kind", ["effect", "pair"])
def test_a_truth_with_effects_names_them(tmp_path, kind):
    (tmp_path / "sealed").mkdir()
    (tmp_path / "sealed/0a.json").write_text(json.dumps(truth(kind, ())))
    (tmp_path / "diagnoses/0a").mkdir(parents=True)
    (tmp_path / "diagnoses/0a/diagnosis.json").write_text(json.dumps(said()))
    with pytest.raises(ProofError, match=r"0a\.json' cannot be read: 'effects' must not be empty"):
        read_outcomes(tmp_path / "sealed", tmp_path / "diagnoses")
