"""How far the time or place of an effect may be moved before the log tells.

Where a robot stands, or gives no torque, the log does not say when a load came or traction was lost, and the
likelihood is flat: its curvature says nothing of how wide the flat part is. Where the wheels slip as the
model knows it, a loss of traction tells no more: it may begin before such a slip, and end after it.
"""

from collections.abc import Mapping

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import is_place
from wmr_replay.gap.search.starts import shifted
from wmr_schemas.arrays import F64

CIRCLE = ("x_m", "y_m", "radius_m")


def reach(problem: Problem, fit: Fit, name: str, key: str) -> tuple[float, float]:
    """The furthest values of a time or place of the model ``fit`` at which −2 log likelihood is higher by no
    more than ``ReportSettings.flat``, everything else as it is; in steps of what an edge's form leaves open.
    Between them it may be higher by up to ``ReportSettings.bump``.
    """
    own = problem.settings.report
    step = own.edge_sd_s if key.endswith("_s") else own.edge_sd_m
    least = problem.deviance(fit.extension, fit.noise)
    ends = []
    for by in (-step, step):
        extension, furthest_value = fit.extension, fit.extension.effects[name][key]
        for _ in range(own.most_steps):
            further = shifted(extension, name, key, by)
            value = further.effects[name][key]
            rise = problem.deviance(further, fit.noise) - least
            if value == extension.effects[name][key] or rise > own.bump:
                break
            extension = further
            furthest_value = value if rise <= own.flat else furthest_value
        ends.append(furthest_value)
    return ends[0], ends[1]


def place_covariance(fit: Fit, binned: BinnedLog) -> F64:
    """What the unknown form of edges adds to the covariance (q, q) of the fitted parameters.

    A time has the variance of its edge. A patch, a circle of centre c and radius r, is known by the places p
    where the path crosses its edge, each up to its form's standard deviation σ along the outward normal n:

        n·δc + δr = ε,    ε ~ N(0, σ²)

    Two crossings leave one direction open: the same stretch of the path lies in small circles and large ones.
    So the covariance is (Σaaᵀ/σ² + I/s²)⁻¹ with a = (n, 1), and s the extent of the path.
    """
    own, V = binned.settings.report, np.zeros((len(fit.keys), len(fit.keys)))
    for j, (name, key) in enumerate(fit.keys):
        if is_place(name, key) and key.endswith("_s"):
            V[j, j] = own.edge_sd_s**2
    for name, values in fit.extension.effects.items():
        if values.keys() >= {*CIRCLE}:
            columns = [fit.keys.index((name, key)) for key in CIRCLE]
            V[np.ix_(columns, columns)] = circle_covariance(binned, values, own.edge_sd_m)
    return V


def circle_covariance(binned: BinnedLog, circle: Mapping[str, float], sd_m: float) -> F64:
    """The covariance (3, 3) of centre and radius, from where the path crosses the circle."""
    angle = crossings(binned, circle, sd_m)
    a = np.column_stack([np.cos(angle), np.sin(angle), np.ones(len(angle))])
    extent_m = max(float(np.hypot(*np.ptp(binned.pose[:, :2], axis=0))), sd_m)
    return np.asarray(np.linalg.inv(a.T @ a / sd_m**2 + np.eye(len(CIRCLE)) / extent_m**2))


def crossings(binned: BinnedLog, circle: Mapping[str, float], sd_m: float) -> F64:
    """The directions from the centre, in rad, in which the path crosses the edge, 2σ apart or more: nearer to
    one another the edge has one form, however often it is crossed there.
    """
    across, along = binned.pose[:, 0] - circle["x_m"], binned.pose[:, 1] - circle["y_m"]
    crosses = np.flatnonzero(np.diff(np.hypot(across, along) < circle["radius_m"]))
    apart, kept = 2 * sd_m / circle["radius_m"], list[float]()
    for angle in np.sort(np.arctan2(along, across)[crosses]).tolist():
        from_last, from_first = (angle - kept[-1], kept[0] + 2 * np.pi - angle) if kept else (np.inf, np.inf)
        if min(from_last, from_first) >= apart:
            kept.append(angle)
    return np.array(kept)


def crossed_once(binned: BinnedLog, fit: Fit) -> tuple[str, ...]:
    """A note for each patch of the model ``fit`` of whose edge the path crosses two places alone."""
    notes = []
    for name, circle in fit.extension.effects.items():
        if not circle.keys() >= {*CIRCLE}:
            continue
        angle = crossings(binned, circle, binned.settings.report.edge_sd_m)
        if len(angle) <= 2:
            x_m = circle["x_m"] + circle["radius_m"] * np.cos(angle)
            y_m = circle["y_m"] + circle["radius_m"] * np.sin(angle)
            ends = " and ".join(f"({x:.1f}, {y:.1f}) m" for x, y in zip(x_m, y_m, strict=True))
            notes.append(
                f"the path crosses the edge of the {name} at {ends} alone: all circles through these places, "
                "small ones and large ones beside the path, look alike"
            )
    return tuple(notes)


def over_slips(binned: BinnedLog, ends: tuple[float, float], hole_s: float) -> tuple[float, float]:
    """The ends of an interval of when traction was lost or came back, moved over the slips that adjoin them;
    holes between slips of up to ``hole_s`` are of them.
    """
    t_s = binned.t_s[binned.slips]
    return -furthest(-ends[0], -t_s[::-1], hole_s), furthest(ends[1], t_s, hole_s)


def furthest(end_s: float, t_s: F64, hole_s: float) -> float:
    """How far the times (n,), which rise, go on from ``end_s`` without a hole of more than ``hole_s``."""
    chain = np.concatenate([[end_s], t_s[t_s > end_s]])
    holes = np.flatnonzero(np.diff(chain) > hole_s)
    return float(chain[holes[0] if len(holes) else -1])
