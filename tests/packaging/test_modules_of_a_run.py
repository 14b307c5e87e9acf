"""What a run imports: no package that a plain log does not need, since imports are most of a short run."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from wmr_synth import Sensors, record, synthesise

PROBE = """
import json, sys
from wmr_replay.cli import main
try:
    main()
except SystemExit as done:
    assert not done.code, done.code
print(json.dumps(sorted(sys.modules)))
"""
NEVER = {
    "scipy.fft",
    "scipy.integrate",
    "scipy.interpolate",
    "scipy.linalg",
    "scipy.optimize",
    "scipy.signal",
    "scipy.sparse",
    "scipy.special",
    "scipy.stats",
    "numpy.f2py",
    "numpy.testing",
    "numba.np.arraymath",
    "numba.cpython.unicode",
    "google.protobuf",
    "sqlite3",
    "matplotlib",
    "mcap",
    "wmr_synth",
    "wmr_replay.gap",
    "wmr_replay.fleet",
    "wmr_replay.timeline.comparison",
    "wmr_replay.ingest.bags.ros1_bag",
}
"""Packages that would cost a warm run of a plain MCAP log a hundredth to half a second each."""
TIMELINES = {"rerun", "wmr_replay.timeline.writer"}
TABLES = {"polars", "pyarrow.parquet", "scipy"}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plain") / "plain.mcap"
    sensors = Sensors(rate_hz=100.0, torque_rate_hz=100.0)
    record(synthesise("patrol", seed=0, duration_s=12.0, sensors=sensors), path)
    return path


def modules_of(*arguments: str) -> set[str]:
    """The modules that a command has imported at its end."""
    command = [sys.executable, "-c", PROBE, *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_a_warm_run_imports_what_a_plain_log_needs(log: Path) -> None:
    call = ("run", str(log), "--out", str(log.parent / "out"))
    modules_of(*call)  # compiles what is not kept yet, which imports all of numba
    loaded = modules_of(*call)
    assert loaded >= TIMELINES | TABLES
    assert loaded.isdisjoint(NEVER), loaded & NEVER


def test_without_a_timeline_rerun_is_not_imported(log: Path) -> None:
    loaded = modules_of("run", str(log), "--out", str(log.parent / "bare"), "--no-rrd")
    assert loaded >= TABLES
    assert loaded.isdisjoint(NEVER | TIMELINES), loaded & (NEVER | TIMELINES)


def test_info_imports_neither_tables_nor_timelines(log: Path) -> None:
    call = ("info", str(log))
    modules_of(*call)
    loaded = modules_of(*call)
    assert loaded.isdisjoint(NEVER | TIMELINES | {"pyarrow"}), loaded & (NEVER | TIMELINES)
