"""The library's candidates as sensitivity columns, and their scores."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.effects.efforts import UNIT_CHANGES
from wmr_replay.effects.theta import from_place
from wmr_replay.gap.estimation.sensitivity import SensitivityTargets
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.candidates import EVERY, LIBRARY, SKID, Candidate
from wmr_replay.gap.model.dynamics import Row
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.local_effects import Patches, local_candidates, patches_of, time_cells
from wmr_replay.gap.scan.own_columns import OwnColumns
from wmr_replay.gap.scan.score import NormalEquations, ScoredCandidate
from wmr_schemas.arrays import F64, I64


@dataclass(frozen=True, eq=False)
class LibraryColumns:
    """The columns: θ of the ``linear`` candidates, ``changes`` of the efforts, losses in cells of time.

    A change is (candidate, value, efforts (n, 2)): per unit of its parameter (value None), or at a value of
    its grid.
    """

    binned: BinnedLog
    extension: Extension
    linear: tuple[Candidate, ...]
    changes: tuple[tuple[Candidate, float | None, F64], ...]
    cells: I64
    n_cells: int
    patches: Patches
    own: OwnColumns

    @classmethod
    def of(cls, binned: BinnedLog, extension: Extension) -> "LibraryColumns":
        """Those of every candidate that the model does not hold yet."""
        left_out = {*extension.effects, *(() if binned.names_skid else (SKID,))}
        library = EVERY if binned.settings.scan.held_too else LIBRARY
        linear = tuple(c for c in library if c.places and c.name not in left_out)
        changes = tuple(effort_changes(extension, binned, extension.rows(binned)))
        cells, n_cells = time_cells(binned)
        patches, own = patches_of(binned), OwnColumns.of(extension)
        return cls(binned, extension, linear, changes, cells, n_cells, patches, own)

    @property
    def targets(self) -> SensitivityTargets:
        """The columns as the filter takes them."""
        places = np.array([place for c in self.linear for place in c.places], np.int64)
        efforts = np.stack([change for _, _, change in self.changes])
        return SensitivityTargets(places, efforts, self.cells, self.n_cells)

    def scores(self, normal: NormalEquations) -> list[ScoredCandidate]:
        """Every candidate at its best, the largest gain first."""
        scored = [linear_score(normal, c, js, self.extension.wheel_radius_m) for c, js in self.groups()]
        first = sum(len(c.places) for c in self.linear)
        best: dict[str, ScoredCandidate] = {}
        for j, (candidate, value, _) in enumerate(self.changes, first):
            one = effort_score(normal, candidate, value, j)
            if candidate.name not in best or one.gain > best[candidate.name].gain:
                best[candidate.name] = one
        scored += best.values()
        after = first + len(self.changes)
        scored += local_candidates(normal, self.binned, self.patches, after, self.extension.effects)
        scored += self.own.scores(normal, after + 2 * self.n_cells)
        return sorted(scored, key=lambda one: -one.gain)

    def groups(self) -> Iterator[tuple[Candidate, list[int]]]:
        """The columns of each linear candidate."""
        column = 0
        for candidate in self.linear:
            k = len(candidate.places)
            yield candidate, list(range(column, column + k))
            column += k

    @staticmethod
    def leading(candidate: Candidate, columns: list[int]) -> list[int]:
        """The columns of the parameters that make an effect."""
        return [j for key, j in zip(candidate.free, columns, strict=True) if key not in candidate.absent]

    def information(self, normal: NormalEquations) -> dict[str, tuple[float, float]]:
        """By effect, the value at which its best seen column stands, and the column's ΨᵀΨ."""
        diagonal = np.diag(normal.G)
        seen = {c.name: (1.0, float(diagonal[self.leading(c, js)].min())) for c, js in self.groups()}
        first = sum(len(c.places) for c in self.linear)
        for j, (candidate, value, _) in enumerate(self.changes, first):
            this = (1.0 if value is None else value, float(diagonal[j]))
            if candidate.name not in seen or size_per_information(this) < size_per_information(
                seen[candidate.name]
            ):
                seen[candidate.name] = this
        return seen | self.own.information(normal, first + len(self.changes) + 2 * self.n_cells)


def size_per_information(seen: tuple[float, float]) -> float:
    """|value|/√information: the smaller, the better an effect is seen."""
    return abs(seen[0]) / float(np.sqrt(max(seen[1], 1e-30)))


def effort_changes(
    extension: Extension, binned: BinnedLog, rows: F64
) -> Iterator[tuple[Candidate, float | None, F64]]:
    """Changes (n, 2) of left and right effort: per unit of a parameter (value None), or at a grid's value."""
    left, right = rows[:, Row.LEFT], rows[:, Row.RIGHT]
    largest = float(np.max(np.abs(binned.torque.efforts_nm)))
    typical = float(np.median(np.abs(binned.torque.efforts_nm)))
    scales = {"typical_effort": 2 * typical, "largest_effort": largest}
    for candidate in LIBRARY:
        if candidate.name in extension.effects:
            continue
        if candidate.name in UNIT_CHANGES:
            yield candidate, None, np.column_stack(UNIT_CHANGES[candidate.name](left, right))
        elif candidate.grid:
            (key,) = candidate.free
            scale = scales.get(candidate.declaration.search.grid_unit, 1.0)
            for share in candidate.grid:
                value = share * scale
                means = extension.with_effect(candidate.name, {key: value}).mean_torques(binned)
                yield candidate, value, np.column_stack([means[0] - left, means[1] - right])


def linear_score(
    normal: NormalEquations, candidate: Candidate, columns: list[int], wheel_radius_m: float
) -> ScoredCandidate:
    """The best linear size of an effect; its gain is 0 where the sign is not a physical one. A parameter that
    may be absent is left out where its sign is none.
    """
    by_key = dict(zip(candidate.free, columns, strict=True))
    gain, parameters = linear_best(normal, candidate, by_key, wheel_radius_m)
    outside = {key for key in parameters if not is_within(candidate, key, parameters)}
    if outside and outside <= candidate.absent.keys():
        kept = {key: column for key, column in by_key.items() if key not in outside}
        gain, parameters = linear_best(normal, candidate, kept, wheel_radius_m)
        parameters, outside = {**candidate.absent, **parameters}, set()
    if outside and candidate.declaration.search.clipped:
        parameters = {k: float(np.clip(v, *candidate.bounds[k])) for k, v in parameters.items()}
        outside = set()
    return ScoredCandidate(candidate.name, parameters, 0.0 if outside else gain, 1)


def is_within(candidate: Candidate, key: str, parameters: Mapping[str, float]) -> bool:
    """Whether a parameter is a physical one beside the others."""
    low, high = candidate.bounds_at(key, parameters)
    return low <= parameters[key] <= high


def linear_best(
    normal: NormalEquations, candidate: Candidate, columns: Mapping[str, int], wheel_radius_m: float
) -> tuple[float, dict[str, float]]:
    """The gain and the sizes of least squares of some parameters of an effect, by their columns."""
    gain, delta = normal.gain(list(columns.values()))
    places = dict(zip(candidate.free, candidate.places, strict=True))
    sizes = zip(columns, delta, strict=True)
    return gain, {key: from_place(places[key], float(size), wheel_radius_m) for key, size in sizes}


def effort_score(
    normal: NormalEquations, candidate: Candidate, value: float | None, column: int
) -> ScoredCandidate:
    """The score of one column: at its best size, or, of a grid's value, at size 1: 2 s − G."""
    (key,) = candidate.free
    if value is None:
        gain, delta = normal.gain([column])
        return ScoredCandidate(candidate.name, {key: float(delta[0])}, gain, 1)
    gain = float(2 * normal.s[column] - normal.G[column, column])
    return ScoredCandidate(candidate.name, {key: value}, gain, len(candidate.grid))
