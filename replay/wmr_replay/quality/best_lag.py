"""The lag that costs least, its standard deviation, and how far it stands out among the others."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import F64, Bool

NEAR = 6
"""Lags so near to the best belong to the same minimum."""


@dataclass(frozen=True)
class BestLag:
    """``lag`` and ``sd`` in steps. ``excess``: by how many standard errors every other lag costs more."""

    lag: float
    sd: float
    excess: float


def best_lag(costs: F64, known: Bool) -> BestLag | None:
    """From costs (1 + g, lags) of a log and of the log without each group, of which ``known`` (g,) hold any
    block. None where the log, or the log without one of its groups, has its minimum at an end.
    """
    whole, without = costs[0], costs[1:][known]
    lags = [vertex(curve) for curve in (whole, *without)]
    found = [lag for lag in lags if lag is not None]
    if len(found) < len(lags):
        return None
    sd = float(np.std(found[1:]) * np.sqrt(len(without) - 1))
    return BestLag(found[0], sd, excess(whole, whole - without))


def vertex(costs: F64) -> float | None:
    """The minimum in steps from the middle lag, by the parabola through its three lags; None at an end."""
    best = int(np.argmin(costs))
    if not 0 < best < len(costs) - 1:
        return None
    before, at, after = costs[best - 1 : best + 2].tolist()
    bend = before - 2 * at + after
    return best - len(costs) // 2 + ((before - after) / (2 * bend) if bend > 0 else 0.0)


def excess(whole: F64, groups: F64) -> float:
    """How much more the least of the other lags costs than the best, in standard errors over the groups."""
    best = int(np.argmin(whole))
    others = np.abs(np.arange(len(whole)) - best) > NEAR
    more = (groups - groups[:, best : best + 1])[:, others]
    error = more.std(axis=0, ddof=1) / np.sqrt(len(groups))
    return float((more.mean(axis=0) / np.maximum(error, np.finfo(float).tiny)).min())
