"""Versions of this package and of those that its numbers depend on."""

from __future__ import annotations

import platform
from importlib import metadata

PACKAGES = ("physid_drake", "drake", "mujoco", "numpy", "scipy", "scikit-learn")


def versions() -> dict[str, str]:
    """Of Python and of what the numbers of a run depend on, as far as it is installed."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def made_with() -> str:
    """The versions in one line."""
    return ", ".join(f"{name} {version}" for name, version in versions().items())
