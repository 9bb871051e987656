"""The cell that judges: as stiff as it can be stepped, but for hands so slow that its time steps are long."""

import dataclasses as dc

from physid_drake.cell import CellConfig
from physid_drake.identify.judge import HAND_FREQUENCY, REST_DEPTH, STICTION, TIME_STEP, stiff


def test_the_judges_contacts_hardly_give():
    plain = CellConfig()
    made = stiff(plain)
    assert made.solver.time_step_s == TIME_STEP and made.solver.slide_time_step_s <= 2.0 * TIME_STEP
    contact = made.contact
    assert (contact.hand_frequency_rad_s, contact.rest_depth_m) == (HAND_FREQUENCY, REST_DEPTH)
    assert contact.stiction_tolerance_mps == STICTION < plain.contact.stiction_tolerance_mps
    assert contact.model == plain.contact.model


def test_a_slow_hand_keeps_its_ticks():
    plain = CellConfig()
    slow = dc.replace(plain, solver=dc.replace(plain.solver, time_step_s=0.02, slide_time_step_s=0.02))
    assert stiff(slow) is slow
