"""Contact modes for the analysis, from the identifier with the model as far as it is known."""

import numpy as np
import polars as pl

from wmr_replay.engine import Engine
from wmr_replay.gap.extension import Extension
from wmr_replay.memory import as_batch
from wmr_replay.model_effects import replay_model
from wmr_replay.settings import Settings
from wmr_replay.tables import samples_frame
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log, ModeTrack


def identified_modes(log: Log, extension: Extension) -> ModeTrack:
    """What the bank makes of the log with the extended model; undecided rows count as ideal."""
    effects = tuple(Effect(name, dict(parameters)) for name, parameters in extension.effects.items())
    engine = Engine(Settings(), replay_model(Model(effects=effects), log.robot))
    columns = [*engine.push(as_batch(Log(log.pose, log.torque, None, log.robot))), *engine.finish()]
    samples = pl.concat([samples_frame(c) for c in columns])
    mode = samples["mode"].to_numpy()
    return ModeTrack(samples["t_ns"].to_numpy().astype(np.int64), np.maximum(mode, 0).astype(np.int8))
