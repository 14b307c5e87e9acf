"""Means over cells of half a second: the common ground on which signs and units are compared."""

from typing import NamedTuple

import numpy as np

from wmr_replay.quality.interface import Observed
from wmr_replay.quality.sums import PLAIN, Sums
from wmr_replay.quality.thinning import Thinning
from wmr_schemas.arrays import F64, I64

CELL_S = 0.5
"""Several poses at 10 Hz, and a turn of less than half a circle up to 6 rad/s."""


class Means(NamedTuple):
    """Means over m cells, (m,) each; NaN where a row of the cell lacks what is averaged.

    ``x_m``, ``y_m`` from the log's first position and ``yaw_rad`` as measured; ``position_var``: variance of
    the mean of x. ``v_mps``, ``yaw_rate_radps``, ``a_mps2``, ``yaw_acc_radps2`` and their variances as they
    are for a single row: neighbouring rows share their window. Efforts in N·m and wheel speeds in rad/s.
    """

    t_s: F64
    x_m: F64
    y_m: F64
    yaw_rad: F64
    position_var: F64
    v_mps: F64
    yaw_rate_radps: F64
    a_mps2: F64
    yaw_acc_radps2: F64
    v_var: F64
    yaw_rate_var: F64
    a_var: F64
    yaw_acc_var: F64
    left_nm: F64
    right_nm: F64
    left_radps: F64
    right_radps: F64


N_FIELDS = len(Means._fields)


class Cells:
    """Stage: rows → rows (m,) that begin a cell, and the means over the cell before.

    Running sums are carried on from batch to batch, one row after another, so that batches change no bit.
    Cells without a row are left out. Of a fast log every few rows are averaged.
    """

    def __init__(self, sums: Sums = PLAIN) -> None:
        self._sums, self._thinning = sums, Thinning()
        self._total, self._total_at_begin = np.zeros(2 * N_FIELDS), np.zeros((2 * N_FIELDS, 1))
        self._cell: float | None = None
        self._origin = np.zeros(2)

    def push(self, rows: Observed) -> tuple[I64, Means]:
        """The next rows."""
        at = self._thinning.push(rows.t_ns)
        cell = np.floor(rows.t_s.take(at) / CELL_S)
        if self._cell is None and len(cell):
            self._cell, self._origin = float(cell[0]), rows.pose_raw[:2, 0]
        begins = np.flatnonzero(np.diff(cell, prepend=self._cell or 0.0) != 0)
        values, edges = _values(rows, at, self._origin), np.empty((2 * N_FIELDS, 1 + len(begins)))
        edges[:, :1] = self._total_at_begin
        self._sums.add_up(values, begins, self._total, edges)
        self._total_at_begin = edges[:, -1:]
        self._cell = float(cell[-1]) if len(cell) else self._cell
        return at[begins], _means(np.diff(edges, axis=1))


def _values(rows: Observed, at: I64, origin: F64) -> F64:
    """What is averaged of the rows ``at`` (k,), in the order of :class:`Means`: (fields, k)."""
    m, (x_m, y_m, yaw_rad) = rows.motion, rows.pose_raw
    sd = m.v_long_mps_sd, m.yaw_rate_radps_sd, m.a_long_mps2_sd, m.yaw_acc_radps2_sd
    averaged = (
        *(rows.t_s, x_m, y_m, yaw_rad, rows.variances[0]),
        *(m.v_long_mps, m.yaw_rate_radps, m.a_long_mps2, m.yaw_acc_radps2),
        *(*sd, *rows.smoothed),
    )
    values = np.stack([column.take(at) for column in averaged])
    values[1:3] -= origin[:, None]
    np.square(values[9:13], out=values[9:13])
    return values


def _means(sums: F64) -> Means:
    """Means (m,) from sums and counts; NaN where a cell has rows of which a value is not known."""
    total, count = np.split(sums, 2)
    rows = count[0]
    mean = np.where((count == rows) & (rows > 0), total / np.maximum(count, 1.0), np.nan)
    means = Means(*mean)
    return means._replace(position_var=means.position_var / np.maximum(rows, 1.0))
