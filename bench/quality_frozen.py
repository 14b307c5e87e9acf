"""Frozen poses: how many are found, and what is marked where nothing is frozen.

    python bench/quality_frozen.py [--logs 60]

Of each way of freezing: logs with the finding, share of the repeats that are marked, and of those while the
robot moves at .2 m/s or more. Of each way in which a live tracker repeats itself: rows marked by mistake.
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from quality_logs import FAMILIES, clean_log, replayed

from wmr_replay.align import Aligner, FrozenPose
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.settings import NO_IDENTIFIER, Settings
from wmr_schemas.arrays import F64, I64, Bool
from wmr_schemas.signals import Log, PoseTrack
from wmr_synth import SCENARIOS, Sensors
from wmr_synth.sensors import NOISE_LEVELS
from wmr_synth.synthesis import synthesise

Fault = Callable[[Log, np.random.Generator], Log]
QUIET_S = 2.0
"""The first seconds are left as they are."""


def with_rows(log: Log, rows: I64) -> Log:
    """The log with the pose of ``rows`` (n,) under its own stamps."""
    p = log.pose
    return replace(log, pose=PoseTrack(p.t_ns, p.x_m[rows], p.y_m[rows], p.yaw_rad[rows]))


def bursts(log: Log, rng: np.random.Generator, share: float, longest: int) -> Bool:
    """Rows (n,) in bursts of up to ``longest``, a ``share`` of all."""
    n = len(log.pose)
    rows = np.zeros(n, bool)
    begin = 1 + int(np.searchsorted(log.pose.t_ns, log.pose.t_ns[0] + round(QUIET_S * 1e9)))
    while begin < n:
        length = int(min(longest, 1 + rng.exponential(longest / 3)))
        rows[begin : begin + length] = True
        begin += length + max(1, int(rng.exponential(length * (1 - share) / share)))
    return rows


def last_live(frozen: Bool) -> I64:
    """For each row (n,) the last that is not frozen."""
    return np.maximum.accumulate(np.where(frozen, 0, np.arange(len(frozen))))


def frozen_in_bursts(log: Log, rng: np.random.Generator) -> Log:
    """23 to 45 % of the messages repeat the last one, up to 204 in a row."""
    longest = int(np.exp(rng.uniform(np.log(5), np.log(204))))
    return with_rows(log, last_live(bursts(log, rng, rng.uniform(0.23, 0.45), longest)))


def caught_up(log: Log, rng: np.random.Generator) -> Log:
    """After a burst, the poses that were missed come at four times their rate."""
    frozen = bursts(log, rng, rng.uniform(0.2, 0.4), int(rng.integers(5, 100)))
    rows = last_live(frozen)
    behind = 0
    for i in range(1, len(rows)):
        if not frozen[i]:
            behind = max(i - rows[i - 1] - 4, 0)
            rows[i] = i - behind
    return with_rows(log, rows)


def every_other(log: Log, rng: np.random.Generator) -> Log:
    """Every pose comes two to ten times."""
    times = int(rng.integers(2, 11))
    return with_rows(log, np.arange(len(log.pose)) // times * times)


def position_frozen(log: Log, rng: np.random.Generator) -> Log:
    """The position stands in bursts while the yaw goes on."""
    p, rows = log.pose, last_live(bursts(log, rng, 0.3, 60))
    return replace(log, pose=PoseTrack(p.t_ns, p.x_m[rows], p.y_m[rows], p.yaw_rad))


def on_grid(log: Log, rng: np.random.Generator) -> Log:
    """Positions in whole millimetres and yaw in whole milliradians."""
    p = log.pose
    return replace(log, pose=PoseTrack(p.t_ns, *(np.round(v, 3) for v in (p.x_m, p.y_m, p.yaw_rad))))


FAULTS: dict[str, Fault] = {
    "bursts": frozen_in_bursts,
    "bursts, caught up": caught_up,
    "each pose n times": every_other,
    "position alone": position_frozen,
}


def marked(log: Log) -> tuple[Bool, F64]:
    """Rows (n,) that are marked, and the poses (3, n)."""
    aligner = Aligner()
    parts = [aligner.push(as_batch(log)), aligner.finish()]
    stage = FrozenPose()
    found = [stage.push(rows) for rows in parts]
    return np.concatenate([r.frozen for r in found]), np.concatenate([r.pose_raw for r in found], axis=1)


def repeats_of(pose: F64) -> Bool:
    """Rows (n,) whose position is that of the row before."""
    return np.concatenate([[False], (np.diff(pose[:2]) == 0).all(axis=0)])


def moving(log: Log, least_mps: float = 0.05) -> Bool:
    """Rows (n,) of a clean log that move, over .2 s about them."""
    p = log.pose
    half = max(1, round(0.1 / (float(np.median(np.diff(p.t_ns))) / 1e9)))
    i = np.arange(len(p))
    a, b = np.maximum(i - half, 0), np.minimum(i + half, len(p) - 1)
    speed = np.hypot(p.x_m[b] - p.x_m[a], p.y_m[b] - p.y_m[a]) / ((p.t_ns[b] - p.t_ns[a]) / 1e9)
    return np.asarray(speed > least_mps)


def without_wheels(log: Log) -> Log:
    """The log with torques, and no wheel speeds."""
    if log.torque is None:
        return log
    nothing = np.full(len(log.torque), np.nan)
    return replace(log, torque=replace(log.torque, left_radps=nothing, right_radps=nothing))


def faults(
    names: Sequence[str],
    n_logs: int,
    first: int,
    rates_hz: Sequence[float],
    *,
    noises: Sequence[str],
    wheels: bool,
) -> None:
    """Print a line for each way of freezing and noise."""
    print(f"{'fault':<20}{'noise':<8}{'wheels':<8}{'logs':>5}{'found':>7}{'marked':>8}{'moving':>8}")
    for name in names:
        fault = FAULTS[name]
        for noise in noises:
            found, shares, while_moving = 0, [], []
            for seed in range(first, first + n_logs):
                rng = np.random.default_rng([seed, 7])
                family, rate = str(rng.choice(list(FAMILIES))), float(rng.choice(rates_hz))
                clean = clean_log(family, seed, noise=noise, rate_hz=rate, duration_s=20.0)
                log = fault(clean if wheels else without_wheels(clean), rng)
                mask, pose = marked(log)
                repeats = repeats_of(pose)
                shares.append(mask[repeats].mean() if repeats.any() else 1.0)
                fast = repeats & moving(clean, 0.2)
                while_moving.append(mask[fast].mean() if fast.any() else 1.0)
                findings = replayed(log, settings=Settings(identifier=NO_IDENTIFIER)).engine.findings
                found += any(f.code == "frozen_pose" for f in findings)
            words = f"{name:<20}{noise:<8}{'yes' if wheels else 'no':<8}{n_logs:>5}{found:>7}"
            print(f"{words}{np.mean(shares):>8.3f}{np.mean(while_moving):>8.3f}", flush=True)


def legitimate(n_logs: int) -> None:
    """Print a line for each way in which a live tracker repeats itself."""
    print(f"{'live tracker':<34}{'logs':>5}{'repeats':>9}{'marked':>9}{'logs with any':>15}")
    cases = {
        "noise-free": noise_free,
        "noise-free, on a grid": lambda seed, rate: on_grid(noise_free(seed, rate), np.random.default_rng(0)),
        "motion capture, on a grid": lambda seed, rate: on_grid(
            clean_log("stop-go", seed, noise="mocap", rate_hz=rate, duration_s=20.0), np.random.default_rng(0)
        ),
    }
    for name, make in cases.items():
        for with_wheels in (True, False):
            rows, n_repeats, n_marked, some = 0, 0, 0, 0
            for seed in range(n_logs):
                rate = float(np.random.default_rng(seed).choice([10.0, 20.0, 50.0, 100.0, 200.0, 1000.0]))
                log = make(seed, rate) if with_wheels else without_wheels(make(seed, rate))
                mask, pose = marked(log)
                rows, n_marked = rows + len(mask), n_marked + int(mask.sum())
                n_repeats, some = n_repeats + int(repeats_of(pose).sum()), some + bool(mask.sum() > 2)
            words = f"{name}, {'with' if with_wheels else 'no'} wheels"
            print(
                f"{words:<34}{n_logs:>5}{n_repeats / rows:>9.4f}{n_marked / rows:>9.5f}{some:>15}", flush=True
            )


def noise_free(seed: int, rate_hz: float) -> Log:
    """Stop and go without noise."""
    scenario = ("stop-and-go", "patrol", "random")[seed % 3]
    sensors = Sensors(rate_hz, max(rate_hz, 50.0)).without_noise()
    return synthesise(SCENARIOS[scenario], seed=seed, duration_s=20.0, sensors=sensors).log


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fault", choices=FAULTS, nargs="*", help="only these, and nothing of live trackers")
    parser.add_argument("--rate", type=float, nargs="*", default=[20.0, 50.0, 100.0, 200.0], help="in Hz")
    parser.add_argument("--noise", choices=NOISE_LEVELS, nargs="*", default=list(NOISE_LEVELS))
    parser.add_argument("--no-wheels", action="store_true", help="only logs without wheel speeds")
    options = parser.parse_args()
    if options.fault is None:
        legitimate(options.logs)
    for wheels in (False,) if options.no_wheels else (True, False):
        names = options.fault or list(FAULTS)
        faults(names, options.logs, options.seed, options.rate, noises=options.noise, wheels=wheels)


if __name__ == "__main__":
    main()
