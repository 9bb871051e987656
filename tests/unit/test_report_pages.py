"""The pages of a folder link to each other, and one of them leads."""

import itertools

import pytest
from matplotlib.colors import to_rgb

from physid_drake.report import svg
from physid_drake.report.pages import DIAGNOSIS, INDEX, PLAN, SCENE, index_page, nav
from physid_drake.report.stage import COLOURS


def test_a_page_links_to_those_beside_it_and_not_to_itself():
    links = nav(DIAGNOSIS, (INDEX, DIAGNOSIS, SCENE))
    assert [f'href="{page}"' in links for page in (INDEX, DIAGNOSIS, SCENE, PLAN)] == [True, False, True, False]
    assert "<b" in links and "Diagnosis</b>" in links


def test_a_page_that_is_alone_links_to_nothing():
    assert nav(PLAN, ()) == "" and nav(PLAN, (PLAN, "plan.json")) == ""


def test_the_page_that_leads_says_what_came_of_it_and_what_the_others_tell():
    page = index_page("Diagnosis of <mug>", ["Missing physics: a & b."], ("diagnosis.json", INDEX, DIAGNOSIS, SCENE))
    assert "Diagnosis of &lt;mug&gt;" in page and "a &amp; b" in page and "<mug>" not in page
    assert page.count(f'href="{DIAGNOSIS}"') == 2 and "in three dimensions" in page and PLAN not in page
    assert "diagnosis.json" in page and "http" not in page


def lightness(colour):
    """Of sRGB, as a printer without colours has it (Rec. 601)."""
    red, green, blue = to_rgb(colour)
    return 0.299 * red + 0.587 * green + 0.114 * blue


@pytest.mark.parametrize(
    "series",
    [(svg.INK, svg.AFTER, svg.BEFORE), (svg.CONTACT, svg.FREE), tuple(c[:3] for c in COLOURS.values())],
    ids=["models", "phases", "scene"],
)
def test_series_of_one_figure_are_told_apart_without_colours(series):
    shades = sorted(map(lightness, series))
    assert min(b - a for a, b in itertools.pairwise(shades)) > 0.12, shades
