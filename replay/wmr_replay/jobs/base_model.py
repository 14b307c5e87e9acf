"""A model file as the base of another log's analysis: effects at a time of its own log are left out."""

import math
from dataclasses import replace

from wmr_replay.ingest import LogPath
from wmr_schemas.effects import EFFECTS, UNNAMED_PREFIX
from wmr_schemas.errors import InvalidSetting, LogUnusable
from wmr_schemas.model_file import Model
from wmr_schemas.robot import RobotParameters
from wmr_schemas.slip_terms import is_slip_term
from wmr_schemas.terms import parse_term

TIMED = tuple(name for name, effect in EFFECTS.items() if effect.extent == "time")
"""Effects at a time of the log that they were found in."""
OTHER_ROBOT = math.log(1.25)
"""Logarithm of the factor between two lengths of one robot that tyres and data sheets leave open."""


def base_for(base: Model | None, log_sha256: str) -> tuple[Model | None, tuple[str, ...]]:
    """The base model as it holds for a log, and notes on what was left out of it.

    Effects at a time are left out on any log but the one that the model was fitted to. Raises InvalidSetting
    for a term of the dictionary on the lateral channel, which the gap's simulation does not have.
    """
    if base is None:
        return None, ()
    for effect in base.effects:
        unnamed = effect.name.startswith(UNNAMED_PREFIX) and not is_slip_term(effect.name)
        if unnamed and parse_term(effect.name).channel == "lateral":
            raise InvalidSetting(
                f"a base model cannot hold {effect.name}, for lateral terms; take it out of the model file"
            )
    if base.provenance.log_sha256 in ("", log_sha256):
        return base, ()
    left_out = [effect.name for effect in base.effects if is_timed(effect.name)]
    kept = tuple(effect for effect in base.effects if effect.name not in left_out)
    notes = (f"{name} of the model belongs to the time of another log and is left out" for name in left_out)
    return replace(base, effects=kept), tuple(notes)


def check_same_robot(path: LogPath, stated: RobotParameters, base: Model | None) -> None:
    """Raises LogUnusable where the log, or its map, states a length of the robot that is far from the
    model's: of another robot's model every answer would be wrong.
    """
    if base is None:
        return
    for key in ("half_track_m", "wheel_radius_m"):
        own, other = getattr(stated, key), getattr(base.robot, key)
        if own is not None and other is not None and abs(math.log(own / other)) > OTHER_ROBOT:
            raise LogUnusable(
                path,
                f"{key} is {own:g} here, and {other:g} in the model: it is the model of another robot",
                "Take the model of this robot (`wmr-replay fit`), or give its lengths in [robot] of --map.",
            )


def is_timed(name: str) -> bool:
    """Whether an effect acts at a time of its own log: one of :data:`TIMED`, or a term of a gust, a step, a
    saw or a wave over time, or of the turns since its first pose. A drift begins with every log.
    """
    if not name.startswith(UNNAMED_PREFIX) or is_slip_term(name):
        return name in TIMED
    factors = parse_term(name).factors
    timed = ("gust(", "pulse(", "after(", "saw(", "edge(t", "edge(yaw")
    return any(factor.startswith(timed) or factor.endswith("t)") for factor in factors)
