"""The identifier in a thread beside the monitors: the same rows as one after the other, and its errors."""

import threading

import numpy as np
import pytest

from wmr_replay.pipeline import beside
from wmr_replay.pipeline.beside import LEAST_ROWS, Beside
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_synth import Sensors, synthesise

SENSORS = Sensors(rate_hz=250.0, torque_rate_hz=250.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)


def rows_of(log, settings):
    engine = Engine(settings, ReplayModel(log.robot))
    parts = [*engine.push(as_batch(log)), *engine.finish(), *engine.hindsight()]
    return [(name, column) for part in parts for name, column in part.items()]


@pytest.mark.parametrize("settings", [Settings(), Settings(identifier="paper")])
def test_threads_change_no_bit(monkeypatch, settings):
    log = synthesise("random", seed=3, duration_s=30, sensors=SENSORS).log
    both = rows_of(log, settings)
    monkeypatch.setattr(beside, "LEAST_ROWS", 10**9)
    for (name, column), (same, expected) in zip(both, rows_of(log, settings), strict=True):
        assert name == same
        assert np.array_equal(column, expected, equal_nan=column.dtype.kind == "f"), name


def test_few_rows_stay_in_the_callers_thread():
    thread = Beside()
    assert thread.begin(lambda _: threading.get_ident(), 0, LEAST_ROWS - 1)() == threading.get_ident()
    assert thread.begin(lambda _: threading.get_ident(), 0, LEAST_ROWS)() != threading.get_ident()


@pytest.mark.parametrize("n", [1, LEAST_ROWS])
def test_an_error_reaches_the_caller(n):
    def fails(_):
        raise ValueError("diverged")

    with pytest.raises(ValueError, match="diverged"):
        Beside().begin(fails, 0, n)()
