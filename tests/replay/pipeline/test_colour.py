"""Intervals of a log's motion under white and under coloured noise: what changes, and from which row on."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from wmr_replay.jobs.replay import MemorySource, Replay
from wmr_replay.pipeline.colour import PoseColour
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.signals import PoseTrack
from wmr_synth import Sensors, synthesise
from wmr_synth.hidden.disturbance import unit_ou

SD_M, SD_RAD, N = 0.01, 0.005, 3001


@pytest.fixture(scope="module")
def exact():
    """Half a minute at 100 Hz with an exact pose, and its truth."""
    return synthesise("figure-eight", seed=3, duration_s=30.0, sensors=Sensors(100.0, 100.0, 0.0, 0.0))


def measured(made, noise):
    pose, scale = made.log.pose, np.array([[SD_M], [SD_M], [SD_RAD]])
    noise = scale * noise
    track = PoseTrack(pose.t_ns, pose.x_m + noise[0], pose.y_m + noise[1], pose.yaw_rad + noise[2])
    return replace(made.log, pose=track)


def white():
    return np.random.default_rng(5).normal(0.0, 1.0, (3, N))


def wobbling():
    return unit_ou(np.full(N - 1, 0.01 / 0.2), np.random.default_rng(5)).T


def tables(log):
    replay = Replay(MemorySource(log, "log"), Engine(Settings(identifier="paper"), ReplayModel(log.robot)))
    return pl.concat(replay.samples()), pl.concat(replay.hindsight())


def plain(log, monkeypatch):
    """The samples table without any look at the noise's colour."""
    with monkeypatch.context() as patch:
        patch.setattr(PoseColour, "widen", lambda self, motion, *rest, **always: motion)
        patch.setattr(PoseColour, "as_white", lambda self, variances, which: variances)
        return tables(log)[0]


def test_white_noise_changes_no_bit_of_the_samples_and_hindsight_adds_the_bias(exact, monkeypatch):
    log = measured(exact, white())
    samples, later = tables(log)
    assert samples.equals(plain(log, monkeypatch))
    both = later.drop_nulls("v_long_mps_sd")["v_long_mps_sd"].mean()
    assert both > 1.01 * samples.drop_nulls("v_long_mps_sd")["v_long_mps_sd"].mean()


def test_a_wobble_widens_the_intervals_until_they_hold(exact, monkeypatch):
    log = measured(exact, wobbling())
    samples, without = tables(log)[0], plain(log, monkeypatch)
    motion, rows = exact.truth, samples["t_s"].to_numpy() > 4.0
    about_s = samples["t_s"].to_numpy() - samples["delay_s"].to_numpy()
    off = samples["v_long_mps"].to_numpy() - np.interp(about_s, motion.t_ns / 1e9, motion.v_long_mps)
    assert np.mean(np.abs(off[rows]) < 1.96 * without["v_long_mps_sd"].to_numpy()[rows]) < 0.5
    assert np.mean(np.abs(off[rows]) < 1.96 * samples["v_long_mps_sd"].to_numpy()[rows]) > 0.85
    assert samples["v_long_mps"].equals(without["v_long_mps"])


def test_a_row_depends_on_earlier_rows_alone(exact):
    log = measured(exact, wobbling())
    k = 1777
    pose = PoseTrack(*(column[:k] for column in vars(log.pose).values()))
    part, whole = tables(replace(log, pose=pose))[0], tables(log)[0]
    names = [
        name for name in whole.columns if name.endswith("_sd") and name.split("_")[0] in ("v", "a", "yaw")
    ]
    assert part.select(names)[:k].equals(whole.select(names)[:k])
