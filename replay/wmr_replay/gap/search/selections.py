"""The selections of one log by the labels that they are made with, each made once.

With another model, an identifier often sees the same contact modes again.
"""

from collections.abc import Hashable

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.refit import Fit
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.search.begun import Begun, is_whole
from wmr_replay.gap.search.fit_candidates import Hints
from wmr_replay.gap.search.select import Selection, base_fit, forward_selection


class Selections:
    """Forward selections over the base model ``extension``, every row of the log fitted.

    Those on the whole of a long log begin with what is ``begun``, if anything is, and leave terms to the
    formula that is looked for behind them.
    """

    def __init__(self, extension: Extension, options: GapOptions, begun: Begun | None = None) -> None:
        self.extension, self.options, self.begun = extension, options, begun
        self._problems: dict[Hashable, Problem] = {}
        self._made: dict[Hashable, Selection] = {}

    def known(self, problem: Problem) -> Problem:
        """The first problem with the same labels, whose passes of the filter are known; else ``problem``."""
        return self._problems.setdefault(labels_of(problem), problem)

    def of(
        self, problem: Problem, *, terms: bool = True, hints: Hints = (), without: tuple[str, ...] = ()
    ) -> Selection:
        """:func:`~wmr_replay.gap.search.select.forward_selection`."""
        starts = tuple((name, tuple(parameters.items())) for name, parameters in hints)
        key = labels_of(problem), terms, starts, without
        if key not in self._made:
            same = self.known(problem)
            begun = self.begun if is_whole(same) else None
            terms = terms and not is_whole(same)
            self._made[key] = forward_selection(
                same, self.extension, self.options, terms=terms, hints=hints, begun=begun, without=without
            )
        return self._made[key]

    def base(self, problem: Problem) -> Fit:
        """The fit of the base model that a selection begins with; with the rests that the selection holds
        where the base model's misfit is known.
        """
        if self.extension.misfit:
            return self.of(problem).base
        return base_fit(self.known(problem), self.extension)


def labels_of(problem: Problem) -> Hashable:
    """Where the rows begin, the contact modes in the bins and in finer ones, how well their changes are
    known, and what they may leave out.
    """
    binned, track = problem.binned, problem.binned.track
    held: tuple[bytes, ...] = ()
    if track is not None:
        changes = np.flatnonzero(np.diff(track.mode, prepend=-1))
        held = track.t_ns[changes].tobytes(), track.mode[changes].tobytes()
    first_s = float(binned.t_s[0])
    return first_s, binned.mode.tobytes(), held, binned.margin, binned.names_skid
