"""The pushes of the rollout benchmark, and the engines that simulate them: the Cell and its peers.

A peer is imported when it is asked for: ``pip install physid_drake[peers]``.
"""
