"""Remains of loops and campaigns: memory, mappings, descriptors, child processes and
temporary files of this process, as Linux counts them.

As a program it measures 1,000 loops and 100 campaigns with a law, against those after the tenth:

    python python/tests/leaks.py [LOOPS CAMPAIGNS]
"""

import gc
import os
import sys
import tempfile
from pathlib import Path

from reentry_fmus import ClosedLoop, campaign
from reentry_fmus._data import experiment_path

CAMPAIGN = """
title = "Short"
experiment = "short.toml"
cases = 2
metrics = ["ems_deg"]

[[vary]]
parameter = "plant.disturbance.seed"
case = 1
"""


def footprint():
    """Counts what this process holds now, memory in MB. A folder of its own is part of it."""
    gc.collect()
    process = Path("/proc/self")
    memory = int((process / "statm").read_text().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6
    children = [
        number
        for task in (process / "task").iterdir()
        for number in (task / "children").read_text().split()
    ]
    temporary = Path(tempfile.gettempdir())
    return {
        "memory": memory,
        "mappings": len((process / "maps").read_text().splitlines()),
        "descriptors": len(list((process / "fd").iterdir())),
        "children": len(children),
        "folders": sum(1 for path in temporary.rglob("*") if path.is_dir()),
    }


def repeated(act, count, first):
    """Acts so often, and returns what is held after the first times and after all."""
    found = []
    for number in range(1, count + 1):
        act(number)
        if number in (first, count):
            found.append(footprint())
    return found


def loop(number):
    """Opens, steps and closes a loop, with a controller of the package in turn."""
    controllers = [None, "LQR", "FBL", "CRMPC"]
    controller = controllers[number % len(controllers)]
    with ClosedLoop(controller=controller) as loop:
        loop.step(None if controller else [0.0, 0.0, 0.0])


def law(state):
    """A law for the campaigns."""
    return [0.0, 0.0, 0.0]


def campaigns(folder):
    """Returns a function that flies a short campaign with a law."""
    (folder / "short.toml").write_text(
        f"title = 'LQR for 1 s'\nextends = '{experiment_path('lqr')}'\n[simulation]\nstop = 1.0\n"
    )
    (folder / "campaign.toml").write_text(CAMPAIGN)

    def fly(number):
        campaign(folder / "campaign.toml", law=law).run(out=folder / f"out-{number}")

    return fly


def main(loops=1000, flown=100):
    """Prints what is held after ten times, or half of all, and after all, one kind a line."""
    with tempfile.TemporaryDirectory() as temporary, tempfile.TemporaryDirectory() as place:
        tempfile.tempdir = temporary
        for name, act, count in (
            ("loops", loop, loops),
            ("campaigns with a law", campaigns(Path(place)), flown),
        ):
            if not count:
                continue
            first = min(10, count // 2)
            before, after = repeated(act, count, first)
            for kind, number in before.items():
                print(f"{name}: {kind} after {first}: {number:.5g}, after {count}: {after[kind]:.5g}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
