"""The section "See the guarantee" of the page: what it draws is what the certificate checked, and what it says is true at
the chosen time."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import Page

from browsing import in_chromium
from test_browser import PAGE, after, flights, opened

pytestmark = [
    pytest.mark.tier("browser"),
    pytest.mark.skipif(not PAGE.is_file(), reason=f"{PAGE.relative_to(PAGE.parents[2])} does not exist: run scripts/browser"),
    in_chromium,
]

HOSTILE = "plant.disturbance.kind=alongRate"
BOTH = "plant.disturbance.bound={0}+deg/s2&controller.disturbance.bound={0}+deg/s2"


def drawn(page: Page) -> dict:
    return page.evaluate(
        """() => {
            const { plans, time, norms, limits, holds } = proof.picture.data;
            return { plans, time: [...time], norms: norms.map((each) => [...each]), limits, holds: [...time].map((_, row) => holds(row)) };
        }"""
    )


@pytest.mark.parametrize("address", ["", HOSTILE, f"{HOSTILE}&{BOTH.format(2.3)}", f"{BOTH.format(1)}&plant.disturbance.seed=9"])
def test_oracle_the_drawn_tube_of_the_plan_in_force_contains_the_flight(chromium, address):
    seen = drawn(opened(chromium, address))
    assert all(seen["holds"]) and len(seen["plans"]) == 250
    time = np.array(seen["time"])
    for number, (plan, following) in enumerate(zip(seen["plans"], [*seen["plans"][1:], None], strict=True)):
        tubes = [limit - np.array(bounds) for limit, bounds in zip(seen["limits"], plan["bounds"], strict=True)]
        # A plan under guarantee stays under its bound everywhere.
        for norms, bounds, limit in zip(plan["norms"], plan["bounds"], seen["limits"], strict=True):
            assert (np.array(norms) <= np.array(bounds) + 1e-9 * limit).all(), number
        end = following["began"] if following else 50.0
        # The last row repeats the moment before it. The moment is that of the interval, the rate that of its end.
        followed = np.flatnonzero((time > plan["began"] - 1e-9) & (time < end - 1e-9))
        moments = np.array(seen["norms"][1])[followed]
        assert (np.abs(moments - plan["norms"][1][0]) <= tubes[1][0] + 1e-9).all(), number
        reached = seen["norms"][0][int(np.argmin(np.abs(time - end)))]
        assert abs(reached - plan["norms"][0][1]) <= tubes[0][1] + 1e-9, number


def test_the_bound_falls_as_the_disturbance_grows_until_the_light_goes_out(chromium):
    page = opened(chromium, HOSTILE)
    left = []
    for bound in (1.0, 2.0, 2.3):
        count = flights(page)
        page.evaluate("(bound) => proof.assume(bound)", bound)
        after(page, count)
        page.evaluate("point(5)")
        assert page.inner_text("#lamp-says") == "Guaranteed"
        left.append(page.evaluate("Math.min(...flight.plans[25].bounds[1].slice(5))"))
    assert left[0] > left[1] > left[2] > 0.0, left
    count = flights(page)
    page.locator("#assumed").press("End")
    after(page, count)
    assert page.inner_text("#lamp-says") == "Not guaranteed"
    assert "not possible with these settings" in page.inner_text("#promise")


def test_what_is_promised_at_the_chosen_time_holds(chromium):
    page = opened(chromium)
    assert page.inner_text("#promise") == "Whatever the disturbance does within its bound, the vehicle keeps to 5.0 deg/s and 136 kN m."
    count = flights(page)
    page.get_by_role("button", name="More than was assumed").click()
    after(page, count)
    # Nothing has contradicted the assumptions at the beginning.
    assert page.inner_text("#lamp-says") == "Guaranteed"
    page.evaluate("point(3)")
    assert page.inner_text("#promise") == "Guarantee void: the disturbance is larger than assumed."
    assert "exceeded" not in page.inner_text("#proof")
    opened_again = opened(chromium, "controller=lqr")
    assert not opened_again.is_visible("#proof")


def test_another_law_flies_under_the_same_disturbance(chromium):
    page = opened(chromium, f"{HOSTILE}&plant.initial.alpha=12+deg")
    page.wait_for_function("flight.ghost")
    ghost = page.evaluate("flight.ghost.norms.map((each) => [...each])")
    alone = opened(chromium, f"controller=lqr&{HOSTILE}&plant.initial.alpha=12+deg")
    assert alone.evaluate("[norm(flight.rates), norm(flight.moment)].map((each) => [...each])") == ghost
    page.select_option("#ghost", "")
    assert page.evaluate("flight.ghost") is None


@pytest.mark.parametrize("wait", [0, 1500])
def test_nothing_is_said_of_a_flight_before_it_is_flown(chromium, wait):
    page = chromium.new_context().new_page()
    page.goto(PAGE.as_uri())
    after(page, 0)
    page.wait_for_timeout(wait)
    # Whatever is shown of an entry from now on is kept.
    page.evaluate("""() => {
        window.told = [];
        new MutationObserver(() => told.push([flight?.isEntry, $("entry").hidden ? "" : $("arrival").textContent, $("proof").hidden]))
            .observe(document.body, { subtree: true, childList: true, characterData: true, attributes: true });
    }""")
    page.click("#fly-entry")
    page.wait_for_function("flight?.isEntry && !busy && !wanted")
    told = page.evaluate("told")
    assert told and all(entry in (None, True) or not arrival for entry, arrival, _ in told[1:])
    assert {arrival for _, arrival, _ in told} - {""} == {page.inner_text("#arrival")}
    assert "reaches the terminal area" in page.inner_text("#arrival")


def test_the_keyboard_plays_and_back_undoes(chromium):
    page = opened(chromium)
    page.locator("#plan").press("ArrowRight")
    assert page.evaluate("time") == pytest.approx(26.5)
    page.locator("#plan").press(" ")
    page.wait_for_function("time > 27")
    page.locator("#plan").press(" ")
    count = flights(page)
    page.get_by_role("button", name="A hostile one").click()
    after(page, count)
    assert page.evaluate("settings.value('plant.disturbance.kind')") == "alongRate"
    count = flights(page)
    page.go_back()
    after(page, count)
    assert page.evaluate("settings.value('plant.disturbance.kind')") == "white"


def test_back_undoes_one_choice_however_quickly_others_follow(chromium):
    page = opened(chromium)
    first = page.evaluate("settings.choice.id")
    page.evaluate("""["lqr", "fbl"].forEach((id) => {
        document.querySelector("#controller").value = id;
        document.querySelector("#controller").dispatchEvent(new Event("change"));
    })""")
    for expected in ("lqr", first):
        page.go_back()
        page.wait_for_function(f"settings.choice.id === '{expected}'")
