"""The residual against the variable of its effect, in bins: before, after, and the effect's fitted curve.

A drag is a line through the residual over the speed. The table is what a plot of it needs: of each bin the
median of the residual that the base model leaves, of what the extended model leaves, and of what the effect
itself explains: the residual of the extended model without the effect, less that with it.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from wmr_replay.gap.result.result import Against, AgainstBin, FoundEffect, Traces
from wmr_replay.gap.result.shown_by import DISTANCE, HEADING
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
    k = CHANNELS.index(effect.residual)
    before, after = traces.base_residual[:, k], traces.extended_residual[:, k]
    rows = np.flatnonzero(np.isfinite(variable + before + after + without[:, k]))
    if len(rows) < own.bins * own.least_rows:
        return None
    explained = without[:, k] - after
    units = SLIP_UNITS if by_wheels else {name: UNITS[f"base_residual_{name}"] for name in CHANNELS}
    return Against(
        residual_unit=units[effect.residual],
        variable_unit=UNITS[effect.variable],
        rms_before=rms(before[rows]),
        rms_after=rms(after[rows]),
        bins=tuple(bins_of(rows, variable, (before, after, explained), traces.t_s, own.bins)),
    )


def variable_of(effect: FoundEffect, traces: Traces) -> F64 | None:
    """The effect's variable at each row (n,), a heading between −π and π; None where it is not known."""
    if effect.variable == "t_s":
        return traces.t_s
    if effect.variable == HEADING:
        return np.asarray(np.angle(np.exp(1j * traces.measured[:, 2])))
    if effect.variable == DISTANCE:
        centre = [effect.parameters[key].value for key in ("x_m", "y_m") if key in effect.parameters]
        return None if len(centre) < 2 else np.hypot(*(traces.measured[:, :2] - centre).T)
    return traces.quantities.get(effect.variable)


def bins_of(
    rows: I64, variable: F64, residuals: tuple[F64, F64, F64], t_s: F64, n: int
) -> Iterable[AgainstBin]:
    """Bins of equal counts, in ascending order of the variable."""
    edges = np.unique(np.quantile(variable[rows], np.linspace(0.0, 1.0, n + 1)))
    inside = np.clip(np.searchsorted(edges, variable[rows], side="right") - 1, 0, max(len(edges) - 2, 0))
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
