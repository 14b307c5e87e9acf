"""Test whether the pose is independent of the wheel speeds.

A pose that was integrated from wheel speeds has v_lat ≡ 0 by construction: skidding cannot be seen in it.
"""

import math
from typing import NamedTuple

import numpy as np

from wmr_schemas.arrays import F64, I64
from wmr_schemas.compiled.lean import lean

INDEPENDENT, NOT_INDEPENDENT, UNKNOWN = 1, -1, 0


class IndependenceRules(NamedTuple):
    """Thresholds of the test, which compiled code takes as constants."""

    relative_tolerance: float = 5e-4
    """Lateral over longitudinal step that still counts as numerical noise."""
    tolerance_mps: float = 1e-4
    """Lateral speed that still counts as numerical noise: .1 mm/s, from rounding of the logged numbers."""
    moving_mps: float = 0.02
    """Slower steps do not count: at rest every pose obeys the constraint."""
    memory_steps: float = 50.0
    """Steps over which the running share is averaged: .5 s at 100 Hz."""
    evidence_steps: int = 20
    """Moving steps before a verdict."""


RULES = IndependenceRules()


@lean
def lateral_is_noise(step: tuple[float, float], yaw_before: float, yaw_after: float, step_s: float) -> bool:
    """Whether a step obeys the nonholonomic constraint to within numerical noise.

    |Δp·n| ≤ 5·10⁻⁴ |Δp·e| + .1 mm/s · Δt for the heading at the step's start, middle or end: the three usual
    ways of integrating wheel odometry.
    """
    for yaw in (yaw_before, 0.5 * (yaw_before + yaw_after), yaw_after):
        cos, sin = math.cos(yaw), math.sin(yaw)
        along, across = abs(step[0] * cos + step[1] * sin), abs(step[1] * cos - step[0] * sin)
        if across <= RULES.relative_tolerance * along + RULES.tolerance_mps * step_s:
            return True
    return False


class IndependenceState(NamedTuple):
    """Memory of the test: stamp of the last row (1,); its x, y, yaw (3,); share of recent steps that break
    the constraint, how many did, and how many moving steps there were (3,).
    """

    last_ns: I64
    last: F64
    counts: F64


def fresh_independence() -> IndependenceState:
    """The state before the first row."""
    return IndependenceState(np.zeros(1, np.int64), np.full(3, np.nan), np.zeros(3))


def track_independence(t_ns: I64, pose: F64, state: IndependenceState) -> F64:
    """INDEPENDENT, NOT_INDEPENDENT or UNKNOWN at each row, (n,), from the steps up to it.

    A running median test over the steps at .02 m/s or more: once more than half of the recent ones break the
    constraint, with at least 20 that do, the pose is independent for good; while 20 moving steps have not
    shown that, it is not. ``pose`` (3, n); ``state`` is carried on in place.
    """
    out = np.empty(len(t_ns))
    fill_independence(t_ns, pose, state, out)
    return out


@lean
def fill_independence(t_ns: I64, pose: F64, state: IndependenceState, out: F64) -> None:
    """Fill the answer of :func:`track_independence`."""
    counts, last = state.counts, state.last
    for i in range(len(t_ns)):
        if counts[1] == np.inf:
            out[i] = INDEPENDENT
            continue
        step = pose[0, i] - last[0], pose[1, i] - last[1]
        step_s = (t_ns[i] - state.last_ns[0]) * 1e-9
        if math.hypot(step[0], step[1]) > RULES.moving_mps * step_s:
            breaks = 0.0 if lateral_is_noise(step, last[2], pose[2, i], step_s) else 1.0
            counts[0] += (breaks - counts[0]) / min(counts[2] + 1.0, RULES.memory_steps)
            counts[1] += breaks
            counts[2] += 1.0
        state.last_ns[0] = t_ns[i]
        for k in range(3):
            last[k] = pose[k, i]
        if counts[1] >= RULES.evidence_steps and counts[0] > 0.5:
            counts[1] = np.inf
        if counts[1] == np.inf:
            out[i] = INDEPENDENT
        else:
            out[i] = NOT_INDEPENDENT if counts[2] >= RULES.evidence_steps else UNKNOWN
