"""What is told of skids and slips at low rates of the pose, and whether wrong rates are found.

    python bench/quality_rate.py answers [--logs 3]
    python bench/quality_rate.py findings [--logs 54]

answers, by rate: rows right, wrong and undecided; of the rows told as skids and as slips, the share that are;
and the share of rows right if every row were called ideal. findings, by kind of log: the share with the
finding, the share of rows that are answered once it is due, and the longest window at the log's end.
"""

import argparse
from dataclasses import fields, replace

import numpy as np
from quality_logs import clean_log

from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import as_batch, replay_columns
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_replay.quality import rate
from wmr_schemas.arrays import F64
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log, PoseTrack
from wmr_schemas.status import Status

RATES_HZ = (1.0, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0, 20.0)
FAMILIES = ("patrol", "stop-go", "teleoperated", "friction-limit")


def told(family: str, noise: str, seed: int, rate_hz: float) -> np.ndarray:
    """Mode and true mode (2, n) of the rows after warm-up."""
    batches = replay_columns(clean_log(family, seed, noise=noise, rate_hz=rate_hz))
    mode, true, status = (np.concatenate([b[k] for b in batches]) for k in ("mode", "mode_true", "status"))
    return np.stack([mode, true])[:, (status != Status.WARMING_UP) & (true >= 0)]


def at_times(log: Log, t_s: F64) -> Log:
    """The log with the poses next to these times."""
    pose = log.pose
    rows = np.unique(np.searchsorted(pose.t_ns, pose.t_ns[0] + np.rint(t_s * 1e9).astype(np.int64)))
    rows = rows[rows < len(pose)]
    return replace(log, pose=PoseTrack(*(getattr(pose, f.name)[rows] for f in fields(pose))))


def uneven(step_s: float, start_s: float, end_s: float, rng: np.random.Generator) -> F64:
    """Times from start to end in steps that vary by a tenth."""
    n = int((end_s - start_s) / step_s)
    return start_s + step_s * (np.arange(n) + rng.uniform(-0.05, 0.05, n)).clip(0)


def slow(rng: np.random.Generator) -> tuple[F64, float]:
    """.5 to 2.4 Hz throughout."""
    return uneven(1 / rng.uniform(0.5, 2.4), 0, LENGTH_S, rng), 0.0


def changing(rng: np.random.Generator) -> tuple[F64, float]:
    """A rate between 5 and 100 Hz that changes by 1.7 to 8 times, up or down."""
    factor = np.exp(rng.uniform(np.log(1.7), np.log(8)))
    low = np.exp(rng.uniform(np.log(5), np.log(100 / factor)))
    pair = (low, factor * low)[:: int(rng.choice([-1, 1]))]
    at_s = rng.uniform(20, 35)
    parts = uneven(1 / pair[0], 0, at_s, rng), uneven(1 / pair[1], at_s, LENGTH_S, rng)
    return np.concatenate(parts), at_s + 40 / pair[1]


def waking(rng: np.random.Generator) -> tuple[F64, float]:
    """1 to 20 steps of 2 s, and 60 ms from then on. The first ones alone need no finding."""
    at_s = 2.0 * rng.integers(1, 21)
    return np.concatenate([np.arange(0, at_s, 2.0), uneven(0.06, at_s, LENGTH_S, rng)]), at_s + 41 * 0.06


def steady(rng: np.random.Generator) -> tuple[F64, float]:
    """One rate of 3 to 150 Hz; nothing is wrong."""
    return uneven(1 / np.exp(rng.uniform(np.log(3), np.log(150))), 0, LENGTH_S, rng), 0.0


KINDS = {"rate_too_low": slow, "rate_changed": changing, "rate_changed, 2 s first": waking, "steady": steady}
LENGTH_S = 60.0


def findings(n_logs: int, first: int) -> None:
    """Print the table of what is found."""
    print(f"{'kind':<26}{'logs':>5}{'found':>7}{'answered':>10}{'window':>9}")
    for name, times in KINDS.items():
        found, answered, windows = [], [], []
        for seed in range(first, first + n_logs):
            rng = np.random.default_rng([seed, 13])
            t_s, due_s = times(rng)
            clean = clean_log(FAMILIES[seed % len(FAMILIES)], seed, rate_hz=200.0, duration_s=LENGTH_S)
            engine = Engine(Settings(identifier="paper"), ReplayModel(clean.robot))
            batches = [*engine.push(as_batch(at_times(clean, t_s))), *engine.finish()]
            codes = {f.code for f in engine.findings}
            found.append(name.split(",")[0] in codes if name != "steady" else bool(codes & RATE_CODES))
            windows.append(engine._chain._derivation.window_s)
            t_ns, status = (np.concatenate([b[k] for b in batches]) for k in ("t_ns", "status"))
            due = (t_ns - t_ns[0]) / 1e9 > due_s + windows[-1]
            answered.append(np.mean(~np.isin(status[due], UNANSWERED)) if due.any() else np.nan)
        longest = f"{max(windows):.2f} s"
        shares = f"{np.mean(found):>7.0%}{np.nanmean(answered):>10.0%}"
        print(f"{name:<26}{n_logs:>5}{shares}{longest:>9}", flush=True)


RATE_CODES = {"rate_too_low", "rate_changed"}
UNANSWERED = [Status.WARMING_UP, Status.RATE_TOO_LOW, Status.GAP]


def main() -> None:
    """Print one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("table", choices=["answers", "findings"])
    parser.add_argument("--logs", type=int, help="3 per family and noise; 54 of each kind")
    parser.add_argument("--seed", type=int, default=0, help="the first one, of findings")
    options = parser.parse_args()
    if options.table == "findings":
        findings(options.logs or 54, options.seed)
    else:
        answers(options.logs or 3)


def answers(n_logs: int) -> None:
    """Print the table of answers; nothing is barred while it is measured."""
    rate.LONGEST_STEP_S = np.inf
    print(f"{'Hz':>4}{'right':>8}{'wrong':>8}{'none':>8}{'skids':>8}{'slips':>8}{'ideal':>8}")
    for rate_hz in RATES_HZ:
        cases = [(f, n, s) for f in FAMILIES for n in ("mocap", "rtk") for s in range(n_logs)]
        mode, true = np.concatenate([told(*case, rate_hz) for case in cases], axis=1)
        shares = [np.mean(mode == true), np.mean((mode != true) & (mode >= 0)), np.mean(mode < 0)]
        shares += [np.mean(true[mode == m] == m) for m in (ContactMode.SKIDDING, ContactMode.SLIPPING)]
        shares += [np.mean(true == ContactMode.IDEAL)]
        print(f"{rate_hz:>4g}" + "".join(f"{share:>8.3f}" for share in shares), flush=True)


if __name__ == "__main__":
    main()
