"""What a person asks first of a diagnosis."""

import dataclasses as dc
import math

import pytest
from test_diagnosis_page import diagnosis_with

from physid_drake.report.answers import answers

QUESTIONS = ["How sure is that?", "Where?", "What now?", "May I trust it?"]


def said(**changes):
    return dict(answers(diagnosis_with(**changes)))


def test_an_explained_mismatch_answers_all_four():
    told = said()
    assert list(told) == QUESTIONS
    assert "stribeck_friction" in told["How sure is that?"] and "load_model" in told["What now?"]
    assert "0.50 mm (baseline model 2.00)" in told["May I trust it?"]


@pytest.mark.parametrize(
    ("verdict", "now"),
    [
        ("consistent", "Use the baseline model"),
        ("underpowered", "Record more pushes"),
        ("unexplained", "physid_drake inspect"),
        ("ambiguous", "Make the push that distinguishes them"),
    ],
)
def test_what_to_do_follows_from_the_verdict(verdict, now):
    placed = verdict in ("unexplained", "ambiguous")
    changes = {} if placed else {"location": None, "effects": ()}
    told = said(verdict=verdict, **changes)
    assert now in told["What now?"] and ("Where?" in told) == placed


@pytest.mark.parametrize(("p_value", "pushes", "known"), [(1e-6, 8, True), (0.3, 8, False), (1e-6, 2, False)])
def test_errors_that_chance_hardly_leaves_are_not_put_down_to_too_few_pushes(p_value, pushes, known):
    told = said(verdict="underpowered", location=None, effects=(), p_value=p_value, pushes=pushes)
    assert ("too few" in told["How sure is that?"]) != known and ("Repeat the pushes" in told["What now?"]) == known


def test_rivals_without_a_push_that_tells_them_apart_ask_for_other_pushes():
    assert "Record other pushes" in said(verdict="ambiguous", next_push=None)["What now?"]


def test_rotation_that_was_not_measured_is_not_spoken_of():
    fit = dc.replace(diagnosis_with().fit, rotation_before=math.nan, rotation_after=math.nan)
    assert " deg" not in said(fit=fit)["May I trust it?"] and "nan" not in said(fit=fit)["May I trust it?"]
