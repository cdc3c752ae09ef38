"""Spelling, and the subjects of commits."""

import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT

PROGRAMS = Path(sys.executable).parent


def checked(*command: str) -> str:
    program = PROGRAMS / command[0]
    return subprocess.run([program, *command[1:]], cwd=ROOT, capture_output=True, text=True).stdout


def test_words_are_spelt_right() -> None:
    assert checked("typos", "--format", "brief") == ""


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no commits in a source archive")
def test_commits_have_short_subjects_in_the_imperative() -> None:
    """Of those that this checkout has, the last 50."""
    found = subprocess.run(["git", "rev-list", "--max-count=50", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    first = found.stdout.split()[-1]
    assert checked("committed", "--no-merge-commit", f"{first}..HEAD") == ""
