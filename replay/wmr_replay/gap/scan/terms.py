"""The dictionary's terms as sensitivity columns, and their scores."""

from dataclasses import dataclass

import numpy as np

from wmr_replay.gap.estimation.sensitivity import NO_TARGETS, SensitivityTargets
from wmr_replay.gap.model.binned_log import BinnedLog
from wmr_replay.gap.model.dictionary import as_efforts
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.own_columns import NO_COLUMNS, OwnColumns
from wmr_replay.gap.scan.score import NormalEquations, ScoredCandidate
from wmr_schemas.terms import COEFFICIENT


@dataclass(frozen=True, eq=False)
class TermColumns:
    """A column for each term, as a change of the efforts."""

    names: tuple[str, ...]
    targets: SensitivityTargets
    own: OwnColumns = NO_COLUMNS

    @classmethod
    def of(cls, binned: BinnedLog, extension: Extension) -> "TermColumns":
        """Those of all terms."""
        terms, changes = zip(*as_efforts(binned, extension.base), strict=True)
        return cls(tuple(term.name for term in terms), NO_TARGETS._replace(efforts=np.stack(changes)))

    def scores(self, normal: NormalEquations) -> list[ScoredCandidate]:
        """Every term at its best size, the largest gain first."""
        scored = []
        for j, name in enumerate(self.names):
            gain, delta = normal.gain([j])
            scored.append(ScoredCandidate(name, {COEFFICIENT: float(delta[0])}, gain, len(self.names)))
        return sorted(scored, key=lambda one: -one.gain)
