"""Synthetic logs as batches in memory, and the yardstick."""

import importlib.util
import os
import sys
from itertools import pairwise
from pathlib import Path

import polars as pl
import pytest

from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch, has_wheels_alone
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_replay.regress.replayed import Asked, replay
from wmr_replay.regress.results import Results
from wmr_replay.tables import samples_frame
from wmr_schemas import PAPER_ROBOT
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.signals import Log
from wmr_synth import Sensors, record, synthesise

HERE = Path(__file__).parent
SHARED = Path(os.environ.get("WMR_SHARED_DATA", HERE.parents[1].parent / "shared" / "data"))
NOT_SHARED = "the shared data are not beside the project"
SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)


class LogRows:
    """The rows of a log in the order in which a recorder would have written them."""

    def __init__(self, log: Log) -> None:
        self.robot, self.wheels_alone = log.robot, has_wheels_alone(log)
        whole = as_batch(log)
        self.signals = [whole.pose, whole.torque, whole.mode, whole.wheels]
        self.n = sum(map(len, self.signals))

    def batch(self, start: int, stop: int) -> RawBatch:
        """The messages start … stop − 1."""
        parts = []
        for rows in self.signals:
            chosen = (rows.order >= start) & (rows.order < stop)
            parts.append(Rows(rows.t_ns[chosen], rows.order[chosen], rows.values[:, chosen]))
        return RawBatch(*parts[:3], wheels=parts[3])

    def samples(
        self,
        settings: Settings | None = None,
        *,
        model: ReplayModel | None = None,
        cuts=(),
        stop: int | None = None,
    ) -> pl.DataFrame:
        """The samples table of the first ``stop`` messages, pushed in pieces."""
        known = model or ReplayModel(self.robot)
        engine = Engine(settings or Settings(), known, wheels_alone=self.wheels_alone)
        stop = self.n if stop is None else stop
        edges = [0, *sorted(c for c in cuts if c < stop), stop]
        columns = [c for a, b in pairwise(edges) for c in engine.push(self.batch(a, b))] + engine.finish()
        return pl.concat([samples_frame(c) for c in columns])


@pytest.fixture(scope="session")
def log_rows():
    """The class itself: tests make their own."""
    return LogRows


@pytest.fixture(scope="session")
def yardstick():
    """``yardstick(log, position_sd_m, yaw_sd_rad)``: the posterior of the filter that is told everything."""
    module = _module("yardstick")
    alpha = PAPER_ROBOT.alpha
    wheel, m, yaw = 0.35**2 / 1.6, 1000.0, 500.0
    truth = module.Truth(alpha, alpha, 8.0, (3 / m) / (wheel + 2 / m), (3 / yaw) / (wheel + 2 / yaw), 1.0)
    return lambda log, position_sd_m, yaw_sd_rad: module.yardstick(log, truth, position_sd_m, yaw_sd_rad)


@pytest.fixture(scope="session")
def made_up_gap():
    """The module that makes gap results up, without an analysis."""
    return _module("made_up_gap")


@pytest.fixture(scope="session")
def page_reader():
    """The module that reads pages: ``checked(page)``."""
    return _module("page_reader")


@pytest.fixture(scope="session")
def made_up_clocks():
    """The module that writes logs whose channels are stamped by other clocks."""
    return _module("made_up_clocks")


@pytest.fixture(scope="session")
def servers():
    """The module of small servers on loopback: ``FileServer``, ``S3Server``."""
    return _module("servers")


@pytest.fixture(scope="session")
def log(tmp_path_factory) -> Path:
    """12 s of random driving, for tests that only read it."""
    path = tmp_path_factory.mktemp("log") / "drive.mcap"
    record(synthesise("random", seed=5, duration_s=12, sensors=SENSORS), path)
    return path


@pytest.fixture(scope="session")
def results(log) -> Results:
    """What a replay of ``log`` gives with nothing asked for."""
    return replay(log, Asked())


@pytest.fixture(scope="session")
def short_logs(tmp_path_factory):
    """A folder of three short logs with their side files, one of them in a folder below."""
    folder = tmp_path_factory.mktemp("logs")
    (folder / "below").mkdir()
    for seed, name in enumerate(("a.mcap", "b.mcap", "below/c.mcap")):
        record(synthesise("random", seed=seed, duration_s=6, sensors=SENSORS), folder / name)
    return folder


@pytest.fixture(scope="session")
def shared_data():
    """``shared_data("logs", "a.mcap")``: a file or folder of the shared data, see their README.

    Without the shared data the test is skipped; with them a file that is missing is a failure.
    """

    def path(*parts: str) -> Path:
        if not SHARED.is_dir():
            pytest.skip(NOT_SHARED)
        found = SHARED.joinpath(*parts)
        assert found.exists(), f"{found} is missing in the shared data"
        return found

    return path


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """In CI no test may be skipped for want of shared data that are there."""
    report = yield
    skipped_here = (
        report.skipped and not hasattr(report, "wasxfail") and "beside the project" in str(report.longrepr)
    )
    if skipped_here and SHARED.is_dir() and os.environ.get("CI"):
        report.outcome, report.longrepr = "failed", f"skipped although {SHARED} is there: {report.longrepr}"
    return report


@pytest.fixture(scope="session")
def conformance():
    """The module that writes the files of MCAP's conformance suite."""
    return _module("conformance")


@pytest.fixture(scope="session")
def real_shapes():
    """The module that writes logs in the shapes of real ones."""
    return _module("real_shapes")


@pytest.fixture(scope="session")
def bags():
    """The module that writes a log's messages into ROS bags."""
    return _module("bags")


def _module(name: str):
    spec = importlib.util.spec_from_file_location(name, HERE / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module
