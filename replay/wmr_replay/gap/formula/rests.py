"""What the base model leaves on its own calibration log, as accelerations that a formula may describe.

The misfit of a calibrated base model says how much of each effect it may leave. What of a formula these
effects do together, each by a share of its misfit and the squares of all shares at most 1, is no finding.
"""

from collections.abc import Iterator

import numpy as np
from scipy.optimize import brentq

from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.misfit import floor_of
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.arrays import F64
from wmr_schemas.terms import Term, TermChannel


def beyond_rests(
    value_mps2: F64, channel: TermChannel, extension: Extension, binned: BinnedLog, own: MisfitSettings
) -> F64:
    """The acceleration (n,) less what the base model's rests may do of it."""
    rests = [
        floor_of(name, extension, own) * unit
        for name, on, unit in units_of(extension, binned)
        if on == channel and floor_of(name, extension, own) > 0
    ]
    if not rests:
        return value_mps2
    columns = np.column_stack(rests)
    return np.asarray(value_mps2 - columns @ shares_of(columns, value_mps2))


def shares_of(columns: F64, value: F64) -> F64:
    """The shares z (k,) with ‖z‖ ≤ 1 at which columns (n, k) come nearest to ``value`` (n,)."""
    sizes, axes = np.linalg.eigh(columns.T @ columns)
    along = axes.T @ (columns.T @ value)
    sizes = np.maximum(sizes, 1e-12 * sizes[-1])

    def shares(price: float) -> F64:
        return np.asarray(along / (sizes + price))

    low, high = 1e-12 * sizes[-1], float(np.linalg.norm(along)) + 1e-12 * sizes[-1]

    def excess(log_price: float) -> float:
        return float(np.linalg.norm(shares(np.exp(log_price)))) - 1

    if excess(np.log(low)) <= 0:
        return np.asarray(axes @ shares(low))
    return np.asarray(axes @ shares(np.exp(brentq(excess, np.log(low), np.log(high)))))


def units_of(extension: Extension, binned: BinnedLog) -> Iterator[tuple[str, TermChannel, F64]]:
    """Each effect that has a form on the motion or the torques, with its acceleration (n,) per size."""
    base, columns = extension.base, columns_of(binned)
    wheel = 2 / extension.wheel_radius_m
    ahead: list[tuple[str, float, str]] = [
        ("payload", base.alpha, "effort_sum"),
        ("torque_imbalance", base.alpha, "effort_diff"),
        ("rolling_resistance", 1.0, "sgn(v)"),
        ("viscous_drag", 1.0, "v"),
        ("aerodynamic_drag", 1.0, "v*abs(v)"),
        ("wheel_coulomb", 2 * base.alpha, "sgn(v)"),
        ("wheel_viscous", wheel * base.alpha, "v"),
        ("torque_bias_common", 2 * base.alpha, "1"),
        ("slope", 1.0, "cos(yaw)"),
        ("slope", 1.0, "sin(yaw)"),
        ("com_offset", 1.0, "yaw_rate*yaw_rate"),
    ]
    turning: list[tuple[str, float, str]] = [
        ("yaw_inertia", base.alpha_yaw, "effort_diff"),
        ("torque_imbalance", base.alpha_yaw, "effort_sum"),
        ("yaw_damping", base.half_track_m, "yaw_rate"),
        ("scrub_torque", 1.0, "sgn(yaw_rate)"),
        ("wheel_viscous", wheel * base.alpha_yaw * base.half_track_m, "yaw_rate"),
        ("torque_bias_differential", 2 * base.alpha_yaw, "1"),
        ("com_offset", base.com_yaw_per_m, "v*yaw_rate"),
    ]
    channels: tuple[tuple[TermChannel, list[tuple[str, float, str]]], ...] = (
        ("longitudinal", ahead),
        ("yaw", turning),
    )
    for channel, forms in channels:
        for name, size, product in forms:
            yield name, channel, size * Term(channel, tuple(product.split("*"))).evaluate(columns)
