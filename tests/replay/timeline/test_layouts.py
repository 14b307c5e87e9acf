"""The layouts that open with a recording: what is in them, and that they open on the whole log."""

from collections.abc import Iterator

import numpy as np
import pytest
import rerun.blueprint as rrb

from wmr_replay.timeline.blueprint import Contents, layout
from wmr_replay.timeline.gap.layout import gap_layout
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.views import Page, Plot, Span, pages_view

RUN = (
    "/posterior",
    "/constraint/c_k_mps/estimate",
    "/constraint/c_k_mps/threshold",
    "/constraint/c_d_mps2/threshold",
    "/alpha/nominal",
    "/velocity/v_long_mps/estimate",
    "/velocity/v_long_mps/true",
    "/torque",
)


def frame() -> Frame:
    found = Frame()
    found.include(np.array([[0.0, 0.0], [20.0, 10.0]]))
    return found


def views_of(part: rrb.Container | rrb.View) -> Iterator[rrb.View]:
    """All views of a layout, those in tabs too."""
    if isinstance(part, rrb.View):
        yield part
        return
    for inner in part.contents:
        yield from views_of(inner)


def shown_range_s(view: rrb.View) -> tuple[float, float]:
    """The range of time that a view opens on."""
    (shown,) = view.properties["TimeAxis"].view_range.as_arrow_array().to_pylist()
    return shown["start"] / 1e9, shown["end"] / 1e9


def on_time(view: rrb.View) -> bool:
    return isinstance(view, (rrb.TimeSeriesView, rrb.StateTimelineView))


@pytest.mark.parametrize("end_s", [3.0, 60.0, 3600.0])
def test_lanes_and_plots_open_on_the_whole_log_and_on_the_same_stretch(end_s: float) -> None:
    span = Span(0.0, end_s)
    written = {"/gap/position/base", "/residual/yaw/base", "/speed/actual"}
    both = (
        layout(Contents(RUN, frame(), span)),
        gap_layout(written, frame(), span, 10.0, extended=True, found=True),
    )
    for blueprint in both:
        ranges = [shown_range_s(view) for view in views_of(blueprint.root_container) if on_time(view)]
        assert len(ranges) >= 3
        assert len(set(ranges)) == 1
        low, high = ranges[0]
        assert low <= 0.0 < end_s <= high
        assert end_s / (high - low) > 0.75


def test_a_plot_without_its_own_quantity_is_left_out_and_so_is_an_empty_page() -> None:
    """Thresholds without C_d, a nominal α without an estimate: no entry of a key for what is not shown."""
    names = [view.name for view in views_of(layout(Contents(RUN, frame(), Span(0, 9))).root_container)]
    assert names == [
        "Path [m] by mode",
        "Verdict",
        "How to read",
        "Contact mode and status",
        "Probability of each mode",
        "C_k [m/s]",
        "v_long [m/s]",
        "Wheel torque [N·m]",
    ]
    page = Page("Empty", (Plot("C_d", ("/c_d", "/threshold")),))
    assert pages_view([page], ["/threshold"], Span(0, 9)) is None


def test_wheel_speeds_have_slip_and_what_was_learnt_in_place_of_torques_and_alpha() -> None:
    written = {
        *("/posterior", "/posterior/both", "/constraint/c_k_mps/estimate", "/constraint/c_d_mps2/threshold"),
        *(f"/slip/{side}/{line}" for side in ("left", "right") for line in ("estimate", "band")),
        *("/learnt/wheel_scale/estimate", "/learnt/wheel_scale/stated", "/velocity/v_long_mps/estimate"),
    }
    held = Contents(written, frame(), Span(0, 9), ranges={"/learnt/wheel_scale/estimate": (0.9, 1.1)})
    views = list(views_of(layout(held).root_container))
    assert [view.name for view in views[4:]] == [
        "Probability of each mode",
        "C_k [m/s]",
        "Slip of the left wheel [m/s]",
        "Slip of the right wheel [m/s]",
        "Wheel scale",
        "v_long [m/s]",
    ]
    assert views[4].contents == ["/posterior", "/posterior/both"]
    assert views[6].contents == ["/slip/left/estimate", "/slip/left/band"]
    assert views[8].properties["ScalarAxis"].range.as_arrow_array().to_pylist() == [[0.9, 1.1]]


def test_findings_and_a_true_path_are_named() -> None:
    held = Contents(RUN, frame(), Span(0, 9), found=True, true_path=True)
    names = [view.name for view in views_of(layout(held).root_container)]
    assert names[:4] == ["Path [m] by mode, true in white", "Verdict", "Data quality", "How to read"]


def test_a_recording_of_nothing_shows_its_texts() -> None:
    names = [view.name for view in views_of(layout(Contents((), Frame(), None)).root_container)]
    assert names == ["Verdict", "How to read"]


def test_a_model_that_was_not_extended_has_one_path() -> None:
    names = [
        view.name
        for view in views_of(
            gap_layout(
                {"/speed/actual"}, frame(), Span(0, 9), 5.0, extended=False, found=False
            ).root_container
        )
    ]
    assert names == [
        "Base model, error × 5",
        "Verdict",
        "How to read",
        "Contact mode and status",
        "Speed [m/s]",
    ]
