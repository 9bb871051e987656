"""Kinds of inputs that are wrong on purpose, to see whether the fuzzer sees it."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import time
import warnings
from functools import partial

import numpy as np

from fuzz.case import Case
from physid_drake.errors import ConfigError


def refuse(text):
    raise ConfigError(text)


def fill():
    return np.ones(300_000_000)


def leak(folder):
    (folder / "copy.txt").write_bytes((folder.parent / "secret.txt").read_bytes())


def read_by_compiled_code(file):
    ctypes.CDLL(None).open(os.fsencode(file), os.O_RDONLY)


def unusual():
    return np.array([1e308]) * 10.0


def spoilt(folder):
    (folder / "given.txt").write_text("x")
    return Case(partial((folder / "given.txt").write_text, "changed"))


FAULTS = {
    "traceback": lambda folder: Case(partial(int, "x")),
    "hang": lambda folder: Case(partial(time.sleep, 60.0)),
    "crash": lambda folder: Case(os.abort),
    "exit": lambda folder: Case(partial(os._exit, 3)),
    "memory": lambda folder: Case(fill),
    "read outside": lambda folder: Case((folder.parent / "secret.txt").read_text),
    "read by compiled code": lambda folder: Case(partial(read_by_compiled_code, folder.parent / "secret.txt")),
    "listed outside": lambda folder: Case(partial(os.listdir, folder.parent)),
    "copied": lambda folder: Case(partial(leak, folder), may_read=(folder.parent / "secret.txt",)),
    "written outside": lambda folder: Case(partial((folder.parent / "new.txt").write_text, "x")),
    "removed outside": lambda folder: Case((folder.parent / "secret.csv").unlink),
    "changed": spoilt,
    "started": lambda folder: Case(partial(subprocess.run, [sys.executable, "--version"], check=False)),
    "foreign words": lambda folder: Case(partial(refuse, "Failure at geometry/x.cc:3")),
    "no words": lambda folder: Case(partial(refuse, " \n")),
    "odd warning": lambda folder: Case(partial(warnings.warn, "drake::x", UserWarning, 2)),
}
FINE = {
    "read": lambda folder: Case(partial((folder / "out.txt").write_text, "x")),
    "refused": lambda folder: Case(partial(refuse, "file 'x': is none.\n\x1b[2J")),
    "warning": lambda folder: Case(unusual),
}
KINDS = [(name, lambda rng, folder, make=make: make(folder)) for name, make in {**FAULTS, **FINE}.items()]
