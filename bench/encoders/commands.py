"""Which effect ``gap --input commands`` names: ``python -m bench.encoders.commands``.

Each effect of the drive is hidden in turn, in a form of its own, on each driver family, chassis and noise; as
many logs again hide nothing. The base model is the true calibration of the robot and its own drive: lag,
delay and acceleration limit. Prints what :mod:`bench.encoders.gap` prints, and what was named in its place.
"""

import argparse
import time
from typing import Any

from bench.encoders.gap import Answer, Case, cases, covers, report, simulated

from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds
from wmr_schemas.effects import effects_of
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_synth.synthesis import SimulatedLog

OF_THE_DRIVE = (
    "actuator_lag",
    "input_delay",
    "drive_gain",
    *(name for name, effect in effects_of("wheel_speed").items() if name.startswith(("turn_gain", "speed_"))),
    "acceleration_limit",
)


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


def answer(case: Case, options: GapOptions) -> Answer:
    """What the analysis says of a case."""
    made = simulated(case)
    facts: Any = made.facts
    hidden = {e["name"]: e["parameters"] for e in facts.get("effects", [])}
    start = time.perf_counter()
    try:
        result = analyse_wheel_speeds([made.log], base_of(made), options, driven_by="command")
    except InvalidSignal as error:
        return Answer(case, f"refused: {error}", (), False, (), 0.0, ())
    names = tuple(effect.name for effect in result.effects)
    right = bool(names) and case.effect in result.effects[0].confound_class
    tried = tuple((t.name, round(t.gain, 1), t.failed) for t in result.candidates)
    seconds = time.perf_counter() - start
    return Answer(case, result.verdict, names, right, covers(result, hidden), seconds, tried)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", default="develop", choices=["develop", "report"])
    parser.add_argument("--rounds", type=int, default=1, help="logs of each effect")
    parser.add_argument("--plain", type=int, default=7, help="logs without a hidden effect")
    parser.add_argument("--effects", default=",".join(OF_THE_DRIVE))
    parser.add_argument("--first", type=int, default=0, help="added to every seed")
    given = parser.parse_args()
    hidden = cases(given.part, given.rounds, tuple(given.effects.split(","))) if given.rounds else []
    plain = [one._replace(seed=one.seed + 50000) for one in cases(given.part, given.plain, ("",))]
    answers = []
    for case in (*hidden, *plain):
        one = answer(case._replace(seed=case.seed + given.first), GapOptions(max_effects=8))
        answers.append(one)
        print(tuple(one.case), one.verdict, one.names, f"{one.seconds:.1f} s", one.tried, flush=True)
    report(answers)


if __name__ == "__main__":
    main()
