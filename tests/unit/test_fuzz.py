"""Odd inputs of every kind are read or refused in one line, and the fuzzer sees what is wrong where it is."""

from random import Random

import pytest
from fuzz import wrong
from fuzz.harness import run
from fuzz.kinds import KINDS
from fuzz.trees import json_text, mutated, yaml_text
from fuzz.watch import lay_out
from fuzz.wrong import FAULTS

QUICK, LONG = 90, 450  # inputs: each kind five times, and 25 times; benchmarks/fuzz.py runs 10,000


@pytest.fixture(scope="module")
def seen():
    """What the fuzzer says of things that are wrong on purpose, by name."""
    tally = run(range(len(wrong.KINDS)), seed=0, module=wrong.__name__, silent=5.0)
    assert tally.inputs == len(wrong.KINDS)
    return tally


@pytest.mark.parametrize("name", FAULTS)
def test_the_fuzzer_sees(name, seen):
    assert seen.counts[name, "fault"] == 1, seen.lines()


def test_the_fuzzer_says_what_it_saw(seen):
    groups = "\n".join(seen.faults)
    assert "traceback: ValueError" in groups
    assert "hang: a hang" in groups and "crash: a crash, status -6" in groups and "exit: a crash, status 3" in groups
    assert "memory: MemoryError" in groups or "2 GB" in groups
    assert groups.count("outside: read outside") == 2 and groups.count("outside: written outside") == 2
    (hang,) = seen.faults["hang: a hang"]
    assert hang["end"] == list(FAULTS).index("hang")


def test_what_is_read_refused_or_warned_of_is_no_fault(seen):
    assert seen.counts["read", "read"] == seen.counts["refused", "refused"] == seen.counts["warning", "warning"] == 1
    assert any("RuntimeWarning" in group for group in seen.warnings)


def test_an_input_is_made_from_seed_and_index_alone(tmp_path):
    def made(name):
        found = {}
        for index, (kind, make) in enumerate(KINDS):
            base = tmp_path / name / f"{index}"
            base.mkdir(parents=True)
            folder = lay_out(base)
            make(Random(f"0 {index}"), folder)
            files = sorted(one for one in folder.rglob("*") if one.is_file() and not one.is_symlink())
            for file in files:
                # Archives hold the time at which they were written.
                content = b"" if file.suffix in (".npz", ".h5") else file.read_bytes()
                found[kind, index, file.relative_to(folder).as_posix()] = content.replace(bytes(base), b"")
        return found

    assert made("one") == made("two")


def test_a_mutated_tree_shares_nothing_that_it_changes():
    tree = {"a": [1, 2, {"b": 0.5}], "c": "text"}
    texts = {json_text(mutated(Random(k), tree, "json")) for k in range(50)}
    assert len(texts) > 30 and tree == {"a": [1, 2, {"b": 0.5}], "c": "text"}
    assert yaml_text(tree) == 'a:\n  - 1\n  - 2\n  -\n    b: 0.5\nc: "text"\n'


def check(indices, seed):
    tally = run(indices, seed=seed)
    assert tally.inputs == len(indices)
    assert not tally.faults and not tally.warnings, "\n".join(tally.lines())


def test_odd_inputs_are_read_or_refused_in_one_line():
    check(range(QUICK), seed=0)


@pytest.mark.slow
def test_many_odd_inputs_are_read_or_refused_in_one_line():
    check(range(LONG), seed=1)
