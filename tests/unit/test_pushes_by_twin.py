"""What the twin predicts of recorded pushes: what the cell does; and what it leaves to the cell."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from bare_laws import BareLaws
from runs import coarse_identifier, shipped_pushes

from physid_drake.cell import CellConfig, ContactConfig
from physid_drake.effects.drag import RollingResistance, ViscousDrag
from physid_drake.effects.tracker import TrackerLatency
from physid_drake.identify import SearchConfig
from physid_drake.pushes import by_twin
from physid_drake.pushes.by_twin import predicted_by_twin
from physid_drake.pushes.nuisance import nuisance_of
from physid_drake.pushes.rollouts import RolloutPool, predict
from physid_drake.pushes.task import Task
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
def identifier():
    return coarse_identifier(shipped_pushes(3), cell=CellConfig(contact=ContactConfig(model="point")))


def tasks_of(identifier, *effects, **changes):
    thetas = identifier.thetas
    for problem in identifier.problems:
        nuisance = nuisance_of(problem, 0.01)
        theta = thetas.space.nominal
        yield Task(
            problem=replace(problem, **changes), theta=theta, nuisance=nuisance, values=0.3 * nuisance.stds,
            effects=effects,
        )  # fmt: skip


@pytest.mark.parametrize("effects", [(), (ViscousDrag(coefficient=0.1), TrackerLatency(delay=0.02))])
def test_the_twin_predicts_what_the_cell_does(identifier, effects):
    spec, thetas = identifier.pool.spec, identifier.thetas
    tasks = list(tasks_of(identifier, *effects, force_times=np.array([0.35, 0.45])))
    for task, said in zip(tasks, predicted_by_twin(spec, thetas, tasks), strict=True):
        cell = predict(spec, thetas, task)
        away = (said.poses - cell.poses) / SIGMA
        assert np.sqrt(np.mean(away**2)) < 0.5  # measured .2
        assert said.forces.shape == (2, 2) and said.forces == pytest.approx(cell.forces, abs=0.02)


def test_turns_are_those_of_the_recording(identifier):
    start = identifier.problems[0].start
    further = replace(start, pose=(*start.pose[:2], start.pose[2] + 4.0 * np.pi))
    tasks = list(tasks_of(identifier, start=further))[:1]
    plain = list(tasks_of(identifier, start=start))[:1]
    spec, thetas = identifier.pool.spec, identifier.thetas
    turned, seen = predicted_by_twin(spec, thetas, tasks)[0], predicted_by_twin(spec, thetas, plain)[0]
    assert turned.poses[:, 2] == pytest.approx(seen.poses[:, 2] + 4.0 * np.pi)


def test_what_the_twin_does_not_know_is_left_to_the_cell(identifier):
    spec, thetas = identifier.pool.spec, identifier.thetas
    (known, *_), (unknown, *_) = tasks_of(identifier), tasks_of(identifier, UNKNOWN)
    assert predicted_by_twin(spec, thetas, [unknown, known])[0] is None
    rolls = replace(spec, shape=Cylinder(radius=0.03, length=0.1, axis="y"))
    assert (
        predicted_by_twin(rolls, thetas, [known, *tasks_of(identifier, RollingResistance(coefficient=1e-3))])
        == [None] * 4
    )
    place = known.problem.start.pose
    small = replace(spec, table=((place[0] - 0.1, place[1] - 0.1), (place[0] + 0.1, place[1] + 0.1)))
    assert predicted_by_twin(small, thetas, [known]) == [None]  # it comes to the edge


def test_a_pool_puts_the_cells_answers_where_the_twin_has_none(identifier):
    plain = list(tasks_of(identifier))
    unknown = list(tasks_of(identifier, UNKNOWN))
    mixed = [plain[0], unknown[1], plain[2], unknown[0]]
    spec, thetas = identifier.pool.spec, identifier.thetas
    said = RolloutPool(spec, thetas, 1, integrator="twin").run(mixed)
    by_twin, by_cell = predicted_by_twin(spec, thetas, plain), [predict(spec, thetas, task) for task in unknown]
    for answer, want in zip(said, (by_twin[0], by_cell[1], by_twin[2], by_cell[0]), strict=True):
        assert np.array_equal(answer.poses, want.poses) and np.array_equal(answer.forces, want.forces)


@pytest.mark.parametrize("integrator", [pytest.param("cell", marks=pytest.mark.slow), "twin"])
def test_identification_says_the_same_with_either(integrator):
    search = SearchConfig(candidates=64, budget=6, jobs=1, integrator=integrator)
    found = coarse_identifier(shipped_pushes(5), search=search, held_out_share=0.2).run()
    told = {e.name: e for e in found.estimates}
    for name, true in (("support_friction", 0.27), ("hand_friction", 0.22)):
        low, high = told[name].ci90
        assert low - 0.01 < true < high + 0.01


@pytest.mark.parametrize("kept", [True, False])
def test_the_first_use_says_once_that_it_compiles(identifier, monkeypatch, capsys, kept):
    monkeypatch.setattr(by_twin, "is_compiled", lambda: kept)
    by_twin.say_that_it_compiles.cache_clear()
    tasks = list(tasks_of(identifier))[:1]
    for _ in range(2):
        predicted_by_twin(identifier.pool.spec, identifier.thetas, tasks)
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
