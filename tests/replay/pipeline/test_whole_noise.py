"""The second pass's variances: those of the first, with the colour that the whole log shows."""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.signals import PoseTrack
from wmr_synth import Sensors, synthesise
from wmr_synth.hidden.disturbance import unit_ou

SD_M, SD_RAD, WOBBLE_S, STEP_S = 0.02, 0.01, 0.1, 0.01
HIDES = 2 * WOBBLE_S / (1 + (WOBBLE_S / 0.2) ** 2) / STEP_S
"""White noise over one step that is as dense at 1/(.2 s) as a wobble of unit variance."""


def second_pass(share):
    """Half a minute at 100 Hz; ``share`` of the variance of the pose's noise wobbles."""
    made = synthesise("figure-eight", seed=4, duration_s=30.0, sensors=Sensors(100.0, 100.0, 0.0, 0.0))
    pose, rng = made.log.pose, np.random.default_rng(8)
    n = len(pose.t_ns)
    slow = unit_ou(np.full(n - 1, STEP_S / WOBBLE_S), rng).T
    noise = np.sqrt(share) * slow + np.sqrt(1 - share) * rng.normal(0.0, 1.0, (3, n))
    noise *= np.array([[SD_M], [SD_M], [SD_RAD]])
    track = PoseTrack(pose.t_ns, pose.x_m + noise[0], pose.y_m + noise[1], pose.yaw_rad + noise[2])
    log = replace(made.log, pose=track)
    engine = Engine(Settings(), ReplayModel(log.robot))
    engine.push(as_batch(log))
    engine.finish()
    return engine._chain.second_pass()


def variances(second):
    """Variances of rows in the first pass and in the second, (2, m) each: of x and of yaw."""
    bins = list(second._record.bins())
    told = [second._noise.told(part) for part in bins]
    return [2 * np.concatenate([part.values[[3, 5]] for part in parts], axis=1) for parts in (bins, told)]


def test_a_wobble_counts_from_the_first_bin_on():
    """Within a factor of 3: in half a minute motion and a wobble are told apart no better."""
    before, told = variances(second_pass(0.5))
    truth = np.array([[SD_M**2], [SD_RAD**2]]) * (0.5 + 0.5 * HIDES)
    first = slice(0, 75)
    early, late = (np.abs(np.log(np.median(part[:, first] / truth, axis=1))) for part in (before, told))
    assert (early > np.log(3.0)).all()
    assert (late < np.log(3.0)).all()
    assert told[:, -1] == pytest.approx(before[:, -1], rel=0.5)


def test_white_noise_stays_as_it_is():
    _, told = variances(second_pass(0.0))
    assert np.median(told, axis=1) == pytest.approx([SD_M**2, SD_RAD**2], rel=0.15)


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_no_variance_becomes_smaller(share):
    before, told = variances(second_pass(share))
    assert (told >= before).all()
