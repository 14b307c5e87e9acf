"""The engine: raw batches in, rows of the samples table out, causal and independent of the batches.

align → (initial stretch) → repair → differentiate → identify. Rows of the initial stretch get the status
``warming_up``: what the stretch tells about the log must not reach back into it.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from wmr_replay.align import Aligner, FrozenPose, Lag, SampleBatch, concatenate
from wmr_replay.pipeline.chain import Chain
from wmr_replay.pipeline.columns import Columns, warming_up_columns
from wmr_replay.pipeline.derivation import Tuning
from wmr_replay.pipeline.hindsight import Record
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_replay.quality.frozen import RepeatedRows
from wmr_replay.quality.reader_bars import ReaderBars
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.batches import RawBatch
from wmr_schemas.findings import Finding

MIN_STRETCH_ROWS = 20


class Engine:
    """Stage: ``push(RawBatch)`` and ``finish()`` give batches of :data:`Columns`, every pose row once and in
    order; the second pass follows where the settings ask for it.
    """

    def __init__(self, settings: Settings, model: ReplayModel) -> None:
        self.settings, self.model = settings, model
        self._record = Record() if settings.hindsight else None
        self.aligner = Aligner(
            reorder_window_s=settings.reorder_window_s + abs(settings.clock_offset_s),
            max_hold_s=settings.max_hold_s,
        )
        self._frozen, self._repeats = FrozenPose(), RepeatedRows()
        self._lag = Lag(model.lag_s, 2) if model.lag_s > 0 else None
        self._chain: Chain | None = None
        self._bars = ReaderBars()
        self._stretch: list[SampleBatch] = []
        self._start_ns = 0
        self._first_pose_ns: int | None = None

    @property
    def tuning(self) -> Tuning | None:
        """What the log's first stretches have decided so far."""
        return self._chain.tuning if self._chain else None

    @property
    def n_gaps(self) -> int:
        """Holes in the pose so far."""
        return self._chain.n_gaps if self._chain else 0

    @property
    def n_pose_jumps(self) -> int:
        """Jumps of the pose so far."""
        return self._chain.n_pose_jumps if self._chain else 0

    @property
    def n_outliers(self) -> int:
        """Outliers among the poses so far."""
        return self._chain.n_outliers if self._chain else 0

    @property
    def findings(self) -> list[Finding]:
        """What is wrong with the data, so far."""
        if self._chain is None:
            return []
        parts = self._frozen.n_position, self._frozen.n_yaw
        return [*self._repeats.findings(self._chain.bridged_s, *parts), *self._chain.findings]

    def push(self, batch: RawBatch) -> list[Columns]:
        """The rows of the table that the batch completes."""
        if self._first_pose_ns is None and len(batch.pose.t_ns):
            self._first_pose_ns = int(batch.pose.t_ns[0])
        if self.settings.clock_offset_s:
            batch = replace(batch, torque=batch.torque.moved(self.settings.clock_offset_s))
        self._bars.take(batch.bars)
        corrected = self.model.corrected(batch, self._first_pose_ns or 0)
        return self._advance(self.aligner.push(corrected))

    def finish(self) -> list[Columns]:
        """The rows still held; a log that ends within its initial stretch is warming up throughout."""
        done = self._advance(self.aligner.finish())
        rest = [warming_up_columns(self._start_ns, rows, self.settings.all_modes) for rows in self._stretch]
        self._stretch = []
        return done + rest

    def hindsight(self) -> Iterator[Columns]:
        """Batches of the hindsight table, after :meth:`finish`; a log too short for any answer has none."""
        second = self._chain.second_pass() if self._chain else None
        return iter(()) if second is None else second.columns()

    def _advance(self, rows: SampleBatch) -> list[Columns]:
        """Aligned rows → rows of the table; the initial stretch is held until it is complete."""
        if not len(rows):
            return []
        if self._lag is not None:
            efforts = self._lag.push(rows.t_ns, rows.inputs[:2])
            rows = replace(rows, inputs=np.concatenate([efforts, rows.inputs[2:]]))
        rows = self._frozen.push(rows)
        self._repeats.push(rows.t_ns, rows.frozen)
        if self._chain is not None:
            return self._chain.push(rows)
        held = concatenate([*self._stretch, rows])
        n_stretch = self._stretch_length(held)
        if len(held) <= n_stretch:
            self._start_ns, self._stretch = int(held.t_ns[0]), [held]
            return []
        self._stretch = []
        return self._begin(held.part(slice(n_stretch)), held.part(slice(n_stretch, None)))

    def _stretch_length(self, held: SampleBatch) -> int:
        """Rows of the initial stretch, as far as it has come: for the time set, and the measured poses."""
        t_ns = held.t_ns
        by_time = int(np.searchsorted(t_ns, t_ns[0] + round(self.settings.initial_stretch_s * NS_PER_S)))
        measured = np.flatnonzero(held.kept)
        by_rows = int(measured[MIN_STRETCH_ROWS - 1]) + 1 if len(measured) >= MIN_STRETCH_ROWS else len(held)
        return max(by_time, by_rows)

    def _begin(self, stretch: SampleBatch, rest: SampleBatch) -> list[Columns]:
        """Tune on the stretch and fill the stages' memory with it; its own rows get the status warming_up."""
        self._chain = Chain(self.settings, self.model, stretch, self._bars, self._record)
        self._chain.push(stretch)
        return [
            warming_up_columns(int(stretch.t_ns[0]), stretch, self.settings.all_modes),
            *self._chain.push(rest),
        ]
