"""The pages of the main job in a browser: each opens, is used, and fits on a desk, a phone and paper.

They need Chromium (``apt install chromium``) and the Python package playwright.
"""

import io
import json
import os
import shutil
from pathlib import Path

import matplotlib.image as mpimg
import numpy as np
import pytest

from physid_drake import run_cell
from physid_drake.recording import read_recording
from physid_drake.report.live import STOP, Live
from physid_drake.resources import shipped

sync_api = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = [pytest.mark.slow, pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")]

PAGES = ("index.html", "diagnosis.html", "scene.html", "plan.html")
PANEL = 400  # columns
SEEN = 3e-5  # of the screen: a path is a line of one pixel
DESK, PHONE = {"width": 1280, "height": 800}, {"width": 390, "height": 844}
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    """The folder of a main job: that which PHYSID_RUN names, or one of its own."""
    if "PHYSID_RUN" in os.environ:
        return Path(os.environ["PHYSID_RUN"])
    out = tmp_path_factory.mktemp("job") / "out"
    assert run_cell.main(["--out", str(out), "--no-view"]) == 0
    return out


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield chromium
        chromium.close()


@pytest.fixture
def opened(browser, job):
    """Opens a page of the job; whatever goes wrong in it fails the test."""
    wrong, tabs = [], []

    def open_page(name, size=DESK):
        tab = browser.new_page(viewport=size)
        tabs.append(tab)
        tab.on("pageerror", lambda error: wrong.append(str(error)))
        tab.on("console", lambda message: wrong.append(message.text) if message.type == "error" else None)
        tab.on("requestfailed", lambda request: wrong.append(request.url))
        tab.goto((job / name).as_uri())
        tab.wait_for_timeout(300)
        return tab

    yield open_page
    for tab in tabs:
        tab.close()
    assert wrong == []


def pixels(tab, *, beside=0):
    """The screen (rows, columns, 3), right of so many columns: a panel's focus is no part of the scene."""
    return mpimg.imread(io.BytesIO(tab.screenshot()), format="png")[:, beside:, :3]


def changed(before, after):
    """Share of the pixels that differ."""
    return float((np.abs(after - before).max(axis=-1) > 0.02).mean())


@pytest.mark.parametrize("size", [DESK, PHONE], ids=["desk", "phone"])
@pytest.mark.parametrize("name", PAGES)
def test_a_page_opens_fits_and_shows_something(opened, name, size):
    tab = opened(name, size)
    assert tab.evaluate("document.documentElement.scrollWidth") <= size["width"] + 1
    assert tab.title() and "sealed_01" in tab.inner_text("body")
    assert pixels(tab).std() > 0.02
    links = tab.eval_on_selector_all("nav a", "all => all.map(a => a.getAttribute('href'))")
    assert set(links) == set(PAGES) - {name}


@pytest.mark.parametrize("name", ["index.html", "diagnosis.html", "plan.html"])
def test_on_paper_a_page_keeps_its_bars_and_all_that_is_folded(opened, name):
    tab = opened(name)
    tab.emulate_media(media="print")
    adjust = tab.evaluate("getComputedStyle(document.body).getPropertyValue('print-color-adjust')")
    assert adjust == "exact" and len(tab.pdf()) > 10_000
    if name == "diagnosis.html":
        bars = tab.eval_on_selector_all(".bar i", "all => all.map(i => getComputedStyle(i).backgroundColor)")
        assert bars and "rgba(0, 0, 0, 0)" not in bars
        folded = tab.locator("details >> nth=0").locator("table, figure").first
        assert folded.bounding_box()["height"] > 10


def test_the_first_screen_of_a_diagnosis_answers_what_a_user_asks(opened, job):
    tab = opened("diagnosis.html")
    answer = json.loads((job / "diagnosis.json").read_text())
    bottom = tab.locator("dl.answers").bounding_box()
    assert bottom["y"] + bottom["height"] < DESK["height"]
    text = " ".join(tab.inner_text("header").split())
    for asked in ("How sure is that?", "Where?", "What now?", "May I trust it?"):
        assert asked in text
    assert answer["sentence"] in text and answer["location"]["statement"][1:] in text
    assert "load_model" in text and "Error on held-out pushes" in text


# The scene.


def test_a_push_that_is_chosen_plays_and_its_name_follows_the_time(opened):
    tab = opened("scene.html")
    acts = tab.locator("#physid-act option").all_inner_texts()
    assert acts[0] == "pushes/001.csv" and acts[-1].startswith("planned push")
    for name in (acts[4], acts[-1], acts[0]):
        tab.select_option("#physid-act", label=name)
        tab.wait_for_timeout(300)
        assert tab.locator("#physid-act option:checked").inner_text() == name
    tab.wait_for_timeout(2500)  # it plays on into the next
    assert tab.locator("#physid-act option:checked").inner_text() != acts[0]
    assert "sealed_01" in tab.title()


def test_play_stops_and_goes_on(opened):
    tab = opened("scene.html")
    tab.click("#physid-play")
    tab.wait_for_timeout(200)
    before = pixels(tab)
    tab.wait_for_timeout(500)
    assert changed(before, pixels(tab)) == 0.0 and tab.inner_text("#physid-play") == "play"
    tab.click("#physid-play")
    tab.wait_for_timeout(800)
    assert changed(before, pixels(tab)) > 0.0005 and tab.inner_text("#physid-play") == "pause"


def test_every_switch_changes_what_is_seen_and_back(opened):
    tab = opened("scene.html")
    tab.select_option("#physid-act", label="pushes/002.csv")
    tab.click("#physid-play")
    tab.wait_for_timeout(300)
    before = pixels(tab, beside=PANEL)
    for box in tab.locator("#physid-show input").all():
        box.click()
        tab.wait_for_timeout(250)
        assert changed(before, pixels(tab, beside=PANEL)) > SEEN, box.get_attribute("value")
        box.click()
        tab.wait_for_timeout(250)
        assert changed(before, pixels(tab, beside=PANEL)) < SEEN, box.get_attribute("value")
    for model in ("baseline", "corrected"):
        tab.check(f"#physid-model input[value={model}]")
        tab.wait_for_timeout(250)
        assert changed(before, pixels(tab, beside=PANEL)) > SEEN, model
    tab.check("#physid-model input[value=both]")
    tab.click("#physid-below")
    tab.wait_for_timeout(250)
    assert changed(before, pixels(tab, beside=PANEL)) > 0.2
    tab.click("#physid-below")
    tab.wait_for_timeout(250)
    assert changed(before, pixels(tab, beside=PANEL)) < 0.01


# The live view.


def test_the_live_view_shows_a_sign_and_its_button_stops_the_job(browser):
    live = Live(read_recording(shipped("recordings") / "sealed_01"), "127.0.0.1")
    tell = live.watching(lambda *_: None)
    tab = browser.new_page(viewport=DESK)
    tab.goto(live.url)
    tab.wait_for_timeout(1200)
    before = pixels(tab)
    tell("single effects", 0, 0)
    tab.wait_for_timeout(800)
    assert changed(before, pixels(tab)) > 2e-4  # another line on the sign
    tab.click("text=Open Controls")
    tab.click(f"text={STOP}")
    tab.wait_for_timeout(500)
    with pytest.raises(KeyboardInterrupt):
        tell("single effects", 0, 0)
    tab.close()
