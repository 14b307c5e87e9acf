"""Writing beside computing: the order of calls, errors, and interruptions."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from wmr_replay.jobs import result_files
from wmr_replay.jobs.run import replay_of, run_log
from wmr_replay.jobs.writing_thread import WritingThread
from wmr_synth import Sensors, record, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
INTERRUPTED = """\
import os, signal, sys, time
from wmr_replay.jobs import result_files
from wmr_replay.cli import main

class Slow(result_files.ParquetStream):
    def push(self, frame):
        super().push(frame)
        print("writing", flush=True)
        for _ in range({signals}):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.2)
        super().push(frame)

result_files.ParquetStream = Slow
sys.argv = ["wmr-replay", "run", sys.argv[1], "--out", "out", "--no-rrd"]
main()
"""


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "drive.mcap"
    record(synthesise("random", seed=5, duration_s=20, sensors=SENSORS), path)
    return path


def test_calls_are_made_in_their_order_in_one_other_thread_and_all_before_the_end():
    thread, made = WritingThread(), []
    for k in range(20):
        thread.call(lambda n: (time.sleep(0.002 * (n % 3)), made.append((n, threading.get_ident()))), k)
    thread.finish()
    assert [n for n, _ in made] == list(range(20))
    assert len({ident for _, ident in made}) == 1
    assert made[0][1] != threading.get_ident()


def test_one_call_is_under_way_and_no_other_waits():
    thread, running = WritingThread(), threading.Semaphore(0)
    thread.call(lambda _: running.acquire(), None)
    begun = threading.Event()
    other = threading.Thread(target=lambda: (thread.call(print, "", ), begun.set()))  # fmt: skip
    other.start()
    assert not begun.wait(0.05)
    running.release()
    other.join()
    thread.finish()


def failing(_):
    raise OSError("no space left")


@pytest.mark.parametrize("ask", [lambda t: t.call(print, ""), lambda t: t.finish()])
def test_an_error_is_raised_by_the_next_call_or_at_the_end(ask):
    thread = WritingThread()
    thread.call(failing, 0)
    with pytest.raises(OSError, match="no space left"):
        ask(thread)
    thread.stop()


def test_stopping_waits_for_the_call_under_way_and_says_nothing_of_its_error():
    thread, made = WritingThread(), []
    thread.call(lambda _: (time.sleep(0.05), made.append(1), failing(0)), None)
    thread.stop()
    assert made == [1]


@pytest.mark.parametrize("method", ["push", "close"])
def test_an_error_while_writing_is_the_runs_error_and_leaves_nothing(log, tmp_path, monkeypatch, method):
    monkeypatch.setattr(result_files.ParquetStream, method, lambda *_: failing(0))
    before = threading.active_count()
    with pytest.raises(OSError, match="no space left"):
        run_log(log, tmp_path / "out")
    assert not (tmp_path / "out").exists()
    assert threading.active_count() <= before + 1  # the identifier's ends with its engine


def test_the_timeline_states_what_is_known_with_the_first_rows_in_the_callers_thread(log, tmp_path):
    asked = []

    def facts():
        asked.append(threading.get_ident())
        return replay_of(log).timeline_facts()

    files = result_files.ResultFiles(tmp_path, "drive", facts)
    try:
        for rows in replay_of(log).samples(block_rows=300):
            files.push(rows)
    finally:
        files.discard()
    assert asked == [threading.get_ident()]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="signals")
@pytest.mark.parametrize("signals", [1, 2])
def test_an_interruption_while_a_block_is_written_leaves_nothing(log, tmp_path, signals):
    script = tmp_path / "interrupted.py"
    script.write_text(INTERRUPTED.format(signals=signals))
    done = subprocess.run(
        [sys.executable, script, log], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
    )
    assert "writing" in done.stdout
    assert done.returncode in (130, -signal.SIGINT), done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["interrupted.py"]
