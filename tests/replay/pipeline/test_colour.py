"""Intervals of a log's motion under white and under coloured noise: what changes, and from which row on."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from wmr_replay.differentiate import KernelSpec, uniform_taps
from wmr_replay.identify import Motion
from wmr_replay.jobs.replay import MemorySource, Replay
from wmr_replay.pipeline.colour import Found, PoseColour
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.signals import PoseTrack
from wmr_synth import Sensors, synthesise
from wmr_synth.hidden.disturbance import unit_ou

SD_M, SD_RAD, N = 0.01, 0.005, 3001
WIDTHS = [f"{name}_sd" for name in Motion._fields if f"{name}_sd" in Motion._fields]
WIDTHS += ["c_k_mps_sd", "c_d_mps2_sd"]


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
        for name in ("widen", "shown"):
            patch.setattr(PoseColour, name, lambda self, motion, *rest: motion)
        patch.setattr(PoseColour, "as_white", lambda self, variances, which: variances)
        return tables(log)[0]


def test_under_white_noise_only_intervals_change_and_hold_the_bias_of_the_window(exact, monkeypatch):
    log = measured(exact, 5 * white())
    samples, without = tables(log)[0], plain(log, monkeypatch)
    widths = [name for name in samples.columns if name in WIDTHS]
    assert len(widths) == len(WIDTHS)
    assert samples.drop(widths).equals(without.drop(widths))
    for name in widths:
        known = samples[name].is_not_null()
        assert (samples[name].filter(known) > without[name].filter(known)).all()
    motion = exact.truth
    about_s = samples["t_s"].to_numpy() - samples["delay_s"].to_numpy()
    known = np.isfinite(about_s)
    off = samples["yaw_rate_radps"].to_numpy() - np.interp(about_s, motion.t_ns / 1e9, motion.yaw_rate_radps)
    held, before = (
        np.mean(np.abs(off) < 1.96 * table["yaw_rate_radps_sd"].to_numpy(), where=known)
        for table in (samples, without)
    )
    assert before < 0.85
    assert held > 0.9


def test_before_anything_is_known_a_window_errs_as_the_usual_motion_makes_it():
    """Acceleration of x as a random walk of .25 (m/s²)²/s, without noise."""
    spec, n_taps, step_s = KernelSpec(2), 61, 0.01
    steps = np.random.default_rng(6).normal(0.0, np.sqrt(0.25 * step_s), 200_000)
    acceleration = np.cumsum(steps)
    speed = np.cumsum(acceleration) * step_s
    off = np.convolve(np.cumsum(speed) * step_s, uniform_taps(spec, n_taps, step_s)[1], "valid")
    off -= (speed[30:-30] + speed[31:-29]) / 2
    foretold = Found().shown_of_kernel(spec, n_taps, step_s)[0].biases[1]
    assert foretold == pytest.approx(np.mean(off**2), rel=0.1)


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
