"""Was the pose integrated from wheel speeds? Then v_lat ≡ 0 by construction, and skidding cannot be seen in
it.
"""

from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled import compiled

RELATIVE_TOLERANCE = 5e-4
TOLERANCE_MPS = 1e-4
MOVING_MPS = 0.02
MEMORY_STEPS = 50.0
EVIDENCE_STEPS = 20

INDEPENDENT, NOT_INDEPENDENT, UNKNOWN = 1, -1, 0


@compiled
def lateral_is_noise(step: tuple[float, float], yaw_before: float, yaw_after: float, step_s: float) -> bool:
    """Whether a step obeys the nonholonomic constraint to within numerical noise.

    |Δp·n| ≤ 5·10⁻⁴ |Δp·e| + .1 mm/s · Δt for the heading at the step's start, middle or end: the three usual
    ways of integrating wheel odometry.
    """
    for yaw in (yaw_before, 0.5 * (yaw_before + yaw_after), yaw_after):
        cos, sin = np.cos(yaw), np.sin(yaw)
        along, across = abs(step[0] * cos + step[1] * sin), abs(step[1] * cos - step[0] * sin)
        if across <= RELATIVE_TOLERANCE * along + TOLERANCE_MPS * step_s:
            return True
    return False


class IndependenceState(NamedTuple):
    """Memory of the test: stamp of the last row (1,); its x, y, yaw (3,); share of recent steps that break
    the constraint, how many did, and how many moving steps there were (3,).
    """

    last_ns: I64
    last: F64
    tally: F64


def fresh_independence() -> IndependenceState:
    """Nothing seen yet."""
    return IndependenceState(np.zeros(1, np.int64), np.full(3, np.nan), np.zeros(3))


@compiled
def judge_independence(t_ns: I64, pose: F64, state: IndependenceState) -> F64:
    """INDEPENDENT, NOT_INDEPENDENT or UNKNOWN at each row, (n,), from the steps up to it.

    A running median test over the steps at .02 m/s or more: once more than half of the recent ones break the
    constraint, with at least 20 that do, the pose is independent for good; while 20 moving steps have not
    shown that, it is not. ``pose`` (3, n); ``state`` is carried on in place.
    """
    out = np.empty(t_ns.shape[0])
    tally = state.tally
    for i in range(t_ns.shape[0]):
        if tally[1] == np.inf:
            out[i:] = INDEPENDENT
            return out
        step = pose[0, i] - state.last[0], pose[1, i] - state.last[1]
        step_s = (t_ns[i] - state.last_ns[0]) * 1e-9
        if np.hypot(step[0], step[1]) > MOVING_MPS * step_s:
            breaks = 0.0 if lateral_is_noise(step, state.last[2], pose[2, i], step_s) else 1.0
            tally[0] += (breaks - tally[0]) / min(tally[2] + 1.0, MEMORY_STEPS)
            tally[1] += breaks
            tally[2] += 1.0
        state.last_ns[0] = t_ns[i]
        state.last[:] = pose[:, i]
        if tally[1] >= EVIDENCE_STEPS and tally[0] > 0.5:
            tally[1] = np.inf
        if tally[1] == np.inf:
            out[i] = INDEPENDENT
        else:
            out[i] = NOT_INDEPENDENT if tally[2] >= EVIDENCE_STEPS else UNKNOWN
    return out
