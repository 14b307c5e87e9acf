"""A differentiator as one figure: kernels, Bode diagram and, with a log, derivatives over time."""

import numpy as np
from matplotlib.axes import Axes

from wmr_replay.api.design import Design
from wmr_replay.api.plots.figure import Figure
from wmr_replay.api.pose_derivatives import SIGNALS, PoseDerivatives
from wmr_replay.differentiate import continuous_kernel, frequency_response
from wmr_schemas.arrays import NS_PER_S

COLOURS = ("#4c72b0", "#dd8452", "#55a868")


def design_figure(design: Design, on_log: PoseDerivatives | None = None) -> Figure:
    """The figure of a design, and of what it makes of a log."""
    n_rows = 2 if on_log is None else 4
    figure = Figure(figsize=(10, 3.2 * n_rows), layout="constrained")
    grid = figure.add_gridspec(n_rows, 2)
    draw_kernels(figure.add_subplot(grid[0, 0]), design)
    draw_taps_noise(figure.add_subplot(grid[0, 1]), design)
    draw_bode(figure.add_subplot(grid[1, 0]), figure.add_subplot(grid[1, 1]), design)
    if on_log is not None:
        draw_derivative(figure.add_subplot(grid[2, :]), on_log, 1)
        draw_derivative(figure.add_subplot(grid[3, :]), on_log, 2)
    return figure


def draw_kernels(axes: Axes, design: Design) -> None:
    """Continuous kernels, scaled to a window of 1 s, over the age."""
    age = np.linspace(0, 1, 501)
    for row in design.orders:
        kernel = continuous_kernel(row.order, design.spec, 1.0, age)
        axes.plot(age, kernel / np.max(np.abs(kernel)), color=COLOURS[row.order], label=f"order {row.order}")
    axes.axvline((1 - design.spec.theta) / 2, color="grey", linestyle=":", label="delay")
    axes.set(xlabel="age / T", ylabel="kernel / largest value", title="Kernels")
    axes.legend()


def draw_taps_noise(axes: Axes, design: Design) -> None:
    """Standard deviation of each order over the window's length."""
    windows = np.geomspace(design.window_s / 5, design.window_s * 5, 50)
    for row in design.orders:
        sd = design.sigma * np.sqrt(row.noise_coefficient / design.rate_hz / windows ** (2 * row.order + 1))
        axes.loglog(windows, sd, color=COLOURS[row.order], label=f"order {row.order}")
        axes.plot(design.window_s, row.sd, "o", color=COLOURS[row.order])
    axes.set(xlabel="T in s", ylabel="sd", title=f"Noise of the estimates, signal noise {design.sigma:g}")
    axes.legend()


def draw_bode(gain: Axes, lag: Axes, design: Design) -> None:
    """Gain beside the ideal differentiator's, and phase beside that of the ideal one delayed by δ."""
    frequencies = np.geomspace(0.02 / design.window_s, design.rate_hz / 2, 2000)
    for row in design.orders:
        response = frequency_response(design.taps[row.order], 1 / design.rate_hz, frequencies)
        ideal = (2j * np.pi * frequencies) ** row.order * np.exp(-2j * np.pi * frequencies * design.delay_s)
        colour = COLOURS[row.order]
        gain.loglog(frequencies, np.abs(response), color=colour, label=f"order {row.order}")
        gain.loglog(frequencies, np.abs(ideal), color=colour, linestyle=":")
        passed = frequencies <= row.bandwidth_hz
        degrees = np.angle(response[passed] / ideal[passed], deg=True)
        lag.semilogx(frequencies[passed], degrees, color=colour)
    largest = max(float(np.max(np.abs(taps).sum())) for taps in design.taps)
    gain.set_ylim(1e-4, largest * 2)
    lag.set_ylim(min(-10.0, lag.get_ylim()[0]), max(10.0, lag.get_ylim()[1]))
    gain.set(xlabel="Hz", ylabel="gain", title="Gain (dotted: ideal)")
    lag.set(xlabel="Hz", ylabel="degrees", title="Phase against the ideal, delayed by δ")
    gain.legend()


def draw_derivative(axes: Axes, on_log: PoseDerivatives, order: int) -> None:
    """A derivative of each signal over the log's first rows, with a band of two standard deviations."""
    t_ns, _, out, sd = on_log.head
    t_s = (t_ns - t_ns[0]) / NS_PER_S - np.nan_to_num(out.delay_s)
    for s, (name, unit) in enumerate(SIGNALS):
        value, half = out.estimates[s, order], 2 * sd[s, order]
        axes.plot(
            t_s, value, color=COLOURS[s], linewidth=1, label=f"{name}, {unit}/s{'²' if order == 2 else ''}"
        )
        axes.fill_between(t_s, value - half, value + half, color=COLOURS[s], alpha=0.2, linewidth=0)
    axes.set(xlabel="s", title=f"Derivative of order {order} at the instants described, ± 2 sd")
    axes.legend(loc="upper right")
