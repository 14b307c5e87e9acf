"""One pass of the filter scores every candidate of the library at once.

With whitened innovations e and sensitivities ψ, a candidate with parameters δ lowers Σe² by λ = sᵀ G⁻¹ s, s =
ψᵀe, G = ψᵀψ (its best δ = G⁻¹ s); a candidate tried at one point of a grid by 2 s − G. What is in the model
already is projected out of both. Losses of α in cells of time add up to steps, intervals and patches.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.candidates import LIBRARY, UNIT_EFFORTS, Candidate
from wmr_replay.gap.cells import cell_leads, time_cells
from wmr_replay.gap.dictionary import as_efforts
from wmr_replay.gap.drive import Drive
from wmr_replay.gap.extension import Extension
from wmr_replay.gap.field import Row
from wmr_replay.gap.kalman import Diffusion
from wmr_replay.gap.leads import Lead, Normal, normal_equations
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.sensitivity import NOTHING, Wanted
from wmr_schemas.arrays import F64
from wmr_schemas.terms import COEFFICIENT

GRIDDED_EFFORTS = ("actuator_lag", "input_delay", "torque_deadzone", "torque_saturation")


@dataclass(frozen=True, eq=False)
class Scanned:
    """All leads, the best first; by effect, the value at which a column stands and its ψᵀψ."""

    leads: list[Lead]
    unit_information: dict[str, tuple[float, float]]


def scan(problem: Problem, extension: Extension, noise: Diffusion, nuisance: F64 | None = None) -> Scanned:
    """Score the library. ``nuisance`` (n, 3, q): sensitivities to what the model holds already."""
    drive = problem.drive
    rows = extension.rows(drive)
    linear = [c for c in LIBRARY if c.places and c.name not in extension.effects]
    wanted = np.array([place for c in linear for place in c.places], np.int64)
    changes = list(effort_changes(extension, drive, rows))
    cells, n_cells = time_cells(drive)
    efforts = np.stack([change for _, _, change in changes])
    passed = problem.passed(extension, noise, Wanted(wanted, efforts, cells, n_cells), keep=True)
    psi, e = passed.sensitivities[problem.train], passed.innovations[problem.train]
    normal = normal_equations(psi, e, None if nuisance is None else nuisance[problem.train])
    leads: list[Lead] = []
    column = 0
    information: dict[str, tuple[float, float]] = {}
    for candidate in linear:
        k = len(candidate.places)
        information[candidate.name] = (1.0, float(np.diag(normal.G)[column : column + k].min()))
        columns = list(range(column, column + k))
        leads.append(linear_lead(normal, candidate, columns, extension.wheel_radius_m))
        column += k
    best: dict[str, Lead] = {}
    for candidate, value, _ in changes:
        lead = grid_lead(normal, candidate, value, column)
        told = (1.0 if value is None else value, float(normal.G[column, column]))
        if candidate.name not in information or ratio(told) < ratio(information[candidate.name]):
            information[candidate.name] = told
        column += 1
        if candidate.name not in best or lead.gain > best[candidate.name].gain:
            best[candidate.name] = lead
    leads += best.values()
    leads += cell_leads(normal, drive, cells, n_cells, column, extension.effects)
    return Scanned(sorted(leads, key=lambda lead: -lead.gain), information)


def ratio(told: tuple[float, float]) -> float:
    """Size per √information: the smaller, the better it is seen."""
    return abs(told[0]) / float(np.sqrt(max(told[1], 1e-30)))


def scan_terms(
    problem: Problem, extension: Extension, noise: Diffusion, nuisance: F64 | None = None
) -> list[Lead]:
    """The dictionary's terms as leads, the best first."""
    terms, changes = zip(*as_efforts(problem.drive, extension.base), strict=True)
    wanted = NOTHING._replace(efforts=np.stack(changes))
    passed = problem.passed(extension, noise, wanted, keep=True)
    known = None if nuisance is None else nuisance[problem.train]
    normal = normal_equations(passed.sensitivities[problem.train], passed.innovations[problem.train], known)
    leads = []
    for j, term in enumerate(terms):
        gain, delta = normal.gain([j])
        leads.append(Lead(term.name, {COEFFICIENT: float(delta[0])}, gain, len(terms)))
    return sorted(leads, key=lambda lead: -lead.gain)


def effort_changes(
    extension: Extension, drive: Drive, rows: F64
) -> Iterator[tuple[Candidate, float | None, F64]]:
    """Changes (n, 2) of left and right effort: per unit of a parameter (value None), or at a grid's value."""
    left, right = rows[:, Row.LEFT], rows[:, Row.RIGHT]
    largest = float(np.max(np.abs(drive.torque.efforts_nm)))
    typical = float(np.median(np.abs(drive.torque.efforts_nm)))
    for candidate in LIBRARY:
        if candidate.name in extension.effects:
            continue
        if candidate.name in UNIT_EFFORTS:
            yield candidate, None, np.column_stack(UNIT_EFFORTS[candidate.name](left, right))
        elif candidate.name in GRIDDED_EFFORTS:
            (key,) = candidate.free
            for share in candidate.grid:
                scale = {"torque_deadzone": 2 * typical, "torque_saturation": largest}.get(
                    candidate.name, 1.0
                )
                value = share * scale
                changed = extension.with_effect(candidate.name, {key: value}).input_effects()
                means = drive.torque.means(drive.t_s, changed)
                yield candidate, value, np.column_stack([means[0] - left, means[1] - right])


def linear_lead(normal: Normal, candidate: Candidate, columns: list[int], wheel_radius_m: float) -> Lead:
    """The best linear size of an effect; none where its sign is not a physical one."""
    gain, delta = normal.gain(columns)
    if candidate.name == "undeclared_skid":
        delta = 1.0 / np.maximum(delta, 1e-3)
    if candidate.name == "wheel_viscous":
        delta = delta * wheel_radius_m
    parameters = dict(zip(candidate.free, (float(d) for d in delta), strict=True))
    outside = any(not low <= parameters[key] <= high for key, (low, high) in candidate.bounds.items())
    if outside and candidate.name in ("payload", "yaw_inertia", "drive_gain", "cornering_stiffness"):
        parameters = {k: float(np.clip(v, *candidate.bounds[k])) for k, v in parameters.items()}
        outside = False
    return Lead(candidate.name, parameters, 0.0 if outside else gain, 1)


def grid_lead(normal: Normal, candidate: Candidate, value: float | None, column: int) -> Lead:
    """The gain of one column: at its best size, or at size 1 where it stands for a grid's value."""
    (key,) = candidate.free
    if value is None:
        gain, delta = normal.gain([column])
        return Lead(candidate.name, {key: float(delta[0])}, gain, 1)
    gain = float(2 * normal.s[column] - normal.G[column, column])
    return Lead(candidate.name, {key: value}, gain, len(candidate.grid))
