"""Plants faults in campaigns whose probability is known: python tests/relations/faults.py COUNT FOLDER.

Each trial plants one fault that says nothing about the unit that is flown: in its library, in the parts that are kept, or in the
processes that fly. The command must then either end with an error that names the fault, without any probability, or give the
probability and the table of the campaign without a fault. Once the fault is repaired, the same command must do the latter."""

from __future__ import annotations

import json
import random
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MODEL = ROOT / "orchestrator" / "tests" / "model"

EXPERIMENT = """
title = "gain and integrator"
simulation = { stop = 3.0, step = 1.0, order = ["gain", "plant"] }
components.gain.fmu = "Model.fmu"
components.plant.fmu = "Model.fmu"
connections = [{ from = "plant.output.integral", to = "gain.input" }, { from = "gain.output.direct", to = "plant.input" }]
record.variables = ["plant.output.integral"]
"""
# The integrator has the value (1 + gain)^3 at the end, and one flight in five fails by an answer of the unit.
CAMPAIGN = """
title = "gains"
experiment = "loop.toml"
cases = 60
seed = {seed}
signals.out = ["plant.output.integral"]
measure = [{{ id = "last", kind = "last", signals = "out" }}]
limit = [{{ id = "small", measure = "last", at_most = 4.0 }}]
vary = [
    {{ parameter = "gain.gain", uniform = [0.0, 1.0] }},
    {{ parameter = "plant.fail.time", list = [1e9, 2.0], weights = [4.0, 1.0] }},
    {{ parameter = "gain.pause", uniform = [0.0, 0.002] }},
    {{ parameter = "plant.noise.seed", case = 1 }},
]
"""
SEEDS = range(1, 9)


class Wrong(Exception):
    """Misbehaviour of a campaign."""


def library(target: Path, *flags: str) -> Path:
    """Compiles the unit."""
    command = ["cc", "-shared", "-fPIC", "-O1", "-w", "-o", target, MODEL / "model.c", *flags]
    subprocess.run(command, check=True, capture_output=True)
    return target


def pack(target: Path, library: Path, platform: str = "linux64", ending: str = "so") -> Path:
    with zipfile.ZipFile(target, "w") as archive:
        archive.write(MODEL / "modelDescription.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{platform}/model.{ending}")
    return target


def units(folder: Path) -> dict[str, Path]:
    """The unit as it should be, and with each fault of its library."""
    sound = library(folder / "sound.so")
    (folder / "gone.c").write_text("int gone(void) { return 1; }\n")
    gone = folder / "libgone.so"
    subprocess.run(["cc", "-shared", "-fPIC", folder / "gone.c", "-o", gone], check=True)
    lonely = library(folder / "lonely.so", "-Wl,--no-as-needed", f"-L{folder}", "-lgone")
    gone.unlink()
    cut = folder / "cut.so"
    cut.write_bytes(sound.read_bytes()[:6000])
    crashes = library(folder / "crashes.so", "-DPLACE=STEP", "-DHOW=SEGFAULT")
    endless = library(folder / "endless.so", "-DPLACE=INITIALIZE", "-DHOW=ENDLESS")
    made = {"sound": sound, "lonely": lonely, "cut": cut, "crashes": crashes, "endless": endless}
    packed = {name: pack(folder / f"{name}.fmu", path) for name, path in made.items()}
    return packed | {"windows": pack(folder / "windows.fmu", sound, "win64", "dll")}


@dataclass
class Bench:
    """Campaigns without a fault, to compare with."""

    program: Path
    folder: Path
    units: dict[str, Path] = field(default_factory=dict)
    truths: dict[int, tuple[bytes, dict]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.units = units(self.folder)
        for seed in SEEDS:
            trial = Trial(self, self.folder / f"seed-{seed}", seed)
            self.truths[seed] = trial.result(trial.call())

    def parts(self, seed: int) -> Path:
        return self.folder / f"seed-{seed}" / "out" / "c" / "parts"


class Trial:
    """A campaign in a folder of its own."""

    def __init__(self, bench: Bench, folder: Path, seed: int) -> None:
        self.bench, self.folder, self.seed = bench, folder, seed
        folder.mkdir()
        (folder / "loop.toml").write_text(EXPERIMENT)
        (folder / "c.toml").write_text(CAMPAIGN.format(seed=seed))
        self.fly_with("sound")

    def fly_with(self, unit: str) -> None:
        shutil.copy(self.bench.units[unit], self.folder / "Model.fmu")

    def command(self, *more: str) -> list[str]:
        return [str(self.bench.program), "campaign", "c.toml", "--jobs", "2", *more]

    def start(self, *more: str) -> subprocess.Popen:
        pipe = subprocess.PIPE
        return subprocess.Popen(self.command(*more), cwd=self.folder, stdout=pipe, stderr=pipe, text=True)

    def call(self, *more: str, around: tuple[str, ...] = ()) -> subprocess.CompletedProcess:
        """Flies the campaign; in one process, which is faster, unless more is said."""
        command = [*around, *self.command(*more or ("--isolate=false",))]
        return subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=300, check=False)

    def keep(self, seed: int) -> list[Path]:
        """Takes over the parts of a campaign without a fault."""
        target = self.folder / "out" / "c" / "parts"
        shutil.copytree(self.bench.parts(seed), target)
        return sorted(target.iterdir())

    def result(self, done: subprocess.CompletedProcess) -> tuple[bytes, dict]:
        if done.returncode != 0:
            raise Wrong(f"code {done.returncode}: {done.stderr}")
        out = self.folder / "out" / "c"
        return (out / "cases.parquet").read_bytes(), json.loads((out / "summary.json").read_text())

    def must_be_told(self, done: subprocess.CompletedProcess, code: int, *words: str) -> None:
        """The command ended with an error that says why, and there is no probability."""
        if done.returncode != code or not any(word in done.stderr for word in words):
            raise Wrong(f"code {done.returncode}, {words} not told: {done.stdout}{done.stderr}")
        if "probability" in done.stdout or (self.folder / "out" / "c" / "summary.json").exists():
            raise Wrong(f"a probability in spite of the fault: {done.stdout}")

    def must_be_true(self, done: subprocess.CompletedProcess, *words: str) -> None:
        """The command gave the results of the campaign without a fault, and said what was flown again."""
        if self.result(done) != self.bench.truths[self.seed]:
            raise Wrong(f"other results: {done.stdout}")
        if words and not any(word in done.stdout for word in words):
            raise Wrong(f"{words} not told: {done.stdout}")


def bad_library(unit: str, code: int, *words: str, options: tuple[str, ...] = (), limits: str = "") -> Callable[[Trial, random.Random], None]:
    def fault(trial: Trial, _: random.Random) -> None:
        trial.fly_with(unit)
        (trial.folder / "loop.toml").write_text(EXPERIMENT + limits)
        trial.must_be_told(trial.call(*options), code, *words)

    return fault


def noexec(trial: Trial, _: random.Random) -> None:
    """Nothing in the temporary folder may be loaded as a library."""
    temporary = trial.folder / "temporary"
    temporary.mkdir()
    script = 'mount -t tmpfs -o noexec none "$0" && TMPDIR="$0" exec "$@"'
    done = trial.call(around=("unshare", "-rm", "sh", "-c", script, str(temporary)))
    trial.must_be_told(done, 2, "may not be run (noexec)", "failed to map")


def no_folder(trial: Trial, _: random.Random) -> None:
    """The archive cannot be unpacked."""
    done = trial.call(around=("env", f"TMPDIR={trial.folder}/nowhere"))
    trial.must_be_told(done, 1, "No such file")


def foreign_part(trial: Trial, chance: random.Random) -> None:
    """A part of a campaign with another seed."""
    part = chance.choice(trial.keep(trial.seed))
    other = chance.choice([seed for seed in SEEDS if seed != trial.seed])
    shutil.copy(trial.bench.parts(other) / part.name, part)
    trial.must_be_true(trial.call(), "because this has changed: campaign (1 part)")


def corrupt_part(trial: Trial, chance: random.Random) -> None:
    """A part with bytes that were changed, or that is cut."""
    part = chance.choice(trial.keep(trial.seed))
    content = bytearray(part.read_bytes())
    if chance.random() < 0.3:
        part.write_bytes(content[: chance.randrange(len(content))])
        trial.must_be_true(trial.call(), "their files are damaged (1 part)")
        return
    for _ in range(chance.randrange(1, 5)):
        content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    part.write_bytes(content)
    # Some bytes are those of no value.
    trial.must_be_true(trial.call())


def doubled_cases(trial: Trial, chance: random.Random) -> None:
    """A part under the name of another one of the same length."""
    parts = trial.keep(trial.seed)
    first, second = chance.sample([part for part in parts if "0050" not in part.name[:10]], 2)
    shutil.copy(first, second)
    trial.must_be_true(trial.call(), "their files are damaged (1 part)")


def killed_program(trial: Trial, chance: random.Random) -> None:
    """The program is killed at any time."""
    process = trial.start("--isolate=false")
    time.sleep(chance.uniform(0.0, 0.4))
    process.kill()
    process.communicate()


def killed_unit(trial: Trial, chance: random.Random) -> None:
    """The closed process is killed at any time, by the system or a person."""
    process = trial.start("--isolate")
    children = Path(f"/proc/{process.pid}/task")
    end = time.monotonic() + chance.uniform(0.0, 0.6)
    killed = False
    while process.poll() is None and not (killed and time.monotonic() > end):
        lists = [path.read_text().split() for path in children.glob("*/children")] if children.exists() else []
        found = sorted(int(child) for child in sum(lists, []))
        if found and time.monotonic() > end and not killed:
            subprocess.run(["kill", "-KILL", str(chance.choice(found))], check=False, capture_output=True)
            killed = True
            break
        time.sleep(0.005)
    out, errors = process.communicate(timeout=300)
    done = subprocess.CompletedProcess(process.args, process.returncode, out, errors)
    if done.returncode == 0:
        # It came too late, or the parts were flown by another process.
        trial.must_be_true(done)
    elif (trial.folder / "out" / "c" / "summary.json").exists():
        # It came after the last case; the results are complete.
        done.returncode = 0
        trial.must_be_true(done)
    else:
        trial.must_be_told(done, done.returncode, f"signal {int(signal.SIGKILL)}")


FAULTS: dict[str, Callable[[Trial, random.Random], None]] = {
    "library of another platform": bad_library("windows", 2, "has no library for linux64"),
    "library without its dependency": bad_library("lonely", 2, "needs libgone.so, which is not on this system"),
    "library that is cut": bad_library("cut", 2, "is damaged"),
    "unit that crashes": bad_library("crashes", 1, "could not be flown", "killed by signal 11", options=("--isolate",)),
    "unit that never answers": bad_library("endless", 1, "no answer within", options=("--isolate",), limits="[isolation]\ncall_timeout = 0.3\n"),
    "folder without execution": noexec,
    "no folder to unpack into": no_folder,
    "part of another campaign": foreign_part,
    "damaged part": corrupt_part,
    "cases twice": doubled_cases,
    "program killed": killed_program,
    "closed process killed": killed_unit,
}


def attempt(bench: Bench, folder: Path, number: int) -> str | None:
    """Plants one fault. Returns what went wrong."""
    name = list(FAULTS)[number % len(FAULTS)]
    chance = random.Random(number)
    trial = Trial(bench, folder / str(number), chance.choice(list(SEEDS)))
    try:
        FAULTS[name](trial, chance)
        trial.fly_with("sound")
        trial.must_be_true(trial.call())
    except Wrong as wrong:
        return f"{number}, {name}: {wrong}"
    shutil.rmtree(trial.folder)
    return None


def main() -> None:
    count, folder = int(sys.argv[1]), Path(sys.argv[2])
    profiles = [ROOT / "target" / profile / "orchestrator" for profile in ("release", "debug")]
    program = max((path for path in profiles if path.is_file()), key=lambda path: path.stat().st_mtime)
    folder.mkdir(parents=True)
    bench = Bench(program, folder)
    wrong = [said for number in range(count) if (said := attempt(bench, folder, number))]
    print(*wrong, sep="\n")
    print(f"{len(wrong)} of {count} campaigns with a fault were wrong")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
