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
from wmr_replay.excite.settings import ExciteSettings
from wmr_replay.excite.sizes import Parameters, points_of, sizes_tried
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.model.binned_log import bin_log
from wmr_replay.gap.model.candidates import candidate_of
from wmr_replay.gap.settings import GateSettings
from wmr_schemas.arrays import F64, I64

SEEN = 1e-9
"""Information below which a signature counts as none."""


@dataclass(frozen=True, eq=False)
class Column:
    """An effect at a point: one signature."""

    name: str
    parameters: Mapping[str, float]


@dataclass(frozen=True)
class Rival:
    """A way in which an effect may be fitted: columns, and the factors by which they may be scaled."""

    columns: tuple[int, ...]
    least: float = -np.inf
    most: float = np.inf


@dataclass(frozen=True, eq=False)
class Columns:
    """The signatures that are looked at.

    ``truths`` are the columns of each effect where it is missing, ``rivals`` the ways in which it is fitted;
    ``nuisance`` the columns that are always fitted too. Places in ``columns``.
    """

    names: tuple[str, ...]
    columns: tuple[Column, ...]
    truths: Mapping[str, list[int]]
    rivals: Mapping[str, list[Rival]]
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
        rivals: dict[str, list[Rival]] = {}
        for name in names:
            points = points_of(name, question.extension, question.sizes.get(name))
            truths[name] = places(name, points)
            rivals[name] = [Rival(tuple(truths[name]))]
            if candidate_of(name).grid:
                each_way = settings.rival_sizes if name in question.names else 1
                tried = sizes_tried(name, points[0], settings.rival_ratio, each_way)
                rivals[name] = neighbours(places(name, tried), settings.rival_ratio)
        nuisance = [
            k for name in question.nuisance for k in places(name, points_of(name, question.extension, None))
        ]
        return cls(names, tuple(found), truths, rivals, nuisance)

    @cached_property
    def truth_rows(self) -> I64:
        """Places (t,) of the truths, effect by effect."""
        return np.array([k for name in self.names for k in self.truths[name]])

    @cached_property
    def truth_starts(self) -> I64:
        """Where each effect's truths begin."""
        return np.cumsum([0, *(len(self.truths[name]) for name in self.names[:-1])])

    @cached_property
    def rival_starts(self) -> I64:
        """Where each effect's rivals begin, in the order of the effects."""
        return np.cumsum([0, *(len(self.rivals[name]) for name in self.names[:-1])])

    @cached_property
    def sizes(self) -> I64:
        """Number of parameters of each effect."""
        return np.array([len(self.columns[self.truths[name][0]].parameters) for name in self.names])


def neighbours(places: list[int], ratio: float) -> list[Rival]:
    """Sizes in ascending order, each for the sizes up to half-way to the next; the ends for all beyond."""
    half, last = ratio**0.5, len(places) - 1
    return [
        Rival((place,), 0.0 if k == 0 else 1 / half, np.inf if k == last else half)
        for k, place in enumerate(places)
    ]


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
    rows, starts = columns.truth_rows, columns.truth_starts
    own = np.diag(G)[rows]
    left = np.stack(
        [unexplained(G, own, rows, rival) for name in columns.names for rival in columns.rivals[name]]
    )
    by_rival = np.minimum.reduceat(left, columns.rival_starts, axis=0)
    D = np.minimum.reduceat(by_rival, starts, axis=1).T
    np.fill_diagonal(D, np.minimum.reduceat(own, starts))
    return np.asarray(np.maximum(D, 0.0))


def unexplained(G: F64, own: F64, rows: I64, rival: Rival) -> F64:
    """Squared length (t,) of what a rival leaves of each truth at the best factor that it may have; ``own``
    (t,) are the truths' own.
    """
    if len(rival.columns) > 1:
        return np.asarray(np.diag(without(G, list(rival.columns)))[rows])
    (j,) = rival.columns
    if not G[j, j] > SEEN:
        return own
    products = G[rows, j]
    factor = np.minimum(np.maximum(products / G[j, j], rival.least), rival.most)
    return np.asarray(own - 2 * factor * products + factor**2 * G[j, j])


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
