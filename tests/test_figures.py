"""Curves of a panel can be distinguished without red and green."""

import pytest

from browsing import in_chromium
from conftest import ROOT
from figures import LEAST, check, difference
from geometry import faults


def test_the_measure_tells_red_and_green_of_equal_lightness_apart_for_nobody_without_them():
    assert difference("#0072b2", "#e69f00") > LEAST
    # The angles sideslip and bank as they were drawn once.
    assert difference("#2ca02c", "#d62728") < LEAST
    with pytest.raises(AssertionError, match="a and b"):
        check(
            '<g class="panel"><path data-name="a" fill="none" stroke="#2ca02c"/>'
            '<path data-name="b" fill="none" stroke="#d62728"/>'
        )


FIGURES = [path for path in sorted((ROOT / "docs" / "images").glob("*.svg")) if 'class="panel"' in path.read_text()]


@pytest.mark.parametrize("path", FIGURES, ids=lambda path: path.stem)
def test_curves_of_every_kept_figure_differ(path):
    check(path.read_text())


@in_chromium
@pytest.mark.parametrize("path", FIGURES, ids=lambda path: path.stem)
def test_every_text_of_a_kept_figure_can_be_read_and_every_axis_has_three_marks(path, chromium):
    with chromium.new_page() as page:
        assert faults(page, path) == []


@in_chromium
def test_the_geometry_finds_what_nobody_can_read(tmp_path, chromium):
    marks = '<g class="marks-x"><text x="20" y="90">0</text><text x="60" y="90">1</text></g>'
    curves = '<svg class="curves" width="100" height="80"><path data-name="wave" fill="none" stroke="red" d="M0 30L100 30"/></svg>'
    texts = '<text x="30" y="34">limit</text><text x="95" y="60">beyond</text><text x="20" y="88">x</text>'
    bad = tmp_path / "bad.svg"
    bad.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" width="100" height="100">{marks}{curves}{texts}</svg>')
    with chromium.new_page() as page:
        assert faults(page, bad) == ["on one another: 0; x", "cut: beyond", "on the curve wave: limit", "2 marks: 01"]


def test_curves_of_a_run_differ(experiment):
    check((experiment("crmpc-robust") / "plot.svg").read_text())
