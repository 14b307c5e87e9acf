"""Prediction of a hypothesis by wheel speeds and torques."""

import math
from typing import NamedTuple

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
)
from wmr_replay.identify.joint_bank.switches import slips
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
from wmr_replay.identify.wheel_bank.steps import LONGEST_STEP_S
from wmr_schemas.arrays import F64
from wmr_schemas.compiled.lean import lean

AHEAD_AXIS = Axis(S_SUM, ALPHA, DRAG, AHEAD, E_SUM)
TURN_AXIS = Axis(S_DIFF, BETA, DRAG_TURN, AROUND, E_DIFF)
TIMING_SD_S, SPINNING_SD = JOINT_PRIORS.timing_sd_s, JOINT_PRIORS.spinning_sd
SLIP_DIFFUSION, BURST_DIFFUSION = JOINT_PRIORS.slip_diffusion, JOINT_PRIORS.burst_diffusion
LEAST_VARIANCE, COUPLING_SD = JOINT_PRIORS.least_sd_mps**2, JOINT_PRIORS.coupling_sd
DISTURBANCE_TIME_S, TURNS_MORE = JOINT_PRIORS.disturbance_time_s, JOINT_PRIORS.turn_disturbance**2
SPREAD, SPREAD_SKIDDING = (sd**2 for sd in JOINT_PRIORS.spread_mps_rts)
DRIFT = JOINT_PRIORS.alpha_drift_share_rts**2


class Inputs(NamedTuple):
    """One axis's inputs over a step: the change of the wheels' speed in m/s, the effort and its change in
    N·m, the wheels' sign, their share of inertia, the coupling v_lat ω in m/s², and its variance.
    """

    change: float
    effort: float
    jerk: float
    sign: float
    spinning: float
    coupling: float
    doubt: float


class Noise(NamedTuple):
    """Variances of elastic slip and of the wheels' speeds in (m/s)², of disturbances in (m/s²)²."""

    calm: float
    error: float
    disturbance: float


@lean
def step_of(mean: F64, slip: bool, gain: float, on: Inputs, noise: Noise, dt: float) -> Step:
    """The step of one axis, by what acts on it and what is not known of that; ``gain`` is its α."""
    left = math.exp(-dt / (ACTIVE_TIME_S if slip else CALM_TIME_S))
    fresh = SLIP_DIFFUSION * dt if slip else noise.calm * (1.0 - left * left)
    burst = BURST_DIFFUSION * dt if slip else 0.0
    line = LEAST_VARIANCE + (TIMING_SD_S * gain * on.jerk) ** 2
    line += (COUPLING_SD * on.coupling * dt) ** 2 + on.doubt * dt * dt
    if slip:
        line += (SPINNING_SD * on.change) ** 2
    return Step(
        math.exp(mean[LN_SCALE]),
        on.change,
        on.effort,
        on.sign,
        on.spinning,
        on.coupling,
        left,
        fresh,
        burst,
        noise.error,
        line,
        dt,
    )


@lean
def drive(
    mean: F64,
    covariance: F64,
    mode: int,
    inputs: tuple[F64, F64],
    spinning: tuple[float, float],
    noise: Noise,
    dt: float,
    work: F64,
) -> float:
    """The slips after a step of known wheel speeds and torques, the ``inputs``; the log likelihood of the
    torques.
    """
    wheels, efforts = inputs
    slip = slips(mode)
    _, v_lat, omega = body_motion(mean, wheels)
    skids = mode in (SKIDDING, SKIDDING_SLIPPING)
    doubt = covariance[S_LAT, S_LAT] * omega * omega
    ahead = Inputs(wheels[2] * dt, efforts[0], efforts[2], efforts[4], spinning[0], v_lat * omega, doubt)
    turn = Inputs(wheels[3] * dt, efforts[1], efforts[3], efforts[5], spinning[1], 0.0, 0.0)
    step = step_of(mean, slip, mean[ALPHA], ahead, noise, dt)
    likely = follow_traction(mean, covariance, AHEAD_AXIS, step, work)
    step = step_of(mean, slip, mean[BETA], turn, noise, dt)
    likely += follow_traction(mean, covariance, TURN_AXIS, step, work)
    if slip:
        unknown = (SPREAD_SKIDDING if skids else SPREAD) * dt
        covariance[S_SUM, S_SUM] += unknown
        covariance[S_DIFF, S_DIFF] += unknown
    time_s = ACTIVE_TIME_S if skids else CALM_TIME_S
    fade(mean, covariance, S_LAT, SKID_VARIANCE if skids else noise.calm, time_s, dt)
    return likely


@lean
def forget_errors(mean: F64, covariance: F64, variance: float) -> None:
    """The errors of wheel speeds of which no torque tells."""
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
    inputs: tuple[F64, F64],
    known: tuple[bool, bool],
    spinning: tuple[float, float],
    step_s: float,
    levels: tuple[F64, F64, float],
    work: F64,
) -> None:
    """All hypotheses forward by ``step_s``; without torques as in the wheel-speed bank.

    ``inputs``: the wheels' speeds and their rates (4,), and efforts (6,) as :func:`.steps.set_efforts` has
    them; ``known``: which of both are. ``levels``: variances of elastic slip and of disturbances by level,
    and that of the wheels' speeds.
    """
    step_s = min(step_s, LONGEST_HOLE_S)
    pieces = max(1, math.ceil(step_s / LONGEST_STEP_S))
    dt = step_s / pieces
    calm, disturbances, error = levels
    for h in range(hypotheses.size[0]):
        mean, covariance, mode = hypotheses.mean[h], hypotheses.covariance[h], hypotheses.mode[h]
        noise = Noise(calm[hypotheses.level[h]], error, disturbances[hypotheses.level[h]])
        for _ in range(pieces):
            predict_pose(mean, covariance, inputs[0], dt, work)
            drift(mean, covariance, noise.disturbance, dt)
            if known[0] and known[1]:
                hypotheses.log_weight[h] += drive(mean, covariance, mode, inputs, spinning, noise, dt, work)
            else:
                fade_slips(mean, covariance, mode, noise.calm, known[0], dt)
                forget_errors(mean, covariance, error)
        spread_pose(mean, covariance)
