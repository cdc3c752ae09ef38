"""The steps of docs/use-it.md, in their order."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from conftest import ROOT, TARGET

BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```$", (ROOT / "docs" / "use-it.md").read_text(), re.DOTALL | re.MULTILINE)


@pytest.mark.skipif(
    sys.platform != "linux" or os.uname().machine != "x86_64" or sys.version_info < (3, 11),
    reason="not every tool of the page is there for this platform or Python",
)
def test_the_steps_of_the_page(libpython, tmp_path):
    for name in ("orchestrator", "scripts", "docs"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "target").symlink_to(TARGET)
    (tmp_path / "out").mkdir()
    programs = Path(sys.executable).parent
    environment = {**os.environ, "LIBPYTHON": libpython, "PATH": f"{programs}:{os.environ['PATH']}"}
    for language, text in BLOCKS:
        if language == "toml":
            (tmp_path / "out" / "pd.toml").write_text(text)
            continue
        command = {"sh": ["bash", "-euo", "pipefail", "-c"], "python": [sys.executable, "-c"]}[language]
        done = subprocess.run([*command, text], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, text + done.stdout + done.stderr
    made = [path.name for path in (tmp_path / "out").iterdir()]
    wanted = "crmpc paced loop.ssp again plant.csv exchange.csv closed_loop.csv variation.csv closed_loop.png archive crmpc.csv loop.fmu container.csv"
    for name in [*wanted.split(), "PdController.fmu", "pd"]:
        assert name in made
    assert {language for language, _ in BLOCKS} == {"sh", "python", "toml"}
