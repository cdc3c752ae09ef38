"""The orchestrator as another process, which may ask laws of this one for moments."""

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
from pathlib import Path
from typing import IO, Any

from ._data import caller, program
from ._law import Laws
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
    arguments: Sequence[str], level: str = "warn", laws: Laws | None = None
) -> tuple[int, str, str]:
    """Runs the orchestrator. Returns its exit code, the text of its error, and what it printed.
    Its warnings are Python warnings of the line that called this package; with the level "error"
    there are none. With `laws`, these give the moment in place of the controller; an error of them
    ends the orchestrator and is raised."""
    command = [str(program()), *arguments]
    environment = {**os.environ, "RUST_LOG": level, "ORCHESTRATOR_PARENT": str(os.getpid())}
    if laws is not None:
        exit_code, said, printed = converse([*command, "--law", laws.key], environment, laws)
    else:
        exit_code, said, printed = listen(command, environment)
    messages, _, error = said.partition("error: ")
    for text in re.findall(r"^ *WARN (.+)$", messages, re.MULTILINE):
        warnings.warn(text, OrchestratorWarning, stacklevel=caller())
    return exit_code, reason(exit_code, error, said), printed


def listen(command: list[str], environment: dict[str, str]) -> tuple[int, str, str]:
    """Runs the orchestrator. Returns its exit code, its messages, and what it printed."""
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        env=environment,
    ) as process:
        try:
            printed, said = process.communicate()
        except BaseException:
            end(process)
            raise
    return process.returncode, said, printed


def converse(command: list[str], environment: dict[str, str], laws: Laws) -> tuple[int, str, str]:
    """Does as `listen`, and lets laws answer the orchestrator's questions."""
    head = laws.HEAD
    with tempfile.TemporaryFile() as messages:
        with subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=messages,
            env=environment,
        ) as process:
            assert process.stdin is not None and process.stdout is not None
            try:
                # A shorter message was cut off by the end of the orchestrator.
                while len(message := process.stdout.read(head.size)) == head.size:
                    kind, number, time, length = head.unpack(message)
                    if len(told := process.stdout.read(length)) < length:
                        break
                    answer = laws.answer(kind, number, time, told)
                    if answer is not None and not sent(process.stdin, answer):
                        # The orchestrator has ended, and its messages say why.
                        break
            except BaseException:
                close(process.stdin)
                end(process)
                raise
            # Requests that an ended orchestrator did not read are not written at the end.
            close(process.stdin)
        messages.seek(0)
        said = messages.read().decode(errors="replace")
    return process.returncode, said, laws.printed.decode()


PATIENCE = 0.4
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


def sent(pipe: IO[bytes], answer: bytes) -> bool:
    """Writes an answer. Returns whether somebody reads it."""
    try:
        pipe.write(answer)
        pipe.flush()
    except OSError:
        return False
    return True


def close(pipe: IO[bytes]) -> None:
    """Closes a pipe, also if nobody reads what is left in it."""
    with suppress(OSError):
        pipe.close()


def missing_parts(campaign: Callable[..., str], folder: Path) -> list[tuple[int, int]]:
    """Returns the parts of a campaign that are not flown, each with its first case and the one
    after its last. `campaign` calls the orchestrator for the campaign with further arguments."""
    work: dict[str, Any] = json.loads(campaign("--work", "--out", str(folder)))
    return [(first, last) for first, last in work["missing"]]
