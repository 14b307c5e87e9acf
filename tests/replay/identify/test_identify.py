"""The identifier's parts against closed forms and Monte Carlo."""

import numpy as np
import pytest

from wmr_replay.align import SampleBatch
from wmr_replay.identify import Evidence, make_rules, motion_of, wheel_slip
from wmr_replay.identify.independence import (
    INDEPENDENT,
    NOT_INDEPENDENT,
    UNKNOWN,
    fresh_independence,
    track_independence,
)
from wmr_replay.identify.motion import Derived, Motion
from wmr_replay.identify.thresholds.identifier import PaperIdentifier, not_excluded
from wmr_replay.pipeline.chain import Chain
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas import RobotParameters
from wmr_schemas.modes import ModeSet

STEP_S = 0.01


def stamps(n, step_s=STEP_S):
    return 10**18 + np.round(np.arange(n) * step_s * 1e9).astype(np.int64)


def constant_gains(n, g00=0.01, g01=0.003, g11=0.4, g12=0.02, g22=30.0):
    gains = np.array([[g00, g01, 0.0], [g01, g11, g12], [0.0, g12, g22]])
    return np.repeat(gains[:, :, None], n, axis=2), gains


def test_standard_deviations_of_body_motion_are_those_of_monte_carlo():
    rng = np.random.default_rng(3)
    n = 200_000
    truth = np.array([[1.0, 2.0, 0.4], [-3.0, 1.5, -0.7], [0.8, 0.5, 0.1]])  # signal, order
    gains, covariance = constant_gains(n)
    sd = (0.02, 0.02, 0.03)
    root = np.linalg.cholesky(covariance)
    noise = np.stack([s * root @ rng.normal(size=(3, n)) for s in sd])
    variances = np.repeat(np.array([[sd[0] ** 2], [sd[2] ** 2]]), n, axis=1)
    estimated = motion_of(Derived.of(truth[:, :, None] + noise, gains, variances))
    exact = motion_of(Derived.of(np.repeat(truth[:, :, None], 1, axis=2), gains[:, :, :1], variances[:, :1]))
    for name in ("v_long_mps", "v_lat_mps", "yaw_rate_radps", "a_long_mps2", "yaw_acc_radps2"):
        assert getattr(exact, f"{name}_sd")[0] == pytest.approx(getattr(estimated, name).std(), rel=0.02), (
            name
        )


def test_body_motion_of_a_skidding_arc_is_its_closed_form():
    """A body with velocity (u, w) in its own frame, turning at ω: dv_long/dt = 0, world acceleration not."""
    yaw, rate, u, w = 0.7, 0.9, 2.0, -0.3
    e, n = np.array([np.cos(yaw), np.sin(yaw)]), np.array([-np.sin(yaw), np.cos(yaw)])
    velocity, acceleration = u * e + w * n, rate * (u * n - w * e)
    estimates = np.array(
        [[0, velocity[0], acceleration[0]], [0, velocity[1], acceleration[1]], [yaw, rate, 0]]
    )
    motion = motion_of(Derived.of(estimates[:, :, None], constant_gains(1)[0], np.zeros((2, 1))))
    assert motion.v_long_mps[0] == pytest.approx(u)
    assert motion.v_lat_mps[0] == pytest.approx(w)
    assert motion.a_long_mps2[0] == pytest.approx(0, abs=1e-12)


def test_wheel_slip_reads_what_the_wheel_speeds_say():
    radius, half_track, v, rate, total, difference = 0.35, 1.0, 2.0, 0.3, 0.12, -0.04
    right = (v + half_track * rate + 1.5 * (total + difference)) / radius
    left = (v - half_track * rate + 1.5 * (total - difference)) / radius
    motion = Motion(*(np.array([value]) for value in (v, 0.0, rate, *[0.0] * 7)))
    slip = wheel_slip(motion, np.array([[left], [right]]), radius, half_track)
    assert slip.sum_mps[0] == pytest.approx(total)
    assert slip.diff_mps[0] == pytest.approx(difference)
    assert np.isnan(wheel_slip(motion, np.array([[left], [right]]), None, half_track).sum_mps[0])


def odometry(rule, n=500, step_s=1 / 30):
    """A pose integrated from wheel speeds with the heading at the step's start, middle or end."""
    t = np.arange(n) * step_s
    v, rate = 0.3 + 0.2 * np.sin(t), 0.5 * np.cos(0.7 * t)
    yaw = np.concatenate([[0], np.cumsum(rate[:-1] * step_s)])
    heading = yaw[:-1] + {"start": 0.0, "middle": 0.5, "end": 1.0}[rule] * np.diff(yaw)
    x = np.concatenate([[0], np.cumsum(v[:-1] * step_s * np.cos(heading))])
    y = np.concatenate([[0], np.cumsum(v[:-1] * step_s * np.sin(heading))])
    return stamps(n, step_s), np.stack([x, y, yaw])


@pytest.mark.parametrize("rule", ["start", "middle", "end"])
def test_a_pose_integrated_from_wheel_speeds_is_recognised(rule):
    t_ns, pose = odometry(rule)
    verdict = track_independence(t_ns, pose, fresh_independence())
    assert (verdict[:20] == UNKNOWN).all()
    assert (verdict[25:] == NOT_INDEPENDENT).all()


@pytest.mark.parametrize("sd", [1e-3, 0.05])
def test_a_measured_pose_is_recognised_as_independent(sd):
    t_ns, pose = odometry("middle")
    verdict = track_independence(
        t_ns, pose + np.random.default_rng(0).normal(size=pose.shape) * sd, fresh_independence()
    )
    assert (verdict[60:] == INDEPENDENT).all()
    assert not (verdict == NOT_INDEPENDENT)[60:].any()


def test_what_the_constraints_leave_over():
    assert not_excluded(True, False, True, True) == ModeSet.SKIDDING
    assert not_excluded(False, True, True, True) == ModeSet.SLIPPING
    assert not_excluded(False, False, True, True) == ModeSet.IDEAL
    assert not_excluded(False, False, False, True) == ModeSet.IDEAL | ModeSet.SLIPPING == 0b101
    assert not_excluded(False, False, True, False) == ModeSet.IDEAL | ModeSet.SKIDDING
    assert not_excluded(False, False, False, False) == 0b111


def steered(n, alpha, slip_loss=0.0, slip_from=None, seed=0, noise=0.02):
    """Motion with known acceleration: torque steps, a turn, and a loss of traction from some row on."""
    rng = np.random.default_rng(seed)
    force = np.where((np.arange(n) // 300) % 2 == 0, 20.0, 8.0)
    gain = np.full(n, alpha)
    if slip_from is not None:
        gain[slip_from:] *= 1 - slip_loss
    zero = np.zeros(n)
    motion = Motion(
        np.full(n, 3.0), zero, np.full(n, 0.5), gain * force + rng.normal(size=n) * noise, zero,
        np.full(n, 0.01), np.full(n, 0.01), np.full(n, 0.01), np.full(n, noise), np.full(n, 0.01),
    )  # fmt: skip
    return motion, force


def identify(motion, force, robot, window_ns=100_000_000):
    rules = make_rules(robot, window_ns=window_ns, threshold_sd=3.0, min_c_k_mps=0.005, min_c_d_mps2=0.02)
    n = len(force)
    independence, unused = np.full(n, float(INDEPENDENT)), np.full((3, n), np.nan)
    evidence = Evidence(
        stamps(n),
        unused,
        unused[:2],
        motion,
        force,
        np.zeros(n),
        unused[:2],
        independence,
        unused[0] > 0,
        unused[:2],
        unused[:2],
    )
    return PaperIdentifier(rules).push(evidence)


def test_alpha_is_regressed_with_an_honest_interval_and_without_any_prior():
    robot = RobotParameters(mass_kg=20.0, cornering_stiffness_over_epsilon=10.0)
    errors = []
    for seed in range(60):
        motion, force = steered(2000, 0.031, seed=seed)
        verdict = identify(motion, force, robot)
        errors.append((verdict.alpha[-1] - 0.031) / verdict.alpha_sd[-1])
        assert verdict.alpha[-1] == pytest.approx(0.031, rel=0.02)
    assert 0.7 < np.std(errors) < 1.3


def test_slipping_rows_do_not_enter_alpha():
    robot = RobotParameters(alpha=0.031, mass_kg=20.0, cornering_stiffness_over_epsilon=10.0)
    motion, force = steered(3000, 0.031, slip_loss=0.9, slip_from=1500)
    verdict = identify(motion, force, robot)
    assert (verdict.mode[10:1490] == 0).mean() > 0.99
    assert (verdict.mode[1510:] == 2).mean() > 0.99
    assert verdict.alpha[-1] == pytest.approx(0.031, rel=0.02)


def test_without_torque_slipping_is_never_excluded():
    motion, force = steered(500, 0.031)
    verdict = identify(motion, np.full_like(force, np.nan), RobotParameters(alpha=0.031))
    assert (verdict.mode == -1).all()
    assert (verdict.mode_set & ModeSet.SLIPPING).all()
    assert not np.isfinite(verdict.c_d_mps2).any()


@pytest.mark.parametrize("rate_hz", [50, 200])
def test_torque_steps_leave_c_d_at_zero_in_ideal_rolling_without_noise(rate_hz):
    """Straight ideal rolling under stepping torques, in closed form: dv/dt = α F exactly."""
    alpha, n, step_s = 0.02, 12 * rate_hz, 1 / rate_hz
    force = np.random.default_rng(5).choice([-30.0, 0.0, 45.0], size=n // 20 + 1).repeat(20)[:n]
    acceleration = alpha * np.concatenate([[0.0], force[:-1]])
    v = 1.0 + np.cumsum(acceleration * step_s)
    x = np.concatenate([[0.0], np.cumsum(v[:-1] * step_s + acceleration[1:] * step_s**2 / 2)])
    t_ns = stamps(n, step_s)
    mean_effort = np.concatenate([[force[0]], force[:-1]]) / 2
    inputs = np.stack([mean_effort, mean_effort, np.full(n, np.nan), np.full(n, np.nan)])
    heading = 0.6
    rows = SampleBatch.measured(
        t_ns,
        np.stack([x * np.cos(heading), x * np.sin(heading), np.full(n, heading)]),
        inputs,
        np.zeros(n, np.int8),
    )
    chain = Chain(Settings(window_s=0.5), ReplayModel(RobotParameters(alpha=alpha)), rows)
    (columns,) = [*chain.push(rows), *chain.finish()]
    good = np.isfinite(columns["c_d_mps2"])
    assert good.sum() > n - rate_hz
    assert np.abs(columns["c_d_mps2"][good]).max() < 1e-8
    assert np.abs(columns["a_long_mps2"][good]).max() > 0.5
