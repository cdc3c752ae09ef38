"""Processes that fly parts of a campaign with a law in Python, one on each core."""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ._law import PickledLaw, Progress
from ._orchestrator import OrchestratorError, close, manner
from ._state import LawError, instant

PATIENCE = 2.0
"""Time that what a worker has started gets to end by itself, s."""


class Worker:
    """A process that flies parts, one after the other. Its temporary files are in a folder that is
    removed with the pool."""

    def __init__(
        self, law: PickledLaw, command: list[str], folder: Path, number: int, core: int | None
    ) -> None:
        # Ctrl-C is for this process, which then ends the others.
        apart: dict[str, Any] = {"start_new_session": True}
        if os.name == "nt":
            apart = {"creationflags": 0x200}  # CREATE_NEW_PROCESS_GROUP
        self._law = law
        notes = folder / f"progress-{number}"
        self._progress = Progress(notes)
        temporary = dict.fromkeys(("TMPDIR", "TMP", "TEMP"), str(folder))
        # A law that crashes shows its lines.
        self._process = subprocess.Popen(
            [sys.executable, "-X", "faulthandler", "-m", "reentry_fmus._worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **temporary},
            **apart,
        )
        named = {"law": law.content, "key": law.key, "command": command}
        begin = {**named, "progress": notes, "core": core}
        self._unsent: list[object] = [sys.path, begin]

    def fly(self, arguments: list[str]) -> None:
        """Flies what further arguments of the command say, and waits for the end."""
        assert self._process.stdin is not None and self._process.stdout is not None
        try:
            for message in (*self._unsent, arguments):
                pickle.dump(message, self._process.stdin)
            self._process.stdin.flush()
            self._unsent.clear()
            kind, error = pickle.load(self._process.stdout)
        except (OSError, EOFError, pickle.UnpicklingError):
            raise self._failure() from None
        if kind == "law":
            raise LawError(*error).in_file(self._law.file)
        if kind == "orchestrator":
            raise OrchestratorError(error[0], error[1], None)
        if kind == "other":
            raise RuntimeError(error)

    def _failure(self) -> RuntimeError:
        """Says how the process has ended, and what it was about to do."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(PATIENCE)
        self._process.kill()
        how = manner(self._process.wait())
        is_asked, case, at = self._progress.read()
        if is_asked:
            problem = f"the law {self._law.name} failed {instant(case, at)}: its process {how}"
            return LawError(problem, [], case, at)
        where = "before its first case" if case is None else f"in case {case}, outside the law"
        return RuntimeError(f"a process that flies the law {self._law.name} {how} {where}")

    def end(self) -> None:
        """Ends the process and all that it has started. An orchestrator ends by itself, and leaves
        no half of a file."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            close(pipe)
        self._progress.close()
        if os.name != "nt":
            end = time.monotonic() + PATIENCE
            # The group has the number of the process. It may be gone, or have other users' programs.
            with suppress(OSError):
                while time.monotonic() < end:
                    os.killpg(self._process.pid, 0)
                    time.sleep(0.01)
                os.killpg(self._process.pid, signal.SIGKILL)


class Pool:
    """Workers, which begin when there is work for them."""

    def __init__(self, law: PickledLaw, command: list[str], jobs: int | None) -> None:
        if jobs is not None and jobs < 1:
            raise ValueError(f"jobs = {jobs}, but at least one process is needed")
        self._law, self._command = law, command
        self._jobs = jobs or cores()
        self._folder: TemporaryDirectory[str] | None = None
        self._workers: list[Worker] = []

    def _begin(self, count: int) -> None:
        self._folder = self._folder or TemporaryDirectory(ignore_cleanup_errors=True)
        for number in range(len(self._workers), count):
            core = self._core(number) if count == cores() else None
            place = (Path(self._folder.name), number, core)
            self._workers.append(Worker(self._law, self._command, *place))

    def _core(self, number: int) -> int | None:
        """Returns the core of a worker, of which there is one for each core. It and its
        orchestrator wait for each other in turn, which takes a third of the time on the same
        core."""
        if not hasattr(os, "sched_getaffinity"):
            return None
        return sorted(os.sched_getaffinity(0))[number]

    def fly(self, parts: list[tuple[int, int]]) -> None:
        """Flies parts of the campaign. The first error ends the others."""
        left: queue.SimpleQueue[tuple[int, int]] = queue.SimpleQueue()
        for part in parts:
            left.put(part)
        self._begin(min(self._jobs, len(parts)))

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
        self._begin(1)
        self._workers[0].fly([])

    def end(self) -> None:
        """Ends all processes, and removes their files."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None

    def __enter__(self) -> Pool:
        return self

    def __exit__(self, *_: object) -> None:
        self.end()


def cores() -> int:
    """Returns the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
