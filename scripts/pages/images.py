"""Redraws the pictures of docs/images that are the program's own: images.py STUDIES

STUDIES holds a folder for each study, as `orchestrator reproduce STUDY --out STUDIES/STUDY` writes it. The flights are
flown here, with the program and the FMUs that scripts/build-fmus makes.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TARGET = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
PROGRAM = TARGET / "release" / "orchestrator"
IMAGES = ROOT / "docs" / "images"
STUDIES = {
    "crmpc-2022-delays": "crmpc-2022/figures/delays",
    "crmpc-2022-guarantee-map": "crmpc-2022/figures/guarantee-map",
    "crmpc-2022-trade": "crmpc-2022/figures/trade",
    "crmpc-2022-tube": "crmpc-2022/figures/fig-6-worst",
    "reversal": "reversal/figures/step",
    "tvsmc-2015-angles": "tvsmc-2015/figures/fig-3",
    "tvsmc-2015-biases": "tvsmc-2015-biases/figures/errors",
    "two-loop-moments": "two-loop-smc/figures/moments",
}
FLIGHTS = {"crmpc-robust": "crmpc-robust", "entry": "from-120km"}


def call(*arguments):
    subprocess.run([PROGRAM, *arguments, "--fmu-dir", TARGET / "fmu"], cwd=ROOT, check=True, stdout=subprocess.DEVNULL)


def main(studies: Path) -> None:
    for name, figure in STUDIES.items():
        shutil.copyfile(studies / f"{figure}.svg", IMAGES / f"{name}.svg")
    with tempfile.TemporaryDirectory() as folder:
        for name, experiment in FLIGHTS.items():
            call("run", experiment, "--quiet", "--out", f"{folder}/{name}")
            shutil.copyfile(f"{folder}/{name}/plot.svg", IMAGES / f"{name}.svg")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
