"""Every block of code in the pages is run, or checked, or stands with its reason in
tests/snippets.toml."""

import ast
import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import NamedTuple

import jsonschema
import pytest

from conftest import ROOT, TARGET, merged, program, tomllib


RULES = tomllib.loads((ROOT / "tests" / "snippets.toml").read_text())


class Block(NamedTuple):
    page: str
    line: int
    language: str
    text: str
    printed: str | None

    def __str__(self):
        return f"{self.page}:{self.line}"


def blocks():
    listed = subprocess.run(["git", "ls-files", "*.md"], cwd=ROOT, capture_output=True, text=True, check=True)
    for page in listed.stdout.split():
        text = (ROOT / page).read_text(encoding="utf-8")
        # A block, and what it prints if the page says so at once.
        for match in re.finditer(r"^```(\w*)\n(.*?)^```$(?=(?:\n\n```text\n(.*?)^```$)?)", text, re.S | re.M):
            yield Block(page, text.count("\n", 0, match.start()) + 1, *match.groups())


BLOCKS = list(blocks())


def elsewhere(block):
    """Why a block is not run here."""
    tested = RULES["tested_by"]
    test = tested.get(block.page) or tested.get(f"{block.page} {block.language}")
    # The tests of the package leave out what reads the FMUs of a build.
    if test and not (test.startswith("python/") and "target/fmu" in block.text):
        assert (ROOT / test).is_file()
        return test
    return RULES["languages"].get(block.language)


def here(language):
    chosen = [block for block in BLOCKS if block.language == language and not elsewhere(block)]
    return pytest.mark.parametrize("block", chosen, ids=str)


def commands(block):
    """The lines of a block as they are run."""
    for line in block.text.splitlines():
        line = re.sub(r"\s+# .*", "", line)
        if not line or any(re.search(rule["find"], line) for rule in RULES["skip"]):
            continue
        for rule in RULES["shorten"]:
            if re.search(rule["find"], line):
                line = f"{line} {rule['append']}"
        yield line


def test_every_block_has_a_language_that_is_known():
    known = {"sh", "toml", "python", *RULES["languages"]}
    assert [str(block) for block in BLOCKS if block.language not in known] == []


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    return cache(lambda page: prepared(tmp_path_factory.mktemp(Path(page).stem)))


@pytest.fixture
def project(block, folders):
    """A folder like the project's, in which the blocks of a page run one after the other."""
    return folders(block.page)


def prepared(folder):
    for name in ("orchestrator", "docs"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "target").mkdir()
    for name in ("fmu", "fmi3"):
        (folder / "target" / name).symlink_to(TARGET / name)
    (folder / "target" / "release").symlink_to(program("orchestrator").parent)
    # Names of the reader's own experiment and law in the pages.
    (folder / "my.toml").write_text(merged(ROOT / "orchestrator/experiments/crmpc-2022/crmpc-robust.toml"))
    (folder / "MyLaw.fmu").symlink_to(TARGET / "fmu" / "LQR.fmu")
    return folder


def run(command, folder):
    path = f"{folder / 'target' / 'release'}:{Path(sys.executable).parent}:{os.environ['PATH']}"
    done = subprocess.run(command, cwd=folder, env={**os.environ, "PATH": path}, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, f"{command}\n{done.stdout}{done.stderr}"
    return done.stdout


def check_printed(block, printed):
    """Every line that the page shows begins a line of the output."""
    lines = [" ".join(line.split()) for line in printed.splitlines()]
    for line in (block.printed or "").splitlines():
        assert any(found.startswith(" ".join(line.split())) for found in lines), f"{block}: {line}\n{printed}"


@here("sh")
def test_the_commands_run(block, project):
    lines = list(commands(block))
    check_printed(block, run(["bash", "-euo", "pipefail", "-c", "\n".join(lines)], project) if lines else "")


@here("python")
def test_the_programs_run(block, project):
    ast.parse(block.text)
    check_printed(block, run([sys.executable, "-c", block.text], project))


@cache
def schema(kind, complete):
    """The JSON Schema of a kind of file; a part of a file need not have what a whole one must."""
    text = (ROOT / "orchestrator" / "schema" / f"{kind}.json").read_text()
    return json.loads(text, object_hook=lambda table: {k: v for k, v in table.items() if complete or k != "required" or isinstance(v, dict)})


def kind_of(table):
    """The file that a block is a part of, and whether it is a whole file."""
    if "experiment" in table or "search" in table:
        return "campaign", "experiment" in table
    if "run" in table or "claim" in table:
        return "study", True
    if table.keys() & {"reference", "forces", "moments", "surfaces", "jets"}:
        return "vehicle", {"title", "reference", "forces"} <= set(table)
    return "experiment", {"simulation", "record"} <= set(table)


@here("toml")
def test_the_files_are_as_the_schemas_say(block, project):
    table = tomllib.loads(block.text)
    kind, complete = kind_of(table)
    jsonschema.validate(table, schema(kind, complete))
    if kind == "experiment" and complete:
        (project / "block.toml").write_text(block.text)
        run(["orchestrator", "run", "block.toml", "--stop", "1", "--out", "out/block", "--force"], project)
