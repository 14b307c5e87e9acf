"""Two results in one recording: their entities below ``/a`` and ``/b``, drawn over one another."""

from dataclasses import dataclass, replace
from pathlib import Path

import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from wmr_replay.timeline import colours
from wmr_replay.timeline.blueprint import path_view, with_panels
from wmr_replay.timeline.columns import stride_for
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.series import ESTIMATED, Series, alpha_range
from wmr_replay.timeline.sink import Sink, recording_into
from wmr_replay.timeline.states import LANES, Changes, Lane
from wmr_schemas.files import whole_file

Pen = tuple[colours.Colour, float]
BROAD: Pen = (colours.ESTIMATE, 4.0)
THIN: Pen = (colours.SECOND, 1.25)
"""b is drawn over a: where both agree, a still shows on either side."""
SAME, ANOTHER = "same mode", "another mode"
DIFFERS = Lane("/differs", pl.col("state"), {SAME: (52, 60, 70), ANOTHER: (213, 94, 0)})
PLOTS = {
    "v_long [m/s]": "/velocity/v_long_mps/estimate",
    "Yaw rate [rad/s]": "/velocity/yaw_rate_radps/estimate",
    "v_lat [m/s]": "/velocity/v_lat_mps/estimate",
    "C_k [m/s]": "/constraint/c_k_mps/estimate",
    "C_d [m/s²]": "/constraint/c_d_mps2/estimate",
    "α [(m/s²)/(N·m)]": "/alpha/estimate",
}
"""What is drawn of both, by the plot's title."""
ALPHA = "/alpha/estimate"
LANES_SHOWN = ("/differs", "/a/mode/estimated", "/b/mode/estimated", "/a/mode/true", "/a/status", "/b/status")


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two: its name, its samples table, and the rate of its rows in Hz."""

    name: str
    samples: pl.DataFrame
    rate_hz: float


def write_comparison(
    path: Path, a: Side, b: Side, other_mode: pl.DataFrame, text: str, *, max_rate_hz: float = 100.0
) -> None:
    """Write both sides into one recording at ``path``, whole or not at all.

    ``other_mode`` has the stamps of a's rows (``t_ns``) and whether b's mode there is another (``differs``);
    ``text`` is shown as markdown. Series hold at most ``max_rate_hz`` rows a second, changes are exact.
    """
    with whole_file(path) as part:
        recording = recording_into(part, f"compare-{a.name}-{b.name}")
        try:
            fill(recording, a, b, other_mode, text, max_rate_hz)
        finally:
            recording.disconnect()


def fill(
    recording: rr.RecordingStream,
    a: Side,
    b: Side,
    other_mode: pl.DataFrame,
    text: str,
    max_rate_hz: float,
) -> None:
    """Put both sides, the differences of their modes, the text and the layout into a recording."""
    sides, frame = (("/a", a, BROAD), ("/b", b, THIN)), Frame()
    sinks = [Sink(recording, root) for root, _, _ in sides]
    for sink, (root, side, pen) in zip(sinks, sides, strict=True):
        add_side(sink, side, root[1:], pen, frame, max_rate_hz)
    for sink in sinks:
        sink.add_grid(frame)
    whole = Sink(recording)
    whole.start_ns = sinks[0].start_ns
    recording.log(DIFFERS.entity, DIFFERS.configuration(), static=True)
    whole.add_changes(DIFFERS, mode_differences(other_mode))
    whole.add_text(text)
    whole.close(layout(frame, a, b))


def add_side(sink: Sink, side: Side, key: str, pen: Pen, frame: Frame, max_rate_hz: float) -> None:
    """Lanes, lines and path of one side."""
    sink.start_ns = int(side.samples["t_ns"][0])
    for lane in LANES:
        sink.add_changes(lane, Changes(lane).push(side.samples))
    drawn = side.samples.gather_every(stride_for(side.rate_hz, max_rate_hz))
    for series in ESTIMATED:
        if series.entity in PLOTS.values():
            sink.add_lines(drawn_with(series, key, pen), drawn)
    frame.include(drawn.select("x_m", "y_m").to_numpy())
    sink.add_path(drawn)
    sink.flush()


def drawn_with(series: Series, key: str, pen: Pen) -> Series:
    """The series in the colour and width of its side, named by it."""
    colour, width = pen
    return replace(series, colour=colour, width=width, names=tuple(f"{key}: {n}" for n in series.names))


def mode_differences(other_mode: pl.DataFrame) -> pl.DataFrame:
    """The rows (t_ns, state) at which the two begin to agree or to differ."""
    named = other_mode.select("t_ns", state=pl.when("differs").then(pl.lit(ANOTHER)).otherwise(pl.lit(SAME)))
    return Changes(DIFFERS).push(named) if len(named) else named


def layout(frame: Frame, a: Side, b: Side) -> rrb.Blueprint:
    """Paths beside one another, lanes below one another, lines over one another."""
    paths = rrb.Horizontal(
        path_view(frame, "/a", "a: path [m], by mode"), path_view(frame, "/b", "b: path [m], by mode")
    )
    text = rrb.TextDocumentView(origin="/description", name="Differences")
    left = rrb.Vertical(paths, text, row_shares=[45, 55])
    linked = rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal)
    lanes = rrb.StateTimelineView(
        origin="/", contents=list(LANES_SHOWN), name="Contact mode and status of both", time_view=linked
    )
    ranges = alpha_range(a.samples.tail(1), None), alpha_range(b.samples.tail(1), None)
    known = [limit for limits in ranges if limits is not None for limit in limits]
    plots = [
        rrb.TimeSeriesView(
            origin="/",
            contents=[f"/a{entity}", f"/b{entity}"],
            name=f"{quantity}: a broad blue, b yellow",
            axis_x=linked,
            axis_y=rrb.ScalarAxis(range=(min(known), max(known))) if known and entity == ALPHA else None,
            plot_legend=rrb.PlotLegend(visible=False),
        )
        for quantity, entity in PLOTS.items()
    ]
    right = rrb.Vertical(lanes, rrb.Grid(*plots, grid_columns=2), row_shares=[32, 68])
    return with_panels(rrb.Horizontal(left, right, column_shares=[38, 62]))
