"""One pass of the filter scores every candidate of the library at once.

With whitened innovations e and sensitivities ψ, a candidate with parameters δ lowers Σe² by λ = sᵀ G⁻¹ s, s =
ψᵀe, G = ψᵀψ (its best δ = G⁻¹ s); a candidate tried at one point of a grid by 2 s − G. What is in the model
already is projected out of both. Losses of α in cells of time add up to steps, intervals and patches.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.candidates import LIBRARY, UNIT_EFFORTS, Candidate
from wmr_replay.gap.dictionary import as_efforts
from wmr_replay.gap.drive import Drive
from wmr_replay.gap.extension import Extension, Parameters
from wmr_replay.gap.field import Row
from wmr_replay.gap.kalman import Diffusion
from wmr_replay.gap.problem import Problem
from wmr_replay.gap.refit import clipped
from wmr_replay.gap.sensitivity import NOTHING, Wanted
from wmr_schemas.arrays import F64, I64
from wmr_schemas.terms import COEFFICIENT

MOST_CELLS, LEAST_CELL_S = 120, 0.5
LONGEST_INTERVAL_S, SHORTEST_INTERVAL_S = 30.0, 1.0
RADII_M = (0.5, 1.0, 1.5, 2.5)
GRIDDED_EFFORTS = ("actuator_lag", "input_delay", "torque_deadzone", "torque_saturation")


@dataclass(frozen=True)
class Lead:
    """A candidate that promises to lower the deviance by ``gain``, with its best parameters."""

    name: str
    parameters: dict[str, float]
    gain: float
    tried: int


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal equations over the fitted rows: s (p,), G (p, p)."""

    s: F64
    G: F64

    def gain(self, columns: list[int]) -> tuple[float, F64]:
        """λ and δ of a group of columns."""
        G, s = self.G[np.ix_(columns, columns)], self.s[columns]
        if np.any(np.diag(G) <= 1e-9):
            return 0.0, np.zeros(len(columns))
        delta = np.linalg.solve(G + 1e-12 * np.diag(np.diag(G)), s)
        return float(s @ delta), np.asarray(delta)


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
        leads.append(linear_lead(normal, candidate, list(range(column, column + k))))
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


def normal_equations(psi: F64, e: F64, nuisance: F64 | None) -> Normal:
    """From (n, 3, p) and (n, 3); outliers are clipped, the nuisance is projected out."""
    flat, residual = psi.reshape(-1, psi.shape[2]), clipped(e).ravel()
    s, G = flat.T @ residual, flat.T @ flat
    if nuisance is None or not nuisance.shape[2]:
        return Normal(s, G)
    other = nuisance.reshape(-1, nuisance.shape[2])
    A, B = other.T @ other, flat.T @ other
    A = A + 1e-9 * np.diag(np.diag(A)) + 1e-12 * np.eye(len(A))
    return Normal(s - B @ np.linalg.solve(A, other.T @ residual), G - B @ np.linalg.solve(A, B.T))


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


def linear_lead(normal: Normal, candidate: Candidate, columns: list[int]) -> Lead:
    """The best linear size of an effect; none where its sign is not a physical one."""
    gain, delta = normal.gain(columns)
    if candidate.name == "undeclared_skid":
        delta = 1.0 / np.maximum(delta, 1e-3)
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


def time_cells(drive: Drive) -> tuple[I64, int]:
    """The cell of time in which each row lies, and how many there are."""
    span = float(drive.t_s[-1] - drive.t_s[0])
    n_cells = int(min(MOST_CELLS, max(1, span // LEAST_CELL_S)))
    cells = np.minimum((drive.t_s - drive.t_s[0]) / span * n_cells, n_cells - 1)
    return cells.astype(np.int64), n_cells


def cell_leads(
    normal: Normal, drive: Drive, cells: I64, n_cells: int, column: int, present: Mapping[str, Parameters]
) -> Iterator[Lead]:
    """Load steps, slip intervals and patches out of the losses in cells of time."""
    ahead, turning = slice(column, column + n_cells), slice(column + n_cells, column + 2 * n_cells)
    s, G = normal.s, normal.G
    span = float(drive.t_s[-1] - drive.t_s[0])
    edges = drive.t_s[0] + span / n_cells * np.arange(n_cells + 1)
    if "load_step" not in present:
        yield best_step(s[ahead], G[ahead, ahead], edges)
    both_s = s[ahead] + s[turning]
    both_G = G[ahead, ahead] + G[ahead, turning] + G[turning, ahead] + G[turning, turning]
    if "slip_interval" not in present:
        yield best_interval(both_s, both_G, edges)
    if "low_friction_patch" not in present:
        yield best_patch(both_s, both_G, drive, cells, n_cells)


def sums_over(s: F64, G: F64) -> tuple[F64, F64]:
    """Prefix sums of s (n + 1,) and of G (n + 1, n + 1)."""
    P = np.concatenate([[0.0], np.cumsum(s)])
    C = np.zeros((len(s) + 1, len(s) + 1))
    C[1:, 1:] = np.cumsum(np.cumsum(G, axis=0), axis=1)
    return P, C


def best_step(s: F64, G: F64, edges: F64) -> Lead:
    """A load from t₀ on: the sum of the cells after it. α/(1 + p) = α (1 − loss)."""
    P, C = sums_over(s, G)
    n = len(s)
    starts = np.arange(max(1, n // 10), n - n // 10)
    total = P[n] - P[starts]
    size = np.maximum(C[n, n] - C[starts, n] - C[n, starts] + C[starts, starts], 1e-9)
    loss, gain = total / size, total**2 / size
    gain[(loss > 0.9) | (loss < -2.0)] = 0.0
    i = int(np.argmax(gain))
    parameters = {"mass_ratio": float(loss[i] / (1 - loss[i])), "t0_s": float(edges[starts[i]])}
    return Lead("load_step", parameters, float(gain[i]), n)


def best_interval(s: F64, G: F64, edges: F64) -> Lead:
    """A loss of α and α_yaw between two edges."""
    P, C = sums_over(s, G)
    i, j = np.triu_indices(len(edges), 1)
    length = edges[j] - edges[i]
    fits = (length >= SHORTEST_INTERVAL_S) & (length <= LONGEST_INTERVAL_S)
    i, j = i[fits], j[fits]
    total = P[j] - P[i]
    size = np.maximum(C[j, j] - C[i, j] - C[j, i] + C[i, i], 1e-9)
    loss = total / size
    gain = np.where((loss > 0.02) & (loss < 1.3), total**2 / size, 0.0)
    k = int(np.argmax(gain))
    parameters = {
        "start_s": float(edges[i[k]]),
        "end_s": float(edges[j[k]]),
        "loss": float(min(loss[k], 0.98)),
    }
    return Lead("slip_interval", parameters, float(gain[k]), len(i))


def best_patch(s: F64, G: F64, drive: Drive, cells: I64, n_cells: int) -> Lead:
    """A loss within a disc about a place on the path."""
    rows = np.searchsorted(cells, np.arange(n_cells))
    middle = np.minimum((rows + np.append(rows[1:], len(cells))) // 2, len(cells) - 1)
    centres = drive.pose[middle, :2]
    found = Lead("low_friction_patch", {}, -1.0, 1)
    for radius in RADII_M:
        inside = np.hypot(*(drive.pose[:, None, :2] - centres[None]).transpose(2, 0, 1)) < radius
        share = np.add.reduceat(inside.astype(np.float64), rows, axis=0)
        share /= np.maximum(np.diff(np.append(rows, len(cells))), 1)[:, None]
        total = share.T @ s
        size = np.maximum(np.einsum("ij,ik,kj->j", share, G, share, optimize=True), 1e-9)
        loss = total / size
        gain = np.where((loss > 0.02) & (loss < 1.3), total**2 / size, 0.0)
        k = int(np.argmax(gain))
        if gain[k] > found.gain:
            place = {"x_m": float(centres[k, 0]), "y_m": float(centres[k, 1]), "radius_m": radius}
            parameters = place | {"loss": float(min(loss[k], 0.98))}
            found = Lead("low_friction_patch", parameters, float(gain[k]), len(RADII_M) * n_cells)
    return found
