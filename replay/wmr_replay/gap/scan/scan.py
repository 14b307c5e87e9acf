"""One pass of the filter scores every candidate at once.

What the model holds already is projected out of sensitivities and innovations (:mod:`.score`).
"""

from dataclasses import dataclass

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.library import LibraryColumns
from wmr_replay.gap.scan.score import NormalEquations, ScoredCandidate, normal_equations
from wmr_replay.gap.scan.terms import TermColumns
from wmr_schemas.arrays import F64


@dataclass(frozen=True, eq=False)
class LibraryScan:
    """All candidates, the largest gain first; by effect, the value at which its best seen column stands and
    the column's ΨᵀΨ.
    """

    scored: list[ScoredCandidate]
    unit_information: dict[str, tuple[float, float]]


def scan(
    problem: Problem, extension: Extension, noise: Diffusion, nuisance: F64 | None = None
) -> LibraryScan:
    """Score the library. ``nuisance`` (n, 3, q): sensitivities to what the model holds already."""
    columns = LibraryColumns.of(problem.binned, extension)
    normal = equations_of(problem, extension, noise, columns, nuisance)
    return LibraryScan(columns.scores(normal), columns.information(normal))


def scan_terms(
    problem: Problem, extension: Extension, noise: Diffusion, nuisance: F64 | None = None
) -> list[ScoredCandidate]:
    """Score the dictionary's terms, the largest gain first."""
    columns = TermColumns.of(problem.binned, extension)
    return columns.scores(equations_of(problem, extension, noise, columns, nuisance))


def equations_of(
    problem: Problem,
    extension: Extension,
    noise: Diffusion,
    columns: LibraryColumns | TermColumns,
    nuisance: F64 | None,
) -> NormalEquations:
    """The normal equations of the columns over the fitted rows."""
    output = problem.filtered(extension, noise, columns.targets, keep=True)
    output = columns.own.joined_to(output, problem, noise)
    psi, e, train = output.sensitivities, output.innovations, problem.train
    return normal_equations(psi, e, nuisance, problem.settings.refit, train)
