"""The residual against the variable of its effect, in bins: before, after, and the effect's fitted curve.

A drag is a line through the residual over the speed. The table is what a plot of it needs: of each bin the
median of the residual that the base model leaves, of what the extended model leaves, and of what the effect
itself explains: the residual of the extended model without the effect, less that with it. All terms of a
formula have one such table together.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.gap.result.result import Against, AgainstBin, Formula, FoundEffect, Traces
from wmr_replay.gap.result.shown_by import DISTANCE, HEADING, OF_FACTOR, PLACES, TIME
from wmr_replay.gap.settings.result import ShownSettings
from wmr_schemas.arrays import F64, I64
from wmr_schemas.tables import GAP_TRACES

CHANNELS = ("longitudinal", "lateral", "yaw")
UNITS = {column.name: column.unit for column in GAP_TRACES} | {DISTANCE: "m"}
SLIP_UNITS = {"longitudinal": "m/s", "lateral": "m/s", "yaw": "rad/s"}
"""Of residuals where wheel speeds drive the model."""


def with_curves(
    effects: tuple[FoundEffect, ...],
    traces: Traces,
    residual_without: Callable[[str], F64],
    own: ShownSettings,
    *,
    by_wheels: bool = False,
) -> tuple[FoundEffect, ...]:
    """The effects with their tables. ``residual_without`` gives the residual (n, 3) of the extended model
    without the effect of a name.
    """
    return tuple(
        replace(
            effect, against=against(effect, traces, residual_without(effect.name), own, by_wheels=by_wheels)
        )
        for effect in effects
    )


def against(
    effect: FoundEffect, traces: Traces, without: F64, own: ShownSettings, *, by_wheels: bool
) -> Against | None:
    """The table of one effect; None where its variable or its residual is not among the traces."""
    variable = variable_of(effect, traces)
    if variable is None or effect.residual not in CHANNELS:
        return None
    units = SLIP_UNITS if by_wheels else {name: UNITS[f"base_residual_{name}"] for name in CHANNELS}
    shown = Shown(effect.residual, effect.variable, variable)
    return table_of(shown, traces, without, own, units[effect.residual])


def with_formula_curves(
    formulas: Iterable[Formula],
    traces: Traces,
    residual_without: Callable[[Formula], F64],
    own: ShownSettings,
) -> tuple[Formula, ...]:
    """The formulas with the quantity that what they explain follows most, of those that they read, and the
    residual against that. ``residual_without`` gives the residual (n, 3) without all terms of a formula.
    """
    return tuple(with_curve(one, traces, residual_without(one), own) for one in formulas)


def with_curve(formula: Formula, traces: Traces, without: F64, own: ShownSettings) -> Formula:
    """One formula with its table; as it is, where it reads nothing."""
    k = CHANNELS.index(formula.channel)
    explained = without[:, k] - traces.extended_residual[:, k]
    names = dict.fromkeys(OF_FACTOR[column] for column in formula.visited)
    shown = [Shown(formula.channel, name, column_of(name, traces)) for name in names]
    best = max(shown, key=lambda one: share_of_bins(one.values, explained, own.bins), default=None)
    if best is None:
        return formula
    table = table_of(best, traces, without, own, UNITS[f"base_residual_{formula.channel}"])
    return replace(formula, variable=best.variable, against=table)


class Shown(NamedTuple):
    """A residual's channel, the name of a variable, and its values (n,)."""

    residual: str
    variable: str
    values: F64


def table_of(shown: Shown, traces: Traces, without: F64, own: ShownSettings, unit: str) -> Against | None:
    """The table of what takes the residual ``without`` (n, 3) to the extended model's; None of few rows."""
    k = CHANNELS.index(shown.residual)
    before, after = traces.base_residual[:, k], traces.extended_residual[:, k]
    rows = np.flatnonzero(np.isfinite(shown.values + before + after + without[:, k]))
    if len(rows) < own.bins * own.least_rows:
        return None
    residuals = before, after, without[:, k] - after
    return Against(
        residual_unit=unit,
        variable_unit=UNITS[shown.variable],
        rms_before=rms(before[rows]),
        rms_after=rms(after[rows]),
        bins=tuple(bins_of(rows, shown.values, residuals, traces.t_s, own.bins)),
    )


def variable_of(effect: FoundEffect, traces: Traces) -> F64 | None:
    """The effect's variable at each row (n,); None where it is not known."""
    if effect.variable == DISTANCE:
        centre = [effect.parameters[key].value for key in ("x_m", "y_m") if key in effect.parameters]
        return None if len(centre) < 2 else np.hypot(*(traces.measured[:, :2] - centre).T)
    known = (*PLACES, HEADING, TIME, *traces.quantities)
    return column_of(effect.variable, traces) if effect.variable in known else None


def column_of(name: str, traces: Traces) -> F64:
    """A column of the traces (n,), a heading between −π and π."""
    if name == TIME:
        return traces.t_s
    if name == HEADING:
        return np.asarray(np.angle(np.exp(1j * traces.measured[:, 2])))
    return traces.measured[:, PLACES.index(name)] if name in PLACES else traces.quantities[name]


def share_of_bins(variable: F64, values: F64, n: int) -> float:
    """The share of the variance of values that their means in bins of a variable have."""
    known = np.isfinite(variable + values)
    inside, values = bin_of(variable[known], n), values[known]
    if not len(values) or not np.var(values):
        return 0.0
    counts = np.bincount(inside)
    means = np.bincount(inside, values) / np.maximum(counts, 1)
    return float(np.var(means[inside]) / np.var(values))


def bin_of(values: F64, n: int) -> I64:
    """Bins (m,) of equal counts, in ascending order."""
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, n + 1)))
    return np.clip(np.searchsorted(edges, values, side="right") - 1, 0, max(len(edges) - 2, 0))


def bins_of(
    rows: I64, variable: F64, residuals: tuple[F64, F64, F64], t_s: F64, n: int
) -> Iterable[AgainstBin]:
    """Bins of equal counts, in ascending order of the variable."""
    inside = bin_of(variable[rows], n)
    step_s = float(np.median(np.diff(t_s)))
    for k in np.unique(inside):
        mine = rows[inside == k]
        before, after, explained = (float(np.median(one[mine])) for one in residuals)
        yield AgainstBin(
            low=float(variable[mine].min()),
            high=float(variable[mine].max()),
            at=float(np.median(variable[mine])),
            seconds=len(mine) * step_s,
            before=before,
            after=after,
            fitted=explained,
        )


def rms(values: F64) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(values**2)))
