"""Where the robots reach on a table, and plans that know it."""

import json

import numpy as np
import pytest
from plans import MODEL, TILTED

from physid_drake.cli import main
from physid_drake.errors import ConfigError
from physid_drake.plan.reach import INSIDE, SHIPPED_TABLE, beyond_reach, goal_within, reaches

HALF = (0.5 * SHIPPED_TABLE[0], 0.5 * SHIPPED_TABLE[1])
TABLE = ((-HALF[0], -HALF[1]), HALF)


def test_the_reach_on_the_shipped_table_is_that_of_its_model():
    discs = reaches(TABLE)
    assert discs["motoman"].base == pytest.approx((-0.9, 0.0)) and discs["motoman"].radius == 0.72
    assert discs["baxter"].base == pytest.approx((1.15, 0.0)) and discs["baxter"].radius == 1.041


def test_the_robots_stand_behind_the_edges_of_any_table():
    discs = reaches(((1.0, 2.0), (2.0, 4.0)))
    assert discs["motoman"].base == pytest.approx((0.7, 3.0)) and discs["baxter"].base == pytest.approx((2.55, 3.0))
    place = np.array([[1.0, 3.0], [0.7, 3.82]])
    assert discs["motoman"].beyond(place) == pytest.approx([0.0, 0.1])


def test_chords_are_on_the_table_and_within_the_reach():
    disc = reaches(TABLE)["motoman"]
    rows = disc.chords(TABLE)
    assert len(rows) > 10
    for x, low, high in rows:
        assert -0.6 <= x <= 0.6 and -0.4 <= low < high <= 0.4
        assert disc.beyond(np.array([[x, low], [x, high]])) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert not len(reaches(TABLE)["motoman"].chords(((5.0, 5.0), (6.0, 6.0))))


def test_the_nearest_place_that_a_robot_reaches_costs_nothing_and_lies_on_the_way_to_it():
    cost, (x, y) = goal_within("baxter", TABLE, (0.0, 0.2))
    baxter = reaches(TABLE)["baxter"]
    assert cost.at(np.array([x, y])) == pytest.approx(0.0, abs=1e-9)
    assert np.hypot(x - baxter.base[0], y - baxter.base[1]) == pytest.approx(baxter.radius - INSIDE)
    assert (y - 0.2) / x == pytest.approx(-0.2 / baxter.base[0])
    # Outside it grows with the distance: slope 1 but for its bend near the edge.
    assert cost.at(np.array([-0.4, 0.0])) == pytest.approx(1.55 - cost.radius - cost.softness, abs=1e-3)


@pytest.mark.parametrize(
    ("robot", "table", "start", "said"),
    [
        ("atlas", TABLE, (0.0, 0.0), "the robots are baxter and motoman, but got 'atlas'"),
        ("baxter", TABLE, (0.4, 0.0), "reaches the object already"),
        ("motoman", ((0.0, 0.0), (0.1, 0.1)), (0.05, 0.05), "already"),
    ],
)
def test_what_cannot_be_wanted_is_refused(robot, table, start, said):
    with pytest.raises(ConfigError, match=said):
        goal_within(robot, table, start)


def test_what_lies_beyond_the_robots_is_said_on_the_shipped_table_alone():
    hand, end = np.array([[-0.4, 0.0], [0.0, 0.0]]), np.array([0.0, 0.0])
    assert beyond_reach(TABLE, hand, end) == [
        "the hand goes 180 mm beyond where the Motoman reaches",
        "the object stops 109 mm beyond where the Baxter reaches",
    ]
    assert beyond_reach(TABLE, np.array([[-0.4, 0.0]]), np.array([0.3, 0.0])) == []
    assert beyond_reach(((0.0, 0.0), (1.0, 1.0)), hand, end) == []


def test_a_push_can_be_planned_to_where_the_baxter_reaches(tmp_path, capsys):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "model.yaml").write_text(TILTED.dump())
    out = tmp_path / "out"
    argv = ["plan", str(tmp_path / "run"), "--reach", "baxter", "--budget", "12", "--draws", "0", "--out", str(out)]
    low, high = MODEL.table
    assert main([*argv, "--start", str(low[0] + 0.1), "0", "0"]) == 0
    content = json.loads((out / "plan.json").read_text())
    reach = reaches((low, high))["baxter"]
    assert content["goal_m"] is None and content["goal_within"]["radius_m"] == pytest.approx(reach.radius - INSIDE)
    end = np.array([[content["predicted"]["end"]["x_m"], content["predicted"]["end"]["y_m"]]])
    assert content["predicted"]["cost_m"] > 0.01 or reach.beyond(end)[0] == 0.0
    assert "within a robot's reach" in " ".join(capsys.readouterr().out.split())
