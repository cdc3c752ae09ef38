"""Curves of a panel can be distinguished without red and green."""

import pytest

from conftest import ROOT
from figures import LEAST, check, difference


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


def test_curves_of_a_run_differ(experiment):
    check((experiment("crmpc-robust") / "plot.svg").read_text())
