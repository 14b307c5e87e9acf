"""The engine's robots: what their files say is what the engine does, and what a calibration finds of it."""

import numpy as np
import pytest

from wmr_replay.gap import calibrate

mujoco = pytest.importorskip("mujoco")
SWIVELLING = (
    "porter",
    "usher",
    "mule",
    "dolly",
    "lugger",
    "freighter",
    "puck",
    "barrow",
    "chair",
    "sweeper",
    "medic",
    "stocker",
    "butler",
    "warden",
    "weeder",
    "satchel",
    "caddy",
    "trike",
    "lectern",
    "pallet",
    "stevedore",
)
DRAGGING = ("mopper", "clerk", "scraper", "groomer", "bellhop")
LAGGING = ("bellhop",)
WIDE_TYRED = ("tutor", "tray", "vintner")
TWO_WHEELED = (
    "courier",
    "cart",
    "hauler",
    "kiosk",
    "beetle",
    "waiter",
    "scout",
    "caller",
    "plinth",
    *DRAGGING,
    *SWIVELLING,
)


def rolled(plant, name: str, torque: float) -> float:
    """The speed after half a second of the torque of both motors, without what brakes: motors that lag act
    for a while after it, and what drags brakes as much without a torque.
    """
    for _ in range(50):
        plant.step(torque, torque)
    for _ in range(10 if name in LAGGING else 0):
        plant.step(0.0, 0.0)
    speed = plant.speeds()[0]
    for _ in range(50 if name in DRAGGING else 0):
        plant.step(0.0, 0.0)
    return speed + speed - plant.speeds()[0]


@pytest.mark.parametrize("name", TWO_WHEELED)
def test_a_robots_alpha_is_what_the_engine_does(engine, name):
    robot, drive = engine("robot").robot_of(name), engine("drive")
    plant = drive.Plant(engine("effects").Hidden(engine("robot").spec_of(name), {}))
    for _ in range(50):
        plant.step(0.0, 0.0)
    torque = 0.5 / (2 * robot.alpha)
    rolling = rolled(plant, name, torque)
    assert rolling == pytest.approx(0.25, rel=0.05)
    while plant.speeds()[0] > 0:
        plant.step(-torque, -torque)
    moment, gained = 0.2 / (2 * robot.alpha_yaw), []
    for times in (6, 6, -6) if name in DRAGGING else (1, 2):
        before = plant.speeds()[2]
        for _ in range(50):
            plant.step(-times * moment, times * moment)
        gained.append((plant.speeds()[2] - before) * robot.half_track_m)
    if name in DRAGGING:  # what drags brakes a turn that gathers speed as much as one that loses it
        gained = [0.0, (gained[1] - gained[2]) / 12]
    swinging = 0.15 if name in (*SWIVELLING, *LAGGING) else 0.05  # their casters swing round first
    assert gained[1] - gained[0] == pytest.approx(0.1, rel=swinging)


@pytest.mark.parametrize("name", WIDE_TYRED)
def test_wide_tyres_hold_a_robot_until_the_torque_overcomes_their_scrub(engine, name):
    """Ahead they roll by the robot's α; what turns it is held first."""
    robot, drive = engine("robot").robot_of(name), engine("drive")
    assert robot.wide_tyres
    assert drive.gains_of(robot) == drive.WIDE_TYRES
    plant = drive.Plant(engine("effects").Hidden(engine("robot").spec_of(name), {}))
    plant.settle()
    torque, rates = 0.5 / (2 * robot.alpha), []
    for _ in range(50):
        plant.step(torque, torque)
    rolling = plant.speeds()[0]
    for _ in range(20):
        plant.step(0.0, 0.0)
    braked = rolling - plant.speeds()[0]
    assert rolling + 2.5 * braked == pytest.approx(0.25, rel=0.06)
    for apart_mps2 in (0.1, 2.5):
        each = apart_mps2 / (2 * robot.alpha_yaw)
        for _ in range(30):
            plant.step(-each, each)
        rates.append(robot.half_track_m * plant.speeds()[2])
    assert abs(rates[0]) < 0.005
    assert rates[1] > 0.2


@pytest.mark.parametrize(("name", "offset_m", "on_its_lip"), [("puck", -0.02, True), ("puck", 0.02, False)])
def test_a_mass_that_tips_the_robot_onto_its_lip_is_seen(engine, name, offset_m, on_its_lip):
    spec = engine("robot").spec_of(name)
    chassis = spec.geom("chassis")
    chassis.pos = [chassis.pos[0] + offset_m, *chassis.pos[1:]]
    hidden, clean = (engine("effects").Hidden(one, {}) for one in (spec, engine("robot").spec_of(name)))
    assert engine("drive").rests_elsewhere(hidden, clean) is on_its_lip


def test_an_arm_of_the_centre_of_mass_is_as_long_as_the_engine_has_it(engine):
    """Without the arm the inertia comes out a third too large, in whose units it was a half too long."""
    logs, robots = engine("logs"), engine("robot")
    ahead = logs.logged(engine("case").Case("scout", "stop-go", "mocap", "", 5_000_001))
    compiled = robots.spec_of("scout").compile()
    at_rest, inertia = mujoco.MjData(compiled), np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_forward(compiled, at_rest)
    mujoco.mj_fullM(compiled, at_rest, inertia)
    arm_m = inertia[1, 5] / ahead.robot.mass_kg
    held = {effect.name: effect.parameters for effect in calibrate(ahead.log, ahead.log.robot).effects}
    assert arm_m == pytest.approx(0.041, abs=0.001)
    assert held["com_offset"]["offset_m"] == pytest.approx(arm_m, rel=0.05)


@pytest.mark.parametrize(
    ("name", "noise", "seed", "off"),
    [
        ("lugger", "mocap", 5_000_001, 0.07),
        ("chair", "mocap", 5_000_001, 0.07),
        ("mule", "rtk", 5_000_000, 0.07),  # as a column beside a model without it, swivels are hardly seen
        ("mopper", "rtk", 5_000_000, 0.07),  # pads
    ],
)
def test_alpha_yaw_is_the_engines_where_casters_turn_hard_and_pads_drag(engine, name, noise, seed, off):
    """By the engine's inertias: l²/(r (I + 2 J l²/r²)). Without their friction it is a third too small."""
    case = engine("case").Case(name, "stop-go", noise, "", seed)
    ahead = engine("logs").driven_through(case)
    compiled = engine("robot").spec_of(name).compile()
    at_rest, inertia = mujoco.MjData(compiled), np.zeros((compiled.nv, compiled.nv))
    mujoco.mj_forward(compiled, at_rest)
    mujoco.mj_fullM(compiled, at_rest, inertia)
    wheel = compiled.joint("left").dofadr[0]
    l_m, r_m = ahead.robot.half_track_m, ahead.robot.data_sheet.wheel_radius_m
    turned = inertia[5, 5] + 2 * inertia[wheel, wheel] * (l_m / r_m) ** 2
    found = calibrate(ahead.log, ahead.log.robot)
    assert found.robot.alpha_yaw == pytest.approx(l_m**2 / (r_m * turned), rel=off)
