"""docs/claims has an item for everything that the papers number, and each verdict names a test or run that
exists."""

import re

import claims
import pytest

import named
from conftest import ROOT

PAPERS = claims.papers()
ITEMS = [(name, item) for name, paper in PAPERS.items() for item in claims.items(paper)]
STUDIES = {name: claims.referable(paper["studies"]) for name, paper in PAPERS.items()}


def label(pair) -> str:
    name, item = pair
    return f"{name} {item['place']}"


def places(paper: dict, kind: str) -> set[str]:
    return {item["place"] for item in claims.items(paper) if claims.kind(item["place"]) == kind}


def numbers(paper: dict, kind: str) -> set[int]:
    return {int(re.search(r"\d+", place)[0]) for place in places(paper, kind)}


def test_the_page_has_a_row_for_every_item():
    page = claims.page()
    rows = [line.split(" | ")[0] for line in page.splitlines() if line.startswith("| ")]
    assert [item["place"] for _, item in ITEMS if f"| {claims.cell(item['place'])}" not in rows] == []


@pytest.mark.parametrize("name", PAPERS)
def test_everything_that_a_paper_numbers_has_a_row(name):
    paper = PAPERS[name]
    printed = paper["printed"]
    assert numbers(paper, "equation") == set(range(1, printed["equations"] + 1))
    assert numbers(paper, "figure") == set(range(1, printed["figures"] + 1))
    assert places(paper, "table") == set(printed["tables"])
    assert places(paper, "statement") == set(printed["statements"])


@pytest.mark.parametrize(("name", "item"), ITEMS, ids=map(label, ITEMS))
def test_an_item_is_complete_and_what_shows_it_exists(name, item):
    assert item.keys() <= claims.KEYS and {"place", "says", "verdict"} <= item.keys()
    assert item["verdict"] in claims.VERDICTS
    assert ("reason" in item) == (item["verdict"] in claims.NEED_REASON)
    # Computing times have studies only: a test of them would depend on the machine.
    is_time = (name, item["place"]) in {("chai-2022", "Remark 3"), ("chai-2022", "section 5.2, Fig. 7")}
    assert item["verdict"] in claims.NEED_NO_EVIDENCE or item.get("shown") or is_time and item.get("study"), "no test shows it"
    for test in item.get("shown", []):
        assert named.exists(test), f"there is no test {test}"
    for reference in item.get("study", []):
        # A reference means one entry of one kind; of a claim it may mean all setups.
        meant = {(what, claims.words(entry)) for _, what, entry in claims.matches(reference, STUDIES[name])}
        assert len(meant) == 1, f"{reference}: {meant}"
    for page in item.get("page", []):
        file, _, heading = page.partition("#")
        text = (ROOT / "docs" / file).read_text(encoding="utf-8")
        headings = [re.sub(r"[^\w\- ]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in text.splitlines() if line.startswith("#")]
        assert not heading or heading in headings, page


@pytest.mark.parametrize("name", PAPERS)
def test_every_claim_and_figure_of_the_studies_belongs_to_an_item(name):
    found = STUDIES[name]
    referred = {match for item in claims.items(PAPERS[name]) for reference in item.get("study", []) for match in claims.matches(reference, found)}
    there = [(study, what, entry) for study, entries in found.items() for what in entries for entry in entries[what]]
    owed = [one for one in there if one[1] == "claim" or one[1] == "figure" and one[2].startswith("fig-")]
    assert [one for one in owed if one not in referred] == []
    assert len(owed) >= 10


def test_every_correction_of_an_equation_is_among_the_errata():
    errata = (ROOT / "docs" / "errata.md").read_text(encoding="utf-8").split("\n## ")
    by_study = {re.search(r"\(([\w-]+)\)\n", part)[1]: part for part in errata[1:]}
    for name, item in ITEMS:
        if item["verdict"] == "implemented, corrected" and claims.kind(item["place"]) == "equation":
            number = re.search(r"\d+", item["place"])[0]
            assert re.search(rf"\({number}[ab]?\)", by_study[PAPERS[name]["studies"][0]]), (name, item["place"])
