"""Commands and measured wheel speeds in short stretches: drive told by the wheels, chassis by the path.

The oracle is a campaign of steps of its own: the drive's limits act at 1 kHz on the body's speeds.
"""

import numpy as np
import pytest
from tests.replay.made_up_wheels import HALF_TRACK_M, RADIUS_M, ROBOT, motion

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds, problem_of
from wmr_replay.gap.wheel_speed.base import base_of
from wmr_replay.gap.wheel_speed.candidates import at_its_bound, candidates_of, parameters_of
from wmr_replay.gap.wheel_speed.drive_fit import drive_of
from wmr_replay.gap.wheel_speed.estimate import fit
from wmr_replay.gap.wheel_speed.select import Search, select
from wmr_schemas.signals import CommandTrack, Log, PoseTrack, WheelSpeedTrack

STEP_S, STRETCH_S, REST_S = 1e-3, 2.5, 2.0
LAG_S, GAIN, TURN_RADPS, TURN_RADPS2 = 0.15, 1.25, 1.1, 1.5
CHASSIS = {"effective_track": {"ratio": 0.6}, "icr_offset": {"offset_m": -0.1}}


def driven(wanted, start, limited):
    """Body speeds (2, n), ahead and yaw rate, of a drive that follows ``wanted`` (2,) from ``start`` (2,)."""
    out, turn, now = np.empty((2, round(STRETCH_S / STEP_S))), start[1], np.array(start)
    goal = GAIN * np.asarray(wanted)
    if limited:
        goal[1] = np.clip(goal[1], -TURN_RADPS, TURN_RADPS)
    for k in range(out.shape[1]):
        most = TURN_RADPS2 * STEP_S if limited else np.inf
        turn += np.clip(goal[1] - turn, -most, most)
        now = now + (np.array([goal[0], turn]) - now) * STEP_S / LAG_S
        out[:, k] = now
    return out


def wheels_of(body):
    """Wheel speeds (2, n) in rad/s of body speeds, by the nominal lengths."""
    return np.stack([body[0] - HALF_TRACK_M * body[1], body[0] + HALF_TRACK_M * body[1]]) / RADIUS_M


def campaign(*, limited, n=70, seed=0):
    """A log of ``n`` steps from one pair of speeds to the next, each a stretch with a frame of its own."""
    rng = np.random.default_rng(seed)
    poses, wheels, commands, breaks = [], [], [], []
    now = np.zeros(2)
    t_s = np.arange(round(STRETCH_S / STEP_S)) * STEP_S
    for k in range(n):
        wanted = np.array([rng.uniform(-0.8, 0.8), rng.uniform(-1.6, 1.6)])
        body, at_s = driven(wanted, now, limited), 5.0 + k * (STRETCH_S + REST_S)
        turned = wheels_of(body)
        path = motion(t_s, turned, CHASSIS) + rng.normal(0, [0.002, 0.002, 0.002], (len(t_s), 3))
        poses.append(np.column_stack([at_s + t_s, path])[::50])
        wheels.append(np.column_stack([at_s + t_s, *(turned + rng.normal(0, 0.02, turned.shape))])[::20])
        commands.append([[at + at_s, *wheels_of(wanted[:, None])[:, 0]] for at in t_s[::50]])
        breaks.append(at_s)
        now = body[:, -1]
    columns = [np.concatenate(poses).T, np.concatenate(wheels).T, np.concatenate(commands).T]
    (pose_ns, *pose), (wheel_ns, *wheel), (command_ns, *command) = (
        (np.round(c[0] * 1e9).astype(np.int64), *np.ascontiguousarray(c[1:])) for c in columns
    )
    return Log(
        PoseTrack(pose_ns, *pose),
        robot=ROBOT,
        wheels=WheelSpeedTrack(wheel_ns, *wheel),
        commands=CommandTrack(command_ns, *command),
        breaks_ns=tuple(round(b * 1e9) for b in breaks[1:]),
    )


def told(log):
    """The drive that the wheels of a log show."""
    options, base = GapOptions(), base_of(ROBOT, None)
    commanded, measured = (problem_of([log], base, options, by) for by in ("command", "wheel_speed"))
    drive = tuple(one for one in candidates_of(commanded.record) if one.needs_commands)
    return drive_of(commanded, measured.record, drive, commanded.settings.drive)


@pytest.mark.slow
def test_the_wheels_tell_the_limits_of_a_drive_and_nothing_else():
    found = told(campaign(limited=True))

    assert set(found) >= {"drive_gain", "actuator_lag", "turn_saturation", "turn_acceleration_limit"}
    assert found["drive_gain"]["ratio"] == pytest.approx(GAIN - 1, abs=0.02)
    assert found["actuator_lag"]["time_constant_s"] == pytest.approx(LAG_S, abs=0.03)
    assert found["turn_saturation"]["limit_radps"] == pytest.approx(TURN_RADPS, rel=0.03)
    assert found["turn_acceleration_limit"]["limit_radps2"] == pytest.approx(TURN_RADPS2, rel=0.1)
    assert set(told(campaign(limited=False))) == {"drive_gain", "actuator_lag"}


@pytest.mark.slow
def test_commands_name_the_drive_and_the_chassis_of_a_campaign():
    result = analyse_wheel_speeds(
        [campaign(limited=True)], None, GapOptions(max_effects=8), driven_by="command"
    )

    names = {effect.name for effect in result.effects}
    assert names >= {"effective_track", "icr_offset", "turn_saturation", "actuator_lag"}
    (track,) = (effect for effect in result.effects if effect.name == "effective_track")
    assert track.parameters["ratio"].value == pytest.approx(0.6, abs=0.06)
    assert result.odometry.yaw_rms_after_rad < 0.15 * result.odometry.yaw_rms_before_rad


def test_a_search_goes_on_beside_what_it_begins_with():
    problem = problem_of([campaign(limited=False, n=40)], base_of(ROBOT, None), GapOptions(), "wheel_speed")
    values = {"effective_track": CHASSIS["effective_track"]}
    track = fit(problem, parameters_of("effective_track"), values)
    begin = Search(problem, track, candidates_of(problem.record), [], tuple(values))
    assert {one.name for one in select(problem, 1, begin=begin).found} == set(CHASSIS)


@pytest.mark.parametrize(
    ("name", "values", "at_end"),
    [
        ("effective_track", {"ratio": 9.0}, True),
        ("effective_track", {"ratio": 0.4}, False),
        ("actuator_lag", {"time_constant_s": 0.0}, False),
    ],
)
def test_a_size_at_the_end_of_its_range_is_none(name, values, at_end):
    assert at_its_bound({name: values}, name) is at_end
