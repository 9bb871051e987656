"""How the cell is simulated. Plain data, so that Drake's ``yaml_load_typed`` reads it; no checks live here."""

import dataclasses as dc
from typing import Self


@dc.dataclass
class ContactConfig:
    """How the object meets the table.

    Attributes:
        model: ``hydroelastic`` (rigid facets under the object on a compliant table) or ``point`` (one
            sphere per quadrature point).
        support_points: about how many quadrature points carry the object; friction cells may need more. Thirty-six,
            and what cancels where slip turns about one of them, integrate friction to 0.2 % wherever in or near the
            base it turns.
        rest_depth_m: how deep an evenly loaded object sinks; the stiffness follows from it and the weight.
            Deeper leans a tall object under load transfer, shallower makes the lagged friction of a
            disturbed object wrong; 1 to 5 micrometres are within 0.1 sigma of each other on sixty pushes.
        dissipation_s_per_m: Hunt-Crossley dissipation of the support; the integrator damps enough.
        stiction_tolerance_mps: slip below which Drake treats a contact as sticking.
        hand_frequency_rad_s: natural frequency of the object on the hand's contact; stiffness = mass times
            its square.
    """

    model: str = "hydroelastic"
    support_points: int = 36
    rest_depth_m: float = 3e-6
    dissipation_s_per_m: float = 0.0
    stiction_tolerance_mps: float = 1e-4
    hand_frequency_rad_s: float = 1000.0


@dc.dataclass
class SolverConfig:
    """How Drake steps.

    Attributes:
        scheme: ``cenic``, or a discrete contact approximation of Drake (``lagged``, ``similar``, ``sap``,
            and ``tamsi`` where Drake still has it) for comparison.
        time_step_s: time step while the hand is near the object.
        slide_time_step_s: time step of a free slide, cut to a multiple of ``time_step_s``, which discrete schemes use
            throughout.
        impact_law: Routh's impact at every fast touch, instead of the solver's own.
        drift_feedforward: correct the contact for the turning of the face in a step, and for creep where it sticks.
        trapezoid_slide: replace the symplectic position update of a free slide by the trapezoidal one.
    """

    scheme: str = "cenic"
    time_step_s: float = 1e-3
    slide_time_step_s: float = 2e-3
    impact_law: bool = True
    drift_feedforward: bool = True
    trapezoid_slide: bool = True

    def scaled(self, factor: float) -> Self:
        """The same with all time steps ``factor`` times as long."""
        return dc.replace(
            self, time_step_s=factor * self.time_step_s, slide_time_step_s=factor * self.slide_time_step_s
        )


@dc.dataclass
class CellConfig:
    """The cell's configuration.

    Attributes:
        contact: the object's support.
        solver: Drake's stepping.
        friction_cells: ``[nx, ny]`` friction cells under the object.
        default_density_kgpm3: of the box around the object, assumed where the recording gives no mass: an empty cup
            has a hundred, a full bottle eight hundred.
    """

    contact: ContactConfig = dc.field(default_factory=ContactConfig)
    solver: SolverConfig = dc.field(default_factory=SolverConfig)
    friction_cells: list[int] = dc.field(default_factory=lambda: [1, 1])
    default_density_kgpm3: float = 500.0
