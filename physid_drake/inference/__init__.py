"""Inference: one objective, one noise, one posterior for everything that is estimated from recorded pushes."""
