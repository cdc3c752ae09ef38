"""Ten questions of a visitor of the page "Try it in the browser": each is answered on the first screen, or by one touch."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page

from browsing import in_chromium
from test_browser import PAGE, after, flights, opened

pytestmark = [
    pytest.mark.skipif(not PAGE.is_file(), reason=f"{PAGE.relative_to(PAGE.parents[2])} does not exist: run scripts/browser"),
    in_chromium,
]

IN_VIEW = """(element) => {
    const { top, bottom, width } = element.getBoundingClientRect();
    return width > 0 && top >= 0 && bottom <= innerHeight + 1;
}"""


@pytest.fixture(scope="module")
def page(chromium) -> Page:
    page = opened(chromium, viewport={"width": 1400, "height": 900})
    page.wait_for_function("flight.ghost")
    return page


def read(page: Page, where: str) -> str:
    """A text that is seen without scrolling."""
    [element] = page.locator(where).all()
    assert element.evaluate(IN_VIEW), where
    return element.inner_text()


def touched(page: Page, where: str) -> None:
    """Touches what is seen without scrolling, and waits for the flight."""
    assert page.locator(where).evaluate(IN_VIEW), where
    count = flights(page)
    page.click(where)
    after(page, count)


def test_1_what_is_this(page):
    assert "keeps a vehicle within its limits" in read(page, "header > p")


def test_2_which_law_keeps_the_limits(page):
    text = read(page, "#versus")
    assert text.startswith("CRMPC takes 86 % of the rate limit and 73 % of the moment limit") and "LQR" in text and "446 %" in text


def test_3_why_may_one_trust_it(page):
    assert "only if the whole tube stays under the limit" in read(page, "#proof .note")


def test_4_what_happens_beyond_what_was_assumed(chromium):
    page = opened(chromium, viewport={"width": 1400, "height": 900})
    touched(page, "#disturbances button:nth-child(3)")
    page.evaluate("point(5)")
    assert read(page, "#promise") == "Guarantee void: the disturbance is larger than assumed."


def test_5_where_is_the_plan_now(page):
    assert page.locator("#plan").evaluate(IN_VIEW)
    assert page.evaluate("proof.picture.plan(time)") == 130


def test_6_how_close_to_the_limit(page):
    assert "86 %" in read(page, "#versus")


def test_7_and_8_does_an_entry_reach_its_target_and_within_which_loads(chromium):
    page = opened(chromium, viewport={"width": 1400, "height": 900})
    touched(page, "#fly-entry")
    text = read(page, "#arrival")
    assert "reaches the terminal area" in text and "within its loads" in text
    assert page.locator("#entry svg[role=img]").first.evaluate(IN_VIEW)


def test_9_how_does_my_law_do(chromium):
    page = opened(chromium, viewport={"width": 1400, "height": 900})
    assert page.locator("#controller").evaluate(IN_VIEW)
    count = flights(page)
    page.select_option("#controller", "own")
    after(page, count)
    assert page.locator("#code").evaluate(IN_VIEW)
    page.evaluate("scrollTo(0, document.querySelector('#verdict').offsetTop - 300)")
    assert read(page, "#verdict").startswith("Your own law exceeds the moment limit")


def test_10_how_do_i_get_it(chromium):
    page = opened(chromium, viewport={"width": 1400, "height": 900})
    page.locator("#get summary").click()
    assert "pip install" in read(page, "#get p")


@pytest.mark.parametrize("address", ["", "flight=entry&controller=lqr", "controller=own"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_rule_of_accessibility_is_broken(chromium, address, scheme):
    from axe_playwright_python.sync_playwright import Axe

    found = Axe().run(opened(chromium, address, color_scheme=scheme))
    assert found.violations_count == 0, found.generate_report()


@pytest.mark.parametrize("address", ["", "flight=entry&controller=lqr", "controller=own"])
def test_targets_are_large_enough_for_fingers(chromium, address):
    page = opened(chromium, address, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    small = """[...document.querySelectorAll("button, select, input, summary, textarea")]
        .filter((each) => each.offsetParent && Math.min(each.offsetWidth, each.offsetHeight) < 24).map((each) => each.id || each.textContent)"""
    assert page.evaluate(small) == []
