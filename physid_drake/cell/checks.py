"""What a cell's configuration may say, wherever it was read from."""

from __future__ import annotations

from physid_drake.cell.config import CellConfig
from physid_drake.errors import ConfigError

MODELS = ("hydroelastic", "point")
SCHEMES = ("cenic", "lagged", "similar", "sap", "tamsi")
LONGEST_TICK = 0.05  # s
MOST_CELLS = 10  # along a side
LIGHTEST, HEAVIEST = 20.0, 8000.0  # kg/m^3 of the box around the object: foam, steel


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def check_config(config: CellConfig) -> None:
    """Refuse values that no cell can use.

    Raises:
        ConfigError: naming the key and the rule.
    """
    contact, solver, cells = config.contact, config.solver, config.friction_cells
    rules: list[tuple[str, object, bool, str]] = [
        ("contact.model", contact.model, contact.model in MODELS, " or ".join(repr(m) for m in MODELS)),
        ("contact.support_points", contact.support_points,
         _is_whole(contact.support_points) and 4 <= contact.support_points <= 1000, "a whole number from 4 to 1000"),
        ("contact.rest_depth_m", contact.rest_depth_m, 1e-8 <= contact.rest_depth_m <= 1e-2, "from 1e-8 to 1e-2 m"),
        ("contact.dissipation_s_per_m", contact.dissipation_s_per_m, contact.dissipation_s_per_m >= 0.0,
         "at least 0 s/m"),
        ("contact.stiction_tolerance_mps", contact.stiction_tolerance_mps, contact.stiction_tolerance_mps > 0.0,
         "above 0 m/s"),
        ("contact.hand_frequency_rad_s", contact.hand_frequency_rad_s, contact.hand_frequency_rad_s > 0.0,
         "above 0 rad/s"),
        ("solver.scheme", solver.scheme, solver.scheme in SCHEMES, f"one of {', '.join(SCHEMES)}"),
        ("solver.time_step_s", solver.time_step_s, 0.0 < solver.time_step_s <= LONGEST_TICK,
         f"in (0, {LONGEST_TICK:g}] s"),
        ("solver.slide_time_step_s", solver.slide_time_step_s,
         solver.time_step_s <= solver.slide_time_step_s <= LONGEST_TICK,
         f"between time_step_s and {LONGEST_TICK:g} s"),
        ("friction_cells", cells, len(cells) == 2 and all(_is_whole(n) and 1 <= n <= MOST_CELLS for n in cells),
         f"whole [nx, ny] from 1 to {MOST_CELLS}"),
        ("default_density_kgpm3", config.default_density_kgpm3, LIGHTEST <= config.default_density_kgpm3 <= HEAVIEST,
         f"from {LIGHTEST:g} to {HEAVIEST:g} kg/m^3"),
    ]  # fmt: skip
    switches = ("impact_law", "drift_feedforward", "trapezoid_slide")
    values = {name: getattr(solver, name) for name in switches}
    rules += [(f"solver.{k}", v, isinstance(v, bool), "true or false") for k, v in values.items()]
    for key, value, fine, rule in rules:
        if not fine:
            raise ConfigError(f"key 'cell.{key}': must be {rule}, but is {value!r}.")
