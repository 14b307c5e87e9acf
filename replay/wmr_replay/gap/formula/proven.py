"""A formula that passes the gates, and the library's effects that it stands beside."""

from dataclasses import dataclass

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.evidence.holdout import Proof
from wmr_replay.gap.formula.formula import Formula
from wmr_replay.gap.formula.gates import of_proven_channels, why_not
from wmr_replay.gap.formula.groups import Tried
from wmr_replay.gap.formula.modes import Start
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.fit_candidates import FittedCandidate
from wmr_replay.gap.search.select import Selection
from wmr_schemas.effects import UNNAMED_PREFIX


@dataclass(frozen=True, eq=False)
class Proven:
    """A formula that passes the gates on a problem."""

    problem: Problem
    base: Fit
    formula: Formula
    proof: Proof

    @property
    def model(self) -> Start:
        """The formula as a model with its modes."""
        formula = self.formula
        return Start(self.problem, formula.fit, formula.rest.extension, formula.price(self.problem))


def proven(problem: Problem, base: Fit, formula: Formula, tried: Tried, options: GapOptions) -> Proven | None:
    """What of a formula passes the gates, each channel beside the other; None where that is nothing."""
    formula = of_proven_channels(problem, formula, tried, options)
    failed, proof = why_not(problem, formula, tried, options)
    return Proven(problem, base, formula, proof) if not failed and proof is not None else None


def library_of(selection: Selection) -> tuple[FittedCandidate, ...]:
    """The effects of the library in a selection."""
    return tuple(f for f in selection.found if not f.name.startswith(UNNAMED_PREFIX))
