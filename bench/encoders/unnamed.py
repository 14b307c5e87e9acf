"""What ``gap`` says of effects that no catalogue holds: ``python -m bench.encoders.unnamed``.

Each form below is hidden in turn in what the robot's encoders or its pose say, on each driver family, chassis
and noise; as many logs again hide nothing. None has the form of an effect, and most not that of a term.
Right is a verdict other than "nothing missing", and a first term on the channel on which the form acts.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from bench.encoders.gap import Case, cases, simulated
from bench.encoders.split import part

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import GapResult
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds
from wmr_schemas.arrays import F64, NS_PER_S
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.signals import Log, PoseTrack, WheelSpeedTrack


class Form(NamedTuple):
    """A form: the channel on which it acts, empty where no term is expected; and what it does to a log."""

    channel: str
    hide: Callable[[Log, np.random.Generator], Log]


def either(rng: np.random.Generator, low: float, high: float) -> float:
    """A size of either sign."""
    return float(rng.uniform(low, high) * rng.choice((-1.0, 1.0)))


def wheels_of(log: Log) -> tuple[WheelSpeedTrack, float, float]:
    """Wheel speeds, radius and half-track of a log that has them."""
    wheels, radius_m, half_track_m = log.wheels, log.robot.wheel_radius_m, log.robot.half_track_m
    if wheels is None or radius_m is None or half_track_m is None:
        raise InvalidSignal("wheel speed", "the log has none, or no lengths")
    return wheels, radius_m, half_track_m


def scaled(log: Log, factor: Callable[[F64, F64, F64], tuple[F64, F64]]) -> Log:
    """Encoders that say mean and half difference of the wheels times the factors of (t, v, yaw rate)."""
    wheels, radius_m, half_track_m = wheels_of(log)
    mean = (wheels.right_radps + wheels.left_radps) / 2
    half = (wheels.right_radps - wheels.left_radps) / 2
    t_s = (wheels.t_ns - log.pose.t_ns[0]) / NS_PER_S
    v, turn = radius_m * mean, radius_m * half / half_track_m
    along, across = factor(t_s, v, turn)
    return replace(
        log, wheels=WheelSpeedTrack(wheels.t_ns, mean * along - half * across, mean * along + half * across)
    )


def drifting(log: Log, velocity: Callable[[F64, F64, F64, F64], tuple[F64, F64]]) -> Log:
    """A pose that also moves ahead and left with velocities of (t, v, yaw rate, (x, y)) at each row."""
    pose, (wheels, radius_m, half_track_m) = log.pose, wheels_of(log)
    t_s = (pose.t_ns - pose.t_ns[0]) / NS_PER_S
    at = (wheels.t_ns - pose.t_ns[0]) / NS_PER_S
    left, right = (np.interp(t_s, at, radius_m * c) for c in (wheels.left_radps, wheels.right_radps))
    v, turn = (right + left) / 2, (right - left) / 2 / half_track_m
    ahead, aside = velocity(t_s, v, turn, np.stack([pose.x_m, pose.y_m]))
    yaw, dt = pose.yaw_rad, np.diff(t_s, prepend=t_s[0])
    x = pose.x_m + np.cumsum((np.cos(yaw) * ahead - np.sin(yaw) * aside) * dt)
    y = pose.y_m + np.cumsum((np.sin(yaw) * ahead + np.cos(yaw) * aside) * dt)
    return replace(log, pose=PoseTrack(pose.t_ns, x, y, pose.yaw_rad))


def drooping(log: Log, rng: np.random.Generator) -> Log:
    """A wheel scale that droops with speed: 1 + k |v|^1.3."""
    k = either(rng, 0.04, 0.1)
    return scaled(log, lambda t, v, w: (1 + k * np.abs(v) ** 1.3, np.ones_like(v)))


def warming(log: Log, rng: np.random.Generator) -> Log:
    """Tyres that warm up: 1 + p (1 − exp(−t/40 s)), both wheels."""
    p = either(rng, 0.05, 0.1)
    return scaled(log, lambda t, v, w: (1 + p * -np.expm1(-t / 40.0), np.ones_like(v)))


def side_slip(log: Log, rng: np.random.Generator) -> Log:
    """Sliding outwards as tyres do: −k v² yaw_rate·|v|^−.2."""
    k = float(rng.uniform(0.08, 0.2))
    return drifting(log, lambda t, v, w, at: (0 * v, -k * np.abs(v) ** 1.8 * w))


def tight_turns(log: Log, rng: np.random.Generator) -> Log:
    """Turns that lose more the tighter they are: yaw rate·(1 + k |yaw rate|^1.2) by the encoders."""
    k = float(rng.uniform(0.06, 0.15))
    return scaled(log, lambda t, v, w: (np.ones_like(v), 1 + k * np.abs(w) ** 1.2))


def bumpy_ground(log: Log, rng: np.random.Generator) -> Log:
    """A region of 2 m in which stones push the robot about by some cm/s, at random."""
    row = int(rng.integers(len(log.pose.t_ns) // 4, 3 * len(log.pose.t_ns) // 4))
    centre = np.array([[log.pose.x_m[row]], [log.pose.y_m[row]]])
    n, keep = len(log.pose.t_ns), float(np.exp(-0.01 / 0.3))
    fresh = rng.normal(0.0, 1.0, (2, n)) * np.sqrt(1 - keep**2)
    push = np.zeros((2, n))
    for k in range(1, n):
        push[:, k] = keep * push[:, k - 1] + fresh[:, k]
    size = float(rng.uniform(0.04, 0.08))

    def velocity(t: F64, v: F64, w: F64, at: F64) -> tuple[F64, F64]:
        inside = (np.hypot(*(at - centre)) < 2.0) & (np.abs(v) > 0.05)
        return size * push[0] * inside, size * push[1] * inside

    return drifting(log, velocity)


def towed(log: Log, rng: np.random.Generator) -> Log:
    """A cable that pulls sideways at 2 to 2.5 cm/s for 20 s while the robot moves."""
    start, size = float(rng.uniform(15.0, 50.0)), either(rng, 0.02, 0.025)
    return drifting(log, lambda t, v, w, at: (0 * v, size * ((t > start) & (t < start + 20.0))))


FORMS: dict[str, Form] = {
    "drooping": Form("v_long", drooping),
    "warming": Form("v_long", warming),
    "side_slip": Form("v_lat", side_slip),
    "tight_turns": Form("yaw_rate", tight_turns),
    "bumpy_ground": Form("", bumpy_ground),
    "towed": Form("", towed),
}


def hidden(case: Case, form: str) -> tuple[Log, Model]:
    """A log with a form hidden, and the calibrated robot."""
    made = simulated(case)
    log = made.log if not form else FORMS[form].hide(made.log, np.random.default_rng([case.seed, 7]))
    calibration: Any = made.facts["calibration"]
    effects = tuple(Effect(name, p) for name, p in calibration.items() if any(p.values()))
    return log, Model(robot=made.log.robot, effects=effects)


def said(result: GapResult) -> str:
    """The answer in a word or two."""
    names = " + ".join(effect.name for effect in result.effects)
    if names or result.verdict != "unnamed":
        return names or result.verdict
    return "unnamed " + ("in a region" if result.where.regions else "in an interval")


def is_right(form: str, result: GapResult) -> bool:
    """Whether the verdict is unnamed, by a term on the right channel where one is expected."""
    channel = FORMS[form].channel
    return result.verdict == "unnamed" and (
        not channel or any(e.name.startswith(f"unnamed:{channel}:") for e in result.effects)
    )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", default="develop", choices=["develop", "report"])
    parser.add_argument("--rounds", type=int, default=2, help="logs of each form")
    parser.add_argument("--plain", type=int, default=12, help="logs that hide nothing")
    parser.add_argument("--forms", default=",".join(FORMS))
    parser.add_argument("--first", type=int, default=700, help="added to every seed")
    given = parser.parse_args()
    chosen, wanted = part(given.part), tuple(given.forms.split(","))
    forms = [(c.effect, c) for c in cases(chosen, chosen.conditions, given.rounds, wanted)]
    plain = [("", c) for c in cases(chosen, chosen.conditions, given.plain, ("",))]
    answers: dict[str, Counter[str]] = {}
    right: Counter[str] = Counter()
    for form, case in (*forms, *plain):
        shift = given.first + (0 if form else 50000)
        log, base = hidden(case._replace(effect="", seed=case.seed + shift), form)
        start = time.perf_counter()
        try:
            result = analyse_wheel_speeds([log], base, GapOptions(max_effects=8))
        except InvalidSignal as error:
            print(form, tuple(case), f"refused: {error}", flush=True)
            continue
        answers.setdefault(form, Counter())[said(result)] += 1
        right[form] += is_right(form, result) if form else not result.effects and result.verdict != "unnamed"
        tried = [(t.name, round(t.gain, 1), t.failed) for t in result.candidates if "unnamed" in t.name]
        spent = f"{time.perf_counter() - start:.1f} s"
        print(form or "(nothing)", *case[1:4], case.seed + shift, said(result), spent, tried, flush=True)
    for form, found in answers.items():
        print(f"{form or '(nothing)':14s} right {right[form]}/{found.total()}  {dict(found.most_common(5))}")


if __name__ == "__main__":
    main()
