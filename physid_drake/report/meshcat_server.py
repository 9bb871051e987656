"""Meshcat with a server that listens where it is told, or with one that nobody can connect to."""

from __future__ import annotations

import os
import socket
from contextlib import suppress
from pathlib import Path

from pydrake.geometry import Meshcat, MeshcatParams

from physid_drake.errors import ConfigError

LOOPBACK = "127.0.0.1"
LISTENS = "0A"  # a socket's state in /proc/net/tcp

# Drake aborts the process where a Meshcat is destroyed by another thread than the one that made it. A diagram is a
# cycle of references, and Python collects cycles in any thread (that of a pool of processes, say): none is destroyed.
_kept: list[Meshcat] = []


def served(host: str = LOOPBACK) -> Meshcat:
    """A Meshcat that listens on a free port; whoever reaches it sees the scene.

    Args:
        host: address to listen on; ``*`` is every network of this machine.

    Raises:
        ConfigError: if there is no such address here.
    """
    try:
        meshcat = Meshcat(MeshcatParams(host=host, show_stats_plot=False))
    except RuntimeError as error:
        raise ConfigError(f"--host {host!r}: Meshcat cannot listen there; give this machine's address.") from error
    _kept.append(meshcat)
    return meshcat


def silent() -> Meshcat:
    """A Meshcat for files: nobody can connect to it.

    Drake's has no mode without a server, so its listening socket is replaced by one that does not listen.
    """
    before = _listening()
    meshcat = served()
    for descriptor in _listening() - before:
        with socket.socket() as mute:
            os.dup2(mute.fileno(), descriptor, inheritable=False)
    return meshcat


def _listening() -> set[int]:
    """Descriptors of this process's listening TCP sockets; none where the system does not tell."""
    inodes = set()
    for table in ("tcp", "tcp6"):
        with suppress(OSError):
            rows = [line.split() for line in Path(f"/proc/self/net/{table}").read_text().splitlines()[1:]]
            inodes |= {f"socket:[{row[9]}]" for row in rows if row[3] == LISTENS}
    found = set()
    with suppress(OSError):
        for entry in Path("/proc/self/fd").iterdir():
            with suppress(OSError):  # the one that reads this folder is gone
                if os.readlink(entry) in inodes:  # noqa: PTH115
                    found.add(int(entry.name))
    return found
