"""Contact modes for the analysis, from the identifier with the model as far as it is known."""

from dataclasses import replace

import numpy as np

from wmr_replay.effects.efforts import combined
from wmr_replay.gap.estimation.binned_log import Drive, drive_of
from wmr_replay.gap.model.extension import WEIGHTS, Extension, weight
from wmr_replay.pipeline.memory import replay_columns
from wmr_replay.pipeline.model_effects import FOLLOWED, replay_model
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log, ModeTrack

SWITCH_S = 0.3
"""How well an identifier knows when a mode begins or ends."""


def identified_modes(log: Log, extension: Extension) -> ModeTrack:
    """What the bank makes of the log with the extended model; undecided rows count as ideal."""
    log = as_it_acts(log, extension)
    model = replay_model(Model(effects=lasting_effects(extension)), log.robot)
    batches = replay_columns(Log(log.pose, log.torque, None, log.robot), model=model)
    t_ns, mode = (np.concatenate([columns[name] for columns in batches]) for name in ("t_ns", "mode"))
    return ModeTrack(t_ns, np.maximum(mode, 0).astype(np.int8))


def lasting_effects(extension: Extension) -> tuple[Effect, ...]:
    """Effects of the base model and new ones, but for those in time or space; two of a name add up."""
    found: dict[str, dict[str, float]] = {}
    for name, parameters in extension.acting:
        if name not in FOLLOWED:
            before = found.setdefault(name, {})
            for key, value in parameters.items():
                before[key] = combined(key, before.get(key), value)
    return tuple(Effect(name, parameters) for name, parameters in found.items())


def identified_drive(log: Log, track: ModeTrack) -> Drive:
    """The drive by modes that an identifier said, which knows their changes to ``SWITCH_S`` only."""
    return drive_of(log, track, margin_s=SWITCH_S)


def as_it_acts(log: Log, extension: Extension) -> Log:
    """Torques scaled where an effect in time or space takes traction away, or a load response ahead."""
    acting = [(name, p) for name, p in extension.acting if name in WEIGHTS]
    if not acting or log.torque is None:
        return log
    drive, torque = drive_of(log), log.torque
    ahead, turning = np.ones(len(drive)), np.ones(len(drive))
    for name, p in acting:
        acts = weight(name, p, drive)
        if name == "load_step":
            ahead /= 1 + p["mass_ratio"] * acts
        else:
            ahead *= 1 - p["loss"] * acts
            turning *= 1 - p["loss"] * acts
    seconds = (torque.t_ns - drive.start_ns) / NS_PER_S
    mean, half = (torque.left_nm + torque.right_nm) / 2, (torque.right_nm - torque.left_nm) / 2
    mean, half = mean * np.interp(seconds, drive.t_s, ahead), half * np.interp(seconds, drive.t_s, turning)
    return replace(log, torque=replace(torque, left_nm=mean - half, right_nm=mean + half))
