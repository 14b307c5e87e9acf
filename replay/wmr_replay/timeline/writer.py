"""Samples, batch by batch, into one recording: in blocks and decimated, neither depending on the batches."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from wmr_replay.timeline.blueprint import layout
from wmr_replay.timeline.columns import stride_for
from wmr_replay.timeline.description import description
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.series import ESTIMATED, NOMINAL, TRUE, alpha_range
from wmr_replay.timeline.sink import Sink, recording_into
from wmr_replay.timeline.states import HINDSIGHT_LANE, LANES, Changes
from wmr_schemas.files import PartFile

TrueStates = Callable[[int], Iterator[pl.DataFrame]]
PATH_COLUMNS = {"t_ns", "x_m", "y_m"}
BLOCK_ROWS = 65_536
"""Rows that are written at one time."""


class Timeline:
    """The recording of one run: a temporary file that :meth:`finish` renames to ``path``.

    Series and path hold the rows whose absolute index is a multiple of ⌈rate_hz / max_rate_hz⌉: no more than
    ``max_rate_hz`` a second, the same ones whatever the batches. Mode and status change at their exact rows.

    ``truth`` is the side file's true state at the pose stamps (``t_ns, x_m, y_m, yaw_rad, v_long_mps,
    v_lat_mps, yaw_rate_radps``; what is missing is not drawn), or gives every n-th of its rows in
    blocks. A fixed ``recording_id`` lets two runs compare as equal.
    """

    def __init__(
        self,
        path: Path,
        *,
        log_name: str,
        alpha_nominal: float | None,
        rate_hz: float,
        truth: pl.DataFrame | TrueStates | None = None,
        max_rate_hz: float = 100.0,
        recording_id: str | None = None,
    ) -> None:
        self._file = PartFile(path)
        self._log_name, self._alpha_nominal, self._rate_hz = log_name, alpha_nominal, rate_hz
        self._stride = stride_for(rate_hz, max_rate_hz)
        self._truth = truth
        self._sink = Sink(recording_into(self._file.path, recording_id))
        self._lanes = [(lane, Changes(lane)) for lane in LANES]
        self._later: Changes | None = None
        self._frame = Frame()
        self._pieces: list[pl.DataFrame] = []
        self._n_waiting = self._n_written = 0
        self._last: pl.DataFrame | None = None

    def push(self, samples: pl.DataFrame) -> None:
        """Append the next rows of the samples table, any number of them."""
        self._pieces.append(samples)
        self._n_waiting += len(samples)
        if self._n_waiting < BLOCK_ROWS:
            return
        waiting = pl.concat(self._pieces)
        while len(waiting) >= BLOCK_ROWS:
            self._write(waiting[:BLOCK_ROWS])
            waiting = waiting[BLOCK_ROWS:]
        self._pieces, self._n_waiting = [waiting], len(waiting)

    def push_hindsight(self, rows: pl.DataFrame) -> None:
        """Append the next rows of the hindsight table, after all samples."""
        if self._later is None:
            self._write_waiting()  # the first of them sets the zero of the timeline
            self._later = Changes(HINDSIGHT_LANE)
            self._sink.add_lane(HINDSIGHT_LANE)
        self._sink.add_changes(HINDSIGHT_LANE, self._later.push(rows))

    def finish(self, verdict: str | None = None, findings: Sequence[Mapping[str, Any]] = ()) -> None:
        """Write what is left, the text with the verdict (markdown), the findings on the data and the layout;
        put the file in its place.
        """
        self._write_waiting()
        if self._last is not None:
            self._write_nominal(int(self._last["t_ns"][0]))
            self._sink.add_grid(self._frame)
        self._sink.add_text(self._description(verdict))
        self._sink.add_findings(findings)
        alpha = alpha_range(self._last, self._alpha_nominal)
        parts = {"found": bool(findings), "hindsight": self._later is not None}
        self._sink.close(layout(self._sink.written.keys(), self._frame, alpha, **parts))
        self._file.finish()

    def discard(self) -> None:
        """Close and remove the unfinished file; one that was finished stays."""
        self._sink.close()
        self._file.discard()

    def _write_waiting(self) -> None:
        """Write the samples that are held."""
        if self._n_waiting:
            self._write(pl.concat(self._pieces))
        self._pieces, self._n_waiting = [], 0

    def _write(self, block: pl.DataFrame) -> None:
        if self._n_written == 0:
            self._begin(int(block["t_ns"][0]))
        for lane, changes in self._lanes:
            self._sink.add_changes(lane, changes.push(block))
        drawn = block.gather_every(self._stride, offset=-self._n_written % self._stride)
        self._n_written += len(block)
        self._last = block.tail(1)
        for series in ESTIMATED:
            self._sink.add_lines(series, drawn)
        if len(drawn):
            self._frame.include(drawn.select("x_m", "y_m").to_numpy())
            self._sink.add_path(drawn)
        self._sink.flush()

    def _begin(self, start_ns: int) -> None:
        self._sink.start_ns = start_ns
        if self._truth is None:
            return
        stride, truth = self._stride, self._truth
        blocks = [truth.gather_every(stride)] if isinstance(truth, pl.DataFrame) else truth(stride)
        path: list[pl.DataFrame] = []
        for block in blocks:
            for series in TRUE:
                if series.reads() <= set(block.columns):
                    self._sink.add_lines(series, block)
            if set(block.columns) >= PATH_COLUMNS:
                path.append(block.select(PATH_COLUMNS))
            self._sink.flush()
        if path:
            self._sink.add_true_path(pl.concat(path))

    def _write_nominal(self, end_ns: int) -> None:
        if self._alpha_nominal is not None:
            t_ns = np.array([self._sink.start_ns, end_ns])
            self._sink.add_lines(NOMINAL, pl.DataFrame({"t_ns": t_ns, "alpha": self._alpha_nominal}))

    def _description(self, verdict: str | None) -> str:
        drawn_hz = self._rate_hz / self._stride
        parts = {"has_truth": self._truth is not None, "has_hindsight": self._later is not None}
        return description(self._log_name, verdict, self._rate_hz, drawn_hz, **parts)
