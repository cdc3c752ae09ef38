"""The archives themselves: valid, complete, reproducible, and equal to the committed snapshots."""

import subprocess
import zipfile
from pathlib import Path

import pytest
from fmpy.validation import validate_fmu

from conftest import NAMES, ROOT, TARGET, archive, library, newest, program

# The libraries by the folder with their FMUs' descriptions.
LIBRARIES = {"fmu-plant": ["fmu_plant_library"], "fmu-controller": ["fmu_optimising", "fmu_feedback"]}


def pack(folder, *arguments, folders=LIBRARIES):
    libraries = [library(name) for each in folders for name in LIBRARIES[each]]
    subprocess.run([program("fmu-pack"), *libraries, "--output", folder, *arguments], check=True, capture_output=True)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.importer("FMPy", "`fmpy validate`")
def test_fmpy_finds_no_problem(name):
    assert validate_fmu(str(archive(name))) == []


def test_every_fmu_was_packed_and_tested():
    assert sorted(path.stem for path in archive("LQR").parent.glob("*.fmu")) == sorted(NAMES)


@pytest.mark.parametrize("crate", ["reentry-fmu-plant-library", "reentry-fmu-optimising", "reentry-fmu-feedback"])
def test_a_library_is_built_again_if_a_source_or_a_dependency_has_changed_and_only_then(crate):
    # Files that cargo watches. It considers a path that does not exist as changed.
    said = newest(*TARGET.glob(f"*/build/{crate}-*/output"), *TARGET.glob(f"*/*/build/{crate}-*/output")).read_text()
    prefix = "cargo::rerun-if-changed="
    watched = {Path(line.removeprefix(prefix)) for line in said.splitlines() if line.startswith(prefix)}
    # This one is relative to the crate.
    watched.remove(Path("build.rs"))
    assert {ROOT / "Cargo.lock", ROOT / "vehicle" / "src", ROOT / "vehicle" / "data"} <= watched
    assert [path for path in watched if not path.exists()] == []


@pytest.mark.parametrize("name", NAMES)
def test_description_says_what_tools_rely_on(fmu, name):
    description = fmu(name).description
    assert description.fmiVersion == "2.0"
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    assert description.coSimulation.canGetAndSetFMUstate and description.coSimulation.canSerializeFMUstate
    assert (description.modelExchange is not None) == (name == "ReentryPlant")
    # The duration of the paper's scenario, or of an entry flight.
    assert float(description.defaultExperiment.stopTime) == (3000.0 if name in ("EntryGuidance", "EntryNavigation") else 50.0)
    for variable in description.modelVariables:
        assert variable.description, f"{variable.name} has no description"
    with zipfile.ZipFile(archive(name)) as packed:
        files = packed.namelist()
        icon = packed.read("model.png")
        page = packed.read("documentation/index.html").decode()
    for part in ("Example wiring</h3>", "Limits</h3>", "Parameters", "Inputs", "Outputs", "Licence"):
        assert part in page, part
    [committed] = ROOT.glob(f"fmu-*/icons/{name}.png")
    assert icon.startswith(b"\x89PNG") and icon == committed.read_bytes()
    assert "documentation/index.html" in files
    assert any(file.startswith("documentation/licenses/LICENSE-") for file in files)


def test_packing_twice_gives_the_same_bytes(tmp_path):
    for run in ("first", "second"):
        pack(tmp_path / run, folders=["fmu-plant"])
    first, second = ((tmp_path / run / "ReentryPlant.fmu").read_bytes() for run in ("first", "second"))
    assert first == second


@pytest.mark.parametrize("folder", LIBRARIES)
def test_committed_snapshots_are_what_the_libraries_say(folder, tmp_path):
    pack(tmp_path / "fmu", "--xml-snapshot", tmp_path / "generated", folders=[folder])
    generated = {path.name: path.read_text() for path in (tmp_path / "generated").glob("*.xml")}
    committed = {path.name: path.read_text() for path in (ROOT / folder / "generated").glob("*.xml")}
    differing = sorted(
        name for name in generated.keys() | committed.keys() if generated.get(name) != committed.get(name)
    )
    assert not differing, f"{differing} in {folder}/generated are out of date: run scripts/update-generated"
