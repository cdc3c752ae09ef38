"""Writes the pages of the manual that follow from other files: the variables of every FMU from the
committed descriptions, the keys of experiments, studies and campaigns from their JSON Schemas, the
items of the papers from docs/claims, where every setting acts, and the API in Python and Rust.
Nothing of it is committed.
"""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path += [str(ROOT / "scripts" / "pages")]

import claims
import parameters

CAUSALITIES = {"input": "Inputs", "output": "Outputs", "parameter": "Parameters"}
# The pages that explain FMUs; the others are controllers in laws.md.
PAGES = {
    "ReentryPlant": "vehicle",
    "CRMPC": "CRMPC",
    "ControlAllocator": "allocation-estimation",
    "AttitudeEstimator": "allocation-estimation",
    "EntryGuidance": "entry",
    "EntryNavigation": "entry",
}
# Where a kind of file is explained with examples.
EXPLAINED = {"experiment": "experiments", "study": "studies", "campaign": "campaigns"}


def variables(folder):
    """Writes a page for each FMU, and one that lists them."""
    lines = ["# Variables of every FMU\n", "| FMU | what it is | inputs | outputs | parameters |", "|---|---|---|---|---|"]
    names = sorted(path.stem for path in ROOT.glob("fmu-*/generated/*.xml"))
    for name in names:
        root = parameters.description(name)
        tables = {kind: list(parameters.rows(root, kind)) for kind in CAUSALITIES}
        numbers = " | ".join(str(len(rows)) for rows in tables.values())
        lines.append(f"| [{name}](variables/{name}.md) | {root.get('description')} | {numbers} |")
        parts = [f"# {name}: variables\n", f"{root.get('description')}. {explained(name)}\n"]
        for kind, rows in tables.items():
            if rows:
                parts.append(f"## {CAUSALITIES[kind]}\n\n{variable_table(name, rows)}\n")
        write(folder / "variables" / f"{name}.md", "\n".join(parts))
    lines.append("\n```{toctree}\n:hidden:\n\n" + "\n".join(f"variables/{name}" for name in names) + "\n```")
    write(folder / "variables.md", "\n".join(lines))


def explained(name):
    page = PAGES.get(name, "laws")
    return f"Angles are shown in degrees and are in radians in FMI. [{page}.md](../../docs/{page}.md) explains the FMU."


def variable_table(fmu, rows):
    table = [["variable", "start", "unit", "range", "meaning"]]
    for (stem, span, unit, meaning, _), entries in parameters.grouped(rows):
        endings = [ending if not ending or ending.startswith("[") else f".{ending}" for ending, _ in entries]
        entry = [f"{{variable}}`{fmu}.{stem}{ending}`" for ending in endings]
        name = ", ".join(entry) if len(entry) <= 3 else f"{entry[0]} … {entry[-1]}"
        starts = [start or "" for _, start in entries]
        start = starts[0] if len(set(starts)) == 1 else ", ".join(starts) if len(starts) <= 10 else "various"
        table.append([name, start, unit, span, meaning])
    # Outputs have no start value, and few variables have a range.
    filled = [column for column in zip(*table) if any(column[1:])]
    lines = ["| " + " | ".join(row) + " |" for row in zip(*filled)]
    return "\n".join([lines[0], "|---" * len(filled) + "|", *lines[1:]])


def keys(folder, kind):
    """Writes the page of a kind of file: a table for the file, and one for each table in it."""
    schema = json.loads((ROOT / "orchestrator" / "schema" / f"{kind}.json").read_text(encoding="utf-8"))
    schema["definitions"].pop("Scalar", None)
    parts = [
        f"# Keys of {EXPLAINED[kind]}\n",
        f"{schema['description']}\n\n[{EXPLAINED[kind]}.md](../docs/{EXPLAINED[kind]}.md) explains them with examples, and "
        f"`orchestrator schema {kind}` prints the JSON Schema.\n",
        key_table(schema, kind),
    ]
    for name, definition in sorted(schema["definitions"].items()):
        parts.append(f"## {name}\n\n{prose(definition)}\n")
        if "properties" in definition:
            parts.append(key_table(definition, f"{kind}.{name}"))
        elif "oneOf" in definition:
            parts.append("| value | meaning |\n|---|---|")
            parts[-1] += "".join(f"\n| `{item['const']}` | {prose(item)} |" for item in definition["oneOf"]) + "\n"
    write(folder / f"{kind}-keys.md", "\n".join(parts))


def key_table(table, owner):
    required = table.get("required", [])
    lines = ["| key | type | default | meaning |", "|---|---|---|---|"]
    for name, key in table["properties"].items():
        default = "required" if name in required else shown(key.get("default"))
        lines.append(f"| {{key}}`{owner}.{name}` | {type_of(key)} | {default} | {prose(key)} |")
    return "\n".join(lines) + "\n"


def shown(value):
    return "" if value in (None, [], {}, "") else f"`{json.dumps(value, ensure_ascii=False)}`"


def prose(item):
    return re.sub(r"\s+", " ", item.get("description", "")).replace("|", "\\|").replace("[[", "\\[\\[")


def type_of(key):
    """Returns the values that a key may have, in words."""
    if "$ref" in key:
        name = key["$ref"].rpartition("/")[2]
        return "number, text or truth value" if name == "Scalar" else f"[{name}](#{name.lower()})"
    for several in ("anyOf", "oneOf", "allOf"):
        if several in key:
            return " or ".join(dict.fromkeys(type_of(one) for one in key[several] if one.get("type") != "null"))
    kinds = key.get("type", "any")
    kinds = [kinds] if isinstance(kinds, str) else [kind for kind in kinds if kind != "null"]
    words = {"string": "text", "integer": "whole number", "boolean": "true or false", "number": "number", "any": "any value"}
    return " or ".join(words.get(kind) or {"array": array, "object": table}[kind](key) for kind in kinds)


def array(key):
    return f"list of {type_of(key.get('items', {}))}"


def table(key):
    held = key.get("additionalProperties")
    return f"table of {type_of(held)}" if isinstance(held, dict) else "table"


def settings(folder, table):
    """Copies the table of tests/relations/settable.py, if it was made."""
    made = "# Where every setting acts\n\n`python tests/relations/settable.py` makes this page, before `scripts/manual`.\n"
    write(folder / "settings.md", table.read_text(encoding="utf-8") if table.is_file() else made)


def python_api(folder):
    package = (ROOT / "python" / "src" / "reentry_fmus" / "__init__.py").read_text(encoding="utf-8")
    listed = re.search(r"__all__ = \[(.*?)\]", package, re.S)[1]
    names = re.findall(r'"(\w+)"', listed)
    text = "# Python API\n\nThe package `reentry_fmus`; [python.md](../docs/python.md) has the examples.\n"
    for name in names:
        kind = "class" if name.split(".")[-1][0].isupper() else "function"
        members = "\n:members:\n:undoc-members:" if kind == "class" else ""
        text += f"\n## {name}\n\n```{{eval-rst}}\n.. auto{kind}:: reentry_fmus.{name}{members.replace(chr(10), chr(10) + '   ')}\n```\n"
    write(folder / "python-api.md", text)


def rust_api(folder, rust):
    """Lists the crates with their descriptions, and links what cargo doc wrote to the folder `rust`."""
    lines = ["# Rust API\n", "| crate | folder | what it is |", "|---|---|---|"]
    for file in tracked("*/Cargo.toml"):
        folder_name = str(Path(file).parent)
        text = (ROOT / file).read_text(encoding="utf-8")
        name = re.search(r'^name = "([\w-]+)"', text, re.M)
        about = re.search(r'^description = "(.*)"', text, re.M)
        if folder_name.split("/")[0] in ("tests", "examples") or not (name and about):
            continue
        library = re.search(r'\[lib\][^\[]*?^name = "(\w+)"', text, re.M)
        module = library[1] if library else name[1].replace("-", "_")
        has_page = (rust / module / "index.html").is_file()
        title = f'<a href="../rust/{module}/index.html">{name[1]}</a>' if has_page else f"`{name[1]}`"
        lines.append(f"| {title} | [{folder_name}](../{folder_name}) | {about[1]} |")
    lines.append("\n`cargo doc --workspace --no-deps --open` makes the pages of all crates and opens them.")
    write(folder / "rust-api.md", "\n".join(lines))


def tracked(pattern):
    """Files of the repository by a pattern, without what is ignored."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", pattern]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text.rstrip("\n") + "\n", encoding="utf-8")


def pages(stage):
    """Copies the pages of the repository, with their pictures."""
    for pattern in ("*.md", "docs/images/*"):
        for file in tracked(pattern):
            (stage / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / file, stage / file)
    # Only a picture in Markdown is copied to the site.
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    write(stage / "README.md", re.sub(r"<picture>.*?src=\"(.*?)\"\s+alt=\"(.*?)\".*?</picture>", r"![\2](\1)", readme, flags=re.S))


def main(stage, rust, table):
    shutil.rmtree(stage, ignore_errors=True)
    pages(stage)
    folder = stage / "reference"
    variables(folder)
    for kind in EXPLAINED:
        keys(folder, kind)
    write(folder / "claims.md", claims.page())
    settings(folder, table)
    python_api(folder)
    rust_api(folder, rust)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
