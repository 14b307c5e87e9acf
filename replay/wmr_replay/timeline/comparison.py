"""Two results in one recording: a and b over one another, and b − a.

================================================  ===========================================================
``/description``                                  what differs (markdown, static)
``/path/a``, ``/path/b``, ``/path/differs``       both paths; where on a's the modes differ
``/mode/a``, ``/mode/b``, ``…/differs``, ``…/true``  modes, one below the other; a's true mode
``/status/a``, ``/status/b``                      status of both
``/both/Q/a``, ``/both/Q/b``                      Q is ``v_long_mps``, ``yaw_rate_radps``, ``c_k_mps``,
                                                  ``c_d_mps2``, ``alpha``
``/difference/Q``, ``/difference/position_m``     b − a of the same at one instant; distance of the positions
================================================  ===========================================================

Rows of one log lie at their stamps, with a's first pose as zero; two logs are laid upon one another by the
time since their starts.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from wmr_replay.timeline import colours
from wmr_replay.timeline.blueprint import lanes_and_pages
from wmr_replay.timeline.columns import stride_for
from wmr_replay.timeline.path import Frame, pen
from wmr_replay.timeline.series import Series, alpha_range
from wmr_replay.timeline.sink import XY, Sink, recording_into
from wmr_replay.timeline.states import Changes, Lane, mode_lane, status_lane
from wmr_replay.timeline.views import Page, Plot, Span, path_view, text_view, window
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.files import whole_file

Pen = tuple[colours.Colour, float]
PENS: dict[str, Pen] = {"a": (colours.ESTIMATE, 2.5), "b": (colours.SECOND, 1.0)}
"""b is drawn over a: where both agree, a still shows on either side."""
SAME, ANOTHER = "same mode", "another mode"
DIFFERS = Lane("/mode/differs", pl.col("state"), {SAME: (52, 60, 70), ANOTHER: colours.TRUTH})


@dataclass(frozen=True)
class Quantity:
    """What is drawn of both: column, name with unit, and whether it describes t − ``delay_s``."""

    column: str
    name: str
    at_described: bool = True


QUANTITIES = (
    Quantity("v_long_mps", "v_long [m/s]"),
    Quantity("c_k_mps", "C_k [m/s]"),
    Quantity("c_d_mps2", "C_d [m/s²]"),
    Quantity("alpha", "α [1/(kg·m)]", at_described=False),
    Quantity("yaw_rate_radps", "yaw [rad/s]"),
)
POSITION = Series("/difference/position_m", (pl.col("position_m"),), ("Δ position [m]",), (colours.DIFFERENCE,))
MOST_PLOTS = 4
OUTER = (2.0, 98.0)
"""Percentiles of the difference in α that its plot shows: it is wild while α is hardly known."""
REACH = 2.5
"""Values of b are carried over to instants between rows no further apart than this many usual steps."""


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two: its name, its samples table, and the rate of its rows in Hz."""

    name: str
    samples: pl.DataFrame
    rate_hz: float

    def start_ns(self) -> int:
        """Stamp of the first row."""
        return int(self.samples["t_ns"][0])

    def drawn(self, max_rate_hz: float) -> pl.DataFrame:
        """The rows to draw."""
        return self.samples.gather_every(stride_for(self.rate_hz, max_rate_hz))


def write_comparison(
    path: Path,
    a: Side,
    b: Side,
    other_mode: pl.DataFrame,
    text: str,
    *,
    by_stamp: bool = True,
    max_rate_hz: float = 100.0,
) -> None:
    """Write both sides into one recording at ``path``, whole or not at all.

    ``other_mode`` has the stamps of a's rows (``t_ns``) and whether b's mode there is another (``differs``);
    ``text`` is shown as markdown. ``by_stamp``: the two have stamps in common, else rows belong together by
    the time since the start. Series hold at most ``max_rate_hz`` rows a second, changes are exact.
    """
    offset_ns = 0 if by_stamp else a.start_ns() - b.start_ns()
    if offset_ns:
        b = Side(b.name, b.samples.with_columns(pl.col("t_ns") + offset_ns), b.rate_hz)
    with whole_file(path) as part:
        recording = recording_into(part, f"compare-{a.name}-{b.name}")
        try:
            fill(recording, {"a": a, "b": b}, other_mode, text, max_rate_hz)
        finally:
            recording.disconnect()


def fill(
    recording: rr.RecordingStream,
    sides: dict[str, Side],
    other_mode: pl.DataFrame,
    text: str,
    max_rate_hz: float,
) -> None:
    """Put both sides, their differences, the text and the layout into a recording."""
    sink, frame = Sink(recording, lanes=(DIFFERS,), robot=False), Frame()
    sink.start_ns = sides["a"].start_ns()
    drawn = {key: side.drawn(max_rate_hz) for key, side in sides.items()}
    for key, side in sides.items():
        add_lanes(sink, key, side.samples)
        for quantity in QUANTITIES:
            sink.add_lines(line_of(quantity, key), drawn[key])
        frame.include(drawn[key].select(XY).to_numpy())
        add_path(sink, f"/path/{key}", [drawn[key]], PENS[key], order=10.0 + 2 * (key == "b"))
        sink.flush()
    named = mode_differences(other_mode)
    sink.add_changes(DIFFERS, named)
    red = (colours.TRUTH, 1.75)
    add_path(sink, "/path/differs", stretches(drawn["a"], named), red, order=14.0)
    rows = differences(drawn["a"], drawn["b"])
    for series in (*(difference_of(quantity) for quantity in QUANTITIES), POSITION):
        sink.add_lines(series, rows)
    sink.add_grid(frame)
    sink.add_text(text)
    sink.close(layout(sink, frame, sides, rows))


def add_lanes(sink: Sink, key: str, samples: pl.DataFrame) -> None:
    """Mode and status of one side; the true mode is that of a."""
    lanes = [mode_lane(f"/mode/{key}", "mode"), status_lane(f"/status/{key}")]
    for lane in [*lanes, mode_lane("/mode/true", "mode_true")] if key == "a" else lanes:
        sink.add_lane(lane)
        sink.add_changes(lane, Changes(lane).push(samples))


def line_of(quantity: Quantity, key: str) -> Series:
    """The line of one side."""
    colour, width = PENS[key]
    name = f"a: {quantity.name}" if key == "a" else "b"
    entity, line = f"/both/{quantity.column}/{key}", pl.col(quantity.column)
    return Series(entity, (line,), (name,), (colour,), width, quantity.at_described)


def difference_of(quantity: Quantity) -> Series:
    """The line b − a."""
    entity, name = f"/difference/{quantity.column}", f"Δ {quantity.name}"
    at = quantity.at_described
    return Series(entity, (pl.col(quantity.column),), (name,), (colours.DIFFERENCE,), at_described=at)


def add_path(sink: Sink, entity: str, parts: list[pl.DataFrame], drawn: Pen, order: float) -> None:
    """A path in pieces."""
    colour, width = drawn
    points = [part.select(XY).to_numpy() for part in parts if len(part) > 1]
    sink.add_pieces(entity, points, pen(colour, width, order))


def stretches(rows: pl.DataFrame, named: pl.DataFrame) -> list[pl.DataFrame]:
    """The rows in each stretch of another mode, out of the changes between agreement and difference."""
    if not len(named):
        return []
    starts = named["t_ns"].to_list()
    ends = [*starts[1:], int(rows["t_ns"][-1]) + 1]
    at = [(s, e) for s, e, state in zip(starts, ends, named["state"], strict=True) if state == ANOTHER]
    return [rows.filter(pl.col("t_ns").is_between(s, e, closed="left")) for s, e in at]


def differences(a: pl.DataFrame, b: pl.DataFrame) -> pl.DataFrame:
    """b − a at a's rows (``t_ns``, ``delay_s``, the quantities, ``position_m``), NaN where either is unknown.

    What describes an instant is compared at that instant: b's values are interpolated to it, since the two
    may have other delays.
    """
    columns: dict[str, F64 | pl.Series] = {"t_ns": a["t_ns"], "delay_s": a["delay_s"]}
    for quantity in QUANTITIES:
        columns[quantity.column] = difference(a, b, quantity.column, described=quantity.at_described)
    x, y = (difference(a, b, name, described=False) for name in XY)
    return pl.DataFrame(columns | {"position_m": np.hypot(x, y)})


def difference(a: pl.DataFrame, b: pl.DataFrame, column: str, *, described: bool) -> F64:
    """b − a of one column at the instants of a."""
    start_ns = int(a["t_ns"][0])
    at, values = instants(a, start_ns, described=described), a[column].cast(pl.Float64).to_numpy()
    there, others = instants(b, start_ns, described=described), b[column].cast(pl.Float64).to_numpy()
    return carried(there, others, at) - values


def instants(rows: pl.DataFrame, start_ns: int, *, described: bool) -> F64:
    """Seconds since ``start_ns`` of each row, or of the instant that it describes."""
    t_s = (rows["t_ns"].to_numpy() - start_ns) / NS_PER_S
    return np.asarray(t_s - rows["delay_s"].fill_null(0.0).to_numpy() if described else t_s)


def carried(t_s: F64, values: F64, at_s: F64) -> F64:
    """``values`` at ``t_s``, linearly interpolated to ``at_s``; NaN beside holes and outside."""
    known = np.isfinite(values) & np.isfinite(t_s)
    t_s, values = t_s[known], values[known]
    if len(t_s) < 2:
        return np.full(len(at_s), np.nan)
    after = np.clip(np.searchsorted(t_s, at_s), 1, len(t_s) - 1)
    near = t_s[after] - t_s[after - 1] <= REACH * np.median(np.diff(t_s))
    inside = (at_s >= t_s[0]) & (at_s <= t_s[-1])
    return np.where(near & inside, np.interp(at_s, t_s, values), np.nan)


def mode_differences(other_mode: pl.DataFrame) -> pl.DataFrame:
    """The rows (t_ns, state) at which the two begin to agree or to differ."""
    named = other_mode.select("t_ns", state=pl.when("differs").then(pl.lit(ANOTHER)).otherwise(pl.lit(SAME)))
    return Changes(DIFFERS).push(named) if len(named) else named


def layout(sink: Sink, frame: Frame, sides: dict[str, Side], rows: pl.DataFrame) -> rrb.Blueprint:
    """Both paths and the text on the left; lanes, differences and lines on the right."""
    ends = [(int(side.samples["t_ns"][row]) - sink.start_ns) / NS_PER_S for side in sides.values() for row in (0, -1)]
    lanes = ["/mode/**", "/status/**"]
    path = path_view(frame, "Path [m]: a, b, another mode", always=())
    left = rrb.Vertical(path, text_view("/description", "What differs"), row_shares=[55, 45])
    pages = list(pages_of(sides, rows))
    right = lanes_and_pages(lanes, pages, sink.written, Span(min(ends), max(ends)), lanes_share=40)
    return window(left, right)


def pages_of(sides: dict[str, Side], rows: pl.DataFrame) -> Iterator[Page]:
    """First what differs, then both."""
    ranges = [alpha_range(side.samples.tail(1), None) for side in sides.values()]
    known = [limit for limits in ranges if limits is not None for limit in limits]
    ranges_y = {"alpha": (min(known), max(known))} if known else {}
    both = {q.column: Plot(q.name, tuple(f"/both/{q.column}/{key}" for key in sides), ranges_y.get(q.column)) for q in QUANTITIES}
    ranges_y = {"alpha": outer_range(rows["alpha"].to_numpy())}
    deltas = {q.column: Plot(f"Δ {q.name}", (f"/difference/{q.column}",), ranges_y.get(q.column)) for q in QUANTITIES}
    deltas["position_m"] = Plot("Distance", (POSITION.entity,))
    differing = [plot for column, plot in deltas.items() if differs(rows, column)]
    yield Page("b − a", tuple(differing[:MOST_PLOTS] or deltas.values()))
    yield Page("a and b", tuple(both.values())[:MOST_PLOTS])
    yield Page("further", (*differing[MOST_PLOTS:], *list(both.values())[MOST_PLOTS:]))


def differs(rows: pl.DataFrame, column: str) -> bool:
    """Whether any difference is known and not zero."""
    return bool((np.abs(np.nan_to_num(rows[column].to_numpy())) > 0).any())


def outer_range(values: F64) -> tuple[float, float] | None:
    """The range that holds nearly all values and zero; None without any, or with no difference."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    low, high = np.percentile(known, OUTER)
    margin = 0.2 * max(high - low, abs(high), abs(low))
    return None if margin == 0 else (min(low, 0.0) - margin, max(high, 0.0) + margin)
