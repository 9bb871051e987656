"""Every effect of the catalogue in this engine's own terms, and physics that is in no catalogue.

Parameters are in SI units; with the null values stated an effect is not built in at all. ``rolling_resistance`` is
missing: it needs a lying cylinder, and these worlds have none. Points and directions are in W unless B is said.
"""
