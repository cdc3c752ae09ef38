"""The tasks of docs/find-it.md, in headless Chromium and on the command line, and the size and shape of pages."""

import re
import shutil
import subprocess

import pytest

from browsing import in_chromium
from conftest import EXPERIMENTS, ROOT, TARGET, program

pytestmark = in_chromium


def orchestrator(*arguments) -> str:
    done = subprocess.run([program("orchestrator"), *arguments], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    out = tmp_path_factory.mktemp("study") / "out"
    orchestrator("reproduce", EXPERIMENTS, "--members", "2", "--quiet", "--out", out, "--fmu-dir", TARGET / "fmu")
    return out / "report.html"


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    # The campaign with fewer cases, among copies of what it extends.
    shutil.copytree(EXPERIMENTS.parent, folder / "experiments")
    file, out = folder / "experiments" / "campaigns" / "white.toml", folder / "out"
    file.write_text(re.sub(r"(?m)^cases = \d+", "cases = 26", file.read_text()))
    orchestrator("campaign", file, "--quiet", "--out", out, "--fmu-dir", TARGET / "fmu")
    return out / "report.html"


@pytest.fixture
def page(chromium):
    page = chromium.new_page(viewport={"width": 1400, "height": 900})
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: request.url.startswith("file:") or faults.append(request.url))
    yield page
    page.close()
    assert not faults


def is_on_screen(page, selector: str) -> bool:
    box = page.locator(selector).first.bounding_box()
    return box is not None and 0 <= box["y"] and box["y"] + box["height"] <= page.viewport_size["height"]


def test_the_first_screen_says_what_holds_and_who_broke_which_limit(page, report):
    page.goto(report.as_uri())
    assert re.match(r"Of \d+ claims, \d+ hold", page.locator("header .answer").inner_text())
    assert is_on_screen(page, "header .answer") and is_on_screen(page, ".lead figure .plot") and is_on_screen(page, ".lead table")
    headings = page.locator(".lead th").all_inner_texts()
    assert any("EMS" in heading for heading in headings) and any("/ limit" in heading for heading in headings)
    note = page.locator(".lead .note").last.inner_text()
    assert "EMS: " in note and "CMS: " in note and "brackets" in note


def test_a_claim_opens_to_its_numbers(page, report):
    page.goto(report.as_uri())
    claim = page.locator(".claims details").first
    assert not claim.locator("ul").is_visible()
    claim.locator("summary").click()
    assert "against" in claim.locator("ul").inner_text() and claim.locator(".source").is_visible()


def test_gains_and_command_are_one_click_away(page, report):
    page.goto(report.as_uri())
    page.get_by_role("link", name="Origin").click()
    text = page.locator("#origin").inner_text()
    assert "controller.delay = 0.08" in text and "orchestrator reproduce" in text


def test_a_figure_is_exported_by_two_clicks(page, report):
    page.goto(report.as_uri())
    page.locator("details.figure summary", has_text="Fig. 4, ideal").click()
    link = page.locator("details.figure[open] figcaption a", has_text="SVG").get_attribute("href")
    assert (report.parent / link).read_text().startswith("<svg")


def test_a_figure_shows_values_and_is_enlarged_and_hides_curves(page, report):
    page.goto(f"{report.as_uri()}#fig-3")
    figure = page.locator("#fig-3 .plot")
    figure.scroll_into_view_if_needed()
    page.wait_for_selector("#fig-3 .entry[role=switch]")
    frame = figure.locator(".panel .curves").first.bounding_box()
    at = lambda x, y: (frame["x"] + x * frame["width"], frame["y"] + y * frame["height"])  # noqa: E731
    page.mouse.move(*at(0.5, 0.5))
    assert re.search(r"at 2\d(\.\d+)?\n.*: −?\d", figure.locator(".values").inner_text())
    whole = figure.locator(".curves").first.get_attribute("viewBox")
    page.mouse.move(*at(0.2, 0.2))
    page.mouse.down()
    page.mouse.move(*at(0.6, 0.8))
    page.mouse.up()
    assert figure.locator(".curves").first.get_attribute("viewBox") != whole
    page.mouse.dblclick(*at(0.5, 0.5))
    boxes = [[float(part) for part in text.split()] for text in (whole, figure.locator(".curves").first.get_attribute("viewBox"))]
    assert boxes[1] == pytest.approx(boxes[0])
    entry = figure.locator(".entry").last
    entry.click()
    name = entry.get_attribute("data-name")
    hidden = figure.locator(f'.curves [data-name="{name}"]').first
    assert not hidden.is_visible() and entry.get_attribute("aria-checked") == "false"


def test_figures_that_are_opened_while_all_are_read_are_shown(page, report):
    page.add_init_script("window.requestIdleCallback = (read) => { window.readAll = read; }")
    page.goto(report.as_uri())
    page.evaluate("() => { readAll(); for (const part of document.querySelectorAll('details.figure')) part.open = true; }")
    page.wait_for_function("!document.querySelector('[data-folded]')")
    # Time for what is still being read.
    page.wait_for_timeout(500)


def test_the_worst_case_of_a_campaign_has_its_command(page, campaign):
    page.goto(campaign.as_uri())
    page.get_by_role("link", name="Worst cases").click()
    assert "--case" in page.locator("#worst").inner_text()


def test_the_command_line_answers():
    assert "deg" in orchestrator("inspect", "AttitudeEstimator", "*") and "feedback.k1" in orchestrator("inspect", "CRMPC", "feedback.*")
    assert "crmpc-robust" in orchestrator("list")
    assert "delay s" in orchestrator("margins", "lqr", "--at", "10", "--open", "plant.moment.*", "--fmu-dir", TARGET / "fmu")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_are_small_and_fit_every_screen(chromium, report, scheme):
    assert report.stat().st_size < 3e6
    page = chromium.new_page(viewport={"width": 390, "height": 844}, color_scheme=scheme)
    page.goto(report.as_uri())
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert page.evaluate("document.documentElement.scrollHeight") <= 25_000
    # Text stands out from its ground.
    light = page.evaluate("getComputedStyle(document.body).color")
    dark = page.evaluate("getComputedStyle(document.body).backgroundColor")
    brightness = [sum(map(int, re.findall(r"\d+", color)[:3])) for color in (light, dark)]
    assert abs(brightness[0] - brightness[1]) > 450 and (brightness[0] > brightness[1]) == (scheme == "dark")
    page.close()


@pytest.mark.skipif(shutil.which("pdfinfo") is None, reason="pdfinfo (poppler-utils) is not installed")
def test_paper_shows_whole_figures_on_few_pages(page, report, tmp_path):
    page.goto(report.as_uri())
    page.pdf(path=tmp_path / "report.pdf", format="A4")
    text = subprocess.run(["pdfinfo", tmp_path / "report.pdf"], capture_output=True, text=True, check=True).stdout
    assert int(re.search(r"Pages:\s+(\d+)", text)[1]) <= 20


def test_every_question_of_the_page_has_a_test():
    rows = [line for line in (ROOT / "docs" / "find-it.md").read_text().splitlines() if line.startswith("| ")]
    assert len(rows) == 11
