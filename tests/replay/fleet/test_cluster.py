"""``--scheduler``: the same results on a Dask cluster, here a scheduler and two workers on loopback."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from wmr_replay.fleet.batch import do_all, run_batch
from wmr_replay.fleet.job import Orders
from wmr_replay.fleet.stores import Directory
from wmr_replay.fleet.worklist import find_logs
from wmr_schemas.errors import InvalidSetting, MissingExtra
from wmr_synth import Sensors, record, synthesise

pytestmark = pytest.mark.timeout(300)
BINARY = Path(sys.executable).with_name("wmr-replay")
N_LOGS = 6


class Here:
    """Workers that are this process itself."""

    def map(self, function, tasks):
        yield from enumerate(function(*task) for task in tasks)


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drives")
    sensors = Sensors(rate_hz=100.0, torque_rate_hz=100.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
    for seed in range(N_LOGS):
        record(synthesise("random", seed=seed, duration_s=15, sensors=sensors), folder / f"{seed}.mcap")
    return folder


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def answers(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1):
        return True
    return False


@pytest.fixture
def cluster(tmp_path):
    """The scheduler's address, and two workers as processes of one thread each."""
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    port, address = free_port(), "tcp://127.0.0.1:{}"
    python = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    options = ["--host", "127.0.0.1", "--port", str(port), "--dashboard-address", "127.0.0.1:0"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": tmp_path}
    worker = [sys.executable, "-m", "distributed.cli.dask_worker", address.format(port), "--no-nanny"]
    worker += ["--nthreads", "1", "--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"]
    processes = [subprocess.Popen([*python, *options], **quiet)]
    try:
        while not answers(port):
            assert processes[0].poll() is None
            time.sleep(0.05)
        processes += [subprocess.Popen(worker, **quiet) for _ in range(2)]
        yield address.format(port), processes[1:]
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def content(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_a_worker_killed_half_way_changes_nothing(logs, cluster, tmp_path):
    address, workers = cluster
    out = tmp_path / "far"
    command = [BINARY, "batch", logs, "--out", out, "--scheduler", address]
    batch = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while batch.poll() is None and len(list(out.glob("records/*.json"))) < 2:
        time.sleep(0.005)
    os.kill(workers[0].pid, signal.SIGKILL)
    half_way = len(list(out.glob("records/*.json")))
    shown, problems = batch.communicate()
    assert batch.returncode == 0, shown + problems
    assert half_way < N_LOGS
    assert workers[1].poll() is None
    near = tmp_path / "near"
    with Directory(near).opened():
        do_all(Here(), find_logs([logs]), Orders(), Directory(near), None)
    far = content(out)
    assert far.keys() - content(near).keys() == {"fleet.json", "fleet.parquet"}
    assert content(near).items() <= far.items()


def test_without_a_scheduler_the_message_says_so(logs, tmp_path, monkeypatch):
    pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
    monkeypatch.setattr("wmr_replay.fleet.cluster._CONNECT_S", 0.2)
    address = f"tcp://127.0.0.1:{free_port()}"
    with pytest.raises(InvalidSetting, match=f"{address}: no Dask scheduler answers"):
        run_batch([logs], tmp_path, Orders(), scheduler=address)


def test_without_the_extra_the_message_names_it(logs, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"pip install 'wmr-replay\[cluster\]'"):
        run_batch([logs], tmp_path, Orders(), scheduler="tcp://127.0.0.1:1")
