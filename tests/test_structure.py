"""The modules of a Rust crate, and those of the Python package, use each other in one direction:
there are no circles.

A module uses another if a `use` declaration or a path outside its tests names something of it. A
module that re-exports its own parts (`pub use`) does not use them.
"""

import ast
import re
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
CRATES = sorted(
    path.parent.relative_to(ROOT).as_posix()
    for path in ROOT.glob("**/Cargo.toml")
    if (path.parent / "src").is_dir() and not {"target", ".venv", "out"} & set(path.relative_to(ROOT).parts)
)


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
    """The paths in a tree of a use declaration."""
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
        user, text = module(file, source), code(file)
        paths = [leaf for tree in re.findall(r"\buse ([^;]+);", text) for leaf in leaves(tree)]
        paths += re.findall(r"\b(?:crate|super)(?:::\w+)+", re.sub(r"\buse [^;]+;", "", text))
        for path in paths:
            parts = path.split(" as ")[0].split("::")
            if parts[0] == "crate":
                parts, at = parts[1:], ()
            elif parts[0] == "self":
                parts, at = parts[1:], user
            elif parts[0] == "super":
                up = len([part for part in parts if part == "super"])
                parts, at = parts[up:], user[: len(user) - up]
            elif (*user, parts[0]) in modules:
                at = user
            else:
                continue
            used = (*at, *parts)
            while used not in modules:
                used = used[:-1]
            if used != user and used:
                graph[user].add(used)
    return graph


@pytest.mark.parametrize("crate", CRATES)
def test_modules_use_each_other_in_one_direction(crate: str) -> None:
    try:
        list(TopologicalSorter(uses(crate)).static_order())
    except CycleError as error:
        pytest.fail(f"{crate}: " + " uses ".join("::".join(name) for name in reversed(error.args[1])))


def test_the_modules_of_the_python_package_use_each_other_in_one_direction() -> None:
    graph = {
        file.stem: {
            name
            for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
            if isinstance(node, ast.ImportFrom) and node.level
            for name in ([node.module] if node.module else [alias.name for alias in node.names])
        }
        for file in (ROOT / "python" / "src" / "reentry_fmus").glob("*.py")
    }
    assert graph["__init__"] > {"_campaign", "_loop"}
    TopologicalSorter(graph).prepare()


def test_what_the_orchestrator_knows_of_a_vehicle_is_what_the_architecture_says() -> None:
    """Its crates name no quantity of a vehicle, except for the roles in the picture of one, and the
    inputs and the output of a law in another program."""
    words = re.compile(r"\b(attitude|sideslip|bank|deflections?|moments?|elevons?)\b", re.IGNORECASE)
    crates = [ROOT / "orchestrator" / name / "src" for name in ("master", "import", "cosim", "metrics", "report", "sweep", "study", "campaign", "linear")]
    files = [file for crate in crates for file in crate.rglob("*.rs") if file.stem != "tests"]
    knowing = {file.relative_to(ROOT / "orchestrator").as_posix() for file in files if words.search(code(file))}
    pictures = {"recording/effectors.rs", "recording/trajectory.rs", "run_page/data.rs", "run_page/mod.rs", "run_page/plans.rs"}
    assert knowing == {"cosim/src/experiment/vehicle.rs", "import/src/law.rs", *(f"report/src/{name}" for name in pictures)}
