"""Experiments: statistics, tables, kept repetitions, methods with a counted budget, and hidden worlds."""

import csv
import dataclasses as dc
import io
import json
import math
from pathlib import Path

import numpy as np
import pytest

from physid_drake.cli import main
from physid_drake.errors import ConfigError, OutputError
from physid_drake.run_folder import RunFolder
from physid_drake.space import Parameter, ParameterSpace
from physid_drake.validation.experiments.catalogue import EXPERIMENTS, Wish, experiment_named
from physid_drake.validation.experiments.closed_loop import HIDDEN, SIMULATED, ClosedLoops
from physid_drake.validation.experiments.corrected_plan import CorrectedPlans
from physid_drake.validation.experiments.learning import GREEDY, LEAST_SQUARES, METHODS, RANDOM, search_trials
from physid_drake.validation.experiments.mit_pushes import counts, pressed
from physid_drake.validation.experiments.repetitions import claim, run_all
from physid_drake.validation.experiments.values import Panel, Result, Table, mean_and_deviation, series_of
from physid_drake.validation.report.experiment import result_figure, result_json, result_markdown, table_csv
from physid_drake.validation.run_experiment import write

SPACE = ParameterSpace(
    parameters=tuple(
        Parameter(name=name, unit="-", lower=0.1, upper=10.0, prior_mean=1.0, scale="log") for name in ("a", "b")
    )
)  # fmt: skip
OPTIMUM = np.array([2.0, 0.5])


def silent(stage, done, total):
    pass


@dc.dataclass(frozen=True, kw_only=True)
class Counted:
    """Draws a number; a file in ``log`` says which repetitions were made."""

    seed: int
    log: str
    repetitions: int = 4
    stop_at: int | None = None

    def repeat(self, index, progress):
        if index == self.stop_at:
            raise KeyboardInterrupt
        with Path(self.log).open("a") as file:
            file.write(f"{index}\n")
        return {"value": float(np.random.default_rng([self.seed, index]).normal()), "nothing": math.nan}

    def result(self, records):
        raise AssertionError


def made(experiment):
    return sorted(int(line) for line in Path(experiment.log).read_text().split())


@pytest.fixture
def counted(tmp_path):
    return Counted(seed=3, log=str(tmp_path / "log"))


def test_mean_and_deviation_are_those_of_a_sample():
    mean, deviation = mean_and_deviation([1.0, 2.0, 4.0])
    assert mean == pytest.approx(7.0 / 3.0)
    assert deviation == pytest.approx(math.sqrt(7.0 / 3.0))
    assert math.isnan(mean_and_deviation([5.0])[1])
    with pytest.raises(ConfigError, match="at least one"):
        mean_and_deviation([])


def test_a_series_takes_its_statistics_over_repetitions():
    series = series_of("x", [1.0, 2.0], [[1.0, 10.0], [3.0, 30.0]])
    assert series.mean == (2.0, 20.0)
    assert series.deviation == pytest.approx((math.sqrt(2.0), math.sqrt(200.0)))
    with pytest.raises(ConfigError, match="every repetition needs 2"):
        series_of("x", [1.0, 2.0], [[1.0]])


def test_a_table_with_a_short_row_is_refused():
    with pytest.raises(ConfigError, match="2 columns, but a row of 1"):
        Table(name="t", title="t", columns=("a", "b"), rows=((1,),))


def example():
    table = Table(name="t", title="some", columns=("method", "mm"), rows=(("one", 1.25), ("two", math.nan)))
    series = series_of("one", [1.0, 2.0, 3.0], [[3.0, 2.0, 1.0]])
    return Result(
        setting="Nothing.", tables=(table,), skipped=("three: is missing.",),
        panels=(Panel(title="p", x_label="x", y_label="y", series=(series,), level=("best", 0.5)),),
    )  # fmt: skip


def test_a_result_is_written_without_what_is_not_known():
    result = example()
    assert list(csv.reader(io.StringIO(table_csv(result.tables[0])))) == [
        ["method", "mm"],
        ["one", "1.25"],
        ["two", ""],
    ]
    content = json.loads(result_json(result, "name", "command", {"python": "3"}))
    assert content["tables"][0]["rows"] == [{"method": "one", "mm": 1.25}, {"method": "two", "mm": None}]
    assert content["panels"][0]["series"][0]["deviation"] == [None] * 3
    text = result_markdown(result, "name", "the command")
    assert "| two | - |" in text and "    the command" in text and "Skipped: three" in text
    assert len(result_figure(result).axes) == 1


def test_a_result_is_written_to_the_same_bytes(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write(RunFolder.begin(tmp_path / name, "experiment"), example(), "name", "command")
    files = sorted(file.name for file in (tmp_path / "one").iterdir())
    assert "figure.svg" in files
    assert all((tmp_path / "one" / f).read_bytes() == (tmp_path / "two" / f).read_bytes() for f in files)


def run_in(out, experiment, jobs=1):
    with claim("counted", experiment, out) as folder:
        return run_all(experiment, folder, jobs=jobs, progress=silent)


def test_repetitions_that_are_done_are_not_made_again(counted, tmp_path):
    first = run_in(tmp_path / "out", counted)
    assert made(counted) == [0, 1, 2, 3]
    (tmp_path / "out" / "repetitions" / "002.json").unlink()
    again = run_in(tmp_path / "out", counted)
    assert made(counted) == [0, 1, 2, 2, 3]
    assert [r["value"] for r in again] == [r["value"] for r in first]


def test_an_interrupted_experiment_keeps_what_is_done(counted, tmp_path):
    with pytest.raises(KeyboardInterrupt), claim("counted", counted, tmp_path / "out") as folder:
        run_all(dc.replace(counted, stop_at=2), folder, jobs=1, progress=silent)
    assert len(run_in(tmp_path / "out", counted)) == 4
    assert made(counted) == [0, 1, 2, 3]


@pytest.mark.slow
def test_records_do_not_depend_on_the_number_of_jobs(counted, tmp_path):
    one, two = run_in(tmp_path / "one", counted), run_in(tmp_path / "two", counted, jobs=2)
    assert [r["value"] for r in one] == [r["value"] for r in two]


def test_a_folder_of_other_sizes_is_refused(counted, tmp_path):
    run_in(tmp_path / "out", counted)
    with pytest.raises(ConfigError, match="choose another --out"):
        run_in(tmp_path / "out", dc.replace(counted, seed=4))


def test_a_broken_record_is_named(counted, tmp_path):
    run_in(tmp_path / "out", counted)
    (tmp_path / "out" / "repetitions" / "001.json").write_text("{")
    with pytest.raises(OutputError, match=r"001\.json"):
        run_in(tmp_path / "out", counted)


def bowl(theta):
    """Residuals of a curved valley in the logarithms, zero at the optimum."""
    a, b = np.log(np.asarray(theta) / OPTIMUM)
    return np.array([a + 0.3 * b**2, 2.0 * b, 0.1 * a * b])


def log_rms(residuals):
    return float(0.5 * np.log(np.mean(residuals**2) + 1e-12))


@pytest.mark.parametrize("method", METHODS)
def test_every_method_keeps_to_its_budget_and_repeats_itself(method):
    def run():
        return search_trials(method, bowl, log_rms, SPACE, budget=12, rng=np.random.default_rng(1))

    trials = run()
    assert 1 <= len(trials.misfits) <= 12
    assert np.array_equal(trials.thetas, run().thetas)
    best = [log_rms(bowl(trials.best_after(k))) for k in range(1, 13)]
    assert (np.diff(best) <= 0.0).all()
    assert best[-1] == trials.misfits.min()


@pytest.mark.slow
def test_least_squares_and_greedy_entropy_search_find_what_random_search_does_not():
    def distance(method, seed):
        trials = search_trials(method, bowl, log_rms, SPACE, budget=20, rng=np.random.default_rng(seed))
        return float(np.abs(np.log(trials.best_after(20) / OPTIMUM)).max())

    greedy, random, squares = (
        np.median([distance(method, seed) for seed in range(3)]) for method in (GREEDY, RANDOM, LEAST_SQUARES)
    )
    assert squares < 1e-2
    assert greedy < 0.5 * random


def test_names_and_folders_that_do_not_exist_are_said_in_one_line(capsys, tmp_path):
    assert main(["experiment", "motion"]) == 1
    assert "motion_prediction" in capsys.readouterr().err
    assert main(["experiment", "mit_pushes"]) == 1
    assert "--data" in capsys.readouterr().err
    assert main(["experiment", "mit_pushes", "--data", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert (
        "abs_rect1_v10.csv' is missing" in error and "PlanarManipulationToolBox" in error and error.count("\n") == 1
    )
    assert main(["experiment", "push_speed", "--data", str(tmp_path)]) == 1
    assert "makes its own pushes" in capsys.readouterr().err
    assert main(["experiment", "push_speed", "--jobs", "0"]) == 1
    assert "--jobs must be at least 1" in capsys.readouterr().err


def test_every_quick_experiment_is_smaller_than_the_full_one():
    for name in EXPERIMENTS:
        if name != "mit_pushes":
            full, quick = (experiment_named(name, Wish(seed=0, quick=q, pushes=None)) for q in (False, True))
            assert quick.repetitions < full.repetitions == (40 if name == "corrected_plan" else 10)


def test_the_pressure_family_is_even_at_zero_and_grows_to_the_rim():
    assert pressed(0.0).is_null
    weights = np.array(pressed(1.0).weights)
    assert weights[0, 1] / weights[1, 1] == pytest.approx(math.e)
    assert weights[0, 0] > weights[0, 1] > weights[1, 1]
    assert np.array_equal(weights, weights.T)


def test_predictions_are_tested_at_the_whole_budget():
    assert counts(16) == [4, 8, 16]
    assert counts(6) == [4, 6]


def missed(effect, named, baseline, corrected):
    return {
        "effect": [effect], "named": named, "verdict": "explained" if named else "consistent", "size_sigma": 5.0,
        "baseline": {"miss_mm": baseline}, "corrected": {"miss_mm": corrected},
    }  # fmt: skip


def test_corrected_plans_are_told_apart_by_what_was_named():
    records = [
        missed("magnet", ["magnet"], 20.0, 4.0),
        missed("tether", [], 9.0, 9.0),
        missed("sloshing", ["sloshing"], 6.0, 8.0),
    ]
    misses, summary = CorrectedPlans(seed=0).result(records).tables
    assert [row[:2] for row in misses.rows] == [
        ("magnet", "magnet"),
        ("sloshing", "sloshing"),
        ("tether", "consistent"),
    ]
    assert [(row[0], row[1], row[-1]) for row in summary.rows] == [
        ("all worlds", 3, "1 of 3"), ("effect named correctly, alone", 2, "1 of 2"), ("other answers", 1, "0 of 1"),
    ]  # fmt: skip
    assert summary.rows[1][2:4] == (13.0, 6.0)  # medians


def test_closed_loops_are_misses_by_push_for_both_robots():
    loops = {
        "open loop": {"mm": [10.0, 8.0, 8.0], "friction": 0.3},
        "closed loop": {"mm": [10.0, 2.0, 1.0], "friction": 0.22},
    }
    record = {"truth": 0.2, "believed": 0.25, SIMULATED: loops, HIDDEN: loops}
    result = ClosedLoops(seed=0).result([record, record])
    assert [row[:4] for row in result.tables[0].rows[3:6]] == [
        (SIMULATED, "closed loop", k + 1, mm) for k, mm in enumerate((10.0, 2.0, 1.0))
    ]
    assert "25.0 % before the first push and 10.0 % after" in result.setting
    assert [panel.title for panel in result.panels] == [SIMULATED, HIDDEN]
