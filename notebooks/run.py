"""Runs every notebook in this folder from its first cell to its last; none keeps outputs. `run.py NAME...` runs some of them."""

import importlib.util
import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).resolve().parent
# Too large to be asked of everybody who runs the others.
OPTIONAL = ["torch", "sionna", "ns3"]


def main():
    chosen = sys.argv[1:] or sorted(path.stem for path in HERE.glob("*.ipynb"))
    for name in chosen:
        notebook = nbformat.read(HERE / f"{name}.ipynb", as_version=4)
        code = [cell for cell in notebook.cells if cell.cell_type == "code"]
        assert not any(cell.outputs or cell.execution_count for cell in code), f"{name}: expected no outputs in the repository"
        used = [module for module in OPTIONAL if any(f"import {module}" in c.source or f'("{module}")' in c.source for c in code)]
        missing = [module for module in used if importlib.util.find_spec(module) is None]
        if missing:
            print(f"{name}: skipped, for {' and '.join(missing)} cannot be imported")
            continue
        began = time.monotonic()
        NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": HERE}}).execute()
        print(f"{name}: {time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
