"""The identifier `algebraic`: its regressions against closed forms, its modes on simulated logs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from wmr_replay.differentiate import Differentiator, KernelSpec
from wmr_replay.effects.theta import theta_of
from wmr_replay.identify import Evidence, Motion, make_rules, motion_of
from wmr_replay.identify.algebraic import AlgebraicIdentifier, make_priors
from wmr_replay.identify.algebraic import regression as reg
from wmr_replay.identify.independence import INDEPENDENT, NOT_INDEPENDENT
from wmr_replay.identify.motion import Derived
from wmr_replay.identify.terms import Terms
from wmr_schemas import PAPER_ROBOT, RobotParameters
from wmr_schemas.modes import ContactMode
from wmr_schemas.status import Status
from wmr_synth import Sensors, synthesise

NO_TERMS = Terms()
IDEAL, SKIDDING, SLIPPING = ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING
QUIET = Sensors(rate_hz=100.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.01)
PAPER = Sensors(rate_hz=1000.0, noise_xy_sd_m=0.1**0.5, noise_yaw_sd_rad=0.1**0.5)
BLIND_ROBOT = RobotParameters(alpha=PAPER_ROBOT.alpha, half_track_m=PAPER_ROBOT.half_track_m)
"""All that the identifier may use: no mass, no stiffness, no speed."""


def evidence_of(name, seed, sensors, duration_s=None, window_s=0.4):
    """What the identifier gets on a scenario, the true mode at each row, and the seconds since the start."""
    log = synthesise(name, seed=seed, sensors=sensors, duration_s=duration_s).log
    t_ns = log.pose.t_ns
    pose = np.stack([log.pose.x_m, log.pose.y_m, np.unwrap(log.pose.yaw_rad)])
    held = np.maximum(np.searchsorted(log.torque.t_ns, t_ns, side="left") - 1, 0)
    efforts = np.stack([log.torque.left_nm, log.torque.right_nm])[:, held]
    differentiator = Differentiator(
        KernelSpec(2, 0, 0, 0.0), window_s=window_s, step_s=1 / sensors.rate_hz, folds=(2, 2)
    )
    derivatives = differentiator.push(t_ns, pose, efforts)
    variances = np.ones((2, len(t_ns))) * [[sensors.noise_xy_sd_m**2], [sensors.noise_yaw_sd_rad**2]]
    motion = motion_of(Derived.of(derivatives.estimates, derivatives.gains, variances))
    force = derivatives.inputs[0] + derivatives.inputs[1]
    true = log.mode.mode[np.searchsorted(log.mode.t_ns, t_ns, side="right") - 1]
    nothing, independence = np.zeros(len(t_ns)), np.full(len(t_ns), float(INDEPENDENT))
    return (
        Evidence(
            t_ns,
            pose,
            efforts,
            motion,
            force,
            nothing,
            variances,
            independence,
            nothing > 0,
            efforts,
            efforts,
        ),
        true,
        (t_ns - t_ns[0]) * 1e-9,
    )


def speed_of(evidence):
    """Speed along the path, from the pose over .5 s."""
    steps = np.hypot(*(evidence.pose[:2, 50:] - evidence.pose[:2, :-50])) / 0.5
    return np.concatenate([np.full(25, steps[0]), steps, np.full(25, steps[-1])])


def part(evidence, rows):
    motion = Motion(*(column[rows] for column in evidence.motion))
    return Evidence(*(motion if item is evidence.motion else item[..., rows] for item in evidence))


def identify(evidence, robot=BLIND_ROBOT, cuts=(), terms=NO_TERMS):
    rules = make_rules(robot, window_ns=400_000_000, threshold_sd=3.0, min_c_k_mps=0.005, min_c_d_mps2=0.02)
    identifier = AlgebraicIdentifier(robot, rules, terms=terms)
    edges = [0, *sorted(cuts), len(evidence.t_ns)]
    verdicts = [identifier.push(part(evidence, slice(a, b))) for a, b in pairwise(edges)]
    columns = [verdict[: verdict._fields.index("wheels")] for verdict in verdicts]  # no wheel speeds here
    return type(verdicts[0])(*(np.concatenate(parts, axis=-1) for parts in zip(*columns, strict=True)))


@pytest.fixture(scope="module")
def quiet():
    return evidence_of("random", 4, QUIET, duration_s=30)


@pytest.fixture(scope="module")
def quiet_verdict(quiet):
    return identify(quiet[0])


def same_bits(one, other):
    pairs = list(zip(one, other, strict=True))
    assert all((a is None) == (b is None) for a, b in pairs)
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs if a is not None)


@given(cuts=st.lists(st.integers(0, 3000), max_size=12))
@settings(max_examples=15, deadline=None)
def test_batches_change_no_bit(quiet, quiet_verdict, cuts):
    assert same_bits(identify(quiet[0], cuts=cuts), quiet_verdict)


@given(stop=st.integers(1, 3000))
@settings(max_examples=15, deadline=None)
def test_a_prefix_of_the_rows_gives_a_prefix_of_the_verdict(quiet, quiet_verdict, stop):
    prefix = identify(part(quiet[0], slice(stop)))
    assert same_bits(prefix, [column if column is None else column[..., :stop] for column in quiet_verdict])


def rates(mode, force, difference, alpha, yaw_gain, decay, own):
    """The three modes as in the reference model, in robot conventions; ``own`` is ρα while slipping."""

    def rate(_, z):
        _, _, yaw, v, w, turn = z
        cos, sin = np.cos(yaw), np.sin(yaw)
        lateral = w if mode == SKIDDING else 0.0
        push = own * force if mode == SLIPPING else alpha * force + lateral * turn / 3
        slide = -decay * w - v * turn if mode == SKIDDING else 0.0
        twist = yaw_gain * difference * (0.1 if mode == SLIPPING else 1.0)
        return [v * cos - lateral * sin, v * sin + lateral * cos, turn, push, slide, twist]

    return rate


@pytest.mark.parametrize("mode", [IDEAL, SKIDDING, SLIPPING])
def test_a_regressions_step_is_the_modes_own_equations_to_third_order(mode):
    force, difference, alpha, yaw_gain, decay = 20.0, 6.0, 0.03, 0.02, 3.0
    own = {IDEAL: 0.0, SKIDDING: -0.2, SLIPPING: 0.006}[mode]
    start = np.array([1.0, 2.0, 0.7, 2.0, own, 0.4, alpha, yaw_gain, np.log(decay)])
    priors = make_priors(BLIND_ROBOT)
    errors = []
    for dt_s in (0.08, 0.04):
        at = reg.Reference(
            start[2] + 0.5 * dt_s * start[5], start[3], start[4], start[5], alpha, yaw_gain, start[8]
        )
        matrix = np.zeros((6, 10))
        reg.transition(mode, at, reg.Step(dt_s, force, difference), priors, matrix)
        state = np.append(start[:4], [own if mode == SKIDDING else 0.0, start[5]])
        rate = rates(mode, force, difference, alpha, yaw_gain, decay, own)
        exact = solve_ivp(rate, (0, dt_s), state, rtol=1e-11, atol=1e-13).y[:, -1]
        found = matrix @ np.append(start, 1.0)
        rows = [0, 1, 2, 3, 5] + ([4] if mode == SKIDDING else [])
        errors.append(np.abs(found[rows] - exact[rows]).max())
    assert errors[1] < 2e-3
    assert errors[1] < errors[0] / 3


def test_corrections_are_weighted_least_squares():
    """Against the normal equations of prior and pose, and the density of the pose under the prior."""
    rng = np.random.default_rng(2)
    root = rng.normal(size=(9, 9))
    prior, mean, pose = root @ root.T + np.eye(9), rng.normal(size=9), rng.normal(size=3)
    variances = np.array([0.5, 0.6, 0.1])
    picks = np.eye(3, 9)
    information = np.linalg.inv(prior) + picks.T @ np.diag(1 / variances) @ picks
    expected = np.linalg.solve(information, np.linalg.solve(prior, mean) + picks.T @ (pose / variances))
    spread, error = prior[:3, :3] + np.diag(variances), pose - mean[:3]
    found, covariance = mean.copy(), prior.copy()
    log_likelihood, chi_square = reg.measurement_update(found, covariance, pose, variances, np.zeros(9))
    assert found == pytest.approx(expected, rel=1e-9)
    assert covariance == pytest.approx(np.linalg.inv(information), rel=1e-8, abs=1e-9)
    assert chi_square == pytest.approx(error @ np.linalg.solve(spread, error))
    assert log_likelihood == pytest.approx(-0.5 * chi_square - 0.5 * np.linalg.slogdet(spread)[1])


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_the_papers_scenario_is_identified_and_alpha_found_from_a_nominal_off_by_a_factor_2(factor):
    evidence, true, t_s = evidence_of("paper-acceleration", 3, PAPER)
    verdict = identify(evidence, replace(BLIND_ROBOT, alpha=factor * PAPER_ROBOT.alpha))
    after = t_s > 12
    assert (verdict.mode == true)[after].mean() > 0.94
    assert verdict.alpha[-1] == pytest.approx(PAPER_ROBOT.alpha, rel=0.01)
    assert abs(verdict.alpha[-1] - PAPER_ROBOT.alpha) < 4 * verdict.alpha_sd[-1]


def test_random_drives_are_identified_with_calibrated_probabilities():
    right, confidence = [], []
    for seed in range(4):
        evidence, true, t_s = evidence_of("random", seed, QUIET, duration_s=90)
        verdict = identify(evidence, replace(BLIND_ROBOT, alpha=1.4 * PAPER_ROBOT.alpha))
        rows = t_s > 1.5
        right.append((verdict.posterior[:3].argmax(axis=0) == true)[rows])
        confidence.append(verdict.posterior[:3, rows].max(axis=0))
        assert np.allclose(verdict.posterior[:3, rows].sum(axis=0), 1)
        assert verdict.alpha[-1] == pytest.approx(PAPER_ROBOT.alpha, rel=0.01)
    right, confidence = np.concatenate(right), np.concatenate(confidence)
    assert right.mean() > 0.92
    bins = np.minimum((confidence * 10).astype(int), 9)
    ece = sum(abs(confidence[bins == k].sum() - right[bins == k].sum()) for k in range(10)) / len(right)
    assert ece < 0.04


def test_in_uniform_motion_skidding_alone_is_named():
    evidence, true, t_s = evidence_of("paper-uniform", 2, PAPER, window_s=2.0)
    verdict = identify(evidence)
    rows = t_s > 3
    assert (verdict.mode[rows & (true == SKIDDING)] == SKIDDING).mean() > 0.9
    rolling = rows & (true != SKIDDING)
    assert (verdict.mode[rolling] == -1).mean() > 0.85
    unseen = rolling & (verdict.outcome == Status.NOT_EXCITED)
    assert unseen.sum() > 0.85 * rolling.sum()
    assert (verdict.mode_set[unseen] == 0b101).mean() > 0.4
    assert (verdict.mode_set[unseen] & 0b101 == 0b101).all()


def test_without_torque_skidding_is_still_seen_and_slipping_never_excluded():
    evidence, true, t_s = evidence_of("random", 10, QUIET, duration_s=60)
    blind = evidence._replace(efforts=evidence.efforts * np.nan, force=evidence.force * np.nan)
    verdict = identify(blind)
    rows = t_s > 3
    assert (verdict.mode[rows & (true == SKIDDING)] == SKIDDING).mean() > 0.85
    assert not (verdict.mode[rows] == SLIPPING).any()
    undecided = rows & (verdict.mode == -1)
    assert (verdict.mode_set[undecided & (verdict.outcome == Status.NO_TORQUE)] & 0b101 == 0b101).all()
    assert (verdict.outcome[undecided] == Status.NO_TORQUE).mean() > 0.9


def test_without_a_nominal_alpha_one_is_found(quiet):
    evidence, true, t_s = quiet
    verdict = identify(evidence, RobotParameters())
    assert (verdict.mode == true)[t_s > 3].mean() > 0.85
    assert verdict.alpha[-1] == pytest.approx(PAPER_ROBOT.alpha, rel=0.02)


def test_a_pose_jump_is_said_to_be_one_and_is_no_skid():
    evidence, true, t_s = evidence_of("random", 4, QUIET, duration_s=30)
    at = int(np.flatnonzero((true[:-150] == IDEAL) & (true[150:] == IDEAL) & (t_s[:-150] > 5))[0])
    evidence.pose[0, at:] += 0.5
    near = slice(at + 10, at + 150)
    verdict = identify(evidence)
    assert (verdict.outcome[near] == Status.POSE_JUMP).any()
    assert not (verdict.mode[near] == SKIDDING).any()


def test_single_outliers_are_passed_over(quiet, quiet_verdict):
    evidence = quiet[0]._replace(pose=quiet[0].pose.copy())
    evidence.pose[1, 500::100] += 3.0
    verdict = identify(evidence)
    assert (verdict.outcome[500::100] == Status.OUTLIER).all()
    assert (verdict.mode == quiet_verdict.mode).mean() > 0.97
    assert verdict.alpha[-1] == pytest.approx(quiet_verdict.alpha[-1], rel=0.005)


@pytest.mark.parametrize("factor", [0.75, 1.4])
def test_alpha_is_followed_when_the_load_changes(factor):
    """Torques shown 1/factor as large from the middle on are those of a robot with ``factor`` times the α."""
    evidence, true, t_s = evidence_of("random", 10, QUIET, duration_s=60)
    half = len(t_s) // 2
    evidence.efforts[:, half:] /= factor
    verdict = identify(evidence)
    assert verdict.alpha[half - 1] == pytest.approx(PAPER_ROBOT.alpha, rel=0.01)
    assert verdict.alpha[-1] == pytest.approx(factor * PAPER_ROBOT.alpha, rel=0.01)
    assert (verdict.mode == true)[half + 1000 :].mean() > 0.85


def test_after_a_gap_the_windows_begin_anew_and_alpha_is_kept(quiet):
    evidence, _, t_s = quiet
    kept = (t_s < 15) | (t_s > 18)
    verdict = identify(part(evidence, np.flatnonzero(kept)))
    resumed = np.flatnonzero(t_s[kept] > 18)[0]
    assert np.isnan(verdict.posterior[0, resumed + 10 : resumed + 90]).all()
    assert np.isfinite(verdict.posterior[:3, resumed + 120 :]).all()
    assert verdict.alpha[resumed + 120] == pytest.approx(PAPER_ROBOT.alpha, rel=0.02)


def test_a_models_drag_is_no_slip():
    """A drag that the pose shows (x″ is less by c₁v) and the model knows leaves modes and α as they were."""
    evidence, true, t_s = evidence_of("paper-alpha-ideal", 1, QUIET, duration_s=40)
    drag = Terms(theta_of([("viscous_drag", {"c1_per_s": -0.15})], 1.0), half_track_m=1.0)
    efforts = evidence.efforts - 0.15 * speed_of(evidence) / PAPER_ROBOT.alpha / 2
    hidden = evidence._replace(efforts=efforts, force=efforts.sum(axis=0))
    rows = t_s > 5
    knowing = identify(hidden, terms=drag)
    assert (knowing.mode == true)[rows].mean() > 0.97
    assert knowing.alpha[-1] == pytest.approx(PAPER_ROBOT.alpha, rel=0.02)
    assert abs(identify(hidden).alpha[-1] / PAPER_ROBOT.alpha - 1) > 0.05


def test_a_pose_from_wheel_speeds_gives_no_mode(quiet):
    evidence, _, t_s = quiet
    verdict = identify(evidence._replace(independence=np.full(len(t_s), float(NOT_INDEPENDENT))))
    rows = t_s > 1.5
    assert (verdict.mode == -1).all()
    assert (verdict.mode_set[rows] == 0b111).all()
    assert (verdict.outcome[rows] == Status.POSE_NOT_INDEPENDENT).all()


def test_an_hour_loses_no_precision():
    """Covariances that are only ever updated stay positive, and α its error, over 90 000 bins."""
    evidence, true, t_s = evidence_of("random", 1, replace(QUIET, rate_hz=25.0), duration_s=3600)
    verdict = identify(evidence)
    late = t_s > 3000
    assert (verdict.mode == true)[late].mean() > 0.85
    assert np.isfinite(verdict.alpha_sd[t_s > 1.5]).all()
    assert np.median(verdict.alpha[late]) == pytest.approx(PAPER_ROBOT.alpha, rel=0.005)
