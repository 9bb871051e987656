"""The table of thresholds in docs/method.md says what the code does."""

import re
from importlib import import_module
from pathlib import Path

PAGE = Path(__file__).resolve().parents[2] / "docs" / "method.md"
ROWS = re.findall(r"^\| `([\w.]+)\.(\w+)` \| ([\d.]+) \|", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def test_every_row_is_the_codes():
    assert len(ROWS) > 20
    said = {f"{module}.{name}": float(value) for module, name, value in ROWS}
    assert len(said) == len(ROWS)
    assert said == {
        f"{module}.{name}": getattr(import_module(f"physid_drake.{module}"), name) for module, name, _ in ROWS
    }


def test_the_modules_that_decide_are_in_it_with_all_their_numbers():
    for module in ("diagnose.decide", "diagnose.conclude"):
        numbers = {n for n, v in vars(import_module(f"physid_drake.{module}")).items()
                   if n.isupper() and isinstance(v, int | float)}  # fmt: skip
        own = {name for where, name, _ in ROWS if where == module}
        imported = {name for where, name, _ in ROWS if where != module} | {"UNIT_SCATTER"}
        assert numbers - imported <= own
