"""The modules of a Rust crate use each other in one direction: there are no circles.

A module uses another if a `use` declaration or a path outside its tests names something of it. A
module that re-exports its own parts (`pub use`) does not use them.
"""

import re
import subprocess
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CRATES = sorted(
    path.parent.relative_to(ROOT).as_posix()
    for path in ROOT.glob("**/Cargo.toml")
    if (path.parent / "src").is_dir() and not {"target", ".venv", "out"} & set(path.relative_to(ROOT).parts)
)
LONGEST = 400


def module(file: Path, source: Path) -> tuple[str, ...]:
    """Path of the module that a file holds: () for the root of a crate."""
    parts = file.relative_to(source).with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib", "main") else parts


def code(file: Path) -> str:
    """Text of a file without comments, tests and re-exports."""
    text = re.sub(r"//[^\n]*", "", file.read_text())
    text = re.split(r"#\[cfg\(test\)\]\s*mod \w+\s*\{", text)[0]
    return re.sub(r"pub(\([^)]*\))? use [^;]*;", "", text)


def leaves(tree: str) -> list[str]:
    """The paths that a tree of a use declaration stands for."""
    depth, start, parts = 0, 0, []
    head = re.match(r"([\w:]*?)(?:::)?\{(.*)\}$", tree, re.S)
    if not head:
        return [tree.strip()]
    inner = head[2]
    for place, symbol in enumerate(inner + ","):
        depth += (symbol == "{") - (symbol == "}")
        if symbol == "," and depth == 0:
            if part := inner[start:place].strip():
                parts += [f"{head[1]}::{leaf}" for leaf in leaves(part)]
            start = place + 1
    return parts


def uses(crate: str) -> dict[tuple[str, ...], set[tuple[str, ...]]]:
    """The modules of a crate with those that each of them uses."""
    source = ROOT / crate / "src"
    files = [file for file in source.rglob("*.rs") if "tests" not in file.relative_to(source).with_suffix("").parts]
    modules = {module(file, source) for file in files}
    graph = {name: set() for name in modules}
    for file in files:
        own, text = module(file, source), code(file)
        paths = [leaf for tree in re.findall(r"\buse ([^;]+);", text) for leaf in leaves(tree)]
        paths += re.findall(r"\b(?:crate|super)(?:::\w+)+", re.sub(r"\buse [^;]+;", "", text))
        for path in paths:
            parts = path.split(" as ")[0].split("::")
            if parts[0] == "crate":
                parts, at = parts[1:], ()
            elif parts[0] == "self":
                parts, at = parts[1:], own
            elif parts[0] == "super":
                up = len([part for part in parts if part == "super"])
                parts, at = parts[up:], own[: len(own) - up]
            elif (*own, parts[0]) in modules:
                at = own
            else:
                continue
            found = (*at, *parts)
            while found not in modules:
                found = found[:-1]
            if found != own and found:
                graph[own].add(found)
    return graph


@pytest.mark.parametrize("crate", CRATES)
def test_modules_use_each_other_in_one_direction(crate: str) -> None:
    try:
        list(TopologicalSorter(uses(crate)).static_order())
    except CycleError as error:
        pytest.fail(f"{crate}: " + " uses ".join("::".join(name) for name in reversed(error.args[1])))


def test_no_file_is_too_long() -> None:
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True)
    files = [Path(name) for name in tracked.stdout.splitlines() if (ROOT / name).is_file()]
    scripts = [file for file in files if file.parts[0] == "scripts" and not file.suffix]
    # The tests in Python are lists of cases.
    code = [file for file in files if file.suffix in (".rs", ".py", ".sh") and not file.match("tests/test_*.py")]
    long = {
        file.as_posix(): count
        for file in code + scripts
        if (count := len((ROOT / file).read_text(encoding="utf-8").splitlines())) > LONGEST
    }
    assert not long
