"""Campaigns over laws in Python."""

import importlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest
from conftest import SHORT, USUAL
from laws import lqr
from laws import pd as pd_law
from reentry_fmus import OrchestratorError, campaign
from reentry_fmus._data import FMUS, experiment_path, program
from test_campaign import CAMPAIGN

CASES = 30
# Cases that break the limit, and some that do not.
TEXT = (
    CAMPAIGN.replace("cases = 600", f"cases = {CASES}")
    .replace('metrics = ["ems_deg"]', 'metrics = ["ems_deg", "cms", "max_moment_ratio"]')
    .replace("at_most = 6.0", "at_most = 6.3")
)


class Integrating:
    """A law with a memory, which goes on from flight to flight if it is not a fresh one."""

    def __init__(self):
        self.sum = np.zeros(3)

    def __call__(self, state):
        self.sum += state.reference - state.attitude
        return pd_law(state) + 10.0 * self.sum


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("campaign") / "gusts.toml"
    path.write_text(TEXT)
    return path


@pytest.fixture(scope="module")
def by_law(file, tmp_path_factory):
    return campaign(file, law=lqr).run(out=tmp_path_factory.mktemp("law"))


@pytest.fixture(scope="module")
def by_fmu(file, tmp_path_factory):
    return campaign(file).run(out=tmp_path_factory.mktemp("fmu"))


# The same as an FMU


def test_oracle_a_law_flies_what_its_fmu_flies(by_law, by_fmu):
    """The law of docs/laws.md in Python against LQR.fmu: equal to rounding."""
    mine, packaged = by_law.table, by_fmu.table
    assert list(mine) == list(packaged) and mine.attrs == packaged.attrs
    assert mine.shape == (CASES, 11)
    for name in mine:
        if mine[name].dtype.kind == "f":
            assert np.allclose(mine[name], packaged[name], rtol=1e-9, atol=0.0), name
        else:
            assert mine[name].astype(str).equals(packaged[name].astype(str)), name
    assert not mine["ems_deg"].equals(packaged["ems_deg"]), "the FMU was flown"


def test_limits_and_intervals_are_those_of_the_fmu(by_law, by_fmu):
    (limit,) = by_law.summary["limits"]
    assert 0 < limit["broken"]["events"] < CASES
    assert by_law.summary["limits"] == by_fmu.summary["limits"]
    assert by_law.summary["status"] == by_fmu.summary["status"]
    pages = [flown.report.read_text() for flown in (by_law, by_fmu)]
    verdicts = [re.search(r'<section id="limits">.*?</section>', page, re.S)[0] for page in pages]
    assert verdicts[0] == verdicts[1] and "Clopper" in pages[0]
    headings = [re.findall(r"<h[123]>.*?</h[123]>", page) for page in pages]
    assert headings[0] == headings[1]
    assert "law lqr in place of LQR: LQR, scenario of Chai 2022" in pages[0]
    # The page shows how a case is flown again.
    assert "law=lqr).case(" in pages[0] and "orchestrator campaign" not in pages[0]


def test_the_bytes_do_not_depend_on_processes(file, by_law, tmp_path):
    before = {path.name: path.read_bytes() for path in (by_law.folder / "parts").iterdir()}
    assert len(before) == 6
    alone = campaign(file, law=lqr).run(out=tmp_path / "alone", jobs=1)
    again = {path.name: path.read_bytes() for path in (alone.folder / "parts").iterdir()}
    assert before == again
    for name in ("cases.parquet", "summary.json", "report.html"):
        assert (alone.folder / name).read_bytes() == (by_law.folder / name).read_bytes(), name


def test_what_is_flown_is_not_flown_again_by_the_same_law(file, by_law):
    parts = by_law.folder / "parts"
    times = {path.name: path.stat().st_mtime_ns for path in parts.iterdir()}
    (parts / "0000000025-0000000030.cases").unlink()
    assert campaign(file, law=lqr).run(out=by_law.folder).table.equals(by_law.table)
    after = {path.name: path.stat().st_mtime_ns for path in parts.iterdir()}
    assert [name for name in times if times[name] != after[name]] == [
        "0000000025-0000000030.cases"
    ]


def test_another_law_is_another_campaign(short, tmp_path):
    first = campaign(short, law=lambda state: [0.0, 0.0, 0.0]).run(out=tmp_path / "out")
    other = campaign(short, law=lambda state: [1e4, 0.0, 0.0]).run(out=tmp_path / "out")
    assert not first.table["ems_deg"].equals(other.table["ems_deg"])
    by_fmu = campaign(short).run(out=tmp_path / "out")
    assert not by_fmu.table["ems_deg"].equals(other.table["ems_deg"])


def test_a_law_with_a_memory_begins_afresh_in_each_case(short, tmp_path):
    law = Integrating()
    whole = campaign(short, law=law).run(out=tmp_path / "out", jobs=2)
    assert not law.sum.any()
    for case in (0, 1, 49):
        run = campaign(short, law=law).case(case)
        assert run.metrics["ems_deg"] == whole.table["ems_deg"][case]


def test_the_hash_of_a_law_is_that_of_its_code(tmp_path):
    """It is the same in another process, and another one if the code or its module changes."""
    program = """
        from laws import lqr
        from reentry_fmus import campaign
        gain = {gain}
        def law(state):
            return [gain * state.rate[0], 0.0, 0.0]
        for one in (law, lqr):
            print(campaign("white", law=one).law.key)
    """

    def keys(gain, folder):
        path = tmp_path / "program.py"
        path.write_text(textwrap.dedent(program.format(gain=gain)))
        environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONHASHSEED": "random"}
        environment["PYTHONPATH"] += os.pathsep + os.environ.get("PYTHONPATH", "")
        run = [sys.executable, path]
        done = subprocess.run(run, capture_output=True, text=True, env=environment, check=True)
        return done.stdout.split("\n")[:2]

    here = Path(__file__).parent
    first = keys(1.0, here)
    assert first == keys(1.0, here) and first[0].startswith("law ")
    assert keys(2.0, here)[0] != first[0]
    (tmp_path / "other").mkdir()
    changed = (here / "laws.py").read_text().replace("/ 10.0", "/ 11.0")
    (tmp_path / "other" / "laws.py").write_text(changed)
    assert keys(1.0, tmp_path / "other") == [first[0], keys(1.0, tmp_path / "other")[1]]
    assert keys(1.0, tmp_path / "other")[1] != first[1]


def test_a_law_may_be_in_a_module_and_print(short, tmp_path, monkeypatch):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "my_law.py").write_text(
        "def law(state):\n    print('here')\n    return [0.0, 0.0, 1e3]\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path / "mine"))
    law = importlib.import_module("my_law").law
    assert len(campaign(short, law=law).run(out=tmp_path / "out").table) == 50


def test_results_are_in_a_folder_of_the_law_by_default(short, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    mine = campaign("campaign.toml", law=pd_law)
    assert mine.run().folder == tmp_path / "out" / "campaign-pd"
    assert repr(mine).endswith("campaign.toml', law=pd)")


# Failure


def test_a_case_that_an_fmu_refuses_has_failed(file, tmp_path):
    """The vehicle tumbles: at a sideslip angle of 90 deg its angles are singular, and the attitude
    is lost before that."""
    text = file.read_text().replace(f"cases = {CASES}", "cases = 2")
    (tmp_path / "spin.toml").write_text(text)
    lost = campaign(tmp_path / "spin.toml", law=lambda state: [0.0, 3e7, 3e7]).run(
        out=tmp_path / "out"
    )
    assert (lost.table["status"] == "lost").all() and (lost.table["time"] < 50.0).all()
    assert not lost.table["kept.rate"].any()
    text = text.replace('experiment = "lqr"', 'experiment = "patient.toml"')
    (tmp_path / "spin.toml").write_text(text)
    lqr_file = subprocess.run(
        [sys.executable, "-c", "from reentry_fmus._command import main; main()", "show", "lqr"],
        capture_output=True,
        text=True,
        check=True,
    )
    patient = lqr_file.stdout.replace("beyond = 60.0", "beyond = 1e6")
    assert patient != lqr_file.stdout
    (tmp_path / "patient.toml").write_text(patient)
    with pytest.raises(OrchestratorError, match="all 2 cases failed.*singular") as caught:
        campaign(tmp_path / "spin.toml", law=lambda state: [0.0, 3e7, 3e7]).run(
            out=tmp_path / "out"
        )
    assert "plant failed at t = " in str(caught.value)
    assert str(caught.value).count("in doStep: ") == 1


def test_values_that_an_fmu_refuses_fail_their_cases_alone(short, tmp_path):
    """A normal distribution has no ends: here some bounds of the disturbance are negative."""
    varied = SHORT.replace("cases = 50", "cases = 10").replace("plant.disturbance.seed", "plant.x")
    varied = varied.replace('"plant.x"\ncase = 1', '"plant.disturbance.bound"\nnormal = { mean = 0.01, deviation = 0.02 }')
    short.write_text(varied)
    mine = campaign(short, law=lqr).run(out=tmp_path / "law").table
    packaged = campaign(short).run(out=tmp_path / "fmu").table
    assert set(packaged["status"]) == {"completed", "failed"}
    assert mine["status"].equals(packaged["status"]) and mine["time"].equals(packaged["time"])
    assert np.allclose(mine["ems_deg"], packaged["ems_deg"], rtol=1e-9, equal_nan=True)
    first = int((mine["status"] == "failed").idxmax())
    beginnings = [table["message"][first][:60] for table in (mine, packaged)]
    assert beginnings[0] == beginnings[1] and beginnings[0].startswith("plant failed at t = 0 s in")


def test_a_campaign_without_processes_is_refused(short, tmp_path):
    with pytest.raises(ValueError, match="at least one process"):
        campaign(short, law=pd_law).run(out=tmp_path / "out", jobs=0)


def test_progress_is_told_while_a_campaign_flies(short, tmp_path, monkeypatch):
    """No case ends before it is told."""
    told = tmp_path / "told"

    class Heard(io.StringIO):
        def write(self, text):
            with told.open("a") as file:
                return file.write(text)

    def law(state):
        while not told.exists():
            time.sleep(0.01)
        return [0.0, 0.0, 0.0]

    short.write_text(SHORT.replace("cases = 50", "cases = 2"))
    monkeypatch.setattr("reentry_fmus._campaign.PAUSE", 0.2)
    monkeypatch.setattr(sys, "stderr", Heard())
    campaign(short, law=law).run(out=tmp_path / "out")
    assert told.read_text().startswith("campaign-law: 2 cases to be flown\n")


def ended(number, code, folder, has_begun):
    """Sends a signal to a program that has begun, and waits until nothing that it started runs on. Ctrl-C
    goes to all processes of a terminal; here the one that called the package gets it alone."""
    imports = "from laws import pd\nfrom reentry_fmus import campaign, experiment\n"
    (folder / "program.py").write_text(imports + code)
    paths = [str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}
    here, there = os.pipe()
    command = [sys.executable, "program.py"]
    process = subprocess.Popen(command, cwd=folder, env=environment, stdin=there, stderr=there, **USUAL)
    os.close(there)
    while not has_begun():
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(number)
    # All of them hold the other end of the pipe.
    with open(here) as heard:
        said = heard.read()
    assert process.wait() != 0
    return said


signals = pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
not_windows = pytest.mark.skipif(os.name == "nt", reason="Ctrl-C goes another way under Windows")


@not_windows
@signals
@pytest.mark.parametrize("law", ["pd", "None"])
def test_a_signal_ends_a_campaign_and_keeps_what_is_flown(law, number, tmp_path):
    (tmp_path / "gusts.toml").write_text(TEXT.replace(f"cases = {CASES}", "cases = 5000"))
    parts = tmp_path / "out" / "parts"
    code = f"campaign('gusts.toml', law={law}).run(out='out', jobs=2)\n"
    said = ended(number, code, tmp_path, lambda: len(list(parts.glob("*.cases"))) >= 2)
    assert number == signal.SIGTERM or said.rstrip().endswith("KeyboardInterrupt")
    kept = sorted(path.name for path in parts.glob("*.cases"))
    flown = sum(int(last) - int(first) for first, last in re.findall(r"(\d+)-(\d+)", " ".join(kept)))
    work = campaign(tmp_path / "gusts.toml", law=pd_law if law == "pd" else None)
    left = json.loads(work.call("--work", "--out", str(tmp_path / "out")))["missing"]
    assert sum(last - first for first, last in left) == 5000 - flown > 0
    # Nothing flies on.
    time.sleep(1.0)
    assert sorted(path.name for path in parts.iterdir()) == kept


@not_windows
@signals
def test_a_signal_ends_a_run_and_keeps_its_rows(number, tmp_path):
    table = tmp_path / "out" / "results.csv"
    code = "experiment('from-120km', out='out')\n"
    ended(number, code, tmp_path, lambda: table.is_file() and table.stat().st_size > 10_000)
    heading, *rows = table.read_text().splitlines(keepends=True)
    assert {row.count(",") for row in rows} == {heading.count(",")} and rows[-1].endswith("\n")
    assert 10.0 < float(rows[-1].split(",")[0]) < 1000.0


@pytest.mark.parametrize("answer", [b"", bytes(80)])
def test_the_orchestrator_says_that_the_law_has_ended(answer, tmp_path):
    """A program of another's may speak to it, too. That it ends is no result."""
    out = tmp_path / "out"
    command = [program(), "run", experiment_path("lqr"), "--out", out, "--law", "mine"]
    done = subprocess.run([*command, "--fmu-dir", FMUS], input=answer, capture_output=True)
    assert done.returncode == 1
    assert "the program with the control law has ended" in done.stderr.decode()
    asked = [3] if answer else [0]
    # It begins, and asks for a moment until it gets none.
    assert done.stdout[:1] == b"b" and b"\nattitude.alpha\n" in done.stdout
    metrics = json.loads((out / "metrics.json").read_text())
    assert metrics["completed"] is False and metrics["samples"] == asked[0] + 1
    command = [program(), "campaign", "white", "--out", tmp_path / "cases", "--law", "mine"]
    done = subprocess.run([*command, "--fmu-dir", FMUS], input=answer, capture_output=True)
    assert done.returncode == 1 and not list(tmp_path.glob("cases/parts/*"))
