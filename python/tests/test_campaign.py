"""Campaigns and searches on one machine."""

import sys
from pathlib import Path

import numpy as np
import pytest
from reentry_fmus import OrchestratorError, campaign, experiment

CAMPAIGN = """
title = "LQR, inertia and gusts"
experiment = "lqr"
cases = 600
metrics = ["ems_deg"]

[[vary]]
parameter = "plant.disturbance.seed"
case = 1

[[vary]]
parameter = "plant.inertia.scale"
uniform = [0.95, 1.05]

[[vary]]
parameter = "plant.initial.alpha"
uniform = ["6 deg", "9 deg"]

[[measure]]
id = "rate"
kind = "largest"
signals = "rate-norm"

[[limit]]
id = "rate"
measure = "rate"
at_most = 6.0

[signals]
rate-norm = ["norm(plant.rate.p, plant.rate.q, plant.rate.r)"]

[search]
largest = "rate"
cases = 20
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("campaign") / "gusts.toml"
    path.write_text(CAMPAIGN)
    return path


@pytest.fixture(scope="module")
def flown(file, tmp_path_factory):
    return campaign(file).run(out=tmp_path_factory.mktemp("flown"), units="deg")


def test_a_campaign_is_a_table_of_cases(flown):
    table = flown.table
    assert table.shape[0] == 600 and table.index.name == "case"
    assert list(table.index) == list(range(600))
    assert table["plant.disturbance.seed"].tolist() == list(range(1, 601))
    assert table["plant.inertia.scale"].between(0.95, 1.05).all()
    assert table["status"].cat.categories.tolist() == ["completed", "ended", "lost", "failed"]
    assert (table["status"] == "completed").all() and (table["time"] == 50.0).all()
    assert table["kept.rate"].equals((table["rate"] <= 6.0).rename("kept.rate"))


def test_columns_have_units(file, flown):
    assert set(flown.table.attrs["units"]) == set(flown.table.columns)
    assert flown.table.attrs["units"]["rate"] == "deg/s"
    assert flown.table.attrs["units"]["plant.initial.alpha"] == "deg"
    assert flown.table["plant.initial.alpha"].between(6.0, 9.0).all()
    si = campaign(file).run(out=flown.folder).table
    assert si.attrs["units"]["plant.initial.alpha"] == "rad"
    assert si.attrs["units"]["plant.inertia.scale"] is None
    assert si["plant.initial.alpha"].max() < 0.16


def test_the_summary_follows_from_the_table(flown):
    assert flown.summary["cases"] == 600
    (limit,) = flown.summary["limits"]
    assert limit["broken"]["events"] == (~flown.table["kept.rate"]).sum()
    (rate,) = [measure for measure in flown.summary["measures"] if measure["name"] == "rate"]
    assert rate["summary"]["worst"] == flown.table["rate"].idxmax()
    assert rate["summary"]["mean"] == pytest.approx(flown.table["rate"].mean(), rel=1e-12)
    assert flown.report.read_text().lstrip().lower().startswith("<!doctype html>")


def test_a_campaign_is_shown_in_a_few_lines(flown):
    broken = flown.summary["limits"][0]["broken"]["events"]
    lines = repr(flown).splitlines()
    assert lines[:2] == ["Flown: LQR, inertia and gusts", "  600 cases, 600 completed"]
    assert lines[2].startswith(f"  rate ≤ 6 deg/s: broken by {broken} of 600, probability 0.")
    assert (Path.cwd() / lines[3].strip()).samefile(flown.report) and len(lines) == 4
    assert f"<td>{broken} of 600</td>" in flown._repr_html_()


def test_a_campaign_becomes_arrays(flown):
    pytest.importorskip("xarray")
    data = flown.to_xarray()
    assert dict(data.sizes) == {"case": 600} and set(data.data_vars) == set(flown.table)
    assert data["rate"].attrs == {"units": "deg/s"} and data.attrs["title"] == flown.summary["title"]
    assert np.array_equal(data["rate"], flown.table["rate"])
    assert set(data["status"].values) == {"completed"} and data["kept.rate"].dtype == bool


def test_what_is_flown_is_not_flown_again(file, flown):
    before = {path: path.stat().st_mtime_ns for path in (flown.folder / "parts").iterdir()}
    assert len(before) == 40
    bytes_before = (flown.folder / "cases.parquet").read_bytes()
    next(iter(before)).unlink()
    again = campaign(file).run(out=flown.folder, jobs=1, units="deg")
    assert again.table.equals(flown.table)
    after = {path: path.stat().st_mtime_ns for path in (flown.folder / "parts").iterdir()}
    assert sum(after[path] == before[path] for path in before) == 39
    assert (flown.folder / "cases.parquet").read_bytes() == bytes_before


def test_results_are_in_out_by_default(file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = tmp_path / "small.toml"
    small.write_text(CAMPAIGN.replace("cases = 600", "cases = 100"))
    run = campaign("small.toml").run()
    assert run.folder == tmp_path / "out" / "small" and len(run.table) == 100


def test_a_case_is_run_again_with_everything_recorded(file, flown, tmp_path):
    worst = int(flown.table["rate"].idxmax())
    run = campaign(file).case(worst, out=tmp_path / "worst")
    assert run.metrics["ems_deg"] == flown.table["ems_deg"][worst]
    rate = [run.table[f"plant.rate.{axis}"] for axis in "pqr"]
    largest = np.degrees(np.sqrt(np.square(rate).sum(axis=0))).max()
    assert largest == pytest.approx(flown.table["rate"][worst], rel=1e-9)
    again = experiment(tmp_path / "worst" / "case.toml")
    assert again.table.equals(run.table)


def test_a_search_finds_a_worse_case(file, flown, tmp_path):
    search = campaign(file).worst(out=tmp_path / "search", jobs=1)
    assert search.outcome["measure"] == "rate" and search.outcome["unit"] == "deg/s"
    assert search.table["rate"].max() == search.outcome["largest"]
    assert search.figure.startswith("<svg") and search._repr_svg_() == search.figure
    run = experiment(search.worst)
    rate = [run.table[f"plant.rate.{axis}"] for axis in "pqr"]
    largest = np.degrees(np.sqrt(np.square(rate).sum(axis=0))).max()
    assert largest == pytest.approx(search.outcome["largest"], rel=1e-9)


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ("at_most = 6.0", 'at_most = "6 deg/s"', "bad.toml:27: invalid type"),
        ("cases = 600", "cases = 600\ncasses = 1", "casses"),
        ("plant.inertia.scale", "plant.inertia.scal", 'did you mean "plant.inertia.scale"?'),
        ('experiment = "lqr"', 'experiment = "lqrr"', 'did you mean "lqr"?'),
    ],
)
def test_the_orchestrators_errors_are_exceptions(right, wrong, message, tmp_path):
    (tmp_path / "bad.toml").write_text(CAMPAIGN.replace(right, wrong))
    with pytest.raises(OrchestratorError) as caught:
        campaign(tmp_path / "bad.toml").run(out=tmp_path / "out")
    assert message in str(caught.value) and caught.value.exit_code == 2


def test_bad_arguments_are_refused(file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OrchestratorError, match='no campaign "gust"'):
        campaign("gust").run()
    with pytest.raises(OrchestratorError, match="the campaign has 600 cases"):
        campaign(file).case(600)
    with pytest.raises(ValueError, match='"si" or "deg"'):
        campaign(file).run(units="grad")


def test_a_missing_package_is_named(file, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(ModuleNotFoundError) as caught:
        campaign(file)
    assert 'pip install "reentry-fmus[campaign]"' in str(caught.value)
