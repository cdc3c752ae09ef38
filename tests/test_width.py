"""Prose is at most 100 columns wide: pages and the comments of Rust code. Code is as `rustfmt.toml`
says. Tables, pictures, blocks of code and addresses cannot be broken.
"""

import subprocess
from pathlib import Path

ROOT = Path(__file__).parent.parent
WIDTH = 100


def files(pattern: str) -> list[Path]:
    listed = subprocess.run(["git", "ls-files", pattern], cwd=ROOT, capture_output=True, text=True, check=True)
    return [ROOT / name for name in listed.stdout.splitlines()]


def prose(file: Path) -> list[tuple[int, str]]:
    """Lines of a page that can be broken, with their numbers."""
    lines, is_code = [], False
    for number, line in enumerate(file.read_text().splitlines(), start=1):
        is_code ^= line.lstrip().startswith("```")
        if not is_code and not line.lstrip().startswith(("|", "![", "[![")) and " " in line.strip():
            lines.append((number, line))
    return lines


def test_pages_are_100_columns_wide() -> None:
    wide = [
        f"{file.relative_to(ROOT)}:{number}"
        for file in files("*.md")
        for number, line in prose(file)
        if len(line) > WIDTH and "://" not in line
    ]
    assert not wide


def test_comments_are_100_columns_wide() -> None:
    wide = [
        f"{file.relative_to(ROOT)}:{number}"
        for file in files("*.rs")
        for number, line in enumerate(file.read_text().splitlines(), start=1)
        if line.lstrip().startswith("//") and len(line) > WIDTH and "://" not in line and "| " not in line
    ]
    assert not wide
