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

from dataclasses import dataclass
from pathlib import Path

import polars as pl
import rerun as rr

from wmr_replay.timeline import colours
from wmr_replay.timeline.columns import stride_for
from wmr_replay.timeline.comparison.differences import differences
from wmr_replay.timeline.comparison.layout import comparison_layout
from wmr_replay.timeline.comparison.quantities import (
    PENS,
    POSITION,
    QUANTITIES,
    Pen,
    difference_of,
    line_of,
)
from wmr_replay.timeline.path import Frame, pen
from wmr_replay.timeline.series import alpha_range
from wmr_replay.timeline.sink import XY, Sink, recording_into
from wmr_replay.timeline.states import Changes, Lane, mode_lane, status_lane
from wmr_replay.timeline.views import Span
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.files import whole_file

SAME, ANOTHER = "same mode", "another mode"
DIFFERS = Lane("/mode/differs", pl.col("state"), {SAME: (52, 60, 70), ANOTHER: colours.TRUTH})


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
        sink.add_lines([line_of(quantity, key) for quantity in QUANTITIES], drawn[key])
        frame.include(drawn[key].select(XY).to_numpy())
        add_path(sink, f"/path/{key}", [drawn[key]], PENS[key], order=10.0 + 2 * (key == "b"))
        sink.flush()
    named = mode_differences(other_mode)
    sink.add_changes(DIFFERS, named)
    red = (colours.TRUTH, 1.75)
    add_path(sink, "/path/differs", stretches(drawn["a"], named), red, order=14.0)
    rows = differences(drawn["a"], drawn["b"])
    sink.add_lines([*(difference_of(quantity) for quantity in QUANTITIES), POSITION], rows)
    sink.add_grid(frame)
    sink.add_text(text)
    span = span_of(sides, sink.start_ns)
    sink.close(comparison_layout(sink.written, frame, span, rows, alpha_of_both(sides)))


def add_lanes(sink: Sink, key: str, samples: pl.DataFrame) -> None:
    """Mode and status of one side; the true mode is that of a."""
    lanes = [mode_lane(f"/mode/{key}", "mode"), status_lane(f"/status/{key}")]
    for lane in [*lanes, mode_lane("/mode/true", "mode_true")] if key == "a" else lanes:
        sink.add_lane(lane)
        sink.add_changes(lane, Changes(lane).push(samples))


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


def mode_differences(other_mode: pl.DataFrame) -> pl.DataFrame:
    """The rows (t_ns, state) at which the two begin to agree or to differ."""
    named = other_mode.select("t_ns", state=pl.when("differs").then(pl.lit(ANOTHER)).otherwise(pl.lit(SAME)))
    return Changes(DIFFERS).push(named) if len(named) else named


def span_of(sides: dict[str, Side], start_ns: int) -> Span:
    """The stretch of time that both cover together."""
    ends = [int(side.samples["t_ns"][row]) - start_ns for side in sides.values() for row in (0, -1)]
    return Span(min(ends) / NS_PER_S, max(ends) / NS_PER_S)


def alpha_of_both(sides: dict[str, Side]) -> tuple[float, float] | None:
    """The range that shows α of both."""
    ranges = [alpha_range(side.samples.tail(1), None) for side in sides.values()]
    known = [limit for limits in ranges if limits is not None for limit in limits]
    return (min(known), max(known)) if known else None
