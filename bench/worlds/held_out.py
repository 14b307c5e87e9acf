"""The held-out predictive score of a model on a log, its contact modes known causally.

Score: mean −log density of a held-out bin's pose (x, y and yaw), predicted from earlier rows. The modes at t
are those that a replay with the model says at t, from what was seen until t: smoothed ones would absorb what
the model lacks for slip and skid. The disturbances are fitted to the other rows. The true model is the base
model with what is hidden, in its declared form at the size that comes nearest.
"""

from typing import Any

import numpy as np

from wmr_replay.gap import GapOptions
from wmr_replay.gap.analyse import base_model
from wmr_replay.gap.estimation.diffusion import fit_diffusion
from wmr_replay.gap.estimation.modes import bin_identified, lasting_effects, with_acting_torques
from wmr_replay.gap.estimation.problem import Problem
from wmr_replay.gap.estimation.slip_disturbance import with_slip_disturbance
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.settings import GateSettings
from wmr_replay.pipeline.memory import replay_columns
from wmr_replay.pipeline.model_effects import replay_model
from wmr_schemas.model_file import Model
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack
from worlds.case import World

Row = dict[str, Any]


def causal_modes(log: Log, extension: Extension, gates: GateSettings) -> ModeTrack:
    """The modes that a replay with the model says at each row, from the rows until then."""
    acting = with_acting_torques(log, extension, gates)
    model = replay_model(Model(effects=lasting_effects(extension)), log.robot)
    parts = list(replay_columns(acting, model=model))
    t_ns, mode = (np.concatenate([part[name] for part in parts]) for name in ("t_ns", "mode"))
    mode = np.where(mode == ContactMode.UNDECIDED, ContactMode.IDEAL, mode)
    return ModeTrack(t_ns, mode.astype(np.int8))


def score_of(log: Log, extension: Extension) -> float:
    """Mean −log density of the held-out bins."""
    gates = GateSettings()
    track = causal_modes(log, extension, gates)
    problem = Problem.of(bin_identified(log, track, gates))
    gates = with_slip_disturbance(problem, extension)
    problem = Problem.of(bin_identified(log, track, gates))
    noise = fit_diffusion(problem, extension, iterations=gates.budget.base_diffusion)
    return float(0.5 * problem.filtered(extension, noise).deviance[~problem.train].mean())


def held_out_scores(world: World, row: Row) -> Row:
    """Scores of the base model, of the one that the analysis names, and of the true one."""
    log = world.without_modes()
    base = base_model(log, None, GapOptions()).extension
    named = base
    for effect in row.get("effects", ()):
        named = named.with_effect(effect["name"], {k: v[0] for k, v in effect["parameters"].items()})
    true = base
    if world.case.effect:
        true = base.with_effect(world.case.effect, world.sizes | row["fitted"])
    scores = {"base": score_of(log, base)}
    scores["true"] = score_of(log, true) if world.case.effect else scores["base"]
    scores["named"] = score_of(log, named) if row.get("effects") else scores["base"]
    return {"held_out": scores}
