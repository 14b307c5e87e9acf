"""The engine: raw batches in, rows of the samples table out, causal and independent of the batches.

align → (initial stretch) → repair → differentiate → identify. Rows of the initial stretch get the status
``warming_up``: what the stretch tells about the log must not reach back into it.
"""

from collections.abc import Iterator
from typing import TypeAlias

from wmr_replay.align import Aligner, SampleBatch, concatenate
from wmr_replay.pipeline.chain import Chain
from wmr_replay.pipeline.columns import Columns, warming_up_columns
from wmr_replay.pipeline.derivation import Tuning
from wmr_replay.pipeline.evidence import chosen_evidence, remark_on
from wmr_replay.pipeline.hindsight import Record
from wmr_replay.pipeline.intake import Intake, stretch_length
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_replay.quality.frozen import RepeatedRows
from wmr_replay.quality.reader_bars import ReaderBars
from wmr_schemas.batches import Bar, RawBatch
from wmr_schemas.findings import Finding

TakenIn: TypeAlias = tuple[tuple[Bar, ...], SampleBatch]
"""Bars of the reader, and the measured rows."""


class Engine:
    """Stage: ``push(RawBatch)`` and ``finish()`` give batches of :data:`Columns`, every pose row once and in
    order; the second pass follows where the settings ask for it. ``push`` is :meth:`take_in` and then
    :meth:`advance`; another thread may take in the next batch while this one advances. The wheel speeds of a
    ``steered`` robot tell nothing of slipping. ``wheels_alone``: the log's channels hold wheel speeds and no
    torques, whenever they begin.
    """

    def __init__(
        self, settings: Settings, model: ReplayModel, *, steered: bool = False, wheels_alone: bool = False
    ) -> None:
        self.settings, self.model = settings, model
        self._steered, self._wheels_alone = steered, wheels_alone
        self._record = Record() if settings.hindsight else None
        self._intake, self._repeats = Intake(settings, model), RepeatedRows()
        self._chain: Chain | None = None
        self.told_by, self.note = "", ""
        """What tells the modes once the initial stretch is complete, and why that is less than was asked."""
        self._bars = ReaderBars()
        self._stretch: list[SampleBatch] = []
        self._start_ns = 0

    @property
    def aligner(self) -> Aligner:
        """The stage that aligns the signals, which counts what it leaves out."""
        return self._intake.aligner

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
        frozen = self._intake.frozen
        parts = frozen.n_position, frozen.n_yaw
        return [*self._repeats.findings(self._chain.bridged_s, *parts), *self._chain.findings]

    def push(self, batch: RawBatch) -> list[Columns]:
        """The rows of the table that the batch completes."""
        return self.advance(self.take_in(batch))

    def take_in(self, batch: RawBatch) -> TakenIn:
        """The batch aligned: what :meth:`advance` is given, in the order of the batches."""
        return batch.bars, self._intake.push(batch)

    def advance(self, taken: TakenIn) -> list[Columns]:
        """The rows of the table that what was taken in completes."""
        bars, rows = taken
        self._bars.take(bars)
        return self._advance(rows)

    def finish(self) -> list[Columns]:
        """The rows still held; a log that ends within its initial stretch is warming up throughout."""
        done = self._advance(self._intake.finish())
        done += self._chain.finish() if self._chain is not None else []
        rest = [warming_up_columns(self._start_ns, rows, self.settings.all_modes) for rows in self._stretch]
        self._stretch = []
        return done + rest

    def hindsight(self) -> Iterator[Columns]:
        """Batches of the hindsight table, after :meth:`finish`; a log too short for any answer has none."""
        second = self._chain.second_pass() if self._chain else None
        return iter(()) if second is None else second.columns()

    def _advance(self, rows: SampleBatch) -> list[Columns]:
        """Measured rows → rows of the table; the initial stretch is held until it is complete."""
        if not len(rows):
            return []
        self._repeats.push(rows.t_ns, rows.frozen)
        if self._chain is not None:
            return self._chain.push(rows)
        held = concatenate([*self._stretch, rows])
        n_stretch = stretch_length(held, self.settings)
        if len(held) <= n_stretch:
            self._start_ns, self._stretch = int(held.t_ns[0]), [held]
            return []
        self._stretch = []
        return self._begin(held.part(slice(n_stretch)), held.part(slice(n_stretch, None)))

    def _begin(self, stretch: SampleBatch, rest: SampleBatch) -> list[Columns]:
        """Tune on the stretch and fill the stages' memory with it; its own rows get the status warming_up."""
        self.told_by, self.note = chosen_evidence(
            self.settings.evidence,
            stretch,
            self.model,
            steered=self._steered,
            wheels_alone=self._wheels_alone,
        )
        self.note = "; ".join(filter(None, [self.note, remark_on(self.settings, self.told_by, self.model)]))
        settings = self.settings.told_by(self.told_by)
        self._chain = Chain(settings, self.model, stretch, self._bars, self._record)
        self._chain.push(stretch)
        return [
            warming_up_columns(int(stretch.t_ns[0]), stretch, settings.all_modes),
            *self._chain.push(rest),
        ]
