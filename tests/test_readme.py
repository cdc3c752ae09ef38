"""The README's examples run as described. Those of the Python package run where the wheel is
installed (python/tests/test_pages.py)."""

import re
import subprocess
import sys

import pytest

from conftest import ROOT, TARGET

BLOCKS = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
EXAMPLES = [code for code in BLOCKS if "reentry_fmus" not in code]


def test_there_is_an_example():
    assert EXAMPLES


@pytest.mark.parametrize("code", EXAMPLES, ids=range(1, len(EXAMPLES) + 1))
def test_the_python_examples_run(code, tmp_path):
    (tmp_path / "target").symlink_to(TARGET)
    finished = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert finished.returncode == 0, finished.stderr
