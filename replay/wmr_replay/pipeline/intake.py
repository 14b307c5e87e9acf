"""From raw batches to measured rows: aligned, corrected by the model, repeats of the tracker marked."""

from dataclasses import replace

import numpy as np

from wmr_replay.align import Aligner, FrozenPose, Lag, SampleBatch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.batches import RawBatch

MIN_STRETCH_ROWS = 20


class Intake:
    """Stage: ``push(RawBatch)`` and ``finish()`` give rows with measured poses."""

    def __init__(self, settings: Settings, model: ReplayModel) -> None:
        self._settings, self._model = settings, model
        self.aligner = Aligner(
            reorder_window_s=settings.reorder_window_s + abs(settings.clock_offset_s) + abs(model.delay_s),
            max_hold_s=settings.max_hold_s,
        )
        self.frozen = FrozenPose()
        self._lag = Lag(model.lag_s, 2) if model.lag_s > 0 else None
        self._first_pose_ns: int | None = None

    def push(self, batch: RawBatch) -> SampleBatch:
        """The rows that the batch completes."""
        if self._first_pose_ns is None and len(batch.pose.t_ns):
            self._first_pose_ns = int(batch.pose.t_ns[0])
        if self._settings.clock_offset_s:
            by_s = self._settings.clock_offset_s
            batch = replace(batch, torque=batch.torque.moved(by_s), wheels=batch.wheels.moved(by_s))
        corrected = self._model.corrected(batch, self._first_pose_ns or 0)
        return self._measured(self.aligner.push(corrected))

    def finish(self) -> SampleBatch:
        """The rows still held."""
        return self._measured(self.aligner.finish())

    def _measured(self, rows: SampleBatch) -> SampleBatch:
        """Aligned rows with efforts as the actuators' lag leaves them, and repeated poses marked."""
        if not len(rows):
            return rows
        if self._lag is not None:
            efforts = self._lag.push(rows.t_ns, rows.inputs[:2])
            rows = replace(rows, inputs=np.concatenate([efforts, rows.inputs[2:]]))
        return self.frozen.push(rows)


def stretch_length(rows: SampleBatch, settings: Settings) -> int:
    """Rows of the initial stretch, as far as it has come: for the time set, and the measured poses."""
    t_ns = rows.t_ns
    by_time = int(np.searchsorted(t_ns, t_ns[0] + round(settings.initial_stretch_s * NS_PER_S)))
    measured = np.flatnonzero(rows.kept)
    by_rows = int(measured[MIN_STRETCH_ROWS - 1]) + 1 if len(measured) >= MIN_STRETCH_ROWS else len(rows)
    return max(by_time, by_rows)
