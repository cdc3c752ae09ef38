"""Finds where every variable of an FMU that can be set acts. It is set to other values in the places of
the shipped experiments, until an output of the FMU differs.

A place is the settings of a component of an experiment, and the inputs that it had in a run. The FMU is
driven alone, so what differs at its outputs differs in the experiment's results. A variable that acts
under some settings only says so: its description ends with "; used with CONDITION", and the FMU warns if
it is set without effect.

    python tests/relations/settable.py      # writes target/settings.md, for the manual
"""

from __future__ import annotations

import csv
import re
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from ctypes import c_double, c_int, c_uint
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from fmpy.fmi1 import FMICallException

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from conftest import NAMES, ROOT, TARGET, archive, program, tomllib
from fmi import NOT_REPRODUCIBLE, Fmu, Instance, number
from parameters import joined, pattern, without_index
from scenes import SCENES


PAGE = TARGET / "settings.md"
TIMED = {"solver.timeBudget"}
# Communication points of a run, unless its FMUs end it, and those at which an FMU is driven: first at
# a few of them. A flight that has not more than the last number is flown to its end as well.
FLOWN, DRIVEN, SHORT, LONGEST = 3000, 60, 8, 100_000
NEVER, STEPPED = "no setting of this FMU", "co-simulation"
# Files for parameters that are texts, all of which name files.
VEHICLE = ROOT / "orchestrator" / "experiments" / "entry" / "vehicles" / "lifting-body.toml"
TUNING = {
    "ReentryPlant": "sensor.gravity = 9.0\nsensor.gyroscope.bias.x = 0.01",
    "EntryGuidance": "bank.final = 0.3",
    "EntryNavigation": "alignment.attitude = 0.01",
    "AttitudeEstimator": "filter.cutoff = 3.0",
    "CRMPC": "terminal.k1 = -1.0\nterminal.k2 = -2.5",
    "DLMPC": "reference.previewAcceleration.alpha = 0.1\nsolver.maxIterations = 1",
}
FILE = "time_s,alpha_rad,beta_rad,sigma_rad\n0,0.1,0.0,-0.3\n100,0.2,0.1,-0.4\n"


@dataclass(frozen=True)
class Place:
    """Settings of an FMU, and its inputs at some communication points."""

    name: str
    settings: dict
    times: list[float]
    inputs: dict[str, list[float]]
    # Variables that the measures and pictures of the experiment show.
    observed: frozenset[str] = field(default_factory=frozenset)


# Runs of the experiments


def experiments() -> list[Path]:
    """All experiments that can be run."""
    found = []
    for path in sorted((ROOT / "orchestrator" / "experiments").glob("*/*.toml")):
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        if "title" in table and not table.keys() & {"paper", "experiment", "vary"}:
            found.append(path)
    return found


def flown(experiment: Path, folder: Path, to_the_end: bool) -> list[tuple[str, Place]]:
    """Flies an experiment. Returns the names of the FMUs of its components, and the place of each."""
    text = subprocess.run([program("orchestrator"), "show", experiment], capture_output=True, text=True, check=True).stdout
    # The text is written to another folder, and its files stay where they are.
    text = re.sub(r'(\.file" = ")([^"/])', rf"\1{experiment.parent}/\2", text)
    merged = tomllib.loads(text)
    time, components = merged["simulation"], merged["components"]
    start, step = time.get("start", 0.0), time["step"]
    steps = round((time["stop"] - start) / step)
    if to_the_end and ("ends_with" not in time or steps > LONGEST):
        return []
    steps = steps if to_the_end else min(steps, FLOWN)
    # Nothing is measured, as the margins of a loop take long.
    sections = re.split(r"^(?=\[)", text, flags=re.M)
    kept = "".join(section for section in sections if not re.match(r"\[+(observe|record)", section))
    kept += f"[record]\nevery = {max(1, steps // DRIVEN)}\nvariables = {[f'{name}.*' for name in components]}\n"
    folder.mkdir(parents=True)
    file = folder / "recorded.toml"
    file.write_text(kept, encoding="utf-8")
    command = [program("orchestrator"), "run", file, "--out", folder, "--fmu-dir", TARGET / "fmu", "--fmu-dir", experiment.parent]
    finished = subprocess.run([*command, "--stop", str(start + steps * step), "--no-plot", "--quiet"], capture_output=True, text=True)
    assert finished.returncode == 0, f"{experiment}: {finished.stderr}"
    assert "no effect" not in finished.stderr, f"{experiment}: {finished.stderr}"
    with open(folder / "results.csv", encoding="utf-8") as results:
        heading, *rows = csv.reader(results)
    columns = {name: [float(value) for value in values] for name, values in zip(heading, zip(*rows))}
    shown = re.findall(r"[a-zA-Z][\w.\[\],]*", str(merged.get("observe", "")))
    name = f"{experiment.parent.name}/{experiment.stem}"
    places = []
    for part, component in components.items():
        if component["fmu"].endswith(".fmu"):
            own = {column.removeprefix(f"{part}."): values for column, values in columns.items() if column.startswith(f"{part}.")}
            observed = frozenset(one.removeprefix(f"{part}.") for one in shown if one.startswith(f"{part}."))
            vehicle = {"vehicle.file": merged["vehicle"]["file"]} if "vehicle" in merged else {}
            settings = vehicle | {key: number(value) for key, value in component.get("parameters", {}).items()}
            places.append((component["fmu"].removesuffix(".fmu"), Place(name, settings, columns["time"], own, observed)))
    return places


def places(folder: Path) -> dict[str, list[Place]]:
    """The places of each FMU, without those whose settings occurred before."""
    jobs = [(path, folder / path.parent.name / f"{path.stem}-{end}", end) for end in (False, True) for path in experiments()]
    with ThreadPoolExecutor(2) as pool:
        found: dict[str, list[Place]] = {}
        for name, place in (pair for pairs in pool.map(lambda job: flown(*job), jobs) for pair in pairs):
            found.setdefault(name, []).append(place)
    return found


# Conditions


def condition(description: str) -> str:
    """The condition under which a variable acts; empty for always."""
    return description.partition("; used with ")[2]


def parts(text: str) -> Iterator[list[tuple[str, str, str]]]:
    """The alternatives of each part of a condition, each with name, operator and value."""
    for part in text.split(" and ") if text not in ("", NEVER) else []:
        alternatives: list[tuple[str, str, str]] = []
        for alternative in part.strip("()").split(" or ") if part != STEPPED else []:
            words = alternative.split(" ")
            alternatives.append(tuple(words) if len(words) == 3 else (*alternatives[-1][:2], alternative))
        if alternatives:
            yield alternatives


class Driven:
    """An FMU that is set to other values and driven, time and again."""

    def __init__(self, fmu: Fmu, folder: Path):
        self.fmu = fmu
        self.variables = fmu.variables
        self.settable = [v for v in fmu.description.modelVariables if v.causality in ("parameter", "input")]
        self.instance = Instance(fmu)
        self.references = [[], [], []]
        for variable in fmu.description.modelVariables:
            # What a law shows of itself for recording only, such as its plan, is local.
            is_shown = variable.causality == "output" or (variable.causality, variable.variability) == ("local", "discrete")
            if is_shown and variable.name not in NOT_REPRODUCIBLE:
                kind = {"Real": 0, "Boolean": 2}.get(variable.type, 1)
                self.references[kind].append(variable.valueReference)
        self.bases: dict[tuple, list] = {}
        self.file = folder / "reference.csv"
        self.file.write_text(FILE)
        self.tuning = folder / "settings.toml"
        self.tuning.write_text(TUNING.get(fmu.name, ""))

    def value(self, name: str, written):
        """A value in the type of its variable, from a text or a number."""
        variable = self.variables[name]
        if variable.type == "Enumeration" and not str(written).isdigit():
            return self.fmu.item(name, written)
        if variable.type == "Boolean":
            return str(written) in ("True", "true", "1.0")
        return {"Real": float, "String": str}.get(variable.type, lambda value: int(float(value)))(written)

    def setting(self, place: Place, name: str):
        return self.value(name, place.settings.get(name, self.variables[name].start))

    # Runs

    def outputs(self) -> bytes:
        slave, read = self.instance.slave, b""
        for references, kind, get in zip(self.references, (c_double, c_int, c_int), (slave.fmi2GetReal, slave.fmi2GetInteger, slave.fmi2GetBoolean)):
            values = (kind * len(references))()
            get(slave.component, (c_uint * len(references))(*references), len(references), values)
            read += bytes(values)
        return read

    def rows(self, place: Place, settings: dict, added: dict) -> Iterator[bytes | str]:
        """Yields all outputs after initialization and every step, and the message of a failure. Some values are
        `added` to inputs."""
        instance = self.instance
        instance.log.clear()
        instance.slave.reset()
        own = {name: signal for name, signal in place.inputs.items() if self.is_input(name) and name not in place.settings | settings}
        try:
            instance.set({name: self.value(name, value) for name, value in (place.settings | settings).items() if name in self.variables})
            instance.enter(place.times[0])
            for row, time in enumerate(place.times):
                given = {name: self.value(name, signal[row]) for name, signal in own.items()}
                given |= {name: given[name] + value for name, value in added.items()}
                instance.set(given)
                if row == 0:
                    instance.exit()
                    yield self.outputs()
                if row + 1 < len(place.times):
                    instance.step(time, place.times[row + 1] - time)
                    yield self.outputs()
        except FMICallException:
            yield instance.messages()

    def is_input(self, name: str) -> bool:
        return name in self.variables and self.variables[name].causality == "input"

    def tried(self, place: Place, name: str, value, is_set: bool = True) -> str:
        """Returns the effect of a value: it `acts`, is `refused`, the FMU has `warned`, or nothing. An input that is not
        set like a parameter, but connected, has the value added to its signal."""
        key = (place.times[-1], place.name, *sorted(place.settings.items(), key=str))
        if key not in self.bases:
            self.bases[key] = list(self.rows(place, {}, {}))
        rows = self.rows(place, {name: value}, {}) if is_set else self.rows(place, {}, {name: value})
        for row, (before, after) in enumerate(zip(self.bases[key], rows)):
            if before != after:
                return "refused" if isinstance(after, str) and row == 0 else "acts"
        vain = [line.partition(" no effect: ")[0] for line in self.instance.messages().splitlines() if " no effect: " in line]
        return "warned" if name in re.split(r", | ", " ".join(vain)) else ""

    def values(self, place: Place, name: str) -> list:
        """Values to try, in the limits of the variable."""
        variable, now = self.variables[name], self.setting(place, name)
        if variable.type == "Boolean":
            return [not now]
        if variable.type == "String":
            return [str({"vehicle.file": VEHICLE, "settings.file": self.tuning}.get(name, self.file))]
        if variable.type == "Enumeration":
            return [int(item.value) for item in variable.declaredType.items if int(item.value) != now]
        ends = [None if end is None else float(end) for end in (variable.min, variable.max)]
        size = float(variable.nominal or 0.0) or abs(now) or 1.0
        # Times within the run.
        times = [share * place.times[-1] for share in (0.3, 0.8)] if variable.unit == "s" else []
        values = [now + 0.1 * size, now - 0.1 * size, now + size, now - size, 2 * now, now / 2, 0.0, -now, 4.5 * now, 5.5 * now, now / 20, now / 1000, now + size / 1000, 10 * now + 10 * size, *times, *ends]
        values = [self.value(name, value) for value in values if value is not None]
        low, high = ends
        return [v for v in dict.fromkeys(values) if v != now and (low is None or v >= low) and (high is None or v <= high)]

    # Conditions

    def named(self, name: str) -> list[str]:
        return [v.name for v in self.settable if v.name.startswith(name[:-1])] if name.endswith("*") else [name]

    def compares(self, place: Place, name: str, operator: str, written: str) -> bool:
        pairs = [(self.setting(place, one), self.value(one, written)) for one in self.named(name)]
        return any({"=": a == b, "!=": a != b, ">": a > b, ">=": a >= b}[operator] for a, b in pairs)

    def holds(self, place: Place, text: str) -> bool:
        return text != NEVER and all(any(self.compares(place, *one) for one in part) for part in parts(text))

    def fulfilled(self, place: Place, text: str) -> Place:
        """The place with the settings that the condition needs."""
        settings = dict(place.settings)
        for alternatives in parts(text):
            if any(self.compares(place, *one) for one in alternatives):
                continue
            name, operator, written = alternatives[0]
            for one in self.named(name):
                value = self.value(one, written)
                # A time lies within the run, and a period passes several times.
                others = [(0.1 if one.endswith(".period") else 0.8) * place.times[-1]] if self.variables[one].unit == "s" else self.values(place, one)
                settings[one] = value if operator in ("=", ">=") else others[0]
        return replace(place, name=f"{place.name}, with this condition", settings=settings)

    def unfulfilled(self, place: Place, text: str) -> Place:
        """The place with a setting that contradicts the condition."""
        settings = dict(place.settings)
        for name, operator, written in next(parts(text)):
            for one in self.named(name):
                values = [written] if operator == "!=" else self.values(place, one)
                tries = (replace(place, settings=settings | {one: value}) for value in values)
                settings = next(other for other in tries if not self.compares(other, one, operator, written)).settings
        return replace(place, name=f"{place.name}, without this condition", settings=settings)

    def place_of(self, variable, places: list[Place]) -> str | None:
        """Where a variable acts: an experiment or a scene, or the condition that no experiment fulfils."""
        name, text = variable.name, condition(variable.description)
        if text == NEVER:
            return None
        fits = [place for place in places if self.holds(place, text)] or [self.fulfilled(place, text) for place in places[:2]]
        # An input is changed where it is connected, and then set to a constant.
        ways = [False, True] if self.is_input(name) and name in places[0].inputs else [True]
        shown = [place.name for place in places if name in place.observed]
        refused = None
        # Most variables act at once. The others are tried with more values, over all communication points.
        for length, few in ((SHORT, 2), (DRIVEN + 1, None)):
            for place in fits:
                place = replace(place, times=place.times[:length])
                for value in self.values(place, name)[:few]:
                    outcomes = [self.tried(place, name, value, is_set) for is_set in ways if is_set or name not in place.settings]
                    if "acts" in outcomes:
                        return place.name
                    if "refused" in outcomes:
                        refused = f"{place.name}: the value decides whether the settings are accepted"
            if shown:
                return f"measures and pictures of {shown[0]}"
        return refused

    def in_vain(self, variable, places: list[Place]) -> str:
        """Returns the effect of setting a variable where its condition does not hold."""
        text = condition(variable.description)
        elsewhere = [place for place in places if not self.holds(place, text)] or [self.unfulfilled(places[0], text)]
        place = replace(elsewhere[0], times=elsewhere[0].times[:SHORT])
        outcomes = {self.tried(place, variable.name, value) for value in self.values(place, variable.name)}
        return next((outcome for outcome in ("acts", "", "warned", "refused") if outcome in outcomes), "")


def places_of(fmu: Fmu, fmus: list[Fmu], found: dict[str, list[Place]]) -> list[Place]:
    """The places of an FMU: its own, those of FMUs with the same inputs, for which it can be exchanged, and scenes."""
    def entries(name: str, value) -> dict:
        """The entries of a vector that is set by its name."""
        names = [other for other in fmu.variables if other.startswith(f"{name}[")] if name not in fmu.variables else []
        return dict(zip(names, value if isinstance(value, list) else [value] * len(names))) if names else {name: value}

    for place in found[fmu.name]:
        given = [entries(name, value) for name, value in place.settings.items()]
        place.settings.update({name: value for entry in given for name, value in entry.items() if name not in place.settings})
    own = found[fmu.name]
    others = [place for other in fmus if other.names("input") == fmu.names("input") for place in found[other.name]]
    exchanged = [place for place in others if place.name not in {place.name for place in own}]
    scenes = SCENES.get(fmu.name, {}).items()
    base = {place.name: place for place in own + exchanged}
    return own + exchanged + [scene(fmu, base[experiment], title, settings) for title, (experiment, settings) in scenes]


def scene(fmu: Fmu, base: Place, title: str, given: dict) -> Place:
    """The place of an experiment with other settings and signals. Communication points are where samples are measured, if these are given."""
    signals = {name: value for name, value in given.items() if isinstance(value, list) and name in fmu.variables}
    settings = {name: value for name, value in (base.settings | given).items() if name not in signals}
    times = signals.get("measured.time", base.times)[: len(base.times)]
    return replace(base, name=title, settings=settings, inputs=base.inputs | signals, times=times)


# The page

HEAD = """# Where every setting acts

Generated by `tests/relations/settable.py`, whose test sets every parameter and every input of every
FMU to other values. A setting acts in an experiment if another value of it changes an output of the
FMU there. Where its condition does not hold, it has no effect: the FMU then logs a warning if a
parameter differs from its start value at the end of initialization, or an input before
initialization mode.
"""


def table(rows: list[tuple[str, str, str]]) -> str:
    """Rows of variable, condition and place; entries of a vector that agree share a row."""
    groups: list[tuple[tuple, list[str]]] = []
    for name, text, place in rows:
        stem, ending = pattern(name)
        key = (stem, without_index(text, ending), place, bool(ending))
        if ending and groups and groups[-1][0] == key:
            groups[-1][1].append(ending)
        else:
            groups.append((key, [ending]))
    lines = ["| variable | used with | acts in |", "|---|---|---|"]
    for (stem, text, place, _), endings in groups:
        lines.append(f"| {joined(stem, endings)} | {f'`{text}`' if text else ''} | {place} |")
    return "\n".join(lines)


def page(found: dict[str, list[tuple[str, str, str]]]) -> str:
    return HEAD + "".join(f"\n## {name}\n\n{table(rows)}\n" for name, rows in found.items())


def looked_at(job: tuple[str, list[Place], Path]) -> tuple[list[tuple[str, str, str]], list[str]]:
    """The rows of the page for one FMU, and what is wrong."""
    name, there, folder = job
    driven, rows, faults = Driven(Fmu.open(archive(name), folder), folder), [], []
    for variable in driven.settable:
        text = condition(variable.description)
        place = driven.place_of(variable, there)
        if text not in ("", STEPPED) and (outcome := driven.in_vain(variable, there)) not in ("warned", "refused"):
            faults.append(f"{name}: {variable.name} is used with {text}, but elsewhere it {outcome or 'says nothing'}")
        if place is None and text != NEVER:
            faults.append(f"{name}: {variable.name} acts nowhere")
        # How long a computation takes, and so where a budget acts, differs from run to run.
        rows.append((variable.name, text, "wherever computing takes longer" if variable.name in TIMED else place or ""))
    driven.instance.close()
    return rows, faults


def look(names: list[str], folder: Path) -> tuple[dict[str, list[tuple[str, str, str]]], list[str]]:
    """The rows of the page for each FMU, and what is wrong."""
    known = places(folder / "runs")
    fmus = [Fmu.open(archive(name), folder / name) for name in names]
    jobs = [(fmu.name, places_of(fmu, fmus, known), folder / f"{fmu.name}-driven") for fmu in fmus]
    with ProcessPoolExecutor(2) as pool:
        outcomes = list(pool.map(looked_at, jobs))
    return {name: rows for name, (rows, _) in zip(names, outcomes)}, [fault for _, faults in outcomes for fault in faults]


if __name__ == "__main__":
    with TemporaryDirectory() as made:
        found, wrong = look(NAMES, Path(made))
        PAGE.write_text(page(found), encoding="utf-8")
        sys.exit("\n".join(wrong))
