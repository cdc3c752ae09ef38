"""Holds the verdict of `orchestrator margins` against flights: a loop that it calls stable must come to
rest from a small start, one that it calls unstable must not. A refusal is no verdict, and is counted.

    PYTHONPATH=tests python scripts/oracles/margins_in_flight.py [OPTION…]

holds all delays of the plant's moment up to 1 s against flights of LQR and FBL.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from conftest import ROOT, TARGET, program

REST = ROOT / "orchestrator" / "experiments" / "margins" / "rest.toml"
# Rates at the start of a flight, deg/s, and its length, s: near its margin a loop takes minutes to show
# whether it grows.
START = 1e-5
STOP = 300.0
# Part of the start to which a flight must come to count as at rest, whatever rounding does with it then.
AT_REST = 1e-4


def call(command: str, experiment: Path, arguments: list[str]) -> subprocess.CompletedProcess:
    line = [program("orchestrator"), command, experiment, *arguments, "--fmu-dir", TARGET / "fmu"]
    return subprocess.run(line, capture_output=True, text=True, timeout=600)


def verdict(arguments: list[str], experiment: Path = REST) -> bool | str:
    """Whether the loop is stable by `margins`, or why it says nothing."""
    done = call("margins", experiment, ["--json", *arguments])
    found = json.loads(done.stdout)
    assert found.get("exit_code", 0) == done.returncode, done.stderr
    if "error" in found:
        assert found["error"] in done.stderr and done.returncode == 1, done.stderr
        return found["error"]
    return found["stable"]


def judged(arguments: list[str], experiment: Path = REST) -> tuple[bool | str, bool]:
    """The verdict on a loop, and whether a small motion decays in flight. The experiment asks for margins
    as metrics."""
    start = [f"plant.initial.{name}={rate * START} deg/s" for name, rate in zip("pqr", (1.3, 1.0, 0.7))]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, "run")
        more = [part for value in start for part in ("--set", value)]
        done = call("run", experiment, [*arguments, *more, "--stop", str(STOP), "--quiet", "--no-plot", "--out", out])
        if done.returncode != 0:
            assert done.returncode in (1, 3) and ("singular" in done.stderr or "lost" in done.stderr), done.stderr
            return verdict(arguments, experiment), False
        table = pd.read_csv(out / "results.csv", index_col="time")
        found = json.loads((out / "metrics.json").read_text())["margin_stable"]
    rates = table[[f"plant.rate.{name}" for name in "pqr"]].abs().max(axis=1)
    middle, end = (rates[(rates.index > a * STOP) & (rates.index <= b * STOP)].max() for a, b in ((0.4, 0.6), (0.8, 1.0)))
    decays = bool(end < max(middle, AT_REST * np.radians(START)))
    return verdict(arguments, experiment) if found is None else found, decays


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--laws", nargs="+", default=["LQR", "FBL"])
    parser.add_argument("--by", type=float, default=0.01, help="distance of the delays, s")
    parser.add_argument("--first", type=float, default=0.0, help="least delay, s")
    parser.add_argument("--last", type=float, default=1.0, help="longest delay, s")
    parser.add_argument("more", nargs="*", help="further arguments of the orchestrator, after --")
    asked = parser.parse_args()
    count = round((asked.last - asked.first) / asked.by)
    wrong, refused = [], []
    for law in asked.laws:
        for delay in (round(asked.first + k * asked.by, 6) for k in range(count + 1)):
            arguments = ["--fmu", f"controller={law}.fmu", "--set", f"plant.actuation.delay={delay}", *asked.more]
            found, decays = judged(arguments)
            case = f"{law}, {delay} s"
            if isinstance(found, str):
                refused.append(case)
                print(f"{case}: refused: {found}", flush=True)
                continue
            is_right = found == decays
            print(f"{case}: {'stable' if found else 'unstable'}{'' if is_right else ', FALSE'}", flush=True)
            wrong += [] if is_right else [case]
    print(f"{len(asked.laws) * (count + 1)} loops, {len(wrong)} false verdicts, {len(refused)} refused")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
