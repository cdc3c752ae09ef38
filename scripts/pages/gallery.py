"""Flies every experiment, and every controller on the scenario of Chai 2022, and keeps their plots.

    python scripts/pages/gallery.py OUT    # writes OUT/NAME.svg, with the programs and FMUs in target

The manual's gallery shows the plots (docs/site/stage.py).
"""

import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
EXPERIMENTS = ROOT / "orchestrator" / "experiments"
# An attitude that is lost, as two of the experiments show, is a result.
DONE = {0, 3}


class Picture(NamedTuple):
    file: str
    title: str
    arguments: list[str]


def experiments():
    """A picture of each experiment, by its folder. A file without a title is part of others."""
    found = {}
    for path in sorted(EXPERIMENTS.glob("*/*.toml")):
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        if path.parent.name in ("base", "campaigns") or path.stem == "study" or "title" not in table:
            continue
        folder = path.parent.name
        file = path.relative_to(ROOT).as_posix()
        found.setdefault(folder, []).append(Picture(f"{folder}-{path.stem}", table["title"], [file]))
    return found


def controllers():
    """A picture of each FMU that commands a moment, all of them on the same scenario."""
    names = []
    for path in sorted((ROOT / "fmu-controller" / "generated").glob("*.xml")):
        if re.search(r'name="moment\.x"[^>]*causality="output"', path.read_text(encoding="utf-8")):
            names.append(path.stem)
    scenario = "orchestrator/experiments/exchange/crmpc-2022.toml"
    return [Picture(name, name, [scenario, "--fmu", f"controller={name}.fmu"]) for name in names]


def program():
    found = [TARGET / profile / "orchestrator" for profile in ("release", "debug")]
    found = [path for path in found if path.is_file()]
    if not found:
        sys.exit("there is no orchestrator in target: run scripts/build-fmus")
    return max(found, key=lambda path: path.stat().st_mtime)


def fly(picture, out):
    with tempfile.TemporaryDirectory() as folder:
        command = [program(), "run", *picture.arguments, "--fmu-dir", TARGET / "fmu", "--out", f"{folder}/run", "--quiet"]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        plot = Path(folder, "run", "plot.svg")
        if done.returncode not in DONE or not plot.is_file():
            sys.exit(f"{' '.join(picture.arguments)}: exit code {done.returncode}, no plot\n{done.stderr}")
        (out / f"{picture.file}.svg").write_bytes(plot.read_bytes())


def main(out):
    out.mkdir(parents=True, exist_ok=True)
    pictures = [*controllers(), *(picture for group in experiments().values() for picture in group)]
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        list(threads.map(lambda picture: fly(picture, out), pictures))
    for file in out.glob("*.svg"):
        if file.stem not in {picture.file for picture in pictures}:
            file.unlink()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
