"""One Rerun recording on its way into a file: how each kind of data is put into it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from wmr_replay.timeline.columns import blank_holes, rows_to_draw, time_columns
from wmr_replay.timeline.path import (
    Frame,
    log_grid,
    log_scene,
    strip_columns,
    strips_by_mode,
    true_strip_columns,
)
from wmr_replay.timeline.series import Series
from wmr_replay.timeline.states import LANES, Lane
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.findings import Severity
from wmr_schemas.modes import ContactMode
from wmr_schemas.text import shown

APPLICATION = "wmr_replay"
LEVELS = {
    Severity.NOTE: rr.TextLogLevel.INFO,
    Severity.WARNING: rr.TextLogLevel.WARN,
    Severity.BARS: rr.TextLogLevel.ERROR,
}
"""The viewer's levels of log entries."""
XY = ("x_m", "y_m")
DESCRIBED_NS = pl.col("t_ns") - (pl.col("delay_s").fill_null(0.0) * NS_PER_S).round().cast(pl.Int64)
"""The instant that the derivative columns of a row describe."""


def recording_into(path: Path, recording_id: str | None) -> rr.RecordingStream:
    """A recording that streams into ``path``."""
    recording = rr.RecordingStream(
        APPLICATION,
        recording_id=None if recording_id is None else shown(recording_id),
        send_properties=False,
    )
    recording.save(path)
    return recording


class Sink:
    """A run in a recording, below ``root``; ``start_ns`` is the zero of the timeline ``log_t``."""

    def __init__(self, recording: rr.RecordingStream, root: str = "", lanes: Sequence[Lane] = LANES) -> None:
        self.start_ns = 0
        self.written: dict[str, bool] = {}
        """Series that hold anything, and whether the last row of each was finite."""
        self._path_end: pl.DataFrame | None = None
        self.recording, self._root = recording, root
        log_scene(self.recording, root)
        for lane in lanes:
            self.recording.log(root + lane.entity, lane.configuration(), static=True)

    def add_lines(self, series: Series, rows: pl.DataFrame) -> None:
        """Append rows to a series, leaving holes where a value is null or not finite."""
        values = rows.select(line.cast(pl.Float64).alias(str(k)) for k, line in enumerate(series.lines))
        blanked, finite = blank_holes(values.to_numpy())
        first_ever = series.entity not in self.written
        if first_ever and not finite.any():
            return
        drawn = rows_to_draw(finite, before=self.written.get(series.entity, False))
        self.written[series.entity] = bool(finite[-1])
        if first_ever:
            self._style(series)
        at = rows.select(DESCRIBED_NS).to_series() if series.at_described else rows["t_ns"]
        self._send(series.entity, at.filter(drawn), rr.Scalars.columns(scalars=blanked[drawn]))

    def add_changes(self, lane: Lane, rows: pl.DataFrame) -> None:
        """Append state changes (t_ns, state)."""
        if len(rows):
            states = rr.StateChange.columns(state=rows["state"].to_list())
            self._send(lane.entity, rows["t_ns"], states)

    def add_path(self, rows: pl.DataFrame) -> None:
        """Append to the measured path, joined to what was appended before."""
        self._send("/path/robot", rows["t_ns"], rr.Points2D.columns(positions=rows.select(XY).to_numpy()))
        rows = rows.select("t_ns", *XY, pl.col("mode").fill_null(int(ContactMode.UNDECIDED)))
        joined = rows if self._path_end is None else pl.concat([self._path_end, rows])
        self._path_end = rows.tail(1)
        strips = strips_by_mode(joined.select(XY).to_numpy(), joined["mode"].to_numpy())
        if strips.points:
            self._send("/path/estimated", joined["t_ns"][strips.first_rows], strip_columns(strips))

    def add_strips(self, entity: str, t_ns: pl.Series, strips: rr.ComponentColumnList) -> None:
        """Append pieces of a path, each at a stamp."""
        if len(t_ns):
            self._send(entity, t_ns, strips)

    def add_true_path(self, truth: pl.DataFrame) -> None:
        """The true path as a whole."""
        if len(truth) > 1 and set(XY) <= set(truth.columns):
            self._send("/path/true", truth["t_ns"][:1], true_strip_columns(truth.select(XY).to_numpy()))

    def add_grid(self, frame: Frame) -> None:
        """The grid behind the path."""
        log_grid(self.recording, *frame.with_margin(), self._root)

    def add_text(self, markdown: str) -> None:
        """The text panel."""
        self.recording.log(
            "/description", rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN), static=True
        )

    def add_findings(self, findings: Sequence[Mapping[str, Any]]) -> None:
        """Findings on the data's quality as log entries, each where it begins."""
        if not findings:
            return
        at_s = [found["where"][0][0] if found["where"] else 0.0 for found in findings]
        t_ns = pl.Series([self.start_ns + round(t_s * NS_PER_S) for t_s in at_s])
        texts = [shown(f"{found['code']}: {found['text']}. {found['advice']}") for found in findings]
        levels = [LEVELS[found["severity"]] for found in findings]
        self._send("/findings", t_ns, rr.TextLog.columns(text=texts, level=levels))

    def flush(self) -> None:
        """Wait until everything is in the file; else rows logged faster than written fill the memory."""
        self.recording.flush()

    def close(self, layout: rrb.Blueprint | None = None) -> None:
        """Embed the layout, write everything out and close the file."""
        if layout is not None:
            self.recording.send_blueprint(layout)
        self.recording.flush()
        self.recording.disconnect()

    def _style(self, series: Series) -> None:
        n = len(series.lines)
        style = rr.SeriesLines(
            colors=[series.colour] * n,
            widths=[series.width] * n,
            names=list(series.names),
            aggregation_policy=rr.components.AggregationPolicy.MinMax,
        )
        self.recording.log(self._root + series.entity, style, static=True)

    def _send(self, entity: str, t_ns: pl.Series, columns: rr.ComponentColumnList) -> None:
        self.recording.send_columns(
            self._root + entity, time_columns(t_ns.to_numpy(), self.start_ns), columns
        )
