"""The kinds of inputs, as often as each comes up in a round."""

from __future__ import annotations

from fuzz import commands, configurations, folders, logs, meshes, models, proofs, recordings, sources, tables
from fuzz.worker import Maker

KINDS: list[tuple[str, Maker]] = [
    ("table", tables.make), ("recording", recordings.make), ("mesh", meshes.make), ("model", models.make),
    ("folder", folders.make), ("command", commands.make), ("table", tables.make), ("recording", recordings.make),
    ("source", sources.make), ("configuration", configurations.make), ("proof", proofs.make), ("folder",
    folders.make),
    ("model", models.make), ("source", sources.make), ("command", commands.make), ("log", logs.make),
    ("log", logs.make), ("log", logs.make),
]  # fmt: skip
