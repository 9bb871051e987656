"""What the proof makes: worlds that tell nothing, share nothing with the diagnosis, and can be made again."""

import ast
import json
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from physid_drake.errors import ParameterError, ProofError
from physid_drake.recording import Box, read_recording
from physid_drake.validation.sealing.secret import name_by_seed, read_secret
from physid_drake.validation.worlds import make, mix, mujoco_world, strengths
from physid_drake.validation.worlds.effects import catalogue as fx
from physid_drake.validation.worlds.effects.effect import parameters_of
from physid_drake.validation.worlds.knobs import draw_knob
from physid_drake.validation.worlds.mujoco_world import PushWorld
from physid_drake.validation.worlds.scene import draw_scene
from physid_drake.validation.worlds.world_plan import Plan

PLAN = Plan(
    shape=Box(size=(0.127, 0.051, 0.030)), mass=0.2, support_friction=0.3, hand_friction=0.2, tip_radius=0.008,
    tip_height=0.015,
)  # fmt: skip


def test_the_package_shares_nothing_with_the_diagnosis():
    forbidden = {"effects", "cell", "identify", "diagnose"}
    folder = Path(mujoco_world.__file__).parent
    worlds = ("make", "scene", "knobs", "shapes", "feet", "world_plan", "contact", "mujoco_xml", "mujoco_world")
    for file in [*(folder / f"{name}.py" for name in worlds), *(folder / "effects").glob("*.py")]:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            for name in names:
                parts = name.split(".")
                assert parts[0] != "pydrake"
                assert parts[0] != "physid_drake" or not forbidden & set(parts[1:2])


def test_missing_mujoco_says_what_to_install(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(mujoco_world.importlib, "import_module", missing)
    with pytest.raises(ProofError, match=r"pip install '\.\[proof\]'"):
        PushWorld(PLAN)


def test_the_mix_is_a_quarter_nothing_and_every_effect_has_its_turn():
    drawn = [mix.assign(index, 7) for index in range(200)]
    assert {kind: sum(d.kind == kind for d in drawn) for kind in mix.KINDS} == {
        "none": 50,
        "effect": 100,
        "other": 30,
        "pair": 20,
        "notched": 0,
    }
    assert {d.effects[0] for d in drawn if d.kind == "effect"} == set(fx.CATALOGUED)
    assert {d.effects[0] for d in drawn if d.kind == "other"} == set(fx.OTHERS)
    assert all(len(set(d.effects)) == 2 for d in drawn if d.kind == "pair")
    assert len({name_by_seed(index, 7) for index in range(200)}) == 200


@pytest.fixture
def short_scenes(monkeypatch):
    """Two pushes a world: enough for what is written."""
    monkeypatch.setattr(make, "draw_scene", lambda rng, **kinds: _cut(draw_scene(rng, **kinds)))


def _cut(scene):
    return replace(scene, pushes=scene.pushes[:2])


@pytest.mark.slow
def test_a_world_is_made_again_bit_for_bit_and_tells_nothing(tmp_path, short_scenes):
    seals = [make.make(tmp_path / name, 1, 3, kind="effect", names_by_seed=True) for name in ("a", "b")]
    assert seals[0] == seals[1] == make.make(tmp_path / "a", 1, 3, kind="effect")
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file())
    for file in files:
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()
    for folder in (tmp_path / "a" / "recordings").iterdir():
        recording = read_recording(folder)
        truth = json.loads((tmp_path / "a" / "sealed" / f"{folder.name}.json").read_text())
        text = (folder / "recording.yaml").read_text()
        assert not any(name in text for name in [*fx.CATALOGUED, *fx.OTHERS])
        for push_ in recording.pushes:
            exact = np.array(
                truth["noise_free_poses"][f"pushes/{push_.name.split('/')[-1].removesuffix('.csv')}.csv"]
            )
            error = push_.object.planar - exact
            assert np.abs(error[:, :2]).max() < 6 * truth["noise"]["position"]
            assert len(exact) == len(push_.object)


@pytest.fixture
def no_worlds(monkeypatch):
    """Worlds that cost nothing: a recording of one file, and a truth."""

    def made(index, seed, kind, effect, name):
        return name, {"id": name, "index": index, "seed": seed}

    def written(name, folder):
        folder.mkdir(parents=True)
        (folder / "recording.yaml").write_text(f"name: {name}\n")

    monkeypatch.setattr(make, "make_world", made)
    monkeypatch.setattr(make, "write_recording", written)


def test_a_folder_keeps_its_worlds_names_and_another_has_others(tmp_path, no_worlds):
    make.make(tmp_path / "a", 2, 3)
    first = {path.name for path in (tmp_path / "a" / "recordings").iterdir()}
    make.make(tmp_path / "a", 3)
    make.make(tmp_path / "b", 3, 3)
    more, others = ({path.name for path in (tmp_path / f / "recordings").iterdir()} for f in ("a", "b"))
    assert first < more and len(more) == 3 and not more & others
    truths = [json.loads(file.read_text()) for file in (tmp_path / "a" / "sealed").glob("????????.json")]
    assert sorted((truth["index"], truth["seed"]) for truth in truths) == [(0, 3), (1, 3), (2, 3)]


def test_names_by_seed_are_those_of_the_answers_in_docs(tmp_path, no_worlds):
    make.make(tmp_path, 14, 42042, names_by_seed=True)
    assert (tmp_path / "recordings" / "a3d441d5").is_dir()


def test_what_an_interrupted_making_began_is_made_again_and_nothing_else_is_removed(tmp_path, no_worlds):
    make.make(tmp_path, 2, 3)
    done, begun = (path for path in sorted((tmp_path / "recordings").iterdir()))
    (tmp_path / "sealed" / f"{begun.name}.json").unlink()
    (tmp_path / "seal.txt").unlink()
    for folder in (done, begun):
        (folder / "own.txt").write_text("mine")
    make._write_world(tmp_path, next(k for k in range(2) if read_secret(tmp_path).name_of(k) == begun.name),
                      read_secret(tmp_path))  # fmt: skip
    assert (done / "own.txt").exists() and not (begun / "own.txt").exists()
    for kind in ("link", "file"):
        (tmp_path / "sealed" / f"{begun.name}.json").unlink(missing_ok=True)
        make.shutil.rmtree(begun) if begun.is_dir() and not begun.is_symlink() else begun.unlink()
        begun.symlink_to(done) if kind == "link" else begun.write_text("mine")
        with pytest.raises(ProofError, match=f"recordings/{begun.name}': must be a folder, or nothing yet"):
            make.make(tmp_path, 2, 3)
    assert (done / "own.txt").exists() and begun.read_text() == "mine"


@pytest.mark.parametrize("other", ["somebody's", "seed", "kind"])
def test_by_hand_a_folder_that_holds_something_else_is_refused(tmp_path, no_worlds, capsys, other):
    if other == "somebody's":
        (tmp_path / "recordings" / "mine").mkdir(parents=True)
    else:
        make.make(tmp_path, 1, 3, "none" if other == "kind" else None)
    before = sorted(tmp_path.rglob("*"))
    capsys.readouterr()
    words = ["--worlds", "1", "--out", str(tmp_path), "--seed", "4" if other == "seed" else "3"]
    assert make.main(words) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and said.startswith("error: ") and "choose another --out" in said
    assert sorted(tmp_path.rglob("*")) == before


def test_tethers_are_springs_and_cables_and_some_cables_are_slack_in_the_middle():
    scene = draw_scene(np.random.default_rng(0))
    knobs = [draw_knob("tether", np.random.default_rng([1, k]), scene) for k in range(60)]
    drawn = [knob.at(knob.limit) for knob in knobs]
    slack = [np.hypot(one.x, one.y) < one.rest_length for one in drawn]
    assert 10 <= sum(one.rest_length == 0.0 for one in drawn) <= 30
    assert 5 <= sum(slack) <= 20


def test_parameters_are_plain_numbers():
    for effect in (fx.CATALOGUED | fx.OTHERS).values():
        written = json.loads(json.dumps(parameters_of(effect())))
        assert set(written) == {field.name for field in fields(effect)}


def test_two_effects_may_not_lift_an_edge_together():
    """Each is drawn so that it does not; both may."""
    rng, lifted = np.random.default_rng(0), []
    for _ in range(20):
        scene = draw_scene(rng)
        knobs = [draw_knob(name, rng, scene) for name in ("uneven_support", "com_offset")]
        effects = [knob.at(knob.limit) for knob in knobs]
        assert all(
            strengths.loaded(scene, [effect, other.at(0.0)])
            for effect, other in zip(effects, knobs[::-1], strict=True)
        )
        lifted.append(not strengths.loaded(scene, effects))
    assert any(lifted) and not all(lifted)


def test_a_world_has_one_grain():
    drawn = {frozenset(mix.assign(index, 7, "pair", "anisotropic_table").effects) for index in range(300)}
    assert frozenset(mix.GRAINS) not in drawn and len(drawn) == len(fx.CATALOGUED) - 2
    grains = [draw_knob(name, np.random.default_rng(0), SimpleNamespace(plan=PLAN)).at(0.3) for name in mix.GRAINS]
    with pytest.raises(ParameterError, match="one grain"):
        PushWorld(PLAN, grains, pushes=1).run((0.0, 0.0, 0.0), None, push=0, duration=0.01)


@pytest.mark.parametrize(("tilt", "ratio", "rests"), [(0.1, 1.0, True), (0.0, 0.3, True), (0.1, 0.3, False)])
def test_two_effects_that_set_an_object_going_before_the_hand_comes_make_no_world(tilt, ratio, rests):
    push = SimpleNamespace(pose=(0.0, 0.0, 0.0), friction_factor=1.0)
    effects = [fx.CATALOGUED["table_tilt"](x=tilt, y=0.0), fx.CATALOGUED["friction_patch"](ratio=ratio, radius=1.0)]
    assert strengths.stands(SimpleNamespace(plan=PLAN, pushes=[push]), effects) is rests


def test_worlds_with_notches_have_one_effect_or_none():
    kinds = [mix.assign(index, 5, "notched") for index in range(8)]
    assert [one.kind for one in kinds] == ["effect", "effect", "effect", "none"] * 2
    assert all(one.notched and len(one.effects) == (one.kind == "effect") for one in kinds)
    assert not mix.assign(0, 5, "effect").notched
