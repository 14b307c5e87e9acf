"""The filter bank starts again where it diverges and where a step is too long, whatever the batches."""

import numpy as np
import polars as pl
import pytest

from wmr_replay.identify.filter_bank import model
from wmr_replay.pipeline.memory import as_batch
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack
from wmr_synth import Sensors, synthesise

SENSORS = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
AT_S = 6.0


@pytest.fixture(scope="module")
def log():
    """10 s of driving."""
    return synthesise("random", seed=5, duration_s=10, sensors=SENSORS).log


def failing(real, at_s, how):
    """``run_bins`` that diverges in the bin at a time; the bins' times are counted from the bank's start."""

    def run_bins(hypotheses, values, seconds, *others):
        hit = (seconds > at_s - 0.011) & (seconds <= at_s + 0.009)
        if hit.any() and how is not None:
            hypotheses.mean[:] = 7.0  # what the kernel leaves behind when it is left by an exception
            raise how
        found = real(hypotheses, values, seconds, *others)
        found.posterior[:, hit] = np.nan
        return found

    return run_bins


@pytest.mark.parametrize("how", [ZeroDivisionError(), None], ids=["exception", "nan"])
def test_a_bin_that_cannot_be_followed_costs_a_new_start_and_no_crash(log, log_rows, monkeypatch, how):
    rows = log_rows(log)
    clean = rows.samples()
    monkeypatch.setattr(model, "run_bins", failing(model.run_bins, 6.0, how))
    whole = rows.samples()
    pieces = rows.samples(cuts=range(0, rows.n, 37))
    assert whole.equals(pieces)
    decided, was = (table["p_ideal"].is_not_null().to_numpy() for table in (whole, clean))
    lost = np.flatnonzero(was & ~decided)
    assert len(lost) == pytest.approx(31, abs=3)  # the bin itself, and 30 for the first fit
    assert whole[: int(lost[0])].equals(clean[: int(lost[0])])
    assert decided[int(lost[-1]) + 1 :].all()


def with_pauses(log, n_pauses, pause_s):
    """The log with pauses between its rows from 6 s on."""

    def later(t_ns):
        steps = np.clip((t_ns - log.pose.t_ns[0]) * 1e-9 - AT_S, 0, n_pauses * 0.02) / 0.02
        return t_ns + np.floor(steps).astype(np.int64) * round(pause_s * 1e9)

    pose, torque = log.pose, log.torque
    return Log(
        PoseTrack(later(pose.t_ns), pose.x_m, pose.y_m, pose.yaw_rad),
        TorqueTrack(later(torque.t_ns), *list(vars(torque).values())[1:]),
        None,
        log.robot,
    )  # fmt: skip


def test_a_step_of_years_takes_no_longer_than_one_of_a_minute(log, log_rows):
    table = log_rows(with_pauses(log, 1, 3e8)).samples()
    assert len(table) == len(as_batch(log).pose)
    before = table["t_s"] < AT_S - 0.1
    assert table.filter(before).equals(
        log_rows(log)
        .samples()
        .drop("mode_true")
        .filter(before)
        .with_columns(pl.lit(None, pl.Int8).alias("mode_true"))
        .select(table.columns)
    )
