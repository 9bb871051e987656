"""Measures the tool: hidden worlds of another simulator, published recordings, the paper's experiments.

The commands ``prove`` and ``experiment`` start here. Nothing outside this room imports it, and it alone needs MuJoCo
(``pip install 'physid_drake[proof]'``). It ships with the tool, so that a proof names one version for both and
whoever doubts a figure can draw worlds of their own.
"""
