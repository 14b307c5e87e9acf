"""The extended plant against the base plant, and each hidden form against its equation."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wmr_schemas import PAPER_ROBOT
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.model_file import Effect
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import ClosedLoop, OpenLoop
from wmr_synth.driving.patrol import GAINS, SMALL_ROBOT, stop_go_reverse_turn
from wmr_synth.hidden.disturbance import NO_DISTURBANCE, Disturbance
from wmr_synth.hidden.measurement import as_seen
from wmr_synth.hidden.parameters import Hidden, hidden_of
from wmr_synth.hidden.simulate import simulate_hidden
from wmr_synth.plants.motion import Motion
from wmr_synth.plants.two_wheeled_loop import simulate

ALPHA, ALPHA_YAW, L = SMALL_ROBOT.alpha, SMALL_ROBOT.alpha_yaw, SMALL_ROBOT.half_track_m


def instants(duration_s: float) -> np.ndarray:
    return np.arange(0, round(duration_s * 100) + 1) * (NS_PER_S // 100)


def moved(
    *effects: Effect,
    left=np.zeros_like,
    right=None,
    duration_s=10.0,
    start=(0.0, 0.0),
    mode=0,
    robot=SMALL_ROBOT,
    plain=False,
    disturbance=NO_DISTURBANCE,
) -> Motion:
    """Open-loop motion under effects; both wheels get ``left`` unless ``right`` is given."""
    t_ns = instants(duration_s)
    driver = OpenLoop(lambda t: (left(t), (right or left)(t)))
    modes = ModeTrack(np.zeros(1, np.int64), np.array([mode], np.int8))
    hidden = hidden_of(effects, robot, plain=plain)
    noise = disturbance, np.random.default_rng(0)
    return simulate_hidden(robot, modes, driver.commands(t_ns / NS_PER_S), (t_ns, t_ns), start, hidden, noise)


def constant(value: float):
    return lambda t: np.full_like(t, value)


def effect(name: str, **parameters: float) -> Effect:
    return Effect(name, parameters)


@pytest.mark.parametrize("robot", [SMALL_ROBOT, PAPER_ROBOT], ids=["small", "paper"])
def test_without_effect_and_disturbance_the_extended_plant_is_the_base_plant(robot):
    t_ns, rng = instants(60.0), np.random.default_rng(4)
    gains = GAINS if robot is SMALL_ROBOT else GAINS._replace(limit_nm=40.0)
    commands = ClosedLoop(stop_go_reverse_turn(60.0, rng), gains).commands(t_ns / NS_PER_S)
    starts = np.array([0, 9, 14, 25, 31, 44], np.int64) * NS_PER_S
    modes = ModeTrack(starts, np.array([0, 1, 0, 2, 3, 0], np.int8))
    base = simulate(robot, modes, commands, t_ns, t_ns, (0.3, 0.1))
    noise = NO_DISTURBANCE, np.random.default_rng(0)
    ours = simulate_hidden(robot, modes, commands, (t_ns, t_ns), (0.3, 0.1), Hidden(), noise)
    assert np.array_equal(ours.t_ns, base.t_ns)
    assert np.array_equal(ours.mode, base.mode)
    assert np.ptp(base.x_m) > 1.0
    for name in vars(base):
        if name not in ("t_ns", "mode"):
            within = 1e-6 if name.endswith(("_m", "_rad", "_mps", "_nm")) else 1e-5
            assert getattr(ours, name) == pytest.approx(getattr(base, name), abs=within), name


def stribeck(v, c0):
    return -c0 * (1 + 0.25 * np.exp(-((v / 0.15) ** 2))) * v / np.hypot(v, 0.005)


def integrated(acceleration, start, t_s):
    """Velocity by an adaptive method of high order, from the equation as written."""
    solution = solve_ivp(
        lambda t, v: [acceleration(t, v[0])], (0, t_s[-1]), [start], t_eval=t_s, rtol=1e-10, atol=1e-12,
        method="Radau", max_step=0.05,
    )  # fmt: skip
    return solution.y[0]


def test_rolling_resistance_is_stribecks():
    motion = moved(effect("rolling_resistance", c0_mps2=0.2), start=(1.0, 0.0), duration_s=4.0)
    t_s = motion.t_ns / NS_PER_S
    assert motion.v_long_mps == pytest.approx(integrated(lambda t, v: stribeck(v, 0.2), 1.0, t_s), abs=1e-5)


def test_a_torque_below_rolling_friction_does_not_move_the_robot():
    torque = constant(0.5 * 0.2 / (2 * ALPHA))
    motion = moved(effect("rolling_resistance", c0_mps2=0.2), left=torque, duration_s=30.0)
    assert abs(motion.x_m[-1]) < 0.1
    assert moved(left=torque, duration_s=30.0).x_m[-1] > 40


def test_drag_has_the_terminal_speed_of_its_exponent():
    torque = constant(0.5 / (2 * ALPHA))
    end = moved(effect("aerodynamic_drag", c2_per_m=0.1), left=torque, duration_s=60.0).v_long_mps[-1]
    assert end == pytest.approx((0.5 / 0.1) ** (1 / 1.9), rel=1e-6)
    plain = moved(effect("aerodynamic_drag", c2_per_m=0.1), left=torque, duration_s=60.0, plain=True)
    assert plain.v_long_mps[-1] == pytest.approx(5**0.5, rel=1e-6)


def test_a_medium_that_brakes_turns_does_so_by_the_whole_speed():
    spinning = moved(effect("aerodynamic_drag", c2_per_m=0.0, e2_per_m=0.4), start=(0.0, 1 / L), plain=True)
    t_s = spinning.t_ns / NS_PER_S
    assert L * spinning.yaw_rate_radps == pytest.approx(1 / (1 + 0.4 * t_s), rel=1e-6)
    ahead = moved(effect("aerodynamic_drag", c2_per_m=0.0, e2_per_m=0.4), start=(3.0, 1e-3 / L), plain=True)
    assert L * ahead.yaw_rate_radps == pytest.approx(1e-3 * np.exp(-0.4 * 3.0 * t_s), rel=1e-5)


def test_viscous_drag_and_yaw_damping_decay_exponentially():
    both = effect("viscous_drag", c1_per_s=0.3), effect("yaw_damping", d1_per_s=0.7)
    motion = moved(*both, start=(1.5, 0.8))
    t_s = motion.t_ns / NS_PER_S
    assert motion.v_long_mps == pytest.approx(1.5 * np.exp(-0.3 * t_s), rel=1e-9)
    assert motion.yaw_rate_radps == pytest.approx(0.8 * np.exp(-0.7 * t_s), rel=1e-9)


def test_swivels_keep_the_curvature_until_a_torque_overcomes_their_friction():
    """Of (v, l·yaw_rate) = (1, 0), a torque of less than s₀ turns nothing, one of more what it has beyond."""
    swivels = effect("swivel_friction", s0_mps2=0.2)
    below, above = 0.1 / (2 * ALPHA_YAW), 0.5 / (2 * ALPHA_YAW)
    held = moved(swivels, left=constant(-below), right=constant(below), start=(1.0, 0.0), duration_s=0.2)
    assert abs(held.yaw_rate_radps[-1]) < 0.2 * 0.1 * 0.2 / L
    turned = moved(swivels, left=constant(-above), right=constant(above), start=(1.0, 0.0), duration_s=0.2)
    assert turned.yaw_rate_radps[-1] == pytest.approx(0.3 * 0.2 / L, rel=0.1)


def test_swivels_do_not_brake_a_turn_on_the_spot():
    spinning = moved(effect("swivel_friction", s0_mps2=0.2), start=(0.0, 1.0), duration_s=1.0)
    assert spinning.yaw_rate_radps[-1] == pytest.approx(1.0, abs=1e-9)


def test_supports_that_drag_brake_a_turn_on_the_spot_and_hardly_one_at_speed():
    drag = effect("support_friction", p0_mps2=0.0, d0_mps2=0.05)
    spinning = moved(drag, start=(0.0, 1.0), duration_s=1.0)
    assert spinning.yaw_rate_radps[-1] == pytest.approx(1.0 - 0.05 / L, abs=2e-3)
    rolling = moved(drag, start=(10 * L, 1.0), duration_s=1.0)
    assert rolling.yaw_rate_radps[-1] == pytest.approx(1.0 - 0.05 / L / 10, abs=2e-3)
    ahead = moved(effect("support_friction", p0_mps2=0.1, d0_mps2=0.0), start=(1.0, 0.0), duration_s=1.0)
    assert ahead.v_long_mps[-1] == pytest.approx(0.9, abs=1e-3)


def test_a_payload_makes_tyres_scrub_more_and_an_inertia_less():
    scrub = effect("scrub_torque", d0_mps2=0.05)
    loaded = moved(scrub, effect("payload", mass_ratio=0.4), start=(0.0, 1.0), duration_s=1.0)
    assert loaded.yaw_rate_radps[-1] == pytest.approx(1.0 - 1.4 * 0.05 / L, abs=1e-3)
    heavier = moved(scrub, effect("yaw_inertia", ratio=0.25), start=(0.0, 1.0), duration_s=1.0)
    assert heavier.yaw_rate_radps[-1] == pytest.approx(1.0 - 0.05 / 1.25 / L, abs=1e-3)


def test_scrub_stops_turning_at_a_constant_rate():
    motion = moved(effect("scrub_torque", d0_mps2=0.05), start=(0.0, 1.0), duration_s=3.0)
    assert motion.yaw_rate_radps[200] == pytest.approx(1.0 - 0.05 / L * 2.0, abs=1e-3)


def test_friction_at_the_wheels_acts_on_both_channels():
    coulomb = moved(effect("wheel_coulomb", torque_nm=0.2), start=(1.0, 0.5), duration_s=1.0)
    assert coulomb.v_long_mps[-1] == pytest.approx(1.0 - 2 * ALPHA * 0.2, abs=1e-4)
    assert coulomb.yaw_rate_radps[-1] == pytest.approx(0.5, abs=1e-4)
    viscous = moved(effect("wheel_viscous", nm_per_radps=0.02), start=(1.0, 0.5), duration_s=2.0)
    rate = 2 * 0.02 / SMALL_ROBOT.wheel_radius_m
    assert viscous.v_long_mps[-1] == pytest.approx(np.exp(-rate * ALPHA * 2), rel=1e-9)
    assert viscous.yaw_rate_radps[-1] == pytest.approx(0.5 * np.exp(-rate * ALPHA_YAW * 2), rel=1e-9)


def test_a_bumpy_slope_conserves_energy_over_its_surface():
    g_x, g_y, wave = 0.3, -0.2, 2 * np.pi / 3
    motion = moved(effect("slope", grade_x_mps2=g_x, grade_y_mps2=g_y), start=(1.0, 0.3))
    bump = 0.25 * np.hypot(g_x, g_y)
    x, y = motion.x_m, motion.y_m
    height = -(g_x * x + g_y * y) + bump / wave * (np.cos(wave * x + 0.7) + np.cos(wave * y + 2.1))
    energy = motion.v_long_mps**2 / 2 + height
    assert energy == pytest.approx(energy[0], abs=1e-6)
    assert np.ptp(height) > 0.3


def test_a_slope_drives_a_skidding_robot_sideways():
    motion = moved(effect("slope", grade_x_mps2=0.0, grade_y_mps2=0.3), mode=1, plain=True, duration_s=3.0)
    speed = 0.3
    decay = 2 * SMALL_ROBOT.cornering_stiffness_over_epsilon / SMALL_ROBOT.mass_kg / speed
    assert motion.v_lat_mps[-1] == pytest.approx(0.3 / decay, rel=1e-3)


def test_lag_is_two_poles_of_half_the_time_constant():
    step_s, time_constant = 2.0, 0.2
    motion = moved(
        effect("actuator_lag", time_constant_s=time_constant), left=constant(1.0), duration_s=step_s
    )
    t_s, half = motion.t_ns / NS_PER_S, time_constant / 2
    torque = 1 - np.exp(-t_s / half) * (1 + t_s / half)
    assert motion.a_long_mps2 == pytest.approx(2 * ALPHA * torque, abs=1e-7)
    plain = moved(
        effect("actuator_lag", time_constant_s=time_constant), left=constant(1.0), duration_s=2.0, plain=True
    )
    assert plain.a_long_mps2 == pytest.approx(2 * ALPHA * (1 - np.exp(-t_s / time_constant)), abs=1e-7)


def test_delay_moves_every_torque_by_exactly_itself():
    def ramp(t):
        return np.sin(2 * t)

    delayed = moved(effect("input_delay", delay_s=0.1234), left=ramp, duration_s=6.0)
    torque = ramp(np.floor(np.maximum(delayed.t_ns / NS_PER_S - 0.1234, 0) * 100 + 1e-6) / 100)
    assert delayed.a_long_mps2 == pytest.approx(2 * ALPHA * torque, abs=1e-12)
    assert delayed.effort_left_nm[300] == pytest.approx(np.sin(2 * delayed.t_ns[300] / NS_PER_S), abs=0.03)


@pytest.mark.parametrize("torque", [-2.0, -0.3, 0.05, 0.4, 3.0])
def test_dead_zone_and_saturation_are_soft_and_odd(torque):
    dead = moved(effect("torque_deadzone", threshold_nm=0.3), left=constant(torque), duration_s=1.0)
    expected = torque - 0.3 * np.tanh(torque / 0.3)
    assert dead.a_long_mps2[-1] == pytest.approx(2 * ALPHA * expected, rel=1e-12)
    limited = moved(effect("torque_saturation", limit_nm=0.8), left=constant(torque), duration_s=1.0)
    assert abs(limited.a_long_mps2[-1]) < 2 * ALPHA * min(0.8, abs(torque))
    assert limited.a_long_mps2[-1] / torque > 0
    assert abs(limited.a_long_mps2[-1]) > 2 * ALPHA * min(0.8, abs(torque)) * 0.85
    hard = moved(
        effect("torque_deadzone", threshold_nm=0.3), left=constant(torque), duration_s=1.0, plain=True
    )
    expected = np.sign(torque) * max(abs(torque) - 0.3, 0.0)
    assert hard.a_long_mps2[-1] == pytest.approx(2 * ALPHA * expected, abs=1e-12)


GAINS_OF = {
    "payload": ({"mass_ratio": 0.25}, 1 / 1.25, 1.0),
    "yaw_inertia": ({"ratio": 0.25}, 1.0, 1 / 1.25),
    "drive_gain": ({"ratio": -0.3}, 0.7, 0.7),
}


@pytest.mark.parametrize("name", GAINS_OF)
def test_gains_scale_the_accelerations(name):
    parameters, ahead, turning = GAINS_OF[name]
    motion = moved(Effect(name, parameters), left=constant(0.5), right=constant(0.8), duration_s=1.0)
    assert motion.a_long_mps2[50] == pytest.approx(ahead * ALPHA * 1.3, rel=1e-12)
    assert L * motion.yaw_acc_radps2[50] == pytest.approx(turning * ALPHA_YAW * 0.3, rel=1e-12)


TORQUES_OF = {
    "torque_imbalance": ({"ratio": 0.1}, 0.45, 0.88),
    "torque_bias_common": ({"bias_nm": -0.2}, 0.3, 0.6),
    "torque_bias_differential": ({"bias_nm": 0.2}, 0.3, 1.0),
}


@pytest.mark.parametrize("name", TORQUES_OF)
def test_imbalance_and_biases_change_the_torques_and_not_their_record(name):
    parameters, left, right = TORQUES_OF[name]
    motion = moved(Effect(name, parameters), left=constant(0.5), right=constant(0.8), duration_s=1.0)
    assert motion.a_long_mps2[50] == pytest.approx(ALPHA * (left + right), rel=1e-12)
    assert L * motion.yaw_acc_radps2[50] == pytest.approx(ALPHA_YAW * (right - left), rel=1e-12)
    assert motion.effort_left_nm[50] == 0.5


@pytest.mark.parametrize(("load", "ratio"), [(0.0, 0.0), (0.4, 0.0), (0.0, 0.3), (0.4, 0.3)])
def test_a_centre_of_mass_ahead_of_the_axle_conserves_kinetic_energy(load, ratio):
    """A payload at the centre of mass and a larger yaw inertia are in the energy, too."""
    m, inertia = SMALL_ROBOT.mass_kg * (1 + load), SMALL_ROBOT.yaw_inertia_kgm2 * (1 + ratio)
    loaded = effect("payload", mass_ratio=load), effect("yaw_inertia", ratio=ratio)
    motion = moved(effect("com_offset", offset_m=0.1), *loaded, start=(0.5, 1.5), duration_s=5.0)
    energy = m * motion.v_long_mps**2 + inertia * motion.yaw_rate_radps**2
    assert energy == pytest.approx(energy[0], rel=1e-9)
    assert motion.v_long_mps[-1] > 0.55


def test_a_load_comes_on_over_two_seconds():
    motion = moved(effect("load_step", mass_ratio=0.5, t0_s=5.0), left=constant(1.0))
    share = motion.a_long_mps2 / (2 * ALPHA)
    assert share[[0, 399, 601, 1000]] == pytest.approx([1, 1, 1 / 1.5, 1 / 1.5])
    assert share[500] == pytest.approx(1 / 1.25)


def test_a_slip_interval_takes_its_share_of_traction():
    motion = moved(effect("slip_interval", start_s=3.0, end_s=6.0, loss=0.4), left=constant(1.0))
    share = motion.a_long_mps2 / (2 * ALPHA)
    assert share[[289, 300, 311, 589, 600, 611]] == pytest.approx([1, 0.8, 0.6, 0.6, 0.8, 1])


def test_a_patch_takes_its_share_of_traction_inside_its_soft_edge():
    patch = effect("low_friction_patch", x_m=3.0, y_m=0.0, radius_m=1.0, loss=0.5)
    motion = moved(patch, left=constant(0.5))
    distance = np.abs(motion.x_m - 3.0)
    share = 1 - 0.25 * (1 - np.tanh((distance - 1.0) / 0.1))
    assert motion.x_m[-1] > 5
    assert motion.a_long_mps2 == pytest.approx(2 * ALPHA * 0.5 * share, rel=1e-9)


@pytest.mark.parametrize(("name", "mode"), [("cornering_stiffness", 1), ("undeclared_skid", 0)])
def test_stiffness_sets_how_fast_lateral_velocity_dies_out(name, mode):
    key = "ratio" if mode else "stiffness_ratio"
    motion = moved(Effect(name, {key: 0.5}), start=(1.0, 0.4), mode=mode, duration_s=3.0)
    factor = 1.5 if mode else 0.5
    decay = factor * 2 * SMALL_ROBOT.cornering_stiffness_over_epsilon / SMALL_ROBOT.mass_kg
    v = np.sqrt(motion.v_lat_mps**2 + motion.v_long_mps**2 + (L * motion.yaw_rate_radps) ** 2)
    balance = -decay / v * motion.v_lat_mps - motion.v_long_mps * motion.yaw_rate_radps
    measured = np.gradient(motion.v_lat_mps, 0.01)
    assert measured[1:-1] == pytest.approx(balance[1:-1], abs=2e-3)
    assert np.all(motion.mode == mode)


def test_an_eccentric_wheel_ripples_once_a_turn():
    motion = moved(effect("wheel_eccentricity", amplitude_mps2=0.2), start=(1.0, 0.0), duration_s=3.0)
    assert motion.a_long_mps2 == pytest.approx(0.2 * np.sin(motion.right_rad), abs=1e-12)
    assert motion.right_rad[-1] == pytest.approx(motion.x_m[-1] / SMALL_ROBOT.wheel_radius_m)


def test_measurement_effects_change_what_is_seen():
    motion = moved(start=(1.0, 0.5))
    effects = (
        effect("heading_misalignment", angle_rad=0.05),
        effect("yaw_drift", rate_radps=0.01),
        effect("pose_lever_arm", x_m=0.2, y_m=-0.1),
    )
    seen = as_seen(motion, effects)
    t_s = motion.t_ns / NS_PER_S
    assert seen.yaw_rad == pytest.approx(motion.yaw_rad + 0.05 + 0.01 * t_s)
    arm = (seen.x_m - motion.x_m) + 1j * (seen.y_m - motion.y_m)
    assert arm == pytest.approx((0.2 - 0.1j) * np.exp(1j * motion.yaw_rad))


def test_the_disturbance_has_its_spread_and_its_correlation_time():
    t_ns = np.arange(0, 4000 * NS_PER_S, NS_PER_S // 100)
    held = Disturbance(0.02, 0.4).held(t_ns, np.random.default_rng(1))
    assert held.std(axis=0) == pytest.approx(np.full(3, 0.02), rel=0.05)
    lag = 40
    correlation = [np.corrcoef(held[lag:, k], held[:-lag, k])[0, 1] for k in range(3)]
    assert correlation == pytest.approx(np.full(3, np.exp(-1)), abs=0.05)
    assert np.corrcoef(held.T)[0, 1] == pytest.approx(0, abs=0.05)


def test_a_white_disturbance_integrates_to_its_density():
    t_ns = np.arange(0, 2000 * NS_PER_S, NS_PER_S // 50)
    white = Disturbance(white_mps2_rthz=(0.1, 0.0, 0.2)).held(t_ns, np.random.default_rng(2))
    over_a_second = white[:-1].cumsum(axis=0)[::50] / 50
    spread = np.diff(over_a_second, axis=0).std(axis=0)
    assert spread == pytest.approx([0.1, 0.0, 0.2], rel=0.06)


def test_the_disturbance_moves_the_robot_by_channel():
    motion = moved(disturbance=Disturbance(0.05, 0.4), start=(1.0, 0.0))
    assert 0.01 < np.std(motion.a_long_mps2) < 0.1
    assert np.std(motion.yaw_acc_radps2) > 0.04
    assert np.all(motion.v_lat_mps == 0)
