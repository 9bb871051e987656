"""Folders of proofs: truths, seals, attempts and answers that somebody changed since they were written."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from random import Random

from fuzz import seeds
from fuzz.case import Case
from fuzz.damage import damaged, replaced
from fuzz.trees import json_text, mutated
from physid_drake.validation.report.proof import proof_json, proof_markdown, proof_tables
from physid_drake.validation.run_prove import opened
from physid_drake.validation.scoring.score import read_outcomes
from physid_drake.validation.sealing.seal import check_seal, read_seal, seal_of, sealed_names
from physid_drake.validation.sealing.secret import Secret, settled_secret

WORLDS = 2
SECRET = Secret(salt="0" * 64, seed=7)


def make(rng: Random, folder: Path) -> Case:
    """An opened proof of two worlds, of which one file is changed; often its seal is made to fit."""
    names = SECRET.names(WORLDS)
    out = folder / "proof"
    files = {"sealed/secret.json": {"salt": SECRET.salt, "seed": SECRET.seed, "kind": None, "effect": None}}
    for name in names:
        files[f"sealed/{name}.json"] = seeds.truth(name)
        files[f"diagnoses/{name}/diagnosis.json"] = seeds.diagnosis()
        files[f"diagnoses/{name}/attempt.json"] = {"seconds": 12.5, "error": None, "hidden_by": "a namespace"}
    changed = rng.choice([*files, *(one for one in files if one.startswith("diagnoses")), "seal.txt", "seal.sha256"])
    contents = {name: json.dumps(tree).encode() for name, tree in files.items()}
    if changed in files:
        tree = mutated(rng, files[changed], "json") if rng.random() < 0.85 else files[changed]
        contents[changed] = json_text(tree).encode("utf-8", "surrogatepass")
    seeds.lay(out, contents)
    (out / "recordings").mkdir()
    total = seal_of(out / "sealed", names)
    lines = "".join(f"{_digest(out / 'sealed' / f'{name}.json')}  sealed/{name}.json\n" for name in sorted(names))
    seeds.lay(out, {"seal.txt": lines.encode(), "seal.sha256": f"{total}\n".encode()})
    if changed.startswith("seal.") or rng.random() < 0.15:
        (out / changed).write_bytes(damaged(rng, (out / changed).read_bytes()))
    if rng.random() < 0.04:
        replaced(rng, out / changed, secret=None)
    return Case(partial(_open, out))


def _digest(file: Path) -> str:
    import hashlib

    return hashlib.sha256(file.read_bytes()).hexdigest()


def _open(out: Path) -> None:
    seal = read_seal(out)
    sealed_names(out)
    secret = settled_secret(out, None, None)
    check_seal(out, seal)
    read_outcomes(out / "sealed", out / "diagnoses", secret.names(WORLDS))
    proof = opened(out, secret.names(WORLDS), seal, secret)
    proof_json(proof)
    proof_markdown(proof)
    proof_tables(proof)
