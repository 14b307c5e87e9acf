"""Every lasting effect as the analysis predicts it against a drive integrated step by step elsewhere."""

import numpy as np
import pytest
from tests.replay.made_up_wheels import ROBOT, drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.predict import composed, summed
from wmr_replay.gap.wheel_speed.windows import gaps_of, windows_of

SIZES = {
    "wheel_scale": {"ratio": -0.1},
    "wheel_scale_difference": {"ratio": 0.02},
    "effective_track": {"ratio": 0.4},
    "wide_turn_scrub": {"ratio": 0.3},
    "icr_offset": {"offset_m": 0.15},
    "lateral_slip": {"seconds": 0.2},
    "turning_slip": {"s_per_m": 0.8},
    "slip_ratio": {"seconds": 0.06},
    "pose_delay": {"delay_s": 0.12},
    "slope_slip": {"x_mps": 0.05, "y_mps": -0.03},
    "heading_misalignment": {"angle_rad": 0.1},
    "pose_lever_arm": {"x_m": 0.3, "y_m": -0.2},
    "yaw_drift": {"rate_radps": 0.01},
    "slip_interval": {"start_s": 20.0, "end_s": 30.0, "loss": 0.4},
}


def gap_of(log, effects):
    """The largest gap of a window [m, rad] with effects in the model."""
    problem = problem_of([log], base_of(ROBOT, None), GapOptions(), "wheel_speed")
    errors = gaps_of(problem, windows_of(problem, 4.0), effects, (0.001, 0.001)).errors
    return errors.position_m.max(), errors.yaw_rad.max()


@pytest.mark.parametrize("name", [None, *SIZES])
def test_the_predicted_path_is_that_of_an_integration_elsewhere(name):
    effects = {} if name is None else {name: SIZES[name]}
    log = drive(effects, seed=3)

    position, yaw = gap_of(log, effects)

    assert position < 0.004
    assert yaw < 0.004
    if name is not None:
        without = gap_of(log, {})
        assert max(without[0] / 0.004, without[1] / 0.004) > 2


def test_ratios_of_one_effect_multiply_and_other_parameters_add_up():
    both = summed({"effective_track": {"ratio": 0.5}}, {"effective_track": {"ratio": -0.2}})

    assert both["effective_track"]["ratio"] == pytest.approx(1.5 * 0.8 - 1)
    assert composed("icr_offset", "offset_m", 0.1, 0.2) == pytest.approx(0.3)
    assert composed("speed_saturation", "limit_mps", 1.0, 0.8) == 0.8
    log = drive({"effective_track": {"ratio": 0.2}}, seconds=30.0)
    apart = summed({"effective_track": {"ratio": 0.5}}, {"effective_track": {"ratio": -0.2}})
    np.testing.assert_allclose(gap_of(log, apart), gap_of(log, {"effective_track": {"ratio": 0.2}}))
