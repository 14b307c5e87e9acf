"""Numbers in a log that no robot can have measured: they count as unknown.

Their squares and products overflow, and a filter that overflows never recovers.
"""

import numpy as np

from wmr_schemas.arrays import F64, I64, Bool

MOST = 1e12
"""Largest magnitude of a position, a yaw, an effort or a wheel speed.

A position on Earth in millimetres is below 2e10, an effort of a machine in mN·m below 1e10.
"""
EARLIEST_NS, LATEST_NS = -500_000_000_000_000_000, 8_700_000_000_000_000_000
"""Stamps before 1954 and after 2245 are damaged; differences of two stamps in between fit in 64 bits."""


def is_absurd(values: F64) -> Bool:
    """Mask of the numbers beyond ``MOST``, infinite ones among them. NaN is not absurd, but unknown."""
    return np.asarray(np.abs(values) > MOST)


def without_absurd(values: F64) -> F64:
    """The same numbers (k, n), NaN in place of those beyond ``MOST``."""
    absurd = is_absurd(values)
    return np.where(absurd, np.nan, values) if absurd.any() else values


def n_absurd(values: F64) -> int:
    """Number of columns of (k, n) with a number beyond ``MOST``."""
    absurd = is_absurd(values)
    return int(np.count_nonzero(absurd.any(axis=0))) if absurd.any() else 0


def is_possible_stamp(t_ns: I64) -> Bool:
    """Mask (n,) of the stamps that may be times."""
    return np.asarray((t_ns > EARLIEST_NS) & (t_ns < LATEST_NS))
