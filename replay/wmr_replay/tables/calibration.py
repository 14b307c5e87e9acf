"""Calibration of the posterior: Brier score and expected calibration error, collected batch by batch."""

import numpy as np
import polars as pl

from wmr_schemas.modes import MODES
from wmr_schemas.status import Status

N_BINS = 10
POSTERIOR = tuple(f"p_{mode.label}" for mode in MODES)


class CalibrationCollector:
    """``push(samples)`` batches in order; rows after warm-up count that have a truth and a posterior."""

    def __init__(self) -> None:
        self._n, self._squares = 0, 0.0
        self._bins = np.zeros((3, N_BINS))

    def push(self, samples: pl.DataFrame) -> None:
        """Take a batch of the samples table in."""
        judged = samples.select("mode_true", "status", *POSTERIOR).filter(
            pl.col("mode_true").is_not_null(),
            pl.col("p_ideal").is_not_null(),
            pl.col("status") != Status.WARMING_UP.label,
        )
        if not len(judged):
            return
        posterior = judged.select(pl.col(POSTERIOR).fill_null(0.0)).to_numpy()
        true = judged["mode_true"].to_numpy()
        of_true = np.take_along_axis(posterior, true[:, None].astype(np.int64), axis=1)
        self._n += len(true)
        self._squares += float(np.sum(posterior**2) - 2 * np.sum(of_true) + len(true))
        confidence = posterior.max(axis=1)
        index = np.minimum((confidence * N_BINS).astype(int), N_BINS - 1)
        right = posterior.argmax(axis=1) == true
        for row, weight in enumerate((np.ones_like(confidence), confidence, right)):
            self._bins[row] += np.bincount(index, weight, N_BINS)

    @property
    def brier(self) -> float | None:
        """Mean over rows of Σ_k (p_k − 1[mode k is the true one])²: 0 at best, 2 at worst."""
        return self._squares / self._n if self._n else None

    @property
    def ece(self) -> float | None:
        """Σ_b (n_b/n)·|accuracy_b − confidence_b| over ten bins of the most probable mode's posterior."""
        gap = float(np.abs(self._bins[2] - self._bins[1]).sum())
        return gap / self._n if self._n else None
