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
    """One entity of one or more lines, named and coloured one by one; a single colour is that of all.

    ``at_described``: at t − ``delay_s``, else at t. ``slow``: lines that change little from row to row, drawn
    at a lower rate. Lines of one name share an entry of the plot's key.
    """

    entity: str
    lines: tuple[pl.Expr, ...]
    names: tuple[str, ...]
    colours: tuple[Colour, ...]
    width: float | tuple[float, ...] = 1.25
    at_described: bool = False
    slow: bool = False

    def reads(self) -> set[str]:
        """The columns that the lines need."""
        return {name for line in self.lines for name in line.meta.root_names()}

    @property
    def line_widths(self) -> tuple[float, ...]:
        """A width for each line."""
        return self.width if isinstance(self.width, tuple) else (self.width,) * len(self.lines)

    @property
    def line_colours(self) -> tuple[Colour, ...]:
        """A colour for each line."""
        return self.colours if len(self.colours) == len(self.lines) else self.colours * len(self.lines)


def _measured(column: str, name: str, colour: Colour = colours.ESTIMATE) -> Series:
    return Series(f"/pose/{column}/measured", (pl.col(column),), (name,), (colour,))


def _estimate(folder: str, column: str, name: str, width: float) -> Series:
    estimate = (colours.ESTIMATE,)
    return Series(
        f"{folder}/{column}/estimate", (pl.col(column),), (name,), estimate, width, at_described=True
    )


def _velocity(column: str, name: str) -> Series:
    """Broad, so that the true one, thin over it, leaves it visible on either side."""
    return _estimate("/velocity", column, name, 2.5)


def _threshold(column: str, threshold: str, beyond: ContactMode) -> Series:
    limit, names = pl.col(threshold), ("threshold", "threshold")
    entity, colour = f"/constraint/{column}/threshold", (MODE_COLOURS[beyond],)
    return Series(entity, (limit, -limit), names, colour, at_described=True, slow=True)


def _true(folder: str, column: str) -> Series:
    return Series(f"{folder}/{column}/true", (pl.col(column),), ("true",), (colours.TRUTH,), 1.0)


def _posterior(entity: str, *modes: ContactMode) -> Series:
    return Series(
        entity,
        tuple(pl.col(f"p_{mode.label}") for mode in modes),
        tuple(f"P({'both' if mode is ContactMode.SKIDDING_SLIPPING else mode.label})" for mode in modes),
        tuple(MODE_COLOURS[mode] for mode in modes),
        1.5,
    )


def _with_band(
    entity: str,
    column: str,
    name: str,
    hues: tuple[Colour, Colour] = (colours.ESTIMATE, colours.BAND),
    *,
    at_described: bool = False,
) -> tuple[Series, Series]:
    """A line and, as siblings beneath it, the ends of its 95 % interval; learnt values change slowly."""
    value, spread = pl.col(column), NORMAL_95 * pl.col(f"{column}_sd")
    timing = {"at_described": at_described, "slow": not at_described}
    names, ends = ("95 % band", "95 % band"), (value + spread, value - spread)
    return (
        Series(f"{entity}/estimate", (value,), (name,), hues[:1], 1.5 if at_described else 2.0, **timing),
        Series(f"{entity}/band", ends, names, hues[1:], 1.0 if at_described else 1.25, **timing),
    )


def _slip(side: str, *hues: Colour) -> tuple[Series, Series]:
    name = f"slip {side} [m/s]"
    return _with_band(f"/slip/{side}", f"slip_{side}_mps", name, (hues[0], hues[1]), at_described=True)


ESTIMATED: tuple[Series, ...] = (
    _measured("x_m", "x [m]"),
    _measured("y_m", "y [m]", colours.SECOND),
    _measured("yaw_rad", "yaw [rad]"),
    _velocity("v_long_mps", "v_long [m/s]"),
    _velocity("v_lat_mps", "v_lat [m/s]"),
    _velocity("yaw_rate_radps", "yaw [rad/s]"),
    _posterior("/posterior", ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING),
    _posterior("/posterior/both", ContactMode.SKIDDING_SLIPPING),
    _estimate("/constraint", "c_k_mps", "C_k [m/s]", 1.5),
    _threshold("c_k_mps", "c_k_threshold_mps", ContactMode.SKIDDING),
    _estimate("/constraint", "c_d_mps2", "C_d [m/s²]", 1.5),
    _threshold("c_d_mps2", "c_d_threshold_mps2", ContactMode.SLIPPING),
    *_with_band("/alpha", "alpha", "α [1/(kg·m)]"),
    *_slip("left", colours.ESTIMATE, colours.BAND),
    *_slip("right", colours.SECOND, colours.SECOND_BAND),
    *_with_band("/learnt/wheel_scale", "wheel_scale", "wheel scale"),
    *_with_band("/learnt/effective_half_track_m", "effective_half_track_m", "half track [m]"),
    *_with_band("/learnt/icr_offset_m", "icr_offset_m", "x of turns [m]"),
)
"""Lines out of the samples table."""

TRUE: tuple[Series, ...] = (
    _true("/pose", "yaw_rad"),
    _true("/velocity", "v_long_mps"),
    _true("/velocity", "v_lat_mps"),
    _true("/velocity", "yaw_rate_radps"),
)
"""Lines out of the side file; Rerun draws siblings in alphabetical order, so ``true`` over ``estimate``."""

TORQUE = Series(
    "/torque",
    (pl.col("left_nm"), pl.col("right_nm")),
    ("τ left [N·m]", "τ right [N·m]"),
    (colours.ESTIMATE, colours.SECOND),
    (2.5, 1.0),
)
"""Lines out of the torques that the run was given."""

NOMINAL = Series("/alpha/nominal", (pl.col("alpha"),), ("nominal",), (colours.NOMINAL,))

AS_STATED = {"wheel_scale": 1.0, "icr_offset_m": 0.0}
"""What a robot shows whose wheels are as large as stated and which turns about the point between them."""
LEARNT = ("wheel_scale", "effective_half_track_m", "icr_offset_m")
LEARNT_SD = 15.0
LEARNT_LEAST = 0.002
"""Reach of the axis of a learnt value: standard deviations of the last one, and in its own unit."""


def as_stated(column: str) -> Series:
    """The line that a learnt value is compared with."""
    return Series(f"/learnt/{column}/stated", (pl.col(column),), ("as stated",), (colours.NOMINAL,))


def learnt_ranges(last: pl.DataFrame | None) -> dict[str, tuple[float, float]]:
    """The range to show of each value learnt of the wheels, by its entity.

    At first their bands are wider than any plot: the automatic range would flatten the rest.
    """
    if last is None:
        return {}
    found = {}
    for name in set(LEARNT) & set(last.columns):
        value, sd = (last[one].cast(pl.Float64).to_numpy()[0] for one in (name, f"{name}_sd"))
        if np.isfinite([value, sd]).all():
            reach = max(LEARNT_SD * sd, LEARNT_LEAST)
            known = [value - reach, value + reach, *([AS_STATED[name]] if name in AS_STATED else [])]
            margin = 0.1 * (max(known) - min(known))
            found[f"/learnt/{name}/estimate"] = (min(known) - margin, max(known) + margin)
    return found


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
