"""Where and when traction is lost: intervals of time and discs on the ground.

A loss λ of both wheels turns a motion p, which the model predicts, into (1 − λ)·p. Every bin whose motion m
is nearer to that than to p speaks for it, and one that is nearer to p against it:

    gain_i(λ) = Σ_c min(((m − p)/sd)², K²) − min(((m − (1 − λ)p)/sd)², K²)        c: ahead, yaw

One wheel alone takes λ of its own share of p: half of its speed s ahead, and ±s/2l in yaw.

The sum over an interval or a disc is large where one loss explains all of it. A wheel that spins, whose loss
changes, adds little, as each bin counts K² at most. Rates are taken over two bins.
"""

from collections.abc import Mapping

import numpy as np
from scipy.optimize import minimize

from wmr_replay.gap.settings.wheel_speed import GateSettingsWheelSpeed
from wmr_replay.gap.wheel_speed.bins import Bins
from wmr_replay.gap.wheel_speed.drive import Values
from wmr_replay.gap.wheel_speed.estimate import Fit, View
from wmr_replay.gap.wheel_speed.modes import differences, spread
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, summed
from wmr_schemas.arrays import F64, Bool

LOSSES = np.arange(0.15, 0.95, 0.05)
"""Losses that are tried."""
MOST_CELLS = 120
LEAST_RADIUS_M = 0.1
SIMPLEX = {"start_s": 0.7, "end_s": -0.7, "x_m": 0.25, "y_m": 0.25, "radius_m": 0.15, "loss": -0.1}
"""First steps of the simplex."""
RADII_M = (0.4, 0.6, 0.8, 1.0, 1.3)
STARTS = 3
"""Times or places whose likelihood is computed; the best is refined."""
MOST = 4.0
"""K: standard deviations beyond which a bin's error counts no more."""
FORM_SHARE = 0.05
"""Share of a speed by which a constant loss may miss it: elastic slip, an edge that is not sharp."""
LEAST_SD = 0.02
"""Least standard deviation of a rate in m/s or rad/s. Judgement: encoders and floors do as much."""
ALIKE_SD = 2.5
"""Standard deviations within which a bin moves as with the common loss."""
EASE = 0.5
"""Share of what a loss must pass that is asked of a first guess."""
AHEAD_YAW = [0, 2]
BOTH = "both"
SIDES = (BOTH, "left", "right")
Start = dict[str, float]


class Rates:
    """Measured and predicted rates (3, n) ahead, left and in yaw by bin, and the sd of their difference."""

    def __init__(self, problem: Problem, values: Values) -> None:
        whole = problem.with_slip
        self.step_s = problem.bins.step_s
        self.measured = slopes(whole.bins, whole.measured)
        self.predicted = slopes(whole.bins, whole.predicted(values))
        usual = spread(differences(problem, problem.measured - problem.predicted(values)))
        self.sd = np.sqrt(usual**2 + LEAST_SD**2 + (FORM_SHARE * self.predicted) ** 2)
        track = summed(problem.base, values).get("effective_track", {}).get("ratio", 0.0)
        self.half_track_m = whole.chassis.half_track_m * (1 + track)

    def gains(self, side: str = BOTH) -> F64:
        """Gain (λ, n) of every loss of a side in every bin; 0 where the rates are unknown."""
        m, p, sd = (part[AHEAD_YAW] for part in (self.measured, self.predicted, self.sd))
        lost = LOSSES[:, None, None] * self.carried_by(side)
        before = np.minimum(((m - p) / sd) ** 2, MOST**2)
        after = np.minimum(((m - p + lost) / sd) ** 2, MOST**2)
        return np.asarray(np.nan_to_num(before - after).sum(axis=1))

    def carried_by(self, side: str) -> F64:
        """What of the predicted rates (2, n) ahead and in yaw goes by both wheels, the left or the right."""
        ahead, yaw = self.predicted[AHEAD_YAW]
        if side == BOTH:
            return np.stack([ahead, yaw])
        sign = 1.0 if side == "right" else -1.0
        half = (ahead + sign * self.half_track_m * yaw) / 2
        return np.stack([half, sign * half / self.half_track_m])

    def lost_share(self, inside: Bool, side: str) -> float:
        """The loss of a side in the bins ``inside`` (n,) by least squares, ahead and in yaw, within its
        bounds: Σ (p − m)·q/sd² / Σ q²/sd², q what goes by that side.
        """
        m, p, sd = (part[AHEAD_YAW][:, inside] for part in (self.measured, self.predicted, self.sd))
        q = self.carried_by(side)[:, inside]
        share = float(np.sum((p - m) * q / sd**2) / np.sum(q**2 / sd**2))
        return float(np.clip(share, *Parameter("slip_interval", "loss").bounds))

    def steadiness(self, inside: Bool, loss: float, own: GateSettingsWheelSpeed) -> tuple[float, float]:
        """Of the bins ``inside`` (n,) that would show a loss of their own: how long [s] they move as with the
        common one, in each channel, and which share of them does.
        """
        information = (self.predicted[AHEAD_YAW] ** 2 / self.sd[AHEAD_YAW] ** 2).sum(axis=0)
        shown = inside & (np.nan_to_num(information) > own.most_loss_sd_of_bin**-2)
        left = np.abs(self.measured - (1 - loss) * self.predicted) / self.sd
        alike = np.all(left < ALIKE_SD, axis=0)
        return float((shown & alike).sum()) * self.step_s, float((shown & alike).sum() / max(shown.sum(), 1))

    def steady(self, inside: Bool, loss: float, own: GateSettingsWheelSpeed, ease: float = 1.0) -> bool:
        """Whether a loss is the same all through the bins ``inside`` (n,). That of a wheel which spins, a
        contact mode and no effect, grows and fades, and the robot skids. ``ease`` below 1 asks for less.
        """
        seconds, share = self.steadiness(inside, loss, own)
        long, alike = seconds >= ease * own.least_steady_s, share >= ease * own.least_steady_share
        return long and alike and loss >= own.least_loss


def slopes(bins: Bins, path: F64) -> F64:
    """Central differences (3, n) within stretches over two bins, across the ends of blocks."""
    out = np.full_like(path, np.nan)
    out[:, 1:-1] = (path[:, 2:] - path[:, :-2]) / (bins.t_s[2:] - bins.t_s[:-2])
    same = np.zeros(path.shape[1], bool)
    same[1:-1] = (bins.stretch[2:] == bins.stretch[:-2]) & (bins.t_s[2:] - bins.t_s[:-2] < 3 * bins.step_s)
    return np.where(same, out, np.nan)


def intervals(problem: Problem, gains: F64) -> list[Start]:
    """The intervals of the largest sums of ``gains`` (λ, n), one for each loss; none overlaps another."""
    t_s, half_s = problem.bins.t_s, problem.bins.step_s / 2
    longest = len(t_s) // 2
    found = []
    for loss, gain in zip(LOSSES, gains, strict=True):
        total = np.concatenate([[0.0], np.cumsum(gain)])
        least = np.minimum.accumulate(total)
        last = int(np.argmax(total - least))
        first = int(np.argmin(total[: last + 1]))
        if last > first and last - first <= longest:
            found.append((float(total[last] - total[first]), first, last, float(loss)))
    kept: list[tuple[int, int, float]] = []
    for _, first, last, loss in sorted(found, reverse=True):
        if all(last <= other[0] or first >= other[1] for other in kept):
            kept.append((first, last, loss))
    return [
        {"start_s": float(t_s[a] - half_s), "end_s": float(t_s[b - 1] + half_s), "loss": loss}
        for a, b, loss in kept[:STARTS]
    ]


def discs(problem: Problem, gains: F64) -> list[Start]:
    """The discs of the largest sums of ``gains`` (λ, n), none whose centre lies in another."""
    x_m, y_m = problem.bins.mean(problem.record.pose[:2])
    side_m = max(0.4, float(np.sqrt(np.ptp(x_m) * np.ptp(y_m) / MOST_CELLS)) / 4)
    centres = np.unique(np.round(np.column_stack([x_m, y_m]) / side_m), axis=0) * side_m
    away_m = np.hypot(x_m - centres[:, :1], y_m - centres[:, 1:])
    found = []
    for radius_m in RADII_M:
        inside = away_m < radius_m
        sums = inside.astype(np.float64) @ gains.T
        sums[inside.mean(axis=1) > 0.5] = 0.0
        best = sums.argmax(axis=1)
        found += [
            (float(sums[c, k]), float(centres[c, 0]), float(centres[c, 1]), radius_m, float(LOSSES[k]))
            for c, k in enumerate(best)
            if sums[c, k] > 0
        ]
    kept: list[tuple[float, float, float, float]] = []
    for _, *one in sorted(found, reverse=True):
        x, y, radius_m, loss = one
        if all(np.hypot(x - other[0], y - other[1]) > other[2] for other in kept):
            kept.append((x, y, radius_m, loss))
        if len(kept) == STARTS:
            break
    return [dict(zip(("x_m", "y_m", "radius_m", "loss"), one, strict=True)) for one in kept]


def likeliest(problem: Problem, current: Fit, name: str) -> Start | None:
    """The interval or disc and its loss of the highest likelihood; None where no loss is steady."""
    view, rates = View.of(problem.with_slip, current.noises), Rates(problem, current.values)
    gains = rates.gains()
    starts = intervals(problem, gains) if name == "slip_interval" else discs(problem, gains)

    def cost(place: Start) -> float:
        return view.deviance(view.errors({**current.values, name: place}))

    own = problem.settings.gates
    likely = [one for one in starts if rates.steady(inside_of(problem, one, name), one["loss"], own, EASE)]
    if not likely:
        return None
    once = refined(view, current, name, min(likely, key=cost))
    return refined(view, current, name, once)


def refined(view: View, current: Fit, name: str, start: Start) -> Start:
    """The interval or disc and its loss of the highest likelihood near a start, by a simplex."""
    keys = list(start)
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


def inside_of(problem: Problem, place: Mapping[str, float], name: str) -> Bool:
    """Bins (n,) in an interval or a disc."""
    if name == "slip_interval":
        t_s = problem.bins.t_s
        return np.asarray((t_s > place["start_s"]) & (t_s < place["end_s"]))
    x_m, y_m = problem.bins.mean(problem.record.pose[:2])
    return np.asarray(np.hypot(x_m - place["x_m"], y_m - place["y_m"]) < place["radius_m"])
