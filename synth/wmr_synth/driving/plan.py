"""What happens in a scenario: who drives, and which contact modes follow one another."""

from dataclasses import dataclass

import numpy as np

from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import ModeTrack
from wmr_synth.driving.drivers import Driver
from wmr_synth.plants.limited_traction import FrictionTrack


@dataclass(frozen=True)
class Plan:
    """What happens: the driver, the modes (stamps in ns since the start) and the initial speeds.

    With ``friction`` traction is limited: ``modes`` says where the robot skids; slipping comes of itself.
    """

    driver: Driver
    modes: ModeTrack
    v_long_mps: float = 0.0
    yaw_rate_radps: float = 0.0
    friction: FrictionTrack | None = None


def phases(modes: tuple[ContactMode, ...], lengths_s: tuple[float, ...], duration_s: float) -> ModeTrack:
    """Phases of the given lengths, over again until ``duration_s`` is full; true switches only."""
    n_cycles = int(np.ceil(duration_s / sum(lengths_s)))
    ends_s = np.cumsum(np.tile(lengths_s, n_cycles))
    starts_s = np.concatenate([[0.0], ends_s[:-1]])
    mode = np.tile(np.array(modes, np.int8), n_cycles)
    kept = starts_s < duration_s * (1 - 1e-12)
    kept[1:] &= mode[1:] != mode[:-1]
    return ModeTrack(np.rint(starts_s[kept] * NS_PER_S).astype(np.int64), mode[kept])
