"""The layout that opens with a gap recording."""

from collections.abc import Collection

import rerun.blueprint as rrb

from wmr_replay.timeline.blueprint import Plot, lanes_view, path_view, plot_view, with_panels
from wmr_replay.timeline.path import Frame

PATHS = ("/path/measured", "/path/held_out", "/path/base", "/path/extended", "/path/regions")


def compared(quantity: str, folder: str) -> Plot:
    """Base against extended model."""
    return Plot(quantity, {"base red": f"{folder}/base", "extended blue": f"{folder}/extended"})


PLOTS = (
    compared("Gap in position [mm]", "/gap/position"),
    compared("Gap in yaw [mrad]", "/gap/yaw"),
    compared("Residual ahead [m/s²]", "/residual/longitudinal"),
    compared("Residual in l·yaw_acc [m/s²]", "/residual/yaw"),
    compared("Residual sideways [m/s]", "/residual/lateral"),
)


def gap_layout(written: Collection[str], frame: Frame) -> rrb.Blueprint:
    """Paths and text on the left; lanes, gaps and residuals on the right."""
    text = rrb.TextDocumentView(origin="/description", name="Verdict")
    name = "Path [m]: measured white, base red, extended blue; held out shaded"
    path = path_view(frame, name=name, always=PATHS)
    lanes = lanes_view(["/mode", "/part"], "Contact mode; what was fitted and what was held out")
    plots = [plot_view(plot, written) for plot in PLOTS if plot.entities(written)]
    left = rrb.Vertical(path, text, row_shares=[56, 44])
    right = rrb.Vertical(lanes, *plots, row_shares=[14] + [86 / max(len(plots), 1)] * len(plots))
    return with_panels(rrb.Horizontal(left, right, column_shares=[42, 58]))
