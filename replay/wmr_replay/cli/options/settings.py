"""Options of the differentiator and the identifier, shared by the commands that replay logs."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click
from click.core import ParameterSource

from wmr_replay.cli.options.places import MODEL_FILE

if TYPE_CHECKING:
    from wmr_replay.api.request import SettingsArguments

F = TypeVar("F", bound=Callable[..., Any])

CLOCK_OFFSET = click.option(
    "--clock-offset",
    "clock_offset_s",
    type=float,
    default=0.0,
    metavar="S",
    help="Seconds added to the stamps of torques and wheel speeds.",
)
OPTIONS = (
    click.option(
        "--identifier",
        type=click.Choice(["paper", "algebraic", "bank"]),
        default="bank",
        help="How modes are told apart.",
    ),
    click.option(
        "--evidence",
        type=click.Choice(["auto", "torques", "wheel-speeds", "both"]),
        default="auto",
        help="What the bank tells modes by; by default what the log has.",
    ),
    click.option("--min-confidence", type=float, default=0.5, help="No mode is named below this posterior."),
    click.option(
        "--simultaneous", is_flag=True, help="Let skidding and slipping at once be a mode of its own."
    ),
    click.option(
        "--threshold-sd", type=float, default=3.0, help="Thresholds of C_k and C_d in standard deviations."
    ),
    click.option(
        "--min-sideslip",
        type=float,
        help="v_lat/v_long up to which tyres count as gripping; by default 0, or 0.15 where the robot's "
        "cornering stiffness is unknown.",
    ),
    click.option(
        "--window", "window_s", type=float, help="Differentiator window in s; else from rate and noise."
    ),
    click.option(
        "--max-delay",
        "max_delay_s",
        type=float,
        help="Delay in s that the differentiator may have; else that of the window from rate and noise.",
    ),
    click.option(
        "--tune/--no-tune",
        default=True,
        help="Tune the kernel on the log's first 8 s with motion; else its window follows rate and noise.",
    ),
    CLOCK_OFFSET,
    click.option(
        "--hindsight/--no-hindsight",
        default=True,
        help="Go over the log a second time, looking ahead: what happened, as well as the log can tell.",
    ),
    click.option(
        "--lag", "hindsight_lag_s", type=float, default=4.0, help="How far hindsight looks ahead, in s."
    ),
    click.option("--degree", type=int, default=2, help="Degree N of the local polynomial."),
    click.option("--kappa", type=int, default=0, help="Weight exponent at the window's newest end."),
    click.option("--mu", type=int, default=0, help="Weight exponent at the window's oldest end."),
    click.option("--theta", type=float, default=0.0, help="Instant described: 0 the window's middle, 1 now."),
)
NAMES = (
    "identifier",
    "evidence",
    "min_confidence",
    "simultaneous",
    "threshold_sd",
    "min_sideslip",
    "window_s",
    "max_delay_s",
    "tune",
    "hindsight",
    "hindsight_lag_s",
    "clock_offset_s",
    "degree",
    "kappa",
    "mu",
    "theta",
)
SHAPE = ("degree", "kappa", "mu", "theta")
"""Settings that choose a kernel."""


def settings_options(command: F) -> F:
    """Add the options of :class:`~wmr_replay.pipeline.settings.Settings` that users change."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def model_option(help_text: str) -> Callable[[F], F]:
    """The option --model, a model file."""
    return click.option("--model", "model_file", type=MODEL_FILE, help=help_text)


def settings_from_options(options: Mapping[str, Any]) -> "SettingsArguments":
    """The settings that the command line and its files state, as keyword arguments; no default is among them.

    A kernel's shape that is given on the command line is one that no tuning replaces, unless --tune is given
    there too.
    """
    from wmr_replay.cli.config.apply import SETTINGS

    ctx = click.get_current_context()
    source = {name: ctx.get_parameter_source(name) for name in NAMES}
    given = ctx.meta.get(SETTINGS, {}) | {
        name: options[name] for name in NAMES if source[name] is not ParameterSource.DEFAULT
    }
    on_line = {name for name in NAMES if source[name] is ParameterSource.COMMANDLINE}
    if on_line & set(SHAPE) and "tune" not in on_line:
        given.pop("tune", None)
    return cast("SettingsArguments", given)
