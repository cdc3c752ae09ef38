"""Content of the cells of docs/results.md and of the gaps of sentences with numbers: its text, and
whether a page says the same. scripts/pages/results.py explains the keys."""

from __future__ import annotations

import fnmatch
import math
import re

VERDICTS = {"holds": "holds", "holds-partly": "in part", "does-not-hold": "does not hold", "not-judged": "not judged"}
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PLAIN = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
NUMBER = re.compile(r"[-−]?\d[\d,]*(?:\.\d+)?(?:·10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?")
# How far a mean over fewer members, and a computing time, may be from the page's.
FEWER, TIMES = 0.1, 10.0


class Study:
    """The results of a study, how many members its runs should have, and whether computing times are
    those of a machine without other work."""

    def __init__(self, results: dict, members: dict[str, int], times: bool = True):
        self.results = results
        self.members = members
        self.times = times

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
        run, name = path.split(".", 1)
        return [member[name] for member in self.results["runs"][run]["members"]]

    def value(self, name: str) -> float:
        matches = [value["value"] for value in self.results["values"] if value["id"] == name]
        assert len(matches) == 1, f"the study has {len(matches)} values {name}"
        return matches[0]

    def claim(self, words: str) -> dict:
        matches = [claim for claim in self.results["claims"] if claim["says"].startswith(words)]
        assert len(matches) == 1, f"{len(matches)} claims begin with {words!r}"
        return matches[0]


class Hole:
    """Content of a cell, or of a gap of a sentence: its text, and how it is compared."""

    def __init__(self, study: Study, spec: dict):
        self.spec = spec
        paths = spec.get("of", [])
        self.paths = [paths] if isinstance(paths, str) else paths
        self.complete = spec.get("over") == "first" or all(study.is_complete(path.split(".")[0]) for path in self.paths)
        self.times = study.times
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
            return not self.times or 1.0 / TIMES <= ours / theirs <= TIMES
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
