"""Runs the notebooks and keeps them with their outputs and pictures: notebooks.py [NAME…]

The FMUs as they are shipped and the program must be built (`scripts/test`, `cargo build --release -p
orchestrator`).
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).absolute()
NOTEBOOKS = {path.stem: path for path in sorted(ROOT.glob("*/examples/*.ipynb"))}


def install(wheel: Path, folder: Path) -> Path:
    """Installs the package alone into a folder, for the Python that runs this."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    subprocess.run([*pip, "--target", folder, wheel], check=True)
    return folder


def run(path: Path, package: Path, folder: Path) -> nbformat.NotebookNode:
    """Runs a notebook in an empty folder, and returns it with its outputs. The first error ends it."""
    notebook = nbformat.read(path, as_version=4)
    place = folder / path.parent.relative_to(ROOT)
    place.mkdir(parents=True)
    for program in path.parent.glob("*.py"):
        shutil.copy(program, place)
    if path.is_relative_to(ROOT / "scripts"):
        (folder / "target").symlink_to(TARGET)
    # What a cell prints is one output, however long it takes, and when it was run is not kept.
    options = {"timeout": 300, "kernel_name": "python3", "coalesce_streams": True, "record_timing": False}
    client = NotebookClient(notebook, resources={"metadata": {"path": str(place)}}, **options)
    client.execute(env={**os.environ, "PYTHONPATH": str(package)})
    notebook.metadata.language_info = {"name": "python"}
    return notebook


def outputs(notebook: nbformat.NotebookNode) -> list[dict]:
    """Returns the outputs of all cells."""
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


def texts(notebook: nbformat.NotebookNode) -> list[str]:
    """Returns all that cells printed or showed as text."""
    found = []
    for output in outputs(notebook):
        found.append(output.get("text", ""))
        found += [text for kind, text in output.get("data", {}).items() if kind.startswith("text/")]
    return found


def main() -> None:
    names = sys.argv[1:] or list(NOTEBOOKS)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        fmus = TARGET / "dist" / "linux-x86_64" / "fmu"
        make = [ROOT / "scripts" / "wheel", "host", fmus, TARGET / "release" / "orchestrator", folder]
        subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        (wheel,) = folder.glob("*.whl")
        package = install(wheel, folder / "package")
        for name in names:
            nbformat.write(run(NOTEBOOKS[name], package, folder / name), NOTEBOOKS[name])


if __name__ == "__main__":
    main()
