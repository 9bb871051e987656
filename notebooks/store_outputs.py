"""Run notebooks and store what they print and draw: ``python notebooks/store_outputs.py [NAME ...]``, or all.

Outputs larger than ``MOST`` (pages of Meshcat) are left out, and paths of this machine are taken out.
"""

import re
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent
MOST = 300_000  # characters of one output
LEFT_OUT = "(Too large to be stored: run the cell to see it.)"


def stored(path: Path) -> nbformat.NotebookNode:
    """A notebook with the outputs of a run."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=900, kernel_name="python3", resources={"metadata": {"path": str(HERE)}}
    ).execute()
    for cell in notebook.cells:
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.outputs = [_small(output) for output in cell.outputs if output.get("name") != "stderr"]
    return notebook


def _small(output: nbformat.NotebookNode) -> nbformat.NotebookNode:
    text = nbformat.v4.writes(nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(outputs=[output])]))
    if len(text) > MOST:
        return nbformat.v4.new_output("stream", name="stdout", text=LEFT_OUT + "\n")
    if "text" in output:
        output["text"] = _without_paths(output["text"])
    for kind in ("text/plain", "text/html"):
        if kind in output.get("data", {}):
            output["data"][kind] = _without_paths(output["data"][kind])
    return output


def _without_paths(text: str) -> str:
    temporary = re.escape(tempfile.gettempdir())
    return re.sub(rf"({temporary}/\w+|{re.escape(str(HERE.parent))})/", "", text)


def main() -> None:
    """Those named, or all."""
    for name in sys.argv[1:] or sorted(path.stem for path in HERE.glob("*.ipynb")):
        path = HERE / f"{name}.ipynb"
        nbformat.write(stored(path), path)
        print(f"{name}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
