"""The layout that opens with a comparison: what differs first, then both."""

from collections.abc import Collection, Iterator, Mapping

import numpy as np
import polars as pl
import rerun.blueprint as rrb

from wmr_replay.timeline.blueprint import lanes_and_pages
from wmr_replay.timeline.comparison.differences import differs
from wmr_replay.timeline.comparison.quantities import POSITION, QUANTITIES
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.views import Page, Plot, Span, path_view, text_view, window
from wmr_schemas.arrays import F64

LANES = ("/mode/**", "/status/**")
MOST_PLOTS = 4
OUTER = (2.0, 98.0)
"""Percentiles of the difference in α that its plot shows: it is wild while α is hardly known."""
Ranges = Mapping[str, tuple[float, float] | None]
"""Ranges of axes by column."""


def comparison_layout(
    written: Collection[str], frame: Frame, span: Span, rows: pl.DataFrame, alpha: tuple[float, float] | None
) -> rrb.Blueprint:
    """Both paths and the text on the left; lanes, differences and lines on the right. ``rows`` are the
    differences, ``alpha`` the range of both α.
    """
    path = path_view(frame, "Path [m]: a, b, another mode", always=())
    left = rrb.Vertical(path, text_view("/description", "What differs"), row_shares=[55, 45])
    right = lanes_and_pages(LANES, list(pages_of(rows, alpha)), written, span, lanes_share=40)
    return window(left, right)


def pages_of(rows: pl.DataFrame, alpha: tuple[float, float] | None) -> Iterator[Page]:
    """The first page holds what differs, and where there is room, a and b of the same; where nothing does,
    the lines of zeros.
    """
    both, deltas = plots_of_both({"alpha": alpha}), plots_of_differences(rows)
    columns = [column for column in deltas if differs(rows, column)]
    first = [*(deltas[column] for column in columns), *(both[column] for column in columns if column in both)]
    yield Page("b − a", tuple(first[:MOST_PLOTS] or deltas.values()))
    every = list(both.values())
    yield Page("a and b", tuple(every[:MOST_PLOTS]))
    further = [deltas[column] for column in columns[MOST_PLOTS:]]
    yield Page("Further", (*further, *every[MOST_PLOTS:]))


def plots_of_both(ranges: Ranges) -> dict[str, Plot]:
    """Lines of both over one another, by column."""
    return {
        q.column: Plot(q.name, (f"/both/{q.column}/a", f"/both/{q.column}/b"), ranges.get(q.column))
        for q in QUANTITIES
    }


def plots_of_differences(rows: pl.DataFrame) -> dict[str, Plot]:
    """Lines of the differences, by column."""
    ranges: Ranges = {"alpha": outer_range(rows["alpha"].to_numpy())}
    plots = {
        q.column: Plot(f"Δ {q.name}", (f"/difference/{q.column}",), ranges.get(q.column)) for q in QUANTITIES
    }
    return plots | {"position_m": Plot("Distance of the positions", (POSITION.entity,))}


def outer_range(values: F64) -> tuple[float, float] | None:
    """The range that holds nearly all values and zero; None without any, or with no difference."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    low, high = np.percentile(known, OUTER)
    margin = 0.2 * max(high - low, abs(high), abs(low))
    return None if margin == 0 else (min(low, 0.0) - margin, max(high, 0.0) + margin)
