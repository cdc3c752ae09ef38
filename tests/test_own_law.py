"""A law that is written on the page "Try it in the browser": it flies as others do, its faults have their lines, and none
that comes with an address is run unasked."""

from __future__ import annotations

from urllib.parse import quote_plus

import numpy as np
import pytest
from playwright.sync_api import Page

from browsing import in_chromium
from test_browser import PAGE, after, flights, opened, signals

pytestmark = [
    pytest.mark.tier("browser"),
    pytest.mark.skipif(not PAGE.is_file(), reason=f"{PAGE.relative_to(PAGE.parents[2])} does not exist: run scripts/browser"),
    in_chromium,
]

QUIET = "controller=own&plant.disturbance.kind=none&plant.inertia.scale=1"


def written(page: Page, code: str, wait: bool = True) -> None:
    count = flights(page)
    page.fill("#code", code)
    if wait:
        after(page, count)


def test_oracle_the_moment_for_an_acceleration_gives_it(chromium):
    page = opened(chromium, QUIET)
    written(page, "function law(state, reference, dt, memory, vehicle) { return vehicle.momentFor([0.01, -0.02, 0.03]); }")
    table = signals(page)
    names = [f"plant.attitude.{name}" for name in ("alpha", "beta", "sigma")]
    angles, time = table[names].to_numpy(), table["time"].to_numpy()
    # At rest at first, so that the angles move as t²/2 while the held moment is that of the instant.
    moved = (angles[10] - angles[0]) / (time[10] ** 2 / 2)
    np.testing.assert_allclose(moved, [0.01, -0.02, 0.03], rtol=0.02)


def test_what_a_law_returns_is_commanded_and_what_it_keeps_is_its_own(chromium):
    page = opened(chromium, QUIET)
    written(page, "function law(state, reference, dt, memory) { memory.n = (memory.n ?? 0) + 1; return [memory.n, -2 * memory.n, dt]; }")
    moment = signals(page)[[f"controller.moment.{axis}" for axis in "xyz"]].to_numpy()
    ticks = np.arange(1, len(moment))
    np.testing.assert_array_equal(moment[:-1], np.column_stack([ticks, -2.0 * ticks, np.full(len(ticks), 0.04)]))
    # Another flight begins with an empty memory.
    count = flights(page)
    page.get_by_label("seed").fill("3")
    after(page, count)
    assert signals(page)["controller.moment.x"][0] == 1.0


def test_it_is_judged_beside_another_law(chromium):
    page = opened(chromium, "controller=own")
    page.wait_for_function("flight.ghost")
    assert page.inner_text("#verdict").startswith("Your own law")
    assert [cell.inner_text() for cell in page.locator("#figures .other").all()][:3] == ["LQR", "129 %", "446 %"]
    assert page.locator("#charts .panel:visible").nth(2).locator("path.curve").count() == 8


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("function law() {\n  const a = ;\n}", "line 2: Unexpected token"),
        ("function law(state) {\n\n  return [state.nothing.x, 0, 0];\n}", "line 3: Cannot read properties of undefined"),
        ("function law() {\n  return [1, 2];\n}", "at 0.00 s it returns [1,2]: three finite numbers are needed"),
        ("const a = 1;", "there is no function named law"),
        ("function law() {\n  while (true);\n}", "a flight takes more than ten seconds"),
        ("function law() {\n  throw null;\n}", "your law: it throws null"),
    ],
)
def test_a_fault_is_told_with_its_line_and_the_page_goes_on(chromium, code, said):
    page = opened(chromium, "controller=own")
    written(page, code, wait=False)
    page.wait_for_function("document.querySelector('#code-says').textContent", timeout=60e3)
    assert said in page.inner_text("#code-says") and said in page.inner_text("#verdict")
    written(page, "function law() { return [0, 0, 0]; }")
    assert page.inner_text("#code-says") == ""


def test_a_law_flies_as_it_is_written_whatever_text_flew_before(chromium):
    page = opened(chromium, "controller=own")
    flown = "flight.signals[10]"
    # A text that never returns, and one that spoils what later ones need.
    written(page, "function law() { while (true); }", wait=False)
    page.wait_for_function("busy && sent.code.includes('while')")
    written(page, "const all = Array.isArray; Array.isArray = () => false; function law() { return all([]) ? [1e3, 0, 0] : null; }", wait=False)
    page.wait_for_function("document.querySelector('#code-says').textContent.includes('three finite numbers')")
    written(page, "function law() { return [2e3, 0, 0]; }")
    assert page.evaluate(flown) == 2e3 and page.inner_text("#code-says") == ""
    count = flights(page)
    page.select_option("#controller", "lqr")
    after(page, count)
    assert page.evaluate("flight.name") == "LQR" and abs(page.evaluate(flown)) != 2e3


def test_a_moment_of_any_size_is_scaled_into_its_limit(chromium):
    page = opened(chromium, "controller=own&controller.saturation=true")
    written(page, "function law() { return [1e200, 0, -1e200]; }")
    moment = signals(page)[[f"controller.moment.{axis}" for axis in "xyz"]].to_numpy()[0]
    np.testing.assert_allclose(moment, np.array([1, 0, -1]) * page.evaluate("flight.summary.limits.moment") / 2**0.5, rtol=1e-12)


def test_a_law_of_an_address_is_not_run_unasked(chromium):
    code = "function law(state) {\n  return [1e3, 0, 0]; // a & b\n}"
    page = chromium.new_context().new_page()
    page.goto(f"{PAGE.as_uri()}#controller=own&law={quote_plus(code)}")
    page.wait_for_function("document.querySelector('#verdict').textContent.startsWith('Not flown yet')")
    assert page.input_value("#code") == code and flights(page) == 0
    page.click("#agree")
    after(page, 0)
    assert page.evaluate("flight.signals[10]") == 1e3 and not page.is_visible("#agree")
    # Other controllers have no law in their addresses, and this one keeps it.
    page.select_option("#controller", "lqr")
    page.wait_for_function("!busy && !wanted")
    assert "law" not in page.evaluate("location.hash")
    page.go_back()
    page.wait_for_function("!busy && !wanted && settings.choice.id === 'own'")
    assert page.input_value("#code") == code
