"""The numbers of a wave, a bell or a shape, by Gauss–Newton from the best point of their grid."""

from collections.abc import Sequence

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.formula.families import BELLS, CUTS, ROPES, WIDE, swings_alone
from wmr_replay.gap.formula.groups import Group
from wmr_replay.gap.formula.scores import ScoredGroup, efforts_of, equations_of
from wmr_replay.gap.model.dictionary import columns_of
from wmr_replay.gap.settings.formula import FormulaSettings
from wmr_schemas.arrays import F64
from wmr_schemas.placed_factors import OF_LINE, Columns
from wmr_schemas.shape_factors import quantity


def refined(problem: Problem, at: Fit, scored: ScoredGroup) -> ScoredGroup:
    """The group at the numbers of the largest gain near its own.

    A step solves for coefficients and numbers together: the slope of a term by a number is one more column.
    Where the first one goes too far, shorter ones are tried.
    """
    own, best = problem.settings.formula, scored
    for k in range(own.shape_steps if is_movable(scored.group) else 0):
        tried = stepped(problem, at, best, own.first_steps if k == 0 else own.first_steps[:1])
        if tried is best:
            break
        best = tried
    return best


def is_movable(group: Group) -> bool:
    """Whether its numbers are no whole turns, and have a slope: a step has none by its time."""
    turns = group.family.kind == "wave" and group.family.along == "yaw"
    return bool(group.shape) and group.family.kind != "after" and not turns


def stepped(problem: Problem, at: Fit, scored: ScoredGroup, shares: Sequence[float]) -> ScoredGroup:
    """The group after a step of its numbers, or the first of these shares of it that gains; as it is, where
    none does or no row tells of them.
    """
    group, n = scored.group, len(scored.group.terms)
    steps = steps_of(group, problem.settings.formula)
    columns = [efforts_of(problem, at, group.terms), slopes_of(problem, at, scored, steps)]
    normal = equations_of(problem, at, np.concatenate(columns))
    _, delta = normal.gain(list(range(n + len(steps))))
    if not np.all(np.isfinite(delta)):
        return scored
    reach = problem.settings.formula.shape_reach * steps
    step = np.clip(delta[n:], -reach, reach)
    for share in shares:
        there = group.moved(allowed(group, np.array(group.shape) + share * step, problem))
        gain, found = equations_of(problem, at, efforts_of(problem, at, there.terms)).gain(list(range(n)))
        if gain >= scored.gain + problem.settings.refit.enough:
            return ScoredGroup(there, tuple(float(c) for c in found), gain)
    return scored


def slopes_of(problem: Problem, at: Fit, scored: ScoredGroup, steps: F64) -> F64:
    """Slopes (k, n, 2) of the group's efforts by each of its numbers."""
    group = scored.group
    own, slopes = efforts_of(problem, at, group.terms), []
    for j, step in enumerate(steps):
        shape = np.array(group.shape)
        shape[j] += step
        moved = efforts_of(problem, at, group.moved(shape).terms) - own
        slopes.append(np.tensordot(scored.coefficients, moved, axes=1) / step)
    return np.stack(slopes)


def allowed(group: Group, shape: F64, problem: Problem) -> F64:
    """The numbers within what is looked for: no wave without a length, no shape far beyond its quantity's
    scale, no bell without a width, none beside the area that is driven or as wide as that.
    """
    own, family = problem.settings.formula, group.family
    if family.kind == "wave":
        return within_lengths(group, shape, own)
    if family.kind in BELLS:
        return within_area(group, shape, problem)
    columns = columns_of(problem.binned)
    if family.kind in OF_LINE:
        return within_lines(group, shape, columns, own)
    if family.kind in CUTS:
        z = columns[family.along]
        widest = own.edge_places[-1] if family.kind == "edge" else own.widest_line
        narrow, wide = (share * float(np.ptp(z)) for share in (own.edge_widths[0], widest))
        return np.array([np.clip(shape[0], z.min(), z.max()), np.clip(shape[1], narrow / 2, wide)])
    if family.kind in ("gust", "pulse", "saw"):
        return within_times(family.kind, shape, columns["t"], own)
    z = quantity(columns, family.along)
    scale = max(float(np.sqrt(np.mean(z**2))), own.least_scale)
    least, most = (share * scale for share in own.scales)
    low = np.where([family.kind == "above" and k == 0 for k in range(len(shape))], -most, least)
    return np.clip(shape, low, most)


def within_lengths(group: Group, shape: F64, own: FormulaSettings) -> F64:
    """The numbers of a wave, no less than half of what they were, and no shorter than is looked for."""
    if group.family.along == "xy":
        largest = 2 * np.pi / own.least_length_m
        return np.asarray(shape * min(1.0, largest / max(float(np.hypot(*shape)), 1e-9)))
    shortest = own.least_length_m
    if group.family.along == "t":
        shortest = own.least_swing_s if swings_alone(group.family) else own.least_period_s
    return np.clip(shape, group.shape[0] / 2, 2 * np.pi / shortest)


def within_times(kind: str, shape: F64, t_s: F64, own: FormulaSettings) -> F64:
    """The time and width of a gust, or the beginning and period of a saw."""
    span_s = float(np.ptp(t_s))
    if kind == "saw":
        return np.array([shape[0], np.clip(shape[1], own.least_saw_s, own.longest_saw * span_s)])
    middle = np.clip(shape[0], t_s[0], t_s[-1])
    return np.array([middle, np.clip(shape[1], own.least_gust_s, own.most_gust * span_s)])


def within_lines(group: Group, shape: F64, columns: Columns, own: FormulaSettings) -> F64:
    """Distance, angle and width of a line that the robot crosses."""
    (x, y), angle = group.family.around, float(shape[1])
    across = (columns["x"] - x) * np.cos(angle) + (columns["y"] - y) * np.sin(angle)
    narrow, wide = (share * float(np.ptp(across)) for share in (own.edge_widths[0], own.widest_line))
    apart = np.clip(shape[0], across.min(), across.max())
    return np.array([apart, angle, np.clip(shape[2], narrow / 2, wide)])


def within_area(group: Group, shape: F64, problem: Problem) -> F64:
    """The place and radius of a bell; a rope may be held outside of the area."""
    own, place = problem.settings.formula, problem.binned.pose[:, :2]
    span_m, is_rope = float(np.mean(np.ptp(place, axis=0))), group.family.kind in ROPES
    wide = group.family.plain or group.family.kind in WIDE
    widest_m = span_m * (own.wide_shares[-1] if wide else own.widest_bell)
    beyond_m = span_m * own.rope_reach * is_rope
    middle = np.clip(shape[:2], place.min(axis=0) - beyond_m, place.max(axis=0) + beyond_m)
    if group.family.kind == "circle":
        least_m, most_m = own.least_radius_m / 2, span_m * np.array([own.circle_shares[-1], own.widest_line])
        return np.append(middle, np.clip(shape[2:], least_m, np.maximum(most_m, least_m)))
    return np.append(middle, np.clip(shape[2], own.least_radius_m, max(widest_m, own.least_radius_m)))


def steps_of(group: Group, settings: FormulaSettings) -> F64:
    """Steps of the difference quotients: of K in rad/m or rad/s, of angles in rad, of places and times in
    shares of the width, and of scales in shares of themselves.
    """
    if group.family.kind == "wave":
        step = settings.wave_step_radps if group.family.along == "t" else settings.wave_step_radpm
        return np.full(len(group.shape), step)
    steps = np.full(len(group.shape), settings.bell_step * group.shape[-1])
    if group.family.kind == "saw":
        return np.array([settings.saw_step, settings.saw_step**2]) * group.shape[1]
    if group.family.kind in OF_LINE:
        steps[1] = settings.side_turn_rad
    return steps
