"""A gap analysis in Rerun: measured, base and extended path, residuals and gaps before and after.

================================================  ===========================================================
``/description``                                  the verdict and how to read the recording (static)
``/path/measured``, ``/path/held_out``            the measured path; the part of it that was not fitted
``/path/base``, ``/path/extended``                simulated in windows of 4 s, each from its own fitted start
``/path/regions``, ``/path/robot``                where most of the gap lies; the robot at the cursor
``/mode``, ``/part``                              contact mode; fitted, held out
``/residual/C/M``                                 disturbance that model M needs on channel C: m/s²,
                                                  sideways a velocity in m/s
``/gap/position/M``, ``/gap/yaw/M``               measured minus simulated, in mm and mrad
================================================  ===========================================================

M is ``base`` or ``extended``; C is ``longitudinal``, ``lateral``, ``yaw`` (l·yaw_acc).
"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from wmr_replay.timeline import colours
from wmr_replay.timeline.gap.layout import gap_layout
from wmr_replay.timeline.gap.path import add_paths, cut, frame_of
from wmr_replay.timeline.gap.text import gap_text
from wmr_replay.timeline.series import Series
from wmr_replay.timeline.sink import Sink, recording_into
from wmr_replay.timeline.states import Changes, Lane, mode_lane
from wmr_schemas.arrays import F64, NS_PER_S, Bool

if TYPE_CHECKING:
    from wmr_replay.gap.result.result import GapResult, Traces

CHANNELS = ("longitudinal", "lateral", "yaw")
PARTS = {"fitted": colours.FITTED, "held out": colours.BAND}
LANES = (
    mode_lane("/mode", "mode"),
    Lane("/part", pl.when("held_out").then(pl.lit("held out")).otherwise(pl.lit("fitted")), PARTS),
)
MODELS = {"base": colours.BASE, "extended": colours.EXTENDED}


def write_gap_timeline(path: Path, result: "GapResult", log_name: str, recording_id: str) -> None:
    """Write the recording of ``result`` to ``path``."""
    traces, sink = result.traces, Sink(recording_into(path, recording_id), lanes=LANES)
    sink.start_ns = traces.start_ns
    try:
        rows = frame_rows(traces)
        for lane in LANES:
            sink.add_changes(lane, Changes(lane).push(rows))
        for model, colour in MODELS.items():
            for series in lines_of(model, colour):
                sink.add_lines(series, rows)
        add_paths(sink, traces, rows["t_ns"], result.where.regions)
        frame = frame_of(traces)
        sink.add_grid(frame)
        sink.add_text(gap_text(result, log_name))
        sink.close(gap_layout(sink.written.keys(), frame))
    except BaseException:
        sink.close()
        raise


def lines_of(model: str, colour: colours.Colour) -> list[Series]:
    """The plotted lines of one model."""
    residuals = [
        Series(f"/residual/{channel}/{model}", (pl.col(f"{model}_{channel}"),), (model,), colour)
        for channel in CHANNELS
    ]
    gaps = [
        Series(f"/gap/{kind}/{model}", (pl.col(f"{model}_gap_{kind}"),), (model,), colour, 1.5)
        for kind in ("position", "yaw")
    ]
    return residuals + gaps


def frame_rows(traces: "Traces") -> pl.DataFrame:
    """The traces as columns, holes as NaN; a window's first row is one, so that no line joins two windows."""
    t_ns = traces.start_ns + np.round(traces.t_s * NS_PER_S).astype(np.int64)
    held_out = traces.held_out.astype(bool)
    mode = traces.mode.astype(np.int8)
    columns: dict[str, F64 | Bool | np.ndarray] = {"t_ns": t_ns, "held_out": held_out, "mode": mode}
    for model in MODELS:
        residual: F64 = getattr(traces, f"{model}_residual")
        columns |= {f"{model}_{name}": residual[:, k] for k, name in enumerate(CHANNELS)}
        gap = traces.measured - getattr(traces, f"{model}_path")
        gap[[a for a, _ in cut(traces)]] = np.nan
        columns[f"{model}_gap_position"] = 1e3 * np.hypot(gap[:, 0], gap[:, 1])
        columns[f"{model}_gap_yaw"] = 1e3 * gap[:, 2]
    rows = pl.DataFrame(columns)
    return rows.with_columns(delay_s=pl.lit(0.0))
