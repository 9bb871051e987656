"""What a cell's configuration may say, wherever it was read from."""

from __future__ import annotations

from physid_drake.cell.config import CellConfig
from physid_drake.errors import ConfigError
from physid_drake.ranges import Range, is_whole
from physid_drake.wording import shown

MODELS = ("hydroelastic", "point")
SCHEMES = ("cenic", "lagged", "similar", "sap", "tamsi")
SHORTEST_TIME_STEP, LONGEST_TIME_STEP = 1e-5, 0.05  # s
MOST_DISSIPATION = 1e4  # s/m
MOST_FREQUENCY = 1e6  # rad/s
MOST_CELLS = 10  # along a side
LIGHTEST, HEAVIEST = 20.0, 8000.0  # kg/m^3 of the box around the object: foam, steel

Rule = tuple[str, object, bool, str]  # key, value, whether it is fine, and what it must be


def _in(value: object, allowed: Range) -> bool:
    """Whether it is a number, and one of those; a configuration may hold whatever YAML does."""
    return isinstance(value, int | float) and not isinstance(value, bool) and allowed.holds(value)


def check_config(config: CellConfig) -> None:
    """Refuse values that no cell can use.

    Raises:
        ConfigError: naming the key and the rule.
    """
    for key, value, fine, rule in (*_contact_rules(config), *_solver_rules(config), *_object_rules(config)):
        if not fine:
            raise ConfigError(f"key 'cell.{key}': must be {rule}, but is {shown(value)}.")


def _contact_rules(config: CellConfig) -> list[Rule]:
    contact = config.contact
    points = contact.support_points
    enough = is_whole(points) and 4 <= points <= 1000
    numbers: list[tuple[str, Range, str]] = [
        ("rest_depth_m", Range(least=1e-8, most=1e-2), "from 1e-8 to 1e-2 m"),
        ("dissipation_s_per_m", Range(least=0.0, most=MOST_DISSIPATION), f"from 0 to {MOST_DISSIPATION:g} s/m"),
        ("stiction_tolerance_mps", Range(above=0.0, most=1.0), "above 0, at most 1 m/s"),
        ("hand_frequency_rad_s", Range(above=0.0, most=MOST_FREQUENCY), f"above 0, at most {MOST_FREQUENCY:g} rad/s"),
    ]  # fmt: skip
    return [
        ("contact.model", contact.model, contact.model in MODELS, " or ".join(repr(m) for m in MODELS)),
        ("contact.support_points", points, enough, "a whole number from 4 to 1000"),
        *((f"contact.{key}", getattr(contact, key), _in(getattr(contact, key), allowed), rule)
          for key, allowed, rule in numbers),
    ]  # fmt: skip


def _solver_rules(config: CellConfig) -> list[Rule]:
    solver = config.solver
    step, slide = solver.time_step_s, solver.slide_time_step_s
    steps = Range(least=SHORTEST_TIME_STEP, most=LONGEST_TIME_STEP)
    switches = {name: getattr(solver, name) for name in ("impact_law", "drift_feedforward", "trapezoid_slide")}
    return [
        ("solver.scheme", solver.scheme, solver.scheme in SCHEMES, f"one of {', '.join(SCHEMES)}"),
        ("solver.time_step_s", step, _in(step, steps), f"from {SHORTEST_TIME_STEP:g} to {LONGEST_TIME_STEP:g} s"),
        ("solver.slide_time_step_s", slide, _in(slide, steps) and (not _in(step, steps) or step <= slide),
         f"between time_step_s and {LONGEST_TIME_STEP:g} s"),
        *((f"solver.{key}", value, isinstance(value, bool), "true or false") for key, value in switches.items()),
    ]  # fmt: skip


def _object_rules(config: CellConfig) -> list[Rule]:
    cells, density = config.friction_cells, config.default_density_kgpm3
    even = (
        isinstance(cells, list | tuple)
        and len(cells) == 2
        and all(is_whole(n) and 1 <= n <= MOST_CELLS for n in cells)
    )
    return [
        ("friction_cells", cells, even, f"whole [nx, ny] from 1 to {MOST_CELLS}"),
        ("default_density_kgpm3", density, _in(density, Range(least=LIGHTEST, most=HEAVIEST)),
         f"from {LIGHTEST:g} to {HEAVIEST:g} kg/m^3"),
    ]  # fmt: skip
