"""Where and when traction is lost: intervals of time and discs on the ground, scanned cell by cell."""

import numpy as np
from scipy.optimize import minimize

from wmr_replay.gap.wheel_speed.estimate import Fit, View
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, from_start
from wmr_schemas.arrays import F64, Bool

MOST_CELLS = 120
LEAST_RADIUS_M = 0.1
SIMPLEX = {"start_s": 0.7, "end_s": -0.7, "x_m": 0.25, "y_m": 0.25, "radius_m": 0.15, "loss": -0.1}
"""First steps of the simplex."""
RADII_M = (0.4, 0.6, 0.8, 1.0, 1.3)
Found = tuple[float, dict[str, float]]
"""Gain, and the parameters at which it is reached."""


def lost(problem: Problem, current: Fit, inside: Bool) -> F64:
    """What a loss of 1 in some bins (c, n) takes from the predicted path, in blocks (3, c, K, B)."""
    bins = problem.bins
    path = bins.blocks(problem.predicted(current.values))
    step = np.diff(path, axis=-1, prepend=path[..., :1])
    step = np.where(bins.inside, step, 0.0)
    step[..., 0] = 0.0
    share = np.where(bins.inside, inside[:, np.maximum(bins.table, 0)], False)
    return from_start(-np.cumsum(step[:, None] * share[None], axis=-1), bins)


def products(problem: Problem, current: Fit, inside: Bool) -> tuple[F64, F64]:
    """Σ column·error (c,) and Σ column·column (c, c) of a loss in some bins (c, n), unclipped."""
    view = View.of(problem, current.noises, robustly=False)
    rows = view.rows(view.errors(current.values), view.white(lost(problem, current, inside)))
    return rows.columns.T @ rows.errors, rows.columns.T @ rows.columns


def scan_intervals(problem: Problem, current: Fit) -> Found:
    """The interval whose loss of traction explains most."""
    t_s = problem.bins.t_s
    cell_s = max(1.0, float(np.ptp(t_s)) / MOST_CELLS)
    cell = np.floor((t_s - t_s[0]) / cell_s).astype(np.int64)
    n = int(cell.max()) + 1
    b, G = products(problem, current, cell[None] == np.arange(n)[:, None])
    sums = np.concatenate([[0.0], np.cumsum(b)])
    table = np.zeros((n + 1, n + 1))
    table[1:, 1:] = np.cumsum(np.cumsum(G, axis=0), axis=1)
    first, last = np.triu_indices(n + 1, 1)
    square = table[last, last] - table[first, last] - table[last, first] + table[first, first]
    total = sums[last] - sums[first]
    loss = np.clip(total / np.maximum(square, 1e-12), 0.0, 0.95)
    gain = 2 * loss * total - loss**2 * square
    gain[(last - first) * cell_s > 0.5 * n * cell_s] = 0.0
    best = int(np.argmax(gain))
    begin = float(t_s[0] + first[best] * cell_s)
    return float(gain[best]), {
        "start_s": begin,
        "end_s": float(t_s[0] + last[best] * cell_s),
        "loss": float(loss[best]),
    }


def scan_discs(problem: Problem, current: Fit) -> Found:
    """The disc in which a loss of traction explains most."""
    x_m, y_m = problem.bins.mean(problem.record.pose[:2])
    side_m = max(0.5, float(np.sqrt(np.ptp(x_m) * np.ptp(y_m) / MOST_CELLS)) / 2)
    centres = np.unique(np.round(np.column_stack([x_m, y_m]) / side_m), axis=0) * side_m
    best: Found = (0.0, {"x_m": 0.0, "y_m": 0.0, "radius_m": RADII_M[0], "loss": 0.0})
    for part in np.array_split(centres, max(1, len(centres) // 64)):
        for radius_m in RADII_M:
            inside = np.hypot(x_m - part[:, :1], y_m - part[:, 1:]) < radius_m
            b, G = products(problem, current, inside)
            square = np.diag(G)
            loss = np.clip(b / np.maximum(square, 1e-12), 0.0, 0.95)
            gain = 2 * loss * b - loss**2 * square
            gain[inside.mean(axis=1) > 0.5] = 0.0
            k = int(np.argmax(gain))
            if gain[k] > best[0]:
                where = {"x_m": float(part[k, 0]), "y_m": float(part[k, 1]), "radius_m": radius_m}
                best = (float(gain[k]), {**where, "loss": float(loss[k])})
    return best


def refined(problem: Problem, current: Fit, name: str, start: dict[str, float]) -> dict[str, float]:
    """The interval or disc and its loss of the highest likelihood near a start, by a simplex."""
    view, keys = View.of(problem, current.noises), list(start)
    at = np.array([start[key] for key in keys])
    steps = np.array([SIMPLEX[key] for key in keys])

    def objective(x: F64) -> float:
        place = dict(zip(keys, x.tolist(), strict=True))
        if not 0 <= place["loss"] < 1 or place.get("radius_m", 1.0) < LEAST_RADIUS_M:
            return 1e12
        return view.deviance(view.errors({**current.values, name: place}))

    found = minimize(
        objective,
        at,
        method="Nelder-Mead",
        options={
            "initial_simplex": np.vstack([at, at + np.diag(steps)]),
            "maxfev": 120,
            "fatol": 1.0,
            "xatol": 0.01,
        },
    )
    bounds = {key: Parameter(name, key).bounds for key in keys}
    return {key: float(np.clip(x, *bounds[key])) for key, x in zip(keys, found.x, strict=True)}
