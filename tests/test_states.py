"""Saved states in another process, bit for bit. Reset, restored states and instances side by side are tested in
tests/conformance."""

import json
import subprocess
import sys

import pytest

import continue_elsewhere
from conftest import NAMES
from continue_elsewhere import SETTINGS, drive, inputs
from fmi import Instance


@pytest.mark.parametrize("name", NAMES)
def test_a_state_saved_to_a_file_goes_on_in_a_new_process(fmu, name, tmp_path):
    with Instance(fmu(name), SETTINGS.get(name)).start(inputs=inputs(name, 0)) as instance:
        drive(instance, range(23))
        (tmp_path / "state").write_bytes(instance.save())
        expected = drive(instance, range(23, 60))
    command = [sys.executable, continue_elsewhere.__file__, fmu(name).path, tmp_path / "unpacked", tmp_path / "state", "23", "60"]
    finished = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert finished.returncode == 0, finished.stderr
    assert json.loads(finished.stdout) == expected
