"""``wmr-replay diff``."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from wmr_replay.cli.mapping import mapping_from_options, mapping_options
from wmr_schemas.errors import InvalidSetting

if TYPE_CHECKING:
    from wmr_replay.cli.differentiator.log import Effect
    from wmr_replay.cli.differentiator.table import Design

POSITIVE = click.FloatRange(min=0, min_open=True)


@click.command(name="diff")
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
    "--log", type=click.Path(path_type=Path), help="MCAP log: say what the differentiator makes of its pose."
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
      wmr-replay diff --window 0.5 --degree 3 --rate 1000
      wmr-replay diff --kappa 1 --mu 1 --plot kernel.png
      wmr-replay diff --log log.mcap --window 0.4 --max-delay 0.15
    """
    from wmr_replay.cli.differentiator.log import effect_on
    from wmr_replay.cli.differentiator.table import design_of, print_design
    from wmr_replay.differentiate import KernelSpec

    if max_delay_s is not None and log is None:
        raise click.UsageError("--max-delay needs a signal to judge by: name a log with --log FILE")
    spec = KernelSpec(degree, kappa, mu, theta, shares)
    draw = None if plot is None else drawing(plot)
    effect = None
    if log is not None:
        effect = effect_on(log, mapping_from_options(mapping), spec, window_s, rate_hz, max_delay_s)
        rate_hz = effect.rate_hz
    design = design_of(spec, window_s, rate_hz or 100.0, sigma)
    if as_json:
        print_json(design, effect)
    else:
        print_design(design, effect)
    if draw is not None and plot is not None:
        draw(plot, design, effect)
        click.echo(f"wrote {plot}", err=as_json)


def drawing(plot: Path) -> Any:
    """The function that draws, once it is sure that it can."""
    if plot.suffix.lower() not in {".png", ".svg", ".pdf"}:
        raise InvalidSetting(f"--plot {plot}: name a file that ends in .png, .svg or .pdf")
    if not plot.parent.is_dir():
        raise InvalidSetting(f"--plot {plot}: there is no directory {plot.parent}; create it first")
    try:
        from wmr_replay.cli.differentiator.plot import draw
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "matplotlib":
            raise
        raise InvalidSetting("--plot needs matplotlib: pip install 'wmr-replay[docs]'") from None
    return draw


def print_json(design: "Design", effect: "Effect | None") -> None:
    """One JSON document on standard output."""
    import json

    content = design.as_dict() | ({} if effect is None else {"log": effect.as_dict()})
    click.echo(json.dumps(content, indent=2, ensure_ascii=False))
