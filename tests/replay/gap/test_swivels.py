"""Friction in the swivels of casters: by hand, and on a robot whose casters are simulated here.

The robot's oracle turns the forks themselves: each trails its pin, rolls without slipping sideways, and its
swivel takes a dry torque. Nothing of it is the form that the analysis has.
"""

import math
from functools import lru_cache

import numpy as np
import pytest
from tests.replay.gap.plain_loop import seen_precisely

from wmr_replay.effects.swivels import by_swivels
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap import calibrate
from wmr_replay.gap.model.candidates import EVERY, LIBRARY
from wmr_replay.identify.terms import Moving, Terms, extra_accelerations
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log

S0 = 0.1
ALPHA, ALPHA_YAW, L, STEP_S, ROWS = 0.1, 0.12, 0.25, 0.001, 9000
TRAIL_M, CREEP_RADPS = 0.03, 0.02
ROBOT = RobotParameters(half_track_m=L, wheel_radius_m=0.1)


def theta(size=S0):
    """A model with that friction alone."""
    found = np.zeros(N_THETA)
    found[Theta.SWIVEL] = size
    return found


@pytest.mark.parametrize(
    ("free", "v", "w", "added"),
    [
        ((0.0, 0.5), 1.0, 0.0, -S0),  # a torque that overcomes it
        ((0.0, -0.5), 1.0, 0.0, S0),
        ((0.0, 0.5), -1.0, 0.0, -S0),  # in reverse it holds as well
        ((0.0, 0.5), 0.0, 1.0, 0.0),  # on the spot nothing changes its direction
        ((0.5, 0.5), 1.0, 1.0, 0.0),  # nor do v and w that gain alike
        ((0.5, 0.0), 1.0, 1.0, S0 / math.sqrt(2)),  # gaining speed alone would straighten the curve
    ],
)
def test_it_holds_the_direction_of_motion(free, v, w, added):
    assert by_swivels(free, v, w, theta()) == pytest.approx(added, abs=0.003)


def test_it_takes_no_more_than_keeps_the_direction():
    for asked in np.linspace(0.0, 0.05, 6):
        left = asked + by_swivels((0.0, asked), 1.0, 0.0, theta())
        assert 0.0 <= left <= 0.25 * asked + 1e-12


def test_an_identifier_applies_it_to_what_the_torques_ask_for():
    at = Moving(1.0, 0.0, 0.0, 0.0, 0.0, 4.0)
    _, _, turning = extra_accelerations(at, ALPHA, ALPHA_YAW, Terms(theta(), L))
    assert turning * L == pytest.approx(by_swivels((0.0, 4.0 * ALPHA_YAW), 1.0, 0.0, theta()))


def test_a_base_model_may_hold_it_and_no_analysis_names_it():
    held_alone = {one.name for one in EVERY} - {one.name for one in LIBRARY}
    assert held_alone == {"swivel_friction", "support_friction"}


@lru_cache
def on_casters(friction_mps2: float) -> Log:
    """90 s of a robot with a caster ahead and one behind, at 100 Hz, poses to 1 mm and 1 mrad."""
    rng, n = np.random.default_rng(8), ROWS * 10
    v = w = 0.0
    pose, forks = np.zeros(3), [0.0, 0.0]
    poses, torques = np.empty((3, ROWS)), np.empty((2, ROWS))
    wanted = np.zeros(2)
    for k in range(n):
        if k % 4000 == 0:
            wanted = np.array([rng.uniform(0.3, 1.2), rng.uniform(-0.25, 0.25)])
        if k % 10 == 0:
            asked = 1.5 * (wanted[0] - v) / ALPHA, 2.0 * (wanted[1] - w) / ALPHA_YAW
            poses[:, k // 10], torques[:, k // 10] = (
                pose,
                ((asked[0] - asked[1]) / 2, (asked[0] + asked[1]) / 2),
            )
        push = 0.0
        for i, side in enumerate((1.0, -1.0)):
            across = v * math.sin(forks[i]) - side * w * math.cos(forks[i])
            turning = -across / TRAIL_M
            forks[i] += STEP_S * turning
            push -= side * math.cos(forks[i]) * friction_mps2 / 2 * math.tanh(turning / CREEP_RADPS)
        v += STEP_S * ALPHA * asked[0]
        turned = w
        w += STEP_S * (ALPHA_YAW * asked[1] + push)
        at = pose[2] + turned / L * STEP_S / 2
        pose = pose + STEP_S * np.array([v * math.cos(at), v * math.sin(at), (turned + w) / 2 / L])
    return seen_precisely(poses, torques, rng, ROBOT)


def test_a_calibration_finds_the_yaw_gain_of_a_robot_whose_casters_turn_hard():
    found = calibrate(on_casters(0.08), ROBOT)
    held = {one.name: one.parameters for one in found.effects}
    assert found.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.1)
    assert held["swivel_friction"]["s0_mps2"] == pytest.approx(0.08, rel=0.2)


def test_casters_that_turn_freely_are_not_held():
    found = calibrate(on_casters(0.0), ROBOT)
    assert found.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.02)
    assert "swivel_friction" not in {one.name for one in found.effects}


def test_alpha_yaw_beside_a_friction_of_swivels_is_known_no_better_than_its_form():
    found = calibrate(on_casters(0.08), ROBOT)
    assert found.misfit["yaw_inertia"] == pytest.approx(0.12)
    assert calibrate(on_casters(0.0), ROBOT).misfit["yaw_inertia"] < 0.03
