"""The FMUs as FMI 3.0: valid, complete, and with the results of FMI 2.0."""

import re
import subprocess
import zipfile
from ctypes import byref, c_double, c_int32, c_size_t, c_uint64

import fmpy
import numpy as np
import pytest
from fmpy import fmi3, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.validation import validate_fmu
from lxml import etree

from conftest import NAMES, archive, archive3
from fmi import ANGLES, MOMENT, NOT_REPRODUCIBLE, RATES, EventLoop, Instance, Instance3, Loop, of_step
from test_entry import FLIGHT, INPUTS, MOTION
from test_importers import fmi_rs, reals

STEP = 0.04
CONTROLLERS = ["CRMPC", "DLMPC", "LQR", "FBL", "BTVSMC", "BTVSMC_DO", "SOTVSMC_DO", "TwoLoopSMC"]
SCHEMAS = fmpy.model_description.Path(fmpy.__file__).parent / "schema" / "fmi3"


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("FMPy", "FMI 3.0, `fmpy validate`")
def test_fmpy_finds_no_problem(name):
    assert validate_fmu(str(archive3(name))) == []


@pytest.mark.parametrize("name", NAMES)
def test_the_archive_has_what_fmi_3_asks_for(name, fmu, fmu3):
    with zipfile.ZipFile(archive3(name)) as packed:
        files = set(packed.namelist())
        terminals = packed.read("terminalsAndIcons/terminalsAndIcons.xml")
    icons = {f"terminalsAndIcons/icon.{suffix}" for suffix in ("png", "svg")}
    assert icons | {"documentation/index.html", "documentation/licenses/license.txt", "resources/README.txt"} <= files
    tuples = {file.split("/")[1] for file in files if file.startswith("binaries/")}
    assert tuples and all(re.fullmatch(r"(x86|x86_64|aarch64)-(linux|windows|darwin)", each) for each in tuples)
    etree.XMLSchema(file=str(SCHEMAS / "fmi3TerminalsAndIcons.xsd")).assertValid(etree.fromstring(terminals))
    # The same names, units and texts as in FMI 2.0, between the time and the event indicators.
    two, three = fmu(name).description, fmu3(name).description
    of = [[(v.name, v.description, v.causality, v.unit, v.start) for v in d.modelVariables] for d in (two, three)]
    indicators = two.numberOfEventIndicators
    assert of[1][1 : len(of[0]) + 1] == of[0]
    assert [v.valueReference for v in three.modelVariables] == list(range(len(of[0]) + 1 + indicators))
    assert three.modelVariables[0].name == "time" and three.modelVariables[0].causality == "independent"
    assert [v.name for v in three.modelVariables[len(of[0]) + 1 :]] == [f"eventIndicator[{i}]" for i in range(1, indicators + 1)]
    assert len(three.eventIndicators) == indicators
    states = {v.derivative.name for v in three.modelVariables if v.derivative is not None}
    # FMPy does not read that events may set them.
    root = etree.parse(str(fmu3(name).folder / "modelDescription.xml"))
    assert {v.get("name") for v in root.iter("Float64") if v.get("reinit") == "true"} == states
    assert three.coSimulation.hasEventMode and three.coSimulation.canSerializeFMUstate


def terminals(name):
    with zipfile.ZipFile(archive3(name)) as packed:
        root = etree.fromstring(packed.read("terminalsAndIcons/terminalsAndIcons.xml"))
    return {t.get("name"): [m.get("memberName") for m in t] for t in root.iter("Terminal")}


@pytest.mark.parametrize("name", CONTROLLERS)
def test_terminals_of_plant_and_controllers_match(name):
    plant, controller = terminals("ReentryPlant"), terminals(name)
    for terminal in ("attitude", "rate", "moment"):
        assert plant[terminal] == controller[terminal], terminal
    assert controller["reference"][:3] == ["alpha", "beta", "sigma"]


@pytest.mark.parametrize("name", NAMES)
def test_every_function_is_exported(fmu3, name):
    functions = {each for each in vars(fmi3._FMU3) if each.startswith("fmi3")}
    assert len(functions) == 75
    library = fmi3.FMU3Slave(instanceName="loaded", **fmu3(name).arguments()).dll
    assert [each for each in sorted(functions) if not hasattr(library, each)] == []


def outputs_of(fmu, name):
    return [output for output in fmu(name).names("output") if output not in NOT_REPRODUCIBLE]


def bits(rows, names):
    # FMPy orders the columns by types, which have other names in the two versions.
    return np.array([rows[name] for name in names], float)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("FMPy", "FMI 3.0, co-simulation", within=0.0, to="FMI 2.0 in FMPy")
def test_fmpy_gets_the_same_bits_as_of_fmi_2(fmu, name):
    names = outputs_of(fmu, name)
    options = dict(output=names, stop_time=10.0, output_interval=STEP)
    two, three = (bits(simulate_fmu(str(path), **options), names) for path in (archive(name), archive3(name)))
    assert three.shape == (len(names), 251)
    assert (two == three).all()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("FMPy", "FMI 3.0, co-simulation with event mode", within=0.0, to="FMI 2.0 in FMPy")
def test_fmpy_handles_events(fmu, name):
    """With event mode, FMPy's outputs at an instant are those before and after the event. Before it
    they are those of FMI 2.0."""
    names = outputs_of(fmu, name)
    options = dict(output=names, stop_time=2.0, output_interval=STEP)
    two = simulate_fmu(str(archive(name)), **options)
    three = simulate_fmu(str(archive3(name)), use_event_mode=True, early_return_allowed=True, **options)
    times, first = np.unique(three["time"], return_index=True)
    regular = [np.abs(times - time).argmin() for time in two["time"]]
    assert np.abs(times[regular] - two["time"]).max() < 1e-9
    found, expected = bits(three[first][regular], names), bits(two, names)
    assert (found[:, 1:] == expected[:, 1:]).all()


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.importer("FMPy", "FMI 3.0, closed loop by hand, with and without event mode", plant=True, within=0.0, to="FMI 2.0, sequential by hand")
def test_loops_of_both_versions_are_equal(fmu, fmu3, name):
    settings = {"disturbance.kind": "white", "disturbance.seed": 5}
    with Instance3(fmu3(name), events=True) as controller:
        step = controller.start().handle()
    with Instance(fmu(name)) as controller, Instance(fmu("ReentryPlant"), settings) as plant:
        two = Loop(controller, plant, step).fly(150)
    with Instance3(fmu3(name)) as controller, Instance3(fmu3("ReentryPlant"), settings) as plant:
        assert Loop(controller, plant, step).fly(150) == two
    with Instance3(fmu3(name), events=True) as controller, Instance3(fmu3("ReentryPlant"), settings, events=True) as plant:
        events = EventLoop(controller, plant, step).fly(150)
    # The moment of an instant acts over the step that begins there.
    assert events[:-1] == of_step(two)[:-1]
    assert events[-1][:6] == two[-1][:6]


def test_a_long_step_ends_at_each_tick(fmu3):
    with Instance3(fmu3("LQR"), events=True) as controller:
        controller.start()
        assert controller.handle() == STEP
        controller.slave.enterStepMode()
        time, reached = 0.0, []
        while time < 0.1:
            event, ended, early, time = controller.step(time, 0.1 - time)
            reached.append((event, ended, early, time))
            if event:
                controller.slave.enterEventMode()
                controller.handle()
                controller.slave.enterStepMode()
        assert reached == [(True, False, True, 0.04), (True, False, True, 0.08), (False, False, False, 0.1)]


def test_without_event_mode_no_step_ends_early(fmu3):
    with Instance3(fmu3("LQR")) as controller:
        controller.start()
        assert controller.step(0.0, 0.1) == (False, False, False, 0.1)
        with pytest.raises(FMICallException):
            controller.slave.enterEventMode()
        assert "fmi3EnterEventMode: not available, because this instance was made without event mode" in controller.messages()


def exchanged(path, settings, **options):
    return simulate_fmu(
        str(path), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-10, start_values=settings, **options
    )


@pytest.mark.importer("FMPy", "FMI 3.0, model exchange, CVode", fmu="ReentryPlant", within=0.0, to="FMI 2.0 in FMPy")
@pytest.mark.parametrize("kind", ["none", "square", "sine"])
def test_model_exchange_agrees_with_fmi_2(fmu, fmu3, kind):
    results = []
    for plant in (fmu("ReentryPlant"), fmu3("ReentryPlant")):
        settings = plant.values({"disturbance.kind": kind, "initial.p": 0.02})
        results.append(exchanged(plant.path, settings, stop_time=10.0, output_interval=STEP, output=ANGLES + RATES, record_events=False))
    two, three = (np.array([result[name] for name in ANGLES + RATES]) for result in results)
    assert two.shape == three.shape and np.ptp(two, axis=1).max() > 0.1
    assert (two == three).all()


def test_an_entry_ends_at_the_same_instant(fmu, fmu3):
    step, ends = 0.5, []
    with Instance(fmu("ReentryPlant"), FLIGHT).start(inputs=INPUTS) as plant:
        with pytest.raises(FMICallException):
            for tick in range(8000):
                plant.step(tick * step, step)
        two = plant.get(MOTION)
    for events in (False, True):
        with Instance3(fmu3("ReentryPlant"), FLIGHT, events=events).start(inputs=INPUTS) as plant:
            if events:
                plant.slave.enterStepMode()
            ended, tick = False, 0
            while not ended:
                event, ended, early, time = plant.step(tick * step, step)
                tick += 1
            assert not event and early == events and (tick - 1) * step < time <= tick * step
            ends.append((time, plant.get(MOTION)))
            assert plant.get(["time"]) == [time]
            plant.slave.terminate()
    assert ends[0] == ends[1] and ends[0][1] == two
    settings = fmu3("ReentryPlant").values(FLIGHT) | INPUTS
    rows = exchanged(archive3("ReentryPlant"), settings, stop_time=4000.0, output_interval=10.0, output=MOTION)
    assert abs(rows["time"][-1] - ends[0][0]) < 1e-6 * ends[0][0]


@pytest.mark.parametrize("name", NAMES)
def test_a_saved_state_continues_the_same_run(fmu3, name):
    unit = fmu3(name)

    def on(instance, first, last):
        rows = []
        for tick in range(first, last):
            instance.step(tick * STEP, STEP)
            rows.append(instance.outputs())
        return rows

    with Instance3(unit) as instance:
        on(instance.start(), 0, 13)
        saved = instance.save()
        expected = on(instance, 13, 30)
        instance.restore(saved)
        assert on(instance, 13, 30) == expected
    with Instance3(unit) as other:
        other.restore(saved)
        assert on(other, 13, 30) == expected


def test_a_state_of_event_mode_needs_event_mode(fmu3):
    with Instance3(fmu3("LQR"), events=True) as instance:
        saved = instance.start().save()
        instance.restore(saved)
        assert instance.handle() == STEP
    with Instance3(fmu3("LQR")) as instance:
        with pytest.raises(FMICallException):
            instance.restore(saved)
        assert "an instance cannot go on in state event mode" in instance.messages()


def test_directional_and_adjoint_derivatives_are_columns_and_rows(fmu, fmu3):
    """Of the same matrix as in FMI 2.0."""
    two, three = fmu("ReentryPlant"), fmu3("ReentryPlant")
    rows = [f"attitudeRate.{axis}" for axis in ("alpha", "beta", "sigma")] + [f"angularAcceleration.{axis}" for axis in "pqr"]
    columns = ANGLES + RATES + MOMENT
    with Instance(two).start() as old, Instance3(three).start() as new:
        of = [[[unit.variables[name].valueReference for name in names] for names in (rows, columns)] for unit in (two, three)]
        unit = np.eye(len(columns))
        expected = np.array([old.slave.getDirectionalDerivative(*of[0], list(seed)) for seed in unit]).T
        columns_found = np.array([new.slave.getDirectionalDerivative(*of[1], list(seed)) for seed in unit]).T
        weights = np.eye(len(rows))
        rows_found = np.array([new.slave.getAdjointDerivative(*of[1], list(seed), nSensitivity=len(columns)) for seed in weights])
    assert np.abs(expected).max() > 0.1
    assert (columns_found == expected).all() and (rows_found == expected).all()


def test_what_no_fmu_has_is_refused_with_the_reason(fmu3):
    with Instance3(fmu3("LQR")) as instance:
        slave, reference = instance.slave, (fmi3.fmi3ValueReference * 1)(1)
        for call, text in (
            (lambda: slave.getFloat32([1]), "fmi3GetFloat32: this FMU has no such variables"),
            (lambda: slave.getClock([1]), "fmi3GetClock: this FMU has no such variables"),
            (lambda: slave.getIntervalDecimal(reference, (c_double * 1)(), (c_int32 * 1)()), "fmi3GetIntervalDecimal: .* no such"),
            (lambda: slave.getShiftFraction(reference, (c_uint64 * 1)(), (c_uint64 * 1)()), "fmi3GetShiftFraction: .* no such"),
            (lambda: slave.enterConfigurationMode(), "no structural parameters"),
            (lambda: slave.fmi3GetNumberOfVariableDependencies(slave.component, 1, byref(c_size_t())), "in the model description"),
            (lambda: slave.fmi3EvaluateDiscreteStates(slave.component), "no discrete states to be evaluated alone"),
        ):
            with pytest.raises(FMICallException):
                call()
            assert re.search(text, instance.log[-1][2]), instance.log[-1]
        assert slave.getFloat32([]) == []
        # None of these has changed the state of the instance.
        instance.start()
        for call, text in (
            (lambda: slave.setFloat64([0], [1.0]), "value reference 0 is the time or an event indicator"),
            (lambda: slave.getFloat64([99_999]), "value reference 99999 does not exist"),
        ):
            saved = instance.save()
            with pytest.raises(FMICallException):
                call()
            assert text in instance.log[-1][2]
            instance.restore(saved)
        with pytest.raises(FMICallException):
            slave.setInt64([fmu3("LQR").variables["reference.profile"].valueReference], [2**40])
        assert "fmi3SetInt64: 'reference.profile'" in instance.log[-1][2]


# Other importers


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("fmi-rs", "FMI 3.0, co-simulation", within=0.0, to="FMI 2.0 in fmi-rs")
def test_fmi_rs_gets_the_same_bits_as_of_fmi_2(fmu, tmp_path, name):
    two, three = fmi_rs(tmp_path, "cs", archive(name)), fmi_rs(tmp_path, "cs3", archive3(name))
    for column in ["time", *reals(fmu(name))]:
        assert (two[column] == three[column]).all(), column


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("fmi-rs", "FMI 3.0, co-simulation with event mode", within=0.0, to="FMI 2.0 in fmi-rs")
def test_fmi_rs_handles_events(fmu, tmp_path, name):
    """The first row of an instant is the one before its event."""
    two, three = fmi_rs(tmp_path, "cs", archive(name)), fmi_rs(tmp_path, "events3", archive3(name))
    times, first = np.unique(three["time"], return_index=True)
    regular = [first[np.abs(times - time).argmin()] for time in two["time"]]
    for column in reals(fmu(name)):
        assert two[column][1:].tolist() == three[column][regular][1:].tolist(), column


@pytest.mark.importer("fmi-rs", "FMI 3.0, model exchange, Euler", fmu="ReentryPlant", within=0.0, to="FMI 2.0 in fmi-rs")
def test_fmi_rs_integrates_the_plant(tmp_path):
    two, three = fmi_rs(tmp_path, "me", archive("ReentryPlant")), fmi_rs(tmp_path, "me3", archive3("ReentryPlant"))
    for column in ANGLES + RATES:
        assert (two[column] == three[column]).all(), column


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("fmu-manipulation-toolbox", "FMI 3.0, `fmutool -check`")
def test_fmutool_finds_no_problem(tool, name):
    done = subprocess.run([tool("fmutool"), "-input", archive3(name), "-check"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "seems to be compliant with FMI-3.0" in done.stdout + done.stderr
