"""Input and output of every identifier."""

from typing import NamedTuple, Protocol

import numpy as np

from wmr_replay.identify.motion import Motion
from wmr_schemas.arrays import F64, I8, I64, U8, Bool


class Evidence(NamedTuple):
    """Evidence at n rows of strictly increasing time; no row depends on a later one.

    ``t_ns`` (n,) stamps. ``pose`` (3, n) repaired x, y in m and unwrapped yaw in rad. ``efforts`` (2, n) left
    and right in N·m, each the mean over the interval that ends at the row, NaN where unknown. ``wheels``
    (2, n) their speeds in rad/s, likewise; ``smoothed_wheels`` through the same window as the motion.
    ``motion`` at the instants t − δ. ``force`` (n,) the sum of the
    efforts in N·m through the same window as the motion. ``known_acceleration`` (n,) dv_long/dt in m/s² by
    the model's further effects. ``variances`` (2, n) of the noise of position and yaw. ``independence``
    (n,) of the pose from wheel speeds. ``restarts`` (n,) rows before which the pose has jumped; the repair
    leaves an error of about its noise.
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
    wheels: F64
    smoothed_wheels: F64


class WheelEstimates(NamedTuple):
    """What wheel speeds tell at each row, (n,), each with its standard deviation; columns of the samples."""

    slip_left_mps: F64
    slip_left_mps_sd: F64
    slip_right_mps: F64
    slip_right_mps_sd: F64
    slip_ratio_left: F64
    slip_ratio_left_sd: F64
    slip_ratio_right: F64
    slip_ratio_right_sd: F64
    wheel_scale: F64
    wheel_scale_sd: F64
    effective_half_track_m: F64
    effective_half_track_m_sd: F64
    icr_offset_m: F64
    icr_offset_m_sd: F64

    def without(self, rows: Bool) -> "WheelEstimates":
        """NaN in the rows of a mask."""
        return WheelEstimates(*(np.where(rows, np.nan, column) for column in self))


class Verdict(NamedTuple):
    """An identifier's answer at each row, (n,); NaN where unknown.

    C_d with the thresholds of C_k and C_d; ``posterior`` (4, n) over ideal, skidding, slipping, both, all NaN
    without probabilities; α in (m/s²)/(N·m) with its standard deviation; ``mode`` (ContactMode), ``mode_set``
    (ModeSet) and ``outcome`` (Status). ``wheels`` where wheel speeds are what is known.
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
    wheels: WheelEstimates | None = None


class Identifier(Protocol):
    """A stage: rows in, verdicts out, one for each."""

    def push(self, evidence: Evidence) -> Verdict:
        """Verdicts that depend on no later row and not on the batches."""


def no_posterior(n: int) -> F64:
    """The posterior of an identifier that has none."""
    return np.full((4, n), np.nan)
