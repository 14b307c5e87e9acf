"""A batch that is killed at a random moment leaves no incomplete result that looks complete, and resumes."""

import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from wmr_replay.fleet.dataset import TABLES
from wmr_synth import Sensors, record, synthesise

pytestmark = [
    pytest.mark.timeout(300),
    pytest.mark.skipif(sys.platform == "win32", reason="needs process groups"),
]
BINARY = Path(sys.executable).with_name("wmr-replay")
N_LOGS, N_KILLS = 6, 3
RECORD_TABLES = {*TABLES}


def start(logs, out):
    """A batch in a process group of its own."""
    command = [BINARY, "batch", logs, "--out", out, "--jobs", "2"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(command, start_new_session=True, **quiet)


def until_work_has_begun(process, out):
    while process.poll() is None and not any((out / ".partial").glob("*")):
        time.sleep(0.005)


def records(out):
    return sorted((out / "records").glob("*.json"))


def assert_nothing_half_written_looks_whole(out):
    for path in records(out):
        files = json.loads(path.read_text())["files"]
        assert {name.partition("/")[0] for name in files} == RECORD_TABLES
        for name, facts in files.items():
            assert hashlib.sha256((out / name).read_bytes()).hexdigest() == facts["sha256"]


def group_is_gone(pid, within_s=10.0):
    """Whether no process of the group is left: killed ones are reaped by whoever adopts them."""
    end_s = time.monotonic() + within_s
    while time.monotonic() < end_s:
        try:
            os.killpg(pid, 0)
        except (ProcessLookupError, PermissionError):
            return True
        if all(state == "Z" for state in group_states(pid)):
            return True
        time.sleep(0.05)
    return False


def group_states(pid):
    """Process states of the group by the system's own account."""
    listed = subprocess.run(["ps", "-eo", "pgid=,stat="], capture_output=True, text=True, check=True).stdout
    rows = (line.split() for line in listed.splitlines())
    return [state[0] for group, state in rows if int(group) == pid]


def content(folder):
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("many")
    sensors = Sensors(rate_hz=100.0, torque_rate_hz=100.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
    for seed in range(N_LOGS):
        record(synthesise("random", seed=seed, duration_s=15, sensors=sensors), folder / f"{seed}.mcap")
    return folder


@pytest.fixture(scope="module")
def undisturbed(logs, tmp_path_factory):
    """Content of the results, and how long they take: of the second of two runs, the first may compile."""
    for name in ("compiles", "out"):
        out = tmp_path_factory.mktemp("undisturbed") / name
        process = start(logs, out)
        until_work_has_begun(process, out)
        begun_s = time.monotonic()
        assert process.wait() == 0
    return content(out), time.monotonic() - begun_s


def test_killed_at_random_moments_and_resumed(logs, undisturbed, tmp_path):
    wanted, work_s = undisturbed
    out, chance = tmp_path / "out", random.Random(time.time_ns())
    n_kills = 0
    for _ in range(N_KILLS):
        process = start(logs, out)
        until_work_has_begun(process, out)
        time.sleep(chance.uniform(0, work_s / N_KILLS))
        if process.poll() is None:  # it may be done already
            n_kills += 1
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        assert group_is_gone(process.pid)
        assert_nothing_half_written_looks_whole(out)
    assert n_kills
    done = {path.name: path.stat().st_mtime_ns for path in records(out)}
    assert start(logs, out).wait() == 0
    assert content(out) == wanted
    kept = {path.name: path.stat().st_mtime_ns for path in records(out) if path.name in done}
    assert kept == done
    assert not (out / ".partial").exists()


def test_workers_do_not_outlive_a_killed_parent(logs, tmp_path):
    process = start(logs, tmp_path)
    until_work_has_begun(process, tmp_path)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert group_is_gone(process.pid)
    assert_nothing_half_written_looks_whole(tmp_path)


def test_an_interrupt_ends_the_workers_and_leaves_nothing_half_written(logs, tmp_path):
    process = start(logs, tmp_path)
    until_work_has_begun(process, tmp_path)
    os.killpg(process.pid, signal.SIGINT)
    assert process.wait() == 130
    assert group_is_gone(process.pid)
    assert_nothing_half_written_looks_whole(tmp_path)
    assert not (tmp_path / ".partial").exists()
    assert len(records(tmp_path)) < N_LOGS
