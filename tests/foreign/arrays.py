"""Tables of arrays: npz, npy, HDF5, MATLAB, Parquet, JSON."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from foreign.common import DESCRIPTION, EPOCH, HAND, at, rotations
from physid_drake.recording import Recording


def padded_npz(recording: Recording, file: Path) -> str:
    """Arrays (pushes, n, k) filled up with NaN, in which the finger is not always seen, and forces on the hand."""
    most = max(len(push.object) for push in recording.pushes)
    pose, finger = (np.full((len(recording.pushes), most, k), np.nan) for k in (7, 3))
    stamp, force = (
        np.full((len(recording.pushes), most, 1), np.nan),
        np.full((len(recording.pushes), most, 3), np.nan),
    )
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        n = len(push.object)
        stamp[k, :n, 0] = 1.7e9 + 100.0 * k + push.object.times
        pose[k, :n] = np.column_stack([push.object.positions, push.object.quaternions])
        finger[k, :n] = at(push.object.times, push.hand.times, push.hand.positions)
        finger[k, 3:n:7] = np.nan
        force[k, :n] = [-1.0, 2.0, 0.5]
    np.savez(file, pose=pose, finger=finger, stamp=stamp, force=force)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: "stamp[0]"}
object:
  position: {columns: ["pose[0]", "pose[1]", "pose[2]"]}
  rotation: {columns: ["pose[3]", "pose[4]", "pose[5]", "pose[6]"], as: wxyz}
hand:
  position: {columns: ["finger[0]", "finger[1]", "finger[2]"]}
  rotation: none
force: {columns: ["force[0]", "force[1]", "force[2]"], acts_on: hand}
pushes: {cut: column, column: "[push]"}
"""
    )


def lerobot(recording: Recording, file: Path) -> str:
    """LeRobot's table of frames: lists of numbers, an episode's index, times that begin anew with every episode."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    states, actions, stamps, episodes = [], [], [], []
    for k, push in enumerate(recording.pushes):
        assert push.hand is not None
        hand = at(push.object.times, push.hand.times, push.hand.positions)
        states += np.column_stack([hand, push.object.positions, push.object.planar[:, 2]]).tolist()
        actions += hand[:, :2].tolist()
        stamps += (push.object.times - push.object.times[0]).tolist()
        episodes += [k] * len(push.object)
    table = pa.table(
        {
            "observation.state": pa.array(states, type=pa.list_(pa.float64(), 7)),
            "action": pa.array(actions),
            "timestamp": pa.array(stamps, type=pa.float64()),
            "episode_index": pa.array(episodes, type=pa.int64()),
            "task": pa.array(["push"] * len(stamps)),
        }
    )
    pq.write_table(table, file)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: timestamp}
object:
  position: {columns: ["observation.state[3]", "observation.state[4]", "observation.state[5]"]}
  rotation: {columns: "observation.state[6]", as: yaw, unit: rad}
hand:
  position: {columns: ["observation.state[0]", "observation.state[1]", "observation.state[2]"]}
  rotation: none
pushes: {cut: column, column: episode_index}
"""
    )


def demonstrations(recording: Recording, file: Path) -> str:
    """An HDF5 file with a group for each push."""
    import h5py

    with h5py.File(file, "w") as opened:
        for k, push in enumerate(recording.pushes):
            assert push.hand is not None
            group = opened.create_group(f"demo_{k}/obs")
            group["time"] = push.object.times
            group["object"] = np.column_stack([push.object.positions, np.roll(push.object.quaternions, -1, axis=1)])
            group["eef_pos"] = at(push.object.times, push.hand.times, push.hand.positions)
            group["image"] = np.zeros((len(push.object), 2, 2, 3), dtype=np.uint8)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: obs/time}
object:
  position: {columns: ["obs/object[0]", "obs/object[1]", "obs/object[2]"]}
  rotation: {columns: ["obs/object[3]", "obs/object[4]", "obs/object[5]", "obs/object[6]"], as: xyzw}
hand:
  position: {columns: ["obs/eef_pos[0]", "obs/eef_pos[1]", "obs/eef_pos[2]"]}
  rotation: none
pushes: {cut: column, column: "[push]"}
"""
    )


def transforms(recording: Recording, file: Path) -> str:
    """Homogeneous transforms (n, 4, 4) of object and tip, each with stamps in ns of a clock of its own.

    Only the pushes were recorded, with some seconds between.
    """
    objects, tips, stamps, tip_stamps = [], [], [], []
    begin = 0.0
    for push in recording.pushes:
        assert push.hand is not None
        pose = np.tile(np.eye(4), (len(push.object), 1, 1))
        pose[:, :3, :3], pose[:, :3, 3] = rotations(push.object).as_matrix(), push.object.positions
        tip = np.tile(np.eye(4), (len(push.hand), 1, 1))
        tip[:, :3, 3] = push.hand.positions
        objects.append(pose)
        tips.append(tip)
        stamps.append(EPOCH + begin + push.object.times)
        tip_stamps.append(EPOCH + 0.25 + begin + push.hand.times)
        begin += push.end_time + 3.0
    np.savez(
        file,
        T_world_object=np.vstack(objects),
        T_world_tip=np.vstack(tips),
        object_stamp=np.round(1e9 * np.concatenate(stamps)).astype(np.int64),
        tip_stamp=np.round(1e9 * np.concatenate(tip_stamps)).astype(np.int64),
    )
    rotation = [f"T_world_object[{i},{j}]" for i in range(3) for j in range(3)]
    places = {name: [f"T_world_{name}[{i},3]" for i in range(3)] for name in ("object", "tip")}
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
object:
  time: {{column: object_stamp, unit: ns}}
  position: {{columns: {places["object"]}}}
  rotation: {{columns: {rotation}, as: matrix}}
hand:
  time: {{column: tip_stamp, unit: ns, offset_s: -0.25}}
  position: {{columns: {places["tip"]}}}
  rotation: none
pushes: {{cut: gap, gap_s: 1.0}}
"""
    )


def matlab(recording: Recording, file: Path) -> str:
    """A MATLAB file with an array of structures, one for each push, mm and degrees."""
    import scipy.io

    trials = []
    for push in recording.pushes:
        assert push.hand is not None
        times = push.object.times
        planar = push.object.planar
        trials.append(
            {
                "t": times[:, None],
                "mug": np.column_stack([1e3 * planar[:, :2], np.rad2deg(planar[:, 2])]),
                "tip": 1e3 * at(times, push.hand.times, push.hand.positions[:, :2]),
                "operator": "somebody",
            }
        )
    kinds = [(key, object) for key in trials[0]]
    rows = np.array([tuple(trial.values()) for trial in trials], dtype=kinds)
    scipy.io.savemat(file, {"trial": rows, "rate_hz": 200.0}, do_compression=True)
    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + """\
time: {column: t}
object:
  position: {columns: ["mug[0]", "mug[1]"], unit: mm}
  rotation: {columns: "mug[2]", as: yaw, unit: deg}
  height_m: 0.023
hand:
  position: {columns: ["tip[0]", "tip[1]"], unit: mm}
  rotation: none
  height_m: 0.023
pushes: {cut: column, column: "[push]"}
"""
    )


def _samples(recording: Recording) -> list[dict[str, np.ndarray]]:
    """Of each push times, poses and places of the tip."""
    found = []
    for push in recording.pushes:
        assert push.hand is not None
        found.append(
            {
                "t": push.object.times,
                "position": push.object.positions,
                "xyzw": np.roll(push.object.quaternions, -1, axis=1),
                "tip": at(push.object.times, push.hand.times, push.hand.positions),
            }
        )
    return found


def _map(names: str, turn: str, tip: str, cut: str, time: str = "t") -> str:
    def columns(name: str, count: int) -> str:
        return "[" + ", ".join(f'"{name}[{k}]"' for k in range(count)) + "]"

    return (
        DESCRIPTION.format(name="mug")
        + HAND
        + f"""\
time: {{column: {time}}}
object:
  position: {{columns: {columns(names, 3)}}}
  rotation: {{columns: {columns(turn, 4)}, as: xyzw}}
hand:
  position: {{columns: {columns(tip, 3)}}}
  rotation: none
pushes: {{cut: column, column: "{cut}"}}
"""
    )


def json_pushes(recording: Recording, file: Path) -> str:
    """A list of pushes, each with lists of its samples."""
    pushes = [{name: values.tolist() for name, values in one.items()} for one in _samples(recording)]
    file.write_text(json.dumps({"date": "2026-03-01", "pushes": pushes}))
    return _map("position", "xyzw", "tip", "[push]")


def json_lines(recording: Recording, file: Path) -> str:
    """A sample in each line, with dates; of some, the tip was not seen."""
    lines = []
    for k, one in enumerate(_samples(recording)):
        for j, t in enumerate(one["t"]):
            stamp = np.datetime64("2026-03-01T10:00:00", "ns") + np.timedelta64(round(1e9 * (1e3 * k + t)), "ns")
            body = {"position": one["position"][j].tolist(), "xyzw": one["xyzw"][j].tolist()}
            tip = {} if j % 50 == 3 else {"tip": one["tip"][j].tolist()}
            lines.append(json.dumps({"when": f"{stamp}Z", "trial": k, "mug": body, "user": "me"} | tip))
    file.write_text("\n".join(lines) + "\n")
    return _map("mug/position", "mug/xyzw", "tip", "trial", "when")


def records(recording: Recording, file: Path) -> str:
    """A structured array of NumPy."""
    kind = [("t", "f8"), ("trial", "i4"), ("mug", [("p", "f8", 3), ("xyzw", "f8", 4)]), ("tip", "f8", 3)]
    rows = []
    for k, one in enumerate(_samples(recording)):
        array = np.zeros(len(one["t"]), dtype=kind)
        array["t"], array["trial"], array["tip"] = one["t"] + 1e3 * k, k, one["tip"]
        array["mug"]["p"], array["mug"]["xyzw"] = one["position"], one["xyzw"]
        rows.append(array)
    np.save(file, np.concatenate(rows))
    return _map("mug/p", "mug/xyzw", "tip", "trial")
