"""Figures of hand-made outcomes, and the page that shows them."""

import dataclasses as dc
import json
import math
import re

import pytest

from physid_drake.report.svg import drawn
from physid_drake.validation.report.proof import Proof, outcomes_in, proof_json, proof_markdown, proof_tables
from physid_drake.validation.report.proof_page import proof_page
from physid_drake.validation.report.proof_pictures import confusion_picture
from physid_drake.validation.scoring.figures import NOT_CATALOGUED, NOTHING, figures_of, json_of
from physid_drake.validation.scoring.score import HeldOut, Outcome, failed_outcome, outcome
from physid_drake.validation.scoring.tables import table
from physid_drake.validation.sealing.diagnosing import Attempt

DRAG, TILT, SWIRL = ("viscous_drag",), ("table_tilt",), ("other_swirl",)


def world(name, kind, true, verdict, said=(), size=8.0, probability=0.9, **more):
    return Outcome(
        id=name, kind=kind, true=true, size=size, verdict=verdict, classes=said,
        probabilities=(probability,) * len(said), **more,
    )  # fmt: skip


OUTCOMES = (
    world("01", "none", (), "consistent", size=0.0, theta_errors=(0.02, 0.04), theta_covered=(True, False),
          held_out=HeldOut(rms=(0.9, 0.9, 0.8))),
    world("02", "none", (), "unexplained", size=0.0, theta_errors=(0.9,), theta_covered=(False,),
          held_out=HeldOut(rms=(7.0, 7.0, 1.0))),
    world("03", "none", (), "failed", size=0.0, error="error: out of memory"),
    world("04", "effect", DRAG, "explained", (DRAG,), errors=(0.1, 0.3), covered=(True, False), seconds=60.0,
          held_out=HeldOut(rms=(5.0, 1.2, 1.1), position=(4e-3, 4e-4, 3e-4), rotation=(0.1, 0.01, 0.009))),
    world("05", "effect", TILT, "ambiguous", (("magnet", "table_tilt"),), size=12.0, seconds=100.0),
    world("06", "effect", TILT, "explained", (("magnet", "tether", "table_tilt"),), size=40.0),
    world("07", "effect", TILT, "explained", (DRAG,), size=20.0, probability=0.6),
    world("08", "effect", DRAG, "consistent", size=3.0),
    world("09", "other", SWIRL, "unexplained"),
    world("10", "other", SWIRL, "explained", (("magnet",),), probability=0.4),
    world("11", "pair", DRAG + TILT, "explained", (DRAG, TILT)),
    world("12", "pair", DRAG + TILT, "explained", (DRAG,)),
    world("13", "pair", DRAG + TILT, "explained", (("magnet",), TILT)),
)  # fmt: skip


def test_figures_of_known_outcomes():
    f = figures_of(OUTCOMES)
    assert f.worlds == {"none": 3, "effect": 5, "pair": 3, "other": 2}
    assert (f.false_alarms.count, f.false_alarms.of) == (2, 3)  # the one without a diagnosis counts against it
    assert (f.failed.count, f.failed.of) == (1, 13)
    clear = f.clear
    assert (clear.found.count, clear.right.count, clear.first.count, clear.in_class.count, clear.wrong.count) == (
        4, 2, 1, 3, 1,
    )  # fmt: skip
    assert clear.class_size.median == 2
    assert (f.faint.found.count, f.faint.found.of) == (0, 1)
    assert [(p.found.count, p.found.of, p.right.count) for p in f.power] == [
        (0, 0, 0), (0, 1, 0), (1, 1, 1), (2, 2, 1), (1, 1, 0),
    ]  # fmt: skip
    assert (f.abstained.count, f.others_named.count) == (1, 1)
    assert {name: share.count for name, share in f.pairs.items()} == {"both": 1, "one": 2, "wrong": 1}
    assert f.parameter_error.median == pytest.approx(0.2)
    assert f.parameter_error.p90 == pytest.approx(0.28)
    assert (f.coverage.count, f.coverage.of) == (1, 2)
    assert f.theta_error.median == pytest.approx(0.03)  # of the world of which the right thing was said
    assert (f.theta_coverage.count, f.theta_coverage.of) == (1, 2)
    assert f.held_out["effect"].worlds == 2
    assert (f.held_out_ratio["effect"].median, f.held_out_ratio["effect"].count) == (pytest.approx(1.2 / 1.1), 1)
    assert (f.held_out_ratio["none"].median, f.held_out_ratio["none"].count) == (pytest.approx(0.9 / 0.8), 1)
    assert f.seconds == (80.0, 100.0)


def test_an_interval_stands_beside_a_share():
    low, high = figures_of(OUTCOMES).abstained.interval
    assert (low, high) == (pytest.approx(0.0126, abs=1e-4), pytest.approx(0.9874, abs=1e-4))
    assert math.isnan(figures_of(OUTCOMES[:3]).abstained.share)
    rows = {what: (figure, interval) for what, figure, interval, _ in table(figures_of(OUTCOMES))}
    assert rows["not in the catalogue: unexplained"] == ("1 of 2 (50 %)", "1 to 99 %")


def test_stated_probabilities_are_compared_with_what_came_true():
    f = figures_of(OUTCOMES)
    found = {b.low: (b.right.count, b.right.of) for b in f.reliability}
    # In the bin of 0.9: a drag, two classes whose first name is wrong, four of the pairs' five names.
    assert found == {0.0: (0, 1), 0.5: (0, 1), 0.7: (0, 0), 0.9: (5, 8), 0.97: (0, 0)}
    assert f.brier == pytest.approx((0.4**2 + 0.6**2 + 5 * 0.1**2 + 3 * 0.9**2) / 10)


def test_the_confusion_counts_first_names_and_verdicts_without_one():
    found = figures_of(OUTCOMES).confusion
    assert found[NOTHING, "failed"] == found[NOTHING, "unexplained"] == found[NOTHING, "consistent"] == 1
    assert found["table_tilt", "magnet"] == 2
    assert found[NOT_CATALOGUED, "magnet"] == 1
    assert sum(found.values()) == 10  # without the pairs


def test_faults_are_named():
    assert {o.id: o.fault for o in OUTCOMES} == {
        "01": None, "02": "false alarm", "03": "failed", "04": None, "05": None, "06": "a large class",
        "07": "wrong name", "08": "missed", "09": None, "10": "wrong name", "11": None, "12": "one of two",
        "13": "wrong name",
    }  # fmt: skip


def test_a_failed_world_counts_against_the_score():
    truth = {"id": "0a", "kind": "effect", "effects": [{"name": "viscous_drag"}], "size_sigma": 9.0}
    lost = failed_outcome(truth, Attempt(seconds=3.0, error="error: no"))
    assert not lost.found and not lost.right and lost.fault == "failed" and lost.error == "error: no"
    figures = figures_of([lost])
    assert (figures.clear.found.count, figures.clear.found.of, figures.failed.count) == (0, 1, 1)


def test_components_of_a_vector_are_compared_over_its_length():
    true = {"name": "table_tilt", "parameters": {"x": 0.04, "y": 0.0001}}
    found = {name: {"value": value, "unit": "rad", "ci90": [0.0, 0.05], "null": 0.0} for name, value in
             (("x", 0.042), ("y", 0.002))}  # fmt: skip
    diagnosis = {
        "verdict": "explained",
        "effects": [{"name": "table_tilt", "indistinguishable_from": [], "probability": 0.9, "parameters": found}],
        "fit": {"held_out_rms_before": 5.0, "held_out_rms_after": 1.1},
        "reduced_chi2_after": None,
    }
    truth = {"id": "0a", "kind": "effect", "effects": [true], "size_sigma": 9.0, "held_out_floor": {"rms": 1.0}}
    o = outcome(truth, diagnosis)
    assert o.errors == (pytest.approx(0.05, abs=1e-3), pytest.approx(0.0475, abs=1e-3))
    assert o.held_out.rms == (5.0, 1.1, 1.0)
    assert math.isnan(o.chi2)


@pytest.fixture
def proof():
    return Proof(
        seed=3, kind=None, seal="ab" * 32, sealed=len(OUTCOMES), outcomes=OUTCOMES, figures=figures_of(OUTCOMES),
        versions={"drake": "1.0"},
    )  # fmt: skip


def test_the_json_has_fixed_keys_and_seconds_stand_alone(proof):
    content = json.loads(proof_json(proof))
    assert set(content) == {
        "format", "seed", "kind", "seal_sha256", "sealed", "hidden_by", "versions", "figures", "faults", "outcomes",
        "seconds",
    }  # fmt: skip
    assert content["figures"]["not_catalogued"]["abstained"]["share"] == 0.5
    assert content["seconds"] == {"median": 80.0, "max": 100.0, "worlds": {"04": 60.0, "05": 100.0}}
    assert "second" not in json.dumps({k: v for k, v in content.items() if k != "seconds"})
    assert [f["id"] for f in content["faults"]][:2] == ["06", "07"]  # the largest effects first


def test_outcomes_are_read_back_from_the_json(proof):
    content = json.loads(proof_json(proof))
    again = outcomes_in(content)
    assert json_of(figures_of(again)) == json_of(proof.figures)
    assert json.loads(proof_json(dc.replace(proof, outcomes=again))) == content


def test_figures_of_an_older_json_lack_what_it_did_not_write(proof):
    content = json.loads(proof_json(proof))
    for one in content["outcomes"]:
        for key in ("others_covered_90", "theta_errors", "theta_covered_90", "held_out_position_m"):
            del one[key]
    figures = figures_of(outcomes_in(content))
    assert figures.theta_coverage.of == 0
    assert figures.coverage == proof.figures.coverage


def test_the_page_is_self_contained_and_lists_every_fault(proof):
    page = proof_page(proof)
    assert page == proof_page(proof)
    assert page.count("<svg") == 3
    assert not re.search(r"""(src|href)\s*=\s*["'](https?:|//|/)|url\((?!#)|<script|@import""", page)
    for outcome_ in proof.faults:
        assert (f'href="diagnoses/{outcome_.id}/diagnosis.html"' in page) is (not outcome_.failed)
    assert "error: out of memory" in page
    assert proof.seal in page


def test_tables_are_written_for_terminal_and_text(proof):
    text = proof_markdown(proof)
    assert "| two effects: both named | 1 of 3 (33 %) | 1 to 91 % | 70 % |" in text
    assert "| 02 | false alarm | no effect | 0.0 | unexplained |" in text
    main, power = proof_tables(proof)
    assert (main.row_count, power.row_count) == (len(table(proof.figures)), 5)


def test_pictures_are_drawn_of_nothing_too(tmp_path, proof):
    nothing = figures_of(())
    assert proof_page(Proof(seed=0, kind=None, seal="", sealed=0, outcomes=(), figures=nothing, versions={}))
    with drawn():
        confusion_picture(proof.figures).savefig(tmp_path / "confusion.png")
    assert (tmp_path / "confusion.png").stat().st_size > 1000
