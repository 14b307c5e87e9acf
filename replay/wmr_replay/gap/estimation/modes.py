"""Contact modes from the identifier, with the model as far as it is known."""

from dataclasses import replace

import numpy as np

from wmr_replay.effects.efforts import combined
from wmr_replay.gap.model.binned_log import BinnedLog, bin_log, lasts_long
from wmr_replay.gap.model.candidates import LOCAL
from wmr_replay.gap.model.extension import WEIGHTS, Extension, change_by
from wmr_replay.gap.model.work import n_bins, work_on
from wmr_replay.gap.settings import GateSettings
from wmr_replay.identify.filter_bank import BankSettings
from wmr_replay.pipeline.bank_alone import modes_in_hindsight
from wmr_replay.pipeline.memory import hindsight_columns
from wmr_replay.pipeline.model_effects import FOLLOWED, replay_model
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack

LEAST_CONFIDENCE = Settings().min_confidence


def identified_modes(log: Log, extension: Extension, settings: GateSettings) -> ModeTrack:
    """The modes that the filter bank sees in hindsight with the extended model; undecided rows count as
    ideal.
    """
    log = replace(with_acting_torques(log, extension, settings), mode=None)
    model = replay_model(Model(effects=lasting_effects(extension)), log.robot)
    if model.accelerates:
        batches = hindsight_columns(log, model=model)
        t_ns, mode = (np.concatenate([columns[name] for columns in batches]) for name in ("t_ns", "mode"))
        mode = np.where(mode == ContactMode.UNDECIDED, ContactMode.IDEAL, mode)
        return ModeTrack(t_ns, mode.astype(np.int8))
    alpha_sd = settings.modes.alpha_sd if extension.acting else None
    bank = BankSettings(bin_s=settings.begun.bank_bin_s) if lasts_long(log.pose, settings) else None
    work_on(log.pose).add(settings.work.of_identifier * n_bins(log.pose, settings))
    start_ns, posterior = modes_in_hindsight(log, model, alpha_sd=alpha_sd, bank=bank)
    if not len(start_ns):
        return ModeTrack(log.pose.t_ns[:1], np.array([ContactMode.IDEAL], np.int8))
    sure = posterior.max(axis=0) >= LEAST_CONFIDENCE
    return ModeTrack(start_ns, np.where(sure, posterior.argmax(axis=0), ContactMode.IDEAL).astype(np.int8))


def lasting_effects(extension: Extension) -> tuple[Effect, ...]:
    """Known and new effects without those in time or space; two of one name are combined."""
    found: dict[str, dict[str, float]] = {}
    for name, parameters in extension.acting:
        if name not in FOLLOWED:
            before = found.setdefault(name, {})
            for key, value in parameters.items():
                before[key] = combined(key, before.get(key), value)
    return extension.with_forms(tuple(Effect(name, values) for name, values in found.items()))


def bin_identified(
    log: Log, track: ModeTrack, settings: GateSettings, *, names_skid: bool = False
) -> BinnedLog:
    """The log in bins, with modes from an identifier, which knows their changes to 0.3 s only.

    A skid that it missed is no effect, but a mode. With ``names_skid`` one is tried all the same, where the
    identifier's skidding was taken out to see what else may look like it.
    """
    margin_s = settings.bins.identified_switch_s
    return bin_log(log, settings, track, margin_s=margin_s, names_skid=names_skid)


def with_acting_torques(log: Log, extension: Extension, settings: GateSettings) -> Log:
    """The log with torques scaled by the effects in time or space.

    A load scales the mean of both efforts by 1/(1 + p), a loss of traction both efforts by 1 − loss.
    """
    acting = [(name, p) for name, p in extension.acting if name in WEIGHTS]
    if not acting or log.torque is None:
        return log
    binned, torque = bin_log(log, settings), log.torque
    load, *losses = (change_by(name, acting, binned) for name in ("load_step", *LOCAL))
    turning = np.prod([1 - loss for loss in losses], axis=0)
    ahead = turning / (1 + load)
    seconds = (torque.t_ns - binned.start_ns) / NS_PER_S
    mean, half = (torque.left_nm + torque.right_nm) / 2, (torque.right_nm - torque.left_nm) / 2
    mean, half = mean * np.interp(seconds, binned.t_s, ahead), half * np.interp(seconds, binned.t_s, turning)
    return replace(log, torque=replace(torque, left_nm=mean - half, right_nm=mean + half))
