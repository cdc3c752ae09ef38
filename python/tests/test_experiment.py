"""FMUs, experiments, and the command."""

import json
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import fmpy
import numpy as np
import pandas as pd
import pytest
from laws import lqr
from laws import pd as pd_law
import reentry_fmus
from reentry_fmus import (
    ClosedLoop,
    OrchestratorError,
    OrchestratorWarning,
    experiment,
    experiments,
    fmu,
    fmus,
)

# The command is among those of the environment, or beside the package if its wheel is unpacked.
FOLDERS = (Path(sysconfig.get_path("scripts")), Path(reentry_fmus.__file__).parents[1] / "bin")
COMMAND = next(path for path in (Path(folder, "orchestrator" + (".exe" if os.name == "nt" else "")) for folder in FOLDERS) if path.is_file())
ALPHA = "plant.attitude.alpha"


def test_every_fmu_is_there_and_simulates():
    names = "AttitudeEstimator BTVSMC BTVSMC_DO ControlAllocator CRMPC DLMPC EntryGuidance EntryNavigation FBL LQR ReentryPlant"
    assert fmus() == [*names.split(), "SOTVSMC_DO", "TwoLoopSMC"]
    for name in fmus():
        assert fmpy.read_model_description(str(fmu(name))).modelName == name
        result = fmpy.simulate_fmu(str(fmu(name)), stop_time=0.2, output_interval=0.04)
        assert len(result) == 6


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("CRPMC", 'there is no FMU "CRPMC"; did you mean "CRMPC"?'),
        ("plant", 'there is no FMU "plant"; did you mean "ReentryPlant"?'),
        ("xyz", 'there is no FMU "xyz"; there are: AttitudeEstimator, BTVSMC'),
        ("", 'there is no FMU ""; there are: AttitudeEstimator, BTVSMC'),
        ("../fmu/CRMPC", 'there is no FMU "../fmu/CRMPC"; there are: AttitudeEstimator, BTVSMC'),
    ],
)
def test_unknown_fmus_are_refused_with_the_nearest_name(name, message):
    with pytest.raises(ValueError) as caught:
        fmu(name)
    assert str(caught.value).startswith(message)


def test_a_run_is_a_table_with_figures_of_merit():
    run = experiment("crmpc-robust")
    assert run.table.shape[0] == 1251 and run.table.index.name == "time"
    assert run.table.index[-1] == 50.0
    assert run.metrics["completed"] and run.metrics["fallbacks"] == 0
    assert run.metrics["max_rate_deg_s"] < run.metrics["rate_limit_deg_s"] == 5.0
    assert run.figure.startswith("<svg") and run.figure._repr_svg_() == run.figure
    assert run.description["seeds"]["plant.disturbance.seed"] == 1
    assert set(run.table.attrs["units"]) == set(run.table.columns)
    assert run.table.attrs["units"][ALPHA] == "rad"
    assert run.table.attrs["descriptions"][ALPHA] == "Angle of attack relative to the ground velocity"


def test_a_run_is_shown_in_a_few_lines():
    run = experiment("crmpc-robust")
    lines = repr(run).splitlines()
    assert lines[0] == f"Run: {experiments()['crmpc-robust']}"
    assert lines[1] == "  0 to 50 s, 1251 rows, 33 columns"
    assert 3 <= len(lines) <= 9 and max(map(len, lines)) <= 80
    assert "ems_deg 1.974" in repr(run) and "guarantee_broken no" in repr(run)
    # Computing times would differ from run to run.
    assert "ms" not in repr(run).replace("ems", "").replace("cms", "") and "wall" not in repr(run)
    shown = run._repr_html_()
    assert "<th>ems_deg</th><td>1.974</td>" in shown and "data:image/svg+xml;base64," in shown
    assert run[ALPHA].equals(run.table[ALPHA])


def test_a_law_replaces_the_controller_of_an_experiment():
    by_fmu, by_law = experiment("lqr", units="deg"), experiment("lqr", law=lqr, units="deg")
    assert list(by_law.table) == list(by_fmu.table)
    assert by_law.table.attrs == by_fmu.table.attrs
    assert np.allclose(by_law.table, by_fmu.table, rtol=1e-9, atol=1e-9)
    assert by_law.metrics["ems_deg"] == pytest.approx(by_fmu.metrics["ems_deg"], rel=1e-9)
    quiet = {"plant.disturbance.kind": "none", "controller.limit.rate": 0.1}
    run = experiment("crmpc-robust", set=quiet, stop=4.0, law=pd_law)
    with ClosedLoop(parameters={**quiet, "plant.inertia.scale": 1.05}) as loop:
        usual = loop.run(4.0, pd_law)
    assert run.title == f"law pd in place of CRMPC: {experiments()['crmpc-robust']}"
    assert by_law.title == f"law lqr in place of LQR: {by_fmu.title}"
    assert run.description["law"] == usual.description["law"] == "pd"
    shared = run.table.columns.intersection(usual.table.columns)
    assert len(shared) >= 12
    # The law computes from its inputs the values that the plant computes of its attitude.
    assert np.allclose(run.table[shared], usual.table[shared], rtol=1e-12, atol=1e-12)
    assert run.metrics["rate_limit_deg_s"] == pytest.approx(np.degrees(0.1))


def test_a_run_becomes_arrays():
    xarray = pytest.importorskip("xarray")
    run = experiment("crmpc-robust", stop=2.0, units="deg")
    data = run.to_xarray()
    assert isinstance(data, xarray.Dataset) and dict(data.sizes) == {"time": 51}
    assert data["time"].attrs == {"units": "s"}
    assert data[ALPHA].attrs == {"units": "deg", "long_name": "Angle of attack relative to the ground velocity"}
    assert np.array_equal(data[ALPHA], run.table[ALPHA])
    assert set(data.data_vars) == set(run.table.columns)
    status = data["controller.solver.status"]
    assert status.dtype.kind == "U" and status.values.tolist() == run["controller.solver.status"].tolist()
    assert data["controller.solver.iterations"].dtype == np.int64
    assert data.attrs["title"] == run.title and data.attrs["ems_deg"] == run.metrics["ems_deg"]
    # Types that a netCDF file can hold.
    assert all(isinstance(value, (int, float, str)) for value in data.attrs.values())
    assert float(data[ALPHA].sel(time=1.0)) == run.table[ALPHA][1.0]


def test_a_run_becomes_a_file_of_matlab(tmp_path):
    io = pytest.importorskip("scipy.io")
    run = experiment("crmpc-robust", stop=2.0, units="deg")
    run.to_mat(tmp_path / "run.mat")
    read = io.loadmat(tmp_path / "run.mat", simplify_cells=True)
    assert np.array_equal(read["time"], run.table.index)
    assert np.array_equal(read["plant_attitude_alpha"], run.table[ALPHA])
    assert list(read["controller_solver_status"]) == run["controller.solver.status"].tolist()
    assert read["units"]["plant_attitude_alpha"] == "deg" and read["names"]["plant_attitude_alpha"] == ALPHA
    assert read["metrics"]["ems_deg"] == run.metrics["ems_deg"]
    assert {name for name in read if not name.startswith("__")} == {*read["names"], "units", "names", "metrics"}
    table = run.table.rename(columns={ALPHA: "x" * 64})
    run.table = table
    with pytest.raises(ValueError, match="is no name for MATLAB"):
        run.to_mat(tmp_path / "other.mat")


def test_enumerations_are_categoricals_of_their_items():
    table = experiment("crmpc-robust", stop=2.0).table
    status = table["controller.solver.status"]
    assert isinstance(status.dtype, pd.CategoricalDtype)
    assert "fallback" in status.cat.categories and set(status) <= {"unconstrained", "constrained"}
    assert status.index.equals(table.index)
    assert table["controller.solver.iterations"].dtype == np.int64


def test_degrees_are_for_reading():
    si, deg = experiment("lqr", stop=1.0).table, experiment("lqr", stop=1.0, units="deg").table
    assert np.allclose(deg[ALPHA], np.degrees(si[ALPHA]), rtol=1e-15)
    assert deg["controller.moment.x"].equals(si["controller.moment.x"])
    names = {unit for unit in deg.attrs["units"].values() if unit}
    assert {"deg", "deg/s", "N.m"} <= names and not [u for u in names if u.startswith("rad")]


def test_parameters_are_set():
    quiet = {"plant.disturbance.kind": "none", "controller.saturation": True}
    run = experiment("lqr", set={**quiet, "plant.inertia.scale": np.float64(1.0)}, stop=1.0)
    parameters = run.description["components"]
    assert parameters["plant"]["parameters"]["disturbance.kind"] == "none"
    assert parameters["plant"]["parameters"]["inertia.scale"] == 1.0
    assert parameters["controller"]["parameters"]["saturation"] is True
    by_seed = [
        experiment("lqr", set={"plant.disturbance.seed": seed}, stop=1.0).table
        for seed in (1, np.int64(7), 7)
    ]
    assert not by_seed[0].equals(by_seed[1]) and by_seed[1].equals(by_seed[2])


def test_step_and_units_are_chosen(tmp_path):
    assert experiment("lqr", stop=1.0, step=0.02).table.shape[0] == 51
    copy = tmp_path / "My law.fmu"
    shutil.copy(fmu("FBL"), copy)
    by_name, by_path = (
        experiment("lqr", fmu={"controller": archive}, stop=1.0).table for archive in ("FBL", copy)
    )
    assert by_name.equals(by_path) and not by_name.equals(experiment("lqr", stop=1.0).table)


def test_an_experiment_may_be_a_file(tmp_path, monkeypatch):
    show = [COMMAND, "show", "lqr"]
    text = subprocess.run(show, capture_output=True, text=True, check=True).stdout
    (tmp_path / "mine.toml").write_text(text)
    usual = experiment("lqr", stop=1.0).table
    monkeypatch.chdir(tmp_path)
    for name in (tmp_path / "mine.toml", "mine.toml", "mine"):
        assert experiment(name, stop=1.0).table.equals(usual)


def test_files_are_kept_where_they_are_wanted(tmp_path, temporary):
    experiment("lqr", stop=1.0)
    assert not list(temporary.iterdir())
    experiment("lqr", stop=1.0, out=tmp_path / "out")
    experiment("lqr", stop=2.0, out=tmp_path / "out")
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert metrics["samples"] == 51
    # Results of an earlier run do not pass for those of one that was refused.
    with pytest.raises(OrchestratorError) as caught:
        experiment("lqr", stop=-1.0, out=tmp_path / "out")
    assert caught.value.run is None


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("crmpc-robus", {}, 'no experiment "crmpc-robus"'),
        ("crmpc-robus", {}, 'did you mean "crmpc-robust"?'),
        ("allocated", {}, "several experiments are called allocated"),
        ("lqr", {"set": {"plant.disturbance.bund": 1}}, 'did you mean "plant.disturbance.bound"?'),
        ("lqr", {"set": {"plant.disturbance.bound": "1 kg"}}, "kg"),
        ("lqr", {"stop": -1.0}, "must be at least one step"),
        ("lqr", {"fmu": {"contoller": "LQR"}}, 'there is no component "contoller"'),
    ],
)
def test_the_orchestrators_errors_are_exceptions(name, arguments, message):
    with pytest.raises(OrchestratorError) as caught:
        experiment(name, **arguments)
    assert message in str(caught.value)
    assert not str(caught.value).startswith("error")
    assert caught.value.exit_code == 2 and caught.value.run is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"units": "grad"}, '"si" or "deg"'),
        ({"set": {"plant.disturbance.bound": [1.0]}}, "not list"),
        ({"set": {"plant.disturbance.bound": None}}, "not NoneType"),
        ({"fmu": {"controller": "LQQ"}}, 'did you mean "LQR"?'),
        ({"fmu": {"controller": "nowhere.fmu"}}, "nowhere.fmu: there is no such FMU"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises((ValueError, TypeError, OSError)) as caught:
        experiment("lqr", **arguments)
    assert message in str(caught.value)


def test_a_run_that_ends_early_gives_what_it_has():
    with pytest.raises(OrchestratorError, match="attitude lost") as caught:
        experiment("lqr", set={"plant.actuation.delay": 0.8})
    assert caught.value.exit_code == 3
    run = caught.value.run
    assert run is not None and 1.0 < run.metrics["lost_at"] == run.table.index[-1] < 50.0


def test_warnings_of_the_orchestrator_are_warnings():
    with pytest.warns(OrchestratorWarning, match="disturbance.sine.offset.x has no effect"):
        experiment("lqr", set={"plant.disturbance.sine.offset.x": 0.01}, stop=1.0)


# The command


def orchestrator(folder, *arguments):
    return subprocess.run(
        [COMMAND, *arguments], cwd=folder, capture_output=True, text=True, encoding="utf-8"
    )


def test_the_command_runs_an_experiment_from_any_folder(tmp_path):
    done = orchestrator(tmp_path, "run", "crmpc-robust")
    assert done.returncode == 0, done.stderr
    kept = tmp_path / "out" / "crmpc-robust"
    names = {"results.csv", "results.json", "metrics.json", "plot.svg"}
    assert {path.name for path in kept.iterdir()} == names
    metrics = json.loads((kept / "metrics.json").read_text())
    run = experiment("crmpc-robust")
    for name in ("ems_deg", "cms", "max_moment_n_m"):
        assert metrics[name] == run.metrics[name]


def test_the_command_lists_what_the_package_has(tmp_path):
    done = orchestrator(tmp_path, "list")
    assert done.returncode == 0, done.stderr
    for line in ("experiments (41)", "studies (8)", "FMUs (13)"):
        assert line in done.stdout
    assert "FAULT" not in done.stdout


def test_the_commands_exit_code_and_words_come_through(tmp_path):
    done = orchestrator(tmp_path, "run", "crmpc-robus")
    assert done.returncode == 2 and done.stderr.startswith("error: ")
    assert done.stdout == ""


# Types


@pytest.mark.skipif(sys.version_info < (3, 11), reason="mypy is installed for later ones only")
def test_types_are_strict_and_shipped(tmp_path):
    (tmp_path / "right.py").write_text(
        """
from pathlib import Path
from typing import Any
import numpy as np
import pandas as pd
from typing_extensions import assert_type
from reentry_fmus import ClosedLoop, Flown, Run, State
from reentry_fmus import campaign, experiment, experiments, fmu, fmus

def law(state: State) -> list[float]:
    return [0.0, 1e3 * float(state.rate[0]), 0.0]

assert_type(fmu("CRMPC"), Path)
assert_type(fmus(), list[str])
assert_type(experiments(), dict[str, str])
run = experiment(Path("x.toml"), set={"a.b": 1, "a.c": "white"}, fmu={"a": Path("b")}, units="deg")
assert_type(run, Run)
assert_type(run.table, pd.DataFrame)
assert_type(run.metrics, dict[str, Any])
assert_type(campaign("x.toml").run(out=Path("out"), jobs=2), Flown)
assert_type(campaign("x.toml").case(1), Run)
with ClosedLoop(controller="CRMPC", step=0.04) as loop:
    assert_type(loop.step(), State)
    loop.step(np.zeros(3))
    assert_type(loop.run(1.0, law), Run)
assert_type(experiment("lqr", law=law), Run)
assert_type(campaign("x.toml", law=law).run(), Flown)
"""
    )
    (tmp_path / "wrong.py").write_text(
        """
from reentry_fmus import ClosedLoop, experiment, fmu
fmu(1)
experiment("lqr", units="grad")
experiment("lqr", set={"a.b": [1.0]})
ClosedLoop(step="0.04")
campaign("x.toml").run(jobs="2")
ClosedLoop().run(1.0, lambda state: state.atitude)
"""
    )
    mypy = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", tmp_path / "cache"]
    right = subprocess.run([*mypy, "right.py"], cwd=tmp_path, capture_output=True, text=True)
    assert right.returncode == 0, right.stdout
    wrong = subprocess.run([*mypy, "wrong.py"], cwd=tmp_path, capture_output=True, text=True)
    faults = [
        line.partition(": error")[0] for line in wrong.stdout.splitlines() if ": error" in line
    ]
    assert faults == [f"wrong.py:{line}" for line in range(3, 9)], wrong.stdout
    settings = Path(__file__).parents[1] / "pyproject.toml"
    package = [*mypy, "--package", "reentry_fmus", "--config-file", settings]
    whole = subprocess.run(package, cwd=tmp_path, capture_output=True, text=True)
    assert whole.returncode == 0, whole.stdout
