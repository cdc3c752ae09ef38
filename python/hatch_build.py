"""Adds FMUs, program and experiments to a wheel, and gives it the platform that they are built
for. Environment variables say where they are; `scripts/wheel` sets them."""

from __future__ import annotations

import os
import re
import struct
import sysconfig
import zipfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Tag of the wheel and machine code of each platform. `host` is for tests on this very machine: its
# tag promises nothing about older systems.
PLATFORMS = {
    "linux-x86_64": ("manylinux2014_x86_64", "ELF x86_64"),
    "linux-aarch64": ("manylinux2014_aarch64", "ELF aarch64"),
    "windows-x86_64": ("win_amd64", "PE x86_64"),
    "macos-universal": ("macosx_11_0_universal2", "Mach-O universal"),
    "macos-x86_64": ("macosx_11_0_x86_64", "Mach-O x86_64"),
    "macos-aarch64": ("macosx_11_0_arm64", "Mach-O aarch64"),
    "host": (sysconfig.get_platform().replace("-", "_").replace(".", "_"), None),
}
DATA = "reentry_fmus/data"
LIBRARIES = (".so", ".dll", ".dylib")
# The newest symbols of the C library that manylinux2014 allows.
GLIBC = 17


def machine_code(content: bytes) -> str:
    """Returns the format of a program or library and the processor that it is for."""
    if content[:4] == b"\x7fELF":
        code = struct.unpack_from("<H", content, 18)[0]
        return "ELF " + {62: "x86_64", 183: "aarch64"}.get(code, f"machine {code}")
    if content[:2] == b"MZ":
        code = struct.unpack_from("<H", content, struct.unpack_from("<I", content, 60)[0] + 4)[0]
        return "PE " + {0x8664: "x86_64", 0xAA64: "aarch64"}.get(code, f"machine {code}")
    if content[:4] == b"\xca\xfe\xba\xbe":
        return "Mach-O universal"
    if content[:4] == b"\xcf\xfa\xed\xfe":
        code = struct.unpack_from("<I", content, 4)[0] & 0xFF
        return "Mach-O " + {7: "x86_64", 12: "aarch64"}.get(code, f"machine {code}")
    return "no program or library"


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
        tag, required = PLATFORMS[platform]
        required = required or machine_code(program.read_bytes())
        archives = sorted(fmus.glob("*.fmu"))
        if not archives:
            self.app.abort(f"there are no FMUs (*.fmu) in {fmus}")
        libraries_of = {program: [program.read_bytes()]}
        libraries_of |= {archive: libraries(archive) for archive in archives}
        for path, contents in libraries_of.items():
            formats = sorted(machine_code(content) for content in contents)
            if required not in formats:
                self.app.abort(f"{path} has {formats}, but {required} is needed")
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
