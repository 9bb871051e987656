"""The formulas in docs/effects.md say what the package's laws do."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from formulas import equations, value, value_of

from physid_drake.cell import Body, HandPath
from physid_drake.cell.diagram import GRAVITY
from physid_drake.cell.impact import routh_impulse
from physid_drake.cell.soft_tip import Mount
from physid_drake.effects import SHIPPED, PushFacts, effect_named
from physid_drake.effects.law_values import GYRATION, force_on, friction_factors, object_at
from physid_drake.recording import Box

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "effects.md").read_text(encoding="utf-8")
MASS, FRICTION, POLAR, RADIUS, ORDER = 0.4, 0.25, 2e-3, 0.03, 5
FACTS = PushFacts(
    order=ORDER, mass=MASS, polar=POLAR, rolling_radius=RADIUS, hand_axes=np.array([[0.6, -0.8], [0.8, 0.6]])
)
BODY = Body(
    mass=MASS, p_BBcm=np.zeros(2), inertia_ratio=1.0, hand_friction=0.3, support_friction=np.array([FRICTION])
)  # fmt: skip
PATH = HandPath(times=np.array([0.0, 0.1, 0.6]), velocities=np.array([[0.0, 0.0], [0.2, 0.0], [0.2, 0.0]]),
                start=np.array([0.1, 0.2]))  # fmt: skip
PLACE, VELOCITY, SPIN = 0.03 - 0.02j, 0.2 + 0.1j, 1.5
VALUES = {
    "stribeck_friction": {"excess": 0.5, "speed": 0.3}, "viscous_drag": {"coefficient": 1.0},
    "quadratic_drag": {"coefficient": 2.5}, "anisotropic_table": {"ratio": 2.0, "angle": 0.5},
    "anisotropic_object": {"ratio": 3.0, "angle": 0.2},
    "friction_patch": {"ratio": 2.5, "x": 0.12, "y": 0.06, "radius": 0.05},
    "friction_gradient": {"slope_x": 3.0, "slope_y": 1.5}, "friction_drift": {"per_push": -0.04},
    "table_tilt": {"x": 0.03, "y": 0.05}, "com_offset": {"x": 0.02, "y": 0.01}, "rotational_inertia": {"ratio": 2.0},
    "sloshing": {"fraction": 0.4, "frequency": 3.0, "damping": 0.05, "turning": 0.3},
    "rolling_resistance": {"coefficient": 8e-4},
    "tether": {"stiffness": 6.0, "x": 0.0, "y": 0.1, "rest_length": 0.08},
    "magnet": {"strength": 8e-4, "x": 0.13, "y": 0.06, "core": 0.03}, "restitution": {"coefficient": 0.4},
    "hand_compliance": {"compliance": 0.005, "damping": 0.3, "share": 0.2}, "actuator_lag": {"time_constant": 0.05},
    "hand_offset": {"x": 0.004, "y": 0.008}, "tracker_latency": {"delay": 0.05},
    "tracker_bias": {"x": 0.012, "y": 0.006, "yaw": 0.15}, "tracker_scale": {"ratio": 1.1},
    "size_error": {"ratio": 1.1},
}  # fmt: skip


class Section:
    """What the page says of an effect: its formula, and the symbols of its parameters."""

    def __init__(self, name):
        text = re.search(rf"^### `{name}`\n(.*?)(?=^#|\Z)", PAGE, re.MULTILINE | re.DOTALL)[1]
        self.effect = effect_named(name)(**VALUES[name])
        self.formula = re.search(r"^\$\$\n(.+?)\n\$\$$", text, re.MULTILINE | re.DOTALL)[1]
        parameters = re.findall(r"^- `(\w+)` \$([^$]+)\$ \[", text, re.MULTILINE)
        self.symbols = {symbol: getattr(self.effect, parameter) for parameter, symbol in parameters}

    def __call__(self, name, **symbols):
        return value_of(self.formula, name, **self.symbols, **symbols)

    def force(self, **state):
        force = force_on(object_at(mass=MASS, **state), self.effect, FACTS)
        return np.array([force.real, force.imag])

    def friction(self, velocity=VELOCITY, place=0j):
        """The coefficient, times e^(i turn)."""
        return FRICTION * complex(friction_factors(object_at(velocity=velocity, place=place), self.effect, FACTS)[0])


def plane(number):
    return np.array([number.real, number.imag])


def stribeck_friction(said):
    assert said(r"\mu(v)", **{r"\mu": FRICTION, "v": abs(VELOCITY)}) == pytest.approx(said.friction().real)


def viscous_drag(said):
    (law,) = said.effect.laws(FACTS)
    wrench = law.wrench(object_at(velocity=VELOCITY, yaw_rate=SPIN, mass=MASS, span=1e-9))
    assert said("F", v=plane(VELOCITY)) == pytest.approx([wrench.fx, wrench.fy])
    assert said("M", **{"k": math.sqrt(POLAR), r"\omega": SPIN}) == pytest.approx(wrench.torque)


def quadratic_drag(said):
    assert said("F", v=plane(VELOCITY)) == pytest.approx(said.force(velocity=VELOCITY, span=1e-9))


def anisotropic_table(said):
    friction = -said.friction() * VELOCITY / abs(VELOCITY)
    assert said("f", **{"N": 1.0, r"\mu": FRICTION, "v": plane(VELOCITY)}) == pytest.approx(plane(friction))


anisotropic_object = anisotropic_table


def friction_patch(said):
    right, where = equations(said.formula)[r"\mu(x, y)"].split(r"\quad \text{where} \quad")
    left, edge = where.split(r"\le")
    inside = []
    for place in (0.12 + 0.1j, 0.12 + 0.06j, 0.12 + 0.12j):
        symbols = said.symbols | {"x": place.real, "y": place.imag, r"\mu": FRICTION}
        inside.append(bool(value(left, symbols.get) <= value(edge, symbols.get)))
        expected = value(right, symbols.get) if inside[-1] else FRICTION
        assert said.friction(place=place).real == pytest.approx(expected)
    assert inside == [True, True, False]


def friction_gradient(said):
    said_here = said(r"\mu(x, y)", **{r"\mu": FRICTION, "x": PLACE.real, "y": PLACE.imag})
    assert said_here == pytest.approx(said.friction(place=PLACE).real)


def friction_drift(said):
    for order in (ORDER, 100):
        body = said.effect.body(BODY, PushFacts(order=order, mass=MASS, polar=POLAR))
        assert said(r"\mu_i", **{r"\mu": FRICTION, "i": order}) == pytest.approx(body.support_friction[0])


def table_tilt(said):
    expected = [said(name, m=MASS, g=GRAVITY) for name in ("F_x", "F_y")]
    assert said.force() == pytest.approx(expected)


def com_offset(said):
    assert said("p_{BBcm}") == pytest.approx(said.effect.body(BODY, FACTS).p_BBcm)


def rotational_inertia(said):
    assert said("I", I_0=1.0) == pytest.approx(said.effect.body(BODY, FACTS).inertia_ratio)


def sloshing(said):
    body = said.effect.body(BODY, FACTS)
    assert said("I", I_0=1.0) == pytest.approx(body.inertia_ratio * body.mass / MASS)
    assert said(r"\omega") == pytest.approx(2.0 * math.pi * 3.0)
    # The object stops, and the mass swings on.
    (law,), span = said.effect.laws(FACTS), 1e-6
    for time, velocity in ((0.0, VELOCITY), (span, 0j), (0.05, 0j)):
        wrench = law.wrench(object_at(velocity=velocity, time=time, span=span, mass=MASS))
    force = said("F", **{"m": MASS, "d": plane(law._place), r"\dot d": plane(law._velocity)})
    assert [wrench.fx, wrench.fy] == pytest.approx(force, rel=1e-4)


def rolling_resistance(said):
    expected = said("F", **{"R": RADIUS, "m": MASS, "g": GRAVITY, "v": np.array([0.2, 0.0])})
    assert said.force(velocity=0.2 + 0j) == pytest.approx(expected)


def tether(said):
    for place in (PLACE, 0.01 + 0.08j):
        force = said("F", x=place.real, y=place.imag)
        towards = plane(complex(said.effect.x, said.effect.y) - place)
        assert said.force(place=place) == pytest.approx(force * towards / np.hypot(*towards))


magnet = tether


def restitution(said):
    blow = {"lever_n": -0.05, "lever_t": 0.0, "approach": -0.3, "slip": 0.0, "mass": MASS,
            "inertia": MASS * GYRATION**2, "friction": 0.3}  # fmt: skip
    body = said.effect.body(BODY, FACTS)
    compression = routh_impulse(**blow, restitution=0.0).normal
    assert said("J", J_c=compression) == pytest.approx(routh_impulse(**blow, restitution=body.restitution).normal)


def hand_compliance(said):
    mount = said.effect.mount(FACTS)
    left, right = next(iter(equations(said.formula).items()))
    symbols = said.symbols | {
        "m": MASS,
        "h": 3e-3,
        "q": 1e-3,
        r"\dot h": 0.1,
        r"\dot q": 0.04,
        r"\ddot q": 1.0,
        "F": 0.2,
    }

    def look_up(symbol):
        return symbols[symbol]

    assert mount == Mount(stiffness=pytest.approx(200.0), damping=mount.damping, mass=mount.mass)
    assert value(left, look_up) == pytest.approx(mount.mass)
    assert value(right, look_up) == pytest.approx(mount.stiffness * 2e-3 + mount.damping * 0.06 - 0.2)


def actuator_lag(said):
    tip, time, step = said.effect.hand(PATH, FACTS), 0.3, 1e-3
    ((left, right),) = equations(said.formula).items()
    places = tip.positions(np.array([time - step, time, time + step]))
    symbols = said.symbols | {
        "q": places[1], r"\dot q": (places[2] - places[0]) / (2.0 * step), "h": PATH.positions(np.array([time]))[0]
    }  # fmt: skip
    assert value(left, symbols.__getitem__) == pytest.approx(value(right, symbols.__getitem__), abs=1e-5)


def hand_offset(said):
    tip = said.effect.hand(PATH, FACTS)
    assert said("q", h=PATH.start, **{"R_{WP}": FACTS.hand_axes}) == pytest.approx(tip.start)


def tracker_latency(said):
    assert said("z(t)", t=1.0, p=lambda time: time) == pytest.approx(1.0 - said.effect.lateness())


def tracker_bias(said):
    assert said("X_{BT}") == pytest.approx(said.effect.tracked(np.zeros((1, 3)))[0])


def tracker_scale(said):
    pose = np.array([[0.2, -0.1, 0.3]])
    assert said("z", p=pose[0, :2]) == pytest.approx(said.effect.tracked(pose)[0, :2])


def size_error(said):
    size = np.array([0.1, 0.08, 0.06])
    assert said("L", L_0=size) == pytest.approx(said.effect.reshaped(Box(size=tuple(size))).size)


@pytest.mark.parametrize("name", VALUES)
def test_the_formula_of_an_effect_is_what_its_law_does(name):
    globals()[name](Section(name))


def test_all_formulas_but_that_of_the_support_are_compared():
    """The pressure of an uneven support depends on where the object's mass is: tests/unit/test_support.py."""
    assert {kind.name for kind in SHIPPED} - set(VALUES) == {"uneven_support"}
