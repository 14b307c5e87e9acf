"""Of the page of a gap analysis: what the extended model leaves, and how both models do on another log."""

import shlex

import msgspec
import polars as pl

from wmr_replay.report import charts, page
from wmr_replay.report import gap_figures as figures
from wmr_schemas.gap_file import GapFile, Proof, Remains, Where
from wmr_schemas.text import figure

NOWHERE = Where({}, (), (), {})


def designing(pair: str) -> str:
    """The command that designs a drive for a pair of effects, quoted for a shell."""
    return f"wmr-replay excite --separate {shlex.quote(pair)}"


def still_left(left: Remains) -> str:
    """What the extended model leaves, in a sentence or two."""
    over = left.position_over_floor
    times = f"The held-out gap in position is {figure(over, 2)} times that of noise alone. "
    said = "" if over is None else times
    if not left.blocks:
        return said + "No stretch stands out: none errs three times as much as the median one."
    stretches = ", ".join(
        f"{one.start_s:.0f} to {one.end_s:.0f} s ({figure(1e3 * (one.position_rms_m or 0.0), 3)} mm)"
        for one in left.blocks
    )
    return said + f"These stretches err more than three times as much as the median one: {stretches}."


def lead(proof: Proof) -> str:
    """What was done on the other log."""
    left_out = f" Left out: {', '.join(proof.left_out)}." if proof.left_out else ""
    return (
        f"{proof.log}: nothing was fitted to it. Both models simulate it in windows of {proof.gap.seconds} s "
        f"under the same contact modes.{left_out}"
    )


def add_figures(sheet: page.Page, gap: GapFile, proof: Proof, traces: pl.DataFrame) -> None:
    """The other log's path by the error of either model, and both errors over time."""
    unmarked = msgspec.structs.replace(gap, where=NOWHERE)
    paths = [one for one in figures.path_figures(unmarked, traces) if one is not None]
    sheet.figures(*[[charts.renamed(one, "elsewhere")] for one in paths])
    unfitted = traces.with_columns(held_out=False)  # all of it: nothing to shade
    error = figures.error_figure(unfitted, extended=bool(gap.effects), seconds=proof.gap.seconds)
    sheet.figures([charts.renamed(error, "elsewhere")])
