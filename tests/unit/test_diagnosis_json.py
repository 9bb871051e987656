"""``diagnosis.json``: digits, times of any origin, parameters that the catalogue does not have."""

import dataclasses as dc
import json

from test_diagnosis_page import diagnosis_with, effect, estimate

from physid_drake.diagnose.values import Window
from physid_drake.report.diagnosis import diagnosis_json, fit_table


def written(**changes):
    return json.loads(diagnosis_json(diagnosis_with(**changes)))


def test_six_digits_of_what_was_estimated_and_all_of_a_clock():
    window = Window(
        push="pushes/001.csv", start=1763637000.12345, end=1763637000.5, place=(0.1, -0.02), heading=1.5, speed=0.04,
        phase="contact",
    )  # fmt: skip
    location = dc.replace(diagnosis_with().location, windows=(window,))
    content = written(location=location, p_value=0.123456789)
    assert content["p_value"] == 0.123457
    assert content["location"]["windows"] == [
        {
            "push": "pushes/001.csv",
            "start_s": 1763637000.1235,
            "end_s": 1763637000.5,
            "x_m": 0.1,
            "y_m": -0.02,
            "heading_rad": 1.5,
            "speed_mps": 0.04,
            "phase": "contact",
        }
    ]


def test_what_the_catalogue_does_not_have_stands_apart():
    liquid = effect("sloshing", fraction=estimate(0.3, null=0.0), frequency=estimate(3.0, "Hz"),
                    damping=estimate(0.1), turning=estimate(0.8))  # fmt: skip
    (found,) = written(effects=(liquid,))["effects"]
    assert list(found["parameters"]) == ["fraction", "frequency", "damping"]
    assert found["beyond_the_catalogue"]["turning"]["value"] == 0.8
    (usual,) = written()["effects"]
    assert "beyond_the_catalogue" not in usual


def test_errors_of_forces_are_written_where_forces_were_compared():
    assert "held_out_rms_before_n" not in written()["fit"]
    forced = dc.replace(diagnosis_with().fit, force_before=0.3, force_after=0.1)
    fit = written(fit=forced)["fit"]
    assert (fit["held_out_rms_before_n"], fit["held_out_rms_after_n"]) == (0.3, 0.1)


def test_the_table_of_errors_has_newtons_where_forces_were_compared():
    forced = dc.replace(diagnosis_with().fit, force_before=0.3, force_after=0.1)
    assert [column.header for column in fit_table(diagnosis_with()).columns] == [
        "model", "mm", "deg", "sigma", "reduced\nchi-square",
    ]  # fmt: skip
    table = fit_table(diagnosis_with(fit=forced))
    (newtons,) = (column for column in table.columns if column.header == "N")
    assert list(newtons.cells) == ["0.30", "0.10"]


def test_what_would_not_show_is_named():
    assert written()["undetectable"] == []
    assert written(undetectable=("restitution", "sloshing"))["undetectable"] == ["restitution", "sloshing"]
