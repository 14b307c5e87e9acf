"""The state of the pose repair between two rows, and the constants of its rules."""

from typing import NamedTuple

import numpy as np

from wmr_replay.align.jumps import AGREEING
from wmr_replay.align.track import fresh_track
from wmr_schemas.arrays import F64, I64

N_HELD, N_GOOD, N_PENDING, N_JUMPS, N_OUTLIERS, N_ROWS, ANCHOR_NS, LAST_NS = range(8)
"""Places in ``Memory.counts``."""


class Memory(NamedTuple):
    """State between two rows, changed in place.

    ``counts`` (8,); the track ``held`` and the ``variances`` (2,) of position and yaw; the last rejected
    samples ``pending`` (4, 4) t, x, y, yaw; ``frame`` (3,) turn and shift that undo the jumps so far;
    ``last`` (3,) the pose measured last; ``waiting`` (5,) inputs of outliers times their seconds, and
    these seconds; ``nowhere`` (3,) is zero. The rest is scratch.
    """

    counts: I64
    held: F64
    variances: F64
    pending: F64
    frame: F64
    last: F64
    waiting: F64
    lines: F64
    gate: F64
    before: F64
    after: F64
    found: F64
    step: F64
    nowhere: F64
    pose: F64


def fresh_memory(position_sd_m: float, yaw_sd_rad: float) -> Memory:
    """The memory before the first row."""
    return Memory(
        counts=np.zeros(8, np.int64),
        held=fresh_track(),
        variances=np.array([position_sd_m**2, yaw_sd_rad**2]),
        pending=np.zeros((4, AGREEING)),
        frame=np.zeros(3),
        last=np.full(3, np.nan),
        waiting=np.zeros(5),
        lines=np.zeros((2, 3)),
        gate=np.zeros(3),
        before=np.zeros((2, 3)),
        after=np.zeros((2, 3)),
        found=np.zeros((2, 3)),
        step=np.zeros(3),
        nowhere=np.zeros(3),
        pose=np.zeros(3),
    )


class Rules(NamedTuple):
    """Nominal step, samples of the line, groups that are short enough, longest gap to predict
    over.
    """

    step_s: float
    n_line: int
    n_groups: int
    longest_gap_s: float
