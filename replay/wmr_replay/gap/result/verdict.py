"""The verdict of a selection, and the notes that say why it is no firmer."""

from itertools import chain

import numpy as np

from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.evidence.excitation import excitation_ratios
from wmr_replay.gap.result.result import FoundEffect, Verdict
from wmr_replay.gap.search.fit_candidates import ANSWERED, ONE_CHANNEL
from wmr_replay.gap.search.seen_slipping import LESS
from wmr_replay.gap.search.select import Selection
from wmr_schemas.effects import UNNAMED_PREFIX


def verdict_of(
    problem: Problem, effects: tuple[FoundEffect, ...], selection: Selection, hidden: tuple[str, ...]
) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict, and notes that say why it is no firmer.

    An effect of the library that passes every gate is named, whatever a formula describes beside it.
    ``hidden`` are the effects of a relevant size that the log would not have shown.
    """
    settings = problem.settings
    named = [effect for effect in effects if not effect.name.startswith(UNNAMED_PREFIX)]
    if effects and not named:
        return "unnamed", forms_note(selection)
    if named:
        close = [
            f"{e.name} and {a.name} explain the log almost equally well"
            for e in named
            for a in e.alternatives
            if a.delta_bic < settings.report.ambiguous_bic
        ]
        return ("ambiguous", tuple(close)) if close else ("named", ())
    if selection.refused:
        return "not_enough_excitation", (selection.refused,)
    calm = calm_note(problem, selection) or answered_note(selection) or one_channel_note(selection)
    if calm:
        return "not_enough_excitation", (calm,)
    if len(hidden) > settings.detectable.most_unseen:
        return "not_enough_excitation", ("the log would not have shown " + ", ".join(hidden),)
    return "nothing_missing", ()


def forms_note(selection: Selection) -> tuple[str, ...]:
    """Which effects of the library a formula has terms of, and why each is not named."""
    return tuple(
        f"a term is the form of {name}, which is not named: {why}" for name, why in selection.not_named
    )


def what_to_drive(verdict: Verdict) -> tuple[str, ...]:
    """Where another drive would say more: what designs it."""
    if verdict not in ("ambiguous", "not_enough_excitation"):
        return ()
    return ("`wmr-replay excite --from gap.json` designs a drive that would tell",)


def slipping_note(problem: Problem) -> tuple[str, ...]:
    """That identified slipping may hide a loss of traction, with its duration and beginning."""
    binned = problem.binned
    seconds = float(binned.step_s[binned.slips].sum())
    if not binned.identified or seconds < problem.settings.slip.shortest_inside_s:
        return ()
    first_s = float(binned.t_s[int(np.argmax(binned.slips))])
    return (
        f"slipping is identified for {seconds:.1f} s, first at {first_s:.1f} s: a loss of traction of its "
        "size in those times or places cannot be told from it",
    )


def less_than_slipping_note(selection: Selection) -> tuple[str, ...]:
    """Which effects would explain less than the slipping that is named, and so are not tested beside it."""
    less = tuple(one.name for one in selection.dropped if one.failed == LESS)
    if not less:
        return ()
    return (
        f"{' and '.join(less)} would explain some of it, too, but less than the slipping: analyse a part "
        "without it (--start, --end) to see what else is missing",
    )


def answered_note(selection: Selection) -> str:
    """That a lag or a gain explains no more than an answer to the disturbance; empty where none does."""
    for one in chain.from_iterable(selection.stages):
        if one.failed == ANSWERED:
            return (
                f"{one.name} would explain part of it, but a controller that answers the disturbance makes "
                "as much of it where nothing is missing"
            )
    return ""


def one_channel_note(selection: Selection) -> str:
    """That a lag is seen in one of the channels alone; empty where none is."""
    for one in chain.from_iterable(selection.stages):
        if one.failed == ONE_CHANNEL:
            return (
                f"{one.name} would explain part of it, but not ahead and in turning alike, as torques that "
                "act late would: something else is late, such as swivel casters that follow a turn"
            )
    return ""


def calm_note(problem: Problem, selection: Selection) -> str:
    """Why nothing found does not mean nothing missing; empty where it does."""
    least = problem.settings.excitation.least_ratio
    ahead, turning = excitation_ratios(problem, selection.fit.extension, selection.fit.noise)
    if min(ahead, turning) >= least:
        return ""
    what, ratio, sd = (
        ("longitudinal acceleration", ahead, selection.fit.noise.long_sd_mps2)
        if ahead < turning
        else ("turning", turning, selection.fit.noise.yaw_sd_mps2)
    )
    return (
        f"the {what} that the torques ask for varies by only {ratio:.1f} times a disturbance of {sd:.2g} "
        f"m/s² that no candidate explains (at least {least:g} times are needed)"
    )
