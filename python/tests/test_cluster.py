"""Campaigns on Dask's workers: whatever happens to them, the results are those of one machine."""

import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import uuid
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from reentry_fmus import OrchestratorError, campaign
from reentry_fmus._data import experiment_path

dask = pytest.importorskip("dask")
pytest.importorskip("distributed")
from distributed import Client, LocalCluster  # noqa: E402
from reentry_fmus import cluster  # noqa: E402
from reentry_fmus.cluster import ClusterError  # noqa: E402

CASES = 2000
CAMPAIGN = f"""
title = "LQR in gusts"
experiment = "short.toml"
cases = {CASES}

[[vary]]
parameter = "plant.disturbance.seed"
case = 1

[[vary]]
parameter = "plant.inertia.scale"
uniform = [0.95, 1.05]

[[measure]]
id = "rate"
kind = "largest"
signals = "rate-norm"

[[limit]]
id = "rate"
measure = "rate"
at_most = 6.45

[signals]
rate-norm = ["norm(plant.rate.p, plant.rate.q, plant.rate.r)"]
"""
PARTS = CASES // 25
# The wall clock of a loaded machine is no matter of these tests.
LONG = 120.0


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    path = folder / "gusts.toml"
    path.write_text(CAMPAIGN)
    lqr = experiment_path("lqr")
    (folder / "short.toml").write_text(
        f"title = 'LQR for 20 s'\nextends = '{lqr}'\n[simulation]\nstop = 20.0\n"
    )
    return path


@pytest.fixture(scope="module")
def expected(file, tmp_path_factory):
    """The bytes of the results of this machine alone."""
    return content(campaign(file).run(out=tmp_path_factory.mktemp("alone")).folder)


def content(folder):
    names = sorted(path.name for path in (folder / "parts").iterdir())
    assert len(names) == PARTS and all(name.endswith(".parquet") for name in names)
    return [(folder / name).read_bytes() for name in ("cases.parquet", "summary.json")]


@contextmanager
def workers(count=2, **options):
    """A cluster of processes with one thread each."""
    options = {"processes": True, "threads_per_worker": 1, "dashboard_address": ":0"} | options
    with LocalCluster(n_workers=count, **options) as cluster, Client(cluster) as client:
        yield client


@pytest.fixture(scope="module")
def client():
    with workers() as client:
        yield client


@contextmanager
def meanwhile(folder, act, parts=2):
    """Acts in another thread as soon as this number of parts is kept in the folder."""
    problems = []

    def watch():
        try:
            until(lambda: len(list((folder / "parts").glob("*.parquet"))) >= parts)
            act()
        except BaseException as problem:
            problems.append(problem)

    thread = threading.Thread(target=watch)
    thread.start()
    yield
    thread.join(LONG)
    assert not thread.is_alive() and not problems, problems


def until(condition):
    end = time.monotonic() + LONG
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_workers_give_the_bytes_of_one_machine(file, expected, client, tmp_path):
    run = campaign(file).run(client, out=tmp_path / "out", units="deg")
    assert content(run.folder) == expected
    assert len(run.table) == CASES and run.summary["cases"] == CASES
    # Flown parts are not flown again, and missing ones are.
    (run.folder / "parts" / "0000000500-0000000525.parquet").unlink()
    before = {path: path.stat().st_mtime_ns for path in (run.folder / "parts").iterdir()}
    assert content(campaign(file).run(client, out=tmp_path / "out").folder) == expected
    after = {path: path.stat().st_mtime_ns for path in (run.folder / "parts").iterdir()}
    assert before.items() < after.items() and len(after) == PARTS
    # Nothing stays with the workers.
    assert not any(
        left for left in client.run(lambda dask_worker: list_of_files(dask_worker)).values()
    )


def list_of_files(worker):
    folder = Path(worker.local_directory)
    return [path.name for path in folder.iterdir() if path.name.startswith(("reentry", "cases"))]


@pytest.mark.parametrize("shares_client", [False, True])
def test_two_drivers_share_a_cluster(shares_client, file, expected, tmp_path):
    """They fly the same campaign at once, with clients of their own or with one. Neither of them takes
    away what the other one needs."""
    with workers() as client, Client(client.scheduler.address, set_as_default=False) as second:
        clients = [client, client if shares_client else second]

        def drive(number):
            # The first one has less to do, and ends before the other one.
            out = tmp_path / f"out-{number}"
            if number == 0:
                campaign(file).run(jobs=2, out=out)
                for part in sorted((out / "parts").iterdir())[:10]:
                    part.unlink()
            return campaign(file).run(clients[number], out=out).folder

        with ThreadPoolExecutor(2) as threads:
            folders = list(threads.map(drive, range(2)))
        assert [content(folder) for folder in folders] == [expected] * 2
        # Nothing stays with the workers.
        assert not any(client.run(lambda dask_worker: list_of_files(dask_worker)).values())
        plugins = client.run(lambda dask_worker: list(dask_worker.plugins))
        assert not [name for names in plugins.values() for name in names if "reentry" in name]


@pytest.mark.parametrize("kind", ["file", "memory"])
def test_parts_are_kept_at_an_address(kind, file, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "shared" if kind == "file" else Path(f"/{uuid.uuid4().hex}")
    address = f"{kind}://{folder.as_posix()}"
    # Data in memory are there for threads of the same process only.
    with workers(processes=kind == "file") as client:
        run = campaign(file).run(client, out=address)
        assert run.folder == tmp_path / "out" / "gusts" and content(run.folder) == expected
        store = cluster.Store(address)
        assert len(store.names()) == PARTS
        assert store.files.cat_file(f"{store.root}/cases.parquet") == expected[0]
        assert not [path for path in store.files.find(store.root) if "unfinished" in path]
        # Another machine goes on with what is there, and flies what is damaged.
        damaged = "0000000250-0000000275.parquet"
        right = store.files.cat_file(f"{store.root}/parts/{damaged}")
        store.files.pipe_file(f"{store.root}/parts/{damaged}", right[:-100])
        shutil.rmtree(tmp_path / "out")
        submitted = []
        submit = client.submit

        def noted(*arguments, **named):
            submitted.append(arguments)
            return submit(*arguments, **named)

        monkeypatch.setattr(client, "submit", noted)
        assert content(campaign(file).run(client, out=address).folder) == expected
        assert [arguments[3:5] for arguments in submitted] == [(250, 275)]
        assert store.files.cat_file(f"{store.root}/parts/{damaged}") == right


def test_a_campaign_ends_at_the_same_case_when_its_question_is_answered(
    file, expected, client, tmp_path
):
    until = file.with_name("until.toml")
    question = '[until]\nlimit = "rate"\nbelow = 0.4\n'
    until.write_text(CAMPAIGN.replace(f"cases = {CASES}", "cases = 20000") + question)
    alone = campaign(until).run(out=tmp_path / "alone")
    together = campaign(until).run(client, out=tmp_path / "together")
    assert alone.summary["answer"]["holds"] is not None
    assert 500 < alone.summary["cases"] < 20000
    for name in ("cases.parquet", "summary.json"):
        assert (together.folder / name).read_bytes() == (alone.folder / name).read_bytes()


@pytest.mark.parametrize("failures", [0, 3])
def test_a_worker_is_killed(failures, file, expected, tmp_path):
    """Its tasks are flown again, whether Dask does so by itself or gives them up at once."""
    out = tmp_path / "out"
    with dask.config.set({"distributed.scheduler.allowed-failures": failures}), workers() as client:
        before = client.run(os.getpid)
        with meanwhile(out, lambda: os.kill(next(iter(before.values())), signal.SIGKILL)):
            run = campaign(file).run(client, out=out)
        assert content(run.folder) == expected
        until(lambda: len(client.nthreads()) == 2)
        assert len(set(client.run(os.getpid).values()) & set(before.values())) == 1


def test_workers_come_late_and_one_stands_still(file, expected, tmp_path):
    out = tmp_path / "out"
    with workers() as client:
        stopped = next(iter(client.run(os.getpid).values()))

        def act():
            os.kill(stopped, signal.SIGSTOP)
            try:
                client.cluster.scale(3)
                # The others do what was not handed to the first one: several parts are one task. Then it goes on.
                until(lambda: len(list((out / "parts").iterdir())) >= PARTS // 2)
            finally:
                os.kill(stopped, signal.SIGCONT)

        with meanwhile(out, act):
            run = campaign(file).run(client, out=out)
        assert content(run.folder) == expected


@contextmanager
def started(*command):
    process = subprocess.Popen(
        [*command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
    )
    try:
        yield process
    finally:
        # With its children, of which a worker has some.
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def command_of(what, *arguments):
    return [sys.executable, "-m", f"distributed.cli.dask_{what}", *arguments]


def test_the_scheduler_is_started_anew(file, expected, tmp_path):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    scheduler = command_of("scheduler", "--host", address, "--no-dashboard")
    worker = command_of("worker", address, "--nthreads", "1", "--no-dashboard")
    # It waits for the scheduler, which a busy machine starts late.
    worker += ["--local-directory", str(tmp_path), "--death-timeout", f"{LONG:.0f}"]
    out = tmp_path / "out"
    with started(*scheduler) as first, started(*worker), Client(address, timeout=LONG) as client:
        with meanwhile(out, lambda: os.kill(first.pid, signal.SIGKILL), parts=3):
            with pytest.raises(ClusterError, match="the same call of run continues") as caught:
                campaign(file).run(client, out=out)
    kept = {path: path.stat().st_mtime_ns for path in (out / "parts").glob("*.parquet")}
    assert 3 <= len(kept) < PARTS and f"{len(kept)} parts are flown and kept" in str(caught.value)
    with started(*scheduler), started(*worker), Client(address, timeout=LONG) as client:
        assert content(campaign(file).run(client, out=out).folder) == expected
    assert all(path.stat().st_mtime_ns == written for path, written in kept.items())


def can_make_namespaces():
    if shutil.which("ip") is None or os.geteuid() != 0:
        return False
    name = f"try{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", name], capture_output=True).returncode == 0
    if made:
        subprocess.run(["ip", "netns", "del", name], check=True)
    return made


@pytest.mark.skipif(
    sys.platform != "linux" or not can_make_namespaces(), reason="needs root, ip and namespaces"
)
def test_workers_on_hosts_of_their_own(file, expected, tmp_path, monkeypatch):
    """Each worker has a network of its own, as a host has. A bridge connects them."""

    def ip(*arguments):
        subprocess.run(["ip", *arguments], check=True)

    tag = f"{os.getpid() % 10000}"
    net = f"10.{200 + os.getpid() % 50}.{os.getpid() % 250}"
    address = f"tcp://{net}.254:8786"
    bridge, hosts = f"rebr{tag}", [f"re{tag}h{number}" for number in (1, 2)]
    # The scheduler gives up a worker that it does not reach after this time.
    monkeypatch.setenv("DASK_DISTRIBUTED__COMM__TIMEOUTS__TCP", "11s")
    with ExitStack() as left:
        left.callback(subprocess.run, ["ip", "link", "del", bridge])
        ip("link", "add", bridge, "type", "bridge")
        ip("address", "add", f"{net}.254/24", "dev", bridge)
        ip("link", "set", bridge, "up")
        left.enter_context(started(*command_of("scheduler", "--host", address, "--no-dashboard")))
        for number, host in enumerate(hosts, 1):
            left.callback(subprocess.run, ["ip", "netns", "del", host])
            ip("netns", "add", host)
            ip("link", "add", f"{host}v", "type", "veth", "peer", "name", "eth0", "netns", host)
            ip("link", "set", f"{host}v", "master", bridge, "up")
            ip("-n", host, "address", "add", f"{net}.{number}/24", "dev", "eth0")
            ip("-n", host, "link", "set", "eth0", "up")
            ip("-n", host, "link", "set", "lo", "up")
            worker = command_of("worker", address, "--nthreads", "1", "--no-dashboard")
            worker += ["--local-directory", str(tmp_path / host)]
            left.enter_context(started("ip", "netns", "exec", host, *worker))
        client = left.enter_context(Client(address, timeout=LONG))
        client.wait_for_workers(2, timeout=LONG)
        addresses = sorted(worker.split(":")[1] for worker in client.nthreads())
        assert addresses == [f"//{net}.1", f"//{net}.2"]

        # The cable of one host is pulled in the middle.
        def pull():
            ip("link", "set", f"{hosts[0]}v", "down")

        with meanwhile(tmp_path / "out", pull):
            run = campaign(file).run(client, out=tmp_path / "out")
        assert content(run.folder) == expected
        assert len(client.nthreads()) == 1


def test_another_version_on_a_worker_is_refused(file, client, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "version", lambda name: "0.0.1")
    with pytest.raises(ClusterError, match=r"has reentry-fmus .*, but the driver has 0\.0\.1"):
        campaign(file).run(client, out=tmp_path / "out")


def test_what_the_program_says_on_a_worker_comes_back(file, client, tmp_path, monkeypatch):
    other = file.with_name("other.toml")
    other.write_text(file.read_text().replace(f"cases = {CASES}", "cases = 100"))
    bundle = cluster.pack(campaign(other).call)
    monkeypatch.setattr(cluster, "pack", lambda campaign: bundle)
    with pytest.raises(ClusterError, match=r"cases \d+ to \d+: tcp://.*within 0\.\.100"):
        campaign(file).run(client, out=tmp_path / "out")


def test_bad_arguments_are_refused(file, client, tmp_path):
    with pytest.raises(ValueError, match="jobs is for runs without a client"):
        campaign(file).run(client, jobs=2)
    with pytest.raises(OrchestratorError, match='no campaign "gust"'):
        campaign("gust").run(client, out=tmp_path / "out")
