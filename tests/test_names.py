"""The project's own experiments, which must not warn about themselves, and the examples in the help
texts of the orchestrator, which must run."""

from __future__ import annotations

import json
import re
import shlex
import subprocess

import pytest

from conftest import EXPERIMENTS, ROOT, TARGET, program, tomllib

# Commands that take minutes, and those that write outside the folder.
LONG = ("reproduce", "campaign white", "--worst", "--guarantee", "~", "/usr")
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
MEANT_TO_WARN = {
    "known-moments": ["less than a tenth of limit.moment"],
    "attainable": ["the guarantee is not in force"],
}


def test_no_experiment_warns_about_itself(tmp_path):
    experiments = {row["name"]: row["path"] for row in listed() if row["kind"] == "experiment"}
    assert len(experiments) == 41
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
