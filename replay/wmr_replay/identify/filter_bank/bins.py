"""Consecutive rows averaged into bins, the steps of the filter bank. White noise loses no information."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wmr_replay.identify.filter_bank.priors import PRIORS
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.compiled.lean import lean

FORCE, TURN, RELEASED = 6, 7, 8
N_VALUES = 9
LEAST_VARIANCE = PRIORS.least_bin_sd * PRIORS.least_bin_sd


class Bin(NamedTuple):
    """The open bin: sums of x, y, ψ, their variances, ∫effort dt (sum and difference), 1 after a jump (9,);
    rows, ∫dt (2,); stamps in ns (3,): Σ(t − t_first), t_first, t_last.
    """

    sums: F64
    weights: F64
    stamps: I64


@dataclass(frozen=True, eq=False)
class Bins:
    """m complete bins: ``values`` (9, m) – mean pose, variance of that mean, mean effort sum and difference,
    1 where the pose has jumped –, and mean stamps (m,) in ns.
    """

    values: F64
    stamps: I64

    @classmethod
    def none(cls) -> "Bins":
        """No bins."""
        return cls(np.empty((N_VALUES, 0)), np.empty(0, np.int64))

    def part(self, start: int, stop: int | None) -> "Bins":
        """Bins start … stop − 1."""
        return Bins(self.values[:, start:stop], self.stamps[start:stop])

    def then(self, later: "Bins") -> "Bins":
        """These bins followed by others."""
        return Bins(
            np.concatenate([self.values, later.values], axis=1), np.concatenate([self.stamps, later.stamps])
        )


def open_bin() -> Bin:
    """An empty bin."""
    return Bin(np.zeros(N_VALUES), np.zeros(2), np.zeros(3, np.int64))


def into_bins(
    t_ns: I64, pose: F64, efforts: F64, variances: F64, restarts: Bool, rows_per_bin: int, state: Bin
) -> tuple[Bins, I64]:
    """Rows into bins of ``rows_per_bin`` rows; with each row goes the number of bins that were complete with
    it (n,). Where the pose has jumped, what a bin held of it before is forgotten.

    ``pose`` (3, n), ``efforts`` (2, n), ``variances`` (2, n) of position and yaw; ``restarts`` (n,) marks
    jumps. The open bin, ``state``, is carried on.
    """
    n = len(t_ns)
    values, stamps, done = np.empty((N_VALUES, n + 1)), np.empty(n + 1, np.int64), np.empty(n, np.int64)
    rows = (
        t_ns,
        np.ascontiguousarray(pose),
        np.ascontiguousarray(efforts),
        np.ascontiguousarray(variances),
        restarts,
    )
    n_bins = bin_rows(rows, rows_per_bin, state, (values, stamps), done)
    return Bins(values[:, :n_bins].copy(), stamps[:n_bins]), done


@lean
def add_row(state: Bin, i: int, pose: F64, efforts: F64, variances: F64, step_s: float) -> None:
    """One more row, ``step_s`` after the one before, into the open bin."""
    for k in range(3):
        state.sums[k] += pose[k, i]
        state.sums[3 + k] += variances[k // 2, i]
    state.sums[FORCE] += (efforts[0, i] + efforts[1, i]) * step_s
    state.sums[TURN] += (efforts[1, i] - efforts[0, i]) * step_s
    state.weights[0] += 1.0
    state.weights[1] += step_s


@lean
def close_bin(state: Bin, values: F64, stamps: I64, place: int) -> None:
    """The open bin's means to ``place``, and an empty one in its stead."""
    count, seconds = state.weights[0], state.weights[1]
    for k in range(3):
        values[k, place] = state.sums[k] / count
        variance = state.sums[3 + k] / (count * count)
        values[3 + k, place] = LEAST_VARIANCE if variance < LEAST_VARIANCE else variance
    for k in (FORCE, TURN):
        values[k, place] = state.sums[k] / (seconds if seconds > 0.0 else math.nan)
    values[RELEASED, place] = state.sums[RELEASED]
    stamps[place] = state.stamps[1] + state.stamps[0] // int(count)
    for k in range(N_VALUES):
        state.sums[k] = 0.0
    state.weights[0] = state.weights[1] = 0.0


@lean
def bin_rows(
    rows: tuple[I64, F64, F64, F64, Bool], rows_per_bin: int, state: Bin, bins: tuple[F64, I64], done: I64
) -> int:
    """:func:`into_bins` into arrays that it is given; the number of bins completed."""
    t_ns, pose, efforts, variances, restarts = rows
    values, stamps = bins
    n_bins = 0
    for i in range(t_ns.shape[0]):
        if restarts[i]:
            for k in range(FORCE):
                state.sums[k] = 0.0
            state.weights[0] = 0.0
            state.sums[RELEASED] = 1.0
        if state.weights[0] == 0.0:
            state.stamps[1] = t_ns[i]
            state.stamps[0] = 0
        step_s = (t_ns[i] - state.stamps[2]) * 1e-9 if state.stamps[2] > 0 else 0.0
        add_row(state, i, pose, efforts, variances, step_s)
        state.stamps[0] += t_ns[i] - state.stamps[1]
        state.stamps[2] = t_ns[i]
        if state.weights[0] >= rows_per_bin:
            close_bin(state, values, stamps, n_bins)
            n_bins += 1
        done[i] = n_bins
    return n_bins
