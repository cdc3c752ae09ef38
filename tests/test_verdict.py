"""The last words of scripts/test, tried with stand-ins for all that it runs."""

import os
import shutil
import signal
import subprocess
import time

import pytest

from conftest import ROOT

# Functions that scripts/test takes from the scripts that it reads, doing nothing.
ENVIRONMENT = """
set -euo pipefail
root=. wasm=wasm target=target fmus=target/fmu dist=target/dist python=python-of-tests
say() { printf '\\n== %s\\n' "$*"; }
mkdir -p "$dist/linux-x86_64/fmu" "$dist/linux-x86_64/fmi3"
touch "$dist/linux-x86_64/fmu/a.fmu" "$dist/linux-x86_64/fmi3/a.fmu"
need_rust() { :; }
need_python() { :; }
install_tools() { :; }
build() { :; }
build_fmus() { :; }
can_build() { :; }
can_build_browser() { false; }
package_fmus() { :; }
"""
# The commands that it runs: each writes its name, and the one that is to hang waits.
COMMAND = """#!/bin/sh
echo "$(basename "$0") $1" >>commands
case "$(basename "$0") $*" in "$HANGS"*) : >hangs; exec sleep 30 ;; "$FAILS"*) exit 1 ;; esac
"""


@pytest.fixture
def script(tmp_path):
    (tmp_path / "scripts").mkdir()
    (tmp_path / "bin").mkdir()
    shutil.copy(ROOT / "scripts/test", tmp_path / "scripts/test")
    (tmp_path / "scripts/environment.sh").write_text(ENVIRONMENT)
    (tmp_path / "scripts/platforms.sh").write_text("")
    for name in ("cargo", "python-of-tests", "valgrind"):
        command = tmp_path / "bin" / name
        command.write_text(COMMAND)
        command.chmod(0o755)

    def start(hangs="nothing", fails="nothing"):
        environment = {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "HANGS": hangs, "FAILS": fails}
        return subprocess.Popen(
            ["bash", "scripts/test"], cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True, text=True
        )

    return start


def test_a_finished_run_says_passed(script):
    run = script()
    output, _ = run.communicate(timeout=30)
    assert run.returncode == 0 and output.endswith("== All tests PASSED\n"), output


@pytest.mark.parametrize("command", ["cargo test", "cargo build", "python-of-tests -m pytest"])
def test_a_run_that_fails_says_so(script, command):
    run = script(fails=command)
    output, _ = run.communicate(timeout=30)
    assert run.returncode != 0 and output.endswith("== Tests FAILED\n") and "PASSED" not in output, output


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("command", ["cargo test --locked --workspace --doc", "cargo build", "python-of-tests -m pytest"])
def test_a_run_that_is_ended_says_failed(script, tmp_path, command, number):
    run = script(hangs=command)
    for _ in range(3000):
        if (tmp_path / "hangs").exists():
            break
        assert run.poll() is None
        time.sleep(0.01)
    # As a terminal or a service manager does: to the script and to what it runs.
    os.killpg(run.pid, number)
    output, _ = run.communicate(timeout=30)
    assert run.returncode != 0 and output.endswith("== Tests FAILED\n") and "PASSED" not in output, output


def test_no_script_takes_the_last_command_that_ended_for_its_outcome():
    scripts = [path for path in ROOT.joinpath("scripts").rglob("*") if path.is_file()] + [ROOT / ".ci/run"]
    traps = [line for path in scripts for line in path.read_text(errors="ignore").splitlines() if line.lstrip().startswith("trap ")]
    assert len(traps) > 3 and not [line for line in traps if "$?" in line]
