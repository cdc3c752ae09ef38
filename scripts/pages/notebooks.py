"""Runs the notebooks and keeps them with their outputs and pictures: notebooks.py [--check] [NAME…]

The FMUs as they are shipped and the program must be built (`scripts/test`, `cargo build --release -p
orchestrator`).
With --check nothing is written, and what differs is printed. Texts and tables must be the same; the
pictures may differ by what fonts and their smoothing make.
"""

from __future__ import annotations

import base64
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import nbformat
import numpy as np
from matplotlib.image import imread
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[2]
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).absolute()
NOTEBOOKS = {
    path.stem: path
    for path in sorted([*ROOT.glob("python/examples/*.ipynb"), *ROOT.glob("scripts/examples/*.ipynb")])
}
# Bytes of a notebook, and of one picture.
LARGEST, LARGEST_PICTURE = 500_000, 150_000
# Largest part of the pixels that may differ, and by how much all may differ on average.
DIFFERENT, ON_AVERAGE = 0.05, 0.01


def install(wheel: Path, folder: Path) -> Path:
    """Installs the package alone into a folder, for the Python that runs this."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    subprocess.run([*pip, "--target", folder, wheel], check=True)
    return folder


def run(path: Path, package: Path, folder: Path) -> nbformat.NotebookNode:
    """Runs a notebook in an empty folder, and returns it with its outputs."""
    notebook = nbformat.read(path, as_version=4)
    place = folder / path.parent.relative_to(ROOT)
    place.mkdir(parents=True)
    for program in path.parent.glob("*.py"):
        shutil.copy(program, place)
    if path.is_relative_to(ROOT / "scripts"):
        (folder / "target").symlink_to(TARGET)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    before = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = str(package)
    try:
        where = {"metadata": {"path": str(place)}}
        # What a cell prints is one output, however long it takes.
        options = {"timeout": 300, "kernel_name": "python3", "coalesce_streams": True}
        client = NotebookClient(notebook, resources=where, **options)
        client.execute()
    finally:
        os.environ.pop("PYTHONPATH")
        if before is not None:
            os.environ["PYTHONPATH"] = before
    for cell in notebook.cells:
        # When cells were run differs from run to run.
        cell.metadata.pop("execution", None)
    notebook.metadata.language_info = {"name": "python"}
    return notebook


def outputs(notebook: nbformat.NotebookNode) -> list[list[dict]]:
    """Returns the outputs of each cell of code."""
    return [list(cell.outputs) for cell in notebook.cells if cell.cell_type == "code"]


def differences(kept: nbformat.NotebookNode, fresh: nbformat.NotebookNode) -> list[str]:
    """Lists the outputs that differ, by the number of the cell."""
    found = []
    for number, (before, after) in enumerate(zip(outputs(kept), outputs(fresh), strict=True), start=1):
        if [kinds(output) for output in before] != [kinds(output) for output in after]:
            found.append(f"cell {number}: other outputs")
            continue
        for one, other in zip(before, after, strict=True):
            if one.get("text") != other.get("text"):
                found.append(f"cell {number}: printed {other['text']!r}, and {one['text']!r} before")
            for kind, content in one.get("data", {}).items():
                if not is_same(kind, content, other["data"][kind]):
                    found.append(f"cell {number}: another {kind}")
    return found


def kinds(output: dict) -> tuple[str, list[str]]:
    return output["output_type"], sorted(output.get("data", {}))


def is_same(kind: str, one: str, other: str) -> bool:
    if kind != "image/png":
        return one == other
    pictures = [imread(io.BytesIO(base64.b64decode(text)), format="png") for text in (one, other)]
    # Fonts of another size move the frame by a pixel or two.
    if any(abs(a - b) > 3 for a, b in zip(pictures[0].shape, pictures[1].shape, strict=True)):
        return False
    rows, columns = np.min([picture.shape[:2] for picture in pictures], axis=0)
    apart = np.abs(pictures[0][:rows, :columns] - pictures[1][:rows, :columns]).max(axis=2)
    return bool((apart > 0.1).mean() <= DIFFERENT and apart.mean() <= ON_AVERAGE)


def faults(notebook: nbformat.NotebookNode, path: Path) -> list[str]:
    """Lists what must not be in a notebook that is kept."""
    found = []
    text = nbformat.writes(notebook)
    if len(text) > LARGEST:
        found.append(f"{len(text)} bytes, but at most {LARGEST} are wanted")
    if match := re.search(r"(/tmp|/home|/root|C:\\\\)[^\s\"]*", "".join(texts(notebook))):
        found.append(f"a path of this machine: {match[0]}")
    for number, cell in enumerate(outputs(notebook), start=1):
        for output in cell:
            if output["output_type"] == "error" or output.get("name") == "stderr":
                found.append(f"cell {number}: an error or a warning")
            for kind, content in output.get("data", {}).items():
                if kind.startswith("image/") and len(content) > LARGEST_PICTURE:
                    found.append(f"cell {number}: a picture of {len(content)} bytes")
    if not any(outputs(notebook)):
        found.append("no outputs: run scripts/pages/notebooks.py")
    return [f"{path.name}: {fault}" for fault in found]


def texts(notebook: nbformat.NotebookNode) -> list[str]:
    """Returns all that cells printed or showed as text."""
    found = []
    for output in (output for cell in outputs(notebook) for output in cell):
        found.append(output.get("text", ""))
        found += [text for kind, text in output.get("data", {}).items() if kind.startswith("text/")]
    return found


def main() -> int:
    is_check = "--check" in sys.argv[1:]
    names = [name for name in sys.argv[1:] if not name.startswith("-")] or list(NOTEBOOKS)
    if unknown := sorted(set(names) - set(NOTEBOOKS)):
        print(f"there is no notebook {unknown[0]}; there are: {', '.join(NOTEBOOKS)}", file=sys.stderr)
        return 2
    problems = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        fmus = TARGET / "dist" / "linux-x86_64" / "fmu"
        make = [ROOT / "scripts" / "wheel", "host", fmus, TARGET / "release" / "orchestrator", folder]
        subprocess.run(make, check=True, stdout=subprocess.DEVNULL)
        (wheel,) = folder.glob("*.whl")
        package = install(wheel, folder / "package")
        for name in names:
            path = NOTEBOOKS[name]
            kept = nbformat.read(path, as_version=4)
            fresh = run(path, package, folder / name)
            problems += faults(kept if is_check else fresh, path)
            if is_check:
                problems += [f"{path.name}: {text}" for text in differences(kept, fresh)]
            elif differences(kept, fresh):
                nbformat.write(fresh, path)
                print(path.relative_to(ROOT))
    print("".join(f"{problem}\n" for problem in problems), end="", file=sys.stderr)
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
