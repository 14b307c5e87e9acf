"""Excitation gate: do the torques vary enough for a verdict?

Under feedback, torques that hardly vary answer the disturbance. A controller sees the disturbance better than
the poses do, so that any effect on the inputs seems to explain it, and significantly so. Efforts of several
times the disturbance's size are no answer to it, but a manoeuvre: an effect must be seen in those alone.
"""

from dataclasses import replace

import numpy as np
from scipy.special import fdtrc

from wmr_replay.gap.estimation.covariance import inverse_information, sandwich
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.estimation.refit import Fit, fit_model
from wmr_replay.gap.evidence.significance import size_columns
from wmr_replay.gap.model.candidates import declaration_of
from wmr_replay.gap.model.dynamics import Row
from wmr_replay.gap.model.extension import Extension
from wmr_schemas.arrays import F64, Bool
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.terms import parse_term

DEAD_ZONE = "torque_deadzone"
BOTH = "both"
"""Both channels, and no one of them."""
ANSWERS = {"longitudinal": "effort_sum", "yaw": "effort_diff"}
"""By channel, the torques by which a controller answers its disturbance."""


def commanded(problem: Problem, extension: Extension) -> tuple[F64, F64]:
    """The accelerations (n,) that the torques ask for in m/s²: α Σu ahead and α_yaw Δu in yaw."""
    rows, base = extension.rows(problem.binned), extension.base
    left, right = rows[:, Row.LEFT], rows[:, Row.RIGHT]
    return base.alpha * (right + left), base.alpha_yaw * (right - left)


def excitation_ratios(problem: Problem, extension: Extension, noise: Diffusion) -> tuple[float, float]:
    """Standard deviation of α Σu over the disturbance's ahead, and of α_yaw Δu over that in yaw."""
    ahead, turning = (float(np.std(a[problem.train])) for a in commanded(problem, extension))
    return ahead / noise.long_sd_mps2, turning / noise.yaw_sd_mps2


def manoeuvres(problem: Problem, fit: Fit, channel: str = BOTH) -> Bool:
    """The fitted rows (n,) in which the torques ask for more than an answer to the disturbance would, and
    those shortly after, which show what came of it; on one ``channel``, or on either.
    """
    own, noise, t_s = problem.settings.excitation, fit.noise, problem.binned.t_s
    ahead, turning = (np.abs(a - np.median(a)) for a in commanded(problem, fit.extension))
    along, across = (
        ahead > own.manoeuvre_sd * noise.long_sd_mps2,
        turning > own.manoeuvre_sd * noise.yaw_sd_mps2,
    )
    large = along if channel == "longitudinal" else across if channel == "yaw" else along | across
    last_s = np.maximum.accumulate(np.where(large, t_s, -np.inf))
    return np.asarray((t_s - last_s <= own.afterwards_s) & problem.train)


def torques_of(name: str) -> str:
    """The channel whose torques an effect acts in proportion to, ``both`` where there is no such one.

    On a drive at constant speed, turning shows nothing of what the torques ahead do. Nor do torques ahead
    answer what turns the robot: a term that turns it by them has no such channel.
    """
    if name.startswith(UNNAMED_PREFIX):
        term = parse_term(name)
        return term.channel if ANSWERS.get(term.channel) in term.columns else BOTH
    declaration = declaration_of(name)
    return declaration.channel if declaration.acts_on == "robot" else BOTH


def p_in_manoeuvres(problem: Problem, fit: Fit, *names: str) -> float:
    """P value of the Wald test that the effects' sizes are 0, from manoeuvres alone, robust over blocks."""
    rows = manoeuvres(problem, fit, channel_of(*names))
    size = [j for name in names for j in size_columns(fit, name)]
    block_s, clip_sd = problem.settings.significance.block_s, problem.settings.significance.clip_sd
    block = np.unique(problem.binned.t_s[rows] // block_s, return_inverse=True)[1]
    n_blocks = int(block.max()) + 1 if len(block) else 0
    if n_blocks <= len(size):
        return 1.0
    psi, e = fit.psi[rows], np.clip(fit.innovations[rows], -clip_sd, clip_sd)
    step = inverse_information(psi) @ np.einsum("ijk,ij->k", psi, e)
    V = sandwich(psi, e - psi @ step, block)
    values = (fit.values + step)[size]
    wald = float(values @ np.linalg.pinv(V[np.ix_(size, size)], rcond=1e-10) @ values) / len(size)
    return float(fdtrc(len(size), n_blocks - len(size), wald))


def gains_in_manoeuvres(before: Fit, after: Fit) -> dict[str, float]:
    """What terms of efforts, which only ``after`` has, lower the deviance by in manoeuvres, by the channel
    whose efforts they read.

    What answers the disturbance moves nothing. So efforts seem to act less where they are small, which a
    curve of them explains, and leaves the manoeuvres as they are or makes them less likely.
    """
    new = after.extension.effects.keys() - before.extension.effects.keys()
    channels = {torques_of(name) for name in new if name.startswith(UNNAMED_PREFIX)} - {BOTH}
    gained = before.row_deviance - after.row_deviance
    return {c: float(gained[manoeuvres(before.problem, before, c)].sum()) for c in channels}


def gain_in_manoeuvres(before: Fit, after: Fit) -> float:
    """The least of :func:`gains_in_manoeuvres`; infinite where there are no such terms."""
    return min(gains_in_manoeuvres(before, after).values(), default=float("inf"))


def channel_of(*names: str) -> str:
    """The channel of the torques that all of the effects act by, ``both`` where they differ."""
    channels = {torques_of(name) for name in names}
    return channels.pop() if len(channels) == 1 else BOTH


def times_the_disturbance(fit: Fit) -> tuple[float, float]:
    """What the width of a dead zone of the model ``fit`` asks for, in standard deviations of the disturbance,
    ahead and in turning, the lesser one first.

    A controller compensates a disturbance by efforts of its size. They move nothing, and so a dead zone of
    that size seems to hold them back.
    """
    base, noise, width_nm = fit.extension.base, fit.noise, fit.extension.effects[DEAD_ZONE]["threshold_nm"]
    ahead, turning = 2 * base.alpha * width_nm, 2 * base.alpha_yaw * width_nm
    times = ahead / noise.long_sd_mps2, turning / noise.yaw_sd_mps2
    return min(times), max(times)


def large_ones_lose_nothing(problem: Problem, fit: Fit, margin: float) -> bool:
    """Whether a dead zone is no likelier, by more than ``margin``, than small efforts that move nothing and
    large ones that lose nothing.

    A zone holds back as much of the large efforts as of the small ones. Where a controller compensates the
    disturbance, its answers move nothing, and the disturbance that they cancel is not seen either: a zone
    that is not there makes it seem small, whatever the answers' size. Manoeuvres then lose nothing.
    """
    torque, own = problem.binned.torque, problem.settings.excitation
    size_nm, width_nm = np.abs(torque.efforts_nm), fit.extension.effects[DEAD_ZONE]["threshold_nm"]
    rest, iterations = fit.extension.without(DEAD_ZONE), problem.settings.budget.ranked_diffusion
    for widths in own.answers_in_zones:
        moving = np.where(size_nm < widths * width_nm, 0.0, torque.efforts_nm)
        binned = replace(problem.binned, torque=replace(torque, efforts_nm=moving))
        rival = fit_model(replace(problem, binned=binned), rest, fit.noise, iterations)
        if rival.deviance <= fit.deviance + margin:
            return True
    return False


def too_calm_for(name: str, problem: Problem, fit: Fit) -> str:
    """Why the log cannot carry the verdict ``name``, an effect of the model ``fit``; empty where it can."""
    own = problem.settings.excitation
    if not declaration_of(name).needs_excitation or p_in_manoeuvres(problem, fit, name) < own.level:
        return ""
    return (
        f"{name} would explain part of it, but what asks for more than {own.manoeuvre_sd:g} times the "
        "disturbance does not show it, and smaller efforts may only answer the disturbance"
    )
