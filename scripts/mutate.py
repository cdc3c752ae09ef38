"""Plants each fault of tests/mutations.toml in a copy of the sources, and checks that a test fails.

    python scripts/mutate.py [N …]      all faults, or those with these numbers, from 1 on

The exit code is 1 if a fault survives. The copy and its build are in target/mutations.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
COPY = ROOT / "target" / "mutations" / "sources"
BUILD = ROOT / "target" / "mutations" / "target"


def copy_sources() -> None:
    """Brings the copy up to date; files that are the same keep their times, so that they are not
    compiled again."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True)
    for name in filter(None, listed.stdout.split("\0")):
        source, target = ROOT / name, COPY / name
        if source.is_file() and (not target.is_file() or source.read_bytes() != target.read_bytes()):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)


def failing(package: str, modules: list[str], options: list[str]) -> str | None:
    """Returns what fails in the tests within a package, and in these modules of its other tests, or
    None if all of them pass. The package may be another one than that of the fault."""
    chosen = [["--lib"]] + ([["--test", "main", "--", *(f"{name}::" for name in modules)]] if modules else [])
    for tests in chosen:
        command = ["cargo", "test", "--locked", "--target-dir", BUILD, "-p", package, *options, *tests]
        tested = subprocess.run(command, cwd=COPY, capture_output=True, text=True)
        if tested.returncode != 0:
            lines = tested.stdout.splitlines()
            failed = [line.split()[1] for line in lines if line.startswith("test ") and line.endswith("FAILED")]
            if not failed:
                sys.exit(f"error: the tests could not be built or run:\n{tested.stderr}")
            return failed[0]
    return None


def main() -> None:
    mutations = tomllib.loads((ROOT / "tests" / "mutations.toml").read_text(encoding="utf-8"))["mutation"]
    numbers = [int(argument) for argument in sys.argv[1:]] or list(range(1, len(mutations) + 1))
    copy_sources()
    survivors = 0
    for number in numbers:
        mutation = mutations[number - 1]
        path = COPY / mutation["file"]
        text = path.read_text(encoding="utf-8")
        if text.count(mutation["from"]) != 1:
            sys.exit(f"error: mutation {number}: {mutation['file']} has its text {text.count(mutation['from'])} times, not once")
        path.write_text(text.replace(mutation["from"], mutation["to"]), encoding="utf-8")
        try:
            failed = failing(mutation["package"], mutation["tests"], mutation.get("options", []))
        finally:
            path.write_text(text, encoding="utf-8")
        survivors += failed is None
        print(f"{number:2} {'SURVIVES' if failed is None else 'fails ' + failed}: {mutation['what']}", flush=True)
    print(f"{survivors} of {len(numbers)} survive")
    sys.exit(survivors > 0)


if __name__ == "__main__":
    main()
