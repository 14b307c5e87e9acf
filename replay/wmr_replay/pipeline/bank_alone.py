"""The contact modes of a whole log in memory, in hindsight, by the filter bank alone.

A replay differentiates the pose too, judges its quality and tells every row. Who asks for the modes only, and
knows the robot, needs none of that: the same rows, repaired alike, go through the same bank twice.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wmr_replay.align import SampleBatch, concatenate
from wmr_replay.identify.filter_bank import Bank, BankSettings, torque_model
from wmr_replay.identify.filter_bank.bins import Bins, into_bins, open_bin
from wmr_replay.pipeline.intake import Intake, stretch_length
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.repairing import Repairing
from wmr_replay.pipeline.settings import Settings
from wmr_replay.pipeline.stretch import initial_levels
from wmr_replay.pipeline.whole_colour import whole_colour
from wmr_schemas.arrays import F64, I64, NS_PER_S
from wmr_schemas.signals import Log

N_MODES = 3


class ModesInHindsight(NamedTuple):
    """m consecutive intervals: their starts in ns (m,), and the posterior by mode (4, m)."""

    start_ns: I64
    posterior: F64


def modes_in_hindsight(
    log: Log,
    model: ReplayModel,
    settings: Settings | None = None,
    *,
    alpha_sd: float | None = None,
    bank: BankSettings | None = None,
) -> ModesInHindsight:
    """The modes of ``log`` by ``model``, whose α is known, its logarithm to ``alpha_sd`` (default: the
    bank's), and which has no accelerations of users' effects.

    There is no interval where the log is too short for the bank to start.
    """
    settings, settings_of_bank = settings or Settings(), bank or BankSettings()
    intake = Intake(settings, model)
    rows = concatenate([intake.push(as_batch(log)), intake.finish()])
    n_stretch = stretch_length(rows, settings) if len(rows) else 0
    if n_stretch >= len(rows):
        return ModesInHindsight(np.empty(0, np.int64), np.empty((4, 0)))
    stretch = rows.part(slice(n_stretch))
    levels = initial_levels(stretch.without_outliers())
    driven = torque_model(model.robot, settings_of_bank, model.terms)
    if alpha_sd is not None:
        driven = replace(driven, prior=driven.prior._replace(ln_alpha_sd=alpha_sd))
    identifier = Bank(driven, levels.step_s, settings_of_bank, N_MODES)
    kept = rows.without_outliers()
    colour = whole_colour((kept.t_ns - kept.t_ns[0]) / NS_PER_S, kept.pose)
    repairing = Repairing(levels, stretch, settings.noise_time_constant_s)
    pieces = list(first_pass(identifier, rows, repairing, colour.factor))
    second = identifier.looking_back(settings.hindsight_lag_s)
    found = [] if second is None else [*(second.push(bins) for bins in pieces), second.finish()]
    ends = np.concatenate([np.empty(0, np.int64), *(part.end_ns for part in found)])
    posterior = np.concatenate([np.empty((4, 0)), *(part.posterior for part in found)], axis=1)
    return ModesInHindsight(np.concatenate([rows.t_ns[:1], ends + 1])[: len(ends)], posterior)


def first_pass(bank: Bank, rows: SampleBatch, repairing: Repairing, factor: F64) -> Iterator[Bins]:
    """Bins of the repaired rows, which the bank has been through; ``factor`` (2,) on the variances."""
    none, state = np.empty(0), open_bin()
    while len(rows):
        n = repairing.rows_left(rows)
        if not n:
            bank.change_rate(repairing.change_rate(int(rows.t_ns[0])).step_s)
            continue
        kept, rows = repairing.push(rows.part(slice(n))).without_outliers(), rows.part(slice(n, None))
        variances = factor[:, None] * repairing.variances(kept)
        known = kept.t_ns, kept.pose, kept.inputs[:2], variances, kept.restarts
        bins, _ = into_bins(*known, bank.rows_per_bin, state)
        bank.push(bins, none, none, np.empty(0, np.int64))
        yield bins
