"""The layout that opens with the file: only views that have something to show."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

import rerun.blueprint as rrb

from wmr_replay.timeline.columns import DURATION
from wmr_replay.timeline.path import Frame


@dataclass(frozen=True)
class Plot:
    """One plot: its quantity with the unit, and for each part of its key the entity that it stands for."""

    quantity: str
    parts: Mapping[str, str]

    def entities(self, written: Collection[str]) -> list[str]:
        """What the plot can show."""
        return [entity for entity in self.parts.values() if entity in written]

    def title(self, written: Collection[str]) -> str:
        """Quantity and key; a legend inside would hide the lines of so small a plot."""
        return f"{self.quantity}: " + ", ".join(
            key for key, entity in self.parts.items() if entity in written
        )


_TRUE = "true red"


def _velocity(quantity: str, column: str) -> Plot:
    return Plot(
        quantity, {"estimate blue": f"/velocity/{column}/estimate", _TRUE: f"/velocity/{column}/true"}
    )


def _constraint(quantity: str, column: str, colour: str) -> Plot:
    lines = {
        "estimate blue": f"/constraint/{column}/estimate",
        f"± threshold {colour}": f"/constraint/{column}/threshold",
    }
    return Plot(quantity, lines)


ALPHA = Plot(
    "α [(m/s²)/(N·m)]",
    {
        "estimate blue": "/alpha/estimate",
        "± 1.96 sd dark": "/alpha/band",
        "nominal grey": "/alpha/nominal",
    },
)
PLOTS = (
    Plot("Position [m]", {"x blue": "/pose/x_m/measured", "y yellow": "/pose/y_m/measured"}),
    Plot("Yaw [rad]", {"measured blue": "/pose/yaw_rad/measured", _TRUE: "/pose/yaw_rad/true"}),
    _velocity("v_long [m/s]", "v_long_mps"),
    _velocity("Yaw rate [rad/s]", "yaw_rate_radps"),
    _velocity("v_lat [m/s]", "v_lat_mps"),
    _constraint("C_k [m/s]", "c_k_mps", "orange"),
    _constraint("C_d [m/s²]", "c_d_mps2", "pink"),
    ALPHA,
)


def layout(
    written: Collection[str],
    frame: Frame,
    alpha_range: tuple[float, float] | None,
    *,
    found: bool = False,
    hindsight: bool = False,
) -> rrb.Blueprint:
    """The blueprint for a recording that holds the series ``written`` and a path inside ``frame``; with
    ``found`` it holds findings on the data's quality, with ``hindsight`` a lane more.
    """
    texts: list[rrb.View] = [rrb.TextDocumentView(origin="/description", name="How to read")]
    if found:
        texts.insert(0, rrb.TextLogView(origin="/findings", name="Data quality"))
    plots = list(_plots(written, alpha_range))
    if not plots:
        return with_panels(rrb.Vertical(*texts))
    known = (
        "as known at the time; hindsight: by the whole log" if hindsight else "at the time they were known"
    )
    lanes = lanes_view(["/mode/**", "/status"], f"Contact mode and status, {known}")
    shares = [56, 16, 28] if found else [66, 34]
    left = rrb.Vertical(path_view(frame), *texts, row_shares=shares)
    right = rrb.Vertical(
        lanes, rrb.Grid(*plots, grid_columns=2), row_shares=[30, 70] if hindsight else [20, 80]
    )
    return with_panels(rrb.Horizontal(left, right, column_shares=[38, 62]))


def _plots(written: Collection[str], alpha_range: tuple[float, float] | None) -> Iterator[rrb.TimeSeriesView]:
    for plot in PLOTS:
        shown = plot.entities(written)
        if not shown or shown == ["/alpha/nominal"]:
            continue
        yield plot_view(plot, written, alpha_range if plot is ALPHA else None)


def plot_view(
    plot: Plot, written: Collection[str], range_y: tuple[float, float] | None = None
) -> rrb.TimeSeriesView:
    """A plot on the common time axis."""
    return rrb.TimeSeriesView(
        origin="/",
        contents=plot.entities(written),
        name=plot.title(written),
        axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
        axis_y=None if range_y is None else rrb.ScalarAxis(range=range_y),
        plot_legend=rrb.PlotLegend(visible=False),
    )


def lanes_view(contents: list[str], name: str) -> rrb.StateTimelineView:
    """States as lanes on the common time axis."""
    return rrb.StateTimelineView(
        origin="/",
        contents=contents,
        name=name,
        time_view=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
    )


def path_view(
    frame: Frame,
    root: str = "",
    name: str = "Path [m], coloured by estimated mode",
    always: Iterable[str] = ("/path/estimated", "/path/true"),
) -> rrb.View:
    """The plane with the path below ``root``, y upwards; the entities in ``always`` are drawn whole, wherever
    the cursor is.
    """
    ends = rrb.TimeRangeBoundary.infinite()
    whole = rrb.VisibleTimeRanges([rrb.VisibleTimeRange(DURATION, start=ends, end=ends)])
    (left, bottom), (right, top) = frame.with_margin()
    return rrb.Spatial2DView(
        origin=root or "/",
        contents=[f"{root}/path/**"],
        name=name,
        overrides={root + entity: whole for entity in always},
        visual_bounds=rrb.VisualBounds2D(x_range=(left, right), y_range=(-top, -bottom)),
    )


def with_panels(content: rrb.Container | rrb.View) -> rrb.Blueprint:
    """The whole window: content and time panel, the others folded."""
    return rrb.Blueprint(
        content,
        rrb.TimePanel(state="collapsed", timeline=DURATION, play_state="paused"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
        auto_layout=False,
    )
