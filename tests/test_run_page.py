"""The page of a run in headless Chromium: it plays, seeks and shows the values at the cursor, without a network."""

from __future__ import annotations

import itertools
import json
import os
import random
import subprocess

import pandas as pd
import pytest
from axe_playwright_python.sync_playwright import Axe

from browsing import in_chromium
from conftest import program

pytestmark = [pytest.mark.tier("browser"), in_chromium]


def call(*arguments, cwd):
    subprocess.run([program("orchestrator"), *map(str, arguments)], check=True, capture_output=True, cwd=cwd)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Two runs with their pages, one with surfaces and jets, and a page of two side by side."""
    folder = tmp_path_factory.mktemp("runs")
    root = os.getcwd()
    for experiment in ("crmpc-robust", "crmpc-plan", "lqr", "crmpc-2022-allocated"):
        call("run", experiment, "--page", "--quiet", "--out", folder / experiment, cwd=root)
    call("plot", folder / "crmpc-robust", folder / "lqr", "--out", folder / "both.html", cwd=root)
    return folder


@pytest.fixture
def opened(chromium):
    """Opens a page. What it loads from elsewhere, and every fault of its scripts, fails the test."""
    seen, contexts = [], []

    def open_page(path, **options):
        context = chromium.new_context(**{"viewport": {"width": 1400, "height": 900}, **options})
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: seen.append(str(error)))
        page.on("console", lambda message: seen.append(message.text) if message.type in ("error", "warning") else None)
        page.on("request", lambda request: seen.append(request.url) if request.url != path.as_uri() else None)
        page.goto(path.as_uri())
        return page

    yield open_page
    assert seen == []
    for context in contexts:
        context.close()


def shown_time(page) -> float:
    return float(page.inner_text("#time").removesuffix(" s"))


def legend(page, panel: int) -> dict[str, float]:
    """Values at the cursor, by the names of the curves of a panel."""
    items = page.locator(".panel").nth(panel).locator(".legend li:has(output)")
    pairs = [(item.locator("span").inner_text(), item.locator("output").inner_text()) for item in items.all()]
    return {name: float(value.replace("−", "-")) for name, value in pairs}


def test_the_cursor_shows_what_is_recorded(runs, opened):
    page = opened(runs / "crmpc-robust" / "page.html")
    table = pd.read_csv(runs / "crmpc-robust" / "results.csv")
    curves = page.locator(".panel svg[role=img]").nth(2)
    curves.scroll_into_view_if_needed()
    box = curves.bounding_box()
    page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 50)
    time = shown_time(page)
    assert 15 < time < 25
    row = table[table["time"] <= time + 0.005].iloc[-1]
    rates = legend(page, 2)
    for name in "pqr":
        assert rates[name] == pytest.approx(row[f"plant.rate.{name}"] * 57.29578, rel=2e-3, abs=2e-2), name
    assert legend(page, 0)["σ"] == pytest.approx(row["plant.attitude.sigma"] * 57.29578, rel=1e-3)
    assert rates["norm"] == pytest.approx(sum(rates[name] ** 2 for name in "pqr") ** 0.5, rel=2e-3)
    # All panels have their cursors at one time.
    places = page.eval_on_selector_all(".cursor", "lines => lines.map(line => line.getAttribute('x1'))")
    assert len(places) == 4 and len(set(places)) == 1


def test_a_recorded_plan_is_drawn_with_its_tube(runs, opened):
    path = runs / "crmpc-plan" / "page.html"
    assert path.stat().st_size < 1e6
    page = opened(path)
    table = pd.read_csv(runs / "crmpc-plan" / "results.csv")
    plans = page.evaluate("JSON.parse(document.getElementById('run-data').textContent).runs[0].plans")
    began = table["controller.plan.began"].drop_duplicates()
    assert [plan["began"] for plan in plans] == pytest.approx(began.tolist(), abs=1e-6) and len(plans) == 250
    row = table.loc[began.index[25]]
    bounds = [row[f"controller.plan.momentBound[{point}]"] / 1e3 for point in range(1, 26)]
    assert plans[25]["bounds"][1] == pytest.approx(bounds, rel=1e-4)
    # The picture moves with the time, and answers to the pointer.
    picture = "document.getElementById('plan').toDataURL()"
    first = page.evaluate(picture)
    page.fill("#seek", "5")
    assert page.evaluate(picture) != first
    box = page.locator("#plan").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 60)
    assert 5 < shown_time(page) < 12
    # A run without plans has no such picture.
    assert opened(runs / "lqr" / "page.html").locator("#plan").count() == 0


def test_panels_are_looked_at_closely_together(runs, opened):
    page = opened(runs / "crmpc-robust" / "page.html")
    panel = page.locator(".panel svg[role=img]").nth(1)
    panel.scroll_into_view_if_needed()
    box = panel.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60, steps=5)
    page.mouse.up()
    shown = page.locator(".panel svg[role=img] text").all_text_contents()
    ends = [text for text in shown if text.endswith(" s")]
    assert len(set(ends)) == 1 and ends[0] != "50 s"
    panel.dblclick()
    assert page.locator(".panel svg[role=img] text").all_text_contents().count("50 s") == 4


def test_keys_play_and_seek(runs, opened):
    page = opened(runs / "crmpc-robust" / "page.html")
    assert shown_time(page) == 0 and page.get_attribute("#play", "aria-label") == "Play"
    page.keyboard.press("Space")
    page.wait_for_function("parseFloat(document.getElementById('time').textContent) > 0.5")
    page.keyboard.press("Space")
    assert page.get_attribute("#play", "aria-label") == "Play"
    paused = shown_time(page)
    page.wait_for_timeout(150)
    assert shown_time(page) == paused
    page.keyboard.press("ArrowRight")
    assert shown_time(page) == pytest.approx(paused + 0.5, abs=0.011)
    page.keyboard.press("Shift+ArrowRight")
    assert shown_time(page) == pytest.approx(paused + 5.5, abs=0.011)
    page.keyboard.press("End")
    assert shown_time(page) == 50
    # Playing from the end begins again.
    page.click("#play")
    page.wait_for_function("parseFloat(document.getElementById('time').textContent) < 40")
    page.click("#play")
    page.fill("#seek", "25")
    assert shown_time(page) == 25
    # A view that is turned keeps the arrows.
    page.focus(".view")
    page.keyboard.press("ArrowRight")
    assert shown_time(page) == 25


def test_whoever_pauses_and_plays_within_a_frame_plays_no_faster(runs, opened):
    page = opened(runs / "crmpc-robust" / "page.html")
    second = """() => {
        let frames = [];
        window.requestAnimationFrame = (frame) => frames.push(frame);
        for (let k = 0; k < 3; k++) document.getElementById("play").click();
        for (const now of [0, 1000]) {
            const due = frames;
            frames = [];
            for (const frame of due) frame(now);
        }
    }"""
    page.evaluate(second)
    assert shown_time(page) == float(page.input_value("#speed"))


def test_the_vehicle_moves_with_the_run(runs, opened):
    page = opened(runs / "crmpc-2022-allocated" / "page.html")
    picture = "document.querySelector('.view').toDataURL()"
    first, label = page.evaluate(picture), page.get_attribute(".view", "aria-label")
    assert "α 7.5, β 10.0, σ −30.0 deg" in label
    assert page.locator(".surface").count() == 8 and page.locator(".jets i").count() == 10
    page.fill("#seek", "3")
    assert page.evaluate(picture) != first and page.get_attribute(".view", "aria-label") != label
    deflections = page.locator(".surface output").all_inner_texts()
    assert any(text not in ("0.0", "−0.0") for text in deflections)
    data = json.loads(page.inner_text("#run-data") or page.eval_on_selector("#run-data", "e => e.textContent"))
    assert len(data["runs"][0]["vehicle"]["time"]) <= 1501
    guaranteed = opened(runs / "crmpc-robust" / "page.html").get_attribute(".view", "aria-label")
    assert guaranteed.endswith("guarantee: in force")


def test_two_runs_side_by_side(runs, opened):
    page = opened(runs / "both.html")
    assert page.locator(".view").count() == 2
    assert "Beyond a limit: largest rate, largest moment" in page.inner_text("header")
    for panel in page.locator(".panel").all():
        styles = panel.locator("path.curve").evaluate_all(
            "paths => paths.map(path => path.getAttribute('stroke') + path.getAttribute('stroke-dasharray'))"
        )
        signals = [style for style in styles if "ink" not in style]
        assert len(signals) <= 6 and len(set(signals)) == len(signals)
    page.check("#different-only")
    page.uncheck("#set-only")
    assert page.locator("#parameter-table tbody tr:visible").count() > 3


def test_the_address_holds_time_and_window(runs, opened):
    path = runs / "lqr" / "page.html"
    page = opened(path)
    page.wait_for_function("location.hash.includes('t=')")
    page.evaluate("location.hash = 'window=10,20&t=12.5'; location.reload()")
    page.wait_for_function("document.getElementById('time')?.textContent === '12.50 s'")
    marks = page.locator(".panel svg[role=img]").nth(0).locator("text[text-anchor=middle]").all_text_contents()
    assert (marks[0], marks[-1]) == ("10", "20 s")
    page.fill("#seek", "15")
    page.wait_for_function("location.hash.includes('t=15')")
    page.locator(".panel svg[role=img]").nth(0).dblclick()
    page.wait_for_function("!location.hash.includes('window')")


def test_a_loss_and_a_peak_of_one_tick_are_seen_in_any_run(runs, tmp_path, opened):
    """Planted anywhere into a run of 5,001 rows: the words, the strip, the vehicle, and the curves show them."""
    long = tmp_path / "long"
    call("run", "crmpc-plan", "--stop", "200", "--quiet", "--out", long, cwd=os.getcwd())
    table = pd.read_csv(long / "results.csv")
    draws = random.Random(4)
    for _ in range(3):
        lost, peak = draws.sample(range(1, len(table) - 1), 2)
        planted = table.copy()
        planted.loc[lost, ["controller.guarantee.inForce", "controller.guarantee.status"]] = [0, 6]
        planted.loc[peak, "controller.moment.x"] = 3e5
        planted.to_csv(long / "results.csv", index=False)
        call("plot", long, "--out", tmp_path / "page.html", cwd=os.getcwd())
        page = opened(tmp_path / "page.html")
        assert page.inner_text("#guarantees") == "guarantee in force for 99.98 % of the time"
        loss = page.locator("#guarantees i").last
        assert loss.bounding_box()["width"] == pytest.approx(2, abs=0.1) and "warn" in loss.get_attribute("style")
        page.fill("#seek", str(table["time"][lost]))
        assert "guarantee: exceeded" in page.locator("canvas.view").get_attribute("aria-label")
        data = page.evaluate("JSON.parse(document.getElementById('run-data').textContent)")
        assert max(data["runs"][0]["vehicle"]["moment"][0]) == 3e5
        assert max(max(panel["curves"][-1]["values"]) for panel in data["panels"]) >= 300
        page.close()


def test_a_limit_that_is_exceeded_many_times_is_seen(tmp_path, opened):
    call("run", "lqr", "--set", "controller.limit.moment=10000", "--page", "--quiet", "--out", tmp_path / "run", cwd=os.getcwd())
    page = opened(tmp_path / "run" / "page.html")
    panel = page.locator("figure.panel").nth(4)
    assert panel.locator("h2").inner_text() == "norm of control moment, kN m"
    assert "limit of norm: 10 kN m" in panel.locator(".legend").inner_text()
    ends = panel.locator("svg[role=img] line[stroke-dasharray='6 4']").evaluate("line => [line.y1.baseVal.value, line.y2.baseVal.value]")
    assert ends[0] == ends[1] and 20 < ends[0] < 150


def test_axe_finds_no_fault(runs, opened):
    axe = Axe()
    pages = [runs / "crmpc-2022-allocated" / "page.html", runs / "both.html"]
    for path, scheme, width in itertools.product(pages, ["light", "dark"], [1400, 390]):
        page = opened(path, viewport={"width": width, "height": 800}, color_scheme=scheme)
        found = axe.run(page)
        assert found.violations_count == 0, found.generate_report()


def test_figures_can_be_read_on_a_phone(tmp_path, opened):
    call("run", "from-120km", "--stop", "100", "--page", "--quiet", "--out", tmp_path / "run", cwd=os.getcwd())
    call("reproduce", "two-loop-smc", "--members", "1", "--quiet", "--out", tmp_path / "study", cwd=os.getcwd())
    sizes = "texts => texts.filter(text => text.getBoundingClientRect().width > 0).map(text => parseFloat(getComputedStyle(text).fontSize) * Math.sqrt(text.getScreenCTM().a ** 2 + text.getScreenCTM().b ** 2))"
    for path in (tmp_path / "run" / "page.html", tmp_path / "study" / "report.html"):
        page = opened(path, viewport={"width": 390, "height": 844})
        drawn = page.locator("svg text").evaluate_all(sizes)
        assert len(drawn) > 20 and min(drawn) >= 9.0, path
        assert page.evaluate("document.documentElement.scrollWidth") == 390


def test_the_page_of_an_entry_flight(tmp_path, opened):
    call("run", "from-120km", "--page", "--quiet", "--out", tmp_path / "run", cwd=os.getcwd())
    path = tmp_path / "run" / "page.html"
    assert path.stat().st_size < 3e6
    page = opened(path)
    page.keyboard.press("End")
    assert shown_time(page) > 1800
    # A peak of one row survives the thinning.
    largest = json.loads((tmp_path / "run" / "metrics.json").read_text())["max_rate_deg_s"]
    values = page.evaluate("JSON.parse(document.getElementById('run-data').textContent).panels[2].curves.at(-1).values")
    assert max(values) == pytest.approx(largest, rel=1e-4)
    # Altitude over speed with its corridor, and the ground track, with the place of the vehicle at the end.
    flight = page.locator("#flight svg[role=img]")
    assert [part.get_attribute("aria-label") for part in flight.all()] == ["Altitude over speed", "Ground track"]
    names = flight.nth(0).locator(".entry").evaluate_all("entries => entries.map(entry => entry.dataset.name)")
    assert names == ["heat flux limit", "load limit", "pressure limit", "equilibrium glide", "flight"]
    place = "mark => [mark.cx.baseVal.value, mark.cy.baseVal.value]"
    end = "path => { const {x, y} = path.getPointAtLength(path.getTotalLength()); return [x, y]; }"
    for part in flight.all():
        drawn = part.locator("path[data-name=flight]").evaluate(end)
        assert part.locator(".place").evaluate(place) == pytest.approx(drawn, abs=0.5)
    verdict = "largest rate, largest moment, largest load, largest heat flux, largest pressure"
    assert page.inner_text(".verdict") == f"Within the limit: {verdict}."
    assert page.inner_text("#guarantees") == "guarantee in force for 100 % of the time"
