"""Supports that drag, and what weighs on tyres: by hand, and on a robot whose balls are simulated here.

The robot's oracle adds up the dry forces at two points that slide along with the body. It has neither the
form that the analysis fits nor its distance from the axle.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from tests.replay.gap.plain_loop import seen_precisely

from wmr_replay.effects.motion import Carried, by_supports, with_body_effects
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap import calibrate
from wmr_replay.gap.estimation.calibrate import beside_parameters
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.dry_turning import open_by_form
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack

P0, D0 = 0.2, 0.3
ALPHA, ALPHA_YAW, L, STEP_S, ROWS = 0.1, 0.12, 0.25, 0.001, 9000
AHEAD_M, BEHIND_M, CREEP_MPS = 0.3, -0.28, 0.003
ROBOT = RobotParameters(half_track_m=L, wheel_radius_m=0.1)


def theta(**sizes):
    """θ with places by name."""
    found = np.zeros(N_THETA)
    for name, size in sizes.items():
        found[Theta[name]] = size
    return found


@pytest.mark.parametrize(
    ("v", "w", "added"),
    [
        (1.0, 0.0, (-P0, 0.0)),
        (-1.0, 0.0, (P0, 0.0)),
        (0.0, 1.0, (0.0, -D0)),
        (0.6, -0.8, (-0.6 * P0, 0.8 * D0)),  # along the way that it goes
    ],
)
def test_a_support_drags_against_its_way(v, w, added):
    found = by_supports(v, w, Carried(1.0, 1.0), theta(SUPPORT=P0, SUPPORT_YAW=D0))
    assert found == pytest.approx(added, abs=1e-3)


@pytest.mark.parametrize("place", ["SCRUB", "SUPPORT_YAW"])
def test_a_weight_at_the_centre_makes_tyres_and_supports_hold_a_turn_more_and_an_inertia_less(place):
    """By hand: a torque μ N a over an inertia I grows by the weight's share and falls by that of I."""

    def turned(load, **sizes):
        given = with_body_effects((0.0, 0.0), 0.0, (1.0, 4.0), 0.0, Carried(0.0, load), theta(**sizes))
        return given[1]

    alone = turned(1.0, **{place: D0})
    assert alone == pytest.approx(-D0, rel=1e-3)
    assert turned(1.0, **{place: D0}, MASS_RATIO=0.3) == pytest.approx(1.3 * alone)
    assert turned(1.0, **{place: D0}, YAW_INERTIA=0.25) == pytest.approx(alone / 1.25)
    assert turned(1.2, **{place: D0}) == pytest.approx(1.2 * alone)


def test_what_became_of_the_gains_is_taken_out_of_what_the_weight_holds():
    """By hand: at the gains of a payload of .2 and an inertia of .25, d₀ is that of the robot so loaded."""
    base = base_of(ROBOT.overridden_by(RobotParameters(alpha=ALPHA, alpha_yaw=ALPHA_YAW)))
    fitted = {
        "payload": {"mass_ratio": 0.2},
        "yaw_inertia": {"ratio": 0.25},
        "scrub_torque": {"d0_mps2": 0.1},
        "support_friction": {"p0_mps2": 0.3, "d0_mps2": 0.2},
        "viscous_drag": {"c1_per_s": 0.05},
    }
    held = beside_parameters(Extension(base, fitted))
    assert held["scrub_torque"]["d0_mps2"] == pytest.approx(0.1 * 1.2 / 1.25)
    assert held["support_friction"] == pytest.approx({"p0_mps2": 0.3, "d0_mps2": 0.2 * 1.2 / 1.25})
    assert held["viscous_drag"] == {"c1_per_s": 0.05}
    assert held.keys() == fitted.keys() - {"payload", "yaw_inertia"}


@lru_cache
def on_balls(friction_mps2: float) -> Log:
    """90 s of a robot with a ball ahead and one behind, at 100 Hz, poses to 1 mm and 1 mrad."""
    rng = np.random.default_rng(11)
    v = w = 0.0
    pose, wanted, asked = np.zeros(3), np.zeros(2), (0.0, 0.0)
    poses, torques = np.empty((3, ROWS)), np.empty((2, ROWS))
    for k in range(10 * ROWS):
        if k % 3000 == 0:
            wanted = np.array([rng.uniform(-0.6, 1.2), rng.uniform(-0.3, 0.3)])
        if k % 10 == 0:
            asked = 3.0 * (wanted[0] - v) / ALPHA, 4.0 * (wanted[1] - w) / ALPHA_YAW
            torques[:, k // 10] = (asked[0] - asked[1]) / 2, (asked[0] + asked[1]) / 2
            poses[:, k // 10] = pose
        push = twist = 0.0
        for arm_m in (AHEAD_M, BEHIND_M):
            across = arm_m * w / L
            speed = np.sqrt(v * v + across * across + CREEP_MPS**2)
            push -= friction_mps2 / 2 * v / speed
            twist -= friction_mps2 / 2 * across / speed * (arm_m / L) * (ALPHA_YAW / ALPHA)
        v += STEP_S * (ALPHA * asked[0] + push)
        turned = w
        w += STEP_S * (ALPHA_YAW * asked[1] + twist)
        at = pose[2] + turned / L * STEP_S / 2
        pose = pose + STEP_S * np.array([v * np.cos(at), v * np.sin(at), (turned + w) / 2 / L])
    return seen_precisely(poses, torques, rng, ROBOT)


def test_a_calibration_finds_the_gains_of_a_robot_on_balls_that_drag():
    found = calibrate(on_balls(0.2), ROBOT)
    held = {one.name: one.parameters for one in found.effects}
    assert found.robot.alpha == pytest.approx(ALPHA, rel=0.03)
    assert found.robot.alpha_yaw == pytest.approx(ALPHA_YAW, rel=0.05)
    assert held["support_friction"]["p0_mps2"] == pytest.approx(0.2, rel=0.1)
    by_hand = 0.2 * (AHEAD_M / L) ** 2 * ALPHA_YAW / ALPHA
    assert held["support_friction"]["d0_mps2"] == pytest.approx(by_hand, rel=0.25)


def test_balls_that_roll_are_not_held():
    found = calibrate(on_balls(0.0), ROBOT)
    assert "support_friction" not in {one.name for one in found.effects}
    assert found.misfit["yaw_inertia"] < 0.03


def test_alpha_yaw_is_known_no_better_than_the_form_of_what_takes_its_torques():
    """By hand, in a steady turn on the spot: the torques do nothing but hold the friction, all of them."""
    t_s, w = np.arange(2000) * 0.01, 0.2
    unknown, apart = np.full(2000, np.nan), np.full(2000, D0 / ALPHA_YAW / 2)
    t_ns = np.rint(1e9 * t_s).astype(np.int64)
    turning = PoseTrack(t_ns, 0 * t_s, 0 * t_s, w / L * t_s)
    log = Log(turning, TorqueTrack(t_ns, -apart, apart, unknown, unknown), None, ROBOT)
    base = base_of(ROBOT.overridden_by(RobotParameters(alpha=ALPHA, alpha_yaw=ALPHA_YAW)))
    seen = bin_log(log, GateSettings())
    for name, sizes in (
        ("support_friction", {"p0_mps2": P0, "d0_mps2": D0}),
        ("scrub_torque", {"d0_mps2": D0}),
    ):
        holding = Extension(base, {}, known=((name, sizes),))
        assert open_by_form(holding, seen, 0.25) == pytest.approx(0.25, rel=0.03)
    assert open_by_form(Extension(base), seen, 0.25) == 0.0


def test_a_stated_yaw_inertia_gives_way_to_the_one_that_alpha_yaw_says():
    """By hand: wheels of radius r turn an inertia I by l²/(r I); a data sheet's is about another point."""
    stated = replace(ROBOT, mass_kg=1 / (0.1 * ALPHA), yaw_inertia_kgm2=0.3)
    found = calibrate(on_balls(0.0), stated)
    inertia_kgm2 = L**2 / (0.1 * ALPHA_YAW)
    assert found.robot.yaw_inertia_kgm2 == pytest.approx(inertia_kgm2, rel=0.02)
    known_to = found.robot_sd["alpha_yaw"] / found.robot.alpha_yaw
    assert found.robot_sd["yaw_inertia_kgm2"] / inertia_kgm2 == pytest.approx(known_to, rel=0.05)
    assert calibrate(on_balls(0.0), ROBOT).robot.yaw_inertia_kgm2 is None
