"""A gap analysis in Rerun: where base and extended model miss the measured path, residuals, gaps.

================================================  ===========================================================
``/description``, ``/how_to_read``                the verdict; how to read the recording (static)
``/findings``                                     what is wrong with the data, where each finding begins
``/path/M/error``, ``/path/M/vectors``            the measured path in the colours of model M's error; vectors
                                                  from measured to simulated, magnified (static)
``/path/held_out``, ``/path/regions``             the part that was not fitted; where most of the gap lies
``/path/robot``, ``/path/key``                    the robot at the cursor; the key of the colours
``/mode``, ``/part``                              contact mode; fitted, held out
``/speed/actual``, ``/speed/M``                 along the heading, in m/s
``/residual/C/M``                                 disturbance that model M needs on channel C: m/s²,
                                                  sideways a velocity in m/s
``/gap/position/M``, ``/gap/yaw/M``               measured minus simulated, in mm and mrad
================================================  ===========================================================

M is ``base`` or ``extended``; C is ``longitudinal``, ``lateral``, ``yaw`` (l·yaw_acc). What belongs to the
extended model is there only where something was added to the base.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from wmr_replay.timeline import colours
from wmr_replay.timeline.gap.layout import PAGES, SLIP_PAGES, gap_layout
from wmr_replay.timeline.gap.path import Errors, add_key, add_paths, cut, frame_of
from wmr_replay.timeline.gap.speed import SPEED_S, speed
from wmr_replay.timeline.gap.text import gap_text, how_to_read
from wmr_replay.timeline.robot import Scales
from wmr_replay.timeline.series import Series
from wmr_replay.timeline.sink import Sink, recording_into
from wmr_replay.timeline.states import Changes, Lane, mode_lane
from wmr_replay.timeline.views import Span
from wmr_schemas.arrays import F64, NS_PER_S, Bool

if TYPE_CHECKING:
    from wmr_replay.gap.result.result import GapResult, Traces

CHANNELS = ("longitudinal", "lateral", "yaw")
PARTS = {"fitted": colours.FITTED, "held out": colours.BAND}
LANES = (
    mode_lane("/mode", "mode"),
    Lane("/part", pl.when("held_out").then(pl.lit("held out")).otherwise(pl.lit("fitted")), PARTS),
)
MODELS = colours.MODELS
EVERY = 2
"""Of speeds and poses of the robot every second row is drawn."""
MEASURED_SPEED = Series(
    "/speed/actual", (pl.col("speed_measured"),), ("measured",), (colours.TRUE_PATH,), 2.0
)


def write_gap_timeline(
    path: Path,
    result: "GapResult",
    log_name: str,
    recording_id: str,
    findings: Sequence[Mapping[str, Any]] = (),
) -> None:
    """Write the recording of ``result`` to ``path``."""
    lanes = LANES if result.base_model == "torque" else LANES[1:]  # by wheel speeds no mode is told
    traces, sink = result.traces, Sink(recording_into(path, recording_id), lanes=lanes)
    sink.start_ns = traces.start_ns
    extended = bool(result.effects)
    try:
        rows = frame_rows(traces)
        for lane in lanes:
            sink.add_changes(lane, Changes(lane).push(rows))
        fewer = rows.gather_every(EVERY)
        sink.add_lines([MEASURED_SPEED], fewer)
        for model in ("base", "extended") if extended else ("base",):
            lines = lines_of(model, MODELS[model])
            sink.add_lines([series for series in lines if not series.slow], rows)
            sink.add_lines([series for series in lines if series.slow], fewer)
        frame = frame_of(traces)
        errors = Errors.of(traces, frame)
        sink.add_grid(frame)
        sink.size_robot(Scales.of(frame, 1.0))
        sink.add_robot(fewer)
        add_paths(sink, traces, errors.without_extended() if not extended else errors, result.where.regions)
        add_key(sink, frame, errors)
        sink.add_text(gap_text(result, log_name, findings))
        sink.add_text(how_to_read(result, errors.factor, SPEED_S), "/how_to_read")
        sink.add_findings(findings)
        span = Span(float(traces.t_s[0]), float(traces.t_s[-1]))
        held = {"extended": extended, "found": bool(findings)}
        pages = PAGES if result.base_model == "torque" else SLIP_PAGES
        sink.close(gap_layout(sink.written.keys(), frame, span, errors.factor, pages, **held))
    except BaseException:
        sink.close()
        raise


def lines_of(model: str, colour: colours.Colour) -> list[Series]:
    """The plotted lines of one model: the base broad, the extended one thin over it."""
    width = 2.0 if model == "base" else 1.0
    folders = [f"residual/{channel}" for channel in CHANNELS] + ["gap/position", "gap/yaw", "speed"]
    return [
        Series(
            f"/{folder}/{model}",
            (pl.col(f"{folder.replace('/', '_')}_{model}"),),
            (model,),
            (colour,),
            width,
            slow=folder == "speed",
        )
        for folder in folders
    ]


def frame_rows(traces: "Traces") -> pl.DataFrame:
    """The traces as columns, holes as NaN; a window's first row is one, so that no line joins two windows."""
    t_ns = traces.start_ns + np.round(traces.t_s * NS_PER_S).astype(np.int64)
    held_out = traces.held_out.astype(bool)
    mode = traces.mode.astype(np.int8)
    columns: dict[str, F64 | Bool | np.ndarray] = {"t_ns": t_ns, "held_out": held_out, "mode": mode}
    columns |= dict(zip(("x_m", "y_m", "yaw_rad"), traces.measured.T, strict=True))
    columns["speed_measured"] = speed(traces.t_s, traces.measured, [(0, len(t_ns))])
    windows = cut(traces)
    for model in MODELS:
        residual: F64 = getattr(traces, f"{model}_residual")
        columns |= {f"residual_{name}_{model}": residual[:, k] for k, name in enumerate(CHANNELS)}
        simulated: F64 = getattr(traces, f"{model}_path")
        gap = traces.measured - simulated
        gap[[a for a, _ in windows]] = np.nan
        columns[f"gap_position_{model}"] = 1e3 * np.hypot(gap[:, 0], gap[:, 1])
        columns[f"gap_yaw_{model}"] = 1e3 * gap[:, 2]
        columns[f"speed_{model}"] = speed(traces.t_s, simulated, windows)
    rows = pl.DataFrame(columns)
    return rows.with_columns(delay_s=pl.lit(0.0))
