"""Which effect ``gap --input commands`` names: ``python -m bench.encoders.commands``.

Each effect of the drive is hidden in turn, in a form of its own, on each driver family, chassis and noise; as
many logs again hide nothing. The base model is the true calibration of the robot and its own drive: lag,
delay and acceleration limit. Prints what :mod:`bench.encoders.gap` prints, and what was named in its place.
"""

import argparse
import time
from itertools import zip_longest
from typing import Any

import numpy as np
from bench.encoders.gap import Answer, Case, cases, close, covers, report, simulated
from bench.encoders.split import part

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds
from wmr_schemas.effects import effects_of
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_synth.synthesis import SimulatedLog

OF_THE_DRIVE = tuple(name for name, effect in effects_of("wheel_speed").items() if effect.needs_commands)


LEAST_REACHED = 0.02
"""Share of the time in which commands have to reach a hidden limit for it to be hidden at all."""


def base_of(made: SimulatedLog) -> Model:
    """The robot with nothing hidden: its calibration, and its own drive."""
    calibration: Any = made.facts["calibration"]
    true: Any = made.facts["true_robot"]
    own = {
        "actuator_lag": {"time_constant_s": true["lag_s"]},
        "input_delay": {"delay_s": true["delay_s"]},
        "acceleration_limit": {"limit_mps2": true["acceleration_mps2"]},
    }
    held = {name: p for name, p in calibration.items() if any(p.values())}
    return Model(robot=made.log.robot, effects=tuple(Effect(n, dict(p)) for n, p in (held | own).items()))


def acts(made: SimulatedLog, hidden: dict[str, dict[str, float]]) -> bool:
    """Whether the commands reach a hidden limit of the speed in at least 2 % of the time."""
    commands, radius_m = made.log.commands, made.log.robot.wheel_radius_m
    limit_mps = hidden.get("speed_saturation", {}).get("limit_mps")
    if limit_mps is None or commands is None or radius_m is None:
        return True
    rims = radius_m * np.abs(np.stack([commands.left_radps, commands.right_radps]))
    return bool((rims.max(axis=0) > limit_mps).mean() > LEAST_REACHED)


def answer(case: Case, options: GapOptions) -> Answer | None:
    """What the analysis says of a case; None where the hidden limit is never reached."""
    made = simulated(case)
    facts: Any = made.facts
    hidden = {e["name"]: e["parameters"] for e in facts.get("effects", [])}
    if not acts(made, hidden):
        return None
    start = time.perf_counter()
    try:
        result = analyse_wheel_speeds([made.log], base_of(made), options, driven_by="command")
    except InvalidSignal as error:
        return Answer(case, f"refused: {error}", (), False, False, (), 0.0, ())
    names = tuple(effect.name for effect in result.effects)
    right = bool(names) and case.effect in result.effects[0].confound_class
    beside = right or (bool(names) and case.effect in close(result.effects[0]))
    tried = tuple((t.name, round(t.gain, 1), t.failed) for t in result.candidates)
    seconds = time.perf_counter() - start
    return Answer(case, result.verdict, names, right, beside, covers(result, hidden), seconds, tried)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", default="develop", choices=["develop", "report"])
    parser.add_argument("--rounds", type=int, default=1, help="logs of each effect")
    parser.add_argument("--plain", type=int, default=7, help="logs without a hidden effect")
    parser.add_argument("--effects", default=",".join(OF_THE_DRIVE))
    parser.add_argument("--first", type=int, default=0, help="added to every seed")
    given = parser.parse_args()
    chosen = part(given.part)
    effects = tuple(given.effects.split(","))
    hidden = cases(chosen, chosen.conditions, given.rounds, effects) if given.rounds else []
    plain = [c._replace(seed=c.seed + 50000) for c in cases(chosen, chosen.conditions, given.plain, ("",))]
    answers, unreached = [], 0
    for case in (one for pair in zip_longest(hidden, plain) for one in pair if one is not None):
        one = answer(case._replace(seed=case.seed + given.first), GapOptions(max_effects=8))
        if one is None:
            unreached += 1
            continue
        answers.append(one)
        print(tuple(one.case), one.verdict, one.names, f"{one.seconds:.1f} s", one.tried, flush=True)
    print(f"logs whose commands never reach the hidden limit, left out: {unreached}")
    report(answers)


if __name__ == "__main__":
    main()
