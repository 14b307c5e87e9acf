"""Samples, batch by batch, into one recording: in blocks and decimated, neither depending on the batches."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
from rerun.blueprint.components import PlayState

from wmr_replay.tables.row_blocks import BLOCK_ROWS, LIVE_BLOCK_ROWS
from wmr_replay.timeline.blueprint import Contents, layout
from wmr_replay.timeline.columns import stride_for
from wmr_replay.timeline.description import how_to_read, verdict_text
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.robot import POSE_HZ, VELOCITY_HZ, Scales, velocities
from wmr_replay.timeline.series import (
    AS_STATED,
    ESTIMATED,
    NOMINAL,
    TORQUE,
    TRUE,
    alpha_range,
    as_stated,
    learnt_ranges,
)
from wmr_replay.timeline.sink import Sink, recording_into
from wmr_replay.timeline.states import HINDSIGHT_LANE, LANES, Changes
from wmr_replay.timeline.views import Span
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.files import PartFile

TrueStates = Callable[[int], Iterator[pl.DataFrame]]
STATES = list(dict.fromkeys(name for lane in LANES for name in lane.state.meta.root_names()))
PATH_COLUMNS = {"t_ns", "x_m", "y_m"}
SLOW_HZ = 20.0
"""Most rows a second of lines that change little from row to row."""
DRAWN_ROWS = 32_768
"""Rows that are drawn at one time: what a series costs each time it is written is half of the time at 6,500
of them.
"""
MOST_BLOCKS = 8
"""Blocks of which no more rows' states are held: of a fast log few rows are drawn."""
READING = "The log is being read."
GROWTH = 2.0
"""A viewer that looks on gets a new layout when the log has grown by this factor."""


class Timeline:
    """The recording of one run: a temporary file that :meth:`finish` renames to ``path``.

    Series and path hold the rows whose absolute index is a multiple of ⌈rate_hz / max_rate_hz⌉: no more than
    ``max_rate_hz`` a second, the same ones whatever the batches. Mode and status change at their exact rows.

    ``truth`` is the side file's true state at the pose stamps (``t_ns, x_m, y_m, yaw_rad, v_long_mps,
    v_lat_mps, yaw_rate_radps``; what is missing is not drawn), or gives every n-th of its rows in
    blocks. ``torque`` gives the wheel torques known so far (``t_ns, left_nm, right_nm``). A fixed
    ``recording_id`` lets two runs compare as equal. ``live`` is the address of a viewer that is to show the
    rows as they come.
    """

    def __init__(  # noqa: PLR0913 – keyword arguments
        self,
        path: Path,
        *,
        log_name: str,
        alpha_nominal: float | None,
        rate_hz: float,
        truth: pl.DataFrame | TrueStates | None = None,
        torque: Callable[[], pl.DataFrame] | None = None,
        max_rate_hz: float = 100.0,
        recording_id: str | None = None,
        live: str | None = None,
    ) -> None:
        self._file = PartFile(path)
        self._log_name, self._alpha_nominal, self._rate_hz = log_name, alpha_nominal, rate_hz
        self._strides = {hz: stride_for(rate_hz, hz) for hz in (max_rate_hz, SLOW_HZ, POSE_HZ, VELOCITY_HZ)}
        self._most_hz, self._stride, self._live = max_rate_hz, self._strides[max_rate_hz], live is not None
        self._block_rows = LIVE_BLOCK_ROWS if self._live else BLOCK_ROWS
        self._truth, self._torque = truth, torque
        try:
            self._sink = Sink(recording_into(self._file.path, recording_id, live), live=self._live)
        except BaseException:  # an interruption: nobody else knows the file yet
            self._file.discard()
            raise
        self._lanes = [(lane, Changes(lane)) for lane in LANES]
        self._later: Changes | None = None
        self._frame = Frame()
        self._fastest_mps = 0.0
        self._torque_until_ns: int | None = None
        self._true_path = False
        self._pieces: list[pl.DataFrame] = []
        self._n_waiting = self._n_written = 0
        self._pick_anew()
        self._last: pl.DataFrame | None = None
        self._shown_until_s = 0.0

    def push(self, samples: pl.DataFrame) -> None:
        """Append the next rows of the samples table, any number of them."""
        self._pieces.append(samples)
        self._n_waiting += len(samples)
        if self._n_waiting < self._block_rows:
            return
        waiting = pl.concat(self._pieces)
        while len(waiting) >= self._block_rows:
            self._write(waiting[: self._block_rows])
            waiting = waiting[self._block_rows :]
        self._pieces, self._n_waiting = [waiting], len(waiting)

    def push_hindsight(self, rows: pl.DataFrame) -> None:
        """Append the next rows of the hindsight table, after all samples."""
        if self._later is None:
            self._write_waiting()  # the first of them sets the zero of the timeline
            self._later = Changes(HINDSIGHT_LANE)
            self._sink.add_lane(HINDSIGHT_LANE)
        self._sink.add_changes(HINDSIGHT_LANE, self._later.push(rows))

    def finish(self, verdict: str | None = None, findings: Sequence[Mapping[str, Any]] = ()) -> None:
        """Write what is left, the texts with the verdict (markdown), the findings on the data and the layout;
        put the file in its place.
        """
        self._write_waiting()
        if self._last is not None:
            self._write_nominal(int(self._last["t_ns"][0]))
            self._sink.add_grid(self._frame)
            self._sink.size_robot(self._scales())
        self._sink.add_text(verdict_text(self._log_name, verdict, findings))
        self._sink.add_text(self._how_to_read(), "/how_to_read")
        self._sink.add_findings(findings)
        self._sink.close(layout(self._contents(found=bool(findings))))
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
        if self._n_picked:
            self._draw()

    def _write(self, block: pl.DataFrame) -> None:
        """Pick the rows to draw, and every row's states; draw them once they are many."""
        if self._n_written == 0:
            self._begin(int(block["t_ns"][0]))
        self._states.append(block.select("t_ns", *STATES))
        drawn = self._every(block, self._stride)
        for hz, picked in self._picked.items():
            picked.append(self._every_of(block, drawn, self._strides[hz]))
        self._n_written += len(block)
        self._n_picked += len(drawn)
        self._last = block.tail(1)
        if self._live or self._n_picked >= DRAWN_ROWS or len(self._states) >= MOST_BLOCKS:
            self._draw()

    def _pick_anew(self) -> None:
        """Nothing is picked."""
        self._picked: dict[float, list[pl.DataFrame]] = {hz: [] for hz in self._strides}
        self._states: list[pl.DataFrame] = []
        self._n_picked = 0

    def _draw(self) -> None:
        """Write the rows that are picked."""
        rows = {hz: pl.concat(picked) for hz, picked in self._picked.items()}
        drawn, slow, poses, moving = (rows[hz] for hz in (self._most_hz, SLOW_HZ, POSE_HZ, VELOCITY_HZ))
        states = pl.concat(self._states)
        for lane, changes in self._lanes:
            self._sink.add_changes(lane, changes.push(states))
        self._pick_anew()
        self._sink.add_lines([series for series in ESTIMATED if not series.slow], drawn)
        self._sink.add_lines([series for series in ESTIMATED if series.slow], slow)
        if len(drawn):
            self._frame.include(drawn.select("x_m", "y_m").to_numpy())
            self._sink.add_path(drawn)
        if len(moving):
            self._fastest_mps = max(self._fastest_mps, float(np.hypot(*velocities(moving).T).max()))
        self._sink.add_robot(poses)
        self._sink.add_velocity(moving)
        if self._last is not None:
            self._write_torque(int(self._last["t_ns"][0]))
        self._sink.flush()
        self._show_growth()

    def _every(self, block: pl.DataFrame, stride: int) -> pl.DataFrame:
        """The rows whose index in the whole log is a multiple of the stride."""
        return block[-self._n_written % stride :: stride]

    def _every_of(self, block: pl.DataFrame, drawn: pl.DataFrame, stride: int) -> pl.DataFrame:
        """The same, taken from those that are drawn where they are among them."""
        times, rest = divmod(stride, self._stride)
        if rest:
            return self._every(block, stride)
        n_drawn = -(-self._n_written // self._stride)
        return drawn[-n_drawn % times :: times]

    def _begin(self, start_ns: int) -> None:
        self._sink.start_ns = start_ns
        if self._truth is None:
            return
        stride, truth = self._stride, self._truth
        blocks = [truth.gather_every(stride)] if isinstance(truth, pl.DataFrame) else truth(stride)
        path: list[pl.DataFrame] = []
        for block in blocks:
            self._sink.add_lines(TRUE, block)
            if set(block.columns) >= PATH_COLUMNS:
                path.append(block.select(PATH_COLUMNS))
            self._sink.flush()
        if path:
            self._sink.add_true_path(pl.concat(path))
            self._true_path = True

    def _write_torque(self, until_ns: int) -> None:
        """Append the torques up to a stamp, whatever is known beyond it."""
        if self._torque is None:
            return
        rows = self._torque().filter(pl.col("t_ns") <= until_ns)
        if self._torque_until_ns is not None:
            rows = rows.filter(pl.col("t_ns") > self._torque_until_ns)
        if len(rows):
            self._torque_until_ns = int(rows["t_ns"][-1])
            self._sink.add_lines([TORQUE], rows)

    def _write_nominal(self, end_ns: int) -> None:
        """Levels over the whole log: the nominal α, and what was learnt if the robot were as stated."""
        ends = pl.DataFrame({"t_ns": np.array([self._sink.start_ns, end_ns])})
        if self._alpha_nominal is not None:
            self._sink.add_lines([NOMINAL], ends.with_columns(alpha=pl.lit(self._alpha_nominal)))
        for name, value in AS_STATED.items():
            if f"/learnt/{name}/estimate" in self._sink.written:
                self._sink.add_lines([as_stated(name)], ends.with_columns(pl.lit(value).alias(name)))

    def _show_growth(self) -> None:
        """A layout for the log so far, for a viewer that looks on."""
        span = self._span()
        if not self._live or span is None or span.end_s < GROWTH * self._shown_until_s:
            return
        if self._shown_until_s == 0.0:
            self._sink.add_text(verdict_text(self._log_name, READING))
        self._shown_until_s = span.end_s
        self._sink.add_grid(self._frame)
        self._sink.size_robot(self._scales())
        self._sink.show(layout(self._contents(), PlayState.Following))

    def _contents(self, *, found: bool = False) -> Contents:
        alpha = alpha_range(self._last, self._alpha_nominal)
        written = self._sink.written.keys()
        learnt = learnt_ranges(self._last)
        return Contents(written, self._frame, self._span(), alpha, found, self._true_path, learnt)

    def _span(self) -> Span | None:
        if self._last is None:
            return None
        return Span(0.0, (int(self._last["t_ns"][0]) - self._sink.start_ns) / NS_PER_S)

    def _scales(self) -> Scales:
        return Scales.of(self._frame, self._fastest_mps)

    def _how_to_read(self) -> str:
        parts = {
            "has_truth": self._truth is not None,
            "has_hindsight": self._later is not None,
            "by_wheel_speeds": "/slip/left/estimate" in self._sink.written,
        }
        arrow_s = self._scales().arrow_s if self._last is not None else None
        return how_to_read(self._rate_hz, self._rate_hz / self._stride, arrow_s, **parts)
