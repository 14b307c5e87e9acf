"""What a drive would show of each effect, as the gap analysis' filter sees it.

The signature of an effect is the change of the whitened innovations when it is missing, e(base) − e(base with
it): pose noise, the disturbance and the unknown start are accounted for by the filter. Two drives that both
begin and end at rest have signatures that stand beside one another, so their Gram matrices add.

If effect i is missing, rival j explains all but

    D_ij = min over the size of j of Σ(signature_i − signature_j)²

of the expected drop of the deviance: the T-criterion of Atkinson and Fedorov (Biometrika 62 (1975) 57) for
two rival models, after Hunter and Reiner (1965) and Box and Hill (1967).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from wmr_replay.excite.profile import Profile, Reached
from wmr_replay.excite.question import Question
from wmr_replay.excite.sizes import Parameters, points_of, rivals_of
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.settings import GateSettings
from wmr_replay.gap.settings.excite import ExciteSettings
from wmr_schemas.arrays import F64, I64

SEEN = 1e-9
"""Information below which a signature counts as none."""


@dataclass(frozen=True, eq=False)
class Column:
    """An effect at a point: one signature."""

    name: str
    parameters: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Columns:
    """The signatures that are looked at.

    ``truths`` are the columns of each effect where it is missing, ``rivals`` the groups of columns that stand
    for it where it is fitted; ``nuisance`` the columns that are always fitted too. Places in ``columns``.
    """

    names: tuple[str, ...]
    columns: tuple[Column, ...]
    truths: Mapping[str, list[int]]
    rivals: Mapping[str, list[list[int]]]
    nuisance: list[int]

    @classmethod
    def of(cls, names: tuple[str, ...], question: Question, settings: ExciteSettings) -> "Columns":
        """Those of the effects ``names``, and of what the base model's calibration leaves open."""
        found: list[Column] = []

        def places(name: str, points: Iterable[Parameters]) -> list[int]:
            start = len(found)
            found.extend(Column(name, point) for point in points)
            return list(range(start, len(found)))

        truths: dict[str, list[int]] = {}
        rivals: dict[str, list[list[int]]] = {}
        for name in names:
            points = points_of(name, question.extension, question.sizes.get(name))
            truths[name] = places(name, points)
            groups = rivals_of(name, points, settings.rival_sizes)
            rivals[name] = [truths[name] if g == points else places(name, g) for g in groups]
        nuisance = [
            k for name in question.nuisance for k in places(name, points_of(name, question.extension, None))
        ]
        return cls(names, tuple(found), truths, rivals, nuisance)

    @cached_property
    def sizes(self) -> I64:
        """Number of parameters of each effect."""
        return np.array([len(self.columns[self.truths[name][0]].parameters) for name in self.names])


def gram(profile: Profile, question: Question, columns: Columns, settings: ExciteSettings) -> F64:
    """Products (m, m) of the signatures on a drive, summed over its rows."""
    problem = problem_of(profile, question, settings)
    extension, noise = question.extension, question.noise
    e = problem.filtered(extension, noise).innovations
    signatures = np.stack(
        [
            (e - problem.filtered(extension.with_effect(c.name, c.parameters), noise).innovations).ravel()
            for c in columns.columns
        ]
    )
    return np.asarray(signatures @ signatures.T)


def problem_of(profile: Profile, question: Question, settings: ExciteSettings) -> Problem:
    """The drive as a log without noise, weighed by the noise that a real one would have."""
    gates = GateSettings()
    gates = replace(gates, bins=replace(gates.bins, least_rows=2))
    binned = bin_log(Reached.of(profile, settings.step_s).log(question.extension.base), gates)
    return Problem.of(replace(binned, noise_sd=np.array(question.pose_sd)))


def separations(G: F64, columns: Columns) -> F64:
    """D (e, e): of each effect (row) where it is missing, what each rival (column) leaves unexplained; on the
    diagonal, what nothing at all leaves. The worst direction of an effect counts, and the best rival size.
    """
    G = without(G, columns.nuisance)
    n = len(columns.names)
    D = np.zeros((n, n))
    rows = [columns.truths[name] for name in columns.names]
    own = np.diag(G)
    for i in range(n):
        D[i, i] = max(float(own[rows[i]].min()), 0.0)
    for j, name in enumerate(columns.names):
        left = np.min([np.diag(without(G, group)) for group in columns.rivals[name]], axis=0)
        for i in range(n):
            if i != j:
                D[i, j] = max(float(left[rows[i]].min()), 0.0)
    return D


def without(G: F64, group: list[int]) -> F64:
    """The products (m, m) of what is left when the columns of ``group`` are projected out."""
    seen = [k for k in group if G[k, k] > SEEN]
    if not seen:
        return G
    inside = G[np.ix_(seen, seen)]
    inside = inside + 1e-12 * np.diag(np.diag(inside))
    return np.asarray(G - G[:, seen] @ np.linalg.solve(inside, G[seen]))


def expected_bic(D: F64, columns: Columns, n_rows: int) -> F64:
    """Expected BIC of each rival (column) less that of the effect (row) which is missing."""
    price = np.log(max(3 * n_rows, 2))
    extra = (columns.sizes[None, :] - columns.sizes[:, None]) * price
    alone = -columns.sizes * price
    return np.asarray(D + np.where(np.eye(len(D), dtype=bool), alone[:, None], extra))
