"""The page "Try it in the browser" in headless Chromium: its flights have the bits of the orchestrator, also for the
experiment files that it writes."""

from __future__ import annotations

import base64
import json
import subprocess
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page

from browsing import in_chromium
from conftest import ROOT, program, tomllib


PAGE = ROOT / "out" / "browser" / "index.html"
# The controllers that the page offers: those of the studies.
STUDIES = ROOT / "orchestrator" / "experiments" / "base" / "studies.toml"
CONTROLLERS = [entry["id"] for entry in tomllib.loads(STUDIES.read_text(encoding="utf-8"))["lists"]["controllers"]]
# Another flight than the scenario's: text with a unit, integer, number, and both delays.
CHANGED = "plant.disturbance.bound=1.7+deg/s2&plant.disturbance.seed=7&plant.initial.alpha=12+deg&plant.inertia.scale=0.97"
DELAYED = f"{CHANGED}&plant.actuation.delay=0.04&controller.delay=0.04&controller.limit.moment=150000"

pytestmark = [
    pytest.mark.tier("browser"),
    pytest.mark.skipif(not PAGE.is_file(), reason=f"{PAGE.relative_to(ROOT)} does not exist: run scripts/browser"),
    in_chromium,
]


def flights(page: Page) -> int:
    return page.evaluate("Number(document.documentElement.dataset.flights ?? 0)")


def after(page: Page, count: int) -> None:
    """Waits for the flight after `count` others, and for the last one that was asked for."""
    page.wait_for_function(f"Number(document.documentElement.dataset.flights ?? 0) > {count} && !busy && !wanted")


def opened(browser: Browser, address: str = "", **options) -> Page:
    """The page once its first flight is shown. A fault in it fails the test."""
    page = browser.new_context(**options).new_page()
    page.faults = []
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    page.goto(f"{PAGE.as_uri()}#{address}")
    after(page, 0)
    assert page.faults == []
    return page


def signals(page: Page) -> pd.DataFrame:
    """The recorded signals, as the bytes that they are in the page."""
    columns, text = page.evaluate(
        """() => {
            const bytes = new Uint8Array(flight.signals.buffer), parts = [];
            for (let i = 0; i < bytes.length; i += 8192) parts.push(String.fromCharCode(...bytes.subarray(i, i + 8192)));
            return [flight.columns, btoa(parts.join(""))];
        }"""
    )
    values = np.frombuffer(base64.b64decode(text), dtype="<f8")
    return pd.DataFrame(values.reshape(-1, len(columns)), columns=columns)


def assert_same_bits(shown: pd.DataFrame, table: pd.DataFrame, missing: int) -> None:
    """All but so many columns of the page are those of the orchestrator."""
    common = [name for name in shown.columns if name in table]
    assert len(common) == len(shown.columns) - missing
    for name in common:
        assert shown[name].to_numpy().tobytes() == table[name].to_numpy(float).tobytes(), name


def saved(page: Page, folder: Path) -> Path:
    with page.expect_download() as download:
        page.click("#save")
    path = folder / download.value.suggested_filename
    download.value.save_as(path)
    return path


def flown(experiment: Path, folder: Path, code: int = 0) -> tuple[pd.DataFrame, dict]:
    """Results of the orchestrator for an experiment file."""
    done = subprocess.run([program("orchestrator"), "run", experiment, "--out", folder], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    table = pd.read_csv(folder / "results.csv", dtype=str).map(float)
    return table, json.loads((folder / "metrics.json").read_text())


@pytest.mark.parametrize("controller", CONTROLLERS)
def test_a_flight_has_the_bits_of_the_orchestrator(chromium, tmp_path, controller):
    address = f"controller={controller}&{DELAYED if controller in ('crmpc', 'lqr') else CHANGED}"
    page = opened(chromium, address, accept_downloads=True)
    shown = signals(page)
    table, metrics = flown(saved(page, tmp_path), tmp_path / "out")
    assert table["time"].iloc[-1] == 50.0
    # Only CRMPC says something of a guarantee.
    assert_same_bits(shown, table, missing=0 if "crmpc" in controller else 2)
    assert_same_figures(page, metrics)


@pytest.mark.parametrize("address", ["controller=crmpc&plant.initial.flightPathAngle=-1.25+deg", "controller=lqr&plant.air.rows=1&plant.air.wind.east[1]=30"])
def test_an_entry_has_the_bits_of_the_orchestrator(chromium, tmp_path, address):
    page = opened(chromium, f"flight=entry&{address}", accept_downloads=True)
    shown = signals(page)
    table, metrics = flown(saved(page, tmp_path), tmp_path / "out")
    assert shown["time"].iloc[-1] == table["time"].iloc[-1] > 1700.0
    assert_same_bits(shown, table, missing=0 if "crmpc" in address else 2)
    assert page.evaluate("flight.summary.rate_ratio") * 5.0 == pytest.approx(metrics["max_rate_deg_s"], rel=1e-12)
    arrival = page.inner_text("#arrival")
    assert "reaches the terminal area" in arrival and f"{metrics['range_off_km']:.1f} km off" in arrival
    assert "within its loads" in arrival and page.evaluate("stop") == shown["time"].iloc[-1]


def test_an_entry_is_shown_and_answers_to_its_pictures(chromium):
    page = opened(chromium)
    assert not page.is_visible("#entry")
    count = flights(page)
    page.click("#fly-entry")
    after(page, count)
    assert page.is_visible("#entry") and not page.is_visible("#proof") and "flight=entry" in page.evaluate("location.hash")
    track = page.locator("#entry svg[role=img]").nth(1)
    box = track.bounding_box()
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
    chosen = page.evaluate("time")
    assert 100 < chosen < 1800 and page.inner_text("#time") == f"{chosen:.1f} s"
    # An entry that is too steep misses the terminal area, and that is said.
    count = flights(page)
    page.get_by_label("path angle").fill("-2.5")
    after(page, count)
    assert " km short" in page.inner_text("#arrival") and "reaches" not in page.inner_text("#arrival")
    page.go_back()
    page.go_back()
    page.wait_for_function("!busy && !wanted && settings.flight === 'attitude'")
    assert page.is_visible("#proof")


def assert_same_figures(page: Page, metrics: dict) -> None:
    # The figures of merit are sums, which may be taken in another order.
    summary = page.evaluate("flight.summary")
    assert summary["cms"] == pytest.approx(metrics["cms"], rel=1e-9)
    assert summary["moment_ratio"] == pytest.approx(metrics["max_moment_ratio"], rel=1e-12)
    assert page.evaluate("flight.summary.ems * 180 / Math.PI") == pytest.approx(metrics["ems_deg"], rel=1e-9)
    rate = summary["rate_ratio"] * metrics["rate_limit_deg_s"]
    assert rate == pytest.approx(metrics["max_rate_deg_s"], rel=1e-12)


@pytest.mark.parametrize("address", ["controller=two-loop&plant.actuation.delay=0.2", "controller=lqr&plant.actuation.delay=1.0"])
def test_a_lost_attitude_ends_the_flight_as_in_the_orchestrator(chromium, tmp_path, address):
    page = opened(chromium, address, accept_downloads=True)
    shown, end = signals(page), page.evaluate("flight.summary.end")
    table, metrics = flown(saved(page, tmp_path), tmp_path / "out", code=3)
    assert end["time"] == table["time"].iloc[-1] == metrics["lost_at"] < 5.0
    assert_same_bits(shown, table, missing=2)
    assert_same_figures(page, metrics)
    assert "loses the attitude" in page.inner_text("#verdict")
    # Time stands where the flight ended.
    assert float(page.inner_text("#time").removesuffix(" s")) == pytest.approx(end["time"], abs=0.05)


def test_the_page_opens_with_the_published_scenario(chromium, tmp_path):
    experiment = ROOT / "orchestrator" / "experiments" / "crmpc-2022" / "crmpc-robust.toml"
    table, _ = flown(experiment, tmp_path)
    # That experiment does not record which assumption is contradicted.
    assert_same_bits(signals(opened(chromium)), table, missing=1)


def test_the_guarantee_is_told_as_the_orchestrator_tells_it(chromium):
    page = opened(chromium)
    assert "in force throughout" in page.inner_text("#figures")
    assert "keeps both limits" in page.inner_text("#verdict")
    # Three times the disturbance that the design provides for.
    page = opened(chromium, "plant.disturbance.bound=6+deg/s2")
    assert "void: the disturbance is larger than assumed" in page.inner_text("#figures")
    assert page.inner_text("#messages summary")
    # Limits that are kept are never beside a word that says one was not.
    assert "exceeded" not in page.inner_text("#flight") and "exceeded" not in page.evaluate("view.state.light.text")
    page = opened(chromium, "controller=lqr")
    assert "LQR gives none" in page.inner_text("#figures")
    assert "exceeds the rate limit (129 %) and the moment limit (446 %)" in page.inner_text("#verdict")


def test_a_slider_changes_flight_and_address_and_the_address_holds_everything(chromium):
    page = opened(chromium)
    before, count = signals(page), flights(page)
    slider = page.get_by_label("bound", exact=True)
    slider.focus()
    page.keyboard.press("ArrowRight")
    after(page, count)
    changed = signals(page)
    assert not changed.equals(before)
    page.select_option("#controller", "dlmpc")
    page.get_by_label("seed").fill("3")
    page.get_by_label("slidingMode.q").press("ArrowLeft")
    page.wait_for_function("!busy && !wanted")
    address = page.evaluate("location.hash.slice(1)")
    names = ["controller=dlmpc", "plant.disturbance.bound=2.0", "plant.disturbance.seed=3", "controller.slidingMode.q=4."]
    assert all(name in address for name in names), address
    again = opened(chromium, address)
    assert signals(again).equals(signals(page))
    assert again.evaluate("location.hash.slice(1)") == address
    count = flights(page)
    page.click("#reset")
    after(page, count)
    assert page.evaluate("location.hash") == "#controller=dlmpc"


def test_what_an_address_gets_wrong_is_named(chromium):
    assert "plant.wind" in opened(chromium, "plant.wind=3").inner_text("#said")
    page = opened(chromium, "controller=LQR&plant.disturbance.bound=4+deg/s2")
    assert 'no controller "LQR"' in page.inner_text("#said") and page.evaluate("location.hash") == "#controller=crmpc"
    for wrong in ("plant.disturbance.bound=2+rad", "controller.saturation=yes"):
        page = chromium.new_context().new_page()
        page.goto(f"{PAGE.as_uri()}#{wrong}")
        page.wait_for_function("document.querySelector('#verdict').textContent.startsWith('Refused')")
    page = chromium.new_context().new_page()
    page.goto(f"{PAGE.as_uri()}#plant.disturbance.bound=900+deg/s2")
    page.wait_for_function("document.querySelector('#said').textContent.includes('disturbance.bound')")
    # The page goes on from there.
    page.get_by_label("bound", exact=True).press("Home")
    after(page, 0)
    assert page.inner_text("#said") == ""


def test_one_file_is_everything(chromium):
    assert PAGE.stat().st_size <= 2_500_000
    page = chromium.new_context(offline=True).new_page()
    asked = []
    page.on("request", lambda request: asked.append(request.url.split(":")[0]))
    page.goto(PAGE.as_uri())
    after(page, 0)
    assert set(asked) <= {"file", "blob", "data"}


def test_the_view_of_the_vehicle_turns_as_the_angles_are_defined(chromium):
    """The velocity in body axes is (cos α cos β, sin β, sin α cos β); positive bank raises the right wing, which is y."""
    page = opened(chromium)
    rotation = np.array(page.evaluate("Vehicle3D.rotation([0.3, -0.2, 0.7])"))
    alpha, beta = 0.3, -0.2
    velocity = [np.cos(alpha) * np.cos(beta), np.sin(beta), np.sin(alpha) * np.cos(beta)]
    np.testing.assert_allclose(rotation @ velocity, [1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(rotation) > 0.0
    banked = np.array(page.evaluate("Vehicle3D.rotation([0, 0, 0.7])"))
    np.testing.assert_allclose(banked @ [0.0, 1.0, 0.0], [0.0, np.cos(0.7), -np.sin(0.7)], atol=1e-15)


def test_oracle_the_view_of_the_vehicle_turns_with_the_body_rates(chromium):
    page = opened(chromium, "controller=btvsmc&plant.kinematics=exact&plant.disturbance.kind=none")
    table = signals(page).iloc[:200]
    angles = table[[f"plant.attitude.{name}" for name in ("alpha", "beta", "sigma")]].to_numpy().tolist()
    views = np.array(page.evaluate("(all) => all.map((angles) => Vehicle3D.rotation(angles))", angles))
    step = np.diff(table["time"])[:, None, None]
    turned = (views[:-1].transpose(0, 2, 1) @ views[1:] - np.eye(3)) / step
    rates = np.stack([turned[:, 2, 1] - turned[:, 1, 2], turned[:, 0, 2] - turned[:, 2, 0], turned[:, 1, 0] - turned[:, 0, 1]], axis=1) / 2.0
    recorded = table[[f"plant.rate.{name}" for name in "pqr"]].to_numpy()
    middle = (recorded[1:] + recorded[:-1]) / 2.0
    assert np.abs(middle).max() > 0.05
    np.testing.assert_allclose(rates, middle, atol=1e-3)


def test_a_slider_says_what_is_flown(chromium):
    page = opened(chromium, "controller=lqr")
    for parameter, of in (("controller.limit.moment", "flight.summary.limits.moment / 1e3"), ("plant.initial.alpha", "flight.signals[1] * 180 / Math.PI")):
        for key in ("ArrowRight", "PageDown", "End"):
            count = flights(page)
            page.locator(f"[id='set-{parameter}']").press(key)
            after(page, count)
            shown = page.inner_text(f".row[data-names='{parameter}'] output").split()[0].replace("−", "-")
            assert float(shown) == pytest.approx(page.evaluate(of), rel=1e-3, abs=1e-9), (parameter, key)


def test_a_refused_setting_is_told_where_the_flight_is_judged(chromium):
    page = opened(chromium)
    page.get_by_label("rate limit", exact=True).press("Home")
    page.wait_for_function("document.body.classList.contains('refused')")
    assert page.inner_text("#verdict").startswith("Refused: ")
    count = flights(page)
    page.get_by_label("rate limit", exact=True).press("End")
    after(page, count)
    assert "keeps both limits" in page.inner_text("#verdict") and not page.evaluate("document.body.classList.contains('refused')")


def test_a_moment_that_is_scaled_into_its_limit_keeps_it(chromium):
    for limit in range(50, 70, 2):
        page = opened(chromium, f"controller=lqr&controller.saturation=true&controller.limit.moment={limit}000")
        assert "moment limit" not in page.inner_text("#verdict")
        page.close()


@pytest.mark.parametrize("address", ["", "flight=entry&controller=lqr", "controller=own"])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_no_rule_of_accessibility_is_broken(chromium, address, scheme):
    found = Axe().run(opened(chromium, address, color_scheme=scheme))
    assert found.violations_count == 0, found.generate_report()
