"""One master under several faces: every experiment that `orchestrator list` finds has the same results
by the program, with every instance in a process of its own, and by the Python package, as an experiment
and, where the loop is direct, stepped in Python (`ClosedLoop`).

The page for browsers flies each of its controllers with the orchestrator's bits in test_browser.py.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from conftest import ROOT, TARGET, call, program
from conftest import results as recorded


FOLDER = ROOT / "orchestrator" / "experiments"
STOP = 0.4
# It flies the tasks of standard input, and writes the results of the package.
BY_PACKAGE = """
import json, sys
import numpy as np
from reentry_fmus import ClosedLoop, experiment
for path, out, stop in json.load(sys.stdin):
    run = experiment(path, stop=stop, out=out)
    parts, order = run.description["components"], run.description["simulation"]["order"]
    parameters = {f"{part}.{name}": value for part in parts for name, value in parts[part]["set"].items()}
    if order != ["controller", "plant"]:
        continue
    controller = parts["controller"]["fmu"].removesuffix(".fmu")
    step = run.description["simulation"]["step"]
    with ClosedLoop(controller=controller, step=step, parameters=parameters) as loop:
        table = loop.run(run.table.index[-1]).table
    shared = table.columns.intersection(run.table.columns)
    np.savez(f"{out}/loop.npz", names=list(shared), loop=table[shared], run=run.table[shared])
"""


def listed() -> list[Path]:
    rows = json.loads(call("list", "--json", FOLDER).stdout)
    assert not [row for row in rows if row["fault"]]
    return [Path(row["path"]) for row in rows if row["kind"] == "experiment"]


EXPERIMENTS = listed()


def named(path: Path) -> str:
    return path.resolve().relative_to(FOLDER).with_suffix("").as_posix()


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Folder of the results by face and experiment. It takes half a minute, as every experiment is flown by each of
    them: nothing else compares them."""
    folder = tmp_path_factory.mktemp("faces")

    def fly(face: str, path: Path, *arguments: str) -> None:
        out = folder / face / named(path)
        command = [program("orchestrator"), "run", path, "--out", out, "--fmu-dir", TARGET / "fmu"]
        command += ["--quiet", "--stop", str(STOP), *arguments]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            out.mkdir(parents=True, exist_ok=True)
            (out / "failed.txt").write_text(done.stderr)

    def fly_by_package() -> None:
        # The package as its wheel has it, from the sources and what is built.
        package = folder / "site" / "reentry_fmus"
        (package / "data").mkdir(parents=True)
        sources = (ROOT / "python" / "src" / "reentry_fmus").glob("*.py")
        parts = {"fmu": TARGET / "fmu", "experiments": FOLDER, "orchestrator": program("orchestrator")}
        for source in sources:
            (package / source.name).symlink_to(source)
        for name, part in parts.items():
            (package / "data" / name).symlink_to(part)
        tasks = [[str(path), str(folder / "package" / named(path)), STOP] for path in EXPERIMENTS]
        environment = {**os.environ, "PYTHONPATH": str(package.parent), "PYTHONWARNINGS": "ignore"}
        command = [sys.executable, "-c", BY_PACKAGE]
        done = subprocess.run(command, input=json.dumps(tasks), capture_output=True, text=True, env=environment)
        assert done.returncode == 0, done.stderr

    with ThreadPoolExecutor(2) as threads:
        begun = [threads.submit(fly_by_package)]
        for path in EXPERIMENTS:
            begun.append(threads.submit(fly, "program", path, "--isolate=false"))
            begun.append(threads.submit(fly, "isolated", path, "--isolate"))
        for one in begun:
            one.result()
    return folder


def results(folder: Path) -> tuple[bytes, dict, dict]:
    """The table, the metrics without computing times, and what the components were told."""
    failed = folder / "failed.txt"
    assert not failed.exists(), failed.read_text()
    metrics = json.loads((folder / "metrics.json").read_text())
    timed = ("solver_ms", "wall_s", "real_time_factor", "step_us")
    metrics = {name: value for name, value in metrics.items() if not name.startswith(timed)}
    described = json.loads((folder / "results.json").read_text())
    told = {name: [part["guid"], part["set"], part["parameters"]] for name, part in described["components"].items() if "guid" in part}
    return (folder / "results.csv").read_bytes(), metrics, told


@pytest.mark.skipif(os.name == "nt", reason="links need a right under Windows")
@pytest.mark.parametrize("path", EXPERIMENTS, ids=named)
@pytest.mark.parametrize("face", ["isolated", "package"])
def test_every_experiment_has_the_same_results_by_every_face(flown, face, path):
    expected = results(flown / "program" / named(path))
    assert expected[0].count(b"\n") > 2 and len(expected[1]) > 5 and expected[2]
    assert results(flown / face / named(path)) == expected


@pytest.mark.skipif(os.name == "nt", reason="links need a right under Windows")
def test_every_direct_loop_is_stepped_in_python_with_the_same_bits(flown):
    found = sorted((flown / "package").rglob("loop.npz"))
    assert len(found) >= 14
    for path in found:
        with np.load(path) as kept:
            assert len(kept["names"]) >= 12, path
            assert kept["loop"].tobytes() == kept["run"].tobytes(), path
        # The package has read the files that the program has written.
        name = path.parent.relative_to(flown / "package")
        rows = recorded(flown / "program" / name)
        with np.load(path) as kept:
            assert (rows[list(kept["names"])].to_numpy() == kept["run"]).all(), path
