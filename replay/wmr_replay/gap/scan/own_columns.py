"""Users' effects in a scan: sensitivities by difference quotients of the filter's innovations."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.filter import FilterOutput
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.candidates import Candidate, own_candidates
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.score import NormalEquations, ScoredCandidate


@dataclass(frozen=True)
class OwnColumn:
    """One column of a scan: the effect at a point, per ``size`` of the change that the point makes.

    ``key`` is the parameter that the column is linear in; None for a point of a grid, which stands as it is.
    """

    candidate: Candidate
    point: Mapping[str, float]
    key: str | None
    size: float


@dataclass(frozen=True)
class OwnColumns:
    """The columns of every user's effect that the model does not hold yet."""

    extension: Extension | None = None
    columns: tuple[OwnColumn, ...] = ()

    @classmethod
    def of(cls, extension: Extension) -> "OwnColumns":
        """Those that are not in ``extension``."""
        new = (c for c in own_candidates() if c.name not in extension.effects)
        return cls(extension, tuple(column for candidate in new for column in columns_of(candidate)))

    def joined_to(self, output: FilterOutput, problem: Problem, noise: Diffusion) -> FilterOutput:
        """The pass with these columns behind its own sensitivities (n, 3, p): −∂e/∂parameter."""
        if not self.columns or self.extension is None:
            return output
        columns = []
        for column in self.columns:
            moved = self.extension.with_effect(column.candidate.name, column.point)
            e = problem.filtered(moved, noise).innovations
            columns.append((output.innovations - e) / column.size)
        own = np.stack(columns, axis=2)
        return output._replace(sensitivities=np.concatenate([output.sensitivities, own], axis=2))

    def scores(self, normal: NormalEquations, first: int) -> list[ScoredCandidate]:
        """Each effect at its best size, or at the best point of its grid; its columns begin at ``first``."""
        found = []
        for places in self.groups().values():
            columns = [self.columns[j] for j in places]
            score = linear if columns[0].key else gridded
            found.append(score(normal, columns, [first + j for j in places]))
        return found

    def groups(self) -> dict[str, list[int]]:
        """The places of each effect's columns."""
        found: dict[str, list[int]] = {}
        for j, column in enumerate(self.columns):
            found.setdefault(column.candidate.name, []).append(j)
        return found

    def information(self, normal: NormalEquations, first: int) -> dict[str, tuple[float, float]]:
        """By effect, the value of its first parameter at which its first column stands, and ψᵀψ."""
        diagonal = np.diag(normal.G)
        return {
            name: (self.value_of(places[0]), float(diagonal[first + places[0]]))
            for name, places in self.groups().items()
        }

    def value_of(self, place: int) -> float:
        """1 for a column per unit, else the first parameter at its point."""
        column = self.columns[place]
        return 1.0 if column.key else float(next(iter(column.point.values())))


NO_COLUMNS = OwnColumns()


def columns_of(candidate: Candidate) -> Iterator[OwnColumn]:
    """A column for each parameter that is linear from 0 on, the others held at their starts; or for each
    value of the grid of the first parameter.
    """
    declared = candidate.declaration.parameters
    held = {key: 0.0 if p.start is None else p.start for key, p in declared.items()}
    for value in candidate.grid:
        yield OwnColumn(candidate, {**held, candidate.free[0]: value}, None, 1.0)
    if candidate.grid:
        return
    for key, parameter in declared.items():
        if parameter.start is None:
            yield OwnColumn(candidate, {**held, key: parameter.step}, key, parameter.step)


def linear(normal: NormalEquations, columns: list[OwnColumn], places: list[int]) -> ScoredCandidate:
    """The best size; no gain where its sign is not a physical one."""
    gain, delta = normal.gain(places)
    candidate = columns[0].candidate
    sizes = {column.key: float(d) for column, d in zip(columns, delta, strict=True)}
    parameters = {key: sizes.get(key, columns[0].point[key]) for key in candidate.free}
    outside = any(not low <= parameters[key] <= high for key, (low, high) in candidate.bounds.items())
    return ScoredCandidate(candidate.name, parameters, 0.0 if outside else gain, 1)


def gridded(normal: NormalEquations, columns: list[OwnColumn], places: list[int]) -> ScoredCandidate:
    """The best point of the grid: the gain of a column at size 1 is 2 s − G."""
    gains = [float(2 * normal.s[j] - normal.G[j, j]) for j in places]
    best = int(np.argmax(gains))
    return ScoredCandidate(columns[0].candidate.name, dict(columns[best].point), gains[best], len(columns))
