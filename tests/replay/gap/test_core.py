"""The numeric core of the gap analysis against independent oracles.

The oracles are SciPy's integrator, sampled convolution, finite differences, least squares and the statistics
of white noise.
"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from scipy.signal import lfilter, savgol_filter

from wmr_replay.effects.efforts import InputEffects
from wmr_replay.effects.theta import N_THETA, Theta
from wmr_replay.gap.estimation.path_error import window_errors, windows_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.sensitivity import NO_TARGETS
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.dictionary import DEGREE, WINDOWS_BINS, columns_of, smoothed_slopes
from wmr_replay.gap.model.dynamics import N_ROW, N_STATE, Base, Row, step
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.model.inputs import TorqueHistory
from wmr_replay.gap.scan.score import normal_equations
from wmr_replay.gap.settings import GateSettings
from wmr_replay.gap.settings.filter import RefitSettings
from wmr_replay.pipeline.whole_colour import WholeColour
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import RobotParameters
from wmr_schemas.signals import Log, PoseTrack, TorqueTrack
from wmr_synth import hidden_log

BASE = Base(
    alpha=0.28,
    alpha_yaw=0.34,
    half_track_m=0.25,
    skid_decay_mps2=8.0,
    speed_mps=0.0,
    slip_share=0.25,
    slip_share_yaw=0.2,
    com_yaw_per_m=5.0,
    lateral_decay_per_s=5.0,
)
SETTINGS = GateSettings()
TORQUES = {Row.LEFT: 0.9, Row.RIGHT: 1.4}
EFFECTS = {
    "none": {},
    "payload": {Theta.MASS_RATIO: 0.3},
    "yaw_inertia": {Theta.YAW_INERTIA: 0.3},
    "drive_gain": {Theta.DRIVE_GAIN: -0.2},
    "rolling_resistance": {Theta.ROLLING: 0.2},
    "viscous_drag": {Theta.VISCOUS: 0.2},
    "aerodynamic_drag": {Theta.DRAG: 0.2, Theta.DRAG_YAW: 0.6},
    "scrub_torque": {Theta.SCRUB: 0.1},
    "yaw_damping": {Theta.YAW_DAMPING: 0.6},
    "wheel_coulomb": {Theta.WHEEL_COULOMB: 0.3},
    "wheel_viscous": {Theta.WHEEL_VISCOUS: 0.2},
    "slope": {Theta.GRADE_X: 0.3, Theta.GRADE_Y: -0.2},
    "com_offset": {Theta.COM_OFFSET: 0.03},
    "com_offset on a slope": {Theta.COM_OFFSET: 0.03, Theta.GRADE_X: 0.3, Theta.GRADE_Y: -0.2},
    "com_offset and yaw_inertia": {Theta.COM_OFFSET: 0.03, Theta.YAW_INERTIA: 0.4},
    "com_offset and payload": {Theta.COM_OFFSET: 0.03, Theta.MASS_RATIO: 0.4},
    "com_offset and load_step": {Theta.COM_OFFSET: 0.03, Theta.LOAD_STEP: 0.4},
    "cornering_stiffness": {Theta.CORNERING: -0.4},
    "load_step": {Theta.LOAD_STEP: 0.4},
    "slip_interval": {Theta.SLIP: 0.5},
    "low_friction_patch": {Theta.PATCH: 0.5},
}


def written(_, z, p, mode):
    """The equations of the catalogue, written once more: d/dt of (x, y, yaw, v, w, v_lat)."""
    _, _, yaw, v, w, v_lat = z
    yaw_rate = w / BASE.half_track_m
    at = lambda key: p.get(key, 0.0)  # noqa: E731
    left, right = TORQUES[Row.LEFT], TORQUES[Row.RIGHT]
    sgn = lambda speed: np.tanh(speed / 0.02)  # noqa: E731
    left -= at(Theta.WHEEL_COULOMB) * sgn(v - w) + at(Theta.WHEEL_VISCOUS) * (v - w)
    right -= at(Theta.WHEEL_COULOMB) * sgn(v + w) + at(Theta.WHEEL_VISCOUS) * (v + w)
    grip = (1 - at(Theta.SLIP)) * (1 - at(Theta.PATCH)) * (1 + at(Theta.DRIVE_GAIN))
    share, share_yaw = (BASE.slip_share, BASE.slip_share_yaw) if mode == ContactMode.SLIPPING else (1.0, 1.0)
    mass, inertia = (1 + at(Theta.MASS_RATIO)) * (1 + at(Theta.LOAD_STEP)), 1 + at(Theta.YAW_INERTIA)
    dv = BASE.alpha * share * grip / mass * (right + left)
    dw = BASE.alpha_yaw * share_yaw * grip / inertia * (right - left)
    dv -= at(Theta.ROLLING) * sgn(v) + at(Theta.VISCOUS) * v + at(Theta.DRAG) * v * abs(v)
    dv += at(Theta.GRADE_X) * np.cos(yaw) + at(Theta.GRADE_Y) * np.sin(yaw)
    dv += at(Theta.COM_OFFSET) * yaw_rate**2
    dw -= at(Theta.SCRUB) * sgn(w) + at(Theta.YAW_DAMPING) * w
    dw -= at(Theta.DRAG_YAW) * w * np.sqrt(v**2 + w**2)
    across = at(Theta.GRADE_Y) * np.cos(yaw) - at(Theta.GRADE_X) * np.sin(yaw)
    held = v * yaw_rate - across  # what the tyres hold at the axle, by mass
    dw -= BASE.com_yaw_per_m * at(Theta.COM_OFFSET) * mass / inertia * held
    dv_lat = -BASE.lateral_decay_per_s * v_lat
    if mode == ContactMode.SKIDDING:
        speed = max(np.sqrt(v**2 + v_lat**2 + w**2), 0.3)
        rate = BASE.skid_decay_mps2 * (1 + at(Theta.CORNERING)) * (1 - at(Theta.PATCH)) / speed
        dv_lat = -rate * v_lat - v * yaw_rate + across
        dv += v_lat * yaw_rate / 3
    dx = v * np.cos(yaw) - v_lat * np.sin(yaw)
    return [dx, v * np.sin(yaw) + v_lat * np.cos(yaw), yaw_rate, dv, dw, dv_lat]


def stepped(z0, p, mode, dt, n):
    """``n`` steps of the function under test."""
    theta, row = np.zeros(N_THETA), np.zeros(N_ROW)
    for place, value in p.items():
        theta[place] = value
    row[Row.DT], row[Row.MODE], row[Row.LOAD], row[Row.PATCH], row[Row.SLIP] = dt, mode, 1.0, 1.0, 1.0
    for place, value in TORQUES.items():
        row[place] = value
    z, ahead = np.zeros(N_STATE), np.zeros(N_STATE)
    z[:6] = z0
    for _ in range(n):
        step(z, row, theta, BASE, ahead)
        z[:] = ahead
    return z[:6]


@pytest.mark.parametrize("mode", [ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING])
@pytest.mark.parametrize("name", EFFECTS)
def test_steps_converge_to_the_solution_of_the_written_equations(name, mode):
    z0, p = [1.0, -2.0, 0.4, 1.1, 0.2, 0.05], EFFECTS[name]
    exact = solve_ivp(written, (0, 0.48), z0, args=(p, mode), rtol=1e-10, atol=1e-12).y[:, -1]
    coarse, fine = (np.abs(stepped(z0, p, mode, 0.48 / n, n) - exact).max() for n in (12, 48))
    assert coarse < 5e-3
    order = 1 if mode == ContactMode.SKIDDING else 2  # a skid's decay rate is that of the step's start
    assert fine < max(coarse / (4**order / 1.3), 1e-6)


EFFORT = st.lists(st.floats(-3, 3, allow_nan=False), min_size=6, max_size=30)


@settings(max_examples=25, deadline=None)
@given(
    EFFORT,
    st.sampled_from([0.0, 0.03, 0.2]),
    st.sampled_from([0.0, 0.05, 0.13]),
    st.sampled_from([0.0, 0.4]),
    st.sampled_from([np.inf, 1.0]),
)
def test_mean_torques_are_those_of_a_finely_sampled_actuator(efforts, lag_s, delay_s, deadzone_nm, limit_nm):
    fine_s, every = 1e-4, 500
    u = np.array(efforts)
    edges_s = np.arange(0.2, 0.05 * len(u) - 0.02, 0.04)
    assert len(edges_s) >= 2
    history = TorqueHistory(0.05 * np.arange(len(u)), np.stack([u, -u]))
    effects = InputEffects(lag_s=lag_s, delay_s=delay_s, deadzone_nm=deadzone_nm, limit_nm=limit_nm)
    means = history.means(edges_s, effects)
    acting = np.clip(np.sign(u) * np.maximum(np.abs(u) - deadzone_nm, 0), -limit_nm, limit_nm)
    held = np.repeat(acting, every)
    if lag_s:
        a = np.exp(-fine_s / lag_s)
        held = lfilter([1 - a], [1, -a], held, zi=[a * acting[0]])[0]
    held = np.concatenate([np.full(round(delay_s / fine_s), held[0]), held])
    area = np.concatenate([[0.0], np.cumsum(held) * fine_s])
    expected = np.diff(area[np.rint(edges_s / fine_s).astype(int)]) / np.diff(edges_s)
    np.testing.assert_allclose(means[0, 1:], expected, atol=0.02)
    np.testing.assert_allclose(means[1], -means[0])


def test_imbalance_and_bias_act_on_their_wheels():
    history = TorqueHistory(np.array([0.0]), np.array([[1.0], [2.0]]))
    effects = InputEffects(imbalance=0.1, bias_common_nm=0.3, bias_differential_nm=0.05)
    left, right = history.means(np.array([0.0, 0.04, 0.08]), effects)[:, -1]
    assert left == pytest.approx(1.0 * 0.9 + 0.3 - 0.05)
    assert right == pytest.approx(2.0 * 1.1 + 0.3 + 0.05)


SD = (0.004, 0.004, 0.003)
OU_LONG, OU_YAW = (0.05, 0.5), (0.03, 0.4)


def driven(seed, *, disturbed):
    """A minute of the base model at 100 Hz by a plain loop, as a log; noise ``SD``, OU disturbances."""
    rng = np.random.default_rng(seed)
    n, dt, l = 6000, 0.01, BASE.half_track_m
    wanted = np.repeat(rng.uniform(-1.5, 1.5, (n // 150, 2)), 150, axis=0) * [1.0, 0.15]
    z, d, path, sent = np.zeros(5), np.zeros(2), np.zeros((n, 3)), np.zeros((n, 2))
    for k in range(n):
        path[k] = z[:3]
        total, difference = 2 * (wanted[k] - z[3:]) / [BASE.alpha, BASE.alpha_yaw]
        sent[k] = (total - difference) / 2, (total + difference) / 2
        acc = np.array([BASE.alpha * total, BASE.alpha_yaw * difference]) + d
        v, yaw = z[3] + acc[0] * dt / 2, z[2] + z[4] / l * dt / 2
        z += dt * np.array([v * np.cos(yaw), v * np.sin(yaw), (z[4] + acc[1] * dt / 2) / l, *acc])
        if disturbed:
            for i, (sd, tau) in enumerate((OU_LONG, OU_YAW)):
                kept = np.exp(-dt / tau)
                d[i] = kept * d[i] + sd * np.sqrt(1 - kept**2) * rng.normal()
    t_ns = np.arange(n, dtype=np.int64) * 10_000_000
    pose = path + rng.normal(size=(n, 3)) * SD
    torque = TorqueTrack(t_ns, *sent.T.copy(), *np.full((2, n), np.nan))
    robot = RobotParameters(alpha=BASE.alpha, alpha_yaw=BASE.alpha_yaw, half_track_m=l)
    return Log(PoseTrack(t_ns, *pose.T.copy()), torque, None, robot)


NOISE = Diffusion(*OU_LONG, *OU_YAW, 1e-5, 0.2)


@pytest.fixture(scope="module")
def disturbed():
    """With the noise known to be white, as it is."""
    binned = bin_log(driven(1, disturbed=True), SETTINGS)
    return Problem.of(replace(binned, colour=WholeColour(*np.zeros((3, 2)))))


def test_the_root_density_is_that_of_the_autocorrelation():
    """Q = ∫ s² exp(−|t|/τ) dt over all lags, by quadrature."""
    for (sd, tau_s), density in zip((OU_LONG, OU_YAW), NOISE.densities_mps2_rthz, strict=True):
        half = quad(lambda t, sd=sd, tau_s=tau_s: sd**2 * np.exp(-t / tau_s), 0, np.inf)[0]
        assert density == pytest.approx(np.sqrt(2 * half))


def test_innovations_of_the_true_model_are_white(disturbed):
    e = disturbed.filtered(Extension(BASE), NOISE).innovations[50:]
    n = len(e)
    assert np.abs(e.mean(axis=0)).max() < 4 / np.sqrt(n)
    assert np.abs((e**2).mean(axis=0) - 1).max() < 4 * np.sqrt(2 / n) + 0.03
    normal = e / e.std(axis=0)
    lags = [np.abs((normal[k:] * normal[:-k]).mean(axis=0)).max() for k in range(1, 9)]
    assert max(lags) < 4.5 / np.sqrt(n)


def test_a_disturbance_that_may_be_a_wobble_counts_as_noise_in_part():
    """It makes innovations too small, not too large."""
    binned = bin_log(driven(1, disturbed=True), SETTINGS)
    assert 1.0 <= binned.colour.factor.min() <= binned.colour.factor.max() < 2.5


def test_innovations_of_a_wrong_model_are_not(disturbed):
    calm = NOISE._replace(long_sd_mps2=1e-3, yaw_sd_mps2=1e-3)
    e = disturbed.filtered(Extension(BASE), calm).innovations[50:]
    assert (e**2).mean() > 1.5


@pytest.mark.parametrize(
    "place", [Theta.VISCOUS, Theta.DRIVE_GAIN, Theta.GRADE_X, Theta.ARM_X, Theta.HEADING, Theta.YAW_DRIFT]
)
def test_sensitivities_are_finite_differences_of_the_innovations(disturbed, place):
    key = {
        Theta.VISCOUS: ("viscous_drag", "c1_per_s"),
        Theta.DRIVE_GAIN: ("drive_gain", "ratio"),
        Theta.GRADE_X: ("slope", "grade_x_mps2"),
        Theta.ARM_X: ("pose_lever_arm", "x_m"),
        Theta.HEADING: ("heading_misalignment", "angle_rad"),
        Theta.YAW_DRIFT: ("yaw_drift", "rate_radps"),
    }[place]
    output = disturbed.filtered(
        Extension(BASE), NOISE, NO_TARGETS._replace(places=np.array([place])), keep=True
    )
    sides = []
    for size in (-1e-4, 1e-4):
        other = {"slope": {"grade_y_mps2": 0.0}, "pose_lever_arm": {"y_m": 0.0}}.get(key[0], {})
        extension = Extension(BASE, {key[0]: {key[1]: size, **other}})
        sides.append(disturbed.filtered(extension, NOISE).innovations)
    expected = -(sides[1] - sides[0]) / 2e-4
    difference = np.linalg.norm(output.sensitivities[:, :, 0] - expected)
    assert difference < 0.05 * np.linalg.norm(expected)


def test_a_loss_that_is_long_over_is_forgotten_and_leaves_the_others_as_they_are(disturbed):
    """Against a filter that forgets nothing: what it forgets is nothing that anyone reads."""
    n = len(disturbed.binned)
    targets = NO_TARGETS._replace(cells=np.arange(n) // 10, n_cells=(n - 1) // 10 + 1)
    settings = disturbed.settings

    def sensitivities(forgotten):
        filtering = settings.filter._replace(forgotten=forgotten)
        other = disturbed.under(replace(settings, filter=filtering))
        return other.filtered(Extension(BASE), NOISE, targets, keep=True).sensitivities

    kept, told = sensitivities(0.0), sensitivities(settings.filter.forgotten)
    lost = (kept != 0.0) & (told == 0.0)
    assert np.mean(lost) > 0.05
    assert np.abs(kept[lost]).max() < 1e-8
    np.testing.assert_array_equal(told[~lost], kept[~lost])
    assert np.abs(told[:, :, :20]).max(axis=(0, 1)).min() > 1e-3


@pytest.mark.parametrize("window", WINDOWS_BINS)
def test_smoothed_slopes_are_those_of_savitzky_and_golay(window):
    path = np.cumsum(np.random.default_rng(3).normal(size=(120, 3)), axis=0)
    expected = savgol_filter(path, window, DEGREE, deriv=1, delta=0.04, axis=0)
    np.testing.assert_allclose(smoothed_slopes(path, 0.04, window), expected, atol=1e-10)


@pytest.mark.parametrize(("early_s", "late_s"), [(0.1, 4.0), (0.5, 4.0), (3.0, 5.0), (12.0, 19.8)])
def test_speeds_beside_a_hole_are_those_of_their_own_side(early_s, late_s):
    """Of a circle at .8 m/s, where a polynomial over the hole says many times as much."""
    log, _ = hidden_log("patrol", seed=4, duration_s=20, noise="mocap")
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    kept = (t_s < early_s) | (t_s > late_s)
    yaw = 0.4 * t_s
    pose = PoseTrack(log.pose.t_ns[kept], *(2 * np.stack([np.sin(yaw), -np.cos(yaw)])[:, kept]), yaw[kept])
    columns = columns_of(bin_log(replace(log, pose=pose), GateSettings()))
    np.testing.assert_allclose(columns["v"], 0.8, atol=0.1)
    np.testing.assert_allclose(columns["yaw_rate"], 0.4, atol=0.05)


def test_the_gain_of_a_candidate_is_the_drop_of_the_sum_of_squares():
    rng = np.random.default_rng(3)
    psi, e, known = rng.normal(size=(80, 3, 2)), rng.normal(size=(80, 3)), rng.normal(size=(80, 3, 2))

    def left(*parts):
        columns = np.concatenate(parts, axis=2).reshape(240, -1)
        return np.linalg.lstsq(columns, e.ravel(), rcond=None)[1][0]

    gain, _ = normal_equations(psi, e, None, RefitSettings()).gain([0, 1])
    assert gain == pytest.approx((e**2).sum() - left(psi))
    gain, _ = normal_equations(psi, e, known, RefitSettings()).gain([0, 1])
    assert gain == pytest.approx(left(known) - left(known, psi), rel=1e-6)


def test_the_gap_of_a_perfect_model_is_the_noise_floor():
    binned = bin_log(driven(2, disturbed=False), SETTINGS)
    windows = windows_of(binned, np.ones(len(binned), bool))
    assert len(windows) >= 14
    errors = window_errors(binned, Extension(BASE), windows)
    kept = 1 - 5 / (3 * 100)  # five fitted, of three by a hundred
    known = np.array([np.sqrt(2 * kept) * SD[0] / 2, np.sqrt(kept) * SD[2] / 2])
    seen = [np.sqrt(np.mean(part**2)) for part in (errors.position_m, errors.yaw_rad)]
    told = [np.sqrt(np.mean(part**2)) for part in (errors.floor_m, errors.floor_rad)]
    np.testing.assert_allclose(seen, known, rtol=0.08)
    np.testing.assert_allclose(told, known, rtol=0.08)
