"""Disagreement that no effect and no term explains: when, and where on the ground.

In time: velocities ahead, to the left and in yaw, constant or in proportion to speed, that act in an interval
alone. Placebo records have the same errors with random signs in cells of some seconds (the wild bootstrap of
Liu, 1988), so that a moment of slip, however large, is no disagreement: it has to keep its direction.

On the ground: cells in which the errors are larger than the driving there explains, in several visits.
Placebo records are the errors shifted in time along the path, which keeps the colour of both.
"""

from typing import NamedTuple

import numpy as np

from wmr_replay.gap.result.result import Interval, Region
from wmr_replay.gap.wheel_speed.candidates import absent, parameters_of
from wmr_replay.gap.wheel_speed.dictionary import terms_of
from wmr_replay.gap.wheel_speed.estimate import Fit, View, inverse
from wmr_replay.gap.wheel_speed.modes import LASTING
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, from_start
from wmr_replay.gap.wheel_speed.whereabouts import speeds_of
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.terms import COEFFICIENT

KINDS: tuple[tuple[str, int, int | None], ...] = (
    *(("ahead", 0, None), ("ahead", 0, 0), ("to the left", 1, None), ("to the left", 1, 0)),
    *(("in yaw", 2, None), ("in yaw", 2, 2)),
)
"""Direction in words, channel, and the speed to which the velocity is in proportion, if any."""
YAW = 2
"""The channel of the yaw rate."""


class Disagreement(NamedTuple):
    """What stands: intervals or regions with their shares, its placebo's p, and a sentence's part."""

    intervals: tuple[Interval, ...]
    regions: tuple[Region, ...]
    p_value: float
    text: str


def disagreement(problem: Problem, current: Fit) -> Disagreement | None:
    """The disagreement that exceeds the level of its placebo; None where none does."""
    own = problem.settings.disagreement
    if own.level <= 0 or problem.record.driven_by == "command" or not problem.record.anchored:
        return None
    found = [one for one in (in_time(problem, current), on_ground(problem, current)) if one is not None]
    standing = [one for one in found if one.p_value <= (own.level_in_time if one.intervals else own.level)]
    return min(standing, key=lambda one: one.p_value, default=None)


def in_time(problem: Problem, current: Fit) -> Disagreement | None:
    """The interval with the most unlikely velocity of its own."""
    own = problem.settings.disagreement
    view = View.of(problem, current.noises)
    white = view.rows(view.errors(current.values), nuisance(problem, view, current))
    project = inverse(white.columns.T @ white.columns) @ white.columns.T
    errors = white.errors - white.columns @ (project @ white.errors)
    cell, cell_s = cells(problem, own.cell_s, own.most_cells)
    n = int(cell.max()) + 1
    row_cell = np.tile(cell[problem.bins.table[problem.bins.inside]], 3)
    signs = np.random.default_rng(0).choice((-1.0, 1.0), (own.draws, n))
    best, chance = (0.0, 0, 0, 0, 0.0), np.zeros(own.draws)
    for number, kind in enumerate(KINDS):
        columns = view.rows(view.errors(current.values), view.white(pushes(problem, kind, cell))).columns
        columns = columns - white.columns @ (project @ columns)
        b, G = columns.T @ errors, columns.T @ columns
        scores = np.zeros((n, n))
        np.add.at(scores, row_cell, columns * errors[:, None])
        first, last = lengths(n, own.least_cells)
        square = np.maximum(over(G, first, last), 1e-9 * max(float(np.trace(G)), 1e-12))
        sums = sums_over(b[None], first, last)[0]
        gains = sums**2 / square
        k = int(np.argmax(gains))
        if gains[k] > best[0]:
            best = (float(gains[k]), number, int(first[k]), int(last[k]), float(sums[k] / square[k]))
        chance = np.maximum(chance, (sums_over(signs @ scores, first, last) ** 2 / square).max(axis=1))
    gain, number, begin, end, size = best
    if gain == 0.0:
        return None
    p = float((1 + (chance >= gain).sum()) / (1 + own.draws))
    begin_s, end_s = (float(problem.bins.t_s[0] + k * cell_s) for k in (begin, end))
    inside = (problem.bins.t_s >= begin_s) & (problem.bins.t_s < end_s)
    energy = problem.bins.flat(view.errors(current.values)) ** 2
    share = gain / max(float(np.nansum(energy[KINDS[number][1]][inside])), 1e-12)
    what, channel, factor = KINDS[number]
    if share < own.least_share or abs(size) < least_size(problem, KINDS[number]):
        return None
    unit = ("m/s" if channel < 2 else "rad/s") if factor is None else "of the speed"
    text = (
        f"from {begin_s:.0f} to {end_s:.0f} s it moves {what} by {size:.2g} {unit} more than the model says"
    )
    return Disagreement((Interval(begin_s, end_s, min(share, 1.0)),), (), p, text)


def least_size(problem: Problem, kind: tuple[str, int, int | None]) -> float:
    """The least velocity of a kind in an interval that is a disagreement. A share of the yaw rate is a track
    of the interval's own, and none where the calibration leaves as much open.
    """
    own, gates, (_, channel, factor) = problem.settings.disagreement, problem.settings.gates, kind
    if factor is None:
        return own.least_push
    if channel != YAW:
        return own.least_slip
    track_sd = problem.base_sd.get("effective_track", {}).get("ratio", 0.0)
    return max(own.least_slip, gates.calibration_sd * gates.between_logs * track_sd)


def nuisance(problem: Problem, view: View, current: Fit) -> F64:
    """Whitened columns of everything that acts all the time: effects and terms, in the model or not."""
    lasting = [one for name in LASTING for one in parameters_of(name) if name not in current.values]
    terms = [
        Parameter(n, COEFFICIENT) for n in terms_of(problem) if "*t" not in n and n not in current.values
    ]
    values = {**{one.effect: absent(one.effect) for one in (*lasting, *terms)}, **current.values}
    return view.columns(values, (*current.parameters, *lasting, *terms))


def cells(problem: Problem, cell_s: float, most: int) -> tuple[I64, float]:
    """Cell of each bin (n,) in time, and a cell's length in s."""
    t_s = problem.bins.t_s - problem.bins.t_s[0]
    length_s = max(cell_s, float(t_s[-1]) / most)
    return np.floor(t_s / length_s).astype(np.int64), length_s


def pushes(problem: Problem, kind: tuple[str, int, int | None], cell: I64) -> F64:
    """What a unit velocity of a kind in each cell adds to the path, in blocks (3, c, K, B)."""
    _, channel, factor = kind
    bins = problem.bins
    rate = np.ones(len(cell)) if factor is None else speeds_of(problem, {})[factor]
    inside = cell[None] == np.arange(int(cell.max()) + 1)[:, None]
    moved = bins.blocks(np.where(inside, rate * bins.step_s, 0.0))
    way = from_start(np.cumsum(moved, axis=-1), bins)
    out = np.zeros((3, *way.shape))
    out[channel] = way
    return out


def lengths(n: int, least: int) -> tuple[I64, I64]:
    """First and last + 1 cell of each interval of ``least`` cells to half of them."""
    first, last = np.triu_indices(n + 1, least)
    short = last - first <= max(n // 2, least)
    return first[short], last[short]


def over(G: F64, first: I64, last: I64) -> F64:
    """Sums of G (c, c) over the squares [first, last)."""
    table = np.zeros((len(G) + 1, len(G) + 1))
    table[1:, 1:] = np.cumsum(np.cumsum(G, axis=0), axis=1)
    return np.asarray(
        table[last, last] - table[first, last] - table[last, first] + table[first, first], np.float64
    )


def sums_over(b: F64, first: I64, last: I64) -> F64:
    """Sums of rows (d, c) over intervals [first, last)."""
    sums = np.concatenate([np.zeros((len(b), 1)), np.cumsum(b, axis=1)], axis=1)
    return np.asarray(sums[:, last] - sums[:, first])


def on_ground(problem: Problem, current: Fit) -> Disagreement | None:
    """The cell on the ground with errors that its driving does not explain, in several visits."""
    own, whole = problem.settings.disagreement, problem.with_slip
    view = View.of(whole, current.noises)
    errors = whole.bins.flat(np.clip(view.errors(current.values), -view.reject, view.reject))
    known = np.isfinite(errors[0])
    energy = (errors[:, known] ** 2).sum(axis=0)
    x_m, y_m = whole.bins.mean(whole.record.pose[:2])[:, known]
    t_s, n = whole.bins.t_s[known], len(energy)
    if n < own.least_bins:
        return None
    excess = beyond_driving(ranks(energy), speeds_of(whole, current.values)[:, known], whole.bins.step_s)
    best: tuple[float, Bool, float] | None = None
    shifts = np.arange(max(1, round(own.shift_s / whole.bins.step_s)), n - 1)
    shifts = shifts[:: max(1, len(shifts) // own.draws)]
    shifted = np.stack([np.roll(excess, int(s)) for s in shifts])
    chance = np.zeros(len(shifts))
    for inside in visited(x_m, y_m, t_s, own.region_m, own.least_visits):
        root = np.sqrt(inside.sum())
        score = float(excess[inside].sum() / root)
        chance = np.maximum(chance, shifted[:, inside].sum(axis=1) / root)
        if best is None or score > best[0]:
            best = (score, inside, float(energy[inside].sum() / energy.sum()))
    if best is None:
        return None
    score, inside, share = best
    if np.median(energy[inside]) < own.least_louder * np.median(energy[~inside]):
        return None
    p = float((1 + (chance >= score).sum()) / (1 + len(shifts)))
    x, y = float(np.mean(x_m[inside])), float(np.mean(y_m[inside]))
    text = f"around ({x:.1f}, {y:.1f}) m on the ground it moves unlike the model on every visit"
    return Disagreement((), (Region(x, y, own.region_m / 2, share),), p, text)


def ranks(values: F64) -> F64:
    """Ranks (n,) from −1 to 1."""
    order = np.argsort(np.argsort(values))
    return np.asarray(2 * (order + 0.5) / len(values) - 1)


def beyond_driving(rank: F64, speeds: F64, step_s: float) -> F64:
    """Ranks (n,) less what speed, turning and acceleration explain of them."""
    v, w = np.abs(speeds[0]), np.abs(speeds[2])
    a = np.abs(np.gradient(speeds[0], step_s))
    turn = np.abs(np.gradient(speeds[2], step_s))
    X = np.column_stack([np.ones_like(v), v, w, a, turn, v**2, w**2, v * w, np.sqrt(a), np.sqrt(turn)])
    return np.asarray(rank - X @ np.linalg.lstsq(X, rank, rcond=None)[0])


def visited(x_m: F64, y_m: F64, t_s: F64, side_m: float, least: int) -> list[Bool]:
    """Bins (n,) in each square of half-overlapping sides that the path visits several times."""
    found = []
    for shift_x in (0.0, side_m / 2):
        for shift_y in (0.0, side_m / 2):
            place = np.floor(np.column_stack([x_m + shift_x, y_m + shift_y]) / side_m).astype(np.int64)
            _, number = np.unique(place, axis=0, return_inverse=True)
            number = number.ravel()
            for k in range(int(number.max()) + 1):
                inside = number == k
                if (np.diff(t_s[inside]) > 2.0).sum() + 1 >= least and inside.sum() >= 3 * least:
                    found.append(inside)
    return found
