"""A recorded push as a fit sees it: what is compared, its per-push parameters, and what is predicted of it."""
