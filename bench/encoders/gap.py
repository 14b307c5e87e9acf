"""Which effect ``gap`` names on robots that wheel speeds drive: ``python -m bench.encoders.gap``.

Every effect of the base is hidden in turn, in a form of its own, on driver families, chassis and conditions
that are drawn; other logs hide nothing. The base model is the true calibration of the robot. Prints the
share of logs whose first name is right, the share of logs without a hidden effect on which something is
named, and the share of intervals that hold the true value.
"""

import argparse
import itertools
import time
from collections import Counter, defaultdict
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from bench.encoders.conditions import CONDITIONS
from bench.encoders.drivers import SKID_STEER_PACE, driver_of
from bench.encoders.split import Part, part

from wmr_replay.api.simulation import world_of
from wmr_replay.gap.options import GapOptions
from wmr_replay.gap.result.result import FoundEffect, GapResult
from wmr_replay.gap.wheel_speed.analyse import analyse_wheel_speeds
from wmr_schemas.effects import effects_of
from wmr_schemas.errors import InvalidSignal
from wmr_schemas.model_file import Effect, Model
from wmr_synth.scenarios import SCENARIOS, Scenario
from wmr_synth.synthesis import SimulatedLog, synthesise
from wmr_synth.wheel_speed.plan import RollingPlan

CHASSIS = ("encoders", "skid-steer")
MEASURED = tuple(name for name, effect in effects_of("wheel_speed").items() if not effect.needs_commands)
CLOSE_BIC = 10.0
"""As the verdict "ambiguous" has it."""
PLAIN_SEEDS = 50000
"""By how much the seeds of logs without a hidden effect lie behind those of the others."""
LOCAL = ("slip_interval", "low_grip_patch")


class Case(NamedTuple):
    """One log."""

    effect: str
    family: str
    chassis: str
    condition: str
    seed: int


class Answer(NamedTuple):
    """What was named on it, whether the truth is named first, or is said to explain the log as well, whether
    the intervals of the right name hold the truth, and how long it took.
    """

    case: Case
    verdict: str
    names: tuple[str, ...]
    right: bool
    beside: bool
    covered: tuple[bool, ...]
    seconds: float
    tried: tuple[tuple[str, float, str], ...]


def simulated(case: Case) -> SimulatedLog:
    """The log of a case."""
    scenario = SCENARIOS[case.chassis]
    plan = scenario.plan
    assert isinstance(plan, RollingPlan)
    pace = SKID_STEER_PACE if case.chassis == "skid-steer" else 1.0
    condition = CONDITIONS[case.condition]
    driven = replace(plan, driver=driver_of(case.family, pace), floor=condition.floor)
    changed: Scenario = replace(scenario, plan=driven)
    position, yaw = condition.white
    sensors = replace(scenario.sensors, noise_xy_sd_m=position, noise_yaw_sd_rad=yaw)
    hide = (case.effect,) if case.effect else ()
    world = world_of(scenario, hide, None, None, scenario.robot, case.seed, scenario.duration_s)
    made = synthesise(changed, seed=case.seed, sensors=sensors, world=world)
    return replace(made, log=condition.swaying(made.log, case.seed))


def answer(case: Case, options: GapOptions) -> Answer:
    """What the analysis says of a case."""
    made = simulated(case)
    calibration: Any = made.facts["calibration"]
    base = Model(
        robot=made.log.robot,
        effects=tuple(Effect(name, p) for name, p in calibration.items() if any(p.values())),
    )
    hidden: Any = {e["name"]: e["parameters"] for e in made.facts.get("effects", [])}  # type: ignore[attr-defined]
    start = time.perf_counter()
    try:
        result = analyse_wheel_speeds([made.log], base, options)
    except InvalidSignal as error:
        return Answer(case, f"refused: {error}", (), False, False, (), 0.0, ())
    seconds = time.perf_counter() - start
    names = tuple(effect.name for effect in result.effects)
    right = bool(names) and case.effect in result.effects[0].confound_class
    beside = right or (bool(names) and case.effect in close(result.effects[0]))
    tried = tuple((t.name, round(t.gain, 1), t.failed) for t in result.candidates)
    return Answer(case, result.verdict, names, right, beside, covers(result, hidden), seconds, tried)


def close(effect: FoundEffect) -> list[str]:
    """The alternatives that the verdict calls as good as an effect."""
    return [other.name for other in effect.alternatives if other.delta_bic < CLOSE_BIC]


def covers(result: GapResult, hidden: dict[str, dict[str, float]]) -> tuple[bool, ...]:
    """Whether each interval of a rightly named lasting effect holds the truth."""
    return tuple(
        bool(p.ci95[0] <= hidden[effect.name][key] <= p.ci95[1])
        for effect in result.effects
        if effect.name in hidden and effect.name not in LOCAL
        for key, p in effect.parameters.items()
    )


def cases(chosen: Part, conditions: tuple[str, ...], rounds: int, effects: tuple[str, ...]) -> list[Case]:
    """Every effect, or none (an empty name), ``rounds`` times, on families, chassis and conditions drawn."""
    kinds = list(itertools.product(chosen.families, CHASSIS, conditions))
    rng = np.random.default_rng(chosen.first_seed)
    found = []
    for number, (_, effect) in enumerate(itertools.product(range(rounds), effects)):
        family, chassis, condition = kinds[int(rng.integers(len(kinds)))]
        found.append(Case(effect, family, chassis, condition, chosen.first_seed + number))
    return found


def report(answers: list[Answer]) -> None:
    """The shares, by effect."""
    by_effect: dict[str, list[Answer]] = defaultdict(list)
    for one in answers:
        by_effect[one.case.effect].append(one)
    for effect, mine in by_effect.items():
        names = Counter(" + ".join(one.names) or one.verdict for one in mine)
        right = sum(one.right for one in mine)
        inside = [held for one in mine for held in one.covered]
        held = f"{sum(inside)}/{len(inside)} intervals" if inside else ""
        print(f"{effect or '(nothing)':22s} {right}/{len(mine)} {held}  {dict(names.most_common(4))}")
    single = [one for one in answers if one.case.effect]
    plain = [one for one in answers if not one.case.effect]
    covered = [inside for one in single for inside in one.covered]
    if single:
        print(f"first name right: {np.mean([one.right for one in single]):.3f} of {len(single)}")
        print(f"- or said to be as good: {np.mean([one.beside for one in single]):.3f}")
        for what in ("family", "chassis", "condition"):
            print(f"- by {what}: {by(single, what)}")
        print(f"exact set: {np.mean([one.right and len(one.names) == 1 for one in single]):.3f}")
    if plain:
        print(f"nothing hidden, something named: {sum(bool(one.names) for one in plain)} of {len(plain)}")
    if covered:
        print(f"intervals that hold the truth: {np.mean(covered):.3f} of {len(covered)}")
    print(f"seconds a log: {np.median([one.seconds for one in answers]):.1f}")


def by(answers: list[Answer], what: str) -> str:
    """Right first names by family, chassis or condition."""
    right = defaultdict[str, list[bool]](list)
    for one in answers:
        right[getattr(one.case, what)].append(one.right)
    return ", ".join(f"{name} {sum(mine)}/{len(mine)}" for name, mine in right.items())


def names_alone() -> GapOptions:
    """The default options, without the search for disagreement that no name explains: half of the time."""
    gates = GapOptions().gates
    own = replace(gates.wheel_speed, disagreement=replace(gates.wheel_speed.disagreement, level=0.0))
    return GapOptions(max_effects=8, gates=replace(gates, wheel_speed=own))


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--part", default="develop", choices=["develop", "report"])
    parser.add_argument("--rounds", type=int, default=2, help="logs of each effect")
    parser.add_argument("--plain", type=int, default=12, help="logs without a hidden effect")
    parser.add_argument("--effects", default=",".join(MEASURED))
    parser.add_argument("--verbose", action="store_true")
    parser.add_argument("--coloured", action="store_true", help="the part's coloured conditions alone")
    parser.add_argument("--first-seed", type=int)
    given = parser.parse_args()
    options, chosen = names_alone(), part(given.part)
    if given.first_seed is not None:
        chosen = replace(chosen, first_seed=given.first_seed)
    conditions = chosen.coloured if given.coloured else chosen.conditions
    wanted = cases(chosen, conditions, given.rounds, tuple(given.effects.split(","))) if given.rounds else []
    nothing = [
        case._replace(seed=case.seed + PLAIN_SEEDS) for case in cases(chosen, conditions, given.plain, ("",))
    ]
    answers = []
    for case in [*wanted, *nothing]:
        one = answer(case, options)
        answers.append(one)
        if given.verbose or not all(one.covered) or not (one.right or (not case.effect and not one.names)):
            print(tuple(case), one.verdict, one.names, f"{one.seconds:.1f} s", one.tried, flush=True)
    report(answers)


if __name__ == "__main__":
    main()
