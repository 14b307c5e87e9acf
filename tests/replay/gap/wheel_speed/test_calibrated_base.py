"""What a calibration knows of a base model on wheel speeds, and from where on a log contradicts it."""

from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap.settings.wheel_speed import GateSettingsWheelSpeed, WheelSpeedSettings
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.disagreement import KINDS, least_size
from wmr_replay.gap.wheel_speed.estimate import Fit
from wmr_replay.gap.wheel_speed.evidence import p_value, within_calibration
from wmr_replay.gap.wheel_speed.predict import Parameter
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.robot import RobotParameters

OWN = GateSettingsWheelSpeed()
OWN_TIME = WheelSpeedSettings().disagreement
ROBOT = RobotParameters(wheel_radius_m=0.1, half_track_m=0.25)


def fitted(ratio: float, sd: float) -> SimpleNamespace:
    """A fit of the track alone."""
    which = Parameter("effective_track", "ratio")
    return SimpleNamespace(parameters=(which,), sd=[sd], values={"effective_track": {"ratio": ratio}})


@pytest.mark.parametrize(("ratio", "within"), [(0.09, True), (-0.09, True), (0.11, False), (-0.11, False)])
def test_a_track_differs_from_its_calibration_beyond_both_deviations(ratio, within):
    """√((1.5 · .02)² + .025²) · 2.6 = .1015."""
    base_sd = {"effective_track": {"ratio": 0.02}}
    assert within_calibration(base_sd, fitted(ratio, 0.025), "effective_track", OWN) is within
    assert not within_calibration({}, fitted(ratio, 0.025), "effective_track", OWN)


@pytest.mark.parametrize(("kind", "least"), [(4, OWN_TIME.least_push), (1, OWN_TIME.least_slip), (5, 0.39)])
def test_a_track_of_an_interval_s_own_differs_by_more_than_the_calibration_leaves_open(kind, least):
    """2.6 · 1.5 · .1 = .39 of the yaw rate."""
    settings = WheelSpeedSettings()
    problem = SimpleNamespace(settings=settings, base_sd={"effective_track": {"ratio": 0.1}})
    assert least_size(problem, KINDS[kind]) == pytest.approx(least)
    assert least_size(SimpleNamespace(settings=settings, base_sd={}), KINDS[5]) == OWN_TIME.least_slip


def test_deviations_are_those_of_the_model_file():
    effects = (
        Effect("effective_track", {"ratio": 0.3}, {"ratio": 0.02}),
        Effect("wheel_scale", {"ratio": 0.1}),
    )
    base = base_of(ROBOT, Model(robot=ROBOT, effects=effects))
    assert base.values_sd == {"effective_track": {"ratio": pytest.approx(0.02 / 1.3)}}  # of another one
    assert set(base.values) == {"effective_track", "wheel_scale"}


@pytest.mark.parametrize(("step_s", "significant"), [(0.05, False), (0.01, True)])
def test_the_stamps_of_slow_wheel_speeds_are_part_of_a_test(step_s, significant):
    """A stamp belongs to any instant of its step: 14 ms of 50, in which a slip of 30 ms is hardly two."""
    which, tiny = Parameter("slip_ratio", "seconds"), np.array([[1e-8]])
    fit = Fit(
        (which,), {"slip_ratio": {"seconds": 0.03}}, None, 0.0, 1 / tiny, tiny, 60, step_s / np.sqrt(12)
    )
    assert (p_value(fit, "slip_ratio", 10) < OWN.level) is significant
    assert fit.sd == pytest.approx([step_s / np.sqrt(12)], rel=0.2)
