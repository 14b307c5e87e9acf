"""What a drive shall answer: the base model, the effects to tell apart and their sizes, and the noise."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from wmr_replay.gap.estimation.process_noise import Diffusion
from wmr_replay.gap.model.extension import Extension

Parameters = Mapping[str, float]


@dataclass(frozen=True)
class Question:
    """``names``: effects to be told from one another, at least one; a single one is told from the library.

    ``extension`` is the base model, with what is missing for sure among its effects. ``sizes`` are known
    parameters by effect; of others a plausible size is taken. ``nuisance`` are effects that the base model's
    own calibration leaves open. ``pose_sd`` is (m, m, rad); ``library`` says that any effect may be missing.
    """

    extension: Extension
    names: tuple[str, ...]
    noise: Diffusion
    pose_sd: tuple[float, float, float]
    sizes: Mapping[str, Parameters] = field(default_factory=dict)
    nuisance: tuple[str, ...] = ()
    library: bool = False
