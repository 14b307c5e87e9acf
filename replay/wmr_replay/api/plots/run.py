"""A replay as one figure: the path, the modes over time, velocities, constraints and α; of wheel speeds, slip
and scale of the wheels.

What describes an instant (velocities, C_k, C_d) is drawn at that instant, t − ``delay_s``; what is decided
(mode, α) at the time at which it was known.
"""

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import polars as pl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from wmr_replay.api.names import MODE_COLUMNS, with_mode_names
from wmr_replay.api.plots.figure import Figure, styled
from wmr_replay.report.decimate import extremes
from wmr_replay.report.run import RunTables
from wmr_replay.tables.drawn import DRAWN, WHEELS, by_wheel_speeds, with_wheels
from wmr_replay.timeline.colours import BAND, MODE_COLOURS, TRUTH, Colour, mode_name
from wmr_schemas.arrays import F64
from wmr_schemas.modes import ContactMode
from wmr_schemas.text import shown

if TYPE_CHECKING:
    from wmr_replay.api.result import Result

NORMAL_95 = 1.96
OUTER_PERCENT = (1.0, 99.0)
"""Percentiles of α and its interval that the axis shows: single rows do not set its range."""
SHADE = 0.16
MANY = 5
"""Entries of a key that leave little room for a title."""
MODES = (
    ContactMode.IDEAL,
    ContactMode.SKIDDING,
    ContactMode.SLIPPING,
    ContactMode.SKIDDING_SLIPPING,
    ContactMode.UNDECIDED,
)
Stretch = tuple[int, int, str]
"""First row, row after the last, mode by name."""


def rgb(colour: Colour) -> tuple[float, float, float]:
    """A colour of the timeline as matplotlib takes it."""
    red, green, blue = colour
    return red / 255, green / 255, blue / 255


MODE_RGB = {mode.label: rgb(colour) for mode, colour in MODE_COLOURS.items()}
BLUE, RED, DARK = rgb(BAND), rgb(TRUTH), (0.2, 0.22, 0.25)


def run_figure(result: "Result") -> Figure:
    """The figure of a result."""
    return tables_figure(result.report_tables(), result.stem)


def tables_figure(tables: RunTables, name: str) -> Figure:
    """The figure of a replay, out of its tables as they are on disk."""
    samples = drawn_rows(tables)
    nominal = (json.loads(tables.summary["settings"]).get("robot") or {}).get("alpha")
    with styled():
        figure = Figure(figsize=(11, 7), layout="constrained")
        grid = figure.add_gridspec(5, 2, width_ratios=(4, 6), height_ratios=(1, 2, 2, 2, 2))
        path = figure.add_subplot(grid[:, 0])
        lanes = figure.add_subplot(grid[0, 1])
        rows = [figure.add_subplot(grid[k, 1], sharex=lanes) for k in range(1, 5)]
        stretches = stretches_of(samples["mode"])
        draw_path(path, samples, stretches)
        draw_lanes(lanes, samples, drawn_hindsight(tables))
        draw_velocity(rows[0], samples)
        draw_constraint(
            rows[1], samples, "c_k_mps", "c_k_threshold_mps", "C_k [m/s], skidding beyond the band"
        )
        if by_wheel_speeds(samples):
            draw_slip(rows[2], samples)
            draw_scale(rows[3], samples)
        else:
            draw_constraint(
                rows[2], samples, "c_d_mps2", "c_d_threshold_mps2", "C_d [m/s²], slipping beyond the band"
            )
            draw_alpha(rows[3], samples, nominal)
        for axes in rows:
            shade(axes, samples, stretches)
        for axes in (lanes, *rows[:-1]):
            axes.tick_params(labelbottom=False)
        rows[-1].set_xlabel("time since the first pose [s]")
        title = {"x": 0.01, "ha": "left", "fontsize": 12, "fontweight": "bold"}
        figure.suptitle(shown(name), parse_math=False, **title)
    return figure


def drawn_rows(tables: RunTables) -> pl.DataFrame:
    """The columns in use, modes by name."""
    drawn = with_wheels(tables.samples).select(*DRAWN, *WHEELS)
    return with_mode_names(drawn, MODE_COLUMNS).collect()


def thinned(t_s: F64, *values: F64) -> tuple[F64, ...]:
    """Times and values, of long logs the rows that hold the extremes of each value."""
    known = np.flatnonzero(np.isfinite(t_s))
    if not len(known):
        return (t_s, *values)
    kept = [extremes(t_s[known], value[known]) for value in values]
    rows = known[np.unique(np.concatenate(kept))]
    return (t_s[rows], *(value[rows] for value in values))


def drawn_hindsight(tables: RunTables) -> pl.Series:
    """The mode in hindsight; empty without a second pass."""
    if tables.hindsight is None:
        return pl.Series("mode", [], pl.String)
    return with_mode_names(tables.hindsight.select("mode"), ("mode",)).collect()["mode"]


def column(samples: pl.DataFrame, name: str) -> F64:
    """A column with NaN where it is null."""
    return samples[name].cast(pl.Float64).fill_null(np.nan).to_numpy()


def described_s(samples: pl.DataFrame) -> F64:
    """The instants that the derivative columns describe."""
    return column(samples, "t_s") - column(samples, "delay_s")


def stretches_of(mode: pl.Series) -> list[Stretch]:
    """Stretches of one mode."""
    if not len(mode):
        return []
    starts = [0, *(np.flatnonzero((mode != mode.shift()).fill_null(value=False).to_numpy())).tolist()]
    return [(a, b, str(mode[a])) for a, b in zip(starts, [*starts[1:], len(mode)], strict=True)]


def shade(axes: Axes, samples: pl.DataFrame, stretches: list[Stretch]) -> None:
    """The background in the colour of the estimated mode; ideal rolling stays white."""
    t_s = column(samples, "t_s")
    for a, b, mode in stretches:
        if mode != ContactMode.IDEAL.label:
            end = t_s[min(b, len(t_s) - 1)]
            axes.axvspan(t_s[a], end, color=MODE_RGB[mode], alpha=SHADE, linewidth=0, zorder=0)


def draw_path(axes: Axes, samples: pl.DataFrame, stretches: list[Stretch]) -> None:
    """The measured path in the colour of the estimated mode, the start marked."""
    xy = samples.select("x_m", "y_m").to_numpy()
    pieces = [xy[a : b + 1] for a, b, _ in stretches]
    colours = [MODE_RGB[mode] for _, _, mode in stretches]
    axes.add_collection(LineCollection(pieces, colors=colours, linewidths=2.6, capstyle="round"))
    if len(xy):
        axes.plot(*xy[0], "o", color="white", markeredgecolor=DARK, markersize=7, zorder=3)
        axes.annotate("start", xy[0], xytext=(0, -15), textcoords="offset points", ha="center", color=DARK)
    axes.set_aspect("equal", adjustable="datalim")
    axes.autoscale_view()
    axes.margins(0.08)
    axes.set(title="Path by estimated mode", xlabel="x [m]", ylabel="y [m]")


def draw_lanes(axes: Axes, samples: pl.DataFrame, hindsight: pl.Series) -> None:
    """Estimated mode, the one in hindsight, and the true one where there is a truth, as lanes, with the key
    of the colours.
    """
    lanes = [("estimate", samples["mode"])]
    if len(hindsight) == len(samples):
        lanes.append(("hindsight", hindsight))
    if samples["mode_true"].null_count() < len(samples):
        lanes.append(("truth", samples["mode_true"].fill_null(ContactMode.UNDECIDED.label)))
    t_s = column(samples, "t_s")
    for row, (_, mode) in enumerate(lanes):
        for a, b, name in stretches_of(mode):
            width = t_s[min(b, len(t_s) - 1)] - t_s[a]
            axes.broken_barh([(t_s[a], width)], (row + 0.08, 0.84), color=MODE_RGB[name], linewidth=0)
    axes.set_yticks([row + 0.5 for row in range(len(lanes))], [name for name, _ in lanes])
    axes.set_ylim(len(lanes), 0)
    axes.set_xlim(t_s[0] if len(t_s) else 0, t_s[-1] if len(t_s) else 1)
    axes.grid(visible=False)
    axes.tick_params(left=False, bottom=False)
    seen = {str(name) for _, mode in lanes for name in mode.unique()}
    key = [Patch(color=MODE_RGB[m.label], label=mode_name(m)) for m in MODES if m.label in seen]
    key_above(axes, key, handlelength=1.0)
    for side in ("left", "bottom"):
        axes.spines[side].set_visible(False)
    axes.set_title("Contact mode" if len(key) < MANY else "Mode")


def draw_velocity(axes: Axes, samples: pl.DataFrame) -> None:
    """Longitudinal and lateral velocity."""
    t_s = described_s(samples)
    for name, colour, label in (("v_long_mps", BLUE, "longitudinal"), ("v_lat_mps", RED, "lateral")):
        axes.plot(*thinned(t_s, column(samples, name)), color=colour, label=label)
    finish(axes, "Velocity [m/s]")
    key_above(axes)


def draw_constraint(axes: Axes, samples: pl.DataFrame, name: str, threshold: str, title: str) -> None:
    """A constraint and the band between its thresholds."""
    whole = described_s(samples), column(samples, name), column(samples, threshold)
    t_s, value, limit = thinned(*whole)
    axes.fill_between(t_s, -limit, limit, color="#c3c8d0", alpha=0.55, linewidth=0)
    axes.plot(t_s, value, color=BLUE, linewidth=1.1)
    finish(axes, title)


def draw_slip(axes: Axes, samples: pl.DataFrame) -> None:
    """Slip velocities of both wheels with their 95 % intervals."""
    for name, colour, label in (("slip_left_mps", BLUE, "left"), ("slip_right_mps", RED, "right")):
        values = described_s(samples), column(samples, name), column(samples, f"{name}_sd")
        t_s, slip, sd = thinned(*values)
        spread = NORMAL_95 * sd
        axes.fill_between(t_s, slip - spread, slip + spread, color=colour, alpha=0.25, linewidth=0)
        axes.plot(t_s, slip, color=colour, linewidth=1.1, label=label)
    finish(axes, "Slip of the wheels [m/s], 95 % intervals")
    key_above(axes)


def draw_alpha(axes: Axes, samples: pl.DataFrame, nominal: float | None) -> None:
    """α with its 95 % interval, and the nominal value."""
    draw_learnt(axes, samples, "alpha", nominal, "nominal")
    finish(axes, "α [(m/s²)/(N·m)] with its 95 % interval")


def draw_scale(axes: Axes, samples: pl.DataFrame) -> None:
    """The wheels' true over their stated speed with its 95 % interval."""
    draw_learnt(axes, samples, "wheel_scale", 1.0, "as stated")
    finish(axes, "Wheel scale with its 95 % interval")


def draw_learnt(axes: Axes, samples: pl.DataFrame, name: str, level: float | None, label: str) -> None:
    """A learnt value with its 95 % interval, and the level that it is compared with. The axis shows it
    as it is once a fifth of the log has passed.
    """
    t_s, value, sd = thinned(*(column(samples, one) for one in ("t_s", name, f"{name}_sd")))
    low, high = value - NORMAL_95 * sd, value + NORMAL_95 * sd
    axes.fill_between(t_s, low, high, color=BLUE, alpha=0.22, linewidth=0)
    axes.plot(t_s, value, color=BLUE)
    if level is not None:
        axes.axhline(level, color=DARK, linestyle=(0, (4, 3)), linewidth=1, label=label)
        key_above(axes)
    settled = np.isfinite(value) & (t_s >= np.nanmax(t_s, initial=0.0) * 0.2)
    if settled.any():
        values = np.concatenate([low[settled], high[settled]])
        least, most = np.percentile(values[np.isfinite(values)], OUTER_PERCENT).tolist()
        least, most = (least, most) if level is None else (min(least, level), max(most, level))
        margin = 0.25 * (most - least) or 0.1 * abs(most)
        axes.set_ylim(least - margin, most + margin)


def key_above(axes: Axes, handles: Sequence[Artist] | None = None, handlelength: float = 1.5) -> None:
    """The key in one line above the axes, at the right."""
    entries = handles or axes.get_legend_handles_labels()[0]
    axes.legend(
        handles=entries,
        loc="lower right",
        bbox_to_anchor=(1.0, 0.97),
        ncols=max(len(entries), 1),
        borderaxespad=0.0,
        handlelength=handlelength,
        columnspacing=1.2,
    )


def finish(axes: Axes, title: str) -> None:
    """Title and few ticks."""
    axes.set_title(title)
    axes.yaxis.set_major_locator(MaxNLocator(4))
