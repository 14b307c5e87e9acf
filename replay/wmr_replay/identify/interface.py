"""What every identifier takes in and what it says."""

from typing import NamedTuple, Protocol

import numpy as np

from wmr_replay.identify.motion import Motion
from wmr_schemas.arrays import F64, I8, I64, U8, Bool


class Evidence(NamedTuple):
    """What is known up to each of n rows of strictly increasing time.

    ``t_ns`` (n,); ``pose`` (3, n) x, y, yaw unwrapped; ``efforts`` (2, n) left and right, each the mean over
    the interval that ends at the row, NaN where unknown; ``motion`` and ``force`` (n,), the sum of the
    efforts through the same window; ``variances`` (2, n) of position and yaw noise; ``independence`` (n,);
    ``restarts`` (n,): the pose has jumped, and has been carried back to within about its noise.
    """

    t_ns: I64
    pose: F64
    efforts: F64
    motion: Motion
    force: F64
    known_acceleration: F64
    variances: F64
    independence: F64
    restarts: Bool


class Verdict(NamedTuple):
    """What an identifier says at each row, (n,); NaN where unknown.

    ``posterior`` (4, n) over ideal, skidding, slipping, both; all NaN from an identifier that has no
    probabilities.
    """

    c_d_mps2: F64
    c_k_threshold_mps: F64
    c_d_threshold_mps2: F64
    posterior: F64
    alpha: F64
    alpha_sd: F64
    mode: I8
    mode_set: U8
    outcome: I8


class Identifier(Protocol):
    """A stage: rows in, verdicts out, one for each."""

    def push(self, evidence: Evidence) -> Verdict:
        """Verdicts that depend on no later row and not on the batches."""


def no_posterior(n: int) -> F64:
    """The posterior of an identifier that has none."""
    return np.full((4, n), np.nan)
