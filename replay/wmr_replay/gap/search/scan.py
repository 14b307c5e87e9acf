"""One pass of the filter scores every candidate of the library at once.

With whitened innovations e and sensitivities ψ, a candidate with parameters δ lowers Σe² by λ = sᵀ G⁻¹ s, s =
ψᵀe, G = ψᵀψ (its best δ = G⁻¹ s); a candidate tried at one point of a grid by 2 s − G. What is in the model
already is projected out of both. Losses of α in cells of time add up to steps, intervals and patches.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from wmr_replay.effects.efforts import UNIT_CHANGES
from wmr_replay.effects.theta import from_place
from wmr_replay.gap.estimation.binned_log import Drive
from wmr_replay.gap.estimation.filter import Diffusion
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.sensitivity import NOTHING, Wanted
from wmr_replay.gap.model.candidates import LIBRARY, Candidate
from wmr_replay.gap.model.dictionary import as_efforts
from wmr_replay.gap.model.dynamics import Row
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.search.cells import Patches, cell_leads, time_cells
from wmr_replay.gap.search.leads import Lead, Normal, normal_equations
from wmr_replay.gap.search.own_columns import NO_COLUMNS, OwnColumns
from wmr_schemas.arrays import F64, I64
from wmr_schemas.terms import COEFFICIENT


@dataclass(frozen=True, eq=False)
class Columns:
    """What the library's sensitivities are to, in the order of their columns, and how they make leads."""

    drive: Drive
    extension: Extension
    linear: tuple[Candidate, ...]
    changes: tuple[tuple[Candidate, float | None, F64], ...]
    cells: I64
    n_cells: int
    patches: Patches
    own: OwnColumns

    @classmethod
    def of(cls, drive: Drive, extension: Extension) -> "Columns":
        """Those of every candidate that the model does not hold yet."""
        linear = tuple(c for c in LIBRARY if c.places and c.name not in extension.effects)
        changes = tuple(effort_changes(extension, drive, extension.rows(drive)))
        cells, n_cells = time_cells(drive)
        patches, own = Patches.of(drive, cells, n_cells), OwnColumns.of(extension)
        return cls(drive, extension, linear, changes, cells, n_cells, patches, own)

    @property
    def wanted(self) -> Wanted:
        """For the filter."""
        places = np.array([place for c in self.linear for place in c.places], np.int64)
        efforts = np.stack([change for _, _, change in self.changes])
        return Wanted(places, efforts, self.cells, self.n_cells)

    def leads(self, normal: Normal) -> list[Lead]:
        """Every candidate's best, the best first."""
        leads = [linear_lead(normal, c, js, self.extension.wheel_radius_m) for c, js in self.groups()]
        first = sum(len(c.places) for c in self.linear)
        best: dict[str, Lead] = {}
        for j, (candidate, value, _) in enumerate(self.changes, first):
            lead = grid_lead(normal, candidate, value, j)
            if candidate.name not in best or lead.gain > best[candidate.name].gain:
                best[candidate.name] = lead
        leads += best.values()
        after = first + len(self.changes)
        leads += cell_leads(normal, self.drive, self.patches, after, self.extension.effects)
        leads += self.own.leads(normal, after + 2 * self.n_cells)
        return sorted(leads, key=lambda lead: -lead.gain)

    def groups(self) -> Iterator[tuple[Candidate, list[int]]]:
        """The columns of each linear candidate."""
        column = 0
        for candidate in self.linear:
            k = len(candidate.places)
            yield candidate, list(range(column, column + k))
            column += k

    def information(self, normal: Normal) -> dict[str, tuple[float, float]]:
        """By effect, the value at which its best seen column stands, and the column's ψᵀψ."""
        diagonal = np.diag(normal.G)
        told = {c.name: (1.0, float(diagonal[js].min())) for c, js in self.groups()}
        first = sum(len(c.places) for c in self.linear)
        for j, (candidate, value, _) in enumerate(self.changes, first):
            this = (1.0 if value is None else value, float(diagonal[j]))
            if candidate.name not in told or ratio(this) < ratio(told[candidate.name]):
                told[candidate.name] = this
        return told | self.own.information(normal, first + len(self.changes) + 2 * self.n_cells)


@dataclass(frozen=True, eq=False)
class Scanned:
    """All leads, the best first; by effect, the value at which a column stands and its ψᵀψ."""

    leads: list[Lead]
    unit_information: dict[str, tuple[float, float]]


def scan(problem: Problem, extension: Extension, noise: Diffusion, nuisance: F64 | None = None) -> Scanned:
    """Score the library. ``nuisance`` (n, 3, q): sensitivities to what the model holds already."""
    columns = Columns.of(problem.drive, extension)
    passed = problem.passed(extension, noise, columns.wanted, keep=True)
    passed = columns.own.joined_to(passed, problem, noise)
    psi, e = passed.sensitivities[problem.train], passed.innovations[problem.train]
    normal = normal_equations(psi, e, None if nuisance is None else nuisance[problem.train])
    return Scanned(columns.leads(normal), columns.information(normal))


def ratio(told: tuple[float, float]) -> float:
    """Size per √information: the smaller, the better it is seen."""
    return abs(told[0]) / float(np.sqrt(max(told[1], 1e-30)))


@dataclass(frozen=True, eq=False)
class TermColumns:
    """The dictionary's terms as columns."""

    names: tuple[str, ...]
    wanted: Wanted
    own: OwnColumns = NO_COLUMNS

    @classmethod
    def of(cls, drive: Drive, extension: Extension) -> "TermColumns":
        """All terms."""
        terms, changes = zip(*as_efforts(drive, extension.base), strict=True)
        return cls(tuple(term.name for term in terms), NOTHING._replace(efforts=np.stack(changes)))

    def leads(self, normal: Normal) -> list[Lead]:
        """Every term at its best size, the best first."""
        leads = []
        for j, name in enumerate(self.names):
            gain, delta = normal.gain([j])
            leads.append(Lead(name, {COEFFICIENT: float(delta[0])}, gain, len(self.names)))
        return sorted(leads, key=lambda lead: -lead.gain)


def scan_terms(
    problem: Problem, extension: Extension, noise: Diffusion, nuisance: F64 | None = None
) -> list[Lead]:
    """The dictionary's terms as leads, the best first."""
    columns = TermColumns.of(problem.drive, extension)
    passed = problem.passed(extension, noise, columns.wanted, keep=True)
    known = None if nuisance is None else nuisance[problem.train]
    normal = normal_equations(passed.sensitivities[problem.train], passed.innovations[problem.train], known)
    return columns.leads(normal)


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
        if candidate.name in UNIT_CHANGES:
            yield candidate, None, np.column_stack(UNIT_CHANGES[candidate.name](left, right))
        elif candidate.grid:
            (key,) = candidate.free
            scale = {"typical_effort": 2 * typical, "largest_effort": largest}.get(
                candidate.declaration.search.grid_unit, 1.0
            )
            for share in candidate.grid:
                value = share * scale
                means = extension.with_effect(candidate.name, {key: value}).mean_torques(drive)
                yield candidate, value, np.column_stack([means[0] - left, means[1] - right])


def linear_lead(normal: Normal, candidate: Candidate, columns: list[int], wheel_radius_m: float) -> Lead:
    """The best linear size of an effect; none where its sign is not a physical one."""
    gain, delta = normal.gain(columns)
    sizes = (from_place(p, float(d), wheel_radius_m) for p, d in zip(candidate.places, delta, strict=True))
    parameters = dict(zip(candidate.free, sizes, strict=True))
    outside = any(not low <= parameters[key] <= high for key, (low, high) in candidate.bounds.items())
    if outside and candidate.declaration.search.clipped:
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
