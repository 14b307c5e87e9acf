"""The layout that opens with a gap recording."""

from collections.abc import Collection

import rerun.blueprint as rrb

from wmr_replay.timeline.blueprint import lanes_and_pages
from wmr_replay.timeline.path import Frame
from wmr_replay.timeline.views import Page, Plot, Span, path_view, texts_view, window

COMMON = ("/path/grid/**", "/path/key", "/path/held_out", "/path/regions", "/path/robot/**")


def compared(quantity: str, folder: str, *others: str) -> Plot:
    """Base against extended model."""
    return Plot(quantity, (*others, f"{folder}/base", f"{folder}/extended"), titled=True)


COMPARED = Page(
    "Gap and speed",
    (
        compared("Gap in position [mm]", "/gap/position"),
        compared("Gap in yaw [mrad]", "/gap/yaw"),
        compared("Speed [m/s]", "/speed", "/speed/actual"),
    ),
)


def residual_page(ahead: str, yaw: str, sideways: str) -> Page:
    """The page of the residuals, with their titles."""
    titles = {"longitudinal": ahead, "yaw": yaw, "lateral": sideways}
    return Page("Residuals", tuple(compared(title, f"/residual/{name}") for name, title in titles.items()))


PAGES = (
    COMPARED,
    residual_page("Residual ahead [m/s²]", "Residual in l·yaw_acc [m/s²]", "Residual sideways [m/s]"),
)
SLIP_PAGES = (
    COMPARED,
    residual_page("Slip ahead [m/s]", "Slip in yaw rate [rad/s]", "Slip sideways [m/s]"),
)
"""Where wheel speeds drive the model."""


def gap_layout(
    written: Collection[str],
    frame: Frame,
    span: Span,
    factor: float,
    pages: tuple[Page, ...] = PAGES,
    *,
    extended: bool,
    found: bool,
) -> rrb.Blueprint:
    """The error along the path before and, where the model was ``extended``, after; gaps and residuals."""
    names = {"base": f"Base model, error × {factor:g}", "extended": f"Extended model, error × {factor:g}"}
    models = ("base", "extended") if extended else ("base",)
    paths = [path_view(frame, names[model], (*COMMON, f"/path/{model}/**"), always=()) for model in models]
    shares = [39, 39, 22] if extended else [70, 30]
    left = rrb.Vertical(*paths, texts_view(found=found), row_shares=shares)
    right = lanes_and_pages(("/mode", "/part"), pages, written, span, lanes_share=20)
    return window(left, right, left_share=42)
