"""Why effects cannot be told apart by any drive, and what would tell them apart."""

from wmr_replay.excite.question import Question
from wmr_replay.gap.model.candidates import LOCAL, candidate_of
from wmr_replay.gap.model.confounds import confound_class, separate_with
from wmr_schemas.effects import UNNAMED_PREFIX, catalogue, named_of
from wmr_schemas.errors import InvalidSetting

REMEDIES = {
    "payload": "weigh the robot",
    "mass": "weigh the robot",
    "yaw_inertia": "swing the robot on a bifilar pendulum",
    "drive_gain": "hold the robot by a spring scale and read its pull at a known torque",
    "torque_constant": "hold the robot by a spring scale and read its pull at a known torque",
    "wheel_radius": "measure the wheels, or roll the robot over ten turns of a wheel",
    "wheel_inertia": "spin the wheels with the robot lifted",
    "half_track": "measure the distance between the wheels",
    "back_emf": "spin the wheels with the robot lifted, at several speeds",
    "wheel_viscous": "spin the wheels with the robot lifted, at several speeds",
    "viscous_drag": "pull the robot at several speeds with its drives decoupled, by a scale",
    "yaw_damping": "turn the robot by hand at a lever, by a scale, at several rates",
    "pose_clock_offset": "synchronise the clocks, or record wheel speeds: `wmr-replay info` finds it then",
    "input_delay": "record wheel speeds too: they show when a torque acts",
}
"""What tells an effect or quantity from those that look the same in any motion."""


def other_means(names: tuple[str, ...]) -> str:
    """What tells the effects apart without driving."""
    found = dict.fromkeys(REMEDIES[name] for name in names if name in REMEDIES)
    return "; ".join(found) or "measure one of them apart"


def reason_against(question: Question) -> str:
    """Why no drive answers the question; empty where one may."""
    names, beside = question.names, tuple(question.extension.effects)
    for name in names:
        reason = undrivable(name, names)
        if reason:
            return reason
        if name in question.nuisance:
            return (
                f"the base model was calibrated on the log itself, which takes {name} into its parameters: "
                f"calibrate on another log (`wmr-replay fit`), or {other_means((name,))}"
            )
    for name in names:
        for other in names:
            same = confound_class((*beside, name), name)
            if other != name and other in same:
                words = f" while the model also has {' and '.join(beside)}" if beside else ""
                return f"{name} and {other} are the same in any motion{words}: {other_means((name, other))}"
    return ""


def undrivable(name: str, names: tuple[str, ...]) -> str:
    """Why a drive cannot be designed for one effect; empty where it can."""
    effect = candidate_of(name).declaration
    if name in LOCAL or effect.extent != "always":
        what = "in one stretch of time" if effect.extent == "time" else "in one place"
        advice = separate_with(name, tuple(other for other in names if other != name))
        return f"{name} acts {what}, which a drive made beforehand cannot know" + (
            f": {advice}" if advice else ""
        )
    if effect.acts_on == "tyre":
        return f"{name} shows in a skid alone, and a designed drive keeps within what the tyres hold"
    return ""


def check_names(names: tuple[str, ...]) -> None:
    """Raises InvalidSetting for an unknown name, one of another base model, or a quantity that only a
    confound class holds, with what would measure it.
    """
    for name in names:
        if name.startswith(UNNAMED_PREFIX):
            raise InvalidSetting(f"{name}: drives are designed for effects of the library, not for its terms")
        if name not in catalogue():
            check_quantity(name)
        if "torque" not in catalogue()[name].models:
            raise InvalidSetting(
                f"{name} is an effect of robots that wheel speeds drive; drives are designed for torques"
            )
    doubled = [name for name in names if names.count(name) > 1]
    if doubled:
        raise InvalidSetting(f"{doubled[0]} is named twice")


def check_quantity(name: str) -> None:
    """Raises InvalidSetting: what ``name`` is the same as, or which effects there are."""
    same = [e.name for e in catalogue().values() for exact in e.exact if name in exact.same_as]
    if same:
        raise InvalidSetting(
            f"{name} and {same[0]} are the same in any motion, so that no drive separates them: "
            f"{other_means((name,))}"
        )
    raise InvalidSetting(f"no effect {name!r}; known are {', '.join(named_of('torque'))}")


def drivable() -> tuple[str, ...]:
    """Every effect of the library for which drives can be designed."""
    return tuple(name for name in named_of("torque") if not undrivable(name, ()))


def is_same(a: str, b: str, question: Question) -> bool:
    """Whether two effects are the same in any motion beside what the model holds."""
    beside = tuple(question.extension.effects)
    return b in confound_class((*beside, a), a) or a in confound_class((*beside, b), b)
