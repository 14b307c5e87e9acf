"""Figures 3 to 6 of the paper, from ``wmr-replay synth`` and ``run``: ``python docs/make_paper_figures.py``.

Writes ``paper_fig3.png`` … ``paper_fig6.png`` to ``docs/images``, or to ``--out DIR``; ``--quick`` uses short
logs. The figures use robot conventions (REP 103), with the paper's symbols beside them.
"""

import argparse
from pathlib import Path

import numpy as np
import polars as pl
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from paper_runs import Replayed, quotient, replay
from PIL import Image

from wmr_replay.timeline.colours import BAND, MODE_COLOURS, Colour, mode_name
from wmr_schemas.modes import ContactMode
from wmr_schemas.robot import PAPER_ROBOT

IMAGES = Path(__file__).parent / "images"
DRAWN_HZ = 25.0
SEED = 0
TRUE_STYLE = {"color": "black", "linestyle": (0, (4, 2)), "linewidth": 1.2}
STYLE = {
    "figure.dpi": 110,
    "font.size": 11,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e6ea",
    "axes.edgecolor": "#9aa0a8",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
    "legend.fontsize": 10,
    "lines.solid_capstyle": "butt",
}


def rgb(colour: Colour) -> tuple[float, ...]:
    """A colour of the timeline in matplotlib's form."""
    return tuple(part / 255 for part in colour)


ESTIMATE = rgb(BAND)
PAPER_MODES = (ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING)
SHOWN_MODES = (ContactMode.UNDECIDED, *PAPER_MODES)


def thin(rows: pl.DataFrame) -> pl.DataFrame:
    """Rows at ``DRAWN_HZ``, as many as a figure can show."""
    step_s = rows["t_s"].diff().median()
    return rows.gather_every(max(1, round(1 / (DRAWN_HZ * float(step_s or 1.0)))))  # type: ignore[arg-type]


def described_s(samples: pl.DataFrame) -> pl.Series:
    """The instants [s] that the derivative columns describe, t − delay_s."""
    return samples.select(pl.col("t_s") - pl.col("delay_s")).to_series()


def mode_key(modes: tuple[ContactMode, ...]) -> list[Line2D]:
    """Legend entries for the modes."""
    return [Line2D([], [], color=rgb(MODE_COLOURS[m]), linewidth=4, label=mode_name(m)) for m in modes]


def stretches(mode: np.ndarray) -> list[tuple[int, int, ContactMode]]:
    """First and last row of each stretch of one mode; neighbours share a row."""
    starts = np.flatnonzero(np.concatenate([[True], mode[1:] != mode[:-1]]))
    ends = np.append(starts[1:], len(mode) - 1)
    return [(int(a), int(b), ContactMode(int(mode[a]))) for a, b in zip(starts, ends, strict=True)]


def draw_path(axes: Axes, truth: pl.DataFrame) -> None:
    """The true trajectory in the colour of the true condition."""
    xy = truth.select("x_m", "y_m").to_numpy()
    pieces = stretches(truth["mode"].to_numpy())
    colours = [rgb(MODE_COLOURS[mode]) for _, _, mode in pieces]
    axes.add_collection(LineCollection([xy[a : b + 1] for a, b, _ in pieces], colors=colours, linewidths=3))
    axes.plot(*xy[0], "o", color="black", markersize=6)
    axes.annotate("start", xy[0], xytext=(-5, -7), textcoords="offset points", ha="center", va="top")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(title="Trajectory", xlabel="x [m]", ylabel="y [m]")
    axes.legend(handles=mode_key(PAPER_MODES), loc="upper right", handlelength=1.2)


def draw_velocity(axes: Axes, run: Replayed, column: str, title: str, unit: str) -> None:
    """An estimated velocity at the instants that it describes, and the true velocity over it."""
    samples, truth = thin(run.samples), thin(run.truth)
    axes.plot(described_s(samples), samples[column], color=ESTIMATE, linewidth=1.4, label="estimated")
    axes.plot(truth["t_s"], truth[column], label="true", **TRUE_STYLE)
    axes.set(title=title, xlabel="t [s]", ylabel=unit)
    axes.set_xlim(0, truth["t_s"][-1])


def figure_3(run: Replayed) -> Figure:
    """Trajectory and the three velocities."""
    figure = Figure(figsize=(10, 7.6), layout="constrained")
    axes = figure.subplots(2, 2)
    draw_path(axes[0, 0], run.truth)
    draw_velocity(axes[0, 1], run, "v_long_mps", "Longitudinal velocity v_long = $v_y$", "m/s")
    draw_velocity(axes[1, 0], run, "v_lat_mps", "Lateral velocity v_lat = $−v_x$", "m/s")
    draw_velocity(axes[1, 1], run, "yaw_rate_radps", "Yaw rate = $v_θ / l$, $l$ = 1 m", "rad/s")
    axes[0, 1].legend(loc="upper left")
    return figure


def draw_modes(axes: Axes, run: Replayed) -> None:
    """True and identified discrete state; the identified one at the time at which it was known."""
    t_s, mode = run.samples["t_s"].to_numpy(), run.samples["mode"].to_numpy()
    axes.step(t_s, mode, where="post", color="#c4c9d0", linewidth=0.6, zorder=1)
    for a, b, stretch in stretches(mode):
        axes.plot(t_s[[a, b]], [stretch] * 2, color=rgb(MODE_COLOURS[stretch]), linewidth=8, zorder=2)
    axes.step(run.truth["t_s"], run.truth["mode"], where="post", zorder=3, **TRUE_STYLE)
    names = [f"{mode_name(mode)}  {int(mode)}".replace("-", "−") for mode in SHOWN_MODES]
    axes.set_yticks([int(mode) for mode in SHOWN_MODES], names)
    axes.set_ylim(-1.5, 2.5)
    axes.set_title("Discrete state $q$: true (dashed) and identified (coloured), at the time it was known")


def draw_constraint(axes: Axes, run: Replayed, column: str, threshold: str, beyond: ContactMode) -> None:
    """A constraint between its thresholds, at the instants that it describes."""
    samples = thin(run.samples)
    t_s, limit = described_s(samples), samples[threshold].to_numpy()
    colour = rgb(MODE_COLOURS[beyond])
    axes.plot(t_s, samples[column], color=ESTIMATE, linewidth=1.0)
    for bound in (limit, -limit):
        axes.plot(t_s, bound, color=colour, linewidth=2)
    axes.legend(
        handles=[Line2D([], [], color=colour, linewidth=2, label=f"± threshold, {mode_name(beyond)} beyond")],
        loc="upper left",
    )


def figure_4(run: Replayed) -> Figure:
    """The discrete state, and the two constraints that decide it."""
    figure = Figure(figsize=(10, 8), layout="constrained")
    axes = figure.subplots(3, 1, sharex=True, height_ratios=(1.15, 1, 1))
    draw_modes(axes[0], run)
    draw_constraint(axes[1], run, "c_k_mps", "c_k_threshold_mps", ContactMode.SKIDDING)
    draw_constraint(axes[2], run, "c_d_mps2", "c_d_threshold_mps2", ContactMode.SLIPPING)
    axes[1].set(
        title="Kinematic constraint $C_k$ = −v_lat, at the instant described", ylabel="m/s", ylim=(-1.0, None)
    )
    axes[2].set(
        title="Dynamic constraint $C_d$ = dv_long/dt − α Σeffort, at the instant described",
        ylabel="m/s²",
        xlabel="t [s]",
        ylim=(-0.9, 0.8),
    )
    figure.align_ylabels(axes[1:])
    axes[2].set_xlim(0, run.truth["t_s"][-1])
    return figure


def figure_alpha(run: Replayed, condition: ContactMode, formula: str) -> Figure:
    """α in one condition: the paper's quotient at each row, and the regression with its band."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    axes = figure.subplots()
    rows = thin(run.samples.with_columns(quotient()))
    t_s, alpha, reach = rows["t_s"], rows["alpha"], 1.96 * rows["alpha_sd"]
    each = {"color": "#b4bac3", "linewidth": 0.9, "label": f"quotient {formula} at each row"}
    fitted = {"color": ESTIMATE, "linewidth": 2, "label": "regression over time ± 1.96 sd"}
    axes.plot(described_s(rows), rows["quotient"], **each)
    axes.fill_between(t_s, alpha - reach, alpha + reach, step="post", color=ESTIMATE, alpha=0.2, linewidth=0)
    axes.step(t_s, alpha, where="post", **fitted)
    axes.axhline(PAPER_ROBOT.alpha, label="true", **TRUE_STYLE)
    axes.set(xlabel="t [s]", ylabel="α [(m/s²)/(N·m)]", title=f"α, {mode_name(condition)} throughout")
    axes.set_xlim(0, run.truth["t_s"][-1])
    axes.set_ylim(0, 2 * (PAPER_ROBOT.alpha or 1.0))
    axes.legend(loc="upper right", ncols=3)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Save a small PNG with 256 colours and without metadata."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    picture.quantize(256, dither=Image.Dither.NONE).save(path, optimize=True)


def make_figures(out: Path, *, quick: bool = False) -> None:
    """Write the four figures to ``out``."""
    out.mkdir(parents=True, exist_ok=True)
    with rc_context(STYLE):
        acceleration = replay("paper-acceleration", seed=SEED, quick=quick)
        ideal = replay("paper-alpha-ideal", seed=SEED, quick=quick)
        skidding = replay("paper-alpha-skidding", seed=SEED, quick=quick)
        save(figure_3(acceleration), out / "paper_fig3.png")
        save(figure_4(acceleration), out / "paper_fig4.png")
        save(figure_alpha(ideal, ContactMode.IDEAL, "(14)"), out / "paper_fig5.png")
        save(figure_alpha(skidding, ContactMode.SKIDDING, "(15)"), out / "paper_fig6.png")


def main() -> None:
    """Read the command line and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=IMAGES, help="folder of the pictures")
    parser.add_argument("--quick", action="store_true", help="short logs, to try the command")
    options = parser.parse_args()
    make_figures(options.out, quick=options.quick)


if __name__ == "__main__":
    main()
