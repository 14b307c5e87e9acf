"""One Rerun recording on its way into a file: how each kind of data is put into it."""

import re
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from wmr_replay.timeline import colours
from wmr_replay.timeline.columns import blank_holes, rows_to_draw, time_columns
from wmr_replay.timeline.description import log_text
from wmr_replay.timeline.path import (
    Frame,
    log_grid,
    log_scene,
    pen,
    pieces,
    strip_columns,
    strips_by_mode,
    true_strip_columns,
)
from wmr_replay.timeline.robot import (
    Scales,
    log_robot,
    log_scales,
    pose_columns,
    velocity_columns,
)
from wmr_replay.timeline.series import Series
from wmr_replay.timeline.states import LANES, Lane
from wmr_schemas.arrays import F64, NS_PER_S
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
LONGEST = 100
XY = ("x_m", "y_m")
DESCRIBED_NS = pl.col("t_ns") - (pl.col("delay_s").fill_null(0.0) * NS_PER_S).round().cast(pl.Int64)
"""The instant that the derivative columns of a row describe."""


def recording_into(path: Path, recording_id: str | None, live: str | None = None) -> rr.RecordingStream:
    """A recording that streams into ``path``, and to the viewer at ``live`` where there is one."""
    identity = None if recording_id is None else shown(recording_id)
    application = application_of(identity)
    recording = rr.RecordingStream(application, recording_id=identity, send_properties=False)
    if live is None:
        recording.save(path)
    else:
        recording.set_sinks(rr.FileSink(path), rr.GrpcSink(live))
    return recording


def application_of(identity: str | None) -> str:
    """A name of the recording's own among a viewer's applications, in the characters that these may have.

    A viewer keeps one layout for each application, and a layout holds the length and the kind of a recording.
    """
    if identity is None:
        return APPLICATION
    name = re.sub(r"[^A-Za-z0-9_-]+", "-", identity)
    told = name if name == identity else f"{name[:LONGEST]}-{sha256(identity.encode()).hexdigest()[:8]}"
    return f"{APPLICATION}-{told}"


class Sink:
    """Rows on their way into a recording; ``start_ns`` is the zero of the timeline ``log_t``."""

    def __init__(
        self,
        recording: rr.RecordingStream,
        lanes: Sequence[Lane] = LANES,
        *,
        robot: bool = True,
        live: bool = False,
    ) -> None:
        self.start_ns = 0
        self.written: dict[str, bool] = {}
        """Series that hold anything, and whether the last row of each was finite."""
        self._path_end: pl.DataFrame | None = None
        self._penned: set[str] = set()
        self.recording, self._live = recording, live
        log_scene(recording)
        if robot:
            log_robot(recording)
        for lane in lanes:
            self.add_lane(lane)

    def add_lane(self, lane: Lane) -> None:
        """Labels and colours of a lane."""
        self.recording.log(lane.entity, lane.configuration(), static=True)

    def add_lines(self, each: Sequence[Series], rows: pl.DataFrame) -> None:
        """Append rows to those series whose columns they have, leaving holes where a value is null or not
        finite.
        """
        each = [series for series in each if series.reads() <= set(rows.columns)]
        lines = [line.cast(pl.Float64) for series in each for line in series.lines]
        described = [DESCRIBED_NS] if any(series.at_described for series in each) else []
        columns = rows.select(expr.alias(str(k)) for k, expr in enumerate([*lines, *described])).get_columns()
        known = iter(columns)
        for series in each:
            values = np.column_stack([next(known).to_numpy() for _ in series.lines])
            self._add_line(series, columns[-1] if series.at_described else rows["t_ns"], values)

    def _add_line(self, series: Series, t_ns: pl.Series, values: F64) -> None:
        """Append ``values`` (n, k) of the k lines of a series."""
        blanked, finite = blank_holes(values)
        first_ever = series.entity not in self.written
        if first_ever and not finite.any():
            return
        drawn = rows_to_draw(finite, before=self.written.get(series.entity, False))
        self.written[series.entity] = bool(finite[-1])
        if first_ever:
            self._style(series)
        self._send(series.entity, t_ns.filter(drawn), rr.Scalars.columns(scalars=blanked[drawn]))

    def add_changes(self, lane: Lane, rows: pl.DataFrame) -> None:
        """Append state changes (t_ns, state)."""
        if len(rows):
            states = rr.StateChange.columns(state=rows["state"].to_list())
            self._send(lane.entity, rows["t_ns"], states)

    def add_path(self, rows: pl.DataFrame) -> None:
        """Append to the measured path, joined to what was appended before."""
        rows = rows.select("t_ns", *XY, pl.col("mode").fill_null(int(ContactMode.UNDECIDED)))
        joined = rows if self._path_end is None else pl.concat([self._path_end, rows])
        self._path_end = rows.tail(1)
        strips = strips_by_mode(joined.select(XY).to_numpy(), joined["mode"].to_numpy())
        if strips.points:
            self._pen_of("/path/estimated", pen(None, 2.75, 10.0))
            self._send("/path/estimated", joined["t_ns"][strips.first_rows], strip_columns(strips))

    def add_robot(self, rows: pl.DataFrame) -> None:
        """Append poses of the robot at the cursor."""
        known = rows.drop_nulls(["x_m", "y_m", "yaw_rad"])
        if len(known):
            self._send("/path/robot", known["t_ns"], pose_columns(known))

    def add_velocity(self, rows: pl.DataFrame) -> None:
        """Append arrows of the velocity, at the instants that they describe."""
        if len(rows):
            at = rows.select(DESCRIBED_NS).to_series()
            self._send("/path/robot/velocity", at, velocity_columns(rows))

    def size_robot(self, scales: Scales) -> None:
        """Set the sizes of body and arrows."""
        log_scales(self.recording, scales)

    def add_pieces(self, entity: str, points: list[F64], drawn: rr.LineStrips2D) -> None:
        """A path in pieces, seen as a whole wherever the cursor is."""
        if points:
            self.recording.log(entity, pieces(points), drawn, static=True)

    def add_true_path(self, truth: pl.DataFrame) -> None:
        """The true path as a whole."""
        if len(truth) > 1 and set(XY) <= set(truth.columns):
            self._pen_of("/path/true", pen(colours.TRUE_PATH, 0.35, 15.0))
            self._send("/path/true", truth["t_ns"][:1], true_strip_columns(truth.select(XY).to_numpy()))

    def add_grid(self, frame: Frame) -> None:
        """The grid behind the path."""
        log_grid(self.recording, frame)

    def add_text(self, markdown: str, entity: str = "/description") -> None:
        """A text panel."""
        self.recording.log(entity, rr.TextDocument(markdown, media_type=rr.MediaType.MARKDOWN), static=True)

    def show(self, layout: rrb.Blueprint) -> None:
        """Embed the layout, in place of the one before."""
        self.recording.send_blueprint(layout)

    def add_findings(self, findings: Sequence[Mapping[str, Any]]) -> None:
        """Findings on the data's quality as log entries, each where it begins."""
        if not findings:
            return
        at_s = [found["where"][0][0] if found["where"] else 0.0 for found in findings]
        t_ns = pl.Series([self.start_ns + round(t_s * NS_PER_S) for t_s in at_s])
        texts = [log_text(found) for found in findings]
        levels = [LEVELS[found["severity"]] for found in findings]
        self._send("/findings", t_ns, rr.TextLog.columns(text=texts, level=levels))

    def flush(self) -> None:
        """Wait until everything is in the file; else rows logged faster than written fill the memory.

        A viewer that looks on may be closed at any time; the file goes on.
        """
        try:
            self.recording.flush()
        except RuntimeError:
            if not self._live:
                raise

    def close(self, layout: rrb.Blueprint | None = None) -> None:
        """Embed the layout, write everything out and close the file."""
        if layout is not None:
            self.show(layout)
        self.flush()
        self.recording.disconnect()

    def _style(self, series: Series) -> None:
        style = rr.SeriesLines(
            colors=series.line_colours,
            widths=series.line_widths,
            names=list(series.names),
            aggregation_policy=rr.components.AggregationPolicy.MinMax,
        )
        self.recording.log(series.entity, style, static=True)

    def _pen_of(self, entity: str, drawn: rr.LineStrips2D) -> None:
        """Log how a path is drawn, once."""
        if entity not in self._penned:
            self._penned.add(entity)
            self.recording.log(entity, drawn, static=True)

    def _send(self, entity: str, t_ns: pl.Series, columns: rr.ComponentColumnList) -> None:
        self.recording.send_columns(entity, time_columns(t_ns.to_numpy(), self.start_ns), columns)
