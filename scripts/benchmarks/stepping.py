"""Speed at which importers step the same FMU and record all its outputs: the orchestrator, fmi-sim,
libcosim, FMPy. This is no test: times differ from machine to machine, so only the ratios of one run
count."""

from __future__ import annotations

import argparse
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import fmpy
from fmpy import simulate_fmu

import cosim
from conftest import TARGET, archive, program

STEP = 0.04


def orchestrator(path: Path, outputs: list[str], steps: int, folder: Path) -> None:
    experiment = folder / "x.toml"
    recorded = ", ".join(f'"component.{name}"' for name in outputs)
    experiment.write_text(
        f'title = "x"\n[simulation]\nstop = {steps * STEP!r}\nstep = {STEP}\n[components.component]\nfmu = "{path}"\n'
        f'unconnected = ["*"]\n[record]\nvariables = [{recorded}]\n'
    )
    command = [program("orchestrator"), "run", experiment, "--out", folder / "out", "--force", "--quiet"]
    subprocess.run(command, check=True)


def fmi_sim(path: Path, _outputs: list[str], steps: int, folder: Path) -> None:
    command = [TARGET / "bench-tools" / "bin" / "fmi-sim", "--model", path, "-o", folder / "x.csv", "-q", "co-simulation"]
    command += ["--step", str(STEP), "-n", "0", "-s", "0", "-f", repr(steps * STEP)]
    subprocess.run(command, check=True, capture_output=True)


def libcosim(path: Path, outputs: list[str], steps: int, _folder: Path) -> None:
    cosim.alone(path, STEP, steps, outputs)


def with_fmpy(path: Path, outputs: list[str], steps: int, _folder: Path) -> None:
    simulate_fmu(str(path), output=outputs, step_size=STEP, output_interval=STEP, stop_time=steps * STEP)


# The numbers of steps make all importers take about equally long.
IMPORTERS = {
    "orchestrator": (orchestrator, 500_000),
    "fmi-sim": (fmi_sim, 250_000),
    "FMPy": (with_fmpy, 100_000),
    "libcosim": (libcosim, 20_000),
}


def rate(run, path: Path, outputs: list[str], steps: int) -> float:
    """Steps per second, without the cost of a run that takes hardly any steps."""
    with tempfile.TemporaryDirectory() as folder:
        times = []
        for count in (10, steps):
            begin = time.perf_counter()
            run(path, outputs, count, Path(folder))
            times.append(time.perf_counter() - begin)
    return (steps - 10) / (times[1] - times[0])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=5, help="runs of each, of which the median counts")
    repeat = parser.parse_args().repeat
    for fmu in ("LQR", "ReentryPlant"):
        description = fmpy.read_model_description(str(archive(fmu)))
        outputs = [v.name for v in description.modelVariables if v.causality == "output" and v.type == "Real"]
        rates: dict[str, list[float]] = {name: [] for name in IMPORTERS}
        # The importers run in turns, so that other load on the machine affects all alike.
        for _ in range(repeat):
            for name, (run, steps) in IMPORTERS.items():
                rates[name].append(rate(run, archive(fmu), outputs, steps))
        medians = {name: statistics.median(values) for name, values in rates.items()}
        print(f"\n{fmu}, {len(outputs)} outputs recorded at every step of {STEP} s, median of {repeat}")
        for name, value in medians.items():
            ratio = value / medians["orchestrator"]
            print(f"  {name:<14}{value / 1e6:8.3f} million steps/s, {ratio:5.2f} of the orchestrator's")


if __name__ == "__main__":
    main()
