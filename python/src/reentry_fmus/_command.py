"""The command `orchestrator`: the packaged program, which finds the packaged FMUs and experiments
beside itself."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from typing import NoReturn

from ._data import program


def main() -> NoReturn:
    """Runs the orchestrator with the arguments of this process, in its place."""
    arguments = [str(program()), *sys.argv[1:]]
    if os.name != "nt":
        os.execv(arguments[0], arguments)
    # Windows cannot replace a process. Ctrl-C is left to the orchestrator, which ends the run and
    # keeps its results.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(subprocess.run(arguments, check=False).returncode)
