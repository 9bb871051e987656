"""The belief that carries on: one push at a time against all at once, and the state that a Context carries."""

import dataclasses as dc
import json

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from reference.scenes import OBJECTS, Theta
from runs import COARSE, coarse_identifier, shipped_pushes
from worlds import POINTS, pushes_of, recorded, slides

from physid_drake.diagnose import Examined
from physid_drake.errors import RecordingError
from physid_drake.identify import OnlineIdentifier, SearchConfig, online
from physid_drake.identify.system import PUSH_PERIOD, IdentificationSystem, RecordingPlayer
from physid_drake.pushes.config import ThetaConfig
from physid_drake.report.cells import cells_figure, cells_table, cells_verdict
from physid_drake.report.result import result_json

pytestmark = pytest.mark.slow

BOX = OBJECTS["box"]
FRICTIONS = ["hand_friction", "support_friction"]
SEARCH = SearchConfig(jobs=1)


def learner(recording, *parameters, cells=(1, 1), **more):
    cell = dc.replace(COARSE, friction_cells=list(cells))
    theta = ThetaConfig(parameters=list(parameters or FRICTIONS))
    return OnlineIdentifier(recording, cell=cell, theta=theta, search=SEARCH, seed=0, **more)


@pytest.fixture(scope="module")
def recording():
    return shipped_pushes(4)


@pytest.fixture(scope="module")
def learned(recording):
    """The beliefs P_0 to P_4."""
    one = learner(recording)
    beliefs = [one.start()]
    for push in recording.pushes:
        beliefs.append(one.learn(beliefs[-1], push))
    return one, beliefs


def stds(belief):
    return np.sqrt(np.diag(np.linalg.inv(belief.information)))


def test_push_by_push_agrees_with_all_at_once_within_the_interval(recording, learned):
    one, beliefs = learned
    last = beliefs[-1]
    batch = coarse_identifier(recording, theta=ThetaConfig(parameters=FRICTIONS)).run()
    mean = batch.found.point.z[:2]
    apart = (mean - last.mean) / stds(last)
    assert np.all(np.abs(apart) < 0.5), apart  # another start of the same fit
    np.testing.assert_allclose(stds(last), np.sqrt(np.diag(batch.finder.covariance(batch.found)))[:2], rtol=0.1)
    for e, truth in zip(one.identification(last).estimates, (0.22, 0.27), strict=True):
        assert e.value == pytest.approx(truth, rel=0.08)


def test_every_push_adds_information(learned):
    _, beliefs = learned
    # A larger scatter or noise scale may take some of it back, not much.
    gains = np.diff([np.linalg.slogdet(b.information)[1] for b in beliefs])
    assert gains[0] > 2.0
    assert np.all(gains[1:] > -0.5)
    assert stds(beliefs[-1])[1] < 0.5 * stds(beliefs[1])[1] or stds(beliefs[-1])[1] < 0.01


def test_a_push_is_foreseen_better_after_others_were_learned_from(learned):
    _, beliefs = learned
    sizes = [np.sqrt(np.mean(error**2)) for error in beliefs[-1].foreseen.values()]
    assert np.mean(sizes[2:]) < sizes[0]


def test_the_search_on_a_push_begins_from_what_is_believed(learned):
    one, beliefs = learned
    space = one.thetas.space
    candidates = beliefs[2].draw(np.random.default_rng(0), 400)
    apart = space.to_unit(candidates) - beliefs[2].mean
    near = np.sqrt(np.einsum("ni,ij,nj->n", apart, beliefs[2].information, apart))
    # Nine tenths are drawn from P_2: its distances are those of a chi distribution of two degrees.
    assert np.mean(near < 3.5) == pytest.approx(0.9, abs=0.04)
    assert np.median(near[near < 3.5]) == pytest.approx(1.18, abs=0.25)


def test_the_prior_is_all_that_is_believed_before_a_push(recording):
    one = learner(recording, "mass", *FRICTIONS)
    belief = one.start()
    assert one.identification(belief) is None
    np.testing.assert_allclose(belief.theta, one.thetas.space.nominal)
    # 1/sqrt(12) of the cube where the prior is uniform, the scale's figure where there was one.
    mass = one.thetas.space.parameters[0]
    width = np.log(mass.upper / mass.lower)
    np.testing.assert_allclose(stds(belief), [mass.prior_std / width, 12**-0.5, 12**-0.5], rtol=1e-6)


def test_a_push_whose_rollouts_diverge_changes_nothing_but_is_counted(recording, learned, monkeypatch):
    one, beliefs = learned
    rolled = online.fitter_of

    def lost(case, seed):
        return rolled(case.without([len(case.problems) - 1]), seed)

    monkeypatch.setattr(online, "fitter_of", lost)
    belief = one.learn(beliefs[2], recording.pushes[2])
    np.testing.assert_array_equal(belief.mean, beliefs[2].mean)
    assert [error is None for error in belief.foreseen.values()] == [False, False, True]


def test_an_interrupt_in_the_search_is_not_taken_for_its_end(recording, monkeypatch):
    one = learner(recording)

    def interrupted(*asked):
        raise KeyboardInterrupt

    monkeypatch.setattr(online, "log_misfits", interrupted)
    with pytest.raises(KeyboardInterrupt):
        one.learn(one.start(), recording.pushes[0])


# The system: the belief is the Context's.


def diagram_of(recording, one):
    builder = DiagramBuilder()
    player = builder.AddSystem(RecordingPlayer(recording.pushes))
    space = one.thetas.space
    system = builder.AddSystem(IdentificationSystem(one, dimension=space.dimension, nominal=space.nominal))
    builder.Connect(player.GetOutputPort("push.measured"), system.GetInputPort("push.measured"))
    return builder.Build(), system


def test_the_context_carries_the_belief_and_a_clone_goes_on_alike(recording, learned):
    _, beliefs = learned
    diagram, system = diagram_of(recording.subset(range(2)), learner(recording))
    simulator = Simulator(diagram)
    other = diagram.CreateDefaultContext()
    simulator.AdvanceTo(0.5 * PUSH_PERIOD)
    mine = system.GetMyContextFromRoot(simulator.get_context())
    np.testing.assert_array_equal(system.belief(mine).mean, beliefs[1].mean)
    assert system.belief(system.GetMyContextFromRoot(other)).pushes == ()
    clone = Simulator(diagram, simulator.get_context().Clone())
    simulator.AdvanceTo(1.5 * PUSH_PERIOD)
    clone.AdvanceTo(1.5 * PUSH_PERIOD)
    for each in (simulator, clone):
        context = system.GetMyContextFromRoot(each.get_context())
        np.testing.assert_array_equal(system.belief(context).mean, beliefs[2].mean)
        theta = system.GetOutputPort("theta.estimated").Eval(context)
        np.testing.assert_array_equal(theta, beliefs[2].theta)
    assert system.belief(system.GetMyContextFromRoot(other)).pushes == ()


# Friction cells, push by push.


def test_a_straight_slide_tells_the_sides_apart_but_not_front_and_back():
    """What differs across the motion turns the box, what differs along it does not."""
    velocities = np.array([[0.8, 0, 0], [1.0, 0, 0]])
    recording = slides(BOX, Theta(support_friction=0.27), velocities, seed=4)
    one = learner(recording, "support_friction", cells=(2, 2), budget=4)
    belief = one.learn(one.start(), recording.pushes[0])
    result = one.identification(belief)
    told = result.cells
    for i in (0, 1):
        assert (f"support_friction_0_{i}", f"support_friction_1_{i}") in told.not_apart
    assert told.identifiable == 2
    signs = [np.sign(c.weights) for c in told.combinations[:2]]
    both = sorted(signs, key=lambda s: -abs(s.sum()))
    np.testing.assert_array_equal(both[0], 1.0)
    assert both[1][0] == both[1][2] == -both[1][1] == -both[1][3]
    # And so it is reported.
    content = json.loads(result_json(Examined(known=result), recording, 0, {}))["cells"]
    assert content["grid"] == [2, 2]
    assert content["combinations_identifiable"] == 2
    assert ["support_friction_0_0", "support_friction_1_0"] in content["neighbours_indistinguishable"]
    assert "0,0 and 1,0" in cells_verdict(told)
    assert cells_table(told).row_count == 4
    assert cells_figure(told).startswith("<svg")


def test_friction_of_three_cells_is_recovered_push_by_push():
    points, _ = BOX.support(POINTS)
    truth = np.array([0.2, 0.3, 0.42])
    cell = np.clip(((points[:, 0] / 0.10 + 0.5) * 3).astype(int), 0, 2)
    recording = recorded(
        BOX, Theta(hand_friction=0.22), pushes_of(BOX, 3, seed=1), seed=3, friction_of_points=truth[cell]
    )
    one = learner(recording, *FRICTIONS, cells=(3, 1))
    belief = one.start()
    for push in recording.pushes:
        belief = one.learn(belief, push)
    result = one.identification(belief)
    found = {e.name: e for e in result.estimates}
    for k, true in enumerate(truth):
        e = found[f"support_friction_{k}_0"]
        assert e.value == pytest.approx(true, rel=0.15), e
        assert e.ci90[0] / 1.1 < true < 1.1 * e.ci90[1]
    assert result.cells.identifiable == 3
    assert result.cells.not_apart == ()


def test_a_push_that_misses_does_not_end_what_is_learned_of_others(recording):
    """As in the batch: that no hand comes near is refused only where it is so in every push."""
    aside = recording.pushes[1]
    far = dc.replace(aside, hand=dc.replace(aside.hand, positions=aside.hand.positions + np.array([0.0, 0.5, 0.0])))
    one = learner(dc.replace(recording, pushes=(recording.pushes[0], far)))
    belief = one.learn(one.learn(one.start(), recording.pushes[0]), far)
    assert len(belief.foreseen) == 2
    with pytest.raises(RecordingError, match="same frame"):
        learner(dc.replace(recording, pushes=(far,)))
