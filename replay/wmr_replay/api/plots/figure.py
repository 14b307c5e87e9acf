"""A figure that notebooks show by themselves, its style, and how it becomes a file."""

import io
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as PlainFigure

from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file

ENDINGS = (".png", ".svg", ".pdf")
STYLE: dict[str, Any] = {
    "figure.facecolor": "white",
    "font.size": 9.5,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.labelcolor": "#4a4f57",
    "axes.edgecolor": "#9aa0a8",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.color": "#e6e8ec",
    "grid.linewidth": 0.8,
    "xtick.color": "#4a4f57",
    "ytick.color": "#4a4f57",
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.3,
}
"""Matplotlib's settings while a figure of ours is drawn."""


class Figure(PlainFigure):
    """A matplotlib figure without pyplot: no window, no global state; notebooks show it as a picture."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        FigureCanvasAgg(self)
        self.savefig(buffer, format="png", dpi=110)
        return buffer.getvalue()


def check_target(target: Path) -> None:
    """Raises InvalidSetting where no picture can be written."""
    if target.suffix.lower() not in ENDINGS:
        raise InvalidSetting(f"{target}: name a file that ends in .png, .svg or .pdf")
    if not target.parent.is_dir():
        raise InvalidSetting(f"{target}: there is no directory {target.parent}; create it first")


def write_figure(figure: PlainFigure, target: Path, dpi: int = 120) -> None:
    """Write a picture whose ending names the format, whole or not at all."""
    check_target(target)
    with whole_file(target) as part:
        figure.savefig(part, format=target.suffix[1:].lower(), dpi=dpi)


def styled() -> Any:
    """The context in which figures are drawn."""
    return rc_context(STYLE)  # type: ignore[arg-type]  # names as text
