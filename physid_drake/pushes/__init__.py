"""A recorded push as a fit sees it: what is compared, its own unknowns, and what either integrator predicts of it."""
