"""Inference from recorded pushes: one objective, one noise model and one posterior for identification and diagnosis.

Symbols in this package: z (n,) are the coordinates that all pushes share, the parameters theta in their unit cube
followed by effects' coordinates (``hypothesis.Hypothesis``); dz is a change of z; u (k,) are a push's nuisance
parameters; m is the number of features of a push (window means of poses and forces, ``pushes.features``).
"""
