"""The page for Python runs as it stands."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_page_for_python_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "recordings").symlink_to(PROJECT / "recordings")
    monkeypatch.chdir(tmp_path)
    failures, tests = doctest.testfile(
        str(PROJECT / "docs/from_python.md"), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE
    )
    assert tests > 10 and failures == 0
    page = (tmp_path / "sealed_01.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>") and "anisotropic_table" in page
