"""Every FMU in every available importer, alone and in the closed loop, against our own stepping
with the importer's own coupling.

The tests marked `importer` make the table of docs/use-it.md (conftest.py). Each of them gives
two arrays to `agree`, the importer's and ours.
"""

import os
import shutil
import subprocess
import sys


import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.ssp.simulation import simulate_ssp
from fmpy.validation import validate_fmu

from conftest import NAMES, ROOT, TARGET, archive, call, example, results
from fmi import ANGLES, MOMENT, NOT_REPRODUCIBLE, RATES, Fmu, Instance, Loop, of_step

STEP = 0.04
STEPS = 250
STOP = STEPS * STEP
CONTROLLERS = [name for name in NAMES if name not in ("ReentryPlant", "ControlAllocator", "AttitudeEstimator", "EntryGuidance", "EntryNavigation")]
LINUX = sys.platform == "linux" and os.uname().machine == "x86_64"
only_linux = pytest.mark.skipif(not LINUX, reason="what this needs has no binaries for every platform: tried on Linux on x86-64")

each_fmu = pytest.mark.parametrize("name", NAMES)
each_controller = pytest.mark.parametrize("name", CONTROLLERS)


# Our own stepping. The clocks give time and length of step k as importers compute them; they differ
# in the last bit.


def exact(tick):
    return tick * STEP, STEP


def differences(tick):
    return tick * STEP, (tick + 1) * STEP - tick * STEP


def nanoseconds(tick):
    """Clock in whole nanoseconds, converted to seconds."""
    now, then = (round(STEP * 1e9) * count / 1e9 for count in (tick, tick + 1))
    return now, then - now


def reals(fmu) -> list[str]:
    """Names of the outputs that are Real and no wall-clock time."""
    names = fmu.names("output")
    return [name for name in names if fmu.variables[name].type == "Real" and name not in NOT_REPRODUCIBLE]


@pytest.fixture(scope="module")
def by_hand(fmu):
    """Outputs of an instance with its start values at each communication point."""
    done = {}

    def run(name, clock=exact):
        if (name, clock) not in done:
            with Instance(fmu(name)).start() as instance:
                rows = [instance.get(reals(fmu(name)))]
                for tick in range(STEPS):
                    instance.step(*clock(tick))
                    rows.append(instance.get(reals(fmu(name))))
            done[name, clock] = np.array(rows)
            assert (np.ptp(done[name, clock], axis=0) > 0.0).any()
        return done[name, clock]

    return run


@pytest.fixture(scope="module")
def loop(fmu):
    """State and moment of the closed loop at each communication point, as read there or, with
    `shifted`, as the orchestrator's results have them."""
    done = {}

    def run(name, jacobi, clock=exact, parameters=True, shifted=False):
        key = (name, jacobi, clock, parameters)
        if key not in done:
            with Instance(fmu(name)) as controller, Instance(fmu("ReentryPlant"), PARAMETERS if parameters else None) as plant:
                done[key] = Loop(controller, plant, STEP, jacobi, clock).fly(STEPS)
            # The loop must move: by degrees, and with a moment that changes.
            assert np.ptp(np.array(done[key])[:, 0]) > 0.01 and np.ptp(np.array(done[key])[:, 6]) > 1e3
        return np.array(of_step(done[key]) if shifted else done[key])

    return run


# These values differ from the start values, so that a lost parameter shows.
PARAMETERS = {"inertia.scale": 0.97, "disturbance.seed": 3}
EXPERIMENT = """
title = "{0} on the scenario of its defaults, but for two parameters"
[simulation]
stop = {1}
step = {2}
order = ["controller", "plant"]
[components.plant]
fmu = "ReentryPlant.fmu"
unconnected = ["disturbanceMoment.*", "surface*", "jet*", "trajectory.*", "prescribed*", "trim.alpha"]
[components.plant.parameters]
"inertia.scale" = 0.97
"disturbance.seed" = 3
[components.controller]
fmu = "{0}.fmu"
unconnected = ["achievedMoment.*", "knownMoment.*", "reference.*", "trajectory.*"]
[[connections]]
from = "plant.attitude.*"
to = "controller.attitude.*"
[[connections]]
from = "plant.rate.*"
to = "controller.rate.*"
[[connections]]
from = "controller.moment.*"
to = "plant.moment.*"
[record]
variables = ["plant.attitude.*", "plant.rate.*", "controller.moment.*"]
"""
WIRES = [("plant", "controller", name) for name in ANGLES + RATES] + [("controller", "plant", name) for name in MOMENT]
SIGNALS = [(source, name) for source, _, name in WIRES]


def orchestrate(folder, text, *arguments, fmus="fmu"):
    """Runs the orchestrator with the FMUs of a folder in `target`, and returns the columns of the
    results by component and variable name."""
    (folder / "experiment.toml").write_text(text)
    call("run", "experiment.toml", "--out", "out", "--fmu-dir", TARGET / fmus, "--force", "--quiet", *arguments, cwd=folder)
    return results(folder / "out")


@pytest.fixture(scope="session")
def cosim():
    if sys.version_info < (3, 11):
        pytest.skip("libcosimpy is for Python 3.11 and later")
    import cosim

    return cosim


@pytest.fixture
def packed(tmp_path):
    """Packs the closed loop as an SSP archive."""

    def pack(name):
        (tmp_path / "experiment.toml").write_text(EXPERIMENT.format(name, STOP, STEP))
        call("pack", "experiment.toml", "--out", "loop.ssp", "--fmu-dir", TARGET / "fmu", cwd=tmp_path)
        return tmp_path / "loop.ssp"

    return pack


# Each FMU alone


@each_fmu
@pytest.mark.importer("FMPy", "co-simulation", within=0.0)
def test_oracle_fmpy_steps_an_fmu(fmu, by_hand, agree, name):
    found = simulate_fmu(str(archive(name)), stop_time=STOP, step_size=STEP, output_interval=STEP, output=reals(fmu(name)))
    agree(np.array([found[column] for column in reals(fmu(name))]).T, by_hand(name, differences))


def alone(name) -> str:
    """An experiment of one FMU."""
    text = f'title = "alone"\n[simulation]\nstop = {STOP}\nstep = {STEP}\n[components.instance]\nfmu = "{name}.fmu"\nunconnected = ["*"]\n'
    return text + '[record]\nvariables = ["instance.*"]\n'


@each_fmu
@pytest.mark.importer("orchestrator", "co-simulation", within=0.0)
def test_oracle_the_orchestrator_steps_an_fmu(fmu, by_hand, agree, tmp_path, name):
    found = orchestrate(tmp_path, alone(name))
    agree(np.array([found[f"instance.{column}"] for column in reals(fmu(name))]).T, by_hand(name))


@each_fmu
@pytest.mark.importer("orchestrator", "FMI 3.0, co-simulation with event mode", within=0.0)
def test_oracle_the_orchestrator_steps_an_fmu_of_fmi_3(fmu, by_hand, agree, tmp_path, name):
    found = orchestrate(tmp_path, alone(name), fmus="fmi3")
    agree(np.array([found[f"instance.{column}"] for column in reals(fmu(name))]).T, by_hand(name))


@each_fmu
@only_linux
@pytest.mark.importer("libcosimpy", "co-simulation", within=0.0)
def test_oracle_libcosim_steps_an_fmu(cosim, fmu, by_hand, agree, name):
    agree(cosim.alone(archive(name), STEP, STEPS, reals(fmu(name))), by_hand(name, nanoseconds)[1:])


@each_fmu
@pytest.mark.importer("fmi-rs", "co-simulation", within=0.0)
def test_oracle_fmi_rs_steps_an_fmu(fmu, by_hand, agree, tmp_path, name):
    found = fmi_rs(tmp_path, "cs", archive(name))
    agree(np.array([found[column] for column in reals(fmu(name))]).T, by_hand(name, differences))


@each_fmu
@pytest.mark.tier("importers")
@pytest.mark.importer("fmi-sim", "co-simulation", within=0.0)
def test_oracle_fmi_sim_steps_an_fmu(fmu, by_hand, agree, tmp_path, name):
    found = fmi_sim(tmp_path, "co-simulation", archive(name))
    agree(np.array([found[column] for column in reals(fmu(name))]).T, by_hand(name))


@each_fmu
@pytest.mark.importer("fmu-manipulation-toolbox", "`fmutool -check`")
def test_oracle_fmutool_finds_no_problem(tool, name):
    done = subprocess.run([tool("fmutool"), "-input", archive(name), "-check"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "seems to be compliant" in done.stdout + done.stderr


def fmi_rs(folder, *arguments):
    command = [example("fmi_rs"), *arguments, str(STEP), str(STOP), folder / "out.csv"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    return results(folder, "out.csv")


def fmi_sim(folder, *arguments):
    name = TARGET / "tools" / "bin" / ("fmi-sim" + (".exe" if os.name == "nt" else ""))
    assert name.is_file(), f"{name} does not exist: run scripts/install-tools"
    *interface, path = arguments
    command = [name, "--model", path, "-o", folder / "out.csv", *interface, "-s", "0", "-f", str(STOP)]
    command += ["--step", str(STEP), "--output-interval", str(STEP)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    return results(folder, "out.csv")


# The plant as model exchange; test_exchange.py has the comparison under CVode.


@pytest.fixture(scope="module")
def euler(fmu):
    """States by FMPy's Euler method, which test_exchange.py shows to converge to our
    co-simulation."""
    settings = dict(fmi_type="ModelExchange", solver="Euler", step_size=STEP, output_interval=STEP, stop_time=STOP)
    found = simulate_fmu(str(archive("ReentryPlant")), output=ANGLES + RATES, **settings)
    return np.array([found[name] for name in ANGLES + RATES]).T


# fmi-rs accumulates time and step in another order than FMPy, so the last bits differ.
@pytest.mark.importer("fmi-rs", "model exchange, Euler", fmu="ReentryPlant", within=1e-12, to="FMPy's Euler")
def test_oracle_fmi_rs_integrates_the_plant(euler, agree, tmp_path):
    found = fmi_rs(tmp_path, "me", archive("ReentryPlant"))
    agree(np.array([found[name] for name in ANGLES + RATES]).T, euler)


@pytest.mark.tier("importers")
@pytest.mark.importer("fmi-sim", "model exchange, Euler", fmu="ReentryPlant", within=0.0, to="FMPy's Euler")
def test_oracle_fmi_sim_integrates_the_plant(euler, agree, tmp_path):
    found = fmi_sim(tmp_path, "model-exchange", archive("ReentryPlant"))
    agree(np.array([found[name] for name in ANGLES + RATES]).T, euler)


# The closed loop


@each_controller
@pytest.mark.importer("orchestrator", "closed loop, sequential", plant=True, within=0.0)
def test_oracle_the_orchestrator_closes_the_loop(loop, agree, tmp_path, name):
    found = orchestrate(tmp_path, EXPERIMENT.format(name, STOP, STEP))
    agree(np.array([found[f"{component}.{signal}"] for component, signal in SIGNALS]).T, loop(name, jacobi=False, shifted=True))


@each_controller
@pytest.mark.importer("orchestrator", "FMI 3.0, closed loop, sequential", plant=True, within=0.0)
def test_oracle_the_orchestrator_closes_the_loop_of_fmi_3(loop, agree, tmp_path, name):
    found = orchestrate(tmp_path, EXPERIMENT.format(name, STOP, STEP), fmus="fmi3")
    agree(np.array([found[f"{component}.{signal}"] for component, signal in SIGNALS]).T, loop(name, jacobi=False, shifted=True))


@each_controller
@pytest.mark.importer("orchestrator", "closed loop, Jacobi", plant=True, within=0.0)
def test_oracle_the_orchestrator_closes_the_loop_with_a_delay(loop, agree, tmp_path, name):
    text = EXPERIMENT.format(name, STOP, STEP).replace("order =", 'coupling = "jacobi"\norder =')
    found = orchestrate(tmp_path, text)
    agree(np.array([found[f"{component}.{signal}"] for component, signal in SIGNALS]).T, loop(name, jacobi=True, shifted=True))


@each_controller
@pytest.mark.importer("fmi-rs", "closed loop, sequential by hand", plant=True, within=0.0)
def test_oracle_fmi_rs_closes_the_loop(loop, agree, tmp_path, name):
    found = fmi_rs(tmp_path, "loop", archive(name), archive("ReentryPlant"))
    agree(np.array([found[signal] for _, signal in SIGNALS]).T, loop(name, jacobi=False, parameters=False, shifted=True))


@each_controller
@pytest.mark.importer("FMPy", "closed loop, SSP archive", plant=True, within=0.0, to="stepping its way by hand")
def test_oracle_fmpy_closes_the_loop_of_an_archive(fmu, agree, packed, name):
    """FMPy sets zeros at the first step, steps all instances, and passes values on afterwards. Each
    row has the time at which its step starts. FMPy ignores the archive's values."""
    found = simulate_ssp(str(packed(name)), stop_time=STOP, step_size=STEP)
    expected = []
    with Instance(fmu(name)).start() as controller, Instance(fmu("ReentryPlant")).start() as plant:
        state, moment, time = [0.0] * 6, [0.0] * 3, 0.0
        for _ in range(len(found)):
            controller.set(dict(zip(ANGLES + RATES, state)))
            controller.step(time, STEP)
            plant.set(dict(zip(MOMENT, moment)))
            plant.step(time, STEP)
            state, moment = plant.get(ANGLES + RATES), controller.get(MOMENT)
            expected.append([time, *state, *moment])
            time += STEP
    assert len(found) >= STEPS
    columns = ["time", *(f"{component}.{signal}" for component, signal in SIGNALS)]
    agree(np.array([found[column] for column in columns]).T, np.array(expected))


@each_controller
@only_linux
@pytest.mark.importer("libcosimpy", "closed loop, SSP archive", plant=True, within=0.0, to="Jacobi by hand")
def test_oracle_libcosim_closes_the_loop_of_an_archive(cosim, loop, agree, packed, tmp_path, name):
    shutil.unpack_archive(packed(name), tmp_path / "archive", "zip")
    agree(cosim.archive(tmp_path / "archive", STEP, STEPS, SIGNALS), loop(name, jacobi=True, clock=nanoseconds)[1:])


@each_controller
@only_linux
@pytest.mark.importer("libcosimpy", "closed loop, OSP system structure", plant=True, within=0.0, to="Jacobi by hand")
def test_oracle_libcosim_closes_the_loop_of_a_system_structure(cosim, loop, agree, tmp_path, name):
    components = {"controller": (archive(name), {}), "plant": (archive("ReentryPlant"), PARAMETERS)}
    cosim.write_structure(tmp_path, STEP, components, WIRES)
    agree(cosim.structure(tmp_path, STEPS, SIGNALS), loop(name, jacobi=True, clock=nanoseconds)[1:])


@each_controller
@only_linux
@pytest.mark.importer("fmu-manipulation-toolbox", "closed loop, container FMU in FMPy", plant=True, within=0.0, to="Jacobi by hand")
def test_oracle_a_container_holds_the_closed_loop(loop, agree, packed, tool, tmp_path, name):
    """The comparison has no parameters, because the toolbox ignores the archive's values."""
    packed(name)
    command = [tool("fmucontainer"), "-fmu-directory", ".", "-container", f"loop.ssp:{STEP}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    container = tmp_path / "loop.fmu"
    assert validate_fmu(str(container)) == []
    prefix = {"plant": "reentryplant", "controller": name.lower()}
    signals = [f"{prefix[component]}.{signal}" for component, signal in SIGNALS]
    found = simulate_fmu(str(container), stop_time=STOP, step_size=STEP, output_interval=STEP, output=signals)
    agree(np.array([found[signal] for signal in signals]).T, loop(name, jacobi=True, parameters=False))


# A controller of another maker


TURNS = [f"attitudeRate.{axis}" for axis in ("alpha", "beta", "sigma")]
SECONDS = 20


@pytest.fixture(scope="module")
def foreign(tool, tmp_path_factory):
    """Builds scripts/examples/pd_controller.py as an FMU."""
    folder = tmp_path_factory.mktemp("pythonfmu")
    command = [tool("pythonfmu"), "build", "-f", ROOT / "scripts" / "examples" / "pd_controller.py", "-d", folder]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    return folder / "PdController.fmu"


@pytest.fixture(scope="module")
def expected(fmu):
    """States and moments of the controller as a Python object, with the plant stepped by hand."""
    from pd_controller import PdController

    controller = PdController(instance_name="controller")
    rows = []
    with Instance(fmu("ReentryPlant"), PARAMETERS).start() as plant:
        for tick in range(round(SECONDS / STEP) + 1):
            state = plant.get(ANGLES + TURNS)
            rows.append(state + [controller.outputs[name] for name in MOMENT])
            controller.inputs.update(zip(ANGLES + TURNS, state))
            controller.do_step(tick * STEP, STEP)
            plant.set({name: controller.outputs[name] for name in MOMENT})
            plant.step(tick * STEP, STEP)
    rows = np.array(rows)
    # The motion goes from 30 degrees of bank to the noise about zero.
    assert np.abs(rows[0, :3]).max() > 0.5 and np.abs(rows[-1, :3]).max() < 0.03
    return rows


@only_linux
@pytest.mark.importer("orchestrator", "closed loop, controller by PythonFMU", fmu="ReentryPlant", within=0.0)
def test_oracle_the_orchestrator_steps_a_controller_by_pythonfmu(foreign, expected, agree, libpython, tmp_path, monkeypatch):
    monkeypatch.setenv("LD_PRELOAD", libpython)
    shutil.copy(foreign, tmp_path)
    text = EXPERIMENT.format("PdController", SECONDS, STEP).replace('unconnected = ["achievedMoment.*", "knownMoment.*", "reference.*", "trajectory.*"]', "")
    found = orchestrate(tmp_path, text.replace("rate.*", "attitudeRate.*"), "--isolate=false")
    names = [f"plant.{name}" for name in ANGLES + TURNS] + [f"controller.{name}" for name in MOMENT]
    agree(np.array([found[name] for name in names]).T, expected)


@only_linux
@pytest.mark.importer("FMPy", "closed loop, controller by PythonFMU", fmu="ReentryPlant", within=0.0)
def test_oracle_fmpy_steps_a_controller_by_pythonfmu(fmu, foreign, expected, agree, tmp_path):
    rows = []
    with Instance(Fmu.open(foreign, tmp_path)).start() as controller, Instance(fmu("ReentryPlant"), PARAMETERS).start() as plant:
        for tick in range(len(expected)):
            state = plant.get(ANGLES + TURNS)
            rows.append(state + controller.get(MOMENT))
            controller.set(dict(zip(ANGLES + TURNS, state)))
            controller.step(tick * STEP, STEP)
            plant.set(dict(zip(MOMENT, controller.get(MOMENT))))
            plant.step(tick * STEP, STEP)
    agree(np.array(rows), expected)
