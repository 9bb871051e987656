"""A process that runs one input after the other and says so before and after each: ``python -m fuzz.worker``.

Its words are lines of JSON on a descriptor of their own, since what is run may print.
"""

from __future__ import annotations

import faulthandler
import json
import os
import resource
import shutil
import sys
import tempfile
import warnings
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from random import Random
from typing import Final

import numpy as np

from fuzz.case import Case
from fuzz.judge import Verdict, judged
from fuzz.watch import Watch, lay_out
from physid_drake.effects import known_effects

MOST_MEMORY: Final = 2_000_000_000
"""Bytes that the process may have, whatever it is given."""
Maker = Callable[[Random, Path], Case]


def main() -> None:
    """Run the inputs that the words on the command line, one JSON object, say."""
    asked = json.loads(sys.argv[1])
    out = os.fdopen(asked["descriptor"], "w", buffering=1)
    faulthandler.enable()
    kinds: list[tuple[str, Maker]] = getattr(import_module(asked["module"]), asked["table"])
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEMORY, resource.RLIM_INFINITY))
    known_effects()  # looks at what is installed, once, before anybody watches what is read
    watch = Watch()
    for index in asked["indices"]:
        kind, make = kinds[index % len(kinds)]
        print(json.dumps({"begin": index, "kind": kind}), file=out)
        verdict = one(watch, kind, make, asked["seed"], index, Path(asked["scratch"]), keep=asked["keep"])
        print(json.dumps({"end": index, "kind": kind, "memory": memory(), **vars(verdict)}), file=out)
        if verdict.group == MEMORY:
            return  # what it took is not given back


MEMORY: Final = "more than 2 GB of memory"


def one(watch: Watch, kind: str, make: Maker, seed: int, index: int, scratch: Path, *, keep: bool = False) -> Verdict:
    """Make one input from seed and index, run it, and look at what it left."""
    base = Path(tempfile.mkdtemp(prefix=f"{kind}_{index}_", dir=scratch))
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of what makes it
            case = make(Random(f"{seed} {index}"), lay_out(base))
        with watch.over(base, case) as seen:
            verdict = judged(case)
        if seen:
            verdict = Verdict("fault", "outside: " + seen[0].split(":")[0], "; ".join(seen)[:1000], verdict.traceback)
        elif memory() > MOST_MEMORY:
            verdict = Verdict("fault", MEMORY, verdict.text)
    finally:
        if not keep:
            shutil.rmtree(base, ignore_errors=True)
    return verdict


def memory() -> int:
    """The most that this process has had [bytes]."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


if __name__ == "__main__":
    main()
