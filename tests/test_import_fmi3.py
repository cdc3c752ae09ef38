"""FMUs of FMI 3.0 in the orchestrator: the results of FMI 2.0, bit for bit."""

import zipfile

import pandas
import pytest

from conftest import ROOT, TARGET, call, results
from fmi import NOT_REPRODUCIBLE

FOLDER = ROOT / "orchestrator" / "experiments"
EXPERIMENTS = [
    "crmpc-2022/lqr",
    "crmpc-2022/crmpc-robust",
    "crmpc-2022/dlmpc",
    "crmpc-2022/estimator",
    "tvsmc-2015/allocated",
    "two-loop-smc/two-loop",
    "exchange/gusts",
    "reversal/allocated",
    "entry/surfaces-and-jets",
]
PLANT = "ReentryPlant.fmu"


def rows(out, experiment, *folders, options=()):
    """The recorded rows without computing times."""
    command = ["run", FOLDER / f"{experiment}.toml", "--out", out, "--force", "--quiet"]
    stop = ["--stop", "120"] if experiment.startswith("entry") else []
    for folder in folders:
        command += ["--fmu-dir", folder]
    finished = call(*command, *stop, *options, code=None)
    assert finished.returncode in (0, 3), finished.stderr
    found = results(out)
    return found.drop(columns=[name for name in found if name.endswith(tuple(NOT_REPRODUCIBLE))])


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Folders of FMUs: of FMI 3.0 without event mode, and with one of plant and controllers each."""
    root = tmp_path_factory.mktemp("fmu")
    made = {name: root / name for name in ("without event mode", "plant 3.0", "controllers 3.0")}
    for folder in made.values():
        folder.mkdir()
    for path in (TARGET / "fmi3").glob("*.fmu"):
        with zipfile.ZipFile(path) as file, zipfile.ZipFile(made["without event mode"] / path.name, "w") as other:
            for name in file.namelist():
                content = file.read(name)
                if name == "modelDescription.xml":
                    assert b' hasEventMode="true"' in content
                    content = content.replace(b' hasEventMode="true"', b"")
                other.writestr(name, content)
        for name, is_three in (("plant 3.0", path.name == PLANT), ("controllers 3.0", path.name != PLANT)):
            (made[name] / path.name).symlink_to(path if is_three else TARGET / "fmu" / path.name)
    return {"FMI 3.0": TARGET / "fmi3", **made}


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_oracle_the_results_are_those_of_fmi_2(experiment, folders, tmp_path):
    expected = rows(tmp_path / "two", experiment, TARGET / "fmu")
    assert len(expected) > 100
    for name, folder in folders.items():
        assert rows(tmp_path / "other", experiment, folder, options=["--isolate=false"]).equals(expected), name
    if experiment == "crmpc-2022/lqr":
        assert rows(tmp_path / "other", experiment, TARGET / "fmi3", options=["--isolate"]).equals(expected)
    jacobi = [rows(tmp_path / "other", experiment, TARGET / each, options=["--coupling", "jacobi"]) for each in ("fmu", "fmi3")]
    assert jacobi[0].equals(jacobi[1]) and not jacobi[0].equals(expected)


@pytest.mark.parametrize("coupling", ["sequential", "jacobi"])
@pytest.mark.parametrize("step", ["0.01", "0.03", "0.06", "0.08", "0.1", "0.4"])
def test_oracle_a_step_of_any_length_gives_the_results_of_fmi_2(step, coupling, folders, tmp_path):
    """A tick within a step sees the inputs of its beginning, whether or not the step is cut there."""
    options = ["--step", step, "--coupling", coupling, "--stop", "2.4"]
    expected = rows(tmp_path / "two", "crmpc-2022/crmpc-robust", TARGET / "fmu", options=options)
    for name in ("FMI 3.0", "without event mode"):
        assert rows(tmp_path / "three", "crmpc-2022/crmpc-robust", folders[name], options=options).equals(expected), name


def test_oracle_linear_models_are_those_of_fmi_2(tmp_path):
    found = []
    for folder in ("fmu", "fmi3"):
        out = tmp_path / folder
        done = call("margins", FOLDER / "margins" / "rest.toml", "--model", out, "--json", "--fmu-dir", TARGET / folder)
        found.append((done.stdout, out.read_bytes()))
    assert found[0] == found[1]


def test_oracle_a_campaign_gives_the_cases_of_fmi_2(tmp_path):
    tables = []
    for folder in ("fmu", "fmi3"):
        command = ["campaign", FOLDER / "campaigns" / "corners.toml", "--quiet", "--out", tmp_path / folder]
        call(*command, "--experiment", FOLDER / "crmpc-2022" / "lqr.toml", "--fmu-dir", TARGET / folder)
        tables.append(pandas.read_parquet(tmp_path / folder / "cases.parquet"))
    assert tables[0].equals(tables[1]) and len(tables[0]) == 16


@pytest.mark.parametrize("interface", ["coSimulation", "modelExchange"])
def test_an_ssp_archive_takes_both_versions(interface, folders, tmp_path):
    experiment = tmp_path / "lqr.toml"
    extended = FOLDER / "crmpc-2022" / "lqr.toml"
    experiment.write_text(f"extends = '{extended}'\ntitle = 'x'\n[components.plant]\ninterface = '{interface}'\n", encoding="utf-8")
    call("pack", experiment, "--out", tmp_path / "x.ssp", "--fmu-dir", folders["plant 3.0"])
    call("run", tmp_path / "x.ssp", "--step", "0.04", "--out", tmp_path / "out", "--quiet")
    expected, columns = rows(tmp_path / "two", str(tmp_path / "lqr"), TARGET / "fmu"), ["plant.attitude.alpha", "controller.moment.x"]
    assert results(tmp_path / "out")[columns].equals(expected[columns])
