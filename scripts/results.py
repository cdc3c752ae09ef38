"""Writes the tables of docs/results.md from finished studies: results.py [--check] OUT_DIR...

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
        "campaigns"     rows of docs/campaigns-results.md for one controller
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

import fnmatch
import json
import math
import re
import sys
from pathlib import Path

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "results.md"
DATA = ROOT / "docs" / "results.toml"
CAMPAIGNS = ROOT / "docs" / "campaigns-results.md"
TABLE = re.compile(r"(<!-- table ([\w-]+): written by scripts/results\.py -->\n\n).*?(\n*<!-- end -->)", re.DOTALL)
VERDICTS = {"holds": "holds", "holds-partly": "in part", "does-not-hold": "does not hold", "not-judged": "not judged"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PLAIN = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
NUMBER = re.compile(r"[-−]?\d[\d,]*(?:\.\d+)?(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")
# How far a mean over fewer members, and a computing time, may be from the page's.
FEWER, TIMES = 0.1, 10.0


class Study:
    """The results of a study, and how many members its runs should have."""

    def __init__(self, results: dict, members: dict[str, int]):
        self.results = results
        self.members = members

    def expected(self, run: str) -> int:
        return next((count for pattern, count in self.members.items() if fnmatch.fnmatchcase(run, pattern)), 1)

    @property
    def fewer(self) -> list[str]:
        """The runs that have not as many members as they should."""
        return [run for run in self.results["runs"] if not self.is_complete(run)]

    def is_complete(self, run: str) -> bool:
        return len(self.results["runs"][run]["members"]) == self.expected(run)

    def metric(self, path: str) -> list:
        """A metric of all members of a run, `None` where it does not exist."""
        run, *keys = path.split(".")
        if keys[0] == "measure":
            keys[0] = "measures"
        elif keys[0] != "within":
            keys.insert(0, "metrics")
        values = []
        for member in self.results["runs"][run]["members"]:
            for key in keys:
                member = member[key]
            values.append(member)
        return values

    def value(self, name: str) -> float:
        matches = [value["value"] for value in self.results["values"] if value["id"] == name]
        assert len(matches) == 1, f"the study has {len(matches)} values {name}"
        return matches[0]

    def claim(self, words: str) -> dict:
        matches = [claim for claim in self.results["claims"] if claim["says"].startswith(words)]
        assert len(matches) == 1, f"{len(matches)} claims begin with {words!r}"
        return matches[0]


class Hole:
    """What stands in a cell, or in a gap of a sentence: its text, and how it is compared."""

    def __init__(self, study: Study, spec: dict):
        self.spec = spec
        paths = spec.get("of", [])
        self.paths = [paths] if isinstance(paths, str) else paths
        self.complete = spec.get("over") == "first" or all(study.is_complete(path.split(".")[0]) for path in self.paths)
        self.text = self.written(study)

    def written(self, study: Study) -> str:
        spec = self.spec
        if "value" in spec:
            return self.shown(study.value(spec["value"]))
        if "held" in spec:
            (check,) = [check for check in study.claim(spec["claim"])["checks"] if check["label"] == spec["held"]]
            self.complete = study.is_complete(spec["run"])
            return str(check["held"])
        if "total" in spec:
            return str(sum(map(study.expected, study.results["runs"])))
        members = [value for path in self.paths for value in study.metric(path)]
        if None in members:
            return spec["none"]
        over = spec.get("over", "mean")
        if over == "spread":
            least, largest = (self.shown(self.scaled(study, bound(members))) for bound in (min, max))
            return least if least == largest else f"{least} to {largest}"
        combined = {"mean": lambda values: sum(values) / len(values), "largest": max, "least": min, "first": lambda values: values[0]}[over]
        return self.shown(self.scaled(study, combined(members)))

    def scaled(self, study: Study, number: float) -> float:
        for key in ("below", "per"):
            if key in self.spec:
                other = self.spec[key]
                if isinstance(other, str):
                    others = study.metric(other)
                    other = sum(others) / len(others)
                number = 1.0 - number / other if key == "below" else number / other
        return number * (100.0 if self.spec.get("percent") else 1.0) * self.spec.get("factor", 1.0)

    def shown(self, number: float) -> str:
        self.number = number
        if "significant" in self.spec:
            text = significant(number, self.spec["significant"])
        else:
            text = f"{number:.{self.spec.get('digits', 0)}f}"
        text += " %" if self.spec.get("percent") else self.spec.get("unit", "")
        return f"**{text}**" if number > self.spec.get("limit", math.inf) * (1.0 + 1e-9) else text

    def agrees(self, page: str) -> bool:
        """Whether the page says the same, as far as these runs can tell."""
        if page == self.text:
            return True
        theirs, ours = number_of(page), number_of(self.text)
        exact = getattr(self, "number", ours)
        if theirs is None or ours is None or "total" in self.spec:
            return False
        if self.spec.get("time"):
            return 1.0 / TIMES <= ours / theirs <= TIMES
        if self.complete:
            return False
        if "held" in self.spec:
            return ours <= theirs
        over = self.spec.get("over", "mean")
        if over == "largest":
            return ours <= theirs
        if over == "least":
            return ours >= theirs
        return abs(exact - theirs) <= FEWER * abs(theirs) + 0.5 * 10.0 ** -self.spec.get("digits", 0)


def significant(number: float, digits: int) -> str:
    """A number with so many significant digits, as a power of ten where it is small."""
    mantissa, exponent = f"{number:.{digits - 1}e}".split("e")
    if int(exponent) < -3:
        return f"{mantissa}·10{str(int(exponent)).translate(SUPERSCRIPTS)}"
    return f"{float(f'{mantissa}e{exponent}'):.{max(0, digits - 1 - int(exponent))}f}"


def number_of(text: str) -> float | None:
    match = NUMBER.search(text)
    if match is None:
        return None
    mantissa, _, exponent = match[0].replace(",", "").replace("−", "-").partition("·10")
    return float(mantissa) * 10.0 ** float(exponent.translate(PLAIN) or 0)


class Text:
    """A text with holes, as it should be."""

    def __init__(self, study: Study, says: str, specs: dict):
        self.says = says
        self.holes = {name: Hole(study, specs[name]) for name in re.findall(r"\{(\w+)\}", says)}

    @property
    def text(self) -> str:
        return re.sub(r"\{(\w+)\}", lambda name: self.holes[name[1]].text, self.says)

    def pattern(self) -> str:
        """A pattern for the text with anything in the holes, however its lines are broken."""
        parts = re.split(r"\{(\w+)\}", self.says)
        parts[::2] = [r"\s+".join(map(re.escape, part.split(" "))) for part in parts[::2]]
        parts[1::2] = [f"(?P<{name}>\\S(?:[^|]*?\\S)?)" for name in parts[1::2]]
        return "".join(parts)

    def differences(self, match: re.Match | None) -> list[str]:
        if match is None:
            return ["is not there"]
        pairs = [(" ".join(match[name].split()), hole) for name, hole in self.holes.items()]
        return [f"{page!r}, the runs give {hole.text!r}" for page, hole in pairs if not hole.agrees(page)]


class Plain:
    """A cell without numbers of runs, such as a label."""

    def __init__(self, text: str):
        self.text = text

    def agrees(self, page: str) -> bool:
        return page == self.text

    def differences(self, page: str) -> list[str]:
        return [] if self.agrees(page) else [f"{page!r}, the runs give {self.text!r}"]


class Verdict(Plain):
    """The verdict on a claim, with the number of checks that hold if only some do."""

    def __init__(self, study: Study, claim: dict, time: bool = False):
        checks = claim["checks"]
        held = sum(check["held"] == check["of"] for check in checks)
        counted = f" ({held} of {len(checks)} checks)" if claim["verdict"] == "holds-partly" else ""
        super().__init__(VERDICTS[claim["verdict"]] + counted)
        self.fewer = bool(study.fewer)
        self.time = time

    def agrees(self, page: str) -> bool:
        word = lambda text: text.split(" (")[0]
        return page == self.text or self.time or (self.fewer and word(page) == word(self.text))


class Cell(Text):
    def differences(self, page: str) -> list[str]:
        return super().differences(re.fullmatch(self.pattern(), page))


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
    """A controller's rows, from the page that scripts/campaigns writes."""
    page = CAMPAIGNS.read_text(encoding="utf-8")
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


def read(folders: list[Path], data: dict) -> dict[str, Study]:
    """The studies of the folders by their names; the title says which study it is."""
    titles = {}
    for path in (ROOT / "orchestrator" / "experiments").glob("*/study.toml"):
        titles[tomllib.loads(path.read_text(encoding="utf-8"))["title"]] = path.parent.name
    studies = {}
    for folder in folders:
        results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
        name = titles[results["title"]]
        studies[name] = Study(results, data["members"].get(name, {}))
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
