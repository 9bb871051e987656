"""The pages for Python run as they stand."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_pages_for_python_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "recordings").symlink_to(PROJECT / "recordings")
    monkeypatch.chdir(tmp_path)
    for name in ("from_python.md", "model.md"):  # the second begins with what the first saved
        failures, tests = doctest.testfile(
            str(PROJECT / "docs" / name), module_relative=False, optionflags=doctest.NORMALIZE_WHITESPACE
        )
        assert tests > 10 and failures == 0
    page = (tmp_path / "sealed_01.html").read_text(encoding="utf-8")
    assert page.startswith("<!DOCTYPE html>") and "anisotropic_table" in page
