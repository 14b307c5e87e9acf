"""Clean logs of six driver families: nothing is wrong with them, and no finding may bar their answers.

    python bench/quality_logs.py [--logs 60] [--family stop-go] [--compare]

Robots, rates and noises are drawn: 5 to 300 kg, pose at 10 to 1000 Hz, motion capture, satellites and worse,
with a coloured disturbance. The table counts logs with a barring finding and with any finding; accuracy, and
with --compare the accuracy of the same logs without any test of their quality.
"""

import argparse
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from unittest.mock import patch

import numpy as np

from wmr_replay.align import FrozenPose
from wmr_replay.align.batch import SampleBatch
from wmr_replay.jobs.replay import MemorySource, Replay
from wmr_replay.pipeline import chain
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, ModeTrack
from wmr_schemas.status import BARRING
from wmr_synth import Sensors
from wmr_synth.driving import patrol
from wmr_synth.driving.drivers import ClosedLoop, Gains, Waypoints
from wmr_synth.driving.plan import Plan
from wmr_synth.hidden.disturbance import DEFAULT_DISTURBANCE
from wmr_synth.hidden.world import World
from wmr_synth.scenarios import Scenario
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.synthesis import synthesise

Draw = Callable[[float, np.random.Generator], Plan]


def gains_of(mass_kg: float) -> Gains:
    """A controller as strong as the robot needs it."""
    return Gains(proportional_per_s=2.0, integral_per_s2=0.5, limit_nm=0.2 * mass_kg)


def modes_between(
    duration_s: float, rng: np.random.Generator, shortest_s: float, longest_s: float
) -> ModeTrack:
    """Ideal, skidding or slipping for a time of log-uniform length, then another of them."""
    n = int(duration_s / shortest_s) + 2
    lengths = np.exp(rng.uniform(np.log(shortest_s), np.log(longest_s), n))
    mode = (np.cumsum(np.concatenate([[0], rng.integers(1, 3, n - 1)])) % 3).astype(np.int8)
    starts_s = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    kept = starts_s < duration_s
    return ModeTrack(np.rint(starts_s[kept] * NS_PER_S).astype(np.int64), mode[kept])


def rare_modes(duration_s: float, rng: np.random.Generator) -> ModeTrack:
    """Ideal, and one skid or slip a minute of .5 to 3 s."""
    starts = np.sort(rng.uniform(5.0, duration_s - 5.0, max(int(duration_s / 60), 1)))
    ends = np.minimum(starts + rng.uniform(0.5, 3.0, len(starts)), np.append(starts[1:], np.inf) - 1e-3)
    modes = rng.choice([ContactMode.SKIDDING, ContactMode.SLIPPING], len(starts))
    t_s = np.concatenate([[0.0], np.stack([starts, ends], 1).ravel()])
    mode = np.concatenate([[0], np.stack([modes, 0 * modes], 1).ravel()])
    return ModeTrack(np.rint(t_s * NS_PER_S).astype(np.int64), mode.astype(np.int8))


def closed(path: Waypoints, modes: ModeTrack) -> Plan:
    """The path driven under control from its own first speeds on."""
    return Plan(ClosedLoop(path), modes, path.v_long_mps[0], path.yaw_rate_radps[0])


def patrol_family(duration_s: float, rng: np.random.Generator) -> Plan:
    """The project's own patrol: rare skids and slips."""
    return patrol.patrol_plan(duration_s, rng)


def stop_go(duration_s: float, rng: np.random.Generator) -> Plan:
    """Stop, go, reverse, turn; the mode switches every .5 to 5 s."""
    return closed(patrol.stop_go_reverse_turn(duration_s, rng), modes_between(duration_s, rng, 0.5, 5.0))


def square_wave(duration_s: float, rng: np.random.Generator) -> Plan:
    """Constant speed, slow square-wave steering."""
    n = int(duration_s / 3.0) + 2
    turning = rng.uniform(0.2, 0.8) * np.resize([1.0, -1.0], n)
    speed = np.full(n, rng.uniform(0.6, 2.0))
    ramps = np.full(n, 1.0), np.full(n, 2.0)
    path = patrol.ramped(np.full(n, rng.uniform(3.0, 8.0)), (speed, turning), ramps, (float(speed[0]), 0.0))
    return closed(path, rare_modes(duration_s, rng))


def teleoperated(duration_s: float, rng: np.random.Generator) -> Plan:
    """Jerky corrections of a person: a new target every .3 to 2 s."""
    n = int(duration_s / 0.3) + 2
    speed = np.abs(np.cumsum(rng.normal(0, 0.3, n))) % 2.0 * rng.choice([1, 1, 1, -0.5], n)
    turning = rng.normal(0.0, 0.5, n)
    ramps = rng.uniform(1.0, 3.0, n), rng.uniform(2.0, 6.0, n)
    path = patrol.ramped(rng.uniform(0.3, 2.0, n), (speed, turning), ramps)
    return closed(path, modes_between(duration_s, rng, 1.0, 20.0))


def straight_runs(duration_s: float, rng: np.random.Generator) -> Plan:
    """Long straight runs at one speed, a turn on the spot or in motion every 15 to 30 s."""
    n = int(duration_s / 15.0) * 2 + 4
    speed = np.full(n, rng.uniform(0.5, 2.5))
    turns = np.arange(n) % 2 == 1
    turning = np.where(turns, rng.choice([-1, 1], n) * rng.uniform(0.4, 1.0, n), 0.0)
    speed[turns] *= rng.choice([0.05, 0.5], n)[turns]
    lengths = np.where(turns, rng.uniform(1.5, 4.0, n), rng.uniform(15.0, 30.0, n))
    path = patrol.ramped(
        lengths, (speed, turning), (np.full(n, 0.8), np.full(n, 1.5)), (float(speed[0]), 0.0)
    )
    return closed(path, rare_modes(duration_s, rng))


def friction_limit(duration_s: float, rng: np.random.Generator) -> Plan:
    """A figure of eight at 3 to 6 m/s² of lateral acceleration, skidding for seconds at a time."""
    speed, lateral = rng.uniform(1.5, 4.0), rng.uniform(3.0, 6.0)
    turning = lateral / speed
    lap_s, swing_s = 2 * np.pi / turning, min(1.0, np.pi / turning)
    knots = (0.0, lap_s - swing_s, lap_s, 2 * lap_s - swing_s, 2 * lap_s)
    path = Waypoints(knots, (speed,) * 5, (turning, turning, -turning, -turning, turning), period_s=2 * lap_s)
    return closed(path, modes_between(duration_s, rng, 1.0, 8.0))


FAMILIES: dict[str, Draw] = {
    "patrol": patrol_family,
    "stop-go": stop_go,
    "square-wave": square_wave,
    "teleoperated": teleoperated,
    "straight": straight_runs,
    "friction-limit": friction_limit,
}
RATES_HZ = (10.0, 20.0, 50.0, 100.0, 200.0, 1000.0)


def clean_log(
    family: str,
    seed: int,
    *,
    noise: str | None = None,
    rate_hz: float | None = None,
    duration_s: float = 60.0,
) -> Log:
    """A log of the family; robot, noise and rate drawn from the seed where they are not given."""
    rng = np.random.default_rng([seed, sorted(FAMILIES).index(family)])
    robot = patrol.small_robot(
        mass_kg=float(np.exp(rng.uniform(np.log(5.0), np.log(300.0)))),
        half_track_m=float(rng.uniform(0.1, 0.5)),
        wheel_radius_m=float(np.exp(rng.uniform(np.log(0.04), np.log(0.3)))),
        gyration_m=float(rng.uniform(0.12, 0.5)),
    )
    drawn_noise, drawn_rate = str(rng.choice(list(NOISE_LEVELS))), float(rng.choice(RATES_HZ))
    rate = rate_hz or drawn_rate
    sensors = Sensors(rate, max(rate, 50.0), *NOISE_LEVELS[noise or drawn_noise])

    def plan(length_s: float, stream: np.random.Generator) -> Plan:
        found = FAMILIES[family](length_s, stream)
        driver = found.driver
        return replace(found, driver=replace(driver, gains=gains_of(robot.mass_kg or 30.0)))

    scenario = Scenario(family, family, duration_s, plan, sensors, robot, disturbed=True)
    return synthesise(scenario, seed=seed, world=World(disturbance=DEFAULT_DISTURBANCE)).log


def replayed(log: Log, *, settings: Settings | None = None) -> Replay:
    """The log replayed in memory; its samples are exhausted."""
    replay = Replay(MemorySource(log, "log"), Engine(settings or Settings(), ReplayModel(log.robot)))
    for _ in replay.samples():
        pass
    return replay


def share_barred(replay: Replay) -> float:
    """Share of the rows after warm-up that a finding bars."""
    shares = replay._tally.status_shares()
    return sum(shares.get(status.label, 0.0) for status in BARRING)


def without_monitors(log: Log) -> Replay:
    """The log replayed with no test of its quality: no monitor, no search for frozen poses."""

    def none_frozen(_: FrozenPose, rows: SampleBatch) -> SampleBatch:
        return rows

    with patch.object(chain, "default_monitors", list), patch.object(FrozenPose, "push", none_frozen):
        return replayed(log)


def has_repeats(log: Log) -> bool:
    """Whether any pose repeats the one before; else the search for frozen poses changes nothing."""
    pose = np.stack([log.pose.x_m, log.pose.y_m, log.pose.yaw_rad])
    return bool((np.diff(pose) == 0).any())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=60, help="per family")
    parser.add_argument("--family", choices=sorted(FAMILIES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--compare", action="store_true", help="the accuracy without any monitor, too")
    options = parser.parse_args()
    print(f"{'family':<16}{'logs':>5}{'barred':>8}{'any':>6}  barred rows  accuracy  without  codes")
    for family in [options.family] if options.family else FAMILIES:
        barred, some, codes, shares, right, without = 0, 0, Counter(), [], [], []
        for seed in range(options.seed, options.seed + options.logs):
            log = clean_log(family, seed)
            replay = replayed(log)
            row = replay.tables().summary
            found = replay.engine.findings
            codes.update(f.code for f in found)
            barred += any(f.severity == "bars" for f in found)
            some += bool(found)
            shares.append(share_barred(replay))
            right.append(row["accuracy"] or np.nan)
            same = not found and not has_repeats(log)
            other = row if same or not options.compare else without_monitors(log).tables().summary
            without.append(other["accuracy"] or np.nan)
        print(
            f"{family:<16}{options.logs:>5}{barred:>8}{some:>6}  {np.mean(shares):>10.4f}  "
            f"{np.nanmean(right):>8.4f} {np.nanmean(without):>8.4f}  {dict(codes)}",
            flush=True,
        )


if __name__ == "__main__":
    main()
