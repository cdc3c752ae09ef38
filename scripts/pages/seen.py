"""Makes the moving picture of the README from the page "Try it in the browser": CRMPC under a hostile disturbance and
under one that is larger than assumed, with LQR beside it. Needs Chromium and the page (scripts/browser).

    python scripts/pages/seen.py      # docs/images/see-guarantee.gif and see-guarantee-dark.gif
"""

import io
import shutil
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "out" / "browser" / "index.html"
FLOWN = "Number(document.documentElement.dataset.flights ?? 0) > {0} && !busy && !wanted && flight.ghost"
# Disturbance of the page's list, and last time that is shown, s.
SCENES = [(1, 4.0), (2, 3.0)]
# Seconds of the flight between two pictures, and seconds for which one is shown.
STEP, SHOWN = 0.1, 0.1
COLOURS = 128


def frames(page) -> list[Image.Image]:
    taken = []
    for index, last in SCENES:
        count = page.evaluate("Number(document.documentElement.dataset.flights)")
        page.evaluate(f"proof.choose({index})")
        page.wait_for_function(FLOWN.format(count))
        for number in range(int(last / STEP) + 1):
            page.evaluate(f"point({number * STEP})")
            taken.append(Image.open(io.BytesIO(page.locator("#proof > div").screenshot())).convert("RGB"))
    return taken


def main() -> None:
    if not PAGE.is_file():
        sys.exit(f"error: {PAGE.relative_to(ROOT)} does not exist: run scripts/browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for scheme, name in (("light", "see-guarantee"), ("dark", "see-guarantee-dark")):
            page = browser.new_context(viewport={"width": 760, "height": 900}, color_scheme=scheme).new_page()
            page.goto(PAGE.as_uri())
            page.wait_for_function(FLOWN.format(0))
            taken = frames(page)
            # One palette for all, so that what stands still is stored once.
            palette = taken[len(taken) // 2].quantize(COLOURS, dither=Image.Dither.NONE)
            first, *others = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in taken]
            path = ROOT / "docs" / "images" / f"{name}.gif"
            first.save(path, save_all=True, append_images=others, duration=int(1000 * SHOWN), loop=0, optimize=True)
            print(f"{path.stat().st_size / 1e6:.2f} MB  {path.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
