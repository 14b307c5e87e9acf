"""Stamps in another unit, and clocks that do not belong together: how many are found, and in clean logs.

    python bench/quality_stamps.py [--logs 54]

Each log is written to a file with the stamps of pose, torques or both changed (drawn), or with the log times
changed. Clocks apart are those of the pose or of the torques. "found": the finding ``stamp_unit`` or
``clocks_apart`` is made, of clocks apart the latter. "length": the log's length by the clock in use is right.
"""

import argparse
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.writer import Writer
from quality_logs import FAMILIES, clean_log

import wmr_replay as wr
from wmr_schemas.arrays import I64, NS_PER_S
from wmr_schemas.signals import Log
from wmr_synth.recorder import channels_of, find_codec, register

WALL_NS = 1_760_000_000 * NS_PER_S
LENGTH_S = 10.0
Change = Callable[[I64], I64]


def same(t_ns: I64) -> I64:
    """Nothing changed."""
    return t_ns


def times(numerator: int, denominator: int = 1) -> Change:
    """Times a factor."""
    return lambda t_ns: t_ns * numerator // denominator


def fraction(divisor: int) -> Change:
    """The field of nanoseconds holds a larger unit; that of the seconds is right."""
    return lambda t_ns: t_ns // NS_PER_S * NS_PER_S + t_ns % NS_PER_S // divisor


def off(seconds: float) -> Change:
    """Another clock."""
    return lambda t_ns: t_ns + round(seconds * NS_PER_S)


def set_by(seconds: float) -> Change:
    """A clock that is set in the middle of the log."""
    return lambda t_ns: t_ns + round(seconds * NS_PER_S) * (t_ns > t_ns.mean())


def drawn_s(rng: np.random.Generator, least: float, most: float) -> float:
    """Seconds ahead or behind."""
    return float(np.exp(rng.uniform(np.log(least), np.log(most))) * rng.choice([-1, 1]))


@dataclass(frozen=True)
class Case:
    """What is written in place of stamps and of log times; ``wall``: both begin at a date, else near zero;
    ``apart``: of one of the two channels, and the finding is ``clocks_apart``.
    """

    stamps: Change = same
    logged: Change = same
    wall: bool = True
    apart: bool = False


APART: dict[str, Callable[[np.random.Generator], Case]] = {
    "apart by 2.5 s to 3 h": lambda rng: Case(off(drawn_s(rng, 2.5, 1e4)), apart=True),
    "one clock since it started": lambda rng: Case(off(rng.uniform(5, 1e4) - WALL_NS / NS_PER_S), apart=True),
    "a clock set by 2.5 s to 3 h": lambda rng: Case(set_by(drawn_s(rng, 2.5, 1e4)), apart=True),
}
FAULTS = {
    "stamps: ms as s": Case(times(10**3), wall=False),
    "stamps: µs as s": Case(times(10**6), wall=False),
    "stamps: µs as ns": Case(times(1, 10**3)),
    "stamps: ms as ns": Case(times(1, 10**6)),
    "stamps: s as ns": Case(times(1, 10**9)),
    "fraction in µs": Case(fraction(10**3)),
    "fraction in ms": Case(fraction(10**6)),
    "log time: µs as ns": Case(logged=times(1, 10**3)),
    "log time: ms as ns": Case(logged=times(1, 10**6)),
    "log time: s as ns": Case(logged=times(1, 10**9)),
}
CLEAN = {
    "clean, by date": Case(),
    "clean, from zero": Case(wall=False),
    "clean, stamps from zero": Case(lambda t_ns: t_ns - WALL_NS),
    "clean, log time by the ms": Case(logged=lambda t_ns: t_ns // 10**6 * 10**6),
    "clean, stamps by the ms": Case(lambda t_ns: t_ns // 10**6 * 10**6),
}


def written(log: Log, path: Path, case: Case, rng: np.random.Generator) -> set[str]:
    """Write the log with the case's clocks; the topics whose stamps are changed."""
    codec = find_codec("ros2")
    start_ns = WALL_NS if case.wall else int(rng.uniform(5, 1000) * NS_PER_S)
    first_ns = int(log.pose.t_ns[0])
    channels = [c for c in channels_of(log, codec, None) if c.topic != "/ground_truth/mode"]
    kinds = [{"/pose"}, {"/wheel_torques"}, {"/pose", "/wheel_torques"}]
    chosen = kinds[int(rng.integers(2 if case.apart else 3))]
    entries = []
    for index, channel in enumerate(channels):
        t_ns = start_ns + channel.t_ns - first_ns
        delay_ns = rng.exponential(2e6, len(t_ns)).astype(np.int64)
        logged = case.logged(t_ns + delay_ns)
        stamps = case.stamps(t_ns) if channel.topic in chosen else t_ns
        messages = channel.messages(slice(0, len(t_ns)))
        data = [
            m[:4] + struct.pack("<iI", *divmod(t, NS_PER_S)) + m[12:]
            for m, t in zip(messages, stamps.tolist(), strict=True)
        ]
        entries += zip((t_ns + delay_ns).tolist(), [index] * len(t_ns), logged.tolist(), data, strict=True)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(codec.profile, "made up")
        ids = [register(writer, codec, channel) for channel in channels]
        for _, index, log_ns, message in sorted(entries):
            writer.add_message(ids[index], log_ns, message, log_ns)
        writer.finish()
    return chosen


def looked_at(
    made: Case | Callable[[np.random.Generator], Case], seed: int, folder: Path
) -> tuple[bool, bool]:
    """Whether a log's fault is found, and whether its length by the clocks in use is right."""
    rng = np.random.default_rng([seed, 9])
    case = made if isinstance(made, Case) else made(rng)
    rate = float(rng.choice([10.0, 20.0, 50.0, 100.0, 200.0]))
    log = clean_log(list(FAMILIES)[seed % len(FAMILIES)], seed, rate_hz=rate, duration_s=LENGTH_S)
    path = folder / "log.mcap"
    written(log, path, case, rng)
    opened = wr.open_log(path)
    info, signals = opened.info(), opened.signals()
    lengths = [float(np.ptp(frame["t_ns"].to_numpy())) / NS_PER_S for frame in (signals.pose, signals.torque)]
    right = all(abs(length - LENGTH_S) < 0.3 for length in lengths)
    codes = {"clocks_apart"} if case.apart else {"stamp_unit", "clocks_apart"}
    return any(found["code"] in codes for found in info.findings), right


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=54)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--case", choices=[*FAULTS, *CLEAN, *APART], nargs="*", help="only these")
    options = parser.parse_args()
    print(f"{'case':<28}{'logs':>5}{'found':>7}{'length':>8}")
    with tempfile.TemporaryDirectory() as folder:
        cases = FAULTS | CLEAN | APART
        for name in options.case or cases:
            case = cases[name]
            seeds = range(options.seed, options.seed + options.logs)
            found, right = np.mean([looked_at(case, seed, Path(folder)) for seed in seeds], axis=0)
            print(f"{name:<28}{options.logs:>5}{found:>7.0%}{right:>8.0%}", flush=True)


if __name__ == "__main__":
    main()
