"""SSP archives: written from experiments, valid by the standard's schema, and run by the
orchestrator, as are archives of others. Other importers run them in test_importers.py."""

import html
import json
import math
import re
import shutil
import zipfile

import numpy as np
import pytest
from fmpy.ssp.ssd import read_ssd

from conftest import EXPERIMENTS, TARGET, archive, call, results, tomllib

TABLES = {path: tomllib.loads(path.read_text()) for path in sorted(EXPERIMENTS.parent.rglob("*.toml")) if path.parent.name != "vehicles"}
# A file without a title is there to be extended, one of a paper is a study, and in a campaign something varies.
ALL = [path for path, table in TABLES.items() if "title" in table and "paper" not in table and not {"vary", "experiment"} & table.keys()]
# An archive cannot hold a table in place of an FMU, which the orchestrator says.
ALL = [path for path in ALL if ".csv" not in str(TABLES[path].get("components", ""))]
# Wall-clock times differ from run to run.
TIMES = ("solver.time", "innerLaw.time")


def pack(experiment, path, *arguments):
    return call("pack", experiment, "--out", path, "--fmu-dir", TARGET / "fmu", *arguments).stdout


def run(path, out, *arguments, code=0):
    return call("run", path, "--out", out, "--quiet", *arguments, code=code, cwd=out.parent)


@pytest.mark.parametrize("experiment", ALL, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_every_experiment_becomes_a_valid_archive(experiment, tmp_path):
    path = tmp_path / "x.ssp"
    said = pack(experiment, path)
    assert "SSP has no place for the communication step" in said
    # The description is checked against the schema of SSP 1.0.
    structure = read_ssd(str(path), validate=True)
    assert all(element.source.startswith("resources/") for element in structure.system.elements)
    text = zipfile.ZipFile(path).read("SystemStructure.ssd").decode()
    assert text.count('implementation="CoSimulation"') == len(structure.system.elements)
    # Importers demand identifiers as names.
    names = re.findall(r' name="([^"]*)"', text.split("<ssd:Elements>")[0]) + re.findall(r'<ssv:ParameterSet version="1.0" name="([^"]*)"', text)
    assert names and all(name.isidentifier() for name in names)
    assert html.unescape(re.search(r' description="([^"]*)"', text)[1]) == tomllib.loads(experiment.read_text())["title"]
    # libcosim aborts at a connector that is an enumeration.
    assert "Annotation" not in text and "ssc:Enumeration" not in text
    again = tmp_path / "again.ssp"
    pack(experiment, again)
    assert path.read_bytes() == again.read_bytes()


@pytest.mark.parametrize("name", ["crmpc-2022/estimator", "tvsmc-2015/sotvsmc-do", "exchange/two-loop-smc-allocated"])
def test_an_archive_of_ours_is_the_same_run(name, tmp_path):
    """The run needs only the step, which SSP has no place for."""
    experiment = EXPERIMENTS.parent / f"{name}.toml"
    said = pack(experiment, tmp_path / "x.ssp", "--stop", "1")
    step = re.search(r"--step (\S+)", said)[1]
    run(tmp_path / "x.ssp", tmp_path / "ssp", "--step", step)
    run(experiment, tmp_path / "toml", "--stop", "1", "--fmu-dir", TARGET / "fmu")
    ssp, toml = results(tmp_path / "ssp"), results(tmp_path / "toml")
    assert len(toml.columns) > 10 and set(toml) <= set(ssp)
    # The experiment may record fewer rows.
    rows = np.isin(ssp["time"], toml["time"])
    differ = [name for name, values in toml.items() if not np.array_equal(ssp[name][rows], values) and not name.endswith(TIMES)]
    assert rows.sum() == len(toml) and not differ
    ssp, toml = (json.loads((tmp_path / kind / "results.json").read_text()) for kind in ("ssp", "toml"))
    assert ssp["simulation"] == toml["simulation"]
    assert [component["sha256"] for component in ssp["components"].values()] == [component["sha256"] for component in toml["components"].values()]


def test_an_instance_that_fails_in_an_archive_is_named_by_archive_and_entry(tmp_path):
    path = foreign(tmp_path / "x.ssp")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(tmp_path / "y.ssp", "w") as new:
        for entry in old.namelist():
            new.writestr(entry, b"no archive" if entry == "resources/LQR.fmu" else old.read(entry))
    finished = run(tmp_path / "y.ssp", tmp_path / "out", code=2)
    assert finished.stderr.startswith(f"error: {tmp_path / 'y.ssp'}: resources/LQR.fmu: is not a zip archive"), finished.stderr


SSD = """<?xml version="1.0" encoding="ISO-8859-1"?>
<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription"
    xmlns:c="http://ssp-standard.org/SSP1/SystemStructureCommon" name="Fl\xfcgel" version="1.0">
  <System name="outer">
    <ParameterBindings><ParameterBinding source="values%20of%20all.ssv"/></ParameterBindings>
    <Elements>
      <Component name="law" source="resources/LQR.fmu"><Annotations/></Component>
      <System name="vehicle">
        <Connectors><Connector name="roll" kind="input"><c:Real/></Connector></Connectors>
        <Elements><Component name="body" source="resources/ReentryPlant.fmu" implementation="any"/></Elements>
        <Connections>
          <Connection startConnector="roll" endElement="body" endConnector="moment.x">
            <c:LinearTransformation factor="0.5" offset="7"/></Connection>
        </Connections>
      </System>
    </Elements>
    <Connections>
      <Connection startElement="law" startConnector="moment.x" endElement="vehicle" endConnector="roll">
        <c:LinearTransformation factor="4"/></Connection>
    </Connections>
  </System>
  <DefaultExperiment startTime="1" stopTime="3"/>
</SystemStructureDescription>""".encode("latin-1")
SSV = b"""<v:ParameterSet xmlns:v="x" version="1.0" name="all"><v:Parameters>
  <v:Parameter name="vehicle.body.initial.alpha"><v:Real value="3" unit="deg"/></v:Parameter>
  <v:Parameter name="vehicle.body.disturbance.kind"><v:Enumeration value="none"/></v:Parameter>
  <v:Parameter name="vehicle.body.jets.duty"><v:Boolean value="1"/></v:Parameter>
  <v:Parameter name="law.period.feedback"><v:Real value="0.02"/></v:Parameter>
</v:Parameters></v:ParameterSet>"""


def foreign(path, ssd=SSD, ssv=SSV):
    """Writes an archive as another tool could have made it."""
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("SystemStructure.ssd", ssd)
        file.writestr("values of all.ssv", ssv)
        for name in ("LQR", "ReentryPlant"):
            file.write(archive(name), f"resources/{name}.fmu")
    return path


def test_oracle_an_archive_of_another_maker_with_subsystems_and_transformations(tmp_path):
    run(foreign(tmp_path / "x.ssp"), tmp_path / "out", "--step", "0.02")
    found = results(tmp_path / "out")
    assert found["time"].iloc[0] == 1.0 and found["time"].iloc[-1] == 3.0
    assert found["vehicle/body.attitude.alpha"][0] == pytest.approx(math.radians(3.0), rel=1e-15)
    assert not found["vehicle/body.disturbance.delta.alpha"].any()
    # The moment is four times the law's, then half of that plus seven. The law comes first, so
    # there is no delay.
    law, roll = found["law.moment.x"], found["vehicle/body.moment.x"]
    assert np.allclose(roll, 2.0 * law + 7.0, rtol=1e-15) and np.ptp(law) > 0.0


@pytest.mark.parametrize(
    ("old", "new", "culprit"),
    [
        (b'source="resources/LQR.fmu"', b'source="../LQR.fmu"', "leads out"),
        (b'source="resources/LQR.fmu"', b'source="resources/LQ.fmu"', "resources/LQ.fmu"),
        (b'startConnector="moment.x"', b'startConnector="moment.w"', "moment.w"),
        (b'factor="4"', b'factor="four"', "four"),
        (b'<c:LinearTransformation factor="4"/>', b"<c:BooleanMappingTransformation/>", "BooleanMappingTransformation"),
        (b'encoding="ISO-8859-1"', b'encoding="UTF-8"', "UTF-8"),
        (b"<System name", b"<!DOCTYPE a []><System name", "document type"),
        (b"</SystemStructureDescription>", b"", "not closed"),
        (b' stopTime="3"', b"", "--stop"),
        (b'value="none"', b'value="pink"', "pink"),
        (b'unit="deg"', b'unit="deg/s"', "deg/s"),
    ],
)
def test_archives_that_cannot_be_run_are_refused_in_one_line(old, new, culprit, tmp_path):
    assert (old in SSD) != (old in SSV)
    path = foreign(tmp_path / "x.ssp", SSD.replace(old, new, 1), SSV.replace(old, new, 1))
    finished = run(path, tmp_path / "out", code=2)
    assert culprit in finished.stderr, finished.stderr
    assert finished.stderr.count("\n") == 1 and not (tmp_path / "out").exists()


def test_an_input_without_a_connection_keeps_its_start_value(tmp_path):
    old, new = b'endConnector="roll"', b'endConnector="yaw"'
    run(foreign(tmp_path / "x.ssp", SSD.replace(old, new, 1)), tmp_path / "out")


def test_what_is_no_archive_is_refused(tmp_path):
    shutil.copy(archive("LQR"), tmp_path / "x.ssp")
    assert "is not an SSP archive" in run(tmp_path / "x.ssp", tmp_path / "out", code=2).stderr
