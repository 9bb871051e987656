"""The same examples in every run, so that a failure comes back. `PHYSID_EXAMPLES=500 pytest tests/property`: more."""

import os

from hypothesis import settings

settings.register_profile(
    "physid",
    max_examples=int(os.environ.get("PHYSID_EXAMPLES", "30")),
    derandomize=True,
    deadline=None,  # the first rollout of a process loads machine code
    database=None,
)
settings.load_profile("physid")
