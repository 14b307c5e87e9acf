"""Pictures of results. The one place that imports matplotlib (extra ``plot``)."""

try:
    import matplotlib as mpl  # noqa: F401
except ModuleNotFoundError as error:
    if (error.name or "").partition(".")[0] != "matplotlib":
        raise
    from wmr_schemas.errors import MissingExtra

    raise MissingExtra("plot", "a picture", "matplotlib") from None

from wmr_replay.api.plots.design import design_figure
from wmr_replay.api.plots.figure import Figure, check_target, write_figure
from wmr_replay.api.plots.gap import gap_figure
from wmr_replay.api.plots.run import run_figure, tables_figure

__all__ = [
    "Figure",
    "check_target",
    "design_figure",
    "gap_figure",
    "run_figure",
    "tables_figure",
    "write_figure",
]
