"""Rollouts that are kept are not made again, and a file of them that was cut off holds those that are whole."""

import dataclasses as dc
import os

import numpy as np
import pytest

from physid_drake.pushes import rollouts
from physid_drake.pushes.kept_rollouts import KEY, KeptRollouts, key_of, magic
from physid_drake.pushes.prediction import Prediction
from physid_drake.pushes.rollouts import RolloutPool


def said(seed, poses=4, forces=2, fell=False):
    rng = np.random.default_rng(seed)
    return Prediction(poses=rng.standard_normal((poses, 3)), forces=rng.standard_normal((forces, 2)), fell=fell)


def key(number):
    return bytes([number]) * KEY


ALL = {key(0): said(0), key(1): None, key(2): said(2, forces=0, fell=True), key(3): said(3, poses=1)}


def same(one, other):
    if one is None or other is None:
        return one is other
    return (
        np.array_equal(one.poses, other.poses) and np.array_equal(one.forces, other.forces) and one.fell == other.fell
    )


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "rollouts.bin"
    kept = KeptRollouts(path)
    kept.keep({k: ALL[k] for k in list(ALL)[:1]})
    kept.keep({k: ALL[k] for k in list(ALL)[1:]})
    return path


def test_a_file_holds_every_bit(file):
    kept = KeptRollouts(file)
    assert len(kept) == len(ALL) and key(9) not in kept
    assert all(same(kept[k], ALL[k]) for k in ALL)


def test_a_file_that_was_cut_off_anywhere_holds_what_is_whole_and_goes_on(file):
    content, seen = file.read_bytes(), set()
    for length in range(len(content)):
        file.write_bytes(content[:length])
        kept = KeptRollouts(file)
        seen.add(len(kept))
        assert all(same(kept[k], ALL[k]) for k in list(ALL)[: len(kept)])
        kept.keep({k: ALL[k] for k in ALL if k not in kept})
        assert file.read_bytes() == content
    assert seen == {0, 1, 2, 3}


@pytest.mark.parametrize("content", [b"something else", b"physid-rollouts/1 of other sources\n" + bytes(90)])
def test_a_file_of_another_kind_is_begun_again(file, content):
    file.write_bytes(content)
    kept = KeptRollouts(file)
    assert len(kept) == 0
    kept.keep(ALL)
    assert len(KeptRollouts(file)) == len(ALL)


def test_a_record_that_another_overlaps_is_not_believed(file):
    """Two processes that share a folder, or a full disk: numbers of one rollout under the key of another."""
    content = bytearray(file.read_bytes())
    content[len(magic()) + 60] ^= 1
    file.write_bytes(bytes(content))
    assert len(KeptRollouts(file)) == 0 and file.stat().st_size == len(magic())


def test_what_there_is_no_room_for_is_made_again(monkeypatch, tmp_path):
    monkeypatch.setattr(rollouts, "predict", lambda spec, thetas, task: said(round(task.theta[0])))
    kept = KeptRollouts(tmp_path / "rollouts.bin", most=400)
    tasks = [Asked(np.array([value])) for value in (1.0, 2.0, 3.0, 4.0, 5.0)]
    pool = RolloutPool("spec", "thetas", jobs=1, kept=kept)
    first, again = pool.run(tasks), pool.run(tasks)
    assert 0 < len(kept) < 5 and all(same(one, other) for one, other in zip(first, again, strict=True))
    assert (tmp_path / "rollouts.bin").stat().st_size < 400 + len(magic())


def test_a_file_that_cannot_be_written_ends_no_run(tmp_path):
    (tmp_path / "gone").mkdir()
    kept = KeptRollouts(tmp_path / "gone" / "rollouts.bin")
    (tmp_path / "gone").rmdir()
    with pytest.warns(UserWarning, match="no longer kept"):
        kept.keep(ALL)
    assert set(ALL) == {key for key in ALL if key in kept}


@dc.dataclass(frozen=True)
class Asked:
    theta: np.ndarray
    name: str = "push"


def test_what_is_the_same_has_one_key_and_what_differs_has_others():
    theta = np.array([0.1, 0.2])
    assert key_of(Asked(theta)) == key_of(Asked(theta.copy()))
    others = [Asked(theta + 1e-16 * np.array([1.0, 0.0])), Asked(theta[::-1].copy()), Asked(theta, "other")]
    assert len({key_of(one) for one in (Asked(theta), *others)}) == 4


def test_a_pool_makes_each_rollout_once_and_tells_of_all(monkeypatch, tmp_path):
    made, told = [], []

    def predict(spec, thetas, task):
        made.append(float(task.theta[0]))
        return None if task.theta[0] < 0.0 else said(round(task.theta[0]))

    monkeypatch.setattr(rollouts, "predict", predict)
    tasks = [Asked(np.array([value])) for value in (1.0, 2.0, 1.0, -1.0)]
    pool = RolloutPool("spec", "thetas", jobs=1, kept=KeptRollouts(tmp_path / "rollouts.bin"))
    first = pool.run(tasks, told.append)
    assert made == [1.0, 2.0, -1.0] and sum(told) == 4 and pool.count == 4 and pool.diverged == 1
    again = RolloutPool("spec", "thetas", jobs=1, kept=KeptRollouts(tmp_path / "rollouts.bin"))
    assert all(same(one, other) for one, other in zip(first, again.run(tasks), strict=True))
    assert len(made) == 3 and again.count == 4
    again.of("another cell").run(tasks[:1])
    assert made[3:] == [1.0]


def test_a_run_that_is_interrupted_keeps_what_was_made(monkeypatch, tmp_path):
    def predict(spec, thetas, task):
        if task.theta[0] == 3.0:
            raise KeyboardInterrupt
        return said(0)

    monkeypatch.setattr(rollouts, "predict", predict)
    pool = RolloutPool("spec", "thetas", jobs=1, kept=KeptRollouts(tmp_path / "rollouts.bin"))
    with pytest.raises(KeyboardInterrupt):
        pool.run([Asked(np.array([value])) for value in (1.0, 2.0, 3.0, 4.0)])
    assert len(KeptRollouts(tmp_path / "rollouts.bin")) == 2


def test_a_pipe_in_the_place_of_the_file_is_left_alone(tmp_path):
    os.mkfifo(tmp_path / "rollouts.bin")
    with pytest.warns(UserWarning, match="no longer kept"):
        kept = KeptRollouts(tmp_path / "rollouts.bin")
    kept.keep({b"0" * 16: None})
    assert len(kept) == 1
