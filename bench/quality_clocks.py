"""Offsets between the clocks of pose and wheel signals: which are found, and how many clean logs have one.

    python bench/quality_clocks.py [--logs 10] [--family stop-go] [--duration 60] [--signal efforts]

Clean logs of all driver families (bench/quality_logs.py), each with wheel speeds and with efforts alone. The
torques' stamps are moved by offsets drawn from ±.05 to ±2 s. The table counts per family and signal: clean
logs with a finding, and per size of the offset those that are found within 4 sd + 20 ms of it.
"""

import argparse
from dataclasses import replace
from itertools import pairwise

import numpy as np
from quality_logs import FAMILIES, clean_log

from wmr_replay.pipeline import chain
from wmr_replay.pipeline.memory import replay_columns
from wmr_replay.pipeline.settings import NO_IDENTIFIER, Settings
from wmr_replay.quality.clock_offset import ClockOffset
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.signals import Log

SIZES_S = (0.05, 0.1, 0.2, 0.5, 2.0)
"""Bounds of the drawn offsets: log-uniform between neighbours."""


def moved(log: Log, offset_s: float, *, speeds: bool) -> Log:
    """The log with its torques stamped ``offset_s`` too early, without wheel speeds if asked for."""
    torque = log.torque
    assert torque is not None
    torque = replace(torque, t_ns=torque.t_ns - round(offset_s * NS_PER_S))
    if not speeds:
        unknown = np.full(len(torque), np.nan)
        torque = replace(torque, left_radps=unknown, right_radps=unknown)
    return replace(log, torque=torque)


def monitor_of(log: Log) -> ClockOffset:
    """The monitor after a replay of the log."""
    monitor = ClockOffset()
    usual = chain.default_monitors
    chain.default_monitors = lambda: [monitor]  # type: ignore[assignment]
    try:
        replay_columns(log, Settings(identifier=NO_IDENTIFIER))
    finally:
        chain.default_monitors = usual
    return monitor


def is_right(monitor: ClockOffset, offset_s: float) -> bool:
    """Whether the offset is found, and its estimate holds."""
    found = monitor.estimate() if monitor.findings() else None
    return found is not None and abs(found.offset_s - offset_s) < 4 * found.sd_s + 0.02


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=10, help="per family, signal and size")
    parser.add_argument("--family", choices=sorted(FAMILIES))
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--duration", type=float, default=60.0, help="of each log in s")
    parser.add_argument("--signal", choices=["speeds", "efforts"], help="by default both")
    options = parser.parse_args()
    sizes = [f"{a:g}–{b:g} s" for a, b in pairwise(SIZES_S)]
    print(f"{'family':<16}{'signal':<8}{'clean':>8}" + "".join(f"{size:>12}" for size in sizes))
    for family in [options.family] if options.family else FAMILIES:
        for speeds in (True, False):
            if options.signal not in (None, "speeds" if speeds else "efforts"):
                continue
            rng = np.random.default_rng(options.seed)
            counts = np.zeros(len(SIZES_S), int)
            for seed in range(options.seed, options.seed + options.logs):
                log = clean_log(family, seed, duration_s=options.duration)
                counts[0] += bool(monitor_of(moved(log, 0.0, speeds=speeds)).findings())
                for k, (low, high) in enumerate(pairwise(SIZES_S)):
                    offset_s = float(np.exp(rng.uniform(np.log(low), np.log(high))) * rng.choice([-1, 1]))
                    monitor = monitor_of(moved(log, offset_s, speeds=speeds))
                    counts[k + 1] += is_right(monitor, offset_s)
            print(
                f"{family:<16}{'speeds' if speeds else 'efforts':<8}{counts[0]:>4}/{options.logs}"
                + "".join(f"{n:>9}/{options.logs}" for n in counts[1:]),
                flush=True,
            )


if __name__ == "__main__":
    main()
