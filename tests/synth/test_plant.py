"""The plant against SciPy, closed forms and the paper's remarks."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from wmr_schemas import PAPER_ROBOT, ModeTrack, RobotParameters
from wmr_schemas.arrays import F64, I8, I64, NS_PER_S
from wmr_schemas.errors import InvalidSetting
from wmr_synth.driving.drivers import ClosedLoop, Commands, Gains, Waypoints
from wmr_synth.plants.motion import Motion
from wmr_synth.plants.two_wheeled_loop import simulate

ALPHA = 0.35**2 / (3 * 1.6)


def grid(duration_s: float, rate_hz: float) -> I64:
    return np.rint(np.arange(round(duration_s * rate_hz) + 1) * (NS_PER_S / rate_hz)).astype(np.int64)


def drive(
    modes: ModeTrack,
    torque_ns: I64,
    left_nm: F64,
    right_nm: F64,
    pose_ns: I64,
    start: tuple[float, float],
    robot: RobotParameters = PAPER_ROBOT,
) -> Motion:
    nothing = np.zeros(len(torque_ns))
    commands = Commands(left_nm, right_nm, nothing, nothing, Gains(0.0, 0.0, np.inf))
    return simulate(robot, modes, commands, torque_ns, pose_ns, start)


def constant_drive(
    mode: int, left_nm: float, right_nm: float, duration_s: float, start: tuple[float, float]
) -> Motion:
    modes = ModeTrack(np.zeros(1, np.int64), np.full(1, mode, np.int8))
    one = np.zeros(1, np.int64)
    return drive(modes, one, np.full(1, left_nm), np.full(1, right_nm), grid(duration_s, 100), start)


def oracle_rhs(mode: int, u_1: float, u_2: float, v_fixed: float | None):
    """Equation (1) in the transformed variables with the published numbers, written down a second time."""
    g_x, g_y, m, i_theta, i_phi, l, r = 4e3, 1e4, 1000.0, 500.0, 1.6, 1.0, 0.35

    def rhs(_t: float, xi: F64) -> list[float]:
        _, _, theta, v_x, v_y, v_th, s_1, s_2 = xi
        v = v_fixed or max(0.3, np.sqrt(v_x**2 + v_y**2 + v_th**2))
        k = g_y / v
        pose = [
            v_x * np.cos(theta) - v_y * np.sin(theta),
            v_x * np.sin(theta) + v_y * np.cos(theta),
            v_th / l,
        ]
        skid = -2 * g_x / (m * v) * v_x + v_y * v_th / l if mode in (1, 3) else 0.0
        if mode in (0, 1):
            coupling = v_x * v_th / (3 * l) if mode == 1 else 0.0
            return [*pose, skid, -coupling - ALPHA * (u_1 + u_2), -ALPHA * (u_1 - u_2), 0.0, 0.0]
        both = v_x * v_th if mode == 3 else 0.0
        return [
            *pose,
            skid,
            -3 * k / m * s_2 - both / l,
            -3 * l**2 * k / i_theta * s_1,
            -(r**2 / i_phi + 2 * l**2 / i_theta) * k * s_1 + ALPHA * (u_1 - u_2),
            -(r**2 / i_phi + 2 / m) * k * s_2 - 2 / (3 * l) * both + ALPHA * (u_1 + u_2),
        ]

    return rhs


def oracle(
    modes: ModeTrack, torque_ns: I64, left_nm: F64, right_nm: F64, start: tuple[float, float], v: float | None
) -> tuple[I64, F64]:
    """Instants of every switch and torque, and the states there, by DOP853 at 1e-12 between them."""
    events = np.union1d(torque_ns, modes.t_ns)
    xi = np.array([0, 0, -np.pi / 2, 0, start[0], start[1], 0, 0], float)
    states: list[F64] = []
    for begin, end in pairwise(events.tolist()):
        mode = int(modes.mode[np.searchsorted(modes.t_ns, begin, side="right") - 1])
        if begin in modes.t_ns:
            xi[3] *= mode in (1, 3)
            xi[6:] *= mode in (2, 3)
        k = np.searchsorted(torque_ns, begin, side="right") - 1
        rhs = oracle_rhs(mode, -right_nm[k], -left_nm[k], v)
        span = (0.0, (end - begin) / NS_PER_S)
        xi = solve_ivp(rhs, span, xi, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1].copy()
        states.append(xi.copy())
    return events[1:], np.array(states)


@pytest.mark.parametrize("average_speed_mps", ["auto", 0.5])
def test_error_against_a_tight_scipy_integration_stays_below_a_micrometre_over_a_minute(average_speed_mps):
    rng = np.random.default_rng(1)
    switches_ns = (np.arange(0, 60, 3.7) * NS_PER_S).astype(np.int64)
    mode: I8 = np.array([0, 1, 2, 3, 1, 0, 2, 3, 0, 3, 2, 1, 2, 0, 3, 1, 2], np.int8)
    modes = ModeTrack(switches_ns, mode)
    torque_ns = grid(60, 20)
    swing_nm = 12 * np.sin(2 * np.pi * torque_ns / NS_PER_S / 9)
    left_nm, right_nm = (swing_nm + rng.normal(0, 10, len(torque_ns)) for _ in range(2))
    fixed = None if average_speed_mps == "auto" else average_speed_mps
    t_ns, states = oracle(modes, torque_ns, left_nm, right_nm, (1.5, 0.3), fixed)
    robot = replace(PAPER_ROBOT, average_speed_mps=average_speed_mps)
    for rate_hz in (100, 1000):
        motion = drive(modes, torque_ns, left_nm, right_nm, grid(60, rate_hz), (1.5, 0.3), robot).at(t_ns)
        assert np.hypot(motion.x_m - states[:, 0], motion.y_m - states[:, 1]).max() <= 1e-6
        assert np.abs(motion.yaw_rad - np.pi / 2 - states[:, 2]).max() <= 1e-6
        assert np.abs(motion.v_long_mps - states[:, 4]).max() <= 1e-6


def test_pose_rate_does_not_change_the_motion_beyond_the_integration_error():
    modes = ModeTrack(np.zeros(1, np.int64), np.array([2], np.int8))
    torque_ns = grid(10, 10)
    left_nm = 20 * np.sin(np.arange(len(torque_ns)))
    runs = [
        drive(modes, torque_ns, left_nm, -left_nm, grid(10, rate), (0.2, 0.0)).at(torque_ns)
        for rate in (10, 1000)
    ]
    assert np.abs(runs[0].x_m - runs[1].x_m).max() <= 1e-7


def test_ideal_rolling_straight_on_is_a_parabola_in_time():
    motion = constant_drive(0, 10.0, 10.0, 20.0, (2.0, 0.0))
    t_s = motion.t_ns / NS_PER_S
    assert motion.x_m == pytest.approx(2.0 * t_s + 0.5 * ALPHA * 20.0 * t_s**2, abs=1e-9)
    assert np.abs(motion.y_m).max() <= 1e-9


def test_ideal_rolling_without_torque_is_a_circle():
    motion = constant_drive(0, 0.0, 0.0, 30.0, (1.5, 0.5))
    t_s = motion.t_ns / NS_PER_S
    assert motion.x_m == pytest.approx(3.0 * np.sin(0.5 * t_s), abs=1e-9)
    assert motion.y_m == pytest.approx(3.0 * (1 - np.cos(0.5 * t_s)), abs=1e-9)


def test_turning_follows_alpha_yaw_and_driving_follows_alpha():
    robot = replace(PAPER_ROBOT, alpha=0.05, alpha_yaw=0.2, half_track_m=0.5)
    modes = ModeTrack(np.zeros(1, np.int64), np.zeros(1, np.int8))
    one = np.zeros(1, np.int64)
    motion = drive(modes, one, np.array([1.0]), np.array([4.0]), grid(2, 100), (0.0, 0.0), robot)
    assert motion.v_long_mps[-1] == pytest.approx(0.05 * 5.0 * 2.0)
    assert motion.yaw_rate_radps[-1] == pytest.approx(0.2 * 3.0 / 0.5 * 2.0)


def test_skidding_settles_where_centrifugal_and_lateral_force_balance():
    modes = ModeTrack(np.zeros(1, np.int64), np.ones(1, np.int8))
    one, zero = np.zeros(1, np.int64), np.zeros(1)
    robot = replace(PAPER_ROBOT, average_speed_mps=0.5)
    motion = drive(modes, one, zero, zero, grid(2, 100), (0.5, 0.1), robot)
    decay_per_s = 2 * 4000.0 / (1000.0 * 0.5)
    assert motion.v_lat_mps[-1] == pytest.approx(-0.5 * 0.1 / decay_per_s, rel=1e-2)


def test_published_numbers_leave_under_four_percent_of_the_traction_when_slipping():
    modes = ModeTrack(np.zeros(1, np.int64), np.full(1, 2, np.int8))
    one, effort_nm = np.zeros(1, np.int64), np.full(1, 10.0)
    robot = replace(PAPER_ROBOT, average_speed_mps=2.0)
    motion = drive(modes, one, effort_nm, effort_nm, grid(2, 100), (2.0, 0.0), robot)
    ideal = ALPHA * 20.0
    expected = (3 / 1000.0) / (0.35**2 / 1.6 + 2 / 1000.0)
    assert motion.a_long_mps2[-1] / ideal == pytest.approx(expected, rel=1e-6)
    assert expected == pytest.approx(0.038, abs=5e-4)


RESETS = {
    0: {"v_lat_mps", "sigma_sum_mps", "sigma_diff_mps"},
    1: {"sigma_sum_mps", "sigma_diff_mps"},
    2: {"v_lat_mps"},
    3: set[str](),
}
CONTINUOUS = (
    "x_m",
    "y_m",
    "yaw_rad",
    "v_long_mps",
    "v_lat_mps",
    "yaw_rate_radps",
    "sigma_sum_mps",
    "sigma_diff_mps",
)


def test_switches_make_the_papers_jumps_and_leave_the_rest_continuous():
    switches_ns = grid(7, 1)
    mode: I8 = np.array([3, 0, 3, 1, 3, 2, 3, 1], np.int8)
    torque_ns = np.zeros(1, np.int64)
    motion = drive(
        ModeTrack(switches_ns, mode), torque_ns, np.array([8.0]), np.array([12.0]), grid(7, 1000), (2.0, 0.5)
    )
    for switch_ns, into in zip(switches_ns[1:].tolist(), mode[1:].tolist(), strict=True):
        at = int(np.searchsorted(motion.t_ns, switch_ns))
        reset = RESETS[into]
        for name in CONTINUOUS:
            value = getattr(motion, name)
            expected = 0.0 if name in reset else value[at - 1]
            assert value[at] == pytest.approx(expected, abs=0.0 if name in reset else 6e-3), (name, into)


def test_wheel_speeds_obey_the_slip_relation_and_wheel_angles_are_their_integral():
    motion = constant_drive(3, 5.0, 15.0, 3.0, (2.0, 0.4))
    r, l = 0.35, 1.0
    right_mps = (
        motion.v_long_mps + l * motion.yaw_rate_radps + 1.5 * (motion.sigma_sum_mps + motion.sigma_diff_mps)
    )
    left_mps = (
        motion.v_long_mps - l * motion.yaw_rate_radps + 1.5 * (motion.sigma_sum_mps - motion.sigma_diff_mps)
    )
    assert r * motion.right_radps == pytest.approx(right_mps, abs=1e-12)
    assert r * motion.left_radps == pytest.approx(left_mps, abs=1e-12)
    assert motion.sigma_sum_mps[-1] > 0  # driven wheels turn faster than the ground passes
    steps = np.diff(motion.right_rad) * 100
    middle = (motion.right_radps[1:] + motion.right_radps[:-1]) / 2
    assert steps[50:] == pytest.approx(middle[50:], abs=1e-3)


def test_torque_holds_from_its_stamp_on_and_never_acts_earlier():
    torque_ns = np.array([0, NS_PER_S], np.int64)
    modes = ModeTrack(np.zeros(1, np.int64), np.zeros(1, np.int8))
    efforts_nm = np.array([0.0, 10.0])
    motion = drive(modes, torque_ns, efforts_nm, efforts_nm, grid(2, 100), (0.0, 0.0))
    early = motion.t_ns < NS_PER_S
    assert np.all(motion.v_long_mps[early] == 0)
    assert motion.effort_left_nm[~early] == pytest.approx(10.0)
    assert motion.v_long_mps[-1] == pytest.approx(ALPHA * 20.0)


def test_closed_loop_reaches_its_references_within_the_effort_limit():
    driver = ClosedLoop(Waypoints((0.0, 100.0), (1.0, 1.0), (0.3, 0.3)), Gains(2.0, 0.5, 15.0))
    torque_ns = grid(20, 100)
    modes = ModeTrack(np.zeros(1, np.int64), np.zeros(1, np.int8))
    commands = driver.commands(torque_ns / NS_PER_S)
    motion = simulate(PAPER_ROBOT, modes, commands, torque_ns, torque_ns, (0.0, 0.0))
    assert motion.v_long_mps[-1] == pytest.approx(1.0, abs=0.01)
    assert motion.yaw_rate_radps[-1] == pytest.approx(0.3, abs=0.01)
    assert np.abs(motion.effort_left_nm).max() <= 15.0


@pytest.mark.parametrize(
    ("mode", "missing"),
    [
        (0, ["wheel_radius_m"]),
        (1, ["mass_kg", "average_speed_mps"]),
        (2, ["yaw_inertia_kgm2", "wheel_inertia_kgm2"]),
    ],
)
def test_parameters_that_a_mode_needs_are_named_when_missing(mode, missing):
    robot = replace(PAPER_ROBOT, **dict.fromkeys(missing))
    modes = ModeTrack(np.zeros(1, np.int64), np.full(1, mode, np.int8))
    one, zero = np.zeros(1, np.int64), np.zeros(1)
    with pytest.raises(InvalidSetting, match="lacks") as error:
        drive(modes, one, zero, zero, grid(1, 10), (0.0, 0.0), robot)
    assert all(key in str(error.value) for key in missing)


def test_ideal_rolling_needs_no_stiffness_or_mass():
    robot = RobotParameters(alpha=0.1, half_track_m=0.2, wheel_radius_m=0.05)
    modes = ModeTrack(np.zeros(1, np.int64), np.zeros(1, np.int8))
    motion = drive(modes, np.zeros(1, np.int64), np.ones(1), np.ones(1), grid(1, 10), (0.0, 0.0), robot)
    assert motion.v_long_mps[-1] == pytest.approx(0.2)
