"""Logs in the layouts that programs of others write, made of a recording, so that the way back can be compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from foreign.apart import control, detections, frames, rostopic, trials
from foreign.arrays import (
    demonstrations,
    json_lines,
    json_pushes,
    lerobot,
    matlab,
    padded_npz,
    records,
    transforms,
)
from foreign.bags import mcap, odometry, only_pushes, ros1
from foreign.by_map import by_map, map_of
from foreign.common import DESCRIPTION, HAND, assert_rests_agree
from foreign.text import (
    LEFT_HANDED,
    german,
    markers,
    motive,
    motive_euler,
    qualisys,
    rtde,
    rulers,
    unity,
    vicon,
    video,
)
from physid_drake.recording import Recording

__all__ = [
    "BAGS", "DESCRIPTION", "HAND", "LEFT_HANDED", "TABLES", "Log", "assert_rests_agree", "by_map", "control",
    "demonstrations", "detections", "frames", "german", "json_lines", "json_pushes", "lerobot", "map_of", "markers",
    "matlab", "mcap", "motive", "motive_euler", "odometry", "only_pushes", "padded_npz", "qualisys", "records",
    "ros1", "rostopic", "rtde", "rulers", "transforms", "trials", "unity", "vicon", "video",
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Log:
    """A layout: what writes a log of it and returns its map, and what comes back.

    Attributes:
        write: a recording to a file or folder.
        needs: the module that reads it, if it is an extra.
        exact: whether samples come back as they were; a take is resampled, and has rests of its own.
        rotation: what comes back of the object's.
    """

    write: Callable[[Recording, Path], str]
    needs: str = "numpy"
    exact: bool = False
    rotation: str = "full"


TABLES = {
    "take.csv": Log(write=motive),
    "take_euler.csv": Log(write=motive_euler),
    "vicon.csv": Log(write=vicon),
    "qualisys.tsv": Log(write=qualisys),
    "trial1.trc": Log(write=markers, rotation="none"),
    "versuche.csv": Log(write=german, exact=True),
    "unity": Log(write=unity, exact=True),
    "rtde.txt": Log(write=rtde, exact=True, rotation="yaw"),
    "padded.npz": Log(write=padded_npz, exact=True),
    "transforms.npz": Log(write=transforms, exact=True),
    "trials.mat": Log(write=matlab, exact=True, rotation="yaw"),
    "demos.h5": Log(write=demonstrations, needs="h5py", exact=True),
    "pushes.json": Log(write=json_pushes, exact=True),
    "samples.jsonl": Log(write=json_lines, exact=True),
    "samples.npy": Log(write=records, exact=True),
    "topics": Log(write=rostopic),
    "trials": Log(write=trials, exact=True, rotation="yaw"),
    "detections.csv": Log(write=detections),
    "control.csv": Log(write=control, rotation="yaw"),
    "frames": Log(write=frames, rotation="yaw"),
    "data.parquet": Log(write=lerobot, needs="pyarrow", exact=True, rotation="yaw"),
}
"""Tables of whole pushes; ``rulers`` knows the ends only, ``video`` has no rotation and two clocks."""

BAGS = {
    "mcap": Log(write=mcap, needs="rosbags"),
    "sqlite3": Log(write=partial(mcap, storage="sqlite3"), needs="rosbags"),
    "only_pushes": Log(write=only_pushes, needs="rosbags", exact=True),
    "pushes.bag": Log(write=ros1, needs="rosbags"),
    "odometry.bag": Log(write=odometry, needs="rosbags"),
}
