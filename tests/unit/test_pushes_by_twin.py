"""Rollouts of recorded pushes: the twin predicts what the cell does; and what it leaves to the cell."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from bare_laws import BareLaws
from runs import coarse_identifier, shipped_pushes

from physid_drake.cell import CellConfig, ContactConfig
from physid_drake.effects.drag import ViscousDrag
from physid_drake.effects.tracker import TrackerLatency
from physid_drake.identify import SearchConfig
from physid_drake.inference.rollouts import Ask, Physics, Rollouts
from physid_drake.pushes import by_twin
from physid_drake.recording import Cylinder
from physid_drake.twin import compiled


@dataclass(frozen=True)
class Rougher:
    """A friction that is none of the vocabulary."""

    largest: float = 1.2

    def ratio(self, state):
        return np.full(len(state.slips), self.largest)


UNKNOWN = BareLaws(all=(Rougher(),))
SIGMA = np.array([3e-4, 3e-4, 3e-3])


@pytest.fixture(scope="module")
def case():
    return coarse_identifier(shipped_pushes(3), cell=CellConfig(contact=ContactConfig(model="point"))).case


def rollouts_of(case, spec=None, by_cell=(), **changes):
    problems = [replace(problem, **changes) for problem in case.problems]
    return Rollouts(case.pool if spec is None else case.pool.of(spec), problems, case.nuisances, by_cell)


def asks_of(case, *effects):
    physics = Physics(case.thetas.space.nominal, effects)
    return [Ask(i, physics, np.full(len(n.names), 0.3)) for i, n in enumerate(case.nuisances)]


@pytest.mark.parametrize("effects", [(), (ViscousDrag(coefficient=0.1), TrackerLatency(delay=0.02))])
def test_the_twin_predicts_what_the_cell_does(case, effects):
    made = rollouts_of(case, force_times=np.array([0.35, 0.45]))
    asks = asks_of(case, *effects)
    pairs = zip(made.predictions(asks), made.in_cell(case.pool).predictions(asks), strict=True)
    for said, cell in pairs:
        away = (said.poses - cell.poses) / SIGMA
        assert np.sqrt(np.mean(away**2)) < 0.5  # measured .2
        assert said.forces.shape == (2, 2) and said.forces == pytest.approx(cell.forces, abs=0.02)


def test_turns_are_those_of_the_recording(case):
    start = case.problems[0].start
    further = replace(start, pose=(*start.pose[:2], start.pose[2] + 4.0 * np.pi))
    asks = asks_of(case)[:1]
    turned, seen = (rollouts_of(case, start=s).predictions(asks)[0] for s in (further, start))
    assert turned.poses[:, 2] == pytest.approx(seen.poses[:, 2] + 4.0 * np.pi)


def test_what_the_twin_does_not_know_is_the_cells(case):
    """As of an effect of one's own, whose law is Python: found by nobody where such rollouts failed."""
    known, unknown = asks_of(case), asks_of(case, UNKNOWN)
    made = rollouts_of(case)
    one, other = made.predictions([unknown[0], known[0]])
    assert np.array_equal(one.poses, made.in_cell(case.pool).predictions(unknown[:1])[0].poses)
    assert np.array_equal(other.poses, made.predictions(known[:1])[0].poses)
    assert np.abs(one.poses[-1] - other.poses[-1]).max() > 1e-3


def test_what_the_twin_cannot_do_is_said(case):
    spec, known = case.pool.spec, asks_of(case)
    rolls = replace(spec, shape=Cylinder(radius=0.03, length=0.1, axis="y"))
    assert rollouts_of(case, rolls).predictions(known) == [None] * 3
    place = case.problems[0].start.pose
    small = replace(spec, table=((place[0] - 0.1, place[1] - 0.1), (place[0] + 0.1, place[1] + 0.1)))
    assert rollouts_of(case, small).predictions(known[:1]) == [None]  # it comes to the edge


def test_pushes_that_are_the_cells_come_from_it(case):
    """And each answer is that of its own rollout, whatever was asked beside it."""
    plain = asks_of(case)
    mixed = rollouts_of(case, by_cell=[1]).predictions([plain[2], plain[1], plain[0]])
    twin = rollouts_of(case).predictions(plain)
    cell = rollouts_of(case).in_cell(case.pool).predictions(plain)
    for answer, want in zip(mixed, (twin[2], cell[1], twin[0]), strict=True):
        assert np.array_equal(answer.poses, want.poses) and np.array_equal(answer.forces, want.forces)


@pytest.mark.parametrize("integrator", [pytest.param("cell", marks=pytest.mark.slow), "twin"])
def test_identification_says_the_same_with_either(integrator):
    search = SearchConfig(candidates=64, budget=6, jobs=1, integrator=integrator)
    found = coarse_identifier(shipped_pushes(5), search=search).run()
    told = {e.name: e for e in found.estimates}
    for name, true in (("support_friction", 0.27), ("hand_friction", 0.22)):
        low, high = told[name].ci90
        assert low - 0.01 < true < high + 0.01


@pytest.mark.parametrize("kept", [True, False])
def test_the_first_use_says_once_that_it_compiles(case, monkeypatch, capsys, kept):
    monkeypatch.setattr(by_twin, "is_compiled", lambda: kept)
    by_twin.say_that_it_compiles.cache_clear()
    for _ in range(2):
        rollouts_of(case).predictions(asks_of(case)[:1])
    assert capsys.readouterr().err.count("compiling the twin") == (0 if kept else 1)


def test_machine_code_is_kept_where_the_user_may_write_and_else_made_anew(tmp_path, monkeypatch):
    """The folder is named after the sources, so that no other revision's code is taken."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    for home, there in ((tmp_path, True), (tmp_path / "file", False)):
        (tmp_path / "file").touch()
        monkeypatch.setenv("XDG_CACHE_HOME", str(home))
        compiled.cache_folder.cache_clear()
        folder = compiled.cache_folder()
        assert (folder is not None and folder.parent == tmp_path / "physid_drake" / "twin") == there
        made = compiled.compiled(lambda x: x + 1)
        assert made(2) == 3 and (folder is None or any(folder.rglob("*.nbi")))
    compiled.cache_folder.cache_clear()
