"""What is put on Meshcat's stage, and the page that it plays on."""

import base64
import io
import json
import re
import socket
import subprocess
import sys
from types import SimpleNamespace

import matplotlib.image as mpimg
import numpy as np
import pytest

from physid_drake.cell.solid import solid_of
from physid_drake.diagnose.localise import MissingWrench
from physid_drake.errors import ConfigError
from physid_drake.recording import Box, Hand, read_recording
from physid_drake.report.acts import first_act, setting_of_recording, unit_force_of
from physid_drake.report.live import STOP, Live
from physid_drake.report.meshcat_server import served
from physid_drake.report.scene_page import scene_page
from physid_drake.report.sign import sign
from physid_drake.report.stage import BASELINE, CORRECTED, RECORDED, Act, Setting, Stage, Track, _tiles
from physid_drake.resources import shipped

TABLE = ((-0.6, -0.4), (0.6, 0.4))
BOX = Box(size=(0.06, 0.12, 0.03))


def missing(along, across, std):
    return MissingWrench(
        push=0, start=0.1, end=0.2, wrench=np.array([along, across, 0.0]), std=np.full(3, std), phase="contact",
        speed=0.1, heading=0.5, yaw=0.0, place=np.array([0.05, -0.02]), spin=0.0, columns=np.zeros((0, 3)),
    )  # fmt: skip


def track(*places):
    poses = [[1.0, 0.0, 0.0, 0.0, x, 0.0, 0.015] for x in places]
    return Track(times=np.linspace(0.0, 1.0, len(places)), poses=np.array(poses))


def act(name="pushes/001.csv", wrenches=(), **bodies):
    return Act(name=name, begin=0.0, end=1.0, bodies=bodies, hand=track(-0.1, 0.1), missing=wrenches)


def setting(*kinds, **more):
    return Setting(
        table=TABLE, shapes=dict.fromkeys(kinds, BOX), hand=Hand(tip="sphere", radius=0.01), **more
    )  # fmt: skip


SETTING = setting(RECORDED, BASELINE, CORRECTED)
BODIES = {RECORDED: track(0.0, 0.2), BASELINE: track(0.0, 0.1), CORRECTED: track(0.0, 0.19)}


@pytest.fixture(scope="module")
def played():
    stage = Stage(SETTING)
    wrenches = (missing(0.2, 0.0, 0.01), missing(0.0, -0.1, 0.5))
    acts = [act("one", wrenches, **BODIES), act("planned", **{CORRECTED: track(0.0, 0.3)})]
    return stage, stage.play(acts, unit_force=0.1), stage.meshcat.StaticHtml()


def test_every_act_begins_where_the_last_one_has_paused(played):
    _, marks, _ = played
    assert [name for name, _ in marks] == ["one", "planned"] and [time for _, time in marks] == [0.0, 1.4]


def test_every_missing_wrench_is_an_arrow_of_its_push_and_a_spot_on_the_table(played):
    stage, _, _ = played
    paths = [f"acts/0/missing/{k}/{part}" for k in (0, 1) for part in ("shaft", "head")]
    assert all(stage.meshcat.HasPath(path) for path in [*paths, "mismatch/0", "mismatch/1"])
    assert not stage.meshcat.HasPath("acts/1/missing") and not stage.meshcat.HasPath("mismatch/2")


def test_whoever_is_in_an_act_has_a_path_and_stands_where_it_began(played):
    stage, _, _ = played
    assert all(stage.meshcat.HasPath(f"acts/0/paths/{kind}") for kind in BODIES)
    assert stage.meshcat.HasPath(f"acts/1/paths/{CORRECTED}") and not stage.meshcat.HasPath("acts/1/paths/baseline")
    assert all(stage.meshcat.HasPath(f"bodies/{kind}/here/shape/0") for kind in BODIES)


def test_a_track_is_at_its_last_sample():
    moving = track(0.0, 0.1, 0.2)
    assert [moving.at(t).translation()[0] for t in (-1.0, 0.0, 0.49, 0.5, 9.0)] == [0.0, 0.0, 0.0, 0.1, 0.2]


def test_friction_of_cells_is_painted_underneath_from_dark_to_bright():
    tiles = _tiles(solid_of(BOX).underside, np.array([[0.1, 0.2], [0.3, 0.4]]))
    places = [tuple(np.round(centre, 6)) for _, centre, _ in tiles]
    assert places == [(-0.015, -0.03), (-0.015, 0.03), (0.015, -0.03), (0.015, 0.03)]
    brightness = [shade.r() + shade.g() + shade.b() for _, _, shade in tiles]
    assert brightness == sorted(brightness) and brightness[0] < brightness[-1]
    painted = Stage(setting(BASELINE, undersides={BASELINE: np.array([[0.1, 0.2], [0.3, 0.4]])}))
    assert painted.meshcat.HasPath("bodies/baseline/here/underside/3")


@pytest.mark.parametrize(("forces", "unit"), [((0.2,), 0.1), ((0.2, 6.0), 2.0), ((), 0.1)])
def test_the_largest_force_that_is_surely_missing_sets_the_length_of_arrows(forces, unit):
    wrenches = [*(missing(force, 0.0, 0.01) for force in forces), missing(30.0, 0.0, 50.0)]
    around = SimpleNamespace(friction=0.25, weight=4.0)
    evidence = SimpleNamespace(case=SimpleNamespace(around=around), wrenches=wrenches)
    assert unit_force_of(evidence) == pytest.approx(unit)


def test_a_wrench_stands_out_beyond_two_standard_deviations():
    assert missing(0.25, 0.0, 0.1).stands_out and missing(0.0, -0.25, 0.1).stands_out
    assert not missing(0.19, 0.19, 0.1).stands_out


# The page.


def page(**more):
    acts = [act("one <b>", (missing(0.2, 0.0, 0.01),), **BODIES), act("two", **BODIES)]
    return scene_page(SETTING, acts, name="eraser <u>", unit_force=0.12, corrected="with a grain", **more)


def test_a_scene_says_what_its_colours_mean_and_switches_each():
    text = page(lines=["What is missing: <i>."], pages=("index.html", "scene.html"))
    assert "eraser &lt;u&gt;" in text and "one &lt;b&gt;" in text and "&lt;i&gt;" in text and "<u>" not in text
    assert "An arrow of 50 mm is 0.12 N" in text and '<a href="index.html"' in text
    for switch in ("recorded", "paths", "missing", "mismatch", "hand", "reach"):
        assert f'<input type="checkbox" value="{switch}"' in text
    assert re.findall(r'name="model" value="(\w+)"', text) == ["both", "baseline", "corrected"]
    assert text.rstrip().endswith("</html>")


def test_a_scene_of_one_model_without_a_mismatch_offers_no_choice():
    lone = setting(RECORDED, BASELINE)
    text = scene_page(lone, [act(**{RECORDED: track(0.0), BASELINE: track(0.0)})], name="eraser")
    assert 'name="model"' not in text and "arrow" not in text and 'value="missing"' not in text
    assert "baseline model" in text


def test_nobody_can_connect_to_a_stage_without_a_view(played):
    stage, _, html = played
    with pytest.raises(ConnectionRefusedError):  # before a test takes this port for a view
        socket.create_connection(("127.0.0.1", stage.meshcat.port()), timeout=5.0)
    assert len(html) > 100_000


# The live view.


@pytest.fixture
def eraser():
    return read_recording(shipped("recordings") / "eraser_reference")


def test_a_live_view_says_what_goes_on_and_then_plays(eraser):
    live = Live(eraser, "127.0.0.1")
    assert STOP in live._meshcat.GetButtonNames() and live._meshcat.HasPath("sign")
    told = []
    tell = live.watching(lambda *how_far: told.append(how_far))
    tell("theta", 0, 0)
    tell("theta", 1, 2)
    assert told == [("theta", 0, 0), ("theta", 1, 2)] and live.now == "theta" and live.lines == []
    live.found("consistent: nothing is missing")
    live.play(setting_of_recording(eraser), [first_act(eraser)], 1.0)
    assert live.now == "" and live.lines == ["consistent: nothing is missing"]
    assert STOP not in live._meshcat.GetButtonNames()
    assert live._meshcat.HasPath(f"acts/0/paths/{RECORDED}") and live._meshcat.HasPath("sign")


def ink_of(lines):
    content = json.loads(sign(lines).source().in_memory().mesh_file.contents())
    picture = base64.b64decode(content["images"][0]["uri"].partition(",")[2])
    return int((mpimg.imread(io.BytesIO(picture), format="png")[..., 0] < 0.5).sum())


def test_a_sign_has_its_text_as_ink_and_takes_any():
    assert ink_of([]) == 0 < ink_of(["a"]) < ink_of(["a", "$x^2 and <b> and " + 200 * "long "])


def test_the_stop_button_ends_a_job_as_ctrl_c_does(eraser):
    live = Live(eraser, "127.0.0.1")
    tell = live.watching(lambda *_: None)
    tell("theta", 0, 0)
    # As a browser says that it was pressed: a map of two texts, packed by MessagePack.
    pressed = b"\x82" + b"".join(
        bytes([0xA0 + len(word)]) + word for word in (b"type", b"button", b"name", STOP.encode())
    )
    live._meshcat._InjectWebsocketMessage(message=pressed)
    with pytest.raises(KeyboardInterrupt):
        tell("theta", 0, 0)


def test_a_view_listens_on_this_machine_alone():
    meshcat = served()
    with socket.create_connection(("127.0.0.1", meshcat.port()), timeout=5.0):
        pass
    with pytest.raises(ConnectionRefusedError):  # 127.0.0.2 is another address of the same machine
        socket.create_connection(("127.0.0.2", meshcat.port()), timeout=5.0)
    with pytest.raises(ConfigError, match="--host"):
        served("203.0.113.7")


def test_a_stage_that_another_thread_collects_does_not_end_the_process():
    code = """
import gc, threading
from physid_drake.recording import read_recording
from physid_drake.report.acts import setting_of_recording
from physid_drake.report.meshcat_server import _listening
from physid_drake.report.stage import Stage
from physid_drake.resources import shipped
Stage(setting_of_recording(read_recording(shipped("recordings") / "eraser_reference")))
assert _listening() == set()
thread = threading.Thread(target=gc.collect)
thread.start()
thread.join()
"""
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
