"""Processes that fly parts of a campaign with a law in Python, one on each core."""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any

from ._law import LawError, PickledLaw
from ._orchestrator import OrchestratorError


class Worker:
    """A process that flies parts, one after the other."""

    def __init__(self, law: PickledLaw, command: list[str]) -> None:
        # Ctrl-C is for this process, which then ends the others.
        apart: dict[str, Any] = {"start_new_session": True}
        if os.name == "nt":
            apart = {"creationflags": 0x200}  # CREATE_NEW_PROCESS_GROUP
        self._process = subprocess.Popen(
            [sys.executable, "-m", "reentry_fmus._worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            **apart,
        )
        self._file = law.file
        self._send(sys.path)
        self._send({"law": law.content, "command": command})

    def _send(self, message: object) -> None:
        assert self._process.stdin is not None
        pickle.dump(message, self._process.stdin)
        self._process.stdin.flush()

    def fly(self, arguments: list[str]) -> None:
        """Flies what further arguments of the command say, and waits for the end."""
        assert self._process.stdout is not None
        try:
            self._send(arguments)
            kind, error = pickle.load(self._process.stdout)
        except (BrokenPipeError, EOFError, pickle.UnpicklingError):
            code = self._process.wait()
            raise RuntimeError(f"a process that flew cases has ended, exit code {code}") from None
        if kind == "law":
            raise LawError(*error).in_file(self._file)
        if kind == "orchestrator":
            raise OrchestratorError(error[0], error[1], None)
        if kind == "value":
            raise ValueError(error)
        if kind == "other":
            raise RuntimeError(error)

    def end(self) -> None:
        """Ends the process. The orchestrator that it has started ends with it."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()


class Pool:
    """Workers, which begin when there is work for them."""

    def __init__(self, law: PickledLaw, command: list[str], jobs: int | None) -> None:
        if jobs is not None and jobs < 1:
            raise ValueError(f"jobs = {jobs}, but at least one process is needed")
        self._arguments: Any = (law, command)
        self._jobs = jobs or cores()
        self._workers: list[Worker] = []

    def fly(self, parts: list[tuple[int, int]]) -> None:
        """Flies parts of the campaign. The first error ends the others."""
        left: queue.SimpleQueue[tuple[int, int]] = queue.SimpleQueue()
        for part in parts:
            left.put(part)
        while len(self._workers) < min(self._jobs, len(parts)):
            self._workers.append(Worker(*self._arguments))

        def fly(worker: Worker) -> None:
            while not left.empty():
                try:
                    first, last = left.get_nowait()
                except queue.Empty:
                    return
                worker.fly(["--cases", f"{first}..{last}"])

        with ThreadPoolExecutor(len(self._workers)) as threads:
            try:
                for done in as_completed([threads.submit(fly, w) for w in self._workers]):
                    done.result()
            except BaseException:
                self.end()
                raise

    def finish(self) -> None:
        """Lets the orchestrator merge the parts, and fly the cases that the page shows."""
        if not self._workers:
            self._workers.append(Worker(*self._arguments))
        self._workers[0].fly([])

    def end(self) -> None:
        """Ends all processes."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


def cores() -> int:
    """Returns the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
