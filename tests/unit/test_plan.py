"""Plans: what is made small, what the belief says of it, and what the command writes and refuses."""

import json
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from rich.console import Console
from runs import COARSE, coarse_identifier, quick, shipped_pushes, write_small
from scipy import stats
from twin import body_of

from physid_drake import run_cell, run_plan
from physid_drake.cell import SolverConfig
from physid_drake.cli import main
from physid_drake.effects.fields import TableTilt
from physid_drake.errors import ConfigError
from physid_drake.identify import SearchConfig, ThetaConfig
from physid_drake.model import Correlation, Model, load_model
from physid_drake.plan import DistanceToGoal, Ending, InsideRegion, PlanConfig, SimulatedRobot, Situation, plan
from physid_drake.plan.costs import cost_of, loss_of
from physid_drake.plan.draws import draws_of
from physid_drake.plan.story import outcome_under, spread_of
from physid_drake.plan.system import PolicySystem, identified_model, planner_of
from physid_drake.plan.task import Choices, default_goal, policy_for
from physid_drake.plan.trajectory import _paced, trajectory_of
from physid_drake.policies import PlannedPush
from physid_drake.recording import Box, Cylinder, Hand, ObjectModel, Recording, Sensors, Table
from physid_drake.scenario_schema import Scenario

START, GOAL = (0.0, 0.0, 0.0), (0.25, 0.0)
MODEL = Model(
    recording="eraser",
    shape=Box(size=(0.127, 0.051, 0.03)),
    hand_radius=0.01,
    table=((-0.5, -0.4), (0.5, 0.4)),
    config=COARSE,
    body=body_of(0.054, 0.27, hand_friction=0.22),
    intervals={"theta.support_friction": [0.25, 0.29], "theta.hand_friction": [0.2, 0.24]},
)
TILTED = replace(MODEL, effects=(TableTilt(x=0.04),), intervals={**MODEL.intervals, "table_tilt.x": [0.03, 0.05]})


def made(model=MODEL, name="push_speed", goal=GOAL, *, seed=0, choices=None, **more):
    given = {"budget": 12, "draws": 4, "sweep": 3, "situation": Situation(start=START)} | more
    return plan(
        model, policy_for(name, model, START, goal, choices), DistanceToGoal(goal=goal),
        rng=np.random.default_rng(seed), **given,
    )  # fmt: skip


@pytest.fixture(scope="module")
def planned():
    return made()


# Costs.


def test_the_distance_is_zero_at_the_goal_and_grows_with_it():
    cost = DistanceToGoal(goal=GOAL)
    assert cost.at(np.array(GOAL)) == 0.0
    assert cost.at(np.array([0.28, 0.04])) == pytest.approx(0.05)


def test_a_region_is_free_inside_and_has_no_kink_at_its_edge():
    cost = InsideRegion(lower=(0.1, -0.1), upper=(0.3, 0.1), softness=0.01)
    assert cost.at(np.array([0.2, 0.05])) == 0.0 and cost.at(np.array([0.3, 0.1])) == 0.0
    step = 1e-5
    assert cost.at(np.array([0.3 + step, 0.0])) < 1e-2 * step
    assert cost.at(np.array([0.8, 0.0])) == pytest.approx(0.49, abs=1e-3)
    with pytest.raises(ConfigError, match="region"):
        InsideRegion(lower=(0.1, 0.0), upper=(0.0, 0.1))


def fall(speed=1.0):
    push = PlannedPush(direction=0.0, speed=speed, travel=0.45)
    return trajectory_of(MODEL, (push,), Situation(start=START))


def test_an_object_pushed_over_the_edge_falls_and_costs_more_than_any_place_on_the_table():
    trajectory = fall()
    assert trajectory.ending is Ending.FELL and trajectory.lost
    cost = DistanceToGoal(goal=GOAL)
    grid = [np.array([x, y]) for x in np.linspace(-0.5, 0.5, 11) for y in np.linspace(-0.4, 0.4, 9)]
    assert cost_of(cost, trajectory, MODEL.table) == loss_of(cost, MODEL.table) > max(cost.at(p) for p in grid)


def test_a_rollout_that_diverged_is_no_answer():
    trajectory = replace(fall(), ending=Ending.DIVERGED)
    assert cost_of(DistanceToGoal(goal=GOAL), trajectory, MODEL.table) == math.inf


def test_a_tall_object_that_is_tipped_over_is_lost():
    tall = replace(MODEL, shape=Box(size=(0.03, 0.05, 0.25)), body=body_of(0.3, 0.9))
    push = PlannedPush(direction=0.0, speed=0.5, travel=0.2)
    trajectory = trajectory_of(tall, (push,), Situation(start=START, hand_height=0.24))
    assert trajectory.ending is Ending.TOPPLED and trajectory.lost


def test_an_object_that_rolls_on_has_no_end_to_be_near_the_goal():
    rolling = replace(MODEL, shape=Cylinder(radius=0.03, length=0.1, axis="y"), table=((-9.0, -9.0), (9.0, 9.0)))
    push = PlannedPush(direction=0.0, speed=0.05, travel=0.03)
    trajectory = trajectory_of(rolling, (push,), Situation(start=START))
    cost = DistanceToGoal(goal=(float(trajectory.end[0]), float(trajectory.end[1])))
    assert trajectory.ending is Ending.MOVING and not trajectory.lost
    assert cost_of(cost, trajectory, rolling.table) == loss_of(cost, rolling.table)


# The belief.


def drawn_from(model, count=64, **more):
    situation = Situation(start=START, start_std=more.pop("start_std", (0.0, 0.0, 0.0)))
    return draws_of(model, situation, count, np.random.default_rng(0), **more)


def models_from(model, count=64, **more):
    return [draw.model for draw in drawn_from(model, count, **more)]


def test_draws_follow_the_intervals_and_the_scatter():
    drawn = models_from(TILTED)
    friction = np.array([float(m.body.support_friction[0]) for m in drawn])
    assert np.median(friction) == pytest.approx(0.27, rel=0.01)
    assert 0.8 < np.mean((friction > 0.25) & (friction < 0.29)) < 0.97
    tilts = np.array([m.effects[0].x for m in drawn])
    assert tilts.std() == pytest.approx(0.02 / 3.29, rel=0.15) and abs(np.corrcoef(friction, tilts)[0, 1]) < 0.2
    scattered = models_from(replace(MODEL, intervals={}), friction_scatter=0.1)
    assert np.std([float(m.body.support_friction[0]) for m in scattered]) == pytest.approx(0.027, rel=0.15)
    assert all(m.body.hand_friction == MODEL.body.hand_friction for m in scattered)


def tied(rho):
    """Friction and tilt, of which pushes along the slope tell the difference only, as rho says."""
    names = ("theta.support_friction", "table_tilt.x")
    return replace(TILTED, correlation=Correlation(names=names, matrix=((1.0, rho), (rho, 1.0))))


def test_draws_vary_together_as_the_model_says_and_keep_their_intervals():
    alone, together = models_from(tied(0.0), 256), models_from(tied(0.95), 256)

    def values(models):
        rows = [(np.log(m.body.support_friction[0]), np.log(m.body.hand_friction), m.effects[0].x) for m in models]
        return np.array(rows).T

    correlations = np.corrcoef(values(together))
    assert correlations[0, 2] == pytest.approx(0.95, abs=0.02)
    assert abs(correlations[0, 1]) < 0.1 and abs(correlations[1, 2]) < 0.1
    np.testing.assert_allclose(values(together).std(axis=1), values(alone).std(axis=1), rtol=0.08)
    assert abs(np.corrcoef(values(alone))[0, 2]) < 0.1


def test_friction_and_tilt_that_are_known_together_spread_the_end_less_than_each_alone():
    """Coulomb on a slope: a slide of v^2 / (2 g (mu - tilt)), so that only the difference's error counts."""
    push = (PlannedPush(direction=0.0, speed=0.6, travel=0.1),)
    cost = DistanceToGoal(goal=(0.45, 0.0))  # beyond all ends, so that it is linear in them
    spreads = []
    for rho in (0.0, 0.95):
        model = tied(rho)
        unsure = replace(model, intervals={k: v for k, v in model.intervals.items() if "hand" not in k})
        draws = drawn_from(unsure, 32)
        spreads.append(spread_of(draws, push, cost, model=model, situation=Situation(start=START)))
    friction, tilt = 0.04 / 3.29, 0.02 / 3.29
    slide = 0.6**2 / (2.0 * 9.81 * (0.27 - 0.04))
    for spread, rho in zip(spreads, (0.0, 0.95), strict=True):
        difference = math.sqrt(friction**2 + tilt**2 - 2.0 * rho * friction * tilt)
        assert np.std(spread.costs) == pytest.approx(slide * difference / (0.27 - 0.04), rel=0.15)
    low, high = (s.band[1] - s.band[0] for s in reversed(spreads))
    assert low < 0.7 * high


def test_a_scatter_that_few_pushes_told_is_students():
    plain = replace(MODEL, intervals={})
    known, told = (
        np.array([float(m.body.support_friction[0]) / 0.27 - 1.0 for m in models_from(plain, 512, **more)])
        for more in ({"friction_scatter": 0.02}, {"friction_scatter": 0.02, "scatter_freedom": 5.0})
    )
    for drawn, law in ((known, stats.norm), (told, stats.t(5.0))):
        np.testing.assert_allclose(np.quantile(drawn, [0.05, 0.25, 0.75, 0.95]),
                                   0.02 * law.ppf([0.05, 0.25, 0.75, 0.95]), rtol=0.05)  # fmt: skip


def test_the_hand_aims_at_where_the_object_is_seen_not_at_where_it_stands():
    plain, std = replace(MODEL, intervals={}), (0.0, 2e-3, 0.0)
    draws = drawn_from(plain, 16, start_std=std)
    starts = np.array([d.situation.start for d in draws])
    assert starts[:, 1].std() == pytest.approx(2e-3, rel=0.2) and not starts[:, [0, 2]].any()
    situation = Situation(start=START, start_std=std)
    push = (PlannedPush(direction=0.0, speed=0.3, travel=0.05),)
    spread = spread_of(draws, push, DistanceToGoal(goal=GOAL), model=plain, situation=situation)
    # Hit off its middle, the object turns away from the hand: to the left where the hand passes it on the right.
    assert np.corrcoef(starts[:, 1], spread.ends[:, 2])[0, 1] > 0.9
    assert made(plain, situation=situation, draws=4, budget=1, sweep=0).spread is not None


@pytest.mark.parametrize("interval", [3.0, [0.1], ["a", "b"], [0.3, 0.2], [0.1, math.nan], []])
def test_an_interval_that_is_none_is_refused(interval):
    with pytest.raises(ConfigError, match="support_friction"):
        models_from(replace(MODEL, intervals={"theta.support_friction": interval}), 4)


def test_an_interval_of_nothing_is_refused():
    with pytest.raises(ConfigError, match="colour"):
        models_from(replace(MODEL, intervals={"theta.colour": [0.1, 0.2]}), 4)


# Plans.


def test_the_planned_speed_brings_the_object_to_the_goal(planned):
    assert planned.cost < 2e-3
    assert planned.predicted.ending is Ending.AT_REST
    assert planned.predicted.end[:2] == pytest.approx(GOAL, abs=2e-3)
    # Coulomb: the slide after the brake has v^2 / (2 mu g).
    slide = GOAL[0] - planned.policy.reach.travel
    assert planned.settings[0] == pytest.approx(math.sqrt(2.0 * 0.27 * 9.81 * slide), rel=0.03)


def test_the_belief_spreads_the_end_as_friction_says(planned):
    spread = planned.spread
    slide = GOAL[0] - planned.policy.reach.travel
    expected = slide * (0.04 / 3.29) / 0.27
    assert 0.4 * expected < np.std(spread.ends[:, 0]) < 2.0 * expected
    assert spread.mean > planned.cost and spread.losses == 0 and spread.diverged == 0
    rate, (low, high) = spread.success_rate(planned.tolerance)
    assert rate == spread.successes(planned.tolerance) / 4 and low < rate <= high <= 1.0


def test_the_sweep_goes_over_all_speeds_and_its_best_is_no_better_than_the_plan(planned):
    assert [row.value for row in planned.sweep] == pytest.approx([0.02, 0.51, 1.0])
    assert min(row.cost for row in planned.sweep) >= planned.cost
    assert planned.sweep[0].spread is not None


def test_a_random_search_and_another_seed_try_other_settings(planned):
    random = made(search="random", draws=0, sweep=0)
    assert random.cost >= planned.cost and random.spread is None and random.sweep == ()
    again = made(draws=0, sweep=0)
    assert again.settings[0] == planned.settings[0]
    assert made(seed=1, draws=0, sweep=0).settings[0] != planned.settings[0]


def test_two_pushes_start_where_the_first_one_ended():
    result = made(name="two_pushes", goal=(0.2, 0.05), budget=6, draws=0, sweep=0)
    first, second = result.predicted.paths
    between = result.predicted.poses[len(result.predicted.poses) // 2 - 1]
    push = result.policy.pushes(result.settings)[1]
    ahead = np.array([math.cos(push.direction), math.sin(push.direction)])
    across = second.start - between[:2]
    assert across @ ahead < -0.02 and abs(across[0] * ahead[1] - across[1] * ahead[0]) < 1e-9
    assert not np.allclose(first.start, second.start)


def test_the_mean_over_the_belief_stays_further_from_an_edge_that_it_may_fall_over():
    goal, far = (0.47, 0.0), Choices(travel=0.3)
    unsure = replace(MODEL, intervals={"theta.support_friction": [0.2, 0.36]})
    likely = made(unsure, goal=goal, choices=far, sweep=0, budget=10)
    careful = made(unsure, goal=goal, choices=far, sweep=0, budget=10, risk=True)
    assert likely.spread.losses > careful.spread.losses
    assert careful.settings[0] < likely.settings[0] and careful.spread.mean < likely.spread.mean


@pytest.mark.parametrize(
    ("more", "named"),
    [
        ({"budget": 0}, "budget"), ({"draws": -1}, "draws"), ({"sweep": -1}, "sweep"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"search": "luck"}, "luck"), ({"risk": True, "draws": 0}, "belief"),
        ({"model": replace(MODEL, hand_radius=None)}, "no hand"),
        ({"name": "throw"}, "throw"), ({"goal": (2.0, 0.0)}, "not on the table"),
        ({"goal": (math.nan, 0.0)}, "finite"),
        ({"goal": (0.001, 0.0)}, "already"), ({"choices": Choices(speed=0.1)}, "push_direction"),
        ({"choices": Choices(travel=-0.1)}, "travel"),
        ({"name": "push_direction", "choices": Choices(direction=0.1)}, "direction"),
        ({"name": "push_direction", "choices": Choices(speed=3.0)}, "speed"),
    ],
)  # fmt: skip
def test_what_cannot_be_planned_is_refused(more, named):
    with pytest.raises(ConfigError, match=named):
        made(**more)


def test_the_default_goal_is_ahead_or_where_there_is_room():
    assert default_goal((0.0, 0.0, 0.0), ((-1.0, -1.0), (1.0, 1.0))) == (0.3, 0.0)
    assert default_goal((0.0, 0.0, 0.0), ((-1.0, -1.0), (0.4, 1.0))) == pytest.approx((0.24, 0.0))
    assert default_goal((0.35, 0.0, 0.0), MODEL.table) == pytest.approx((0.05, 0.0))


def test_a_choice_fixes_direction_and_travel():
    (push,) = policy_for("push_speed", MODEL, START, GOAL, Choices(direction=0.2, travel=0.07)).pushes(
        np.array([0.3])
    )
    assert (push.direction, push.travel) == (0.2, 0.07)
    (push,) = policy_for("push_direction", MODEL, START, GOAL).pushes(np.array([0.0]))
    assert push.travel == pytest.approx(0.25, abs=1e-3) and push.speed == 0.05


# The diagram and the robot.


def test_the_policy_system_plans_once_it_has_an_identification():
    calls = []
    system = PolicySystem(lambda known: calls.append(known) or made(draws=0, sweep=0, budget=2), dimension=1)
    context = system.CreateDefaultContext()
    port = system.GetInputPort("identification.estimated")
    fixed = port.FixValue(context, AbstractValue.Make(None))
    simulator = Simulator(system, context)
    simulator.AdvanceTo(1.5)
    assert calls == [] and system.plan(context) is None
    assert math.isnan(system.GetOutputPort("settings.desired").Eval(context)[0])
    fixed.GetMutableData().set_value(SimpleNamespace(theta=np.array([0.3])))
    simulator.AdvanceTo(4.5)
    assert [float(known.theta[0]) for known in calls] == [0.3]
    fixed.GetMutableData().set_value(SimpleNamespace(theta=np.array([0.4])))
    simulator.AdvanceTo(6.5)
    assert [float(known.theta[0]) for known in calls] == [0.3, 0.4]
    assert system.GetOutputPort("push.desired").Eval(context) is system.plan(context)
    assert system.GetOutputPort("settings.desired").Eval(context) == system.plan(context).settings


def test_a_robot_pushes_learns_plans_and_pushes_again():
    """The whole loop on a hidden world: friction is 0.20 there, the prior says 0.3."""
    hidden = replace(MODEL, body=body_of(0.054, 0.20, hand_friction=0.22), intervals={})
    sensors = Sensors(object_position_std=3e-4, object_rotation_std=3e-3, hand_position_std=5e-5)
    robot = SimulatedRobot(hidden, start=START, sensors=sensors, rng=np.random.default_rng(0))
    pushes = tuple(robot.execute(PlannedPush(direction=d, speed=0.4, travel=0.05)) for d in (0.0, math.pi))
    recording = Recording(
        name="learnt", description="", object=ObjectModel(shape=MODEL.shape, mass=0.054),
        table=Table(size=(1.0, 0.8)), hand=Hand(tip="sphere", radius=0.01), sensors=sensors, pushes=pushes,
    )  # fmt: skip
    identifier = coarse_identifier(
        recording,
        theta=ThetaConfig(parameters=["support_friction"]),
        search=SearchConfig(candidates=32, budget=4, jobs=1),
    )
    result = identifier.run()
    learnt = identified_model(result, identifier.pool.spec, "learnt")
    assert float(learnt.body.support_friction[0]) == pytest.approx(0.20, rel=0.05)
    start, goal = robot.see(), (0.3, 0.0)
    chosen = plan(
        learnt, policy_for("push_speed", learnt, start, goal), DistanceToGoal(goal=goal),
        situation=Situation(start=start), rng=np.random.default_rng(0), budget=10, draws=0, sweep=0,
    )  # fmt: skip
    (push,) = chosen.policy.pushes(chosen.settings)
    recorded = robot.execute(push)
    assert robot.ending is Ending.AT_REST
    assert math.dist(recorded.object.planar[-1, :2], goal) < 0.01
    assert recorded.name == "pushes/003.csv" and len(recorded.hand) == len(recorded.object)


def test_a_robot_whose_object_fell_asks_for_it_back():
    robot = SimulatedRobot(MODEL, start=START, sensors=Sensors(), rng=np.random.default_rng(0))
    robot.execute(PlannedPush(direction=0.0, speed=1.0, travel=0.45))
    assert robot.ending is Ending.FELL
    with pytest.raises(ConfigError, match="put it back"):
        robot.execute(PlannedPush(direction=0.0, speed=0.1, travel=0.1))


# The command.


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "model.yaml").write_text(TILTED.dump())
    return tmp_path / "run"


QUICK = ["--goal", "0.25", "0", "--budget", "4", "--draws", "2"]


def planned_files(folder, out, *argv):
    assert main(["plan", str(folder), *QUICK, "--out", str(out), *argv]) == 0
    return {path.name: path.read_bytes() for path in out.iterdir()}


@pytest.fixture
def few_rows(monkeypatch):
    """A sweep of three rows, so that the command is quick."""
    original = run_plan.plan
    monkeypatch.setattr(run_plan, "plan", lambda *args, **more: original(*args, **{**more, "sweep": 3}))


def test_the_command_writes_the_plan_and_the_same_seed_the_same_bytes(folder, tmp_path, capsys, few_rows):
    files = planned_files(folder, tmp_path / "one")
    shown = capsys.readouterr().out
    assert set(files) == {"plan.json", "push.csv", "plan.png", "page.html", "settings.json"}
    again = planned_files(folder, tmp_path / "two")
    assert all(again[name] == content for name, content in files.items() if name != "settings.json")
    content = json.loads(files["plan.json"])
    assert content["format"] == "physid-plan/1" and content["effects"] == ["table_tilt"]
    assert content["pushes"][0]["speed_mps"] == content["settings"]["speed"]["value"]
    assert content["belief"]["draws"] == 2 and len(content["sweep"]["rows"]) == 3
    assert f"{content['settings']['speed']['value']:.4f} m/s" in shown and "table_tilt" in shown
    page = files["page.html"].decode()
    assert f"{content['settings']['speed']['value']:.4f} m/s" in page
    assert "http" not in page.replace("http://www.w3.org", "")


def test_plain_plans_without_the_effects_and_says_what_they_make_of_it(folder, tmp_path, capsys, few_rows):
    with_effects = json.loads(planned_files(folder, tmp_path / "one")["plan.json"])
    plain = json.loads(planned_files(folder, tmp_path / "two", "--plain")["plan.json"])
    assert plain["effects"] == [] and with_effects["predicted_with_effects"] is None
    assert plain["settings"]["speed"]["value"] != with_effects["settings"]["speed"]["value"]
    assert plain["predicted_with_effects"]["cost_m"] > with_effects["predicted"]["cost_m"]
    assert "with the effects found" in capsys.readouterr().out


def test_the_results_beside_a_model_give_scatter_and_order(folder, tmp_path, few_rows):
    (folder / "model.yaml").write_text(replace(MODEL, intervals={}).dump())
    assert json.loads(planned_files(folder, tmp_path / "one")["plan.json"])["belief"] is None
    content = {"friction_scatter": 0.05, "held_out": {"pushes": ["a"]}, "training": {"pushes": ["b", "c"]}}
    (folder / "result.json").write_text(json.dumps(content))
    belief = json.loads(planned_files(folder, tmp_path / "two")["plan.json"])["belief"]
    assert belief["ends"][0]["x_m"] != belief["ends"][1]["x_m"]
    # Two pushes tell no scatter, so that it is as sure as its first guess; five add theirs.
    assert run_plan._learnt(folder) == run_plan.Learnt(friction_scatter=0.05, scatter_freedom=4.0, pushes=3)
    diagnosis = {"friction_scatter": 0.02, "fit": {"per_push": [1, 2, 3, 4, 5]}}
    (folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    assert run_plan._learnt(folder) == run_plan.Learnt(friction_scatter=0.02, scatter_freedom=9.0, pushes=5)


@pytest.mark.parametrize(
    ("argv", "named"),
    [
        (["--goal", "9", "0"], "not on the table"), (["--goal", "nan", "0"], "finite"),
        (["--goal", "0", "0"], "already"),
        (["--policy", "throw"], "throw"), (["--speed", "0.1"], "push_direction"),
        (["--direction", "nan"], "--direction"),
        (["--start", "0", "0", "inf"], "--start"), (["--start", "5", "0", "0"], "start"),
        (["--tolerance", "nan"], "tolerance"),
        (["--budget", "0"], "budget"), (["--draws", "-1"], "draws"), (["--seed", "-1"], "--seed"),
        (["--search", "luck"], "luck"), (["--travel", "0"], "travel"), (["--model", "nowhere.yaml"], "nowhere.yaml"),
    ],
)  # fmt: skip
def test_bad_input_ends_in_one_line(folder, tmp_path, capsys, argv, named):
    assert main(["plan", str(folder), *QUICK, "--out", str(tmp_path / "out"), *argv]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and named in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("write", "named"),
    [
        ({}, "no model.yaml"),
        ({"model.yaml": "{"}, "model.yaml"),
        ({"model.yaml": MODEL.dump(), "result.json": "{"}, "result.json"),
        ({"model.yaml": MODEL.dump(), "result.json": '{"friction_scatter": 7}'}, "result.json"),
        ({"model.yaml": replace(MODEL, intervals={"theta.mass": "x"}).dump()}, "theta.mass"),
    ],
)
def test_a_run_that_cannot_be_planned_from_ends_in_one_line(tmp_path, capsys, write, named):
    (tmp_path / "run").mkdir()
    for name, text in write.items():
        (tmp_path / "run" / name).write_text(text)
    assert main(["plan", str(tmp_path / "run"), *QUICK, "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1 and named in error
    assert main(["plan", str(tmp_path / "nowhere"), *QUICK]) == 1
    assert "no such folder" in capsys.readouterr().err
    assert main(["plan", *QUICK]) == 1
    assert "--model" in capsys.readouterr().err


def test_ctrl_c_ends_with_130_and_writes_nothing(folder, tmp_path, capsys, monkeypatch):
    def interrupted(*args, **more):
        raise KeyboardInterrupt

    monkeypatch.setattr("physid_drake.plan.story.trajectory_of", interrupted)
    assert main(["plan", str(folder), *QUICK, "--out", str(tmp_path / "out")]) == 130
    assert "interrupted" in capsys.readouterr().err and not (tmp_path / "out").exists()


# The main job.


def test_the_main_job_plans_with_what_it_identified(tmp_path):
    recording = write_small(tmp_path / "small")
    override = {"plan": {"start_m": [0.0, 0.0], "goal_m": [0.25, 0.0], "budget": 6, "sweep": 3, "draws": 2}}
    out = tmp_path / "out"
    assert quick(out, recording=recording, plan_too=True, **override) == 0
    content = json.loads((out / "plan.json").read_text())
    theta = json.loads((out / "result.json").read_text())["theta"]["support_friction"]
    model = load_model(out)
    assert float(model.body.support_friction[0]) == theta["value"]
    assert model.intervals["theta.support_friction"] == theta["ci90"]
    assert model.correlation == Correlation(names=("theta.support_friction",), matrix=((1.0,),))
    assert (
        content["policy"] == "push_speed" and len(content["sweep"]["rows"]) == 3 and content["belief"]["draws"] == 2
    )
    assert yaml.safe_load((out / "config.yaml").read_text())["eraser"]["plan"]["budget"] == 6
    assert (out / "push.csv").exists() and not (out / "plan.png").exists()
    page = (out / "page.html").read_text()
    assert f"{content['settings']['speed']['value']:.4f} m/s" in page and "Cost against speed" in page


def test_the_main_job_refuses_a_goal_off_the_table_before_it_writes(tmp_path, capsys):
    recording = write_small(tmp_path / "small")
    assert quick(tmp_path / "out", recording=recording, plan_too=True, plan={"goal_m": [3.0, 0.0]}) == 1
    assert "not on the table" in capsys.readouterr().err and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("plan_section", "named"),
    [
        ({"policy": "throw"}, "throw"),
        ({"goal_m": [1.0]}, "goal_m"),
        ({"budget": 0}, "budget"),
        ({"speeds": 3}, "speeds"),
    ],
)
def test_the_main_job_refuses_a_plan_it_cannot_make(tmp_path, capsys, plan_section, named):
    recording = write_small(tmp_path / "small")
    assert quick(tmp_path / "out", recording=recording, plan_too=True, plan=plan_section) == 1
    assert named in capsys.readouterr().err


def test_the_planner_starts_where_the_recording_began():
    identifier = coarse_identifier(shipped_pushes(2))
    planner = planner_of(PlanConfig(), identifier.pool.spec, identifier.problems, "eraser", 0)
    assert planner.situation.start == identifier.problems[0].start.pose
    assert planner.situation.order == 2 and planner.situation.hand_height == pytest.approx(0.015)
    assert planner.goal == pytest.approx((planner.situation.start[0] + 0.3, planner.situation.start[1]))
    assert planner.dimension == 3


def test_no_goal_that_fits_is_no_reason_to_stop_but_a_wrong_one_is(capsys):
    elsewhere = replace(shipped_pushes(2), table=Table(size=(0.1, 0.1), centre=(5.0, 5.0)))
    identifier = coarse_identifier(elsewhere)
    assert run_cell._planner(Scenario(), elsewhere, identifier, Console()) is None
    assert "not on the table" in " ".join(capsys.readouterr().out.split())
    with pytest.raises(ConfigError, match="not on the table"):
        run_cell._planner(Scenario(plan=PlanConfig(goal_m=[0.0, 0.0])), elsewhere, identifier, Console())


@pytest.mark.parametrize(
    ("own", "speed", "tick"), [(1e-3, 1.0, 1e-3), (1e-3, 0.02, 4e-3), (1e-2, 0.005, 1e-2), (1e-2, 1.0, 2e-3)]
)
def test_a_tick_is_short_enough_for_the_push_and_no_shorter(own, speed, tick):
    assert _paced(SolverConfig(time_step_s=own), speed).time_step_s == pytest.approx(tick)


def test_another_model_says_what_it_makes_of_a_plan(planned):
    trajectory, cost = outcome_under(planned, TILTED)
    assert cost > 5e-3 and trajectory.end[0] > GOAL[0]
    assert outcome_under(planned, MODEL)[1] == planned.cost
