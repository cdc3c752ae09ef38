"""Laws in Python in every loop and by every function that flies one, against LQR.fmu."""

import shutil
import subprocess
import sys
import warnings
import zipfile
from pathlib import Path

import numpy as np
import pytest
from laws import lqr
from laws import pd as pd_law
from reentry_fmus import LawError, OrchestratorError, campaign, experiment, linearise, margins
from reentry_fmus._data import experiment_path, program
from test_campaign import CAMPAIGN

ANGLES = [f"plant.attitude.{axis}" for axis in ("alpha", "beta", "sigma")]
# The law in Python knows no turn of the trajectory, so that the FMU does not receive it either.
ENTRY = """
extends = '{base}'

connections = [
    {{ from = "plant.motion.*", to = "guidance.motion.*" }},
    {{ from = "plant.load.*", to = "guidance.load.*" }},
    {{ from = "guidance.reference.*", to = "controller.reference.external.*" }},
    {{ from = "guidance.referenceRate.*", to = "controller.reference.externalRate.*" }},
    {{ from = "guidance.referenceAcceleration.*", to = "controller.reference.externalAcceleration.*" }},
    {{ from = "guidance.reference.alpha", to = "plant.trim.alpha" }},
    {{ from = "plant.airMoment.*", to = "controller.knownMoment.*" }},
    {{ from = "plant.attitude.*", to = "controller.attitude.*" }},
    {{ from = "plant.rate.*", to = "controller.rate.*" }},
    {{ from = "controller.moment.*", to = "plant.moment.*" }},
]

[components.controller]
unconnected = ["achievedMoment.*", "trajectory.*"]

[components.controller.parameters]
"trajectory.earthRate" = 0.0
"""


def without_known_moment(state):
    """LQR as its FMU flies with `knownMoment.*`: the moment that it asks for less the known one."""
    known = [state.inputs[f"knownMoment.{axis}"] for axis in "xyz"]
    return lqr(state) - np.array(known)


@pytest.fixture
def entry(tmp_path):
    path = tmp_path / "entry.toml"
    path.write_text(ENTRY.format(base=experiment_path("from-120km")))
    return path


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("name", "changes", "stop", "within"),
    [
        ("lqr", {}, None, 1e-12),
        ("crmpc-robust", {}, None, 1e-12),
        # Several steps in a period of the law, and angles and rates that are estimated.
        ("estimator", {"controller.measurement.age": 0.0}, None, 1e-12),
        # Jets that are switched let roundings grow.
        ("two-loop-smc/allocated", {}, 2.0, 1e-7),
    ],
)
def test_oracle_a_law_flies_every_loop_as_its_fmu(name, changes, stop, within):
    changes |= {"controller.vehicle.file": "chai2022"}
    by_law = experiment(name, set=changes, stop=stop, law=lqr)
    by_fmu = experiment(name, set=changes, stop=stop, fmu={"controller": "LQR"})
    assert np.abs(by_law.table[ANGLES].to_numpy() - by_fmu.table[ANGLES].to_numpy()).max() < within
    assert by_law.table.shape == by_fmu.table.shape and len(by_law.table) > 100


@pytest.mark.filterwarnings("ignore")
def test_oracle_a_law_flies_an_entry_as_its_fmu(entry):
    by_law = experiment(entry, stop=400.0, law=without_known_moment)
    by_fmu = experiment(entry, stop=400.0, fmu={"controller": "LQR"})
    assert np.abs(by_law.table[ANGLES].to_numpy() - by_fmu.table[ANGLES].to_numpy()).max() < 1e-12
    assert np.ptp(by_law.table["guidance.command.bank"]) > 0.05


def test_a_law_sees_every_input_of_its_controller(entry):
    seen = []

    def law(state):
        seen.append((state.time, dict(state.inputs), state.attitude, state.reference))
        return lqr(state)

    run = experiment(entry, stop=40.0, law=law)
    assert len(seen) == 1000 and [time for time, *_ in seen[:2]] == [0.0, 0.04]
    for row, (_, inputs, attitude, reference) in zip(range(0, 40), seen[::25], strict=True):
        recorded = run.table.iloc[row]
        assert inputs["attitude.alpha"] == attitude[0] == recorded["plant.attitude.alpha"]
        assert inputs["reference.external.sigma"] == reference[2] == recorded["controller.reference.sigma"]
        assert inputs["rate.q"] == recorded["plant.rate.q"]
    assert seen[-1][1]["knownMoment.y"] != 0.0 and seen[0][1]["trajectory.headingRate"] == 0.0


def test_a_law_is_asked_once_in_its_period():
    times = []

    def law(state):
        times.append(state.time)
        return pd_law(state)

    for step, period, asked in [(0.04, 0.04, 50), (0.01, 0.04, 50), (0.01, 0.02, 100), (0.2, 0.04, 10)]:
        times.clear()
        experiment("lqr", set={"controller.period.feedback": period}, step=step, stop=2.0, law=law)
        assert len(times) == asked and np.allclose(np.diff(times), max(step, period))


# Linear models


class Filtered:
    """A law with a memory: the error is filtered before it acts."""

    def __init__(self):
        self.error = np.zeros(3)

    def __call__(self, state):
        self.error += 0.2 * (state.attitude - state.reference - self.error)
        a = -0.25 * self.error - 0.8 * state.attitude_rate
        return np.array([0.6e6 * -a[2], 1.3e6 * a[0], 1.5e6 * -a[1]])


def enclosed():
    law = Filtered()
    return lambda state: law(state)


def test_oracle_margins_of_a_law_are_those_of_its_fmu():
    at = {"at": 10.0, "open": "plant.moment.*", "set": {"plant.disturbance.kind": "none"}}
    mine, packaged = margins("lqr", law=lqr, **at), margins("lqr", **at)
    assert np.allclose(mine, packaged, rtol=1e-5, equal_nan=True) and mine.attrs["stable"]


@pytest.mark.parametrize("make", [Filtered, enclosed])
def test_oracle_the_memory_of_a_law_is_part_of_its_linear_model(make):
    """The model has the pole of the filter, and the law itself is as it was."""
    law = make()
    still = {"plant.disturbance.kind": "none", "controller.reference.profile": "constant"}
    loop = linearise("lqr", at=40.0, open="plant.moment.*", law=law, set=still)
    assert loop.a.shape == (9, 9)
    assert np.sum(np.isclose(np.linalg.eigvals(loop.a), 0.8, atol=1e-4)) == 3
    if make is Filtered:
        assert not law.error.any()


# Other functions


def test_a_search_flies_a_law(tmp_path):
    (tmp_path / "gusts.toml").write_text(CAMPAIGN)
    by_law = campaign(tmp_path / "gusts.toml", law=lqr).worst(out=tmp_path / "law", jobs=1)
    by_fmu = campaign(tmp_path / "gusts.toml").worst(out=tmp_path / "fmu", jobs=1)
    assert by_law.outcome["largest"] == pytest.approx(by_fmu.outcome["largest"], rel=1e-9)
    assert not by_law.table["rate"].equals(by_fmu.table["rate"])
    run = experiment(by_law.worst, law=lqr)
    rate = [run.table[f"plant.rate.{axis}"] for axis in "pqr"]
    largest = np.degrees(np.sqrt(np.square(rate).sum(axis=0))).max()
    assert largest == pytest.approx(by_law.outcome["largest"], rel=1e-9)


# Failure


def fails(state):
    if state.time > 0.5:
        raise ZeroDivisionError("so")
    return [0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    "fly",
    [
        lambda folder, law: experiment("lqr", law=law),
        lambda folder, law: experiment("estimator", law=law),
        lambda folder, law: margins("lqr", at=10.0, open="plant.moment.*", law=law),
        lambda folder, law: linearise("lqr", at=10.0, open="plant.moment.*", law=law),
        lambda folder, law: campaign(folder / "gusts.toml", law=law).worst(out=folder / "out"),
    ],
)
def test_an_error_of_a_law_is_one_wherever_it_flies(fly, tmp_path):
    (tmp_path / "gusts.toml").write_text(CAMPAIGN)
    with pytest.raises(LawError, match="the law fails failed at t = 0.52 s: ZeroDivisionError: so") as caught:
        fly(tmp_path, fails)
    assert caught.value.case is None and caught.value.time == pytest.approx(0.52) and 'raise ZeroDivisionError("so")' in str(caught.value)


def told(fly):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fly()
    assert all(Path(warning.filename) == Path(__file__) for warning in caught)
    return {str(warning.message) for warning in caught}


def test_a_law_is_warned_of_what_its_fmu_is_warned_of(tmp_path):
    """Only the parameters of the law that it replaces are none of its."""
    (tmp_path / "idle.toml").write_text(
        f"extends = ['{experiment_path('crmpc-robust')}']\n[isolation]\ncall_timeout = 2.0\n"
    )
    by_fmu = told(lambda: experiment(tmp_path / "idle.toml", stop=1.0, fmu={"controller": "LQR"}))
    by_law = told(lambda: experiment(tmp_path / "idle.toml", stop=1.0, law=pd_law))
    assert any("call_timeout has no effect" in text for text in by_law)
    assert {text for text in by_fmu if "does not have these parameters" not in text} == by_law


IDLE, ACTS = "controller.weight.P[1]", "controller.limit.rate"


@pytest.mark.parametrize(
    "fly",
    [
        lambda folder, name: experiment("lqr", set={name: 0.1}, stop=1.0, law=pd_law),
        lambda folder, name: margins("lqr", set={name: 0.1}, at=1.0, open="plant.moment.*", law=pd_law),
        lambda folder, name: campaign(changed(folder, f'[set]\n"{name}" = 0.1\n'), law=pd_law).run(),
        lambda folder, name: campaign(
            changed(folder, f'[[vary]]\nparameter = "{name}"\nuniform = [0.1, 0.2]\n'), law=pd_law
        ).run(),
    ],
)
def test_a_setting_that_does_nothing_to_a_law_says_so(fly, tmp_path):
    expected = f"{IDLE} has no effect on the law pd: of its controller, a law has reference, limits, inputs and period"
    assert told(lambda: fly(tmp_path, IDLE)) == {expected}
    assert told(lambda: fly(tmp_path, ACTS)) == set()


def changed(folder, text):
    file = folder / f"changed-{len(list(folder.iterdir()))}.toml"
    file.write_text(CAMPAIGN.replace("cases = 600", "cases = 4") + text)
    return file


@pytest.mark.skipif(shutil.which("cc") is None or sys.platform != "linux", reason="needs a C compiler and Linux")
def test_what_an_fmu_prints_is_no_message_for_a_law(tmp_path):
    library, model = tmp_path / "model.so", Path(__file__).parents[2] / "orchestrator/tests/model"
    flags = ["-shared", "-fPIC", "-w", "-DPLACE=STEP", "-DHOW=FLOOD"]
    subprocess.run(["cc", *flags, "-o", library, model / "model.c"], check=True)
    with zipfile.ZipFile(tmp_path / "Model.fmu", "w") as archive:
        archive.write(model / "modelDescription.xml", "modelDescription.xml")
        archive.write(library, "binaries/linux64/model.so")
    (tmp_path / "noisy.toml").write_text(
        f"extends = ['{experiment_path('lqr')}']\n[components.noise]\nfmu = 'Model.fmu'\nunconnected = ['input']\n"
    )
    noisy = experiment(tmp_path / "noisy.toml", stop=0.2, law=pd_law)
    quiet = experiment("lqr", stop=0.2, law=pd_law)
    assert np.array_equal(noisy["controller.moment.x"], quiet["controller.moment.x"])


def test_what_a_law_cannot_fly_is_refused(tmp_path):
    with pytest.raises(TypeError, match="leave out its FMU"):
        experiment("lqr", law=pd_law, fmu={"controller": "FBL"})
    with pytest.raises(TypeError, match="a law is a function from the state to the moment, not 3"):
        margins("lqr", at=10.0, open="plant.moment.*", law=3)
    law = Filtered()
    law.lock = (value for value in ())
    with pytest.raises(TypeError, match="the law Filtered cannot be copied"):
        margins("lqr", at=10.0, open="plant.moment.*", law=law)
    # A single run needs no copy.
    assert experiment("lqr", stop=1.0, law=law).metrics["samples"] == 26
    show = subprocess.run([program(), "show", experiment_path("lqr")], capture_output=True, text=True, check=True)
    (tmp_path / "other.toml").write_text(show.stdout.replace("controller", "autopilot"))
    with pytest.raises(OrchestratorError, match='there is no component "controller"; there are: autopilot'):
        experiment(tmp_path / "other.toml", law=pd_law)
