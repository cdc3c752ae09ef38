"""The orchestrator as another process: it is run, or it asks for runs that are flown here."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import tempfile
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

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
    with subprocess.Popen(
        [str(program()), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env={**os.environ, "RUST_LOG": level},
    ) as process:
        try:
            printed, said = process.communicate()
        except BaseException:
            end(process)
            raise
    messages, _, error = said.partition("error: ")
    for text in re.findall(r"^ *WARN (.+)$", messages, re.MULTILINE):
        warnings.warn(text, OrchestratorWarning, stacklevel=stacklevel)
    return process.returncode, reason(process.returncode, error, said), printed


PATIENCE = 2.0
"""Time that the orchestrator gets to end by itself, s."""


def end(process: subprocess.Popen[Any]) -> None:
    """Waits for the end of the orchestrator, which then removes its folders. It ends by itself when
    its standard input ends, or when Ctrl-C has reached it, too; else it is asked to."""
    for ask in (None, process.terminate, process.kill):
        if ask is not None:
            ask()
        with suppress(subprocess.TimeoutExpired):
            process.wait(PATIENCE)
            return


def reason(exit_code: int, error: str, said: str) -> str:
    """Returns why the orchestrator has ended."""
    return error.strip() or said.strip() or f"the orchestrator {manner(exit_code)}"


def manner(exit_code: int) -> str:
    """Says how a process has ended."""
    if exit_code >= 0:
        return f"ended with exit code {exit_code}"
    try:
        return f"was ended by {signal.Signals(-exit_code).name}"
    except ValueError:
        return f"was ended by signal {-exit_code}"


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
            assert process.stdin is not None and process.stdout is not None
            try:
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
                close(process.stdin)
                end(process)
                raise
            # What an orchestrator that has ended did not read is not written at the end.
            close(process.stdin)
        messages.seek(0)
        text = messages.read().decode(errors="replace")
        return process.returncode, reason(process.returncode, text.partition("error: ")[2], text)


def close(pipe: IO[bytes]) -> None:
    """Closes a pipe, also if nobody reads what is left in it."""
    with suppress(OSError):
        pipe.close()


def missing_parts(campaign: Callable[..., str], folder: Path) -> list[tuple[int, int]]:
    """Returns the parts of a campaign that are not flown, each with its first case and the one
    after its last. `campaign` calls the orchestrator for the campaign with further arguments."""
    work: dict[str, Any] = json.loads(campaign("--work", "--out", str(folder)))
    return [(first, last) for first, last in work["missing"]]
