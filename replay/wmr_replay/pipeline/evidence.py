"""By what the modes of a log are told: torques, wheel speeds, or both.

``auto`` takes what the initial stretch knows. Where it knows both, both are evidence, except for

- a robot whose cornering stiffness is stated: it follows the paper's model, in which traction is lost while
  the wheels do not run away, and a skid dies out by a known law. Torques alone tell both better there;
- a robot whose wheel radius is not stated: its wheel speeds are no ground speeds yet;
- a model with further accelerations of a robot whose α is not stated: they are no efforts yet.
"""

import numpy as np

from wmr_replay.align import SampleBatch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.robot import ASSUMED_RADIUS_M

AUTO, TORQUES, WHEEL_SPEEDS, BOTH = "auto", "torques", "wheel-speeds", "both"


def chosen_evidence(
    asked: str, stretch: SampleBatch, model: ReplayModel, *, steered: bool, wheels_alone: bool = False
) -> tuple[str, str]:
    """What tells the modes of a log with this initial stretch, and a note where that is not what was asked.

    The wheel speeds of a ``steered`` robot tell nothing of slipping. ``wheels_alone``: the channels hold
    wheel speeds and no torques, so that wheel speeds which begin later are waited for.
    """
    efforts = bool(np.isfinite(stretch.inputs[:2]).all(axis=0).any())
    any_effort = bool(np.isfinite(stretch.inputs[:2]).any())
    wheels = wheels_alone or bool(np.isfinite(stretch.inputs[2:]).all(axis=0).any())
    wheels = wheels and not steered
    if asked == TORQUES or not wheels:
        return TORQUES, lacking(asked, wheels=wheels, efforts=efforts)
    if asked == WHEEL_SPEEDS or not any_effort:
        return WHEEL_SPEEDS, lacking(asked, wheels=wheels, efforts=efforts)
    if asked == BOTH and efforts:
        return BOTH, ""
    return (BOTH if efforts and suits_both(model) else TORQUES), ""


def remark_on(settings: Settings, told_by: str, model: ReplayModel) -> str:
    """What limits the identifier of the settings where modes are told by this; empty where nothing does."""
    if told_by not in (WHEEL_SPEEDS, BOTH):
        return ""
    if settings.identifier == "algebraic" and told_by == WHEEL_SPEEDS:
        return (
            "--identifier algebraic needs torques: without them it names skidding alone; "
            "bank and paper use the wheel speeds"
        )
    if settings.identifier == "paper" and told_by == WHEEL_SPEEDS and not model.effects:
        return (
            "--identifier paper takes the robot's dimensions as they are given and allows for their errors; "
            "what fit writes, given as --model, lets it tell more"
        )
    if settings.identifier == "bank" and model.robot.wheel_radius_m is None:
        return f"no wheel radius is stated: wheel_scale is relative to {ASSUMED_RADIUS_M:g} m"
    return ""


def suits_both(model: ReplayModel) -> bool:
    """Whether torques and wheel speeds of the robot are told together unasked."""
    robot = model.robot
    plain = not model.terms.any and not model.accelerates
    return (
        (plain or robot.alpha is not None)
        and robot.wheel_radius_m is not None
        and robot.cornering_stiffness_over_epsilon is None
    )


def lacking(asked: str, *, wheels: bool, efforts: bool) -> str:
    """Why a log is told by less than was asked; empty where it is not."""
    missing = []
    if asked in (BOTH, WHEEL_SPEEDS) and not wheels:
        missing.append("wheel speeds")
    if asked in (BOTH, TORQUES) and not efforts:
        missing.append("torques")
    return f"--evidence {asked}: the log begins without {' and '.join(missing)}" if missing else ""
