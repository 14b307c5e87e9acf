"""Where, when or towards what heading a found term may act: it times any function of one of them.

The dictionary carries what an engineer would list by place and time; what is found may be another product.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.formula.bells import bells_of, circles_of, wide_bells_of
from wmr_replay.gap.formula.families import Family
from wmr_replay.gap.formula.grids import (
    Grid,
    directions,
    edges_of,
    grid_of,
    lines_of,
    numbers_of_waves,
    saws_of,
)
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.terms import Term

PLANE = ("x", "y")


def placements_of(problem: Problem, terms: Sequence[Term]) -> Iterator[Grid]:
    """Terms of one channel, all of them times one function of the plane, the heading or the time, of those
    that they do not read; what a function leaves where it is 0 stands beside it as the terms themselves.
    """
    columns, own = columns_of(problem.binned), problem.settings.formula
    read = {column for term in terms for column in term.columns}
    carriers = tuple(tuple(factor for factor in term.factors if factor != "1") for term in terms)
    family = Family("", terms[0].channel, "", carriers, plain=True)
    if not read & {*PLANE}:
        yield from over_plane(problem, family, columns, own)
    if "yaw" not in read:
        yield grid_of((replace(family, kind="wave", along="yaw"), np.array(own.turns)[:, None]))
    if "t" not in read:
        yield from over_time(family, columns, own)


def over_plane(
    problem: Problem, family: Family, columns: dict[str, F64], own: FormulaSettings
) -> Iterator[Grid]:
    """Edges, waves, bells and what lies along a line."""
    around = float(np.mean(columns["x"])), float(np.mean(columns["y"]))
    spans = {z: float(np.ptp(columns[z])) for z in PLANE}
    for z in PLANE:
        edge = replace(family, kind="edge", along=z)
        yield grid_of((edge, edges_of(columns[z], own.edge_widths, own)))
        yield grid_of((replace(edge, kind="band"), edges_of(columns[z], own.strip_widths, own)))
        lengths = own.least_length_m, own.longest_in_spans * spans[z]
        yield grid_of((replace(edge, kind="wave"), numbers_of_waves(spans[z], *lengths, own)))
    line = replace(family, along="xy", around=around)
    yield grid_of((replace(line, kind="side"), lines_of(columns, around, own.edge_widths, own)))
    yield grid_of((replace(line, kind="strip"), lines_of(columns, around, own.strip_widths, own)))
    yield grid_of((replace(line, kind="wave"), directions(spans, own)))
    yield grid_of((replace(family, kind="disc"), bells_of("disc", problem.binned, own)))
    yield grid_of((replace(family, kind="bump"), wide_bells_of(problem.binned, own, own.wide_shares)))
    yield grid_of((replace(family, kind="away"), wide_bells_of(problem.binned, own, own.away_shares)))
    yield grid_of((replace(family, kind="circle"), circles_of(problem.binned, own)))


def over_time(family: Family, columns: dict[str, F64], own: FormulaSettings) -> Iterator[Grid]:
    """Waves, and what comes, goes or is switched over."""
    span_s = float(np.ptp(columns["t"]))
    periods = numbers_of_waves(span_s, own.least_period_s, own.longest_in_spans * span_s, own)
    yield grid_of((replace(family, kind="wave", along="t"), periods))
    yield grid_of((replace(family, kind="edge", along="t"), edges_of(columns["t"], own.edge_widths, own)))
    decays = span_s * np.array(own.decay_spans)[:, None]
    yield grid_of((replace(family, kind="decay", along="t"), decays))
    yield grid_of((replace(family, kind="saw", along="t"), saws_of(columns["t"], own)))
