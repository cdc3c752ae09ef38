"""An integer of a parameter is one of 32 bits, as FMI has them, however it is given. Python's own loop is
tested in python/tests."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import pytest

from conftest import EXPERIMENTS, TARGET, call

LQR = EXPERIMENTS / "lqr.toml"
SHORT = f"title = 'short'\nextends = '{LQR.as_posix()}'\n[simulation]\nstop = 0.04\n"
CAMPAIGN = """
title = "short"
experiment = "short.toml"
cases = 4
metrics = ["ems_deg"]
"""
VARY = '[[vary]]\nparameter = "plant.disturbance.seed"\n'
BEYOND = [2**31, -(2**31) - 1, 2**32 + 7, 2**53, -1]


def orchestrate(folder: Path, *arguments: object) -> subprocess.CompletedProcess:
    (folder / "short.toml").write_text(SHORT)
    return call(*arguments, "--fmu-dir", TARGET / "fmu", "--quiet", code=None, cwd=folder)


def by_option(folder: Path, number: int):
    return orchestrate(folder, "run", "short.toml", "--set", f"plant.disturbance.seed={number}")


def by_experiment(folder: Path, number: int):
    (folder / "mine.toml").write_text(f"{SHORT}[components.plant.parameters]\n'disturbance.seed' = {number}\n")
    return orchestrate(folder, "run", "mine.toml")


def by_ssp(folder: Path, number: int):
    pack = ["pack", LQR, "--fmu-dir", TARGET / "fmu", "--out", folder / "seven.ssp"]
    call(*pack, "--stop", "0.04", "--set", "plant.disturbance.seed=7")
    with zipfile.ZipFile(folder / "seven.ssp") as old, zipfile.ZipFile(folder / "other.ssp", "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name.endswith((".ssd", ".ssv")):
                content = content.replace(b'Integer value="7"', f'Integer value="{number}"'.encode())
            new.writestr(name, content)
        changed = b"".join(new.read(name) for name in new.namelist() if name.endswith((".ssd", ".ssv")))
    assert f'Integer value="{number}"'.encode() in changed
    return orchestrate(folder, "run", "other.ssp", "--step", "0.04")


def by_campaign(text: str):
    def fly(folder: Path, number: int):
        (folder / "campaign.toml").write_text(CAMPAIGN + text.format(number=number))
        return orchestrate(folder, "campaign", "campaign.toml")

    return fly


WAYS = {
    "--set": by_option,
    "experiment": by_experiment,
    "SSP": by_ssp,
    "set of a campaign": by_campaign('[set]\n"plant.disturbance.seed" = {number}\n[[vary]]\nparameter = "plant.inertia.scale"\nlist = [1.0]\n'),
    "list": by_campaign(f"{VARY}list = [1, {{number}}]\n"),
    "case": by_campaign(f"{VARY}case = {{number}}\n"),
}


@pytest.mark.parametrize("number", BEYOND)
@pytest.mark.parametrize("way", WAYS)
def test_an_integer_that_fmi_does_not_have_is_refused_with_its_name(way, number, tmp_path):
    done = WAYS[way](tmp_path, number)
    assert done.returncode == 2, done.stderr
    assert "disturbance.seed" in done.stderr and str(number) in done.stderr
    # No case is flown before.
    assert not list(tmp_path.rglob("*.parquet"))


@pytest.mark.parametrize("way", [way for way in WAYS if way != "case"])
def test_the_largest_integer_is_taken(way, tmp_path):
    done = WAYS[way](tmp_path, 2**31 - 1)
    assert done.returncode == 0, done.stderr


def test_of_the_integers_that_are_counted_by_the_case_the_smallest_follows_the_largest(tmp_path):
    done = WAYS["case"](tmp_path, 2**31 - 3)
    assert done.returncode == 0, done.stderr
