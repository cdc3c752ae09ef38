"""Writes the tables of docs/results.md from finished studies: results.py [--check] OUT_DIR…

Each OUT_DIR is what `orchestrator reproduce` wrote for a study and holds its results.json. A table of the
page that lies between `<!-- table NAME: ... -->` and `<!-- end -->` is written anew; docs/results.toml
says what is in it. The rest of the page is prose. Its sentences with numbers, and those of other pages,
are listed there too: they are not written, but compared. Tables and sentences of studies that are not
given are left as they are.

--check writes nothing and says which cell or sentence differs. Three things are not compared digit by
digit. Computing times differ from run to run and must agree within a factor of ten. If the runs have fewer
members (`reproduce --members`) than the page, means must agree within a tenth beyond rounding, the largest
must not be above the page's, and the least not below; of a verdict the word is compared, and the number of
checks is not. Verdicts on computing times are not compared.

Keys of docs/results.toml:

    members.STUDY   how many members the page's runs have, by patterns of their ids; others have one
    [[table]]       name, study, rows, columns; or `kind`:
        "claims"        rows name a claim by its first words; `says` is the text beside the verdict
        "verdicts"      a row for each claim, a column for each `setup` that stands before its colon
        "campaigns"     rows of docs/results.md for one controller
    [[sentence]]    page, study, says
    A text `says` has holes {x}; `x` says what is in it, as does a column:
        of              RUN.METRIC, RUN.measure.ID or RUN.within.ID.KEY; a column leaves RUN to its rows
        value           or the id of a published or computed value of the study
        total           or "runs": how many there are in all
        held            or the label of a comparison of the row's claim: in how many members it holds
        over            mean (default), largest, least, first, or spread (least to largest) over all members
        below, per      1 - of/below; of/per: a number or as `of`
        percent, factor how it is scaled; digits, significant: how it is rounded
        unit, none      text after it; text for a value that does not exist
        limit           a larger value is bold
        time            whether it is a computing time; in a row of claims, whether the claim is about one
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from cells import Cell, Plain, Study, Text, Verdict

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results.md"
DATA = ROOT / "docs" / "results.toml"
TABLE = re.compile(r"(<!-- table ([\w-]+): written by scripts/pages/results\.py -->\n\n).*?(\n*<!-- end -->)", re.DOTALL)


def bare(words: str) -> str:
    return words.rstrip(".")


def rows_of_runs(study: Study, table: dict) -> list[list]:
    rows = []
    for row in table["rows"]:
        cells = [Plain(row["label"])]
        for column in table["columns"]:
            spec = {**column, **row.get("set", {})}
            if "run" in row:
                spec["of"] = f"{row['run']}.{column['of']}"
            elif column["title"] in row.get("values", {}):
                spec = {key: spec[key] for key in ("digits", "unit") if key in spec}
                spec["value"] = row["values"][column["title"]]
            else:
                cells.append(Plain(""))
                continue
            for key in ("below", "per"):
                if isinstance(spec.get(key), str) and "." not in spec[key]:
                    spec[key] = f"{spec[key]}.{column['of']}"
            cells.append(Cell(study, "{x}", {"x": spec}))
        rows.append(cells)
    return rows


def rows_of_claims(study: Study, table: dict) -> list[list]:
    rows, left = [], [claim["says"] for claim in study.results["claims"]]
    for row in table["rows"]:
        claim = study.claim(row["claim"])
        left.remove(claim["says"])
        rows.append([Plain(bare(claim["says"])), Verdict(study, claim, row.get("time", False)), Cell(study, row["says"], row)])
    assert not left, f"table {table['name']} has no row for {left}"
    return rows


def rows_of_verdicts(study: Study, table: dict) -> list[list]:
    by_words: dict[str, dict[str, Plain]] = {}
    for claim in study.results["claims"]:
        setup, words = claim["says"].split(": ", 1)
        by_words.setdefault(words, {})[setup] = Verdict(study, claim)
    setups = {column["setup"] for column in table["columns"]}
    assert setups == {setup for row in by_words.values() for setup in row}
    empty = Plain("–")
    return [
        [Plain(bare(words)), *(row.get(column["setup"], empty) for column in table["columns"])] for words, row in by_words.items()
    ]


def rows_of_campaigns(table: dict) -> list[list]:
    """A controller's rows, from the part of the page that campaigns.py writes."""
    _, page = PAGE.read_text(encoding="utf-8").split("<!-- campaigns: ")
    rows = []
    for row in table["rows"]:
        section = page.split(f"/{row['campaign']}.toml)")[1]
        heading, _, *lines = re.search(r"(?:^\|.*\n)+", section, re.MULTILINE)[0].splitlines()
        names = [name.strip() for name in heading.strip("|").split("|")]
        (row_text,) = [line for line in lines if line.startswith(f"| {table['controller']} |")]
        values = dict(zip(names, (cell.strip() for cell in row_text.strip("|").split("|")), strict=True))
        broken = [re.search(r"(\d+) of (\d+)", values[f"{limit} limit broken"]) for limit in ("rate", "moment")]
        cells = [
            broken[0][2],
            f"{float(values['mean EMS'].split()[0]):.2f}°",
            f"{float(values['largest EMS'].split()[0]):.2f}°",
            f"{float(values['largest rate'].split()[0]) / table['rate_limit']:.3f}",
            values["largest moment / limit"],
            str(max(int(one[1]) for one in broken)),
        ]
        rows.append([Plain(row["label"]), *map(Plain, cells)])
    return rows


def rows(table: dict, studies: dict[str, Study]) -> list[list] | None:
    """The rows of a table; none if its study is not given."""
    if table.get("kind") == "campaigns":
        return rows_of_campaigns(table)
    study = studies.get(table["study"])
    if study is None:
        return None
    return {"claims": rows_of_claims, "verdicts": rows_of_verdicts, None: rows_of_runs}[table.get("kind")](study, table)


def header(table: dict) -> list[str]:
    if table.get("kind") in ("claims", "campaigns"):
        return table["header"]
    return [table.get("corner", ""), *(column["title"] for column in table["columns"])]


def line(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |" if any(cells) else "|"


def written(table: dict, body: list[list]) -> str:
    heading = header(table)
    lines = [line(heading), "|" + "---|" * len(heading)]
    lines += [line([cell.text for cell in row]) for row in body]
    return "\n".join(re.sub(r"\|  (?=\|)", "| ", one) for one in lines)


def cells_of(text: str) -> list[list[str]]:
    return [[cell.strip() for cell in one.strip().strip("|").split("|")] for one in text.strip().splitlines()]


def differences_of_table(table: dict, body: list[list], text: str) -> list[str]:
    heading, _, *page = cells_of(text)
    problems = []
    if heading != [name.strip() for name in header(table)]:
        problems.append("the heading differs")
    if [row[0] for row in page] != [row[0].text for row in body]:
        return [*problems, "the rows differ"]
    for theirs, ours in zip(page, body, strict=True):
        theirs = theirs + [""] * (len(ours) - len(theirs))
        for name, cell, one in zip(header(table), theirs, ours, strict=True):
            problems += [f"row {theirs[0]!r}, column {name!r}: {said}" for said in one.differences(cell)]
    return problems


def read(folders: list[Path], data: dict, times: bool = True) -> dict[str, Study]:
    """The studies of the folders by their names; the title says which study it is. `times` says whether
    computing times are compared, which other work beside the runs would spoil."""
    titles = {}
    for path in (ROOT / "orchestrator" / "experiments").glob("*/study.toml"):
        titles[tomllib.loads(path.read_text(encoding="utf-8"))["title"]] = path.parent.name
    studies = {}
    for folder in folders:
        results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
        name = titles[results["title"]]
        studies[name] = Study(results, data["members"].get(name, {}), times)
    return studies


def data() -> dict:
    return tomllib.loads(DATA.read_text(encoding="utf-8"))


def problems(studies: dict[str, Study], described: dict | None = None, pages: dict[str, str] | None = None) -> list[str]:
    """Where pages differ from the results of the studies."""
    described = described or data()
    read_page = lambda name: (pages or {}).get(name) or (ROOT / name).read_text(encoding="utf-8")
    on_page = {name: text for text, name in ((match[0], match[2]) for match in TABLE.finditer(read_page("docs/results.md")))}
    faults = [f"table {name} is on the page and not in docs/results.toml" for name in on_page.keys() - {table["name"] for table in described["table"]}]
    for table in described["table"]:
        if table["name"] not in on_page:
            faults.append(f"table {table['name']} is not on the page")
            continue
        ours = rows(table, studies)
        if ours is not None:
            text = "\n".join(one for one in on_page[table["name"]].splitlines() if one.startswith("|"))
            faults += [f"table {table['name']}: {said}" for said in differences_of_table(table, ours, text)]
    for sentence in described["sentence"]:
        if sentence["study"] in studies:
            text = Text(studies[sentence["study"]], sentence["says"], sentence)
            match = re.search(text.pattern(), read_page(sentence["page"]))
            faults += [f"{sentence['page']}: {sentence['says']!r}: {said}" for said in text.differences(match)]
    return faults


def write(studies: dict[str, Study], described: dict) -> None:
    for name, study in studies.items():
        if study.fewer:
            sys.exit(f"{name}: the page has other numbers of members of {', '.join(study.fewer[:3])}: run the whole study, or see docs/results.toml")
    tables = {table["name"]: table for table in described["table"]}

    def filled(match: re.Match) -> str:
        ours = rows(tables[match[2]], studies)
        return match[0] if ours is None else match[1] + written(tables[match[2]], ours) + "\n\n" + match[3].lstrip("\n")

    PAGE.write_text(TABLE.sub(filled, PAGE.read_text(encoding="utf-8")), encoding="utf-8")


def main() -> int:
    folders = [Path(name) for name in sys.argv[1:] if name != "--check"]
    described = data()
    studies = read(folders, described)
    if "--check" not in sys.argv[1:]:
        write(studies, described)
    faults = problems(studies, described)
    print("".join(f"{fault}\n" for fault in faults), end="", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
