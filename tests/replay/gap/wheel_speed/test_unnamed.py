"""Effects that no catalogue holds: a term of the dictionary, or the time at which they act."""

from dataclasses import replace

import numpy as np
import pytest
from tests.replay.made_up_wheels import RADIUS_M, drive

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds, problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.disagreement import ranks, visited
from wmr_replay.gap.wheel_speed.rolling import motion
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import PoseTrack, WheelSpeedTrack

OPTIONS = GapOptions(max_effects=8)
RTK = (0.01, 0.005)


def drooping(log, share):
    """Encoders that say more the faster the robot is: 1 + share |v|^1.3."""
    left, right = log.wheels.left_radps, log.wheels.right_radps
    more = share * np.abs(RADIUS_M * (left + right) / 2) ** 1.3 * (left + right) / 2
    return replace(log, wheels=WheelSpeedTrack(log.wheels.t_ns, left + more, right + more))


def towed(log, start_s, end_s, mps):
    """A pose that also slides to the left for some seconds."""
    pose = log.pose
    t_s = (pose.t_ns - pose.t_ns[0]) / 1e9
    slid = mps * ((t_s > start_s) & (t_s < end_s)) * np.diff(t_s, prepend=0.0)
    x = pose.x_m - np.cumsum(slid * np.sin(pose.yaw_rad))
    y = pose.y_m + np.cumsum(slid * np.cos(pose.yaw_rad))
    return replace(log, pose=PoseTrack(pose.t_ns, x, y, pose.yaw_rad))


def test_a_wheel_that_droops_with_speed_is_a_term_with_its_unit_and_an_interval():
    log = drooping(drive({}, noise=RTK, seed=21), 0.08)
    result = analyse_wheel_speeds([log], None, OPTIONS)

    assert result.verdict == "unnamed"
    first = result.effects[0]
    assert first.name.startswith("unnamed:v_long:v*")
    assert first.formula.startswith("v_long += coefficient·v·")
    low, high = first.parameters["coefficient"].ci95
    assert low < first.parameters["coefficient"].value < high < 0
    assert first.parameters["coefficient"].unit in ("s/m", "s²/m²")
    assert result.position.held_out.after < 0.5 * result.position.held_out.before
    again = analyse_wheel_speeds([log], result.model, OPTIONS)
    assert again.verdict == "nothing_missing"


def test_a_push_that_keeps_its_direction_is_said_with_its_time():
    result = analyse_wheel_speeds(
        [towed(drive({}, noise=(0.001, 0.002), seed=22, seconds=90.0), 30.0, 55.0, 0.025)], None, OPTIONS
    )

    assert result.verdict == "unnamed"
    assert not result.effects
    (when,) = result.where.intervals
    assert when.start_s == pytest.approx(30.0, abs=4.0)
    assert when.end_s == pytest.approx(55.0, abs=4.0)
    assert "to the left by 0.02" in result.sentence
    assert "no effect of the library explains" in result.sentence


def test_a_term_of_the_base_model_moves_it():
    log = drive({}, seed=23, seconds=20.0)
    effect = Effect("unnamed:v_lat:v*v*yaw_rate", {"coefficient": -0.2})
    base = base_of(log.robot, Model(robot=log.robot, effects=(effect,)))
    problem = problem_of([log], base, OPTIONS, "wheel_speed")
    rolled, pushed = (motion(problem.record, problem.chassis, e, 1) for e in ({}, problem.base))

    assert np.array_equal(pushed.ahead, rolled.ahead)
    assert pushed.left == pytest.approx(-0.2 * rolled.ahead**2 * rolled.yaw, abs=1e-12)


def test_ranks_and_visits():
    assert ranks(np.array([5.0, 1.0, 9.0])).tolist() == pytest.approx([0.0, -2 / 3, 2 / 3])
    t_s = np.arange(60) * 0.5
    x_m = np.where((t_s % 10.0) < 3.0, 0.5, 50.0 + 40 * t_s)
    assert any(inside.sum() == 18 for inside in visited(x_m, np.zeros(60) + 0.5, t_s, 2.0, 3))
