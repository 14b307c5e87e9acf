"""A loss of traction that measured wheel speeds show, of a calibrated robot.

A wheel that spins loses no constant share of its motion: no loss of one size holds on what was not fitted.
But a robot that rolled on its calibration logs, and of which both wheels here lose motion for a while, or one
of them, lost traction. Every bin has a loss of its own, of those that are tried; where they are far likelier
together than rolling, that is the finding, in the time of the likeliest slip, or in the place of several.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from wmr_replay.gap.wheel_speed.candidates import PATCH, PLACES, SLIP
from wmr_replay.gap.wheel_speed.estimate import Fit, at, inverse
from wmr_replay.gap.wheel_speed.places import (
    AHEAD_YAW,
    BOTH,
    LOSSES,
    SIDES,
    Rates,
    Start,
    inside_of,
    slopes,
)
from wmr_replay.gap.wheel_speed.predict import DECLARED, Parameter, Problem
from wmr_replay.gap.wheel_speed.select import Named, Selection, Tried, price
from wmr_replay.gap.wheel_speed.usual_slip import beside, runs
from wmr_schemas.arrays import Bool

SAID = 5
"""Slips that are said each. Presentation."""
LEAST_WAY_M = 0.01
"""Least standard deviation of a place, that of a good pose."""


class Slip(NamedTuple):
    """Bins (n,) in which the robot slips, by how much that is likelier than rolling, in −2 log likelihood,
    and the share of the motion of both wheels or of one that is lost, with its standard deviation from bin to
    bin.
    """

    inside: Bool
    gain: float
    loss: float
    loss_sd: float
    side: str = BOTH


def with_loss(selection: Selection, slips: list[Slip], whole: Problem) -> Selection:
    """The selection with the loss of traction of the likeliest of ``slips`` and those near it, on the
    ``whole`` record; the same of none.

    The loss stands as it is: steps of a fit would follow how it grows and fades.
    """
    if not slips:
        return selection
    fit, there = selection.fit, [one for one in slips if is_near(whole, one, slips[0])]
    name, place = as_effect(whole, there)
    size, gain = tuple(Parameter(name, key) for key in place), sum(one.gain for one in there)
    p = p_of(there, len(slips))
    loose = at(whole, (*fit.parameters, *size), {**fit.values, name: place}, fit.noises)
    tried = Tried(len(selection.found), name, gain, gain - price(whole, len(size)), p)
    return replace(
        selection,
        problem=whole,
        base=at(whole, (), {}, selection.base.noises),
        fit=known_to_a_bin(loose, whole, there),
        found=(*selection.found, Named(name, p)),
        tried=(*(one for one in selection.tried if one.name != name), tried),
    )


def known_to_a_bin(fit: Fit, whole: Problem, slips: list[Slip]) -> Fit:
    """The fit with the standard deviations of a loss of traction that was seen: begin and end are known to a
    bin, a place to the way in a bin, the loss as it differs from bin to bin.
    """
    inside = np.any([slip.inside for slip in slips], axis=0)
    way_m = np.hypot(*np.diff(whole.bins.mean(whole.record.pose[:2])))
    step_m = float(way_m[inside[1:] & inside[:-1]].max(initial=LEAST_WAY_M))
    sds = {"s": whole.bins.step_s, "m": step_m, "1": slips[0].loss_sd}
    covariance = fit.spread
    for k, one in enumerate(fit.parameters):
        if one.effect in PLACES:
            covariance[k], covariance[:, k] = 0.0, 0.0
            covariance[k, k] = sds[DECLARED[one.effect].parameters[one.key].unit] ** 2
    return replace(fit, information=inverse(covariance), covariance=covariance)


def seen_slips(selection: Selection) -> list[Slip]:
    """The slips that are a finding, the likeliest first; none where the robot is not calibrated, or a loss is
    found already.
    """
    problem, fit = selection.problem, selection.fit
    if problem.slips_to >= 1 or any(one.name in PLACES for one in selection.found):
        return []
    found = [one for one in slips_of(problem, fit) if is_found(problem, fit, one)]
    return sorted(found, key=lambda slip: -slip.gain)


def apart_from(selection: Selection, slips: list[Slip]) -> Selection:
    """The selection on the record without its moments of slip for good, where there are ``slips``: a term of
    the speeds, which are those of wheels that spin, is not to explain them.
    """
    return replace(selection, problem=replace(selection.problem, whole=None)) if slips else selection


def p_of(slips: list[Slip], n_seen: int) -> float:
    """The p of slips of which ``n_seen`` were seen: each bin's loss is a parameter."""
    n = sum(int(slip.inside.sum()) for slip in slips)
    return min(1.0, n_seen * len(SIDES) * float(chdtrc(n, sum(one.gain for one in slips))))


def slipping_left(problem: Problem, fit: Fit) -> dict[str, float]:
    """The loss that calibration logs show, where the robot slips on them; empty where it rolls."""
    own = problem.settings.gates
    slips = [one for one in slips_of(problem, fit) if lasts(problem, one)]
    losses = [one.loss for one in slips if one.gain >= own.least_slipped_gain]
    return {SLIP: max(losses)} if losses else {}


def slips_of(problem: Problem, fit: Fit) -> list[Slip]:
    """The runs of bins in which losing a part of the motion is likelier than rolling: of both wheels' motion
    or of one's, whichever explains most of the run.
    """
    rates = Rates(problem, fit.values)
    by_loss = np.stack([rates.gains(side) for side in SIDES])
    gains, losses = by_loss.max(axis=1), LOSSES[by_loss.argmax(axis=1)]
    found = []
    for inside in runs(gains.max(axis=0) > problem.settings.gates.least_gain_of_bin):
        k = int(gains[:, inside].sum(axis=1).argmax())
        gain, spread = float(gains[k, inside].sum()), float(losses[k, inside].std())
        found.append(Slip(inside, gain, rates.lost_share(inside, SIDES[k]), spread, SIDES[k]))
    return found


def is_found(problem: Problem, fit: Fit, slip: Slip) -> bool:
    """Whether far more motion than on the calibration logs is lost for good, for a while, without a doubt."""
    own, wider = problem.settings.gates, problem.base.get("effective_track", {}).get("ratio", 0.0)
    least = own.least_seen_gain if wider < own.least_scrubbing else own.least_seen_gain_scrubbing
    if slip.gain < least or slip.loss < own.least_beyond_calibration * problem.slips_to:
        return False
    return lasts(problem, slip) and stays_behind(problem, fit, slip)


def lasts(problem: Problem, slip: Slip) -> bool:
    """Whether a share that counts is lost for a while."""
    own, seconds = problem.settings.gates, float(slip.inside.sum()) * problem.bins.step_s
    return slip.loss >= own.least_loss and seconds > own.least_seen_s


def stays_behind(problem: Problem, fit: Fit, slip: Slip) -> bool:
    """Whether the robot is still behind its wheels after a slip: behind the one that slips, or of both ahead
    or in yaw, of which the rims roll the longer way. Where a tracker held the pose, it catches up.
    """
    whole, rows = problem.with_slip, np.flatnonzero(beside(slip.inside))[[0, -1]]
    half_track_m = Rates(problem, fit.values).half_track_m
    ways = {
        BOTH: [[1.0, 0.0], [0.0, half_track_m]],
        "left": [[1.0, -half_track_m]],
        "right": [[1.0, half_track_m]],
    }
    rolled, moved = (
        np.array(ways[slip.side]) @ np.diff(way[AHEAD_YAW][:, rows])[:, 0]
        for way in (whole.predicted(fit.values), whole.measured)
    )
    longer = int(np.abs(rolled).argmax())
    behind = abs(rolled[longer]) - np.sign(rolled[longer]) * moved[longer]
    return bool(behind > problem.settings.gates.least_staying_behind * slip.loss * abs(rolled[longer]))


def in_words(whole: Problem, slips: list[Slip]) -> tuple[str, ...]:
    """When the wheels slip, the first five in time; nothing of none."""
    if not slips:
        return ()
    early = sorted(slips, key=lambda slip: int(slip.inside.argmax()))
    each = [
        f"{'both' if slip.side == BOTH else 'the ' + slip.side} from {t_s[0]:.1f} to {t_s[-1]:.1f} s"
        for slip in early[:SAID]
        for t_s in [whole.bins.t_s[slip.inside]]
    ]
    more = f" and {len(slips) - SAID} times more" if len(slips) > SAID else ""
    return (f"wheels slip: {', '.join(each)}{more}",)


def as_effect(whole: Problem, slips: list[Slip]) -> tuple[str, Start]:
    """A slip as a loss in its time; several as one in the disc about them, with the loss of the first, unless
    the robot rolls through that place as often.
    """
    loss = loss_of(slips[0])
    if len(slips) > 1:
        inside = np.any([slip.inside for slip in slips], axis=0)
        x_m, y_m, radius_m = disc_of(whole, inside)
        radius_m = max(radius_m, Parameter(PATCH, "radius_m").bounds[0])
        place = {"x_m": x_m, "y_m": y_m, "radius_m": radius_m}
        if slips_most_of(whole, place, inside):
            return PATCH, {**place, **loss}
    t_s, half_s = whole.bins.t_s[slips[0].inside], whole.bins.step_s / 2
    return SLIP, {"start_s": float(t_s[0] - half_s), "end_s": float(t_s[-1] + half_s), **loss}


def slips_most_of(whole: Problem, place: Start, inside: Bool) -> bool:
    """Whether the wheels slip in the bins ``inside`` (n,) most of the time that they turn in a disc."""
    ahead, _, yaw = np.abs(slopes(whole.bins, whole.predicted({})))
    turn = ahead + whole.chassis.half_track_m * yaw > whole.settings.modes.slip_mps
    there = inside_of(whole, place, PATCH) & turn
    return bool(2 * (there & inside).sum() > there.sum())


def loss_of(slip: Slip) -> Start:
    """What both wheels lose; of one that slips, half of it, and what the right wheel loses more than that."""
    if slip.side == BOTH:
        return {"loss": slip.loss}
    return {"loss": slip.loss / 2, "loss_apart": slip.loss / 2 * (1.0 if slip.side == "right" else -1.0)}


def disc_of(whole: Problem, inside: Bool) -> tuple[float, float, float]:
    """Centre and radius of the disc about the path in the bins ``inside`` (n,)."""
    path = whole.bins.mean(whole.record.pose[:2])[:, inside]
    x_m, y_m = (path.min(axis=1) + path.max(axis=1)) / 2
    return float(x_m), float(y_m), float(np.hypot(path[0] - x_m, path[1] - y_m).max())


def is_near(whole: Problem, one: Slip, other: Slip) -> bool:
    """Whether the discs about two slips are no further from one another than the wheels are."""
    (x, y, radius), (x_other, y_other, radius_other) = (disc_of(whole, slip.inside) for slip in (one, other))
    return bool(np.hypot(x - x_other, y - y_other) < radius + radius_other + 2 * whole.chassis.half_track_m)
