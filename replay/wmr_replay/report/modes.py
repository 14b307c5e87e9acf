"""Contact modes over time: lanes, posterior bands, shading, and the colours of all of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import polars as pl

from wmr_replay.report.charts import Columns, Figure, Key, Read, Spec, band, blocks, numbers, over_time
from wmr_replay.report.decimate import COLUMNS, means, shares
from wmr_replay.timeline.colours import MODE_COLOURS, mode_name
from wmr_schemas.arrays import F64, I64
from wmr_schemas.modes import MODES, ContactMode

SHOWN = (*MODES, ContactMode.UNDECIDED)
COLOURS = {mode: "#{:02x}{:02x}{:02x}".format(*colour) for mode, colour in MODE_COLOURS.items()}
COLOURS[ContactMode.UNDECIDED] = "#b9bfc8"
"""On white paper a lighter grey than in the viewer."""
WORTH_SAYING = 0.01
POSTERIORS = tuple(f"p_{mode.label}" for mode in MODES)
MOST_SPANS = 1200
"""Spans of a lane that are drawn each; of more, every pixel column shows the shares of its modes."""
LANE, BAND, SPACE = 1.0, 2.6, 0.3
"""Heights of a lane and of a posterior, and the space below each."""
PIXELS = 21


@dataclass(frozen=True, eq=False)
class Lane:
    """A row of the figure: its name, times [s], and the mode at each, −2 where there is none."""

    name: str
    t_s: F64
    mode: I64


@dataclass(frozen=True, eq=False)
class Posterior:
    """A stacked band: its name, times [s], and the probabilities (n, 4), NaN where unknown."""

    name: str
    t_s: F64
    p: F64

    @property
    def modes(self) -> list[ContactMode]:
        """The modes that are ever worth a percent."""
        return [mode for k, mode in enumerate(MODES) if np.nanmax(self.p[:, k], initial=0) > WORTH_SAYING]


def modes_of(samples: pl.DataFrame, column: str = "mode") -> I64:
    """The modes as numbers, −2 where null."""
    found: I64 = samples[column].cast(pl.Int64).fill_null(-2).to_numpy()
    return found


def posterior_of(name: str, samples: pl.DataFrame) -> Posterior | None:
    """The posterior of a table; None where no row has one."""
    p = samples.select(POSTERIORS).fill_null(np.nan).to_numpy().astype(np.float64)
    known = np.isfinite(p).any(axis=1)
    if not known.any():
        return None
    p = np.where(known[:, None] & ~np.isfinite(p), 0.0, p)
    return Posterior(name, samples["t_s"].to_numpy(), p)


class Spans(NamedTuple):
    """Start, end and mode of each stretch of one mode, (m,)."""

    start_s: F64
    end_s: F64
    mode: I64


def spans_of(t_s: F64, mode: I64) -> Spans:
    """The stretches of one mode."""
    if not len(t_s):
        return Spans(t_s, t_s, mode)
    starts = np.flatnonzero(np.diff(mode, prepend=mode[0] - 1))
    return Spans(t_s[starts], np.append(t_s[starts[1:]], t_s[-1]), mode[starts])


def colour_of(mode: int) -> str:
    """The colour of a mode by number; white where there is none."""
    return COLOURS[ContactMode(mode)] if mode >= -1 else "#ffffff"


def name_of(mode: int) -> str:
    """The name of a mode by number."""
    return mode_name(ContactMode(mode)) if mode >= -1 else "unknown"


def shading(t_s: F64, mode: I64) -> Columns:
    """Spans in which the robot is said to skid, slip or both, as columns ``t, t2, c``.

    Of very many only the longest are shaded; the lanes show all of them.
    """
    start_s, end_s, said = spans_of(t_s, mode)
    chosen = np.flatnonzero(said > ContactMode.IDEAL)
    longest = chosen[np.argsort(start_s[chosen] - end_s[chosen], kind="stable")[:MOST_SPANS]]
    shown = np.sort(longest)
    return {
        "t": np.round(start_s[shown], 3).tolist(),
        "t2": np.round(end_s[shown], 3).tolist(),
        "c": [colour_of(m) for m in said[shown].tolist()],
    }


def lane_rows(lane: Lane, top: float, row: int) -> list[tuple[float, float, float, float, str, int, str]]:
    """Rectangles of a lane: from, to, top, bottom, colour, row of the figure, name of the mode.

    Where there are more spans than pixels, a column holds the shares of its modes one above the other.
    """
    spans = spans_of(lane.t_s, lane.mode)
    if len(spans.mode) <= MOST_SPANS:
        each = zip(*(column.tolist() for column in spans), strict=True)
        return [(a, b, top, top - LANE, colour_of(m), row, name_of(m)) for a, b, m in each if m >= -1]
    codes = [int(mode) for mode in SHOWN]
    edges, part = shares(lane.t_s, lane.mode, codes)
    reach = np.cumsum(part, axis=1)
    out = []
    starts = np.flatnonzero(np.append(True, np.any(np.diff(part, axis=0) != 0, axis=1)))
    for a, b in zip(starts, [*starts[1:], COLUMNS], strict=True):
        for k, code in enumerate(codes):
            if part[a, k] > 0:
                high, low = top - LANE * (reach[a, k] - part[a, k]), top - LANE * reach[a, k]
                out.append((edges[a], edges[b], high, low, colour_of(code), row, name_of(code)))
    return out


def band_columns(posterior: Posterior, top: float) -> Columns:
    """The edges between the stacked probabilities, in the figure's heights, the first mode at the top."""
    t_s, p = means(posterior.t_s, posterior.p)
    edges = top - BAND * np.clip(np.cumsum(np.column_stack([np.zeros(len(p)), p]), axis=1), 0, 1)
    columns = {"t": numbers(t_s)} | {f"y{k}": numbers(edges[:, k]) for k in range(len(MODES) + 1)}
    return columns | {POSTERIORS[k]: numbers(p[:, k]) for k in range(len(MODES))}


def mode_figure(
    lanes: Sequence[Lane], posteriors: Sequence[Posterior | None], span_s: tuple[float, float]
) -> Figure:
    """Lanes one below the other, and the posterior bands below them, all over one axis of time."""
    bands = [one for one in posteriors if one is not None]
    whole = len(lanes) * (LANE + SPACE) + len(bands) * (BAND + SPACE)
    top, heights, layers, data, readout = whole, {}, [], {}, []
    rects: list[tuple[float, float, float, float, str, int, str]] = []
    for row, lane in enumerate(lanes):
        rects += lane_rows(lane, top, row)
        heights[round(top - LANE / 2, 3)] = lane.name
        readout.append(Read(lane.name, "lanes", "m", row))
        top -= LANE + SPACE
    data["lanes"] = dict(
        zip(("t", "t2", "y", "y2", "c", "r", "m"), map(list, zip(*rects, strict=True)), strict=True)
    )
    for name in ("t", "t2", "y", "y2"):
        data["lanes"][name] = [round(float(value), 3) for value in data["lanes"][name]]
    layers.append(blocks("lanes"))
    for k, one in enumerate(bands):
        name = f"posterior{k}"
        data[name] = band_columns(one, top)
        layers += posterior_layers(name)
        heights[round(top - BAND / 2, 3)] = one.name
        readout += [
            Read(f"{one.name} {mode_name(mode)}", name, p)
            for mode, p in zip(MODES, POSTERIORS, strict=True)
            if mode in one.modes
        ]
        top -= BAND + SPACE
    spec = over_time(
        layers,
        span_s,
        round(PIXELS * whole),
        data=list(data),
        readout=readout,
        domain=(SPACE, whole),
        rows=heights,
    )
    seen = {code for lane in lanes for code in np.unique(lane.mode).tolist()}
    seen |= {int(mode) for one in bands for mode in one.modes}
    key = [Key(COLOURS[mode], mode_name(mode)) for mode in SHOWN if int(mode) in seen]
    return Figure(
        "modes", "Contact mode" + (" and its probability (stacked)" if bands else ""), spec, data, key
    )


def posterior_layers(data: str) -> list[Spec]:
    """One area for each mode."""
    return [band(data, f"y{k + 1}", f"y{k}", COLOURS[mode], 0.85) for k, mode in enumerate(MODES)]
