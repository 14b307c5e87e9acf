"""What a drive shall answer, out of a result of ``gap``, a model or a robot."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np

from wmr_replay.excite import Question
from wmr_replay.excite.confounded import drivable
from wmr_replay.excite.settings import ExciteSettings
from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.base import BaseModel
from wmr_replay.gap.model.binned_log import noise_of
from wmr_replay.gap.model.extension import WEIGHTS, Extension
from wmr_replay.gap.settings import GateSettings
from wmr_replay.ingest import Between, LogPath
from wmr_replay.ingest.tracks import read_whole
from wmr_schemas.effects import UNNAMED_PREFIX, declared
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.gap_file import Estimate, GapFile
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.model_file import Effect, Model, NoiseModel, parse_effect, split_sd
from wmr_schemas.robot import RobotParameters

NEAR_BIC = GateSettings().report.ambiguous_bic
MOST_HELD_BACK = 4
"""Candidates of a poorly excited log that are asked for."""


def question_about(model: Model, names: tuple[str, ...]) -> Question:
    """Which of ``names`` a robot of this model lacks; any effect of the library where none is named."""
    base = BaseModel(model.robot, model.effects, "model file", misfit=model.misfit)
    own = ExciteSettings()
    position_sd = model.noise.position_sd_m or own.position_sd_m
    pose_sd = (position_sd, position_sd, model.noise.yaw_sd_rad or own.yaw_sd_rad)
    return Question(base.extension, names, diffusion_of(model.noise), pose_sd, library=not names)


def diffusion_of(noise: NoiseModel) -> Diffusion:
    """The disturbance of a model file, of the prior's correlation times; the prior's where it has none."""
    own = GateSettings().diffusion
    long_sd, long_tau, yaw_sd, yaw_tau, lat_sd = own.start
    long, yaw = noise.disturbance_longitudinal_mps2_rthz, noise.disturbance_yaw_mps2_rthz
    return Diffusion(
        long_sd if long is None else max(long, 1e-6) / (2 * long_tau) ** 0.5,
        long_tau,
        yaw_sd if yaw is None else max(yaw, 1e-6) / (2 * yaw_tau) ** 0.5,
        yaw_tau,
        lat_sd,
        own.lateral_tau_s,
    )


def question_of_gap(gap: GapFile, model: Model, names: tuple[str, ...] = ()) -> Question:
    """What a result leaves open: the rivals of an ambiguous verdict, the candidates that a poorly excited
    log held back, or, where there is none, any effect of the library; ``names`` in their place, where given.

    ``model`` is the result's, with the effects that were found. Raises InvalidSetting for a result on wheel
    speeds, and for one that leaves nothing open.
    """
    if gap.base_model != "torque":
        raise InvalidSetting(
            "drives are designed for models that torques drive; this result is on wheel speeds, where the "
            "motion follows from the wheels and any turning drive at several speeds shows what is missing"
        )
    asked = names
    kept: tuple[str, ...] = ()
    if not names and gap.verdict == "ambiguous":
        asked, kept = open_pair(gap)
    elif not names and gap.verdict == "not_enough_excitation":
        asked = held_back(gap)
    elif not names:
        raise InvalidSetting(
            f"the verdict is {gap.verdict.replace('_', ' ')}: nothing is left open. Name the effects to be "
            "told apart with --separate A,B"
        )
    question = question_about(replace(model, effects=base_effects(gap, model)), asked)
    sizes = {e.name: sized for e in gap.effects if (sized := size_of(e.parameters))}
    library = gap.verdict == "not_enough_excitation" and not names
    return replace(
        question,
        extension=with_kept(question, gap, kept),
        sizes={name: size for name, size in sizes.items() if name in asked},
        nuisance=tuple(name for name in gap.unnameable if name != "drive_gain"),
        noise=calmer(question.noise) if gap.verdict == "not_enough_excitation" else question.noise,
        library=library,
    )


def calmer(noise: Diffusion) -> Diffusion:
    """The disturbance, no larger than the prior's: where nothing was named, what is missing may be in it."""
    long_sd, _, yaw_sd, *_ = GateSettings().diffusion.start
    return noise._replace(
        long_sd_mps2=min(noise.long_sd_mps2, long_sd), yaw_sd_mps2=min(noise.yaw_sd_mps2, yaw_sd)
    )


def open_pair(gap: GapFile) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The first effect with close alternatives and those, and the names of the other effects found."""
    for effect in gap.effects:
        close = [a.name for a in effect.alternatives if a.delta_bic is not None and a.delta_bic < NEAR_BIC]
        drive = [n for n in (effect.name, *close) if not n.startswith(UNNAMED_PREFIX)]
        if len(drive) > 1:
            return tuple(drive), tuple(e.name for e in gap.effects if e.name not in drive)
    raise InvalidSetting(
        "the result has no two effects of the library to be told apart: name them with --separate"
    )


def held_back(gap: GapFile) -> tuple[str, ...]:
    """The candidates of the first stage that would explain something, as far as drives can show them."""
    known = drivable()
    found = [c.name for c in gap.candidates if c.stage == 0 and c.score is not None and c.score > 0]
    return tuple(dict.fromkeys(name for name in found if name in known))[:MOST_HELD_BACK]


def size_of(parameters: Mapping[str, Estimate]) -> dict[str, float]:
    """The estimates of an effect by name; empty where one is unknown."""
    known = {key: p.value for key, p in parameters.items() if p.value is not None}
    return known if len(known) == len(parameters) else {}


def base_effects(gap: GapFile, model: Model) -> tuple[Effect, ...]:
    """The effects of the base model: the extended one's less what was found."""
    found = {e.name: size_of(e.parameters) for e in gap.effects}
    return tuple(left for effect in model.effects for left in less(effect, found.get(effect.name)))


def less(effect: Effect, found: dict[str, float] | None) -> Iterator[Effect]:
    """A model's effect without what was found of it, where something is left."""
    if found is None:
        yield effect
        return
    left = {key: value - found.get(key, 0.0) for key, value in effect.parameters.items()}
    size = hypot(*effect.parameters.values())
    if declared(effect.name).zero_is_absent and hypot(*left.values()) > 1e-9 * size:
        yield replace(effect, parameters=left, sd={})


def with_kept(question: Question, gap: GapFile, kept: tuple[str, ...]) -> Extension:
    """The base model with the effects that are missing for sure, which are fitted beside the others."""
    extension = question.extension
    for effect in gap.effects:
        sizes = size_of(effect.parameters)
        if effect.name in kept and effect.name not in WEIGHTS and sizes:
            extension = extension.with_effect(effect.name, sizes)
    return extension


def model_of_gap(path: Path, gap: GapFile) -> Model:
    """The extended model that a gap.json holds. Raises InvalidFile."""
    robot, robot_sd = split_sd(path, "model.robot", gap.model.robot)
    return Model(
        robot=RobotParameters.from_values(robot, str(path)),
        robot_sd=robot_sd,
        noise=NoiseModel(**gap.model.noise),
        effects=tuple(parse_effect(path, index, entry) for index, entry in enumerate(gap.model.effects)),
        misfit=dict(gap.model.misfit),
    )


def model_of_log(path: LogPath, mapping: LogMapping, between: Between) -> Model:
    """The robot that a log states, and the noise of its poses. Raises LogUnusable."""
    log = read_whole(path, mapping, between).log
    measured = np.stack([log.pose.x_m, log.pose.y_m, np.unwrap(log.pose.yaw_rad)], axis=1)
    position_sd, _, yaw_sd = noise_of(log.pose, measured, GateSettings().bins).tolist()
    return Model(robot=log.robot, noise=NoiseModel(position_sd_m=position_sd, yaw_sd_rad=yaw_sd))
