"""Every notebook runs headless from top to bottom, and is committed without outputs or machine paths."""

import os
import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))

every_notebook = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 2


@every_notebook
def test_a_notebook_opens_with_what_will_be_seen(path):
    assert re.match(r"\d\d_", path.name)
    first = nbformat.read(path, as_version=4).cells[0]
    assert first.cell_type == "markdown"
    assert first.source.startswith("# ")
    assert "What you will see" in first.source


@every_notebook
def test_a_notebook_holds_no_outputs_no_classes_and_no_machine_paths(path):
    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        assert not re.search(r"(/(home|work|tmp|Users)/|[A-Z]:\\)", cell.source)
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None
            assert not re.search(r"^\s*class ", cell.source, re.MULTILINE)
            assert len(cell.source.splitlines()) <= 40


@pytest.mark.slow
@every_notebook
def test_a_notebook_runs(path, monkeypatch):
    monkeypatch.setenv("DRAKE_DEPRECATION_RUNTIME_SEVERITY", "error")
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=900, kernel_name="python3", resources={"metadata": {"path": str(path.parent)}}
    ).execute()
    said = "\n".join(
        output.get("text", "") for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs
    )
    assert "Traceback" not in said
    assert "Deprecat" not in said
