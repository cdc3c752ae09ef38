"""`orchestrator reproduce`: the report of Chai 2022, section 5.2, with few members of each run, the
other studies as they are, and what docs/results.md and other pages say of them."""

import base64
import json
import os
import re
import shutil
import signal
import subprocess
import time
import zlib

import numpy as np
import pytest
import results as pages

from conftest import EXPERIMENTS, TARGET, merged, program, tomllib
from figures import check_folder

pytestmark = pytest.mark.tier("studies")

MEMBERS = 2


def reproduce(study, out, *arguments: str) -> subprocess.CompletedProcess:
    command = [program("orchestrator"), "reproduce", study, "--out", out, "--fmu-dir", TARGET / "fmu", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=out.parent)


def started(command, **arguments) -> subprocess.Popen:
    """Starts a program that ignores no signal, although `nohup` and a shell that starts this one in the
    background make it ignore some."""

    def usual():
        for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)

    return subprocess.Popen(command, preexec_fn=usual, **arguments)


def copied(name: str, folder):
    """A copy of all experiments, as studies extend what they share; returns the folder of one study."""
    shutil.copytree(EXPERIMENTS.parent, folder / "experiments")
    return folder / "experiments" / name


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Half a minute, as every number of the pages about this study comes from its 139 runs."""
    out = tmp_path_factory.mktemp("reproduce") / "out"
    finished = reproduce(EXPERIMENTS, out, "--members", str(MEMBERS))
    assert finished.returncode == 0, finished.stderr
    return finished, out


@pytest.fixture(scope="module")
def results(report):
    return json.loads((report[1] / "results.json").read_text())


def metric(results, run: str, name: str) -> list[float]:
    return [member[name] for member in results["runs"][run]["members"]]


def claim(results, words: str) -> dict:
    (found,) = [claim for claim in results["claims"] if words in claim["says"]]
    return found


def test_every_figure_is_on_the_page_and_beside_it(report):
    study = tomllib.loads((EXPERIMENTS / "study.toml").read_text())
    page = (report[1] / "report.html").read_text()
    figures = [figure["id"] for figure in study["figure"]]
    assert {"fig-3", "fig-4", "fig-5", "fig-6", "fig-7"} <= set(figures)
    for figure in figures:
        drawn = page.split(f'<figure id="{figure}">')[1].split("</figure>")[0]
        # Those of folded parts are compressed.
        if folded := re.search('data-folded="([^"]+)"', drawn):
            assert f'<noscript><img src="figures/{figure}.svg"' in drawn
            drawn = zlib.decompress(base64.b64decode(folded[1]), -zlib.MAX_WBITS).decode()
        assert drawn.count("<path data-name=") + drawn.count("<circle data-name=") > 0, figure
        assert (report[1] / "figures" / f"{figure}.svg").read_text().startswith("<svg")


def test_curves_of_every_figure_differ_without_red_and_green(report):
    check_folder(report[1])


@pytest.mark.parametrize("run", ["crmpc-paper", "crmpc-robust", "dlmpc", "dlmpc-tuned", "lqr"])
def test_the_first_member_is_the_experiment_itself(experiment, results, run):
    alone = json.loads((experiment(run) / "metrics.json").read_text())
    for name in ["ems_deg", "cms", "max_rate_deg_s", "max_moment_ratio", "fallbacks"]:
        assert metric(results, run, name)[0] == alone[name], name


def test_crmpc_needs_a_third_less_effort_than_dlmpc_with_the_printed_gains(results):
    # Chai 2022, Table I, prints a reduction of 34.21 %.
    checks = claim(results, "34.21")["checks"]
    printed = [check for check in checks if "tuned" not in check["label"]]
    assert len(printed) == 5 and all(check["held"] == check["of"] for check in printed)
    # CRMPC also needs less effort than the tuned gains, which halve DLMPC's effort. With the
    # paper's sets the saving is below 34.21 %.
    for run, least in [("crmpc-paper", 0.25), ("crmpc-robust", 0.3421)]:
        pairs = zip(metric(results, run, "cms"), metric(results, "dlmpc-tuned", "cms"), strict=True)
        assert all(ours <= (1 - least) * theirs for ours, theirs in pairs)


def test_the_loop_with_estimator_is_stable_and_the_robust_set_keeps_its_limits(results):
    # Each run has as many seeds as are run here; the whole study has 100.
    assert all(len(metric(results, run, "cms")) == MEMBERS for run in ["crmpc-guaranteed-est", "lqr-est"])
    checks = claim(results, "sensors, filter")["checks"]
    assert len(checks) == 4 and all(check["held"] == check["of"] for check in checks)
    for run in ["crmpc-guaranteed-est", "crmpc-robust-est"]:
        assert max(metric(results, run, "max_rate_deg_s")) < 5.0 and max(metric(results, run, "max_moment_ratio")) <= 1.0 + 1e-12
        assert max(metric(results, run, "fallbacks")) == 0
    # The guarantee holds from the second tick on, when the first command acts.
    assert min(metric(results, "crmpc-guaranteed-est", "guarantee_share")) > 0.999


def test_the_map_of_the_guarantee(results):
    """The guarantee is in force and kept where the design accepts the settings; larger
    disturbances, errors or delays are refused."""
    accepted = {}
    for run, result in results["runs"].items():
        if not run.startswith("map-"):
            continue
        metrics = result["members"][0]
        accepted[run[4:]] = metrics["guarantee_share"] > 0.9
        assert metrics["guarantee_broken"] is False
        assert metrics["max_rate_deg_s"] <= 5.0 and metrics["max_moment_ratio"] <= 1.0 + 1e-12
        # An accepted design lacks the guarantee at most in the first ticks; a refused one has it at
        # no tick.
        assert accepted[run[4:]] or metrics["guarantee_share"] == 0.0
    assert len(accepted) == 45
    for delay in ["000", "040", "117"]:
        for error, largest in [("e0", 20), ("e1", 10), ("e2", 5)]:
            bounds = [bound for bound in [5, 10, 15, 20, 25] if accepted[f"{delay}-{error}-b{bound:02}"]]
            assert bounds == [bound for bound in [5, 10, 15, 20, 25] if bound <= (10 if (delay, error) == ("000", "e2") else largest)]


def test_prediction_makes_up_for_a_delay(results):
    """Prediction over a known delay limits the extra effort and the excess over the rate limit; an
    unknown delay costs more."""
    for law in ["robust", "paper", "dlmpc", "lqr"]:
        known, unknown = (
            results["runs"][f"delay-200-{law}{way}"]["members"][0] for way in ["-predicted", ""]
        )
        without = results["runs"][f"delay-000-{law}"]["members"][0]
        assert known["cms"] < 1.1 * without["cms"] and unknown["cms"] > 1.35 * without["cms"], law
        assert known["max_rate_deg_s"] < 1.03 * without["max_rate_deg_s"], law


def test_oracle_crmpc_comes_near_the_clairvoyant_optimum_of_its_sets(results):
    bounds = {value["id"]: value["value"] for value in results["values"]}
    # Of 20 seeds the worst is 5.3 % above the bound. The untightened sets are larger, so their lower
    # bound is lower.
    for ems in metric(results, "crmpc-paper", "ems_deg"):
        assert bounds["ems.clairvoyant.paper"] < ems <= 1.06 * bounds["ems.clairvoyant.paper"]
        assert ems <= 1.12 * bounds["ems.clairvoyant.printed"]
    for run in ["crmpc-robust", "dlmpc", "dlmpc-tuned"]:
        assert min(metric(results, run, "ems_deg")) > bounds["ems.clairvoyant.limits"]


def test_the_orders_that_the_paper_prints(results):
    checks = {check["label"]: check for check in claim(results, "11.75")["checks"]}
    assert checks["paper sets, with noise, lower at all"]["held"] == MEMBERS
    assert checks["paper sets, no noise"]["held"] == 1
    # Claims that do not hold are reported as such.
    assert checks["robust sets, with noise"]["held"] == 0
    assert claim(results, "11.75")["verdict"] == "holds-partly"
    assert claim(results, "LQR breaks both limits")["verdict"] == "holds"
    assert claim(results, "LQR tracks worse")["verdict"] == "does-not-hold"


@pytest.mark.parametrize("case", [1, 2])
def test_a_square_wave_drives_the_rate_to_twice_the_printed_tube(results, case):
    square = results["runs"][f"tube-{case}-square"]["members"][0]
    assert 2.0 < square[f"within.rate-{case}-printed.ratio"] < 2.1
    assert square[f"within.rate-{case}-exact.share"] == 1.0 and square[f"within.rate-{case}-exact.ratio"] > 0.99
    # A constant disturbance reaches half of the exact rate tube, and all of the exact angle tube.
    constant = results["runs"][f"tube-{case}-constant"]["members"][0]
    assert constant[f"within.rate-{case}-exact.ratio"] == pytest.approx(0.5, abs=2e-3)
    assert constant[f"within.angle-{case}-exact.ratio"] == pytest.approx(1.0, abs=2e-3)


def test_a_second_call_computes_nothing_and_says_the_same(report):
    _, out = report
    before = (out / "results.json").read_bytes(), (out / "report.html").read_bytes()
    finished = reproduce(EXPERIMENTS, out, "--members", str(MEMBERS))
    assert finished.returncode == 0 and "0 run now" in finished.stdout
    assert before == ((out / "results.json").read_bytes(), (out / "report.html").read_bytes())


def test_a_signal_ends_it_and_keeps_what_is_finished(tmp_path):
    out, temporary = tmp_path / "out", tmp_path / "tmp"
    temporary.mkdir()
    out.mkdir()
    (out / "report.html").write_text("of an earlier run")
    command = [program("orchestrator"), "reproduce", EXPERIMENTS, "--out", out, "--fmu-dir", TARGET / "fmu", "--quiet"]
    environment = {**os.environ, "TMPDIR": str(temporary)}
    process = started(command, stderr=subprocess.PIPE, text=True, env=environment)
    while len(list(out.glob("runs/*/*.cases"))) < 3:
        assert process.poll() is None
        time.sleep(0.02)
    # A second process must wait.
    second = reproduce(EXPERIMENTS, out)
    assert second.returncode == 2 and "another process is writing its results to" in second.stderr
    process.send_signal(signal.SIGTERM)
    _, errors = process.communicate()
    assert process.returncode == 143 and errors.count("\n") == 1, errors
    assert re.search(r"ended by a signal \(SIGTERM\): \d+ of \d+ cases are flown", errors)
    assert list(temporary.iterdir()) == [] and not (out / "report.html").exists()
    assert not list(out.rglob("*.part"))


def test_a_claim_without_its_numbers_is_not_judged_and_a_seed_that_changes_nothing_is_told(tmp_path):
    study = tmp_path / "study"
    study.mkdir()
    text = merged(EXPERIMENTS / "lqr.toml")
    (study / "lqr.toml").write_text(text.replace("beyond = 60.0", "beyond = 2.0"))
    (study / "study.toml").write_text(
        """title = "one run"
paper = "none"
summary = "none"
values = []
[[run]]
id = "lqr"
label = "LQR"
color = "#000000"
experiment = "lqr.toml"
set = { "plant.disturbance.kind" = "constant" }
seeds = ["plant.disturbance.seed"]
cases = 3
[[claim]]
says = "LQR solves fast."
source = "nowhere"
[[claim.check]]
label = "mean"
left = "lqr.solver_ms_mean"
relation = "below"
right = 1.0
"""
    )
    finished = reproduce(study, tmp_path / "out")
    assert finished.returncode == 0, finished.stderr
    assert "not judged" in finished.stdout
    (claim,) = json.loads((tmp_path / "out" / "results.json").read_text())["claims"]
    assert claim["verdict"] == "not-judged" and claim["checks"][0]["label"] == "mean"
    assert "lqr: plant.disturbance.seed has no effect, all 3 runs are the same" in finished.stdout
    assert re.search(r"lqr: the attitude is lost in 3 of 3 runs, at t = \S+ s or later", finished.stdout)


@pytest.mark.parametrize(
    ("key", "other"),
    [("every", "every = 2"), ("unit", 'unit = { name = "mdeg", factor = 1e3 }'), ("over", "over = [1.0, 2.0]"), ("kind", 'kind = "largest"')],
)
def test_a_changed_measure_is_computed_again(tmp_path, key, other):
    study = tmp_path / "study"
    study.mkdir()
    (study / "lqr.toml").write_text(merged(EXPERIMENTS / "lqr.toml"))

    def written(*keys: str) -> str:
        kind = [] if key == "kind" and keys else ['kind = "rms"']
        return "\n".join(
            [
                'title = "one run"',
                'paper = "none"',
                'summary = "none"',
                "values = []",
                "[signals]",
                'alpha = ["plant.attitude.alpha"]',
                "[[measure]]",
                'id = "m"',
                'signals = "alpha"',
                *kind,
                *keys,
                "[[run]]",
                'id = "lqr"',
                'label = "LQR"',
                'color = "#000000"',
                'experiment = "lqr.toml"',
                'measures = ["m"]',
            ]
        )

    values = []
    for text in (written(), written(other)):
        (study / "study.toml").write_text(text)
        finished = reproduce(study, tmp_path / "out")
        assert finished.returncode == 0, finished.stderr
        assert "1 run now" in finished.stdout
        (member,) = json.loads((tmp_path / "out" / "results.json").read_text())["runs"]["lqr"]["members"]
        values.append(member["measure.m"])
    assert values[0] != values[1]


@pytest.mark.parametrize(
    ("name", "old", "new", "culprit"),
    [
        ("crmpc-2022", 'experiment = "{id}.toml"', 'experiment = "{id}q.toml"', "run crmpc-paper"),
        ("crmpc-2022", 'runs = ["lqr", "dlmpc"', 'runs = ["lqq", "dlmpc"', 'did you mean "lqr"'),
        ("crmpc-2022", 'signal = "estimator.attitude.alpha ', 'signal = "estimator.attitude.alphaa ', 'did you mean "estimator.attitude.alpha"'),
        ("crmpc-2022", 'paper = "ems.dlmpc"', 'paper = "ems.dlmp"', 'did you mean "ems.dlmpc"'),
        ("crmpc-2022", 'ours = "dlmpc-est.cms"', 'ours = "dlmpc-est.cmss"', 'did you mean "cms"'),
        ("crmpc-2022", 'left = "crmpc-paper.cms"', 'left = "crmpc-papr.cms"', 'did you mean "crmpc-paper"'),
        ("crmpc-2022", 'seeds = ["plant.disturbance.seed"]', 'seeds = ["plant.disturbance.sed"]', "disturbance.seed"),
        ("crmpc-2022", 'bound = "tube.case1"', 'bound = "tube.cas1"', "tube.cas1"),
        ("crmpc-2022", 'within = ["angle-1-printed"', 'within = ["angle-1-prnted"', 'did you mean "angle-1-printed"'),
        ("crmpc-2022", "columns = 2", "colums = 2", "colums"),
        ("crmpc-2022", 'extends = "dlmpc-est"', 'extends = "dlmpc-ets"', 'did you mean "dlmpc-est"'),
        ("crmpc-2022", 'for = "optimising"', 'for = "optimizing"', 'did you mean "optimising"'),
        ("crmpc-2022", 'id = "{id}-calm"', 'id = "{di}-calm"', "{di}"),
        ("exchange", 'runs = ["*"]', 'runs = ["chai-alocated-*"]', "chai-alocated-*"),
        ("exchange", "set_for.dlmpc", "set_for.dlmp", 'did you mean "dlmpc"'),
        ("exchange", 'of = "step_us.controller"', 'of = "step_s.controller"', "step_s.controller"),
        ("exchange", "100 * guarantee_share", "1OO * guarantee_share", "no factor"),
        ("two-loop-smc", "± reach.roll", "± reach.rol", "reach.rol"),
        ("exchange", 'experiment = "tvsmc-2015-allocated.toml"', 'experiment = "tvsmc-allocated.toml"', "tvsmc-allocated"),
    ],
)
def test_a_study_with_a_mistake_is_refused_before_anything_runs(tmp_path, name, old, new, culprit):
    study, out = copied(name, tmp_path), tmp_path / "out"
    text = (study / "study.toml").read_text()
    assert old in text
    (study / "study.toml").write_text(text.replace(old, new, 1))
    finished = reproduce(study, out)
    assert finished.returncode == 2 and culprit in finished.stderr, finished.stderr
    assert finished.stderr.count("\n") == 1 and not out.exists()


def test_an_unknown_study_is_refused(tmp_path):
    finished = reproduce(tmp_path / "nothing", tmp_path / "out")
    assert finished.returncode == 2 and "there is no study" in finished.stderr


# The pages of the studies that the tests have flown so far.
PAGES = {}


def reproduced(name: str, folder) -> dict:
    finished = reproduce(EXPERIMENTS.parent / name, folder / "out")
    assert finished.returncode == 0, finished.stderr
    PAGES[name] = folder / "out" / "report.html"
    return json.loads((folder / "out" / "results.json").read_text())


@pytest.fixture(scope="module")
def wu(tmp_path_factory):
    """The study of Wu 2015: its folder and its results."""
    folder = tmp_path_factory.mktemp("wu")
    return folder / "out", reproduced("tvsmc-2015", folder)


# The verdicts on the claims of Wu 2015 at the printed biases: with moments that act directly, with
# surfaces and jets, and with our additions.
HOLDS, PARTLY, FAILS = "holds", "holds-partly", "does-not-hold"
VERDICTS_OF_WU = {
    "sliding modes are more robust than feedback linearisation.": (HOLDS, HOLDS, HOLDS),
    "the errors of feedback linearisation do not vanish.": (HOLDS, HOLDS, HOLDS),
    "with the observer, errors are smaller than without, and than those of feedback linearisation.": (HOLDS, PARTLY, HOLDS),
    "all angles reach their commands within 4 s under both laws with an observer.": (HOLDS, FAILS, HOLDS),
    "the errors of SOTVSMC/DO are much smaller than those of BTVSMC/DO.": (HOLDS, HOLDS, PARTLY),
    "the sliding variables of BTVSMC do not converge to zero.": (HOLDS, HOLDS, HOLDS),
    "the time-varying surface has no reaching phase: the sliding variables begin at zero.": (HOLDS, HOLDS, HOLDS),
    "under the laws with an observer they move away from zero and are back after about 4 s.": (HOLDS, FAILS, FAILS),
    "the sliding variables of BTVSMC/DO stay inside the boundary layer.": (HOLDS, FAILS, HOLDS),
    "the sliding variables of SOTVSMC/DO converge to zero more precisely than those of BTVSMC/DO.": (HOLDS, HOLDS, FAILS),
    "the observer estimates the sliding variables effectively.": (HOLDS, PARTLY, HOLDS),
    "the sliding modes do not chatter.": (HOLDS, PARTLY, HOLDS),
    "the rudders stay at zero.": (None, HOLDS, HOLDS),
    "all limits of the actuators are satisfied.": (None, HOLDS, HOLDS),
    "the jets make up for saturated surfaces with high accuracy.": (None, PARTLY, PARTLY),
}


def test_verdicts_on_the_claims_of_wu_2015(wu):
    setups = ["Direct", "Surfaces and jets", "Surfaces and jets, with our additions"]
    expected = {
        f"{setup}: {words}": verdict
        for words, verdicts in VERDICTS_OF_WU.items()
        for setup, verdict in zip(setups, verdicts, strict=True)
        if verdict
    }
    assert {claim["says"]: claim["verdict"] for claim in wu[1]["claims"]} == expected


def test_the_claims_of_wu_2015_hold_with_moments_acting_directly(wu):
    _, results = wu
    members = {run: results["runs"][run]["members"][0] for run in results["runs"]}
    # docs/errata.md states these RMS values of alpha, beta, sigma over 10 to 20 s, in deg.
    for run, expected in [("fbl", (0.205, 0.076, 0.493)), ("btvsmc", (0.047, 0.017, 0.112))]:
        ours = [members[run][f"measure.rms-{axis}"] for axis in ("alpha", "beta", "sigma")]
        assert ours == pytest.approx(expected, abs=5.1e-4)
        assert members[run]["measure.settling"] is None
    # 2.95 s and 1.5e-4 deg are measured.
    for run in ["btvsmc-do", "sotvsmc-do"]:
        assert members[run]["measure.settling"] <= 4.0
    assert max(members["btvsmc-do"][f"measure.rms-{axis}"] for axis in ("alpha", "beta", "sigma")) <= 3e-4


def test_wu_2015_with_control_allocation(wu):
    _, results = wu
    members = {run: results["runs"][run]["members"][0] for run in results["runs"]}
    # These runs have surfaces at 10 deg/s, all biases and both additions; the jets give any commanded
    # thrust, or PWPF switches them. The paper says 4 s; 3.71 s and 0.0098 deg are measured.
    for run in ["duty-btvsmc-do", "duty-sotvsmc-do", "optimal-btvsmc-do", "optimal-sotvsmc-do"]:
        assert members[run]["measure.settling"] <= 4.0 and members[run]["measure.largest-error"] <= 0.015
        assert members[run]["within.rudders.share"] == 1.0
    # With PWPF every controller keeps the attitude.
    stable = {run: m["measure.largest-error"] for run, m in members.items() if run.startswith("optimal-")}
    assert len(stable) == 8 and max(stable.values()) < 1.3
    assert all(members[run]["measure.pulses"] > 0 for run in stable)
    # With the selector of Jia et al. the laws with an observer are nearly as precise: 0.0135 deg.
    blended = {run: m["measure.largest-error"] for run, m in members.items() if run.startswith("blending-")}
    assert max(blended[f"blending-{law}-do"] for law in ("btvsmc", "sotvsmc")) <= 0.02


def test_curves_of_wu_2015_differ_without_red_and_green(wu):
    check_folder(wu[0])


def test_published_parameters_of_wu_2015_are_those_of_the_fmus(wu):
    page = (wu[0] / "report.html").read_text()
    tables = re.findall(r"<h3>Table [12]:.*?</table>", page, re.DOTALL)
    rows = [re.findall(r"<td.*?>(.*?)</td>", row) for t in tables for row in t.split("<tr>")[2:]]
    assert len(tables) == 2 and len(rows) == 35
    for label, paper, ours, difference, _ in rows:
        assert paper == ours and difference == "0", label


def test_every_controller_flies_every_scenario(tmp_path):
    """It takes more than half a minute, as nothing else flies each law in the scenarios of the others."""
    results = reproduced("exchange", tmp_path)
    assert len(results["runs"]) == 54
    members = {name: run["members"][0] for name, run in results["runs"].items()}
    for name, member in members.items():
        assert member["completed"], name
        assert member["step_us.controller"] > 0.0
        # No law was designed for the others' scenarios. Still none loses the attitude, except under
        # Jia's disturbance, which is more than surfaces and jets can give.
        if not name.startswith("jia-allocated"):
            assert member["ems_deg"] < 10.0, name
        assert ("measure.pulses" in member) == ("allocated" in name)
    # In its own scenario the two-loop law leaves the smallest error.
    errors = {name: m["measure.rms-late"] for name, m in members.items() if re.match("jia-(?!alloc)", name)}
    assert min(errors, key=errors.get) == "jia-two-loop" and errors["jia-two-loop"] < 0.1


def test_every_controller_turns_the_bank_angle(tmp_path):
    results = reproduced("reversal", tmp_path)
    assert len(results["runs"]) == 46
    assert [claim["verdict"] for claim in results["claims"]] == [HOLDS, HOLDS, HOLDS, FAILS, HOLDS, HOLDS]
    members = {name: run["members"][0] for name, run in results["runs"].items()}
    # Nobody turns from -58 to 58 deg faster than the rate allows without breaking its limit.
    for name, member in members.items():
        turning, rate = 40.0 * member["measure.turning"], member["max_rate_deg_s"]
        assert turning > 116.0 / 5.0 or rate > 5.0, (name, turning, rate)
    # Every law uses the derivatives of its reference.
    shaped = {name: member["ems_deg"] for name, member in members.items() if name.startswith("shaped")}
    assert all(ems < 0.25 for ems in shaped.values()), shaped
    assert differences(tmp_path / "out") == []


def test_every_controller_has_its_margins(tmp_path):
    """It takes a minute: a table of the results is made of these 112 linear models, and a change of a law has once
    made it untrue."""
    results = reproduced("margins", tmp_path)
    assert len(results["runs"]) == 112
    assert [claim["verdict"] for claim in results["claims"]] == [HOLDS, HOLDS, HOLDS]
    [member] = results["runs"]["late-lqr"]["members"]
    # The disk margin is within the margins of gain and phase by themselves.
    without = []
    for name, run in results["runs"].items():
        metrics = run["members"][0]
        alpha = metrics["margin_disk"]
        if alpha is None:
            without.append(name)
            continue
        gain = (2.0 + alpha) / (2.0 - alpha)
        assert metrics["margin_gain_above"] is None or gain <= metrics["margin_gain_above"] * (1.0 + 1e-6), name
        assert metrics["margin_gain_below"] is None or 1.0 / gain >= metrics["margin_gain_below"] * (1.0 - 1e-6), name
        assert np.degrees(2.0 * np.arctan(0.5 * alpha)) <= metrics["margin_phase_deg"] * (1.0 + 1e-6), name
    # With fractional powers there is no slope at rest.
    assert set(without) == {name for name in results["runs"] if name.endswith(("-dlmpc", "-btvsmc-do", "-sotvsmc-do"))}
    # The delay margin falls by the delay.
    [ideal] = results["runs"]["ideal-lqr"]["members"]
    assert ideal["margin_delay_s"] - member["margin_delay_s"] == pytest.approx(0.04, abs=1e-6)
    assert differences(tmp_path / "out") == []


def test_every_controller_flies_an_entry(tmp_path):
    """Its 47 whole flights, two at a time on two cores, take more than a minute: nothing else flies each law through an
    entry, navigated, and by surfaces and jets, and a page has the numbers of each."""
    results = reproduced("entry", tmp_path)
    assert len(results["runs"]) == 47
    assert [claim["verdict"] for claim in results["claims"]] == [HOLDS, HOLDS, HOLDS]
    for name, run in results["runs"].items():
        [member] = run["members"]
        assert member["completed"] and member["measure.reversals"] >= 3, name
        # Jets work alone until the dynamic pressure passes the selector's threshold.
        if name.startswith("surfaces-and-jets"):
            assert 0.05 < member["measure.jets-alone"] < 0.5, name
    assert differences(tmp_path / "out") == []


def test_oracle_the_shaped_reversal_is_the_integral_of_its_derivatives():
    rows = np.genfromtxt(EXPERIMENTS.parent / "reversal" / "reversal.csv", delimiter=",", skip_header=1)
    time, alpha, beta, sigma, rate, acceleration = rows.T
    step = np.diff(time)
    assert np.allclose(np.diff(sigma), step * (rate[1:] + rate[:-1]) / 2, atol=1e-6)
    # The acceleration jumps where two rows have the same time.
    assert np.allclose(np.diff(rate), step * (acceleration[1:] + acceleration[:-1]) / 2, atol=1e-6)
    assert (sigma[0], sigma[-1], rate[0], rate[-1]) == (-60.0, 60.0, 0.0, 0.0)
    assert rate.max() == 4.2 and abs(acceleration).max() == 1.0
    assert (alpha == 35.0).all() and (beta == 0.0).all()


# --- docs/results.md --------------------------------------------------------------------------------


def differences(folder) -> list[str]:
    return pages.problems(pages.read([folder], pages.data(), times=False))


def test_pages_agree_with_the_study_of_chai_2022(report):
    assert differences(report[1]) == []


def test_pages_agree_with_the_study_of_wu_2015(wu):
    assert differences(wu[0]) == []


@pytest.mark.parametrize("study", ["tvsmc-2015-biases", "two-loop-smc"])
def test_pages_agree_with_the_study(study, tmp_path):
    """The study of the biases takes more than 20 s, as it flies all their corners, whose numbers are on a page."""
    reproduced(study, tmp_path)
    assert differences(tmp_path / "out") == []
