"""The project's own experiments, which must not warn about themselves, and the examples in the help
texts of the orchestrator, which must run."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import tomllib

import pytest

from conftest import EXPERIMENTS, ROOT, TARGET, program

# Commands that take minutes, and those that write outside the folder.
LONG = ("reproduce", "campaign white", "falsify", "~", "/usr")
# Runs that the examples of a command take up.
FLOWN = {"plot": ("lqr", "dlmpc", "crmpc-robust")}


def call(*arguments: object, folder=ROOT) -> subprocess.CompletedProcess:
    command = [program("orchestrator"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder)


def listed() -> list[dict]:
    done = call("list", "--json", EXPERIMENTS.parent)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


# Experiments whose description announces the warning.
MEANT_TO_WARN = {"entry/told": ["less than a tenth of limit.moment"]}


def test_no_experiment_warns_about_itself(tmp_path):
    experiments = {row["name"]: row["path"] for row in listed() if row["kind"] == "experiment"}
    assert len(experiments) == 38
    for index, (name, path) in enumerate(experiments.items()):
        # A study may have the same name, which `show` prefers.
        step = tomllib.loads(call("show", path).stdout)["simulation"]["step"]
        out = tmp_path / str(index)
        done = call("run", name, "--stop", round(100 * step, 9), "--out", out, "--fmu-dir", TARGET / "fmu")
        # Some of these flights lose the attitude, and margins are taken later than the flight ends.
        assert done.returncode in (0, 3) or "[observe.margins]" in done.stderr, name + done.stderr
        warnings = [line for line in done.stderr.splitlines() if "WARN" in line]
        said = [part for part in MEANT_TO_WARN.get(name, []) if any(part in line for line in warnings)]
        assert said == MEANT_TO_WARN.get(name, []) and len(warnings) == len(said), name + done.stderr


def test_the_list_fits_80_columns_and_has_nothing_of_the_fuzzers():
    done = call("list")
    assert done.returncode == 0, done.stderr
    assert max(map(len, done.stdout.splitlines())) <= 80
    assert "FAULT" not in done.stdout and "fuzz" not in done.stdout
    headings = re.findall(r"^(\w+) \(\d+\): orchestrator (\w+) NAME$", done.stdout, re.MULTILINE)
    assert [kind for kind, _ in headings] == ["experiments", "studies", "campaigns", "FMUs"]


def commands() -> list[str]:
    done = call("--help")
    _, _, after = done.stdout.partition("Commands:\n")
    return re.findall(r"^  (\w+) ", after.partition("\n\n")[0], re.MULTILINE)


def examples(command: str) -> list[str]:
    _, _, text = call(command, "--help").stdout.partition("\nExamples:\n")
    return re.findall(r"^    (orchestrator .*)$", text, re.MULTILINE)


@pytest.mark.parametrize("command", [each for each in commands() if each != "help"])
def test_the_examples_of_each_help_run(command, tmp_path):
    (tmp_path / "orchestrator").symlink_to(ROOT / "orchestrator")
    (tmp_path / "target").mkdir()
    (tmp_path / "target" / "fmu").symlink_to(TARGET / "fmu")
    lines = examples(command)
    assert len(lines) == 3
    for experiment in FLOWN.get(command, ()):
        assert call("run", experiment, "--quiet", folder=tmp_path).returncode == 0
    for line in lines:
        words = shlex.split(line)[1:]
        if any(long in line for long in LONG):
            continue
        done = call(*words, folder=tmp_path)
        assert done.returncode == 0, line + done.stderr


def test_the_names_in_long_examples_are_listed():
    kinds = {"reproduce": "study", "campaign": "campaign", "falsify": "campaign"}
    rows = listed()
    for command, kind in kinds.items():
        names = {row["name"] for row in rows if row["kind"] == kind}
        for line in examples(command):
            assert shlex.split(line)[2] in names, line


@pytest.mark.parametrize("name", ["CRMPC", "ReentryPlant"])
def test_a_sound_fmu_says_so_in_one_line(name):
    done = call("inspect", name, "--check")
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(rf"{name}: sound, \d+ variables for [\w, ]+\n", done.stdout)


def test_moments_have_the_same_unit_in_summary_and_plot(tmp_path):
    done = call("run", "crmpc-robust", "--stop", "4", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    moment = re.search(r"largest moment +(\S+) kN m +within its limit 135\.6000 kN m", done.stdout)
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert abs(float(moment[1]) - metrics["max_moment_n_m"] / 1e3) < 1e-4
    assert "control moment, kN m" in (tmp_path / "out" / "plot.svg").read_text()
