"""The verdict: the result of a replay in a sentence or two."""

import math
from collections.abc import Mapping
from types import MappingProxyType

from wmr_schemas.robot import ASSUMED_RADIUS_M, RobotParameters
from wmr_schemas.status import BARRING, STATUS_MEANING, Status

WORTH_SAYING = 0.05
LEARNT = (
    ("wheel_scale", "wheel scale", ""),
    ("effective_half_track_m", "effective half track", " m"),
    ("icr_offset_m", "centre of rotation at x =", " m"),
)

WITHOUT_RADIUS = ("wheel_scale", "none is stated, so by the pose the wheel radius is", " m")

REASONS = {
    Status.WARMING_UP: "the window was filling",
    Status.GAP: "the pose has holes",
    Status.POSE_JUMP: "the pose jumped",
    Status.NO_TORQUE: "without wheel torques ideal rolling and slipping cannot be told apart",
    Status.NOT_EXCITED: "the torques were too small to tell ideal rolling from slipping",
    Status.NOT_TURNING: "the robot turned too little to tell ideal rolling from skidding",
    Status.POSE_NOT_INDEPENDENT: (
        "the pose obeys the nonholonomic constraint by construction (it was integrated from wheel speeds), "
        "so skidding cannot be seen in it; an external pose is needed"
    ),
    **{status: STATUS_MEANING[status] for status in sorted(BARRING)},
}


NO_WHEEL_SPEED = "without wheel speeds ideal rolling and slipping cannot be told apart"
"""The reason of ``no_torque`` in a log whose slipping wheel speeds tell."""


def verdict_sentence(
    shares: Mapping[str, float],
    statuses: Mapping[str, float],
    torque: bool,
    alpha: tuple[float, float] | None,
    robot: RobotParameters,
    learnt: Mapping[str, float] = MappingProxyType({}),
) -> str:
    """The verdict on the rows after warm-up.

    ``shares`` by mode label (with ``undecided``) and ``statuses`` by status are shares of those rows;
    ``alpha`` is the last estimate with its sd; ``learnt`` see :func:`wheel_sentence`.
    """
    if not shares:
        return "Nothing can be said: the log ends before the differentiator's window is full."
    sentences = [mode_sentence(shares)] if shares["undecided"] < 1 else ["No contact mode can be named."]
    reasons = {**REASONS, Status.NO_TORQUE: NO_WHEEL_SPEED} if learnt else REASONS
    sentences += undecided_sentences(shares["undecided"], statuses, reasons, torque=torque)
    if alpha is not None:
        nominal = "" if robot.alpha is None else f" (nominal {robot.alpha:.4g})"
        sentences.append(f"alpha = {alpha[0]:.4g} ± {1.96 * alpha[1]:.2g} (m/s²)/(N·m){nominal}.")
    sentences += wheel_sentence(learnt, stated_radius=robot.wheel_radius_m is not None)
    return " ".join(sentences)


def wheel_sentence(learnt: Mapping[str, float], *, stated_radius: bool = True) -> list[str]:
    """What wheel speeds have taught about the robot, with 95 % intervals; see ``LEARNT_OF_WHEELS``. Without a
    ``stated_radius`` the wheels' scale is said as the radius that it stands for.
    """
    if not learnt:
        return []
    words_of = LEARNT if stated_radius else (WITHOUT_RADIUS, *LEARNT[1:])
    if not stated_radius and "wheel_scale" in learnt:
        learnt = {name: value * assumed(name) for name, value in learnt.items()}
    parts = [
        f"{words} {with_interval(learnt[name], 1.96 * learnt[f'{name}_sd'])}{unit}"
        for name, words, unit in words_of
        if name in learnt
    ]
    return [f"By the wheel speeds: {', '.join(parts)}."]


def assumed(name: str) -> float:
    """What a learnt value is relative to where no wheel radius is stated."""
    return ASSUMED_RADIUS_M if name.startswith("wheel_scale") else 1.0


def with_interval(value: float, half: float) -> str:
    """A value with half its interval, both to the second digit of the latter: ``1.0210 ± 0.0047``."""
    digits = max(0, 1 - math.floor(math.log10(half))) if half > 0 else 4
    return f"{value:.{digits}f} ± {half:.{digits}f}"


def mode_sentence(shares: Mapping[str, float]) -> str:
    """The shares of the modes that occur."""
    named = [
        f"{label.replace('_', ' and ')} {share:.0%}" for label, share in shares.items() if share >= 0.005
    ]
    return f"Of the time: {', '.join(named)}."


def undecided_sentences(
    undecided: float, statuses: Mapping[str, float], words: Mapping[Status, str], *, torque: bool
) -> list[str]:
    """Why part of the time stays undecided, for every reason that is worth saying."""
    if undecided < WORTH_SAYING:
        return []
    reasons = [
        words[s] for s in words if s != Status.WARMING_UP and statuses.get(s.label, 0.0) >= WORTH_SAYING
    ]
    if not torque and words[Status.NO_TORQUE] not in reasons:
        reasons.append(words[Status.NO_TORQUE])
    return [f"Undecided because {'; and '.join(reasons)}."] if reasons else []
