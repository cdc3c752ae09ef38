"""Tests of the repository by their names, for pages that name the tests behind their claims."""

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
GENERATED = {"target", ".venv", "out", "dist"}


@cache
def tests() -> frozenset[str]:
    """Names of all tests, in Rust and Python."""
    found: set[str] = set()
    crates = [path.parent for path in ROOT.glob("**/Cargo.toml") if not GENERATED & set(path.relative_to(ROOT).parts)]
    for path in {path for crate in crates if crate != ROOT for path in crate.rglob("*.rs")}:
        if not GENERATED & set(path.relative_to(ROOT).parts):
            found.update(re.findall(r"#\[test\]\s*(?:#\[[^\n]*\]\s*)*fn (\w+)", path.read_text(encoding="utf-8")))
    for path in (ROOT / "tests").glob("test_*.py"):
        found.update(re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.MULTILINE))
    return frozenset(found)


def exists(test: str) -> bool:
    """Whether there is such a test; with … at its end, one whose name begins so."""
    return any(name.startswith(test[:-1]) for name in tests()) if test.endswith("…") else test in tests()
