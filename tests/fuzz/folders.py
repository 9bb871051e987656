"""Folders of results: what says whose they are, what a run goes on from, and files of somebody else's in them."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from fuzz import seeds
from fuzz.case import Case, WrongError
from fuzz.damage import damaged, replaced
from fuzz.trees import json_text, mutated
from physid_drake.belief import Belief
from physid_drake.pushes.kept_rollouts import KeptRollouts, key_of
from physid_drake.run_folder import RunFolder
from physid_drake.run_plan import _learnt

COMMAND, SETTINGS = "diagnose", "settings.json"
STATE, RESULTS = ("rollouts.bin",), ("diagnosis.json", "diagnosis.html", "model.yaml")
OWN = (SETTINGS, *STATE, *RESULTS)
FOREIGN = ("notes.txt", "page.html", "diagnosis.json", "model.yaml", "sub/page.html", "settings.json",
           "rollouts.bin",
           "config.yaml", "\x1b[2J", "x" * 200, "manifest.json.bak", "a b",
           "push.csv")  # fmt: skip


def make(rng: Random, folder: Path) -> Case:
    """One of four things that are kept in a folder."""
    return rng.choice((_run, _run, _belief, _rollouts, _answers, _numbers))(rng, folder)


def _run(rng: Random, folder: Path) -> Case:
    """A folder that a command goes on in, though its manifest is changed or files that are not its own are there."""
    out = folder / "out"
    out.mkdir()
    listed = [SETTINGS, *rng.sample(RESULTS, rng.randrange(4)), *rng.sample(STATE, rng.randrange(2))]
    manifest: Any = {"format": "physid-folder/1", "command": COMMAND, "files": sorted(listed)}
    for name in listed:
        (out / name).write_text(f"{name}, ours\n")
    if rng.random() < 0.6:
        manifest = mutated(rng, manifest, "json")
    content = json_text(manifest).encode("utf-8", "surrogatepass")
    (out / "manifest.json").write_bytes(damaged(rng, content) if rng.random() < 0.3 else content)
    for name in rng.sample(FOREIGN, rng.randrange(4)):
        if name not in listed:
            (out / name).parent.mkdir(exist_ok=True)
            (out / name).write_bytes(os.urandom(0) + b"somebody's\n")
    what = rng.random()
    if what < 0.1:
        replaced(rng, out / "manifest.json")
    elif what < 0.25:
        replaced(rng, out / rng.choice((*OWN, ".lock")))
    elif what < 0.3:
        (out / "manifest.json").unlink()
    # What the manifest lists may go, whoever wrote it there.
    named = [one for one in OWN if f'"{one}"' in _text(out / "manifest.json")]
    case = partial(_go_on, out, claim=rng.random() < 0.3)
    return Case(case, may_change=(*(f"out/{one}" for one in named), "out/manifest.json", "out/.lock"))


def _text(file: Path) -> str:
    """The text of a file, or of what stands there for it."""
    if not file.is_file() or file.stat().st_size > 1_000_000:
        return ""
    return file.read_bytes().decode("utf-8", "replace")


def _go_on(out: Path, *, claim: bool) -> None:
    if claim:
        opened = RunFolder.claim(out, COMMAND, '{"seed": 0}\n', name=SETTINGS)
    else:
        opened = RunFolder.open(out, COMMAND, '{"seed": 0}\n', name=SETTINGS, state=STATE, results=RESULTS)
    with opened as folder:
        for name in RESULTS:
            folder.holds(name)
            folder.read(name)
            folder.write(name, "new\n")
        folder.own("rollouts.bin")
        folder.forget("rollouts.bin")


def _belief(rng: Random, folder: Path) -> Case:
    """A belief whose bytes are damaged, or whose arrays or header are others."""
    file = folder / "belief.npz"
    if rng.random() < 0.4:
        file.write_bytes(damaged(rng, seeds.belief()))
    else:
        file.write_bytes(seeds.belief())
        with np.load(file) as loaded:
            arrays = {name: loaded[name] for name in loaded.files}
        if rng.random() < 0.5:
            header = mutated(rng, json.loads(str(arrays["header"])), "json")
            arrays["header"] = np.array(json_text(header).encode("utf-8", "replace").decode())
        else:
            arrays = changed_arrays(rng, arrays)
        file.write_bytes(seeds.npz(arrays, packed=rng.random() < 0.5))
    if rng.random() < 0.03:
        replaced(rng, file)
    return Case(partial(_restore, file))


def _restore(file: Path) -> None:
    try:
        belief = Belief.from_npz(file)
    except FileNotFoundError:  # as it promises
        return
    belief.to_npz(file.with_name("again.npz"))
    Belief.from_npz(file.with_name("again.npz"))
    belief.update(belief.candidates[:1], [1.0], np.random.default_rng(0))


def changed_arrays(rng: Random, arrays: dict[str, Any]) -> dict[str, Any]:
    """One or two arrays of another kind, shape or value."""
    arrays = dict(arrays)
    for _ in range(rng.choice((1, 1, 2))):
        name = rng.choice(list(arrays))
        one = arrays[name]
        match rng.randrange(9):
            case 0:
                arrays.pop(name)
                if not arrays:
                    return {"x": np.zeros(1)}
            case 1:
                kind = rng.choice(("f4", "i8", "U20", "c16", "bool", "S10", "u1", ">f8", "f2"))
                with suppress(ValueError):  # a word is no number
                    arrays[name] = one.astype(kind, casting="unsafe")
            case 2:
                arrays[name] = np.resize(one, rng.choice(((0,), (1,), (7,), (2, 2), (3, 13), (0, 13), (), (1, 1, 1))))
            case 3 if one.dtype.kind == "f" and one.size:
                flat = one.copy().ravel()
                flat[rng.randrange(flat.size)] = rng.choice(
                    (np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-320, 0.0, -1.0, 1e6)
                )
                arrays[name] = flat.reshape(one.shape)
            case 4 if one.dtype.kind in "fi" and one.size:
                arrays[name] = one * rng.choice((0, -1, 2, 1000))
            case 5 if one.ndim:
                arrays[name] = one[: rng.choice((0, 1, 2))]
            case 6 if one.ndim and one.size < 10_000:
                arrays[name] = np.concatenate([one] * rng.choice((2, 50)))
            case 7:
                arrays[rng.choice(("x", "../x", "/x", "header", name + ".npy", ""))] = one
            case _:
                arrays[name] = rng.choice((np.array("x"), np.zeros((2, 0)), np.array(-1), np.array([2**62, 2**62])))
    return arrays


def _rollouts(rng: Random, folder: Path) -> Case:
    file = folder / "rollouts.bin"
    content = seeds.rollouts()
    file.write_bytes(damaged(rng, content) if rng.random() < 0.9 else content)
    if rng.random() < 0.05:
        replaced(rng, file)
    return Case(partial(_keep, file), may_change=("rollouts.bin", "moved here"))


def _keep(file: Path) -> None:
    kept = KeptRollouts(file)
    kept.keep({key_of("new"): None})
    if key_of("new") not in kept:
        raise WrongError("a rollout was not kept")


def _answers(rng: Random, folder: Path) -> Case:
    """What ``plan`` reads beside the model."""
    name, tree = rng.choice((("diagnosis.json", seeds.diagnosis()), ("result.json", seeds.result())))
    content = json_text(mutated(rng, tree, "json")).encode("utf-8", "surrogatepass")
    (folder / name).write_bytes(damaged(rng, content) if rng.random() < 0.3 else content)
    if rng.random() < 0.05:
        replaced(rng, folder / name)
    return Case(partial(_learnt, folder))


def _numbers(rng: Random, folder: Path) -> Case:
    """A belief in an archive that claims more than it holds."""
    import io
    import zipfile

    stream = io.BytesIO()
    with zipfile.ZipFile(
        stream, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA))
    ) as z:
        for name in ("header", "candidates", rng.choice(("thetas", "../x", "/etc/x", "a\nb", ""))):
            shape = rng.choice(
                ("(3,)", "(1000000000000,)", "(0,)", "(-1,)", "()", "(2, 2)", "3", "(1e3,)", "('a',)", "(2**40,)")
            )
            descr = rng.choice(
                ("'<f8'", "'<f8'", "'O'", "'|S10'", "[('a', '<f8')]", "'<U5'", "'<M8[s]'", "'V8'", "'x'", "None")
            )
            order = rng.choice(("False", "True", "2"))
            head = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}"
            head = head.ljust(117 if rng.random() < 0.9 else 60_000) + "\n"
            body = (
                b"\x93NUMPY"
                + rng.choice((b"\1\0", b"\2\0", b"\3\0", b"\x09\0"))
                + len(head).to_bytes(2, "little")
                + head.encode()
            )
            z.writestr(name + ".npy", body + b"\0" * rng.choice((0, 24, 24, 24, 24, 100, 5_000_000)))
    content = stream.getvalue()
    file = folder / "belief.npz"
    file.write_bytes(damaged(rng, content) if rng.random() < 0.2 else content)
    return Case(partial(_restore, file))
