"""Archives of FMUs, each of which is unpacked and loaded once in a process."""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import sys
import tempfile
import threading
import time
from functools import cache
from multiprocessing.util import Finalize
from pathlib import Path
from typing import Any

import fmpy

PREFIX = "unpacked-fmu-"
"""Beginning of the names of temporary folders, which the number of the process follows. The
orchestrator has the same, so that each of the two removes what the other one has left."""
AGE = 60.0
"""Age from which a folder that nobody holds is removed although its process may live, s."""


class Folder:
    """A temporary folder, which is removed when the process ends that has made it, and not when one
    ends that was forked from it. If the process was killed, a later one removes the folder."""

    def __init__(self) -> None:
        look_once()
        self.path = Path(tempfile.mkdtemp(prefix=f"{PREFIX}{os.getpid()}-"))
        # Its priority lets it run after the children of `multiprocessing` have ended.
        arguments = (self.path, held(self.path))
        self.remove = Finalize(None, _remove, args=arguments, exitpriority=-1)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.remove()


def _remove(folder: Path, hold: int | None) -> None:
    if hold is not None:
        os.close(hold)
    # Killed processes may have been about to write a file.
    for _ in range(10):
        shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            return
        time.sleep(0.02)


def held(folder: Path) -> int | None:
    """Holds a folder, as the orchestrator does, and returns the descriptor that is open as long;
    None if another process holds it, or if it cannot be held."""
    descriptor = None
    try:
        if sys.platform == "win32":
            import msvcrt

            descriptor = os.open(folder / ".hold", os.O_CREAT | os.O_RDWR)
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            descriptor = os.open(folder, os.O_RDONLY | os.O_NOFOLLOW)
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if descriptor is not None:
            os.close(descriptor)
        return None
    return descriptor


@cache
def look_once() -> None:
    """Removes what killed processes have left when this one makes its first folder."""
    remove_left()


def remove_left() -> None:
    """Removes the folders that killed processes have left."""
    for folder in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        number = folder.name.removeprefix(PREFIX).partition("-")[0]
        try:
            about = folder.lstat()
        except OSError:
            continue
        has_ended = Path("/proc/self").exists() and not Path("/proc", number).exists()
        is_left = stat.S_ISDIR(about.st_mode) and (has_ended or time.time() - about.st_mtime > AGE)
        if is_left and (hold := held(folder)) is not None:
            _remove(folder, hold)


class Unpacked:
    """An unpacked archive with its description and the path of its library."""

    def __init__(self, archive: Path, folder: Path) -> None:
        fmpy.extract(str(archive), str(folder))
        self.folder = folder
        self.description: Any = fmpy.read_model_description(str(folder))
        self.interface: Any = self.description.coSimulation
        if self.interface is None:
            raise ValueError(f"{archive}: the FMU has no co-simulation, which a loop needs")
        self.is_shared = not self.interface.canBeInstantiatedOnlyOncePerProcess
        # FMI 2.0 names no folder for ARM processors; FMI 3.0 does.
        file = f"{self.interface.modelIdentifier}{fmpy.sharedLibraryExtension}"
        places = [folder / "binaries" / name / file for name in platforms()]
        present = [place for place in places if place.is_file()]
        if not present:
            name = self.description.modelName
            raise FileNotFoundError(f"{name} has no library for {fmpy.platform_tuple}")
        self.library = str(present[0])

    def release(self) -> None:
        """Removes the folder if it is for one instance alone."""
        if not self.is_shared:
            shutil.rmtree(self.folder, ignore_errors=True)


def platforms() -> tuple[str, str]:
    """Returns the names that the folder of this platform's library may have."""
    return fmpy.platform_tuple, fmpy.platform


class Copies:
    """Unpacked archives of this process, by the hash of their content.

    A library of this project stays loaded until the process ends, because data of threads must not
    outlive its code. So it is loaded from one place, and each further instance shares it.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Lets the process begin without copies."""
        self._lock = threading.Lock()
        self._shared: dict[str, Unpacked] = {}
        self._folder: Folder | None = None
        self._count = 0

    def open(self, archive: Path) -> Unpacked:
        """Returns the copy of an archive; one of its own for an instance of an FMU that can be
        instantiated only once per process, which a library of its own makes possible again."""
        digest = hashlib.sha256(archive.read_bytes()).hexdigest()
        with self._lock:
            found = self._shared.get(digest)
            if found is not None and found.folder.is_dir():
                return found
            if self._folder is None or not self._folder.path.is_dir():
                self._folder = Folder()
            self._count += 1
            folder = self._folder.path / f"{digest[:16]}-{self._count}"
            try:
                unpacked = Unpacked(archive, folder)
            except BaseException:
                shutil.rmtree(folder, ignore_errors=True)
                raise
            if unpacked.is_shared:
                self._shared[digest] = unpacked
            return unpacked


copies = Copies()

if hasattr(os, "register_at_fork"):
    # The folder is the parent's, which may remove it at any time.
    os.register_at_fork(after_in_child=copies.forget)
