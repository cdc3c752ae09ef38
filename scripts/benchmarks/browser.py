"""How fast the page "Try it in the browser" is: from opening the file to its first flight, and from moving a slider to
the drawn flight, in headless Chromium.

    scripts/bench browser [--page FILE] [--drags N]
"""

from __future__ import annotations

import argparse
import statistics

from browsing import ARGUMENTS, CHROMIUM
from test_browser import CONTROLLERS, PAGE, after, flights
from playwright.sync_api import Browser, Page, sync_playwright

# Time from an event of a slider until its flight is drawn, measured in the page, ms; and that of the flight alone.
DRAG = """async (name) => {
    const slider = document.getElementById(name), root = document.documentElement;
    const count = Number(root.dataset.flights), begun = performance.now();
    slider.value = Number(slider.value) * 0.999 + 0.002;
    slider.dispatchEvent(new Event("input"));
    // At the next frame at the latest the flight can be seen.
    while (Number(root.dataset.flights) === count) await new Promise((done) => setTimeout(done));
    return [performance.now() - begun, flight.ms];
}"""


def first(browser: Browser, address: str) -> float:
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(address)
        after(page, 0)
        return page.evaluate("first")


def drags(page: Page, name: str, count: int) -> tuple[list[float], list[float]]:
    whole, alone = zip(*(page.evaluate(DRAG, name) for _ in range(count)))
    return list(whole), list(alone)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", default=PAGE.as_uri())
    parser.add_argument("--drags", type=int, default=30)
    options = parser.parse_args()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        opened = [first(browser, options.page) for _ in range(5)]
        print(f"first flight after {min(opened):.0f} to {max(opened):.0f} ms, of {len(opened)} openings")
        print(f"{'controller':<12} {'slider':<24} {'least':>7} {'median':>7} {'largest':>8} {'flight alone':>13}  ms")
        for controller in CONTROLLERS:
            page = browser.new_context().new_page()
            page.goto(f"{options.page}#controller={controller}")
            after(page, 0)
            gain = page.evaluate("document.querySelector('#groups fieldset:last-of-type input[type=range]').id")
            for slider in ("set-plant.disturbance.bound", gain):
                # The first flights are those of a compiler that has not optimised yet.
                drags(page, slider, 5)
                whole, alone = drags(page, slider, options.drags)
                name = slider.removeprefix("set-").split(".", 1)[1]
                times = f"{min(whole):>7.1f} {statistics.median(whole):>7.1f} {max(whole):>8.1f} {statistics.median(alone):>13.1f}"
                print(f"{controller:<12} {name:<24} {times}")
            assert flights(page) > 2 * options.drags
            page.context.close()
        browser.close()


if __name__ == "__main__":
    main()
