"""``diagnosis.json``: digits, times of any origin, parameters that the catalogue does not have."""

import dataclasses as dc
import json

from test_diagnosis_page import diagnosis_with, effect, estimate

from physid_drake.diagnose.values import Window
from physid_drake.report.diagnosis import diagnosis_json


def written(**changes):
    return json.loads(diagnosis_json(diagnosis_with(**changes)))


def test_six_digits_of_what_was_estimated_and_all_of_a_clock():
    location = dc.replace(
        diagnosis_with().location, windows=(Window(push="pushes/001.csv", start=1763637000.12345, end=1763637000.5),)
    )
    content = written(location=location, p_value=0.123456789)
    assert content["p_value"] == 0.123457
    assert content["location"]["windows"] == [
        {"push": "pushes/001.csv", "start_s": 1763637000.1235, "end_s": 1763637000.5}
    ]


def test_what_the_catalogue_does_not_have_stands_apart():
    liquid = effect("sloshing", fraction=estimate(0.3, null=0.0), frequency=estimate(3.0, "Hz"),
                    damping=estimate(0.1), turning=estimate(0.8))  # fmt: skip
    (found,) = written(effects=(liquid,))["effects"]
    assert list(found["parameters"]) == ["fraction", "frequency", "damping"]
    assert found["beyond_the_catalogue"]["turning"]["value"] == 0.8
    (usual,) = written()["effects"]
    assert "beyond_the_catalogue" not in usual
