"""The views that every layout is made of: plots and lanes on one time axis, the path, texts."""

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.components import LinkAxis, PlayState

from wmr_replay.timeline.columns import DURATION
from wmr_replay.timeline.path import Frame

KEY_SHARE = 0.25
"""Room in front of the log, as a share of its length, where the key of a plot hides no line."""
TAIL_SHARE = 0.025


@dataclass(frozen=True)
class Span:
    """The stretch of time that a recording covers, in s from the log's start."""

    start_s: float
    end_s: float

    def axis(self) -> rrb.TimeAxis:
        """The whole log at first sight, with room for the keys in front of it.

        Every view gets this range for its own: a range that is linked to that of the other views would open
        on ±30 s around the cursor, whatever ``view_range`` says.
        """
        length_s = max(self.end_s - self.start_s, 1e-3)
        low, high = self.start_s - KEY_SHARE * length_s, self.end_s + TAIL_SHARE * length_s
        at = rrb.TimeRangeBoundary.absolute
        return rrb.TimeAxis(
            link=LinkAxis.Independent, view_range=rr.TimeRange(start=at(seconds=low), end=at(seconds=high))
        )


@dataclass(frozen=True)
class Plot:
    """One plot: its quantity with the unit, the entities in it, and the range of its axis where one is set.

    Without its first entity there is nothing to show: thresholds or a truth alone say little.
    """

    quantity: str
    entities: tuple[str, ...]
    range_y: tuple[float, float] | None = None
    titled: bool = False
    """Whether the quantity is a title; else the names of the lines say it."""

    def shown(self, written: Collection[str]) -> list[str]:
        """What the plot can show."""
        main, *others = self.entities
        return [main, *(entity for entity in others if entity in written)] if main in written else []

    def view(self, written: Collection[str], span: Span) -> rrb.TimeSeriesView:
        """The plot. Its key stands inside, since a title is cut off in a small window."""
        return rrb.TimeSeriesView(
            origin="/",
            contents=self.shown(written),
            name=self.quantity,
            titlebar=self.titled,
            axis_x=span.axis(),
            axis_y=None if self.range_y is None else rrb.ScalarAxis(range=self.range_y),
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=True),
        )


@dataclass(frozen=True)
class Page:
    """A tab of plots below one another, what it is about, and how the height is shared where not equally."""

    name: str
    plots: tuple[Plot, ...]
    shares: tuple[float, ...] = ()


def pages_view(pages: Iterable[Page], written: Collection[str], span: Span) -> rrb.Container | None:
    """The pages as tabs, the first in front; plots without a line and pages without a plot are left out."""
    columns = list(_columns(pages, written, span))
    return tabs_of(columns) if columns else None


def _columns(pages: Iterable[Page], written: Collection[str], span: Span) -> Iterator[rrb.Container]:
    for page in pages:
        shares = page.shares or (1.0,) * len(page.plots)
        shown = [(plot, share) for plot, share in zip(page.plots, shares, strict=True) if plot.shown(written)]
        if shown:
            views = [plot.view(written, span) for plot, _ in shown]
            yield rrb.Vertical(*views, name=page.name, row_shares=[share for _, share in shown])


def tabs_of(parts: Sequence[rrb.Container | rrb.View]) -> rrb.Container:
    """The parts as tabs, the first in front."""
    return rrb.Tabs(*parts, active_tab=0)


def lanes_view(contents: Sequence[str], name: str, span: Span) -> rrb.StateTimelineView:
    """States as lanes, in the order of their entities' names."""
    return rrb.StateTimelineView(
        origin="/", contents=list(contents), name=name, titlebar=False, time_view=span.axis()
    )


def path_view(
    frame: Frame,
    name: str,
    contents: Sequence[str] = ("/path/**",),
    always: Iterable[str] = ("/path/estimated", "/path/true"),
) -> rrb.View:
    """The plane, y upwards; the entities in ``always`` are drawn whole, wherever the cursor is."""
    ends = rrb.TimeRangeBoundary.infinite()
    whole = rrb.VisibleTimeRanges([rrb.VisibleTimeRange(DURATION, start=ends, end=ends)])
    (left, bottom), (right, top) = frame.with_margin()
    return rrb.Spatial2DView(
        origin="/",
        contents=list(contents),
        name=name,
        overrides=dict.fromkeys(always, whole),
        visual_bounds=rrb.VisualBounds2D(x_range=(left, right), y_range=(-top, -bottom)),
    )


def text_view(origin: str, name: str) -> rrb.TextDocumentView:
    """A text panel."""
    return rrb.TextDocumentView(origin=origin, name=name)


def findings_view() -> rrb.TextLogView:
    """Findings on the data's quality: when, how grave, what."""
    columns = rrb.TextLogColumns(timeline_columns=[DURATION], text_log_columns=["LogLevel", "Body"])
    return rrb.TextLogView(origin="/findings", name="Data quality", columns=columns)


def texts_view(*, found: bool) -> rrb.Container:
    """Tabs: the verdict, the findings on the data where there are any, how to read the recording."""
    between = [findings_view()] if found else []
    return tabs_of([text_view("/description", "Verdict"), *between, text_view("/how_to_read", "How to read")])


def window(
    left: rrb.Container,
    right: rrb.Container | None,
    *,
    left_share: float = 38,
    play_state: PlayState = PlayState.Paused,
) -> rrb.Blueprint:
    """The whole window: two columns and the time panel, the others folded."""
    content = (
        left if right is None else rrb.Horizontal(left, right, column_shares=[left_share, 100 - left_share])
    )
    return rrb.Blueprint(
        content,
        rrb.TimePanel(state="collapsed", timeline=DURATION, play_state=play_state),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )
