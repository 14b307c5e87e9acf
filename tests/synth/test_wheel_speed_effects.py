"""Hidden effects of robots that wheel speeds drive: each is as large as its formula says.

The formulas are written out here once more, as integrals of the logged wheel speeds (or as what follows from
the logged commands), and compared with the logged poses of a robot that has nothing else.
"""

from dataclasses import replace

import numpy as np
import pytest

from wmr_schemas.effects import EFFECTS, effects_of
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.model_file import Effect, Model
from wmr_synth import SCENARIOS, Disturbance, World, hidden_log, synthesise
from wmr_synth.hidden.measurement import MEASURED
from wmr_synth.hidden.registry import ROLLING_WORDS, words_of
from wmr_synth.hidden.rolling import ROLLING_CHANGES
from wmr_synth.hidden.world import drawn_world, model_world
from wmr_synth.wheel_speed.encoders import EncoderSensors
from wmr_synth.wheel_speed.ground import DRY

SENSORS = EncoderSensors(200.0, 200.0, 0.0, 0.0, wheel_rate_hz=200.0, encoder_ticks=0.0, command_rate_hz=50.0)
PLAIN = SCENARIOS["encoders"]
TEXTBOOK = replace(
    PLAIN, sensors=SENSORS, plan=replace(PLAIN.plan, floor=DRY, textbook=True, nominal_error=0.0)
)
R, L = PLAIN.robot.wheel_radius_m, PLAIN.robot.half_track_m
assert R is not None
assert L is not None
DURATION_S = 20.0
SIZES = {
    "wheel_scale": {"ratio": 0.05},
    "wheel_scale_difference": {"ratio": 0.015},
    "effective_track": {"ratio": 0.15},
    "wide_turn_scrub": {"ratio": 0.3},
    "icr_offset": {"offset_m": 0.1},
    "lateral_slip": {"seconds": 0.15},
    "turning_slip": {"s_per_m": 0.4},
    "slip_ratio": {"seconds": 0.05},
    "pose_delay": {"delay_s": 0.1},
    "slope_slip": {"x_mps": 0.05, "y_mps": -0.04},
    "low_grip_patch": {"x_m": 1.5, "y_m": 0.0, "radius_m": 1.2, "loss": 0.5},
    "slip_interval": {"start_s": 6.0, "end_s": 9.0, "loss": 0.4, "loss_apart": 0.2},
    "heading_misalignment": {"angle_rad": 0.08},
    "pose_lever_arm": {"x_m": 0.2, "y_m": -0.1},
    "yaw_drift": {"rate_radps": 0.01},
    "drive_gain": {"ratio": 0.2},
    "turn_gain": {"ratio": 0.2},
    "speed_deadzone": {"threshold_mps": 0.1},
    "speed_saturation": {"limit_mps": 0.7},
    "turn_saturation": {"limit_radps": 0.3},
    "speed_desaturation": {"limit_mps": 0.7},
    "turn_acceleration_limit": {"limit_radps2": 0.4},
    "acceleration_limit": {"limit_mps2": 0.5},
    "actuator_lag": {"time_constant_s": 0.2},
    "input_delay": {"delay_s": 0.1},
}
COMMANDED = {name for name in SIZES if EFFECTS[name].needs_commands}
LEFT = {"low_grip_patch": 0.25, "actuator_lag": 0.4, "speed_saturation": 0.3, "slip_ratio": 0.3}
"""Share of an effect that the candidates' form leaves of the hidden one, where it is more than a fifth."""


def made(name, *, plain):
    world = World((Effect(name, SIZES[name]),), plain=plain)
    return synthesise(TEXTBOOK, seed=6, duration_s=DURATION_S, world=world)


def seconds(log, t_ns):
    return (t_ns - log.pose.t_ns[0]) / 1e9


def speeds(log):
    """(rim mean, rim half difference) in m/s at the middle of the encoders' intervals, and the intervals."""
    right, left = R * log.wheels.right_radps, R * log.wheels.left_radps
    return (right + left) / 2, (right - left) / 2, 1 / 200.0


def wider(name, p, mean, half):
    """The track, by the robot's, of the rims' mean (n,) and half difference (n,)."""
    wide = np.abs(mean) / np.maximum(np.abs(mean) + 3 * np.abs(half), 1e-9)
    by = {"effective_track": 1.0, "wide_turn_scrub": wide - 0.5}.get(name, 0.0)
    return 1 + p.get("ratio", 0.0) * by


def travelled(log, name, p):
    """Poses (3, n) out of wheel speeds, by the base model with one effect of the wheels or of slip."""
    mean, half, dt = speeds(log)
    if name == "wheel_scale":
        mean, half = mean * (1 + p["ratio"]), half * (1 + p["ratio"])
    if name == "wheel_scale_difference":
        mean, half = mean + p["ratio"] * half, half + p["ratio"] * mean
    loss, apart = np.zeros(len(mean)), p.get("loss_apart", 0.0) / p.get("loss", 1.0)
    age = seconds(log, log.wheels.t_ns) - dt / 2
    if name == "slip_interval":
        loss = np.where((age >= p["start_s"]) & (age < p["end_s"]), p["loss"], 0.0)
    if name == "low_grip_patch":
        x, y = (np.interp(age, seconds(log, log.pose.t_ns), c) for c in (log.pose.x_m, log.pose.y_m))
        loss = np.where(np.hypot(x - p["x_m"], y - p["y_m"]) < p["radius_m"], p["loss"], 0.0)
    right, left = (mean + half) * (1 - loss * (1 + apart)), (mean - half) * (1 - loss * (1 - apart))
    mean, half = (right + left) / 2, (right - left) / 2
    rate = half / L / wider(name, p, mean, half)
    v, lateral = mean, np.zeros(len(mean))
    if name == "icr_offset":
        lateral = -p["offset_m"] * rate
    if name == "lateral_slip":
        lateral = -p["seconds"] * v * rate
    if name == "turning_slip":
        v = v * (1 - p["s_per_m"] * np.abs(rate) * L)
    if name == "slip_ratio":
        v = v - p["seconds"] * np.gradient(v, dt)
    yaw = np.concatenate([[0.0], np.cumsum(rate * dt)])
    middle = (yaw[1:] + yaw[:-1]) / 2
    world = (v + 1j * lateral) * np.exp(1j * middle)
    if name == "slope_slip":
        world = world + (p["x_mps"] + 1j * p["y_mps"]) * (np.abs(mean) + np.abs(half) > 0.01)
    path = np.concatenate([[0.0], np.cumsum(world * dt)])
    return seen(np.stack([path.real, path.imag, yaw]), name, p, np.arange(len(yaw)) * dt)


def seen(pose, name, p, age):
    """The pose (3, n) as a sensor with one effect reports it at ``age`` (n,) in s."""
    x, y, yaw = pose
    if name == "pose_delay":
        x, y, yaw = (np.interp(age - p["delay_s"], age, column) for column in pose)
    if name == "heading_misalignment":
        yaw = yaw + p["angle_rad"]
    if name == "yaw_drift":
        yaw = yaw + p["rate_radps"] * age
    if name == "pose_lever_arm":
        x = x + p["x_m"] * np.cos(pose[2]) - p["y_m"] * np.sin(pose[2])
        y = y + p["x_m"] * np.sin(pose[2]) + p["y_m"] * np.cos(pose[2])
    return np.stack([x, y, yaw])


def obeyed(log, name, p):
    """Rim speeds (2, n), left and right in m/s, of 1 ms steps, out of the commands with one effect."""
    step_s = 1e-3
    age = np.arange(0.0, DURATION_S, step_s)
    stamps = seconds(log, log.commands.t_ns) + (p["delay_s"] if name == "input_delay" else 0.0)
    held = np.searchsorted(stamps, age + 1e-9, side="right") - 1
    commands = R * np.stack([log.commands.left_radps, log.commands.right_radps])
    u = np.where(held >= 0, commands[:, np.maximum(held, 0)], 0.0)
    if name == "drive_gain":
        u = u * (1 + p["ratio"])
    if name == "turn_gain":
        half = (u[1] - u[0]) / 2
        u = u + p["ratio"] * np.stack([-half, half])
    if name == "speed_deadzone":
        u = np.sign(u) * np.maximum(np.abs(u) - p["threshold_mps"], 0.0)
    if name == "speed_saturation":
        u = np.clip(u, -p["limit_mps"], p["limit_mps"])
    if name == "turn_saturation":
        excess = np.abs(u[1] - u[0]) / (2 * L * p["limit_radps"])
        u = u.mean(axis=0) + np.stack([-0.5, 0.5])[:, None] * (u[1] - u[0]) / np.maximum(excess, 1.0)
    if name == "speed_desaturation":
        u = u / np.maximum(np.abs(u).max(axis=0) / p["limit_mps"], 1.0)
    if name in ("acceleration_limit", "turn_acceleration_limit", "actuator_lag"):
        u = followed(u, name, p, step_s)
    return age, u


def followed(u, name, p, step_s):
    """Commands behind a limit of their rate or a lag."""
    out, now = np.empty_like(u), np.zeros(2)
    for k in range(u.shape[1]):
        if name == "actuator_lag":
            now = now + (1 - np.exp(-step_s / p["time_constant_s"])) * (u[:, k] - now)
        elif name == "turn_acceleration_limit":
            most, turn = 2 * L * p["limit_radps2"] * step_s, now[1] - now[0]
            turn = turn + np.clip(u[1, k] - u[0, k] - turn, -most, most)
            now = u[:, k].mean() + turn * np.array([-0.5, 0.5])
        else:
            now = now + np.clip(u[:, k] - now, -p["limit_mps2"] * step_s, p["limit_mps2"] * step_s)
        out[:, k] = now
    return out


def away(simulated, name, p):
    """How far a prediction is from what is logged, rms, in m or in m/s."""
    log = simulated.log
    if name in COMMANDED or name == "no command's":
        age, u = obeyed(log, name, p)
        middle = seconds(log, log.wheels.t_ns) - 1 / 400
        logged = R * np.stack([log.wheels.left_radps, log.wheels.right_radps])
        return rms(np.stack([np.interp(middle, age, side) for side in u]) - logged)
    off = travelled(log, name, p) - np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad])
    return rms(off * np.array([[1.0], [1.0], [L]]))


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize("name", SIZES)
def test_an_effect_is_as_large_as_its_formula_says(name):
    nothing = "no command's" if name in COMMANDED else "nothing"
    hidden, plain = (made(name, plain=plain) for plain in (False, True))
    assert away(hidden, name, SIZES[name]) < LEFT.get(name, 0.2) * away(hidden, nothing, {})
    assert away(plain, name, SIZES[name]) < 0.1 * away(plain, nothing, {})


def test_every_effect_of_the_base_can_be_hidden():
    assert set(SIZES) == set(effects_of("wheel_speed"))
    assert set(SIZES) == set(ROLLING_CHANGES) | set(MEASURED) | {"pose_delay"}
    assert set(ROLLING_WORDS) < set(SIZES)
    assert all(EFFECTS[name].ranges for name in SIZES)


def test_a_textbook_robot_with_nothing_hidden_is_the_base_model():
    plain = synthesise(TEXTBOOK, seed=6, duration_s=DURATION_S)
    assert away(plain, "nothing", {}) < 2e-3
    assert away(plain, "no command's", {}) < 0.02
    assert plain.facts["calibration"]["wheel_scale"]["ratio"] == 0.0


def test_drawn_effects_stand_in_the_truth_alone_and_their_form_is_said():
    robot = PLAIN.robot
    for name in ("lateral_slip", "low_grip_patch", "drive_gain"):
        world = drawn_world([name], 4, robot, 30.0, Disturbance())
        made = synthesise("encoders", seed=4, duration_s=30.0, world=world)
        (found,) = made.facts["effects"]
        assert found["form"] == words_of(name, "wheel_speed")
        assert np.all(np.isfinite(list(found["parameters"].values())))
        assert made.log.robot == robot


def test_a_log_in_memory_keeps_its_scenarios_robot_and_encoders():
    log, facts = hidden_log("skid-steer", 2, hide=["pose_delay"], noise="poor", duration_s=5.0)
    assert log.robot == SCENARIOS["skid-steer"].robot
    assert facts["sensors"]["noise_xy_sd_m"] == 0.05
    assert "disturbance" not in facts
    assert log.torque is None
    assert len(log.wheels) == 500


def test_a_hidden_loss_of_grip_is_slipping_in_the_truth():
    lost = made("slip_interval", plain=True).truth
    inside = (lost.t_ns > 6.2e9) & (lost.t_ns < 8.8e9) & (np.abs(lost.v_long_mps) > 0.2)
    assert np.mean(lost.mode[inside] == 2) > 0.9
    for name in ("lateral_slip", "turning_slip", "slip_ratio", "slope_slip", "icr_offset", "wide_turn_scrub"):
        assert set(made(name, plain=True).truth.mode.tolist()) == {0}, name


def test_a_model_file_is_driven_as_it_says():
    model = Model(robot=PLAIN.robot, effects=(Effect("effective_track", {"ratio": 0.3}),))
    simulated = synthesise(
        replace(PLAIN, sensors=SENSORS), seed=2, duration_s=DURATION_S, world=model_world(model)
    )
    assert simulated.facts["effects"][0]["form"] == EFFECTS["effective_track"].formula
    robot = simulated.facts["true_robot"]
    assert (robot["wheel_radius_m"], robot["half_track_m"]) == (R, L)


@pytest.mark.parametrize(("scenario", "name"), [("encoders", "payload"), ("patrol", "wheel_scale")])
def test_an_effect_of_the_other_base_is_refused(scenario, name):
    world = drawn_world([name], 0, SCENARIOS["patrol"].robot, 1.0, Disturbance())
    with pytest.raises(InvalidSetting, match=f"{name} is an effect of robots that wheel"):
        synthesise(scenario, duration_s=1.0, world=world)
