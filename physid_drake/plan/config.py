"""Configuration of the plan in the main job: plain data for Drake's typed YAML loader, no deferred annotations."""

import dataclasses as dc


@dc.dataclass
class PlanConfig:
    """The plan that ``run_cell`` makes with the identified parameters, and again with what its diagnosis finds.

    Attributes:
        policy: a name in ``policies.POLICIES``.
        goal_m: ``[x, y]`` of the goal [m]; empty for 0.3 m ahead of the object's start along +x, or as fits on the
            table.
        start_m: ``[x, y]`` of the object [m]; empty for where it was before the recording's first push.
        start_deg: its yaw [deg], where ``start_m`` is given.
        budget: settings that the search tries.
        sweep: points of the curve of cost over one setting; 0 for none.
        draws: posterior samples for the spread of the cost; 0 for none.
        tolerance_m: distance from the goal up to which a push counts as a success [m].
    """

    policy: str = "push"
    goal_m: list[float] = dc.field(default_factory=list)
    start_m: list[float] = dc.field(default_factory=list)
    start_deg: float = 0.0
    budget: int = 40
    sweep: int = 12
    draws: int = 5
    tolerance_m: float = 0.01
