"""The orchestrator as another process: it is run, or it asks for runs that are flown here."""

from __future__ import annotations

import json
import os
import re
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._data import program
from ._run import Run


class OrchestratorError(RuntimeError):
    """The orchestrator refused an experiment, or its run failed. The text is the
    orchestrator's."""

    def __init__(self, message: str, exit_code: int, run: Run | None) -> None:
        super().__init__(message)
        self.exit_code = exit_code
        """1: the run failed, 2: bad experiment, 3: the attitude was lost."""
        self.run = run
        """Results that were recorded until then, if there are any."""


class OrchestratorWarning(UserWarning):
    """A warning of the orchestrator, or of an FMU that it steps."""


def orchestrate(
    arguments: Sequence[str], stacklevel: int, level: str = "warn"
) -> tuple[int, str, str]:
    """Runs the orchestrator. Returns its exit code, the text of its error, and what it printed.
    Its warnings are Python warnings, as many levels of calls further up as `stacklevel` says; with
    the level "error" there are none."""
    done = subprocess.run(
        [str(program()), *arguments],
        capture_output=True,
        text=True,
        encoding="utf-8",
        env={**os.environ, "RUST_LOG": level},
        check=False,
    )
    messages, _, error = done.stderr.partition("error: ")
    for text in re.findall(r"^ *WARN (.+)$", messages, re.MULTILINE):
        warnings.warn(text, OrchestratorWarning, stacklevel=stacklevel)
    return done.returncode, error.strip() or done.stderr.strip(), done.stdout


@dataclass(frozen=True)
class Rows:
    """Values of the variables of a run that was flown here, a row for each communication point."""

    values: npt.NDArray[np.float64]
    failure: dict[str, str] | None = None
    """Failure of an FMU that ended the run at the last row: "component", "call", "message"."""


def serve(arguments: Sequence[str], fly: Callable[[dict[str, Any]], Rows]) -> tuple[int, str]:
    """Runs the orchestrator, and flies the runs that it asks for. Returns its exit code and the
    text of its error. An error of `fly` ends the orchestrator and is raised."""
    with tempfile.TemporaryFile() as messages:
        with subprocess.Popen(
            [str(program()), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=messages,
            env={**os.environ, "RUST_LOG": "error"},
        ) as process:
            try:
                assert process.stdin is not None and process.stdout is not None
                for line in process.stdout:
                    rows = fly(json.loads(line))
                    head = {"rows": len(rows.values), "failure": rows.failure}
                    process.stdin.write(json.dumps(head).encode() + b"\n")
                    process.stdin.write(rows.values.astype("<f8").tobytes())
                    process.stdin.flush()
            except BrokenPipeError:
                # The orchestrator has ended, and its messages say why.
                pass
            except BaseException:
                process.kill()
                raise
        messages.seek(0)
        text = messages.read().decode(errors="replace")
        return process.returncode, (text.partition("error: ")[2] or text).strip()


def missing_parts(campaign: Callable[..., str], folder: Path) -> list[tuple[int, int]]:
    """Returns the parts of a campaign that are not flown, each with its first case and the one
    after its last. `campaign` calls the orchestrator for the campaign with further arguments."""
    work: dict[str, Any] = json.loads(campaign("--work", "--out", str(folder)))
    return [(first, last) for first, last in work["missing"]]
