"""A process that flies parts of a campaign with a law in Python.

It reads its task from standard input: the law and the command of the orchestrator, and then a line
of arguments for each part. It answers each with a line: an error, or nothing.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import time
import warnings
from pathlib import Path
from typing import Any, BinaryIO

Answer = tuple[str, Any]
"""Kind of an error, and what describes it; ("done", None) if there is none."""


def main() -> None:
    """Serves until standard input ends."""
    tasks, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    # The law reads an empty input, and what it prints must not be taken for an answer.
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    os.dup2(2, 1)
    # Who interrupts the work ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with, args=(os.getppid(),), daemon=True).start()
    # The law may be in a module that the other process has found.
    sys.path[:] = pickle.load(tasks)
    begun: dict[str, Any] = pickle.load(tasks)
    warnings.simplefilter("ignore")
    try:
        serve(tasks, answers, **begun)
    except BrokenPipeError:
        # The other process has ended.
        pass


def end_with(parent: int) -> None:
    """Ends this process when the one that has started it is no more."""
    while os.getppid() == parent:
        time.sleep(0.2)
    os._exit(1)


def serve(
    tasks: BinaryIO,
    answers: BinaryIO,
    law: bytes,
    key: str,
    command: list[str],
    progress: Path,
    core: int | None,
) -> None:
    """Flies part after part, on one core if it is given."""
    if core is not None:
        os.sched_setaffinity(0, {core})
    from ._law import Laws, Progress
    from ._orchestrator import orchestrate
    from ._state import LawError

    laws = Laws(lambda: pickle.loads(law), key, progress=Progress(progress))
    while True:
        try:
            arguments: list[str] = pickle.load(tasks)
        except EOFError:
            break
        answer: Answer
        try:
            exit_code, error, _ = orchestrate([*command, *arguments], laws=laws)
            answer = ("orchestrator", (error, exit_code)) if exit_code else ("done", None)
        except LawError as failed:
            answer = ("law", failed.args)
        except BaseException as failed:
            answer = ("other", f"{type(failed).__name__}: {failed}")
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    main()
