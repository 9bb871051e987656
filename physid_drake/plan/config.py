"""Configuration of the plan in the main job: plain data for Drake's typed YAML loader, no deferred annotations."""

import dataclasses as dc


@dc.dataclass
class PlanConfig:
    """The plan that the main job makes with what it identified, and again with what its diagnosis finds.

    Attributes:
        policy: a name in ``policies.POLICIES``.
        goal_m: ``[x, y]`` of the goal; empty for 0.3 m ahead of the object's start along +x, or as fits on the table.
        start_m: ``[x, y]`` of the object; empty for where it stood before the recording's first push.
        start_deg: its yaw, where ``start_m`` is given.
        budget: settings that the search tries.
        sweep: settings of the cost's curve; 0 for none.
        draws: of theta, for the spread under the belief; 0 for none.
        tolerance_m: of the goal, within which an end counts as a success.
    """

    policy: str = "push"
    goal_m: list[float] = dc.field(default_factory=list)
    start_m: list[float] = dc.field(default_factory=list)
    start_deg: float = 0.0
    budget: int = 40
    sweep: int = 12
    draws: int = 5
    tolerance_m: float = 0.01
