"""How often the data doctor names a convention that is wrong: conventions.py PROOF [...] [--seed N] [--each K].

PROOF is a folder of ``python -m physid_drake.validation.worlds.make``. Every world is examined as it is, where
nothing may be named, with ``--each`` conventions got wrong one at a time, and with two at once, all drawn by the
seed. Named is what is wrong, alone or among others that fit alike; of two, one of them is half; another name alone is
wrong. A world whose effect is a convention itself (a tracker's latency) may be named by it.
"""

import argparse
import json
import random
import time
import warnings
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from physid_drake.doctor import examined
from physid_drake.errors import PhysidError
from physid_drake.recording import Box, Cylinder, Prism
from physid_drake.recording.planar import turned
from physid_drake.recording.reading import read_recording


def hands(change):
    return lambda r: each(r, lambda p: replace(p, hand=replace(p.hand, **change(p.hand))))


def objects(change):
    return lambda r: each(r, lambda p: replace(p, object=replace(p.object, **change(p.object))))


def each(recording, change):
    return replace(recording, pushes=tuple(map(change, recording.pushes)))


def placed(matrix):
    return lambda stream: {"positions": stream.positions @ np.array(matrix).T}


def in_itself(stream):
    """The frame that is tracked lies 12 mm and -8 mm beside the object's middle."""
    shift = turned(stream.planar[:, 2], np.tile([0.012, -0.008], (len(stream), 1)))
    return {"positions": stream.positions + np.column_stack([shift, np.zeros(len(shift))])}


def shifted(stream):
    return {"positions": stream.positions + np.array([0.012, -0.006, 0.0])}


def w_last(stream):
    return {"quaternions": np.roll(stream.quaternions, -1, axis=1)}


def inverted(stream):
    return {"quaternions": stream.quaternions * np.array([1.0, -1.0, -1.0, -1.0])}


def quarter(stream):
    c = s = np.sqrt(0.5)
    w, x, y, z = stream.quaternions.T
    return {"quaternions": np.column_stack([w * c - z * s, x * c + y * s, y * c - x * s, z * c + w * s])}


def sized(factor):
    def change(recording):
        shape = recording.object.shape
        if isinstance(shape, Box):
            other = Box(size=(factor * shape.size[0], factor * shape.size[1], shape.size[2]))
        elif isinstance(shape, Cylinder):
            other = replace(shape, radius=factor * shape.radius)
        elif isinstance(shape, Prism):
            other = replace(shape, polygon=tuple((factor * x, factor * y) for x, y in shape.polygon))
        return replace(recording, object=replace(recording.object, shape=other))

    return change


def wide_tip(recording):
    return replace(recording, hand=replace(recording.hand, radius=2.0 * recording.hand.radius))


OWN = {"tracker_latency": "times are", "hand_lag": "times are", "hand_offset": "frame is off"}
MIRROR, SWAP = np.diag([1.0, -1.0, 1.0]), [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
WRONG = {
    "quaternions x, y, z, w": ("quaternions are x, y, z, w", objects(w_last)),
    "rotations inverted": ("turn the other way", objects(inverted)),
    "frame turned by 90 degrees": ("frame is turned by 270 degrees", objects(quarter)),
    "frame beside the middle": ("the middle of the object is", objects(in_itself)),
    "hand mirrored": ("of the hand, y is mirrored", hands(placed(MIRROR))),
    "hand swapped": ("of the hand, x and y are swapped", hands(placed(SWAP))),
    "object's places mirrored": ("but not of its rotations, y is mirrored", objects(placed(MIRROR))),
    "object's places swapped": ("but not of its rotations, x and y are swapped", objects(placed(SWAP))),
    "hand 100 ms late": ("ms too late", hands(lambda s: {"times": s.times + 0.1})),
    "hand 60 ms early": ("ms too early", hands(lambda s: {"times": s.times - 0.06})),
    "hand shifted": ("the hand's frame is off by", hands(shifted)),
    "hand in cm": ("hand's places are 100 times too large", hands(lambda s: {"positions": 100.0 * s.positions})),
    "object in mm": ("object's places are 1000 times too large", objects(lambda s: {"positions": 1e3 * s.positions})),
    "tip's diameter": ("tip's radius is a diameter", wide_tip),
    "half sizes": ("half", sized(0.5)),
    "twice the size": ("diameter|twice", sized(2.0)),
}  # fmt: skip


SAME = {
    frozenset(
        {"hand mirrored", "object's places mirrored"}
    ): "of both places, but not of the rotations, y is mirrored",
    frozenset(
        {"hand swapped", "object's places swapped"}
    ): "of both places, but not of the rotations, x and y are swapped",
}
"""Two of these that are one convention."""


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("proofs", type=Path, nargs="+", metavar="PROOF")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--each", type=int, default=2)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    counts, seconds = defaultdict(Counter), []
    for proof in given.proofs:
        for folder in sorted((proof / "recordings").iterdir()):
            recording = read_recording(folder)
            if recording.hand is None:
                continue
            truth = json.loads((proof / "sealed" / f"{folder.name}.json").read_text())
            own = [OWN[e["name"]] for e in truth.get("effects", []) if e["name"] in OWN]
            rng = random.Random(f"{given.seed} {folder.name}")
            tried = [
                (),
                *((name,) for name in rng.sample(list(WRONG), given.each)),
                tuple(rng.sample(list(WRONG), 2)),
            ]
            for names in tried:
                verdict, finding, took = judged(recording, names, own)
                seconds.append(took)
                label = "right" if not names else names[0] if len(names) == 1 else "two at once"
                counts[label][verdict] += 1
                print(folder.name, " + ".join(names) or "right", verdict, f"{took:.0f} s", finding, flush=True)
    Console(width=110).print(table(counts))
    print(f"CPU seconds: median {np.median(seconds):.0f}, most {max(seconds):.0f}")


def judged(recording, names, own=()):
    """Verdict, what was said, and CPU seconds."""
    wrong = recording
    try:
        for name in names:
            wrong = WRONG[name][1](wrong)
    except PhysidError as error:
        return "not read", str(error)[:80], 0.0
    begin = time.process_time()
    finding = examined(wrong)
    took = time.process_time() - begin
    said = [one.says for one in finding.better]
    words = [SAME[frozenset(names)]] if frozenset(names) in SAME else [WRONG[name][0] for name in names]
    hit = [s for s in said if all(any(w in s for w in one.split("|")) for one in words)]
    found = f"{finding.before and round(finding.before, 1)} -> {finding.after and round(finding.after, 1)} {said[:3]}"
    of_its_own = bool(said) and any(word in s for word in own for s in said)
    if not names:
        # Pushes that are called none are doubted, too.
        quiet = not finding.elsewhere and (not said or of_its_own)
        return ("left alone" if quiet else "wrong"), found, took
    if not said:
        small = finding.before is not None and finding.before < 5.0
        return ("too small to see" if small else "not found"), found, took
    half = len(names) > 1 and any(w in s for name in names for w in WRONG[name][0].split("|") for s in said)
    return ("named" if hit else "half" if half else "wrong"), found, took


def table(counts):
    kinds = ["named", "left alone", "too small to see", "not found", "half", "wrong", "not read"]
    shown = Table(title="conventions got wrong")
    shown.add_column("what is wrong")
    for kind in kinds:
        shown.add_column(kind, justify="right")
    for label in ["right", *WRONG, "two at once"]:
        if label in counts:
            shown.add_row(label, *(str(counts[label][kind] or "-") for kind in kinds))
    total = Counter()
    for label, one in counts.items():
        if label != "right":
            total += one
    shown.add_row("all that are wrong", *(str(total[kind] or "-") for kind in kinds))
    return shown


if __name__ == "__main__":
    main()
