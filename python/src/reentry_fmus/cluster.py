"""Campaigns on a cluster: the workers of a Dask client fly parts of a campaign.

A worker needs this package with its extra `cluster`, in the driver's version, and nothing else: the
campaign, its experiment and its FMUs are sent to it. `Campaign.run(client)` uses this module.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import io
import os
import shutil
import subprocess
import tempfile
import time
import uuid
import zipfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path

from ._data import need, program
from ._orchestrator import missing_parts
from ._unpacked import Folder

need("distributed", "cluster")

import fsspec  # noqa: E402
from distributed import (  # noqa: E402
    Client,
    Future,
    KilledWorker,
    TimeoutError,
    Worker,
    WorkerPlugin,
    get_worker,
    wait,
)

__all__ = ["ClusterError", "fly"]

Command = Callable[..., str]
"""Runs `orchestrator campaign` for a campaign with further arguments, and returns what it prints."""

TASK = 10.0
"""Intended duration of a task, s: long compared with the start of the program (about 0.1 s), and
short enough that losing a task costs little."""
QUEUED = 2
"""Tasks for each thread of the workers. The second one waits until the first one ends."""
LOOK = 5.0
"""Longest time between two looks for new workers and for a lost scheduler, s."""
GIVEN_UP = 4
"""Number of times that Dask gives a task up before the campaign is ended."""
CANCELLED = (asyncio.CancelledError, concurrent.futures.CancelledError)
"""Errors that Dask raises for a task that the scheduler no longer knows."""


class ClusterError(RuntimeError):
    """Workers or scheduler failed. The text says which parts are kept and how to
    continue."""


class Bundle(WorkerPlugin):  # type: ignore[misc]
    """Sends the files of a campaign to every worker, also to those that come later. Its name is that
    of one flight: Dask knows plugins by their names, and another driver, or another thread of this
    one, may fly the same campaign on the same workers and end first."""

    def __init__(self, content: bytes) -> None:
        self.name = f"reentry-fmus-{uuid.uuid4().hex}"
        self.content = content

    def setup(self, worker: Worker) -> None:
        """Unpacks the files in the worker's folder."""
        with zipfile.ZipFile(io.BytesIO(self.content)) as archive:
            archive.extractall(place(worker, self.name))

    def teardown(self, worker: Worker) -> None:
        """Removes the files."""
        shutil.rmtree(place(worker, self.name), ignore_errors=True)


def place(worker: Worker, name: str) -> Path:
    """Returns the folder in which a worker keeps the files of a campaign."""
    return Path(worker.local_directory) / name


def fly(campaign: Command, client: Client, folder: Path, address: str | None = None) -> None:
    """Flies the missing parts of a campaign on the workers of a client, and merges all parts.

    Parts come back through Dask and are stored in the folder at once. With an address the workers
    store them there, and they are fetched from there.

    Args:
        campaign: Command of the campaign.
        client: Client of a Dask cluster; not an asynchronous one.
        folder: Folder of the results on this machine.
        address: Address of a folder that all workers and this machine reach, as fsspec takes it.

    Raises:
        OrchestratorError: The campaign was refused.
        ClusterError: Workers or scheduler failed.
    """
    if client.asynchronous:
        raise TypeError("the client is asynchronous: Client(…) without asynchronous=True is needed")
    parts = folder / "parts"
    parts.mkdir(parents=True, exist_ok=True)
    store = None if address is None else Store(address)
    if store is not None:
        there = {path.name for path in parts.iterdir()}
        for name in store.names() - there:
            store.fetch(name, parts)
    bundle = pack(campaign)
    flight = Flight(client, bundle.name, folder, store)
    flown: set[int] = set()
    is_sent = False
    try:
        # A campaign that ends with an answer needs more cases at each look.
        while missing := missing_parts(campaign, folder):
            again = flown.intersection(first for first, _ in missing)
            if again:
                raise ClusterError(
                    f"cases {min(again)} and following were flown, but do not fit the campaign: "
                    "its files were changed meanwhile"
                )
            if not is_sent:
                client.register_plugin(bundle)
                is_sent = True
            flown.update(flight.fly(missing))
    finally:
        if is_sent and client.status == "running":
            # A scheduler that was started anew does not know it.
            with suppress(ValueError):
                client.unregister_worker_plugin(bundle.name)
    campaign("--out", str(folder))
    if store is not None:
        for name in ("cases.parquet", "summary.json", "report.html"):
            store.keep(folder / name, name)


def pack(campaign: Command) -> Bundle:
    """Packs campaign, experiment and FMUs, with all that they extend."""
    with Folder() as temporary:
        campaign("--bundle", str(temporary))
        content = io.BytesIO()
        with zipfile.ZipFile(content, "w", zipfile.ZIP_STORED) as archive:
            for path in sorted(path for path in temporary.rglob("*") if path.is_file()):
                name = path.relative_to(temporary).as_posix()
                archive.writestr(zipfile.ZipInfo(name), path.read_bytes())
    return Bundle(content.getvalue())


class Flight:
    """Submits missing parts as tasks, and stores the parts that come back."""

    def __init__(self, client: Client, bundle: str, folder: Path, store: Store | None) -> None:
        self.client = client
        self.bundle = bundle
        self.folder = folder
        self.store = store
        self.part = 0.0
        """Time that a part takes, s; 0 before the first one was flown."""
        self.given_up: Counter[tuple[int, int]] = Counter()
        """How often Dask gave a task up, by its first part."""

    def fly(self, missing: list[tuple[int, int]]) -> Iterator[int]:
        """Flies the parts. Yields the first case of each that is kept."""
        left = list(missing)
        tasks: dict[Future, list[tuple[int, int]]] = {}
        try:
            while left or tasks:
                threads = max(1, sum(self.client.nthreads().values()))
                while left and len(tasks) < QUEUED * threads:
                    parts = self.take(left, threads)
                    tasks[self.submit(parts)] = parts
                for task in self.done(tasks):
                    parts = tasks.pop(task)
                    if self.keep(task, parts):
                        yield from (first for first, _ in parts)
                    else:
                        left = parts + left
        except OSError as error:
            # The client's own calls fail with such an error when the scheduler is gone.
            raise self.lost(str(error)) from error
        finally:
            if tasks and self.client.status == "running":
                self.client.cancel(list(tasks))

    def take(self, left: list[tuple[int, int]], threads: int) -> list[tuple[int, int]]:
        """Takes consecutive parts for a task of about `TASK` seconds. The last tasks are smaller,
        so that all threads end at about the same time."""
        count = int(TASK / self.part) if self.part else 1
        count = max(1, min(count, len(left) // (2 * threads)))
        parts = [left.pop(0)]
        while left and len(parts) < count and left[0][0] == parts[-1][1]:
            parts.append(left.pop(0))
        return parts

    def submit(self, parts: list[tuple[int, int]]) -> Future:
        first, last = parts[0][0], parts[-1][1]
        address = None if self.store is None else self.store.address
        return self.client.submit(
            fly_cases,
            self.bundle,
            version("reentry-fmus"),
            first,
            last,
            address,
            key=f"cases-{first}-{last}-{uuid.uuid4().hex}",
            retries=2,
        )

    def done(self, tasks: Iterable[Future]) -> list[Future]:
        """Waits until a task is done, but no longer than `LOOK`."""
        try:
            wait(list(tasks), timeout=LOOK, return_when="FIRST_COMPLETED")
        except TimeoutError:
            pass
        except CANCELLED as error:
            raise self.lost("the connection to the scheduler was lost") from error
        if self.client.status != "running":
            raise self.lost("the connection to the scheduler was closed")
        if any(task.status in ("lost", "cancelled") for task in tasks):
            raise self.lost("the scheduler no longer knows its tasks")
        return [task for task in tasks if task.done()]

    def keep(self, task: Future, parts: list[tuple[int, int]]) -> bool:
        """Stores the parts that a task has flown. Returns False if Dask gave the task up because it
        was lost with several workers, which may have been taken away for other reasons."""
        try:
            flown, seconds = task.result()
        except KilledWorker as error:
            self.given_up[parts[0]] += 1
            if self.given_up[parts[0]] == GIVEN_UP:
                raise self.lost(str(error)) from error
            return False
        except (Exception, *CANCELLED) as error:
            cases = f"cases {parts[0][0]} to {parts[-1][1] - 1}"
            raise self.lost(f"{cases}: {error}") from error
        now = seconds / len(parts)
        self.part = now if not self.part else 0.5 * (self.part + now)
        for name, content in flown.items():
            if self.store is None:
                put(self.folder / "parts" / name, content)
            else:
                self.store.fetch(name, self.folder / "parts")
        return True

    def lost(self, problem: str) -> ClusterError:
        part_count = sum(1 for _ in (self.folder / "parts").glob("*.parquet"))
        where = "" if self.store is None else f" and {self.store.address}"
        return ClusterError(
            f"{problem}. {part_count} parts are flown and kept in {self.folder}{where}; "
            "the same call of run continues from there, with a client that is connected"
        )


def fly_cases(
    bundle: str, driver_version: str, first: int, last: int, address: str | None
) -> tuple[dict[str, bytes], float]:
    """Flies parts on a worker. Returns the parts' files by name, which are empty if they are kept
    at the address, and the time that it took, s."""
    begin = time.perf_counter()
    worker = get_worker()
    worker_version = version("reentry-fmus")
    if worker_version != driver_version:
        raise ClusterError(
            f"{worker.address} has reentry-fmus {worker_version}, "
            f"but the driver has {driver_version}"
        )
    # Dask removes the folder of a worker that was killed.
    with tempfile.TemporaryDirectory(prefix="cases-", dir=worker.local_directory) as out:
        path = place(worker, bundle) / "campaign.toml"
        command = [str(program()), "campaign", str(path), "--out", out, "--quiet", "--jobs", "1"]
        # FMUs that share the program's process here do so there.
        command += ["--cases", f"{first}..{last}", "--fmu-dir", str(path.parent / "fmu")]
        done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8")
        if done.returncode != 0:
            error = done.stderr.partition("error: ")[2].strip() or done.stderr.strip()
            raise ClusterError(f"{worker.address}: {error or f'exit code {done.returncode}'}")
        parts = sorted(Path(out, "parts").glob("*.parquet"))
        if address is None:
            flown = {path.name: path.read_bytes() for path in parts}
        else:
            store = Store(address)
            for path in parts:
                store.keep(path, f"parts/{path.name}")
            flown = {path.name: b"" for path in parts}
    return flown, time.perf_counter() - begin


def put(path: Path, content: bytes) -> None:
    """Writes a file that is either there as a whole or not at all."""
    unfinished = path.with_suffix(f".unfinished-{uuid.uuid4().hex}")
    unfinished.write_bytes(content)
    os.replace(unfinished, path)


class Store:
    """A folder that fsspec reaches: on a shared disk, or in the cloud."""

    def __init__(self, address: str) -> None:
        self.address = address.rstrip("/")
        self.files, self.root = fsspec.core.url_to_fs(self.address)

    def names(self) -> set[str]:
        """Returns the names of the parts at the address."""
        self.files.invalidate_cache()
        try:
            paths = self.files.ls(f"{self.root}/parts", detail=False)
        except FileNotFoundError:
            return set()
        return {Path(path).name for path in paths if path.endswith(".parquet")}

    def keep(self, path: Path, name: str) -> None:
        """Copies a file to the address. It appears under its name when it is complete."""
        target = f"{self.root}/{name}"
        unfinished = f"{target}.unfinished-{uuid.uuid4().hex}"
        self.files.makedirs(target.rpartition("/")[0], exist_ok=True)
        self.files.pipe_file(unfinished, path.read_bytes())
        self.files.mv(unfinished, target)

    def fetch(self, name: str, folder: Path) -> None:
        """Copies a part from the address into a folder."""
        put(folder / name, self.files.cat_file(f"{self.root}/parts/{name}"))
