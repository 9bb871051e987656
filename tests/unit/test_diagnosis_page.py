"""The page of a diagnosis: well-formed, complete, escaped, the same bytes twice."""

import dataclasses as dc
import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from physid_drake.diagnose.localise import MissingWrench
from physid_drake.diagnose.values import (
    Detectable,
    Diagnosis,
    EffectFinding,
    FitQuality,
    Location,
    NextPush,
    ParameterEstimate,
    Ranked,
    RegimeGain,
    ThetaEstimate,
    Window,
)
from physid_drake.pushes.tracker_noise import UNKNOWN
from physid_drake.recording import Box, Cylinder, Hand, ObjectModel, PoseStream, Push, Recording, Sensors, Table
from physid_drake.report import effect_laws
from physid_drake.report.diagnosis_page import ShownPush, diagnosis_page
from physid_drake.report.numbers import digits_between, number

NAMES = ("pushes/<b>1</b>.csv", "pushes/$2$ & co.csv")
VOID = {"meta", "br", "link", "img", "hr", "input"}


def estimate(value, unit="-", null=None):
    return ParameterEstimate(value=value, unit=unit, ci90=[value - 0.1, value + 0.1], null=null)


def effect(name, **parameters):
    return EffectFinding(
        name=name, element="table", indistinguishable_from=("a <i>rival</i>",), probability=0.8,
        parameters=parameters, statement="a statement",
    )  # fmt: skip


def ranked(name, **figures):
    return Ranked(name=name, **figures)


LAWS = {
    "stribeck_friction": {"excess": estimate(0.4, null=0.0), "speed": estimate(0.05, "m/s")},
    "viscous_drag": {"coefficient": estimate(0.2, "N*s/m", 0.0)},
    "quadratic_drag": {"coefficient": estimate(0.2, "N*s^2/m^2", 0.0)},
    "anisotropic_table": {"ratio": estimate(1.3), "angle": estimate(0.5, "rad")},
    "anisotropic_object": {"ratio": estimate(1.3), "angle": estimate(0.5, "rad")},
    "friction_patch": {n: estimate(v) for n, v in (("ratio", 0.6), ("x", 0.05), ("y", 0.0), ("radius", 0.04))},
    "friction_gradient": {"slope_x": estimate(0.5, "1/m"), "slope_y": estimate(-0.2, "1/m")},
    "table_tilt": {"x": estimate(0.01, "rad"), "y": estimate(-0.02, "rad")},
    "tether": {n: estimate(v) for n, v in (("stiffness", 1.0), ("x", 40.0), ("y", 0.0), ("rest_length", 0.1))},
    "magnet": {n: estimate(v) for n, v in (("strength", 1e-4), ("x", 0.05), ("y", 0.0), ("core", 0.03))},
    "uneven_support": {
        "weights": ParameterEstimate(
            value=[[1.0, 2.0], [0.5, 0.5]], unit="-", ci90=[[[0.9, 1.8], [0.4, 0.4]], [[1.1, 2.2], [0.6, 0.6]]],
            null=[[1.0]],
        )
    },
}  # fmt: skip


WINDOW = Window(
    push=NAMES[0], start=0.5, end=1.0, place=(0.031, -0.012), heading=-0.5, speed=0.0412, phase="free_slide"
)  # fmt: skip


def diagnosis_with(**changes):
    d = Diagnosis(
        recording="eraser <u>",
        verdict="explained",
        sentence="Missing physics: stribeck_friction.",
        p_value=1e-9,
        alpha=0.01,
        effects=(effect("stribeck_friction", **LAWS["stribeck_friction"]),),
        location=Location(
            statement="during free sliding, about 0.1 N", phase=("free_slide",), dof=("along_motion",),
            frame="object_velocity", windows=(WINDOW,),
        ),
        fit=FitQuality(
            rms_before=3.0, rms_after=1.0, position_before=2e-3, position_after=5e-4, rotation_before=0.02,
            rotation_after=0.01, log_score_gain=20.0, log_score_gain_se=4.0,
            per_push=((NAMES[0], 2.0, 1.0), (NAMES[1], math.inf, 0.9)),
        ),
        theta={
            "mass": ThetaEstimate(value=0.1, unit="kg", ci90=(0.05, 0.2), identifiable=False, before=0.1),
            "support_friction": ThetaEstimate(
                value=0.25, unit="-", ci90=(0.2, 0.3), identifiable=True, before=0.24
            ),
        },
        next_push=NextPush(direction_deg=45.0, speed_mps=0.2, contact_offset_m=-0.01, start_x_m=0.1,
                           start_y_m=-0.05, start_yaw_deg=0.0, settles_with_probability=0.9),
        seed=3,
        ranking=(
            ranked("stribeck_friction", gain=40.0, p_value=0.0, held_out_gain=20.0, held_out_se=4.0, why="found"),
            ranked("table_tilt", gain=math.nan, p_value=1.0, held_out_gain=None, held_out_se=None, why="too little"),
        ),
        detectable=(
            Detectable(name="uneven_support", parameter="ends_x", value=math.nan, unit="-", sigmas=math.inf),
            Detectable(name="table_tilt", parameter="x", value=2e-3, unit="rad", sigmas=0.7),
        ),
        left="nothing beyond noise",
        partly=None,
        reduced_chi2_before=4.0,
        reduced_chi2_after=1.1,
        friction_scatter=0.02,
        noise={"position_m": 3e-4, "rotation_rad": 3e-3, "correlation_time_s": [0.0, 0.01], "jitter_s": 0.0},
        warnings=("a <script>warning</script>",),
        rollouts=100,
    )  # fmt: skip
    return dc.replace(d, **changes)


def recording_of(shape=None):
    times = np.array([0.0, 1.0])
    stream = PoseStream(times=times, positions=np.zeros((2, 3)), quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (2, 1)))
    return Recording(
        name="eraser",
        description="",
        object=ObjectModel(shape=shape or Box(size=(0.1, 0.06, 0.03))),
        table=Table(size=(1.0, 1.0)),
        hand=Hand(tip="sphere"),
        sensors=Sensors(),
        pushes=tuple(Push(name=name, object=stream, hand=stream, force=None) for name in NAMES),
    )


def shown_pushes(*, after=True):
    times = np.linspace(0.0, 1.0, 9)
    path = np.column_stack([0.1 * times, 0.02 * times**2, 0.3 * times])
    broken = path + 0.01
    broken[4:] = np.nan  # a rollout that diverged
    return [
        ShownPush(
            name=name, times=times, recorded=path, before=before, after=path + 1e-3 if after else None, released=0.5
        )
        for name, before in zip(NAMES, (path + 5e-3, broken), strict=True)
    ]  # fmt: skip


def missing(push, start, phase):
    return MissingWrench(
        push=push, start=start, end=start + 0.5, wrench=np.array([-0.1, 0.05, 1e-3]), std=np.array([0.02, 0.1, 2e-4]),
        phase=phase, speed=0.2, heading=0.3, yaw=0.1, place=np.array([0.05, 0.01]), spin=0.0,
        columns=np.zeros((0, 3)),
    )  # fmt: skip


WRENCHES = [missing(k, start, phase) for k in (0, 1) for start, phase in ((0.0, "contact"), (0.5, "free_slide"))]


class Tags(HTMLParser):
    """Collects what is open, and refuses an end that does not fit."""

    def __init__(self, page):
        super().__init__()
        self.open, self.seen, self.ids, self.words = [], [], [], []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.handle_startendtag(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.seen.append(tag)
        self.ids += [value for name, value in attrs if name == "id"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


@pytest.fixture(scope="module")
def page():
    return diagnosis_page(diagnosis_with(), recording_of(), shown_pushes(), WRENCHES)


def test_a_page_is_well_formed_and_complete(page):
    tags = Tags(page)
    text = " ".join(tags.words)
    assert page.startswith("<!DOCTYPE html>") and not tags.open
    assert len(tags.ids) == len(set(tags.ids))
    # Law, next push, two views, arrows, and for each push its errors and its strip.
    assert tags.seen.count("svg") == 1 + 1 + 2 + 1 + 2 + 2
    for words in (
        "explained", "Missing physics: stribeck_friction.", "1 × 10⁻⁹", "no (interval is the prior)", "0.2 to 0.3",
        "During free sliding, about 0.1 N", "too little", "< 10⁻³⁰⁰", "nothing beyond noise",
    ):  # fmt: skip
        assert words in text


def test_names_are_escaped(page):
    tags = Tags(page)
    assert "script" not in tags.seen and "u" not in tags.seen and "i" in tags.seen
    assert "<b>1</b>" not in page and "pushes/<b>1</b>.csv" in tags.words
    assert "pushes/$2$ & co.csv" in tags.words
    assert "<i>rival</i>" not in page and "<script>" not in page


def test_a_page_needs_no_network(page):
    assert "http" not in page and "@import" not in page
    assert all(target.startswith("#") for target in re.findall(r'(?:href|src)="([^"]*)"', page))
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", page))


def test_the_same_diagnosis_gives_the_same_bytes(page):
    assert diagnosis_page(diagnosis_with(), recording_of(), shown_pushes(), WRENCHES) == page


def test_effects_that_would_not_show_are_named_beside_those_that_would():
    hidden = "not detectable by these pushes at any size within its bounds"
    for detectable in ((), diagnosis_with().detectable):
        page = diagnosis_page(
            diagnosis_with(detectable=detectable, undetectable=("restitution",)), recording_of(), (), ()
        )
        words = " ".join(" ".join(Tags(page).words).split())
        assert "Smallest detectable effects" in words and f"restitution {hidden}" in words
    assert hidden not in " ".join(Tags(diagnosis_page(diagnosis_with(), recording_of(), (), ())).words)


@pytest.mark.parametrize("verdict", ["consistent", "underpowered", "unexplained", "of another day"])
def test_a_page_of_little(verdict):
    bare = diagnosis_with(verdict=verdict, effects=(), location=None, next_push=None, ranking=(), detectable=(),
                          theta={}, warnings=())  # fmt: skip
    tags = Tags(diagnosis_page(bare, recording_of(), (), ()))
    assert verdict in tags.words and not tags.open and "svg" not in tags.seen


def test_where_nothing_was_found_only_the_plain_cell_is_shown():
    found = diagnosis_with(verdict="unexplained", effects=())
    bare = dc.replace(found, fit=dc.replace(found.fit, rms_after=found.fit.rms_before))
    text = diagnosis_page(bare, recording_of(), shown_pushes(after=False)[:1], WRENCHES[:2])
    assert "with the effects found" not in text and 'class="after"' not in text
    assert "No effect of the catalogue is claimed." in text


def test_what_a_force_without_a_name_does_to_the_errors_is_shown():
    found = diagnosis_with(verdict="unexplained", effects=())
    text = diagnosis_page(found, recording_of(), shown_pushes()[:1], WRENCHES[:2])
    assert "with an unnamed force" in text and 'class="after"' in text
    assert "No effect of the catalogue is claimed." in text


def test_what_is_not_a_number_is_a_dash(page):
    cells = [re.sub(r"<.*?>", "", row) for row in re.findall(r"<tr>(.*?)</tr>", page, flags=re.S)]
    weights = next(c for c in cells if "uneven_support" in c)
    assert "–" in weights and "∞" in weights and not re.search(r"\b(nan|inf)\b", " ".join(Tags(page).words))


def test_gains_across_regimes_are_shown_where_there_are_any(page):
    gains = (
        RegimeGain(fitted_on="50 to 90 mm/s", tested_on="200 to 400 mm/s <i>", gain=-12.34, standard_error=3.0),
        RegimeGain(
            fitted_on="headings 0 to 90 deg", tested_on="headings 180 to 270 deg", gain=5.0, standard_error=math.nan
        ),
    )
    d = diagnosis_with()
    tags = Tags(
        diagnosis_page(dc.replace(d, fit=dc.replace(d.fit, regimes=gains)), recording_of(), shown_pushes(), ())
    )
    assert not tags.open and {
        "50 to 90 mm/s", "200 to 400 mm/s <i>", "−12.3 ± 3.0", "headings 0 to 90 deg",
        "headings 180 to 270 deg", "5.0 ± –",
    } <= set(tags.words)  # fmt: skip
    fit, ranking = (tags.words.index(h) for h in ("Prediction of held-out pushes", "Why other effects were rejected"))
    assert fit < tags.words.index("log-likelihood gain") < ranking
    assert "Generalisation across regimes" in tags.words and "Generalisation across regimes" not in page


def test_a_scene_beside_the_page_is_linked(page):
    pages = ("index.html", "diagnosis.html", "scene.html")
    linked = diagnosis_page(diagnosis_with(), recording_of(), shown_pushes(), WRENCHES, pages=pages)
    assert linked.count('<a href="scene.html"') == 2 and linked.count('<a href="index.html"') == 1
    assert not Tags(linked).open and 'href="plan.html"' not in linked and 'href="diagnosis.html"' not in linked
    assert (
        linked.index("Where it is") < linked.rindex("scene.html") < linked.index("Missing force and torque over time")
    )
    assert "<a" not in page


def test_every_law_is_drawn():
    effects = tuple(effect(name, **parameters) for name, parameters in LAWS.items())
    text = diagnosis_page(diagnosis_with(effects=effects), recording_of(), shown_pushes()[:1], ())
    assert text.count('aria-label="Law of ') == len(LAWS)
    number = (effect("size_error", ratio=estimate(1.01)),)
    text = diagnosis_page(diagnosis_with(effects=number), recording_of(), (), ())
    assert 'aria-label="Law of ' not in text and "size_error" in text


def test_a_standing_cylinder_is_round():
    shape = Cylinder(radius=0.03, length=0.05, axis="z")
    assert "Table from above" in diagnosis_page(diagnosis_with(), recording_of(shape), shown_pushes()[:1], ())


def test_cells_under_a_triangle_have_a_middle_under_it_and_those_beside_it_have_none():
    triangle = np.array([[-50.0, -50.0], [100.0, -50.0], [-50.0, 100.0]])
    edges = np.linspace(-50.0, 100.0, 4)
    middles = effect_laws._middles(triangle, edges, edges)
    np.testing.assert_array_equal(
        np.isfinite(middles[..., 0]), [[True, True, True], [True, True, False], [True, False, False]]
    )
    np.testing.assert_allclose(middles[0, 0], [-25.0, -25.0])
    np.testing.assert_allclose(middles[1, 1], [16.7, 16.7], atol=2.0)  # the half of a cell: a third of its side


@pytest.mark.parametrize(
    ("value", "others", "said"),
    [
        (1.00047, [1.0], "1.0005"),
        (math.nan, [1.0], "–"),
        (1.02435, [1.0, 1.02392, 1.02481], "1.0244"),
        (0.4731, [0.0, 0.453, 0.517], "0.473"),
        (1.0, [1.0], "1"),
        (0.0, [0.1], "0"),
    ],
)
def test_a_ratio_near_one_is_told_from_one(value, others, said):
    assert number(value, digits_between(value, others)) == said


@pytest.mark.parametrize("known", [True, False])
def test_where_nobody_knows_the_noise_the_captions_say_so(known):
    warnings = (
        ()
        if known
        else (f"{UNKNOWN}: the object's noise is taken to be as large as the errors of the baseline model, 2 mm",)
    )
    text = diagnosis_page(diagnosis_with(warnings=warnings), recording_of(), shown_pushes(), WRENCHES)
    assert ("1 = noise only" in text) is known
    assert ("taken to be as large as" in text.partition("<section>")[0]) is not known


def test_where_it_is_has_no_empty_lines():
    endless = Location(statement="at the end", phase=(), dof=(), frame="world", windows=())
    text = diagnosis_page(diagnosis_with(location=endless), recording_of(), shown_pushes(), WRENCHES)
    assert "<dt>frame</dt>" in text and "<dt>when</dt>" not in text and "<dt>in what</dt>" not in text


def test_where_most_is_missing_is_a_table_and_numbers_in_the_picture():
    text = " ".join(diagnosis_page(diagnosis_with(), recording_of(), shown_pushes(), WRENCHES).split())
    for cell in ("0.50 to 1.00", "31, -12", "331", "41.2", "free sliding"):
        assert f">{cell}</td>" in text
    assert "Numbers: the windows of the table." in text


@pytest.mark.parametrize("verdict", ["consistent", "underpowered"])
def test_where_nothing_is_missing_nothing_is_placed(verdict):
    text = diagnosis_page(
        diagnosis_with(verdict=verdict, location=None, effects=()), recording_of(), shown_pushes(), ()
    )
    assert "Where it is" not in text and "Missing force and torque over time" not in text
