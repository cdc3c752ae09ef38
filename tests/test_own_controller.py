"""examples/own-controller, a law outside the project's workspace: built, validated, flown and
compared."""

import subprocess

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from conftest import EXPERIMENTS, ROOT, call, results
from fmi import ANGLES, MOMENT, RATES

# It compiles what the crate needs, in a workspace of its own. `.ci/run` checks that it compiles.
pytestmark = pytest.mark.tier("importers")
FOLDER = ROOT / "examples" / "own-controller"
# The Riccati equation gives these gains for P = 50, Q = 10: sqrt(P/Q), sqrt((P + 2 sqrt(P Q))/Q).
GAINS = {"gain.p": np.sqrt(5.0), "gain.d": np.sqrt(5.0 + 2.0 * np.sqrt(5.0))}
COLUMNS = [*(f"plant.{name}" for name in ANGLES + RATES), *(f"controller.{name}" for name in MOMENT)]


def test_oracle_a_law_from_outside_is_built_flown_and_agrees_with_lqr(experiment, tmp_path):
    packed, packed3 = tmp_path / "fmu" / "PD.fmu", tmp_path / "fmi3" / "PD.fmu"
    locked = (FOLDER / "Cargo.lock").read_text()
    subprocess.run([ROOT / "scripts" / "pack-crate", FOLDER, packed.parent], check=True, capture_output=True)
    assert (FOLDER / "Cargo.lock").read_text() == locked, "Cargo.lock is not up to date"
    assert validate_fmu(str(packed)) == validate_fmu(str(packed3)) == []
    assert len((FOLDER / "src" / "lib.rs").read_text().splitlines()) <= 40

    # The law replaces the controller in an experiment that was written for another one.
    gains = [f"--set=controller.{name}={value!r}" for name, value in {k: float(v) for k, v in GAINS.items()}.items()]
    found = []
    for archive in (packed, packed3):
        flown = tmp_path / "flown" / archive.parent.name
        call("run", EXPERIMENTS / "crmpc-robust.toml", "--fmu", f"controller={archive}", "--out", flown, *gains)
        found.append(results(flown)[COLUMNS].to_numpy())
    expected = results(experiment("lqr"))[COLUMNS].to_numpy()
    assert found[0].shape == expected.shape == (1251, 9)
    assert (np.abs(found[0] - expected).max(axis=0) <= 1e-9 * np.abs(expected).max(axis=0)).all()
    assert np.array_equal(*found)
