"""What pose noise and disturbance leave of a trace: a Kalman filter on the motion linearised along the truth.

State: errors of x, y, yaw, v, w, q; three coloured disturbances; three wobbles of the marker. A trace of
accelerations moves the state, a trace of poses adds to the measurement. The innovations that a trace causes,
each divided by its standard deviation, are independent under noise alone: their inner products are the
information that the log has on the effects, whatever the disturbance and the initial state may be.

What a tool does not know beside is part of that noise: traces c δ with δ of standard deviation 1 give the
innovations C the covariance I + C Cᵀ (:func:`unsure_of`).
"""

from dataclasses import dataclass, replace

import numpy as np

from wmr_schemas.arrays import F64
from worlds.case import Conditions
from worlds.oracle_forms import STEP_S, Signals, Trace

BIN_S = 0.05
PER_BIN = round(BIN_S / STEP_S)
N_STATES = 12
X, Y, YAW, V, W, Q = range(6)
DISTURBANCE, WOBBLE = 6, 9
SIDESLIP_RATE_PER_S = 50.0
LEAST_LEVEL_MPS2 = 0.001
START_SD = np.array([1.0, 1.0, 0.5, 1.0, 0.3, 1.0])


@dataclass(frozen=True, eq=False)
class Steps:
    """The linear model bin by bin: transitions (n, 12, 12), inputs (n, 12, 3), noises (12, 12), (3, 3).

    ``unsure`` (3·n, m) are directions u of the innovations whose share |u|² is lost in what is unknown.
    """

    transition: F64
    inputs: F64
    process: F64
    start: F64
    measurement: F64
    unsure: F64 | None = None


def binned(columns: F64) -> F64:
    """Means over bins along the last axis."""
    n = columns.shape[-1] // PER_BIN
    return columns[..., : n * PER_BIN].reshape(*columns.shape[:-1], n, PER_BIN).mean(axis=-1)


def dynamics(s: Signals) -> F64:
    """Derivative of the state by the state, and behind it by three accelerations, (n, 12, 15) at the bins."""
    v, w, q, yaw, rate = (binned(column) for column in (s.v, s.w, s.q, s.yaw, s.skid_rate))
    skids = binned(s.skids.astype(float)) > 0.5
    cosine, sine = np.cos(yaw), np.sin(yaw)
    found = np.zeros((len(v), N_STATES, N_STATES + 3))
    found[:, X, V], found[:, X, W], found[:, X, YAW] = cosine, -sine, -v * sine - w * cosine
    found[:, Y, V], found[:, Y, W], found[:, Y, YAW] = sine, cosine, v * cosine - w * sine
    found[:, YAW, Q] = 1.0
    found[:, V, W], found[:, V, Q] = np.where(skids, q / 3, 0.0), np.where(skids, w / 3, 0.0)
    found[:, W, W] = np.where(skids, -rate, -SIDESLIP_RATE_PER_S)
    found[:, W, V], found[:, W, Q] = np.where(skids, -q, 0.0), np.where(skids, -v, 0.0)
    for first in (DISTURBANCE, N_STATES):
        found[:, V, first] = 1.0
        found[:, W, first + 1] = skids
        found[:, Q, first + 2] = 1 / s.half_track_m
    return found


def exponential(matrices: F64) -> F64:
    """Exp of each matrix: a series after division by 16, squared four times."""
    small = matrices / 16
    unit = np.eye(matrices.shape[-1])
    total = unit + small / 8
    for k in range(7, 0, -1):
        total = unit + small @ total / k
    for _ in range(4):
        total = total @ total
    return total


def steps_of(s: Signals, around: Conditions, noise_sd: tuple[float, float]) -> Steps:
    """The model along the truth, with the true levels of disturbance, noise and wobble."""
    parts = dynamics(s)
    n = len(parts)
    square = np.zeros((n, N_STATES + 3, N_STATES + 3))
    square[:, :N_STATES] = parts
    square[:, range(6, 9), range(6, 9)] = -1 / around.disturbance_s
    square[:, range(9, 12), range(9, 12)] = -1 / around.wobble_s
    flow = exponential(square * BIN_S)
    sd = np.array([noise_sd[0], noise_sd[0], noise_sd[1]])
    level = max(around.disturbance_mps2, LEAST_LEVEL_MPS2)
    stationary = np.concatenate([np.zeros(6), np.full(3, level**2), around.wobble_share * sd**2])
    forgotten = 1 - np.exp(-2 * BIN_S / np.repeat([1.0, around.disturbance_s, around.wobble_s], [6, 3, 3]))
    process = np.diag(stationary * forgotten)
    process[V, V] = process[W, W] = process[Q, Q] = 1e-12
    start = np.diag(np.concatenate([START_SD**2, stationary[6:]]))
    white = np.diag((1 - around.wobble_share) * sd**2 / PER_BIN)
    return Steps(flow[:, :N_STATES, :N_STATES], flow[:, :N_STATES, N_STATES:], process, start, white)


def whitened(steps: Steps, traces: list[Trace]) -> F64:
    """Innovations that the traces cause in units of their standard deviation, (3·n, traces)."""
    acceleration = np.stack([binned(trace.acceleration) for trace in traces], axis=-1)
    pose = np.stack([binned(trace.pose) for trace in traces], axis=-1)
    n, p = len(steps.transition), len(traces)
    measures = np.zeros((3, N_STATES))
    measures[:, :3] = measures[:, WOBBLE:] = np.eye(3)
    error, covariance = np.zeros((N_STATES, p)), steps.start
    out = np.empty((n, 3, p))
    for k in range(n):
        flow = steps.transition[k]
        error = flow @ error + steps.inputs[k] @ acceleration[:, k]
        covariance = flow @ covariance @ flow.T + steps.process
        across = covariance @ measures.T
        spread = measures @ across + steps.measurement
        innovation = measures @ error + pose[:, k]
        root = np.linalg.cholesky(spread)
        out[k] = np.linalg.solve(root, innovation)
        gain = np.linalg.solve(spread, across.T).T
        error -= gain @ innovation
        covariance -= gain @ across.T
        covariance = 0.5 * (covariance + covariance.T)
    return beside_the_unsure(steps, out.reshape(3 * n, p))


def unsure_of(steps: Steps, traces: list[Trace]) -> Steps:
    """The model in which each of ``traces`` is there with an unknown size of standard deviation 1."""
    if not traces:
        return steps
    directions, sizes, _ = np.linalg.svd(whitened(steps, traces), full_matrices=False)
    return replace(steps, unsure=directions * np.sqrt(1 - 1 / np.sqrt(1 + sizes**2)))


def beside_the_unsure(steps: Steps, columns: F64) -> F64:
    """(I + C Cᵀ)^(−1/2) times the columns: what the unknown traces C leave of them."""
    if steps.unsure is None:
        return columns
    return columns - steps.unsure @ (steps.unsure.T @ columns)


def moved_m(steps: Steps, trace: Trace, window_s: float) -> float:
    """How far a trace moves the simulated path within windows of ``window_s``, at most, in m."""
    acceleration, pose = binned(trace.acceleration), binned(trace.pose)
    per, farthest, state = round(window_s / BIN_S), 0.0, np.zeros(N_STATES)
    first = pose[:, 0]
    for k in range(len(steps.transition)):
        if k % per == 0:
            state, first = np.zeros(N_STATES), pose[:, k]
            state[YAW] = -first[2]
        state = steps.transition[k] @ state + steps.inputs[k] @ acceleration[:, k]
        farthest = max(farthest, float(np.hypot(*(state[:2] + pose[:2, k] - first[:2]))))
    return farthest
