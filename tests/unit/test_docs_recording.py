"""The figures in the tables of docs/recording.md are the code's."""

import math
import re
from importlib import import_module
from pathlib import Path

import pytest

from physid_drake.pushes import noise, problem, theta, tracker_noise
from physid_drake.pushes.case import MOST_PUSHES
from physid_drake.pushes.force_windows import WINDOW
from physid_drake.pushes.plausible import HEAVIEST_GUESS, LIGHTEST_GUESS
from physid_drake.pushes.stated import FAR_BELOW
from physid_drake.recording import screening, thinning, turns

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "recording.md").read_text(encoding="utf-8")
UNITS = {"": 1.0, "%": 1e-2, "mm": 1e-3, "m": 1.0, "ns": 1e-9, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "rad": 1.0,
         "degrees": 1.0, "N": 1.0, "MN": 1e6}  # fmt: skip
ROWS = [
    (limit, re.findall(r"`([\w.]+)`", constants))
    for limit, constants in re.findall(r"^\| .+? \| ([^|]+) \| (?:[^|]+ \| )?(`[^|]+`) \|$", PAGE, re.MULTILINE)
]


def figures(cell):
    """The figures of a cell such as ``0.1 mm, 200 000``, in SI units."""
    found = [re.fullmatch(r"([\d. ]+?) ?([^\d. ]*)", one) for one in cell.split(", ")]
    return [float(one[1].replace(" ", "")) * UNITS[one[2]] for one in found]


def constant(name):
    module, _, attribute = name.rpartition(".")
    return getattr(import_module(f"physid_drake.{module}"), attribute)


@pytest.mark.parametrize(("limit", "names"), ROWS, ids=[" ".join(names) for _, names in ROWS])
def test_a_limit_is_the_codes(limit, names):
    assert figures(limit) == pytest.approx([constant(name) for name in names])


def test_every_constant_of_the_page_is_in_such_a_row():
    named = re.findall(r"`((?:recording|pushes|diagnose)\.\w+\.[A-Z_]+)`", PAGE)
    assert len(named) > 50 and sorted(named) == sorted(name for _, names in ROWS for name in names)


@pytest.mark.parametrize(
    "said",
    [
        f"for up to {screening.LONGEST_LEAP:g} s",
        f"{1e3 * screening.LEAST_SWAP:g} mm or more, stopped",
        f"within a sample by more than {screening.MOST_BRAKE:g} m/s²",
        f"shown {screening.HELD:g} times or more",
        f"over gaps of up to {turns.BRIDGED:g} s",
        f"more than {thinning.MOST_SAMPLES} poses",
        f"more than {MOST_PUSHES} pushes | {MOST_PUSHES} at equal distances",
        f"compared as means over {WINDOW:g} s",
        f"at least {('no', 'one', 'two', 'three')[problem.FEWEST_FREE]} poses",
        f"the heading of W, give or take {problem.UNMEASURED[0]:g} rad",
        f"between {LIGHTEST_GUESS:g} and {HEAVIEST_GUESS:g} kg/m³",
        f"within a factor of {math.exp(theta.UNWEIGHED):.1f}",
        f"surely by {100.0 * (tracker_noise.CONTRADICTS - 1.0):.0f} %",
        f"sampled every {1e3 * noise.SLOW_HAND:.0f} ms or less often",
        f"taken to be {1e3 * noise.DEFAULT_HAND_STD:g} mm, the force's {noise.DEFAULT_FORCE_STD:g} N",
        f"begins at {1e3 * noise.DEFAULT_POSITION_STD:g} mm and {1e3 * noise.DEFAULT_ROTATION_STD:g} mrad",
        f"{1e3 * noise.FINEST_POSITION:g} mm and {1e3 * noise.FINEST_ROTATION:g} mrad are used",
    ],
)
def test_what_is_done_is_said_with_the_codes_figures(said):
    assert said in PAGE


def test_the_figures_that_are_words():
    """A change of these asks for other words on the page."""
    assert (screening.GAP_FACTOR, screening.STALL_SAMPLES, thinning.REST) == (5.0, 5, 1.0)
    assert (problem.UNSURE, noise.DISPROVED, FAR_BELOW**-0.5) == (3.0, 2.0, 2.0)
