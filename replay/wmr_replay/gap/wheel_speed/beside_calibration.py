"""An effect beside a calibration that is as uncertain as it is.

On one drive, effects of the calibration look like others: at a constant speed a centre of rotation that lies
elsewhere is a sideways slip, and what turns set in by is a track or a delay. So an effect is weighed with all
parameters of the calibration free at once, each held by what the calibration says of it: with whitened errors
e, columns C and precisions P,

    δ = (CᵀC + P)⁻¹ Cᵀe      cov δ = (CᵀC + P)⁻¹ (S + P) (CᵀC + P)⁻¹

S being the robust covariance of the scores Cᵀe. One linear step: the path is nearly linear in the parameters.
"""

from dataclasses import replace

import numpy as np

from wmr_replay.gap.wheel_speed.candidates import absent, candidates_of, parameters_of
from wmr_replay.gap.wheel_speed.estimate import Fit, View, inverse, robust
from wmr_replay.gap.wheel_speed.evidence import p_value, within_calibration
from wmr_replay.gap.wheel_speed.predict import Parameter, Problem, replaced


def is_of_calibration(problem: Problem, fitted: Fit, name: str) -> bool:
    """Whether an effect is no more than the calibration leaves open, all its parameters taken together."""
    own = problem.settings.gates
    if within_calibration(problem.base_sd, fitted, name, own):
        return True
    if not problem.base_sd:
        return False
    beside = beside_calibration(problem, fitted)
    known = within_calibration(problem.base_sd, beside, name, own)
    return known or p_value(beside, name, len(candidates_of(problem.record))) > own.level


def beside_calibration(problem: Problem, fitted: Fit) -> Fit:
    """``fitted`` with the other parameters of the calibration beside it, held by their standard deviations.
    A parameter that is held takes no degree of freedom.
    """
    held = tuple(
        one
        for name in problem.base_sd
        for one in parameters_of(name)
        if one not in fitted.parameters and held_sd(problem, one) > 0
    )
    parameters = (*fitted.parameters, *held)
    values = {**{one.effect: absent(one.effect) for one in held}, **fitted.values}
    precision = np.array([0.0] * len(fitted.parameters) + [held_sd(problem, one) ** -2 for one in held])
    view = View.of(problem, fitted.noises)
    white = view.rows(view.errors(fitted.values), view.columns(values, parameters))
    information = white.columns.T @ white.columns + np.diag(precision)
    half = inverse(information)
    for one, change in zip(parameters, half @ (white.columns.T @ white.errors), strict=True):
        values = dict(replaced(values, one, values[one.effect][one.key] + float(change)))
    covariance, n_clusters = robust(white, information)
    covariance = covariance + half @ np.diag(precision) @ half
    return replace(
        fitted,
        parameters=parameters,
        values=values,
        information=information,
        covariance=covariance,
        n_clusters=n_clusters + len(held),
    )


def held_sd(problem: Problem, which: Parameter) -> float:
    """How well the calibration holds a parameter on another drive."""
    return problem.settings.gates.between_logs * problem.base_sd[which.effect].get(which.key, 0.0)
