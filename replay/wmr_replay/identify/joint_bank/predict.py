"""Prediction of a hypothesis by wheel speeds and torques."""

import math

from wmr_replay.identify.filter_bank.hypotheses import HypothesisSet
from wmr_replay.identify.filter_bank.steps import LONGEST_HOLE_S
from wmr_replay.identify.joint_bank.priors import JOINT_PRIORS
from wmr_replay.identify.joint_bank.states import (
    AHEAD,
    ALPHA,
    AROUND,
    BETA,
    DRAG,
    DRAG_TURN,
    E_DIFF,
    E_SUM,
    LOST,
)
from wmr_replay.identify.joint_bank.switches import as_mode, slips_away
from wmr_replay.identify.joint_bank.traction import Axis, Step, follow_traction
from wmr_replay.identify.wheel_bank.predict import (
    ACTIVE_TIME_S,
    CALM_TIME_S,
    SKID_VARIANCE,
    body_motion,
    fade,
    fade_slips,
    predict_pose,
    spread_pose,
)
from wmr_replay.identify.wheel_bank.states import (
    LN_SCALE,
    S_DIFF,
    S_LAT,
    S_SUM,
    SKIDDING,
    SKIDDING_SLIPPING,
)
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

LONGEST_STEP_S = 0.05
AHEAD_AXIS = Axis(S_SUM, ALPHA, DRAG, AHEAD, E_SUM)
TURN_AXIS = Axis(S_DIFF, BETA, DRAG_TURN, AROUND, E_DIFF)
TIMING_SD_S = JOINT_PRIORS.timing_sd_s
SLIP_DIFFUSION, BURST_DIFFUSION = JOINT_PRIORS.slip_diffusion, JOINT_PRIORS.burst_diffusion
LEAST_VARIANCE = JOINT_PRIORS.least_sd_mps**2
COUPLING_SD, SPINNING_SD = JOINT_PRIORS.coupling_sd, JOINT_PRIORS.spinning_sd
LOST_SHARE, LOST_SHARE_SD = JOINT_PRIORS.lost_share, JOINT_PRIORS.lost_share_sd
DISTURBANCE_TIME_S = JOINT_PRIORS.disturbance_time_s
TURNS_MORE = JOINT_PRIORS.turn_disturbance**2
DRIFT = JOINT_PRIORS.alpha_drift_share_rts**2


@lean
def line_of(
    mean: F64,
    mode: int,
    at: Axis,
    change: float,
    inputs: tuple[float, float, float],
    coupling: float,
    spinning: float,
    noise: tuple[float, float],
    dt: float,
) -> Step:
    """What one axis's torque says over a step, with its variances.

    ``inputs``: mean effort and its change in N·m, and the wheels' sign; ``noise``: variances of elastic slip and of the wheels' speed.
    """
    effort, jerk, resists = inputs
    calm, error = noise
    scale, gain = math.exp(mean[LN_SCALE]), mean[at.gain]
    away = slips_away(mode)
    left = math.exp(-dt / (ACTIVE_TIME_S if away else CALM_TIME_S))
    fresh = SLIP_DIFFUSION * dt if away else calm * (1.0 - left * left)
    line = LEAST_VARIANCE + (TIMING_SD_S * gain * jerk) ** 2 + (COUPLING_SD * coupling * dt) ** 2
    if away:
        line += (SPINNING_SD * change) ** 2
    share = 1.0
    if mode == LOST:
        share = LOST_SHARE
        line += (LOST_SHARE_SD * gain * effort * dt) ** 2
    burst = BURST_DIFFUSION * dt if away else 0.0
    return Step(scale, change, effort, share, resists, spinning, coupling, left, fresh, burst, error, line, dt)


@lean
def drive(
    mean: F64,
    covariance: F64,
    mode: int,
    wheels: F64,
    efforts: F64,
    noise: tuple[float, float],
    spinning: tuple[float, float],
    dt: float,
    work: F64,
) -> float:
    """The slips after a step of known wheel speeds and torques; the log likelihood of the torques."""
    v, v_lat, omega = body_motion(mean, wheels)
    coupling = v_lat * omega
    ahead = line_of(
        mean, mode, AHEAD_AXIS, wheels[2] * dt, (efforts[0], efforts[2], efforts[4]), coupling, spinning[0], noise, dt
    )
    likely = follow_traction(mean, covariance, AHEAD_AXIS, LN_SCALE, ahead, work)
    turn = line_of(
        mean, mode, TURN_AXIS, wheels[3] * dt, (efforts[1], efforts[3], efforts[5]), 0.0, spinning[1], noise, dt
    )
    likely += follow_traction(mean, covariance, TURN_AXIS, LN_SCALE, turn, work)
    skids = mode in (SKIDDING, SKIDDING_SLIPPING)
    time_s = ACTIVE_TIME_S if skids else CALM_TIME_S
    fade(mean, covariance, S_LAT, SKID_VARIANCE if skids else noise[0], time_s, dt)
    return likely


@lean
def forget_errors(mean: F64, covariance: F64, variance: float) -> None:
    """The errors of wheel speeds that no line has told."""
    for state in (E_SUM, E_DIFF):
        mean[state] = 0.0
        for j in range(mean.shape[0]):
            covariance[state, j] = covariance[j, state] = 0.0
        covariance[state, state] = variance


@lean
def drift(mean: F64, covariance: F64, disturbance: float, dt: float) -> None:
    """Traction and disturbances after a step."""
    for state in (ALPHA, BETA):
        covariance[state, state] += DRIFT * mean[state] * mean[state] * dt
    fade(mean, covariance, AHEAD, disturbance, DISTURBANCE_TIME_S, dt)
    fade(mean, covariance, AROUND, TURNS_MORE * disturbance, DISTURBANCE_TIME_S, dt)


@lean
def predict(
    hypotheses: HypothesisSet,
    wheels: F64,
    efforts: F64,
    known: tuple[bool, bool],
    spinning: tuple[float, float],
    step_s: float,
    levels: tuple[F64, F64],
    error: float,
    work: F64,
) -> None:
    """All hypotheses forward by ``step_s``; without torques as in the wheel-speed bank.

    ``efforts`` (6,): sum and difference over the step, their changes, and the wheels' signs; ``known``: wheel speeds and efforts;
    ``levels``: variances of elastic slip and of disturbances; ``error``: variance of the wheels' speeds.
    """
    step_s = min(step_s, LONGEST_HOLE_S)
    pieces = max(1, math.ceil(step_s / LONGEST_STEP_S))
    dt = step_s / pieces
    calm, disturbances = levels
    for h in range(hypotheses.size[0]):
        mean, covariance, mode = hypotheses.mean[h], hypotheses.covariance[h], hypotheses.mode[h]
        level, disturbance = calm[hypotheses.level[h]], disturbances[hypotheses.level[h]]
        for _ in range(pieces):
            predict_pose(mean, covariance, wheels, dt, work)
            drift(mean, covariance, disturbance, dt)
            if known[0] and known[1]:
                noise = (level, error)
                hypotheses.log_weight[h] += drive(
                    mean, covariance, mode, wheels, efforts, noise, spinning, dt, work
                )
            else:
                fade_slips(mean, covariance, as_mode(mode), level, known[0], dt)
                forget_errors(mean, covariance, error)
        spread_pose(mean, covariance)
