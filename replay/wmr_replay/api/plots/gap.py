"""A gap analysis as one figure: the proof, the residual over time, paths by error, the gap in numbers."""

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Circle, Patch

from wmr_replay.api.plots.figure import Figure, styled
from wmr_replay.api.plots.run import DARK, key_above
from wmr_replay.report.gap_figures import (
    AFTER,
    BEFORE,
    BINS,
    HEAT,
    QUANTITIES,
    RESIDUALS,
    Shown,
    found_discs,
    level_words,
    round_edges,
    shown_of,
    values,
    variable_of,
)
from wmr_schemas.gap_file import GapFile
from wmr_schemas.text import shown

WORDS = {"base": "base model", "extended": "extended model"}
SHORT = {
    "longitudinal": "Residual ahead [m/s²]",
    "lateral": "Residual sideways [m/s]",
    "yaw": "Residual in yaw [m/s²]",
}
SLIP = {
    "longitudinal": "Slip ahead [m/s]",
    "lateral": "Slip sideways [m/s]",
    "yaw": "Slip in yaw rate [rad/s]",
}
"""The residuals where wheel speeds drive the model."""
COLOURS = {"base": BEFORE, "extended": AFTER}
UNKNOWN = "#c9ced6"
WRAP = 92
"""Characters of a line of the title."""


def gap_figure(gap: GapFile, traces: pl.DataFrame, name: str = "") -> Figure:
    """The figure of a gap analysis, out of ``gap.json`` and its traces."""
    first = next(iter(shown_of(gap)), None)
    models = ("base", "extended") if first else ("base",)
    short = SLIP if gap.base_model == "wheel_speed" else SHORT
    with styled():
        figure = Figure(figsize=(11, 7.2), layout="constrained")
        grid = figure.add_gridspec(3, 2, height_ratios=(3, 1.7, 3.2))
        top = figure.add_subplot(grid[0, 0])
        channel = first.residual if first and first.residual else "longitudinal"
        if first is None or not draw_scatter(top, first, traces, short):
            draw_over_time(top, traces, "base_residual_lateral", short["lateral"], ("base",))
        draw_over_time(figure.add_subplot(grid[0, 1]), traces, f"residual_{channel}", short[channel], models)
        draw_over_time(
            figure.add_subplot(grid[1, :]),
            traces,
            "error_m",
            f"Error of the position [m], windows of {gap.gap.seconds} s",
            models,
        )
        draw_paths(figure, grid, gap, traces, models)
        heading = shown(name or gap.log.replace("\\", "/").rpartition("/")[2].rpartition(".")[0])
        figure.suptitle(
            f"{heading}: {said(gap)}", x=0.01, ha="left", fontsize=11.5, fontweight="bold", parse_math=False
        )
    return figure


def said(gap: GapFile) -> str:
    """The sentence, in lines."""
    words, lines = shown(gap.sentence.strip()).split(" "), [""]
    for word in words:
        lines = (
            [*lines[:-1], f"{lines[-1]} {word}".strip()]
            if len(lines[-1]) + len(word) < WRAP
            else [*lines, word]
        )
    return "\n".join(lines)


def draw_scatter(axes: Axes, one: Shown, traces: pl.DataFrame, short: dict[str, str]) -> bool:
    """The residual over the quantity that it follows, and the medians of bins; False without such columns."""
    if one.residual not in RESIDUALS or one.variable not in QUANTITIES:
        return False
    x = variable_of(one, traces)
    for model in ("base", "extended"):
        y = values(traces, f"{model}_residual_{one.residual}")
        known = np.isfinite(x) & np.isfinite(y)
        axes.plot(
            x[known],
            y[known],
            ".",
            color=COLOURS[model],
            markersize=2.2,
            alpha=0.3,
            markeredgewidth=0,
            rasterized=True,
        )
        edges = np.unique(np.quantile(x[known], np.linspace(0, 1, BINS + 1)))
        where = np.clip(np.searchsorted(edges, x[known], side="right") - 1, 0, max(len(edges) - 2, 0))
        bins = np.unique(where)
        middle = [[float(np.median(v[known][where == k])) for k in bins] for v in (x, y)]
        axes.plot(
            *middle,
            "o-",
            color=COLOURS[model],
            markersize=4.5,
            markeredgecolor="white",
            linewidth=1.8,
            label=WORDS[model],
        )
    axes.axhline(0, color=DARK, linewidth=0.6)
    axes.set(xlabel=QUANTITIES[one.variable], title=short[one.residual])
    key_above(axes)
    return True


def draw_over_time(
    axes: Axes, traces: pl.DataFrame, column: str, title: str, models: tuple[str, ...]
) -> None:
    """A column of each model over time, held-out windows shaded."""
    t_s, held = values(traces, "t_s"), traces["held_out"].to_numpy()
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(np.int8), [0]]))).reshape(-1, 2)
    for a, b in edges:
        axes.axvspan(t_s[a], t_s[min(b, len(t_s) - 1)], color="#e9ebef", linewidth=0, zorder=0)
    for model in models:
        name = column if column.startswith(model) else f"{model}_{column}"
        axes.plot(t_s, values(traces, name), color=COLOURS[model], linewidth=1.1, label=WORDS[model])
    axes.set(xlabel="time [s]", title=title, xlim=(t_s[0], t_s[-1]))
    handles = axes.get_legend_handles_labels()[0]
    if column == "error_m":
        handles = [*handles, Patch(color="#e9ebef", label="held out: not fitted")]
    key_above(axes, handles)


def draw_paths(
    figure: Figure, grid: object, gap: GapFile, traces: pl.DataFrame, models: tuple[str, ...]
) -> None:
    """The measured path in levels of each model's error, one scale for both."""
    error = values(traces, "base_error_m")
    known = error[np.isfinite(error)]
    if len(known) < 2:
        return
    edges = round_edges(float(np.percentile(known, 98)))
    titles = {"base": "Path by error of the base model", "extended": "The same with the effect in the model"}
    for k, model in enumerate(models):
        place = grid[2, k] if len(models) > 1 else grid[2, :]  # type: ignore[index]
        axes = figure.add_subplot(place)
        draw_path(axes, traces, f"{model}_error_m", edges)
        axes.set_title(titles[model])
        for name, (x_m, y_m, radius_m) in found_discs(gap) if k == 0 else []:
            axes.add_patch(Circle((x_m, y_m), radius_m, fill=False, color=DARK, linewidth=1.2))
            axes.annotate(shown(name), (x_m, y_m + radius_m), ha="center", va="bottom", parse_math=False)
    handles = [
        Patch(color=colour, label=words) for colour, words in zip(HEAT, level_words(edges), strict=True)
    ]
    handles.append(Patch(color=UNKNOWN, label="not simulated"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), handlelength=1.0)


def draw_path(axes: Axes, traces: pl.DataFrame, column: str, edges: np.ndarray) -> None:
    """The measured path in levels of an error; grey where nothing was simulated."""
    xy = np.stack([values(traces, "x_m"), values(traces, "y_m")], axis=1)
    error = values(traces, column)
    axes.plot(*xy.T, color=UNKNOWN, linewidth=1.5, zorder=1)
    pieces = np.stack([xy[:-1], xy[1:]], axis=1)
    norm = BoundaryNorm([0.0, *edges, np.inf], len(HEAT))
    kept = np.isfinite(error[:-1])
    lines = LineCollection(
        list(pieces[kept]), cmap=ListedColormap(HEAT), norm=norm, linewidths=2.6, capstyle="round", zorder=2
    )
    lines.set_array(error[:-1][kept])
    axes.add_collection(lines)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.08)
    axes.set(xlabel="x [m]", ylabel="y [m]")
