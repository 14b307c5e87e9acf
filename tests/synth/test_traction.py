"""The traction-limited plant against SciPy and closed forms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wmr_schemas import PAPER_ROBOT, ModeTrack
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.errors import InvalidSetting
from wmr_synth import SCENARIOS, Sensors, synthesise
from wmr_synth.driving.drivers import Commands, Gains
from wmr_synth.plants.limited_traction import FrictionTrack
from wmr_synth.plants.limited_traction_loop import simulate_limited
from wmr_synth.plants.motion import Motion

ALPHA, MASS, RADIUS, WHEEL_INERTIA, STIFFNESS = 0.35**2 / 4.8, 1000.0, 0.35, 1.6, 1e4
LENGTH_M, DAMPING, G = 0.1, 0.5, 9.81
INERTIA = MASS + 2 * WHEEL_INERTIA / RADIUS**2
SHARE = 1 - MASS / INERTIA
QUIET = Sensors(rate_hz=200.0, torque_rate_hz=100.0).without_noise()


def grid(duration_s: float, rate_hz: float) -> I64:
    return np.rint(np.arange(round(duration_s * rate_hz) + 1) * (NS_PER_S / rate_hz)).astype(np.int64)


def held(*values: float) -> FrictionTrack:
    """Friction that changes every second."""
    return FrictionTrack(np.arange(len(values)) * NS_PER_S, np.array(values))


def drive(
    friction: FrictionTrack,
    left_nm: F64,
    right_nm: F64,
    torque_ns: I64,
    pose_ns: I64,
    v_mps: float = 2.0,
    schedule: ModeTrack | None = None,
    alpha_yaw: float | None = None,
) -> Motion:
    nothing = np.zeros(len(torque_ns))
    commands = Commands(left_nm, right_nm, nothing, nothing, Gains(0.0, 0.0, np.inf))
    schedule = schedule or ModeTrack(np.zeros(1, np.int64), np.zeros(1, np.int8))
    robot = replace(PAPER_ROBOT, alpha_yaw=alpha_yaw)
    return simulate_limited(robot, schedule, friction, commands, torque_ns, pose_ns, (v_mps, 0.1))


def constant(
    mu: float, left_nm: float, right_nm: float, duration_s: float = 3.0, v_mps: float = 2.0
) -> Motion:
    one = np.zeros(1, np.int64)
    return drive(held(mu), np.full(1, left_nm), np.full(1, right_nm), one, grid(duration_s, 500), v_mps)


def oracle_rhs(t: float, s: F64, left_nm: float, right_nm: float, mu: float, alpha_yaw: float) -> list[float]:
    """Forces in newtons, wheels with their own speeds: the plant written down a second time."""
    _, _, yaw, v, omega, *wheels = s
    spring_n_per_m = STIFFNESS / LENGTH_M
    cap_n = mu * MASS * G / 2
    rates, forces = [], []
    torque_scale = ALPHA * INERTIA  # force in N that a torque of 1 N·m stands for in rolling
    for (speed, deflection), effort, side in ((wheels[:2], left_nm, -1), (wheels[2:], right_nm, 1)):
        hub = v + side * omega
        slip = speed - hub
        wanted = spring_n_per_m * deflection + DAMPING * INERTIA * slip
        rate = slip - abs(hub) / LENGTH_M * deflection
        if abs(deflection) >= cap_n / spring_n_per_m and rate * deflection > 0:
            rate = 0.0
        forces.append(np.clip(wanted, -cap_n, cap_n))
        rates += [(torque_scale * effort - wanted) / (WHEEL_INERTIA / RADIUS**2), rate]
    yaw_inertia = (ALPHA / alpha_yaw - SHARE) * INERTIA  # half track 1 m
    return [
        v * np.cos(yaw),
        v * np.sin(yaw),
        omega,
        sum(forces) / MASS,
        (forces[1] - forces[0]) / yaw_inertia,
        *rates,
    ]


def test_the_motion_is_that_of_scipy_to_a_fraction_of_a_millimetre_through_grip_and_slip():
    rng = np.random.default_rng(2)
    torque_ns = grid(5, 4)[:-1]
    left_nm, right_nm = rng.uniform(-10, 20, len(torque_ns)), rng.uniform(-10, 20, len(torque_ns))
    mu = (0.8, 0.02, 0.03, 0.8, 0.015)
    motion = drive(held(*mu), left_nm, right_nm, torque_ns, grid(5, 500), alpha_yaw=0.02)
    assert {0, 2} == set(motion.mode.tolist())
    begin = {name: column[0] for name, column in vars(motion).items()}
    creep = [  # the simulation begins with tyres that carry their load
        RADIUS * begin["left_radps"] - (2.0 - 0.1),
        RADIUS * begin["right_radps"] - (2.0 + 0.1),
    ]
    state = np.array(
        [0, 0, 0, 2.0, 0.1, 1.9 + creep[0], creep[0] * 0.1 / 1.9, 2.1 + creep[1], creep[1] * 0.1 / 2.1]
    )
    for k, start_ns in enumerate(torque_ns.tolist()):
        args = (left_nm[k], right_nm[k], mu[start_ns // NS_PER_S], 0.02)
        limit = args[2] * MASS * G / 2 / (STIFFNESS / LENGTH_M)
        state[[6, 8]] = np.clip(state[[6, 8]], -limit, limit)
        done = solve_ivp(
            oracle_rhs, (0, 0.25), state, args=args, method="RK45", rtol=1e-8, atol=1e-10, max_step=1e-3
        )
        state = done.y[:, -1].copy()
        state[[6, 8]] = np.clip(state[[6, 8]], -limit, limit)
        row = int(np.searchsorted(motion.t_ns, start_ns + NS_PER_S // 4))
        assert np.hypot(motion.x_m[row] - state[0], motion.y_m[row] - state[1]) < 2e-4
        assert motion.yaw_rad[row] == pytest.approx(state[2], abs=2e-4)
        assert motion.v_long_mps[row] == pytest.approx(state[3], abs=2e-4)


def test_on_dry_ground_it_rolls_by_alpha_after_the_tyres_have_settled():
    motion = constant(0.8, 6.0, 12.0)
    assert set(motion.mode.tolist()) == {0}
    assert motion.a_long_mps2[-1] == pytest.approx(ALPHA * 18.0, rel=5e-3)
    assert motion.yaw_acc_radps2[-1] == pytest.approx(ALPHA * 6.0, rel=5e-3)


def test_creep_is_force_over_stiffness_plus_damping():
    motion = constant(0.8, 10.0, 10.0, duration_s=1.0, v_mps=5.0)
    wheel_force = (ALPHA * 20.0) * MASS / 2
    v = motion.v_long_mps[-1]
    creep_mps = RADIUS * (motion.left_radps[-1] + motion.right_radps[-1]) / 2 - v
    assert creep_mps == pytest.approx(wheel_force / (STIFFNESS / v + DAMPING * INERTIA), rel=0.01)


def test_on_slippery_ground_it_accelerates_at_mu_g_and_slips_by_the_lost_torque_over_the_damping():
    motion = constant(0.02, 10.0, 10.0)
    assert set(motion.mode[1:].tolist()) == {2}
    assert motion.a_long_mps2[-1] == pytest.approx(0.02 * G, rel=1e-9)
    spent = (
        ALPHA * 10.0 - SHARE / 2 * 0.02 * G
    )  # of a wheel's torque, what does not accelerate it with the robot
    lost = spent - 0.02 * G * (1 - SHARE) / 2
    assert 1.5 * motion.sigma_sum_mps[-1] == pytest.approx(lost / DAMPING, rel=1e-6)


def test_slipping_sets_in_where_the_torque_exceeds_what_friction_carries():
    torque_ns = grid(10, 20)[:-1]
    ramp_nm = np.linspace(0.0, 10.0, len(torque_ns))
    motion = drive(held(0.02), ramp_nm, ramp_nm, torque_ns, grid(10, 200))
    onset = motion.t_ns[np.argmax(motion.mode == 2)] / NS_PER_S
    assert onset == pytest.approx(10.0 * 0.02 * G / (ALPHA * 20.0), abs=0.1)
    assert np.all(motion.mode[motion.t_ns / NS_PER_S >= onset] == 2)


def test_grip_returns_when_the_torque_is_taken_back_and_in_braking_the_other_way_round():
    torque_ns = grid(3, 1)[:-1]
    efforts_nm = np.array([10.0, 2.0, -10.0])
    motion = drive(held(0.02), efforts_nm, efforts_nm, torque_ns, grid(3, 500), v_mps=5.0)
    at = np.searchsorted(motion.t_ns, np.array([0.9, 1.9, 2.9]) * NS_PER_S)
    assert motion.mode[at].tolist() == [2, 0, 2]
    assert motion.a_long_mps2[at] == pytest.approx([0.02 * G, ALPHA * 4.0, -0.02 * G], rel=5e-3)


def test_one_wheel_on_ice_turns_the_robot():
    """The capped wheel gives c; what the other one gives agrees with its own torque."""
    one = np.zeros(1, np.int64)
    motion = drive(held(0.02), np.full(1, 10.0), np.full(1, 2.0), one, grid(3, 500))
    assert motion.mode[-1] == 2
    assert motion.yaw_acc_radps2[-1] < 0
    cap = 0.02 * G * (1 - SHARE) / 2
    right = motion.a_long_mps2[-1] * (1 - SHARE) - cap
    hub = motion.a_long_mps2[-1] + motion.yaw_acc_radps2[-1]
    assert right == pytest.approx(ALPHA * 2.0 - SHARE / 2 * hub, rel=1e-3)


def test_scheduled_skidding_follows_the_published_plant_and_leaves_no_slip():
    plain = synthesise("paper-acceleration", seed=1, duration_s=12, sensors=QUIET).truth
    limited = synthesise("paper-acceleration-traction-limited", seed=1, duration_s=12, sensors=QUIET).truth
    skids = limited.mode == 1
    assert np.array_equal(skids, plain.mode == 1)
    assert np.all(limited.sigma_sum_mps[skids] == 0)
    first = skids & (limited.t_ns < 4 * NS_PER_S)
    assert limited.v_lat_mps[first] == pytest.approx(plain.v_lat_mps[first], abs=1e-3)
    assert limited.v_long_mps[first] == pytest.approx(plain.v_long_mps[first], abs=1e-3)
    assert np.all(limited.v_lat_mps[~skids] == 0)


@pytest.mark.parametrize("seed", range(5))
def test_the_true_mode_is_slipping_where_force_falls_short_of_torque_and_no_spell_is_shorter_than_the_hold(
    seed,
):
    simulated = synthesise("random-traction-limited", seed=seed, sensors=QUIET)
    truth, track = simulated.truth, simulated.log.mode
    assert track is not None
    assert np.all(np.diff(track.mode) != 0)
    slips = track.mode[:-1] == 2
    assert np.diff(track.t_ns)[slips].min() >= 20_000_000
    short = np.abs(truth.a_long_mps2 - ALPHA * (truth.effort_left_nm + truth.effort_right_nm))
    assert np.percentile(short[truth.mode == 0], 95) < 0.05
    assert np.median(short[truth.mode == 2]) > 0.1
    wheel_slip = 1.5 * np.hypot(truth.sigma_sum_mps, truth.sigma_diff_mps)
    assert np.median(wheel_slip[truth.mode == 2]) > 2 * np.median(wheel_slip[truth.mode == 0])


def test_the_papers_six_conditions_come_about_with_slipping_of_itself():
    simulated = synthesise("paper-acceleration-traction-limited", sensors=QUIET)
    assert simulated.log.mode is not None
    assert simulated.log.mode.mode.tolist() == [0, 1, 2, 1, 0, 2]
    assert simulated.facts["friction"][2] == {"t_s": 20.0, "coefficient": 0.02}  # type: ignore[index]
    assert "friction" not in synthesise("random", duration_s=1).facts


def test_the_scenarios_are_found_and_the_motion_does_not_depend_on_the_pose_rate():
    for name in ("paper-acceleration-traction-limited", "random-traction-limited"):
        runs = [
            synthesise(name, seed=3, duration_s=20, sensors=replace(QUIET, rate_hz=r)).truth
            for r in (100.0, 1000.0)
        ]
        assert np.abs(runs[0].x_m - runs[1].x_m[::10]).max() < 2e-3
        assert name in SCENARIOS


@pytest.mark.parametrize(
    ("changes", "message"), [({"mass_kg": None}, "mass_kg"), ({"alpha_yaw": 5.0}, "alpha_yaw")]
)
def test_a_robot_whose_traction_cannot_be_limited_is_refused(changes, message):
    with pytest.raises(InvalidSetting, match=message):
        synthesise("random-traction-limited", duration_s=1, robot=replace(PAPER_ROBOT, **changes))
