"""``wmr-replay design``."""

from pathlib import Path
from typing import TypedDict

import click

from wmr_replay.cli.help import GroupedCommand
from wmr_replay.cli.options.mapping import log_options, mapping_options

POSITIVE = click.FloatRange(min=0, min_open=True)


class Kernel(TypedDict):
    """The kernel's parameters as keyword arguments."""

    degree: int
    kappa: int
    mu: int
    theta: float
    shares: tuple[float, ...]


@click.command(
    "design",
    cls=GroupedCommand,
    groups={
        "Kernel": (
            "--window",
            "--rate",
            "--degree",
            "--kappa",
            "--mu",
            "--theta",
            "--share",
            "--noise",
            "--max-delay",
        )
    },
)
@click.option("--window", "window_s", type=POSITIVE, default=0.5, show_default=True, help="Window T in s.")
@click.option("--rate", "rate_hz", type=POSITIVE, help="Sampling rate in Hz.  [default: the log's, or 100]")
@click.option("--degree", type=int, default=2, show_default=True, help="Degree N of the local polynomial.")
@click.option(
    "--kappa", type=int, default=0, show_default=True, help="Weight exponent at the window's newest end."
)
@click.option(
    "--mu", type=int, default=0, show_default=True, help="Weight exponent at the window's oldest end."
)
@click.option(
    "--theta",
    type=float,
    default=0.0,
    show_default=True,
    help="Instant described: 0 the window's middle, 1 now.",
)
@click.option(
    "--share",
    "shares",
    type=float,
    multiple=True,
    help="Share of degree N + 1; given again, of N + 2, and so on.  [default: none]",
)
@click.option(
    "--noise",
    "sigma",
    type=POSITIVE,
    default=1.0,
    show_default=True,
    help="Standard deviation of the signal's noise, for the table.",
)
@click.option(
    "--plot",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Draw kernels and Bode diagram to this file (.png, .svg or .pdf).",
)
@click.option(
    "--log", type=click.Path(path_type=Path), help="Log: say what the differentiator makes of its pose."
)
@click.option(
    "--max-delay",
    "max_delay_s",
    type=POSITIVE,
    help="With --log: find the best kernel at this delay or less, in s.",
)
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@mapping_options
def command(  # noqa: PLR0917
    window_s: float,
    rate_hz: float | None,
    degree: int,
    kappa: int,
    mu: int,
    theta: float,
    shares: tuple[float, ...],
    sigma: float,
    plot: Path | None,
    log: Path | None,
    max_delay_s: float | None,
    as_json: bool,
    **mapping: str | Path | None,
) -> None:
    """Design a differentiator: delay, noise, bandwidth and efficiency of every order; kernels and Bode
    diagram; and what it makes of a log.

    \b
    Examples:
      wmr-replay design --window 0.5 --degree 3 --rate 1000
      wmr-replay design --kappa 1 --mu 1 --plot kernel.png
      wmr-replay design --log log.mcap --window 0.4 --max-delay 0.15
    """
    from wmr_replay.api.design import design
    from wmr_replay.api.pose_derivatives import differentiate_pose
    from wmr_replay.cli.printing.design import print_design
    from wmr_replay.cli.printing.progress import byte_progress

    if max_delay_s is not None and log is None:
        raise click.UsageError("--max-delay needs a signal to judge by: name a log with --log FILE")
    if plot is not None:
        check_plot(plot)
    kernel: Kernel = {"degree": degree, "kappa": kappa, "mu": mu, "theta": theta, "shares": shares}
    on_log = None
    if log is not None:
        with byte_progress(f"reading {log.name}") as progress:
            on_log = differentiate_pose(
                log,
                window_s=window_s,
                rate_hz=rate_hz,
                max_delay_s=max_delay_s,
                progress=progress,
                **kernel,
                **log_options(mapping),
            )
        rate_hz = on_log.rate_hz
    designed = design(window_s, rate_hz or 100.0, noise_sd=sigma, **kernel)
    print_design(designed, on_log, as_json=as_json)
    if plot is not None:
        from wmr_replay.api.plots import design_figure, write_figure
        from wmr_replay.cli.printing.plain import say

        write_figure(design_figure(designed, on_log), plot)
        say(f"wrote {plot}", err=as_json)


def check_plot(plot: Path) -> None:
    """Raises InvalidSetting where the picture could not be written, before any work is done."""
    from wmr_replay.api.plots import check_target

    check_target(plot)
