"""What a scenario may say. Plain data: Drake's loader cannot read deferred annotations or frozen classes."""

import dataclasses as dc

from physid_drake.cell.config import CellConfig
from physid_drake.identify import SearchConfig
from physid_drake.plan.config import PlanConfig
from physid_drake.pushes.case import MOST_PUSHES
from physid_drake.pushes.config import ThetaConfig


@dc.dataclass
class Scenario:
    """One run.

    Attributes:
        recording: a folder, or the name of a recording that ships with the project.
        pushes: to look at, at most; of more, so many are taken at equal distances.
        seed: of everything random.
        cell: contact, solver, friction cells.
        theta: the unknowns.
        search: how theta is searched for.
        plan: the search over a policy with what was identified.
    """

    recording: str = "eraser_reference"
    pushes: int = MOST_PUSHES
    seed: int = 0
    cell: CellConfig = dc.field(default_factory=CellConfig)
    theta: ThetaConfig = dc.field(default_factory=ThetaConfig)
    search: SearchConfig = dc.field(default_factory=SearchConfig)
    plan: PlanConfig = dc.field(default_factory=PlanConfig)
