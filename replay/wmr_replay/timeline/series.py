"""The plotted series: which entity, out of which columns, named and coloured how."""

from dataclasses import dataclass

import numpy as np
import polars as pl

from wmr_replay.timeline import colours
from wmr_replay.timeline.colours import MODE_COLOURS, Colour
from wmr_schemas.modes import ContactMode

NORMAL_95 = 1.96
"""Half width, in standard deviations, of the interval that holds a normal variable with probability 0.95."""


@dataclass(frozen=True)
class Series:
    """One entity of one or more lines. ``at_described``: at t − ``delay_s``, else at t."""

    entity: str
    lines: tuple[pl.Expr, ...]
    names: tuple[str, ...]
    colour: Colour
    width: float = 1.25
    at_described: bool = False

    def reads(self) -> set[str]:
        """The columns that the lines need."""
        return {name for line in self.lines for name in line.meta.root_names()}


def _measured(column: str, name: str, colour: Colour = colours.ESTIMATE) -> Series:
    return Series(f"/pose/{column}/measured", (pl.col(column),), (name,), colour)


def _derivative(column: str) -> Series:
    return Series(
        f"/velocity/{column}/estimate",
        (pl.col(column),),
        ("estimate at t − delay",),
        colours.ESTIMATE,
        at_described=True,
    )


def _constraint(column: str, threshold: str, name: str, beyond: ContactMode) -> tuple[Series, Series]:
    limit = pl.col(threshold)
    names = (f"+ threshold ({colours.mode_name(beyond)} beyond)", "− threshold")
    return (
        Series(
            f"/constraint/{column}/estimate", (pl.col(column),), (name,), colours.ESTIMATE, at_described=True
        ),
        Series(
            f"/constraint/{column}/threshold", (limit, -limit), names, MODE_COLOURS[beyond], at_described=True
        ),
    )


def _true(folder: str, column: str) -> Series:
    return Series(f"{folder}/true", (pl.col(column),), ("true",), colours.TRUTH)


_SPREAD = NORMAL_95 * pl.col("alpha_sd")

ESTIMATED: tuple[Series, ...] = (
    _measured("x_m", "x measured"),
    _measured("y_m", "y measured", colours.SECOND),
    _measured("yaw_rad", "measured"),
    _derivative("v_long_mps"),
    _derivative("v_lat_mps"),
    _derivative("yaw_rate_radps"),
    *_constraint("c_k_mps", "c_k_threshold_mps", "C_k at t − delay", ContactMode.SKIDDING),
    *_constraint("c_d_mps2", "c_d_threshold_mps2", "C_d at t − delay", ContactMode.SLIPPING),
    Series("/alpha/estimate", (pl.col("alpha"),), ("α from the data up to t",), colours.ESTIMATE, 2.0),
    Series(
        "/alpha/band",
        (pl.col("alpha") + _SPREAD, pl.col("alpha") - _SPREAD),
        ("α + 1.96 sd", "α − 1.96 sd"),
        colours.BAND,
    ),
)
"""Lines out of the samples table."""

TRUE: tuple[Series, ...] = (
    _true("/pose/yaw_rad", "yaw_rad"),
    _true("/velocity/v_long_mps", "v_long_mps"),
    _true("/velocity/v_lat_mps", "v_lat_mps"),
    _true("/velocity/yaw_rate_radps", "yaw_rate_radps"),
)
"""Lines out of the side file; Rerun draws siblings in alphabetical order, so ``true`` over ``estimate``."""

NOMINAL = Series("/alpha/nominal", (pl.col("alpha"),), ("nominal",), colours.NOMINAL)


def alpha_range(last: pl.DataFrame | None, nominal: float | None) -> tuple[float, float] | None:
    """The range of α to show: last estimate ± 4 sd and nominal value; None where there is no estimate.

    While α is hardly known its band is wider than any plot: the automatic range would flatten the rest.
    """
    if last is None:
        return None
    alpha, sd = (last[name].cast(pl.Float64).to_numpy()[0] for name in ("alpha", "alpha_sd"))
    if not np.isfinite([alpha, sd]).all():
        return None
    reach = max(min(4 * sd, abs(alpha)), 0.1 * abs(alpha))
    known = [alpha - reach, alpha + reach] + ([] if nominal is None else [nominal])
    margin = 0.1 * (max(known) - min(known))
    return min(known) - margin, max(known) + margin
