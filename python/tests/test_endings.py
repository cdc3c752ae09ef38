"""However a law, a process or the work ends: the error says so, there is no result, and nothing
is left behind."""

import ctypes
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import leaks
import pytest
from conftest import SHORT, USUAL
from reentry_fmus import ClosedLoop, LawError, OrchestratorError, campaign, experiment

EARLIER: list[str] = []  # Children that other tests of this process have left.
KINDS = ["memory", "mappings", "descriptors", "children", "folders"]
linux = pytest.mark.skipif(sys.platform != "linux", reason="counts what a process holds by /proc")


# How a law ends


def raises(state):
    raise ZeroDivisionError("so")


def exits(state):
    sys.exit(0)


def interrupts(state):
    raise KeyboardInterrupt


def stops(state):
    return next(iter(()))


def reads(state):
    return [float(number) for number in input().split()]


def reads_all(state):
    return [float(number) for number in sys.stdin.read().split()]


def debugs(state):
    breakpoint()
    return [0.0, 0.0, 0.0]


def gives_nothing(state):
    pass


def gives_texts(state):
    return ["0.0", "0.0", "0.0"]


def gives_complex_numbers(state):
    return [1j, 0.0, 0.0]


def leaves(state):
    os._exit(0)


def aborts(state):
    os.abort()


def crashes(state):
    ctypes.string_at(0)


def is_killed(state):
    os.kill(os.getpid(), signal.SIGKILL)


ENDS = {
    raises: "ZeroDivisionError: so",
    exits: "SystemExit: 0",
    interrupts: "KeyboardInterrupt",
    stops: "StopIteration",
    reads: "EOFError",
    reads_all: "three finite numbers",
    debugs: "BdbQuit",
    gives_nothing: "three finite numbers, x, y and z in N m, but this is None",
    gives_texts: "three finite numbers",
    gives_complex_numbers: "three finite numbers",
}
"""Ends that Python sees, and what the error says."""
CRASHES = {
    leaves: "its process ended with exit code 0",
    aborts: "its process was ended by SIGABRT",
    crashes: "its process was ended by SIGSEGV",
    is_killed: "its process was ended by SIGKILL",
}


def at_last(end):
    """A law that ends so at 0.52 s, in some cases."""

    def law(state):
        if state.time > 0.5 and state.attitude[0] > 0.1309:
            return end(state)
        return [0.0, 0.0, 0.0]

    law.__name__ = end.__name__
    return law


@pytest.mark.parametrize("end", [*ENDS, *CRASHES], ids=lambda end: end.__name__)
def test_every_end_of_a_law_names_law_case_and_time(end, short, tmp_path, temporary):
    if end in CRASHES and os.name == "nt":
        pytest.skip("Windows has other codes")
    with pytest.raises(LawError) as caught:
        campaign(short, law=at_last(end)).run(out=tmp_path / "out", jobs=1)
    error = caught.value
    assert error.case in range(50) and error.time == pytest.approx(0.52)
    where = f"the law {end.__name__} failed in case {error.case} at t = 0.52 s: "
    assert str(error).startswith(where) and {**ENDS, **CRASHES}[end] in str(error)
    if end is raises:
        with pytest.raises(LawError, match=re.escape(str(error).splitlines()[0])):
            campaign(short, law=at_last(end)).case(error.case)
    # Its part is not kept, and nothing else stays.
    first = 5 * (error.case // 5)
    assert not list(tmp_path.glob(f"out/parts/*{first:010}-*"))
    assert not list(temporary.iterdir())
    assert not children()


@pytest.mark.parametrize("end", [e for e in ENDS if e not in (reads, reads_all, debugs, interrupts)])
def test_every_end_of_a_law_in_this_process_names_law_and_time(end):
    with ClosedLoop() as loop:
        with pytest.raises(LawError, match=rf"the law {end.__name__} failed at t = 0 s: ") as caught:
            loop.run(1.0, end)
        assert ENDS[end] in str(caught.value) and caught.value.case is None
        # The loop goes on as if nothing had been asked.
        assert loop.step([0.0, 0.0, 0.0]).time == 0.04
    with pytest.raises(LawError, match=rf"the law {end.__name__} failed at t = 0 s: "):
        experiment("lqr", stop=1.0, law=end)


def test_ctrl_c_in_a_law_is_no_failure_of_the_law(temporary):
    with ClosedLoop() as loop, pytest.raises(KeyboardInterrupt):
        loop.run(1.0, interrupts)
    with pytest.raises(KeyboardInterrupt):
        experiment("lqr", stop=1.0, law=interrupts)
    assert not list(temporary.glob("tmp*")) and not children()


@pytest.mark.parametrize("use", ["step", "run", "reset", "close"])
def test_a_law_does_not_step_its_own_loop(use):
    with ClosedLoop() as loop:
        uses = {
            "step": lambda: loop.step([0.0, 0.0, 0.0]),
            "run": lambda: loop.run(2.0, lambda state: [0.0, 0.0, 0.0]),
            "reset": loop.reset,
            "close": loop.close,
        }
        with pytest.raises(LawError, match="at t = 0 s: RuntimeError: a law does not step, run"):
            loop.run(1.0, lambda state: uses[use]())
        # It may read, and set inputs that are not connected.
        def law(state):
            loop.set("plant.disturbanceMoment.x", 1e3)
            return [loop.get("plant.rate.p"), 0.0, 0.0]

        assert len(loop.run(1.0, law).table) == 26


def test_a_law_that_cannot_be_sent_is_named(short, tmp_path):
    with ClosedLoop() as loop, pytest.raises(TypeError, match="the law law cannot be sent"):

        def law(state):
            return loop.state.moment

        campaign(short, law=law)
    with pytest.raises(TypeError, match="a law is a function from the state to the moment, not 3"):
        campaign(short, law=3)


# Failures are not results


class Worker:
    """A law in whose process something happens that is not the law's doing."""

    def __init__(self, act):
        self.act = act

    def __call__(self, state):
        if state.time > 0.5:
            self.act()
        return [0.0, 0.0, 0.0]


def killed_between_two_laws():
    """The process is killed where it waits for the next question."""
    from reentry_fmus._law import Laws

    def answer(self, kind, number, time, told):
        os.kill(os.getpid(), signal.SIGKILL)

    Laws.answer = answer


@pytest.mark.skipif(os.name == "nt", reason="Windows has other codes")
def test_a_process_that_is_killed_is_no_result(short, tmp_path, temporary):
    with pytest.raises(RuntimeError, match="Worker was ended by SIGKILL in case [0-9]+, outside") as caught:
        campaign(short, law=Worker(killed_between_two_laws)).run(out=tmp_path / "out", jobs=1)
    assert not isinstance(caught.value, LawError)
    assert not list(tmp_path.glob("out/parts/*")) and not list(temporary.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="Windows has other codes")
def test_an_orchestrator_that_is_killed_is_no_result(short, tmp_path, temporary):
    def kill_orchestrator():
        os.kill(int(Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()[-1]), 9)

    if sys.platform == "linux":
        with pytest.raises(OrchestratorError, match="was ended by SIGKILL"):
            campaign(short, law=Worker(kill_orchestrator)).run(out=tmp_path / "out", jobs=1)
        assert not list(tmp_path.glob("out/parts/*.cases"))
        with pytest.raises(OrchestratorError, match="was ended by SIGKILL"):
            experiment("lqr", stop=1.0, law=Worker(kill_orchestrator))


# Nothing is left behind


@pytest.fixture(autouse=True)
def earlier_children():
    EARLIER.extend(children())


def children():
    path = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children")
    return [child for child in path.read_text().split() if child not in EARLIER] if path.exists() else []


@linux
@pytest.mark.parametrize(("loops", "campaigns"), [(50, 0), (0, 4)])
def test_loops_and_campaigns_leave_nothing_behind(loops, campaigns):
    """As `python leaks.py`, which takes 1,000 and 100, in a process of its own."""
    command = [sys.executable, leaks.__file__, str(loops), str(campaigns)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    found = re.findall(r": (\w+) after \d+: (\S+), after \d+: (\S+)", said)
    assert [kind for kind, _, _ in found] == KINDS
    for kind, first, last in found:
        # A loop that loads its libraries anew keeps 4 MB and 8 mappings.
        allowed = {"memory": 10.0, "mappings": 8}.get(kind, 0)
        assert float(last) - float(first) <= allowed, said


def test_what_a_law_starts_and_writes_ends_with_the_campaign(short, tmp_path, temporary):
    def law(state):
        import subprocess
        import tempfile

        if state.time == 0.0:
            process = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
            (tmp_path / f"{process.pid}.started").touch()
            tempfile.mkdtemp()
        return [0.0, 0.0, 0.0]

    short.write_text(SHORT.replace("cases = 50", "cases = 2"))
    campaign(short, law=law).run(out=tmp_path / "out")
    started = [int(path.stem) for path in tmp_path.glob("*.started")]
    assert started and not list(temporary.iterdir())
    if sys.platform == "linux":
        assert not any(Path(f"/proc/{number}/exe").exists() for number in started)


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C goes another way under Windows")
@pytest.mark.parametrize("law", ["time.sleep(100.0)", "sum(range(10**12))"])
def test_ctrl_c_leaves_nothing_behind(law, short, tmp_path):
    """Also if the law is busy. Here the process that called `run` gets Ctrl-C alone."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    program = tmp_path / "program.py"
    program.write_text(
        "import os, time\nfrom reentry_fmus import campaign\n"
        f"def law(state):\n    open('begun', 'w').close()\n    {law}\n"
        "campaign('campaign.toml', law=law).run(out='out')\n"
    )
    process = subprocess.Popen(
        [sys.executable, program],
        cwd=tmp_path,
        env={**os.environ, "TMPDIR": str(temporary)},
        stderr=subprocess.PIPE,
        text=True,
        **USUAL,
    )
    while not (tmp_path / "begun").exists():
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, error = process.communicate()
    assert error.rstrip().endswith("KeyboardInterrupt")
    assert not list(temporary.iterdir())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="Windows has no fork")
def test_a_forked_child_leaves_the_folder_of_its_parent(temporary):
    """It may open loops of its own, and goes on with those that were open."""

    def work(loop, end):
        assert loop.step([0.0, 0.0, 0.0]).time == 0.04
        with ClosedLoop() as own:
            own.step([0.0, 0.0, 0.0])
        end.send("done")
        end.close()

    with ClosedLoop() as loop:
        before = sorted(temporary.rglob("*"))
        here, there = multiprocessing.Pipe()
        child = multiprocessing.get_context("fork").Process(target=work, args=(loop, there))
        child.start()
        child.join()
        assert child.exitcode == 0 and here.recv() == "done"
        assert sorted(temporary.rglob("*")) == before
        number = os.fork()
        if number == 0:
            try:
                work(loop, there)
            finally:
                # As if the child had ended by itself, but without pytest's report.
                from multiprocessing.util import _exit_function

                _exit_function()
                os._exit(0)
        os.waitpid(number, 0)
        assert here.recv() == "done"
        assert sorted(temporary.rglob("*")) == before
        assert loop.step([0.0, 0.0, 0.0]).time == 0.04


def test_folders_end_with_their_process(tmp_path):
    program = (
        "import os, sys\nfrom reentry_fmus import ClosedLoop\n"
        "loop = ClosedLoop(controller='LQR')\nloop.step()\n"
        "print(len(os.listdir(os.environ['TMPDIR'])))\n"
        "if len(sys.argv) > 1: os.kill(os.getpid(), 9)\n"
    )
    environment = {**os.environ, "TMPDIR": str(tmp_path), "TEMP": str(tmp_path)}

    def run(*arguments):
        command = [sys.executable, "-c", program, *arguments]
        return subprocess.run(command, env=environment, capture_output=True, text=True).stdout

    assert run() == "2\n" and not list(tmp_path.iterdir())
    if sys.platform == "linux":
        run("killed")
        assert len(list(tmp_path.iterdir())) == 2
        # The remains of a killed process are removed by the next orchestrator.
        program = "from reentry_fmus import experiment\nexperiment('lqr', stop=0.04)\n"
        run()
        assert not list(tmp_path.iterdir())


def test_an_archive_is_unpacked_once_until_it_changes(tmp_path, temporary):
    from reentry_fmus import fmu

    copy = tmp_path / "Copy.fmu"
    copy.write_bytes(fmu("LQR").read_bytes())
    with ClosedLoop():
        before = len(list(temporary.iterdir()))
    with ClosedLoop(controller=copy), ClosedLoop(controller=copy):
        assert len(list(temporary.iterdir())) == before + 1
        copy.write_bytes(fmu("FBL").read_bytes())
        with ClosedLoop(controller=copy) as changed:
            assert changed._controller.name == "FBL"
