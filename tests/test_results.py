"""scripts/pages/results.py, which writes the tables of docs/results.md. That the page agrees with the runs is
tested in test_reproduce.py."""

import re

import cells
import pytest
import results as pages

from conftest import ROOT

PAGE = "docs/results.md"
TEXT = (ROOT / PAGE).read_text(encoding="utf-8")
# The tables that are written by hand, by the command behind them: benchmarks and searches, whose times
# are those of one machine.
BY_HAND = ["cargo bench -p reentry-control --bench optimisation", "--example worst_time", "orchestrator run crmpc-robust"]


def study(members: dict[str, list[dict]], expected: dict[str, int], claims=()) -> cells.Study:
    runs = {run: {"members": [{"metrics": metrics} for metrics in each]} for run, each in members.items()}
    return cells.Study({"runs": runs, "values": [], "claims": list(claims)}, expected)


def hole(ems: list, expected: int, **spec) -> cells.Hole:
    return cells.Hole(study({"lqr": [{"ems_deg": value} for value in ems]}, {"lqr": expected}), {"of": "lqr.ems_deg", **spec})


def test_the_page_and_its_data_name_the_same_tables_and_campaigns():
    assert pages.problems({}) == []


def test_every_other_table_has_its_command_before_it():
    blocks = re.sub(pages.TABLE, "", TEXT)
    assert len(re.findall(r"^\|---", blocks, re.MULTILINE)) == len(BY_HAND)
    place = 0
    for command in BY_HAND:
        place = blocks.index(command, place)
        place = blocks.index("|---", place)


def test_a_cell_and_a_row_that_differ_are_told():
    changed = TEXT.replace("| 192 | 2.05° |", "| 192 | 2.06° |")
    assert changed != TEXT
    (said,) = pages.problems({}, pages={PAGE: changed})
    assert said == "table chai-campaigns: row '`square-waves`: 0.08 s to 20 s', column 'mean EMS': '2.06°', the runs give '2.05°'"
    (said,) = pages.problems({}, pages={PAGE: TEXT.replace("| `square-waves`", "| `waves`")})
    assert said == "table chai-campaigns: the rows differ"
    said = pages.problems({}, pages={PAGE: TEXT.replace("<!-- table wu-jets:", "<!-- table wu:")})
    assert said == ["table wu is on the page and not in docs/results.toml", "table wu-jets is not on the page"]


def test_a_sentence_is_compared_however_its_lines_are_broken():
    described = {"table": [], "sentence": [{"page": "a.md", "study": "s", "says": "It makes {n} runs, or more.", "n": {"total": "runs"}}]}
    studies = {"s": study({"lqr": [{}] * 3}, {"lqr": 3})}
    said = lambda text: pages.problems(studies, described, {"a.md": text, PAGE: "none"})
    assert said("So. It\nmakes 3 runs, or\nmore.") == []
    assert "'4', the runs give '3'" in said("It makes 4 runs, or more.")[0]
    assert "is not there" in said("It makes runs.")[0]


@pytest.mark.parametrize(
    ("number", "digits", "text"),
    [(7.18e-5, 2, "7.2·10⁻⁵"), (0.0098, 2, "0.0098"), (0.00098, 2, "9.8·10⁻⁴"), (33.64, 2, "34"), (0.01, 2, "0.010"), (1.02, 2, "1.0")],
)
def test_significant_digits(number, digits, text):
    assert cells.significant(number, digits) == text
    assert cells.number_of(text) == pytest.approx(number, rel=0.06)


def test_all_members_must_agree_to_the_digit():
    assert hole([1.0, 2.0], 2, digits=1).agrees("1.5")
    assert not hole([1.0, 2.0], 2, digits=1).agrees("1.6")
    assert hole([1.0, 2.0], 2, digits=1, over="largest", limit=1.5).text == "**2.0**"
    assert hole([None], 1, none="never").text == "never" and not hole([None], 1, none="never").agrees("3 s")


def test_with_fewer_members_only_what_must_be_so_is_compared():
    mean = hole([1.0, 2.0], 20, digits=2)
    assert mean.agrees("1.60") and not mean.agrees("1.68") and not mean.agrees("1.35")
    # 34.7 % rounds to 35 %, and may be 32 % or 38 % over more members.
    share = hole([0.347, 0.347], 20, percent=True)
    assert share.agrees("32 %") and share.agrees("38 %") and not share.agrees("30 %")
    largest = hole([1.0, 2.0], 20, digits=1, over="largest")
    assert largest.agrees("9.9") and not largest.agrees("1.9")
    least = hole([1.0, 2.0], 20, digits=1, over="least")
    assert least.agrees("0.1") and not least.agrees("1.1")
    # The first member is there in any case.
    assert not hole([1.0, 2.0], 20, digits=1, over="first").agrees("1.1")


def test_times_must_agree_within_a_factor_of_ten():
    time = hole([1.0], 1, digits=2, time=True)
    assert time.agrees("0.10") and time.agrees("10.00") and not time.agrees("0.09") and not time.agrees("11.00")
    time.times = False
    assert time.agrees("11.00") and not time.agrees("none")


def test_verdicts_count_the_checks_that_hold():
    check = lambda held: {"held": held, "of": 1}
    partly = {"verdict": "holds-partly", "checks": [check(1), check(0)]}
    whole, fewer = study({"lqr": [{}]}, {}), study({"lqr": [{}]}, {"lqr": 20})
    assert cells.Verdict(whole, partly).text == "in part (1 of 2 checks)"
    assert cells.Verdict(whole, partly).differences("in part (2 of 2 checks)")
    assert not cells.Verdict(fewer, partly).differences("in part (2 of 2 checks)")
    said = cells.Verdict(fewer, partly).differences("holds")
    assert said == ["'holds', the runs give 'in part (1 of 2 checks)'"]
    assert not cells.Verdict(whole, partly, time=True).differences("holds")


def test_a_page_is_not_written_from_fewer_members():
    with pytest.raises(SystemExit, match="the page has other numbers of members of lqr"):
        pages.write({"s": study({"lqr": [{}] * 2}, {"lqr": 20})}, {"table": []})
    assert (ROOT / PAGE).read_text(encoding="utf-8") == TEXT
