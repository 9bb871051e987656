"""What is identified from recordings whose truth is known: the shipped one, and small ones of the planar reference.

The pushes were never simulated with the cell that is fitted to them. Deviations in brackets were measured.
"""

import dataclasses as dc

import numpy as np
import pytest
from reference.scenes import OBJECTS, Theta
from runs import coarse_identifier, shipped_pushes
from scipy import stats
from twin import shape_of
from worlds import POINTS, endpoints, pushes_of, recorded, slides

from physid_drake.cell import CellConfig, ContactConfig
from physid_drake.diagnose import Examined
from physid_drake.identify import Identification, SearchConfig
from physid_drake.identify.identify import unknowns_of
from physid_drake.pushes.config import ThetaConfig
from physid_drake.pushes.theta import CELL_ERROR, UNWEIGHED
from physid_drake.recording import read_recording, write_recording
from physid_drake.report.result import result_json

pytestmark = pytest.mark.slow

BOX = OBJECTS["box"]
TRUTH = Theta(support_friction=0.27, hand_friction=0.22)  # of the shipped recording too
POINT = CellConfig(contact=ContactConfig(model="point"))
FRICTIONS = ["hand_friction", "support_friction"]


def identified(recording, *parameters, cell=POINT, **search) -> Identification:
    given = SearchConfig(**({"candidates": 64, "budget": 4, "jobs": 2} | search))
    return coarse_identifier(
        recording,
        cell=cell,
        theta=ThetaConfig(parameters=list(parameters)),
        search=given,
    ).run()


def estimate(result, name):
    return next(e for e in result.estimates if e.name == name)


def assert_recovered(result, name, truth, share, widest=0.1):
    e = estimate(result, name)
    assert e.identifiable
    assert e.value == pytest.approx(truth, rel=share)
    # The interval's half width is 1.6 standard deviations; the truth may be at twice that.
    half = 0.5 * (e.ci90[1] - e.ci90[0])
    assert abs(e.value - truth) < 2.0 * half
    assert half < widest * truth


@pytest.fixture(scope="module")
def shipped():
    """Eight of the shipped pushes, on the default cell."""
    return identified(shipped_pushes(8), "mass", *FRICTIONS, cell=CellConfig())


def test_friction_of_the_shipped_recording_is_recovered(shipped):
    assert_recovered(shipped, "support_friction", 0.27, 0.03)  # +1.1 %
    assert_recovered(shipped, "hand_friction", 0.22, 0.03)  # -1.6 %


def test_no_interval_is_narrower_than_the_cells_own_error(shipped):
    for name in FRICTIONS:
        low, high = estimate(shipped, name).ci90
        assert 0.5 * np.log(high / low) > stats.norm.ppf(0.95) * CELL_ERROR


def test_a_weighed_mass_that_a_push_cannot_tell_keeps_its_prior(shipped):
    mass = estimate(shipped, "mass")
    assert not mass.identifiable
    assert mass.prior == 0.054
    assert mass.value == pytest.approx(0.054, rel=1e-3)
    assert mass.ci90 == pytest.approx([0.054 * np.exp(-0.01645), 0.054 * np.exp(0.01645)], rel=2e-3)


def test_the_plain_cell_explains_the_reference_to_its_noise(shipped):
    assert 0.8 < shipped.reduced_chi2 < 1.3  # 1.02


def test_pushes_are_predicted_by_the_others_better_than_before_any(shipped):
    before, after = shipped.before, shipped.after
    assert len(after.per_push) == 8
    assert after.rms < 0.5 * before.rms
    assert after.rms < 1.0  # of means over windows: 0.59 of all twelve
    assert after.end_position < before.end_position
    assert before.diverged == after.diverged == 0


def test_the_scatter_of_friction_is_found_roughly(shipped):
    """The truth is 0.010; six pushes and two steps of expectation-maximisation from 0.02 give 0.018."""
    assert 0.003 < shipped.friction_scatter < 0.025


@pytest.fixture(scope="module")
def three_pushes():
    return pushes_of(BOX, 3, seed=1)


def test_a_mass_that_nothing_tells_is_said_to_be_unknown(three_pushes):
    result = identified(recorded(BOX, TRUTH, three_pushes, seed=2), "mass", *FRICTIONS)
    assert not estimate(result, "mass").identifiable
    assert_recovered(result, "hand_friction", 0.22, 0.03)
    assert_recovered(result, "support_friction", 0.27, 0.04)


def test_recorded_forces_tell_the_mass(three_pushes, tmp_path):
    write_recording(recorded(BOX, TRUTH, three_pushes, seed=2, forces=True), tmp_path / "forces")
    recording = read_recording(tmp_path / "forces")
    assert recording.object.mass is None
    result = identified(recording, "mass", *FRICTIONS)
    assert_recovered(result, "mass", 0.4, 0.05)  # -1.0 %
    assert_recovered(result, "support_friction", 0.27, 0.04)
    assert result.fitted.force < 0.1  # N, of 1.1 N


def test_first_and_last_pose_are_enough_for_friction():
    result = identified(endpoints(shipped_pushes(6)), *FRICTIONS)
    assert sum(len(push.residual) for push in result.fit.pushes) == 6 * 3
    assert_recovered(result, "support_friction", 0.27, 0.06)  # -1.0 %
    assert_recovered(result, "hand_friction", 0.22, 0.06, widest=0.12)  # 0.2 %


def test_an_underside_of_two_frictions_is_recovered_on_a_grid_of_two(three_pushes):
    points, _ = BOX.support(POINTS)
    recording = recorded(BOX, TRUTH, three_pushes, seed=3, friction_of_points=np.where(points[:, 0] < 0.0, 0.2, 0.4))
    result = identified(recording, *FRICTIONS, cell=dc.replace(POINT, friction_cells=[2, 1]))
    assert_recovered(result, "support_friction_0_0", 0.2, 0.05)  # -2.5 %
    assert_recovered(result, "support_friction_1_0", 0.4, 0.05)  # -1.6 %
    assert result.reduced_chi2 < 1.3


@pytest.fixture(scope="module")
def slid():
    rng = np.random.default_rng(5)
    velocities = np.column_stack([rng.uniform(0.5, 1.0, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(-4.0, 4.0, 3)])
    return identified(slides(BOX, TRUTH, velocities, seed=4), "mass", *FRICTIONS)


def test_a_free_slide_tells_the_tables_friction_and_nothing_else(slid):
    assert_recovered(slid, "support_friction", 0.27, 0.02)
    assert not estimate(slid, "mass").identifiable
    assert not estimate(slid, "hand_friction").identifiable


UNIFORM = tuple(np.exp(np.log(0.02) + np.array([0.05, 0.95]) * np.log(1.2 / 0.02)))  # on the logarithm
GUESSED = CellConfig().default_density_kgpm3 * float(np.prod(shape_of(BOX).size))  # kg
NORMAL = tuple(GUESSED * np.exp(UNWEIGHED * stats.norm.ppf([0.05, 0.95])))  # on the logarithm, and not cut by bounds


@pytest.mark.parametrize(("name", "interval"), [("mass", NORMAL), ("hand_friction", UNIFORM)])
def test_what_a_free_slide_does_not_tell_keeps_its_prior(slid, name, interval):
    e = estimate(slid, name)
    assert e.value == pytest.approx(e.prior, rel=0.05)
    assert e.ci90 == pytest.approx(interval, rel=2e-3)  # measured: 9e-4, of slopes by differences; ends of 14 to 1


def test_scatter_of_friction_is_found_push_by_push():
    changes, alike = np.array([-0.12, 0.08, 0.12, -0.08]), []
    for seed in (2, 3):  # of the noise, which four pushes feel
        recording = recorded(BOX, TRUTH, pushes_of(BOX, 4, seed=9), seed=seed, friction_changes=changes)
        result = identified(recording, *FRICTIONS)
        # With seed 3, half an interval is 10.5 % on one machine and 12.5 % on another, the scatter 0.092 and 0.057
        # (0.102 is true), and the value 7.6 and 8.5 % too low.
        assert_recovered(result, "support_friction", 0.27, 0.1, widest=0.15)
        assert 0.03 < result.friction_scatter < 0.15  # 0.046 for seed 2
        found = [unknowns["friction"] for unknowns in unknowns_of(result.case, result.fit).values()]
        alike.append(np.corrcoef(found, changes)[0, 1])
    assert np.mean(alike) > 0.93  # 0.896 and 0.994 or 0.997


def test_the_same_seed_gives_the_same_result_to_the_bit_on_one_process_and_on_two():
    recording = shipped_pushes(3)

    def text(seed, jobs):
        search = SearchConfig(candidates=32, budget=2, jobs=jobs)
        result = coarse_identifier(recording, theta=ThetaConfig(parameters=FRICTIONS), search=search, seed=seed).run()
        return result_json(Examined(known=result), recording, seed, {})

    first = text(0, 1)
    assert text(1, 1) != first  # which also leaves another history in the process's cell
    assert text(0, 1) == first
    assert text(0, 2) == first
