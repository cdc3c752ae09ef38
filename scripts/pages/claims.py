"""The manual's page of claims, made of docs/claims/*.toml.

Each file holds one paper: `paper`, its `studies`, how much is `printed` of what is numbered, and
sections of items. An item has

    place     where the paper has it, in its own numbering
    says      what it says
    setup     in what it was judged; none where nothing was run
    verdict   one of VERDICTS
    number    a value that belongs to the verdict
    shown     names of the tests that show it
    study     figures (by id), tables and overviews (by title) and claims (by their words) of the studies
              that show it. "SETUP…: WORDS" means a claim in all setups that begin so.
    page      pages that say more
    reason    why it is not judged, does not hold, or holds in part
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs" / "claims"
STUDIES = ROOT / "orchestrator" / "experiments"
PAPERS = ["chai-2022", "wu-2015", "jia"]

VERDICTS = {
    "holds": "the test or run shows it",
    "holds in part": "it holds under a condition that the row names",
    "does not hold": "the test or run shows the contrary",
    "reproduced": "the run gives the printed numbers",
    "redrawn": "the run draws the figure; the paper's own curves were not available, so nothing was compared digit by digit",
    "implemented": "the code computes it, or has the value, as printed",
    "implemented, corrected": "the code computes it differently from the print; [errata.md](../docs/errata.md) has the details of what the code uses",
    "background": "a definition, a step or a remark for which nothing is computed",
    "not judged": "nothing shows it; the row says why",
}
NEED_REASON = {"holds in part", "does not hold", "not judged"}
NEED_NO_EVIDENCE = {"background", "not judged"}
KINDS = ["equation", "statement", "figure", "table", "claim"]
KEYS = {"place", "says", "setup", "verdict", "number", "shown", "study", "page", "reason"}

HEAD = """\
# Every item of the papers, and its verdict

This page has a row for each numbered equation, assumption, definition, lemma, theorem, remark,
figure and table of the three papers, and for each claim of their text. A row has the place, the
item in our words, the setup in which it was judged, the verdict, and the test or run that shows it;
an item that was judged in several setups has several rows. [results.md](../docs/results.md) has the
measured results as a report, [errata.md](../docs/errata.md) the misprints and the full references, and
[symbols.md](../docs/symbols.md) the symbols.

Setups: *closed form* is a test against a formula, differences or another solver. *Ideal
measurement* and *sensors and estimator* are the scenario of Chai 2022. *Direct moments* act as
commanded; with *surfaces, jets* they go through the allocation. The *eight corners* are those of
Wu's biases, inertia ± 5 %, air ± 10 % and coefficients ± 10 %, whose signs are not printed; *all
biases* are an inertia of + 5 %, and air and surfaces 10 % weaker. The laws of Wu have corrected
signs unless the row says *as printed*. *Our additions* are that the observer uses the achieved
moment, and that the surface is re-initialised while the actuators fall short; the paper simulates
surfaces and jets without them. Numbers are those of the tests' bounds, of the studies' reports, of
[results.md](../docs/results.md) or of [errata.md](../docs/errata.md).
"""


def papers() -> dict[str, dict]:
    """The data of all papers by the names of their files."""
    return {name: tomllib.loads((DATA / f"{name}.toml").read_text(encoding="utf-8")) for name in PAPERS}


def items(paper: dict) -> list[dict]:
    return [item for section in paper["section"] for item in section["item"]]


def kind(place: str) -> str:
    """Returns the kind of an item by its place: a number of the paper, or a claim of its text."""
    if re.fullmatch(r"\(\d+[a-z]?\)", place):
        return "equation"
    if re.fullmatch(r"(Assumption|Definition|Lemma|Remark|Theorem) \d+", place):
        return "statement"
    return "figure" if re.fullmatch(r"Fig\. \d+", place) else "table" if place.startswith("Table ") else "claim"


def spelled_out(study: str) -> dict:
    """A study with all that it extends and with its lists spelled out, by the orchestrator."""
    target = ROOT / os.environ.get("CARGO_TARGET_DIR", "target")
    programs = [target / profile / "orchestrator" for profile in ("release", "debug")]
    built = [program for program in programs if program.is_file()]
    if not built:
        sys.exit("error: the orchestrator has not been built: run scripts/build-fmus")
    program = max(built, key=lambda file: file.stat().st_mtime)
    shown = subprocess.run([program, "show", STUDIES / study / "study.toml"], check=True, capture_output=True, text=True, encoding="utf-8")
    return tomllib.loads(shown.stdout)


Referable = dict[str, dict[str, list[str]]]


def referable(names: list[str]) -> Referable:
    """The ids of figures, titles of tables and overviews, and words of claims that items can refer to in
    each study."""
    marks = {"figure": "id", "table": "title", "overview": "title", "claim": "says"}
    studies = {name: spelled_out(name) for name in names}
    return {name: {what: [entry[mark] for entry in study.get(what, [])] for what, mark in marks.items()} for name, study in studies.items()}


def words(claim: str) -> str:
    """A claim without the setup before its colon, as Wu's have it."""
    return re.sub(r"^(?:Direct|Surfaces and jets)[^:]*: ", "", claim)


def matches(reference: str, studies: Referable) -> list[tuple[str, str, str]]:
    """The entries of the studies that a reference means, with study and kind: a figure's id, or how a
    title or a claim begins. "SETUP…: WORDS" means a claim in all setups that begin so."""
    setup, several, rest = reference.partition("…: ")
    means = {
        "figure": lambda name: name == reference,
        "table": lambda name: name.startswith(reference),
        "overview": lambda name: name.startswith(reference),
        "claim": lambda name: name.startswith(setup) and (not several or words(name).startswith(rest)),
    }
    return [(study, what, name) for study, entries in studies.items() for what, means_it in means.items() for name in entries[what] if means_it(name)]


def cell(text: str) -> str:
    return text.replace("|", r"\|") or "–"


def evidence(item: dict, studies: Referable) -> str:
    parts = [f"`{test}`" for test in item.get("shown", [])]
    for study in studies:
        entries: dict[str, list[str]] = {}
        for _, what, name in (hit for reference in item.get("study", []) for hit in matches(reference, studies) if hit[0] == study):
            shown = {"figure": f"figure `{name}`", "claim": f"“{words(name)}”"}.get(what, f"{what} “{name}”")
            entries.setdefault(shown, []).extend([name.removesuffix(f": {words(name)}")] if words(name) != name else [])
        texts = [shown + (f" ({'; '.join(setups)})" if setups else "") for shown, setups in entries.items()]
        if texts:
            parts.append(f"[{study}](../orchestrator/experiments/{study}/study.toml): {'; '.join(texts)}")
    parts += [f"[{page.split('#')[0]}](../docs/{page})" for page in item.get("page", [])]
    return ", ".join(parts)


def verdict(item: dict) -> str:
    return f"**{item['verdict']}**" + (f": {item['reason']}" if "reason" in item else "")


def table(header: list[str], rows: list[list[str]]) -> list[str]:
    lines = [header, ["---"] * len(header), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def page() -> str:
    data = papers()
    lines = [HEAD.rstrip(), ""]
    lines += table(["verdict", "meaning"], [[f"**{name}**", meaning] for name, meaning in VERDICTS.items()])
    lines += ["", "## How many", ""]
    for heading, names, group_of in [("verdict", list(VERDICTS), lambda item: item["verdict"]), ("kind", KINDS, lambda item: kind(item["place"]))]:
        counts = {key: Counter(group_of(item) for item in items(paper)) for key, paper in data.items()}
        rows = [[name, *(str(counts[key][name]) for key in data), str(sum(counts[key][name] for key in data))] for name in names]
        totals = [sum(counts[key].values()) for key in data]
        rows.append(["all", *map(str, totals), str(sum(totals))])
        lines += [*table([heading, *(paper["paper"] for paper in data.values()), "all"], rows), ""]
    for paper in data.values():
        studies = referable(paper["studies"])
        lines += [f"## {paper['paper']}", ""]
        for section in paper["section"]:
            lines += [f"### {section['title']}", ""]
            rows = [
                [
                    cell(item["place"]),
                    cell(item["says"]),
                    cell(item.get("setup", "")),
                    cell(verdict(item)),
                    cell(item.get("number", "")),
                    cell(evidence(item, studies)),
                ]
                for item in section["item"]
            ]
            lines += [*table(["place", "says", "setup", "verdict", "number", "shown by"], rows), ""]
    return "\n".join(lines)
