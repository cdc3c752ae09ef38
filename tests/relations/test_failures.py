"""A failure for a reason outside the FMU is not a result of a campaign: it gives no probability, is kept nowhere, and is reported."""

import subprocess

import faults
import pytest
from conftest import EXPERIMENTS, TARGET, call, program

# A multiple of the number of faults and some more; python tests/relations/faults.py plants any number of them.
TRIALS = 24
SEARCHES = [file for file in sorted((EXPERIMENTS.parent / "campaigns").glob("*.toml")) if "\n[search]" in file.read_text("utf-8")]


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return faults.Bench(program("orchestrator"), tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def has_mounts():
    command = ["unshare", "-rm", "true"]
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


@pytest.mark.parametrize("number", range(TRIALS))
def test_a_planted_fault_gives_no_wrong_probability_and_is_told(bench, has_mounts, number, tmp_path):
    name = list(faults.FAULTS)[number % len(faults.FAULTS)]
    if name == "folder without execution" and not has_mounts:
        pytest.skip("this system mounts nothing for a user")
    assert faults.attempt(bench, tmp_path, number) is None


def test_a_fault_that_is_hidden_is_seen_by_this_check(bench, tmp_path):
    """The comparison itself can fail: with results of another seed it does."""
    trial = faults.Trial(bench, tmp_path / "other", faults.SEEDS[0])
    done = trial.call()
    trial.must_be_true(done)
    trial.seed = faults.SEEDS[1]
    with pytest.raises(faults.Wrong, match="other results"):
        trial.must_be_true(done)
    with pytest.raises(faults.Wrong, match="not told"):
        trial.must_be_told(done, 2, "has no library")


@pytest.mark.tier("studies")
@pytest.mark.parametrize("file", SEARCHES, ids=lambda file: file.stem)
def test_a_search_goes_on_when_an_fmu_refuses_values(file, tmp_path):
    """A search tries corners, where two times may be equal: the plant refuses these, and would refuse the file's own values."""
    search = tmp_path / "search.toml"
    search.write_text(f"extends = '{file}'\n[search]\ncases = 24\n")
    done = call("campaign", search, "--worst", "--out", tmp_path / "out", "--fmu-dir", TARGET / "fmu", code=None)
    assert done.returncode in (0, 4), done.stderr
