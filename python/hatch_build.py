"""Adds FMUs, program and experiments to a wheel, and gives it the platform that they are built
for. Environment variables say where they are; `scripts/wheel` sets them."""

from __future__ import annotations

import os
import re
import sysconfig
import zipfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Tag of the wheel of each platform, and how its programs and libraries begin. `host` is for tests on
# this very machine: its tag promises nothing about older systems.
PLATFORMS = {
    "linux-x86_64": ("manylinux2014_x86_64", rb"\x7fELF.{14}\x3e\0"),
    "linux-aarch64": ("manylinux2014_aarch64", rb"\x7fELF.{14}\xb7\0"),
    "windows-x86_64": ("win_amd64", rb"MZ.*?PE\0\0\x64\x86"),
    "macos-universal": ("macosx_11_0_universal2", rb"\xca\xfe\xba\xbe"),
    "macos-x86_64": ("macosx_11_0_x86_64", rb"\xcf\xfa\xed\xfe\x07"),
    "macos-aarch64": ("macosx_11_0_arm64", rb"\xcf\xfa\xed\xfe\x0c"),
    "host": (sysconfig.get_platform().replace("-", "_").replace(".", "_"), rb""),
}
DATA = "reentry_fmus/data"
LIBRARIES = (".so", ".dll", ".dylib")
# The newest symbols of the C library that manylinux2014 allows.
GLIBC = 17


def glibc(content: bytes) -> int:
    """Returns the newest minor version of glibc 2 that a program or library asks for."""
    return max((int(minor) for minor in re.findall(rb"GLIBC_2\.(\d+)", content)), default=0)


def libraries(path: Path) -> list[bytes]:
    """Returns the libraries in an FMU."""
    with zipfile.ZipFile(path) as archive:
        return [archive.read(name) for name in archive.namelist() if name.endswith(LIBRARIES)]


class PlatformHook(BuildHookInterface):  # type: ignore[type-arg]
    def given(self, variable: str) -> str:
        """Returns an environment variable that must be set."""
        value = os.environ.get(variable)
        if not value:
            self.app.abort(f"{variable} is not set: build the wheel with scripts/wheel")
        return str(value)

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        platform = self.given("WHEEL_PLATFORM")
        fmus = Path(self.given("WHEEL_FMUS"))
        program = Path(self.given("WHEEL_PROGRAM"))
        if platform not in PLATFORMS:
            names = ", ".join(PLATFORMS)
            self.app.abort(f"there is no platform {platform}; there are: {names}")
        tag, beginning = PLATFORMS[platform]
        archives = sorted(fmus.glob("*.fmu"))
        if not archives:
            self.app.abort(f"there are no FMUs (*.fmu) in {fmus}")
        libraries_of = {program: [program.read_bytes()]}
        libraries_of |= {archive: libraries(archive) for archive in archives}
        for path, contents in libraries_of.items():
            if not any(re.match(beginning, content, re.DOTALL) for content in contents):
                self.app.abort(f"{path} has no program or library for {platform}")
            newest = max(glibc(content) for content in contents)
            if "manylinux2014" in tag and newest > GLIBC:
                self.app.abort(f"{path} needs glibc 2.{newest}, but {tag} allows 2.{GLIBC}")

        root = Path(self.root).parent / "orchestrator"
        # The program finds experiments and FMUs that lie beside it from any folder. Editors find
        # the schema by the first line of each experiment.
        files = {archive: f"fmu/{archive.name}" for archive in archives}
        files[program] = "orchestrator" + program.suffix
        for folder in ("experiments", "schema"):
            for path in sorted((root / folder).rglob("*")):
                if path.suffix in (".toml", ".csv", ".json"):
                    files[path] = path.relative_to(root).as_posix()
        # A release adds the licences of what is linked in.
        for notice in filter(None, os.environ.get("WHEEL_NOTICES", "").split(os.pathsep)):
            files[Path(notice)] = Path(notice).name
        # The page for browsers, which is the same on every platform, may not have been built.
        page = Path(os.environ.get("WHEEL_PAGE") or root.parent / "out" / "browser" / "index.html")
        if page.is_file():
            files[page] = "try.html"
        build_data["force_include"].update(
            {str(path): f"{DATA}/{place}" for path, place in files.items()}
        )
        build_data["pure_python"] = False
        build_data["tag"] = f"py3-none-{tag}"
