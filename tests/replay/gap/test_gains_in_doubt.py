"""What looks like a gain on a drive is no finding beside a calibrated base model."""

from dataclasses import replace

import numpy as np
import pytest

from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.gains_in_doubt import with_gains_in_doubt
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

ROBOT = RobotParameters(wheel_radius_m=0.1, half_track_m=0.2, alpha=0.5, alpha_yaw=0.8)
SETTINGS = GateSettings()
KNOWN_TO = {"payload": 0.01, "drive_gain": 0.01, "yaw_inertia": 0.02, "slope": 0.003, "wheel_coulomb": 0.005}
STEADY = Extension(base_of(ROBOT), {}, 0.1, misfit=KNOWN_TO)


def drive(speed_mps, sum_nm, apart_nm=0.0):
    """A straight drive of 20 s at 50 Hz at a speed, with the given sum and difference of the torques."""
    t_s = np.arange(0.0, 20.0, 0.02)
    t_ns = np.rint(t_s * 1e9).astype(np.int64)
    still, unknown = np.zeros_like(t_s), np.full_like(t_s, np.nan)
    left, right = (np.full_like(t_s, (sum_nm + sign * apart_nm) / 2) for sign in (-1, 1))
    pose = PoseTrack(t_ns, speed_mps * t_s, still, still)
    return Log(pose, TorqueTrack(t_ns, left, right, unknown, unknown))


@pytest.mark.parametrize(
    ("sum_nm", "left_nm", "looks_like"), [(0.4, 0.005, 0.05), (4.0, 0.005, 0.005), (0.4, 0.05, 0.06)]
)
def test_a_friction_that_is_left_looks_like_a_gain_the_less_torque_a_drive_takes(sum_nm, left_nm, looks_like):
    """Twice .005 N·m on both wheels, .01 m/s², are 5 % of .5 · .4 = .2 m/s²; of more, .012 m/s² count."""
    left = replace(STEADY, misfit={**KNOWN_TO, "wheel_coulomb": left_nm})
    wider = with_gains_in_doubt(left, bin_log(drive(0.5, sum_nm), SETTINGS)).misfit
    assert wider["payload"] == wider["drive_gain"] == pytest.approx(0.01 + looks_like, rel=0.02)
    assert (wider["yaw_inertia"], wider["slope"]) == (0.02, 0.003)


def test_a_held_term_of_the_torques_leaves_their_gain_open():
    """.1 effort_sum |v| at .5 m/s beside .5 effort_sum is 10 %; in yaw .08 effort_diff beside .8 is 10 %."""
    ahead = ("unnamed:longitudinal:effort_sum*abs(v)", {"coefficient": 0.1})
    turning = ("unnamed:yaw:effort_diff*abs(v)", {"coefficient": 0.16})
    log = drive(0.5, 40.0, apart_nm=1.0)
    wider = with_gains_in_doubt(replace(STEADY, known=(ahead, turning)), bin_log(log, SETTINGS)).misfit
    assert wider["payload"] == pytest.approx(0.01 + 0.1, abs=0.002)
    assert wider["yaw_inertia"] == pytest.approx(0.02 + 0.1, abs=0.002)
    no_torque = ("unnamed:longitudinal:v*v*v", {"coefficient": 0.1})
    other = with_gains_in_doubt(replace(STEADY, known=(no_torque,)), bin_log(log, SETTINGS))
    assert other.misfit == with_gains_in_doubt(STEADY, bin_log(log, SETTINGS)).misfit


def test_an_uncalibrated_base_model_is_taken_as_it_is():
    bare = replace(STEADY, misfit={})
    assert with_gains_in_doubt(bare, bin_log(drive(0.5, 0.4), SETTINGS)) is bare
