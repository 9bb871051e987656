"""A table in whatever frame, units and order a map says: what the map makes of it is the recording again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml
from scipy.spatial.transform import Rotation

from foreign.common import at
from physid_drake.convert.map_reading import stated_in
from physid_drake.convert.mapping import Turn
from physid_drake.convert.source_frame import source_frame
from physid_drake.convert.units import ANGLES, LENGTHS
from physid_drake.recording import Conversion, Recording

COLUMNS = "push,t,x,y,z,q0,q1,q2,q3,hx,hy,hz"


def map_of(recording: Recording, **said: str) -> str:
    """A map of such a table.

    Args:
        recording: which it describes, as its folder has it.
        said: ``unit`` and ``hand_unit`` of places, ``order`` of quaternions; ``world``, ``hand_world`` and ``offset``
            as a map has them; ``rotation``, where it is not a quaternion.
    """
    assert recording.folder is not None
    whole = yaml.safe_load((recording.folder / "recording.yaml").read_text(encoding="utf-8"))
    kept = {"name": "log"} | {key: whole[key] for key in ("object", "table", "hand", "sensors") if key in whole}
    rotation = said.get("rotation", f"{{columns: [q0, q1, q2, q3], as: {said.get('order', 'wxyz')}}}")
    lines = [
        "format: physid-map/1",
        f"recording: {yaml.safe_dump(kept, default_flow_style=True, width=10_000).strip()}",
        "time: {column: t}",
        "object:",
        f"  position: {{columns: [x, y, z], unit: {said.get('unit', 'm')}}}",
        f"  rotation: {rotation}",
        *([f"  offset: {said['offset']}"] if "offset" in said else []),
        "hand:",
        f"  position: {{columns: [hx, hy, hz], unit: {said.get('hand_unit', 'm')}}}",
        "  rotation: none",
        *([f"  world: {said['hand_world']}"] if "hand_world" in said else []),
        *([f"world: {said['world']}"] if "world" in said else []),
        "pushes: {cut: column, column: push}",
    ]
    return "\n".join(lines) + "\n"


def by_map(recording: Recording, file: Path, text: str) -> None:
    """Writes the table that a map makes a recording of."""
    stated = stated_in(Conversion(source="log", source_sha256="", map=text, map_sha256=""))
    assert stated is not None and stated.hand is not None
    body, tip = source_frame(stated, stated.object), source_frame(stated, stated.hand)
    units = [LENGTHS[pose.position.unit or "m"] for pose in (stated.object, stated.hand)]
    tables = []
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        times = push.object.times
        hand = replace(
            push.hand,
            times=times,
            positions=at(times, push.hand.times, push.hand.positions),
            quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1)),
            rotation="none",
        )
        turns = _written(body.rotations(push.object), stated.object.turn, body.world.axes[2])
        numbers = [body.places(push.object) / units[0], turns, tip.places(hand) / units[1]]
        tables.append(np.column_stack([np.full(len(times), k), times, *numbers]))
    np.savetxt(file, np.vstack(tables), delimiter=",", header=COLUMNS, comments="", fmt="%.12g")


def _written(rotations: Rotation, turn: Turn | None, up: np.ndarray) -> np.ndarray:
    """Rotations (n) as a map says, in four columns (n, 4), of which angles leave the last ones empty."""
    kind = "wxyz" if turn is None else turn.kind
    if turn is None or kind in ("wxyz", "xyzw"):
        return np.roll(rotations.as_quat(), 1 if kind == "wxyz" else 0, axis=1)
    if kind == "euler":
        angles = np.unwrap(rotations.as_euler(turn.order), axis=0)
    elif kind == "yaw":
        angles = np.unwrap(rotations.as_rotvec() @ up)[:, None]
    else:
        angles = rotations.as_rotvec()
    return np.pad(angles / ANGLES[turn.unit or "rad"], ((0, 0), (0, 4 - angles.shape[1])))
