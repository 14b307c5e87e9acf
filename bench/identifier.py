"""Accuracy, delay, calibration, α and speed of the identifiers, compared with the yardstick.

    python bench/identifier.py [--seeds 40] [--identifiers paper,bank] [--sets paper] [--stiffness 2]
    python bench/identifier.py --speed

Each log's nominal α is wrong by a factor drawn from 1/2 to 2, and the identifiers do not get the noise level.
The yardstick gets all true parameters. --stiffness multiplies the nominal stiffnesses. In the sets called
"limited", slip is caused by slippery ground; there the yardstick gets the cap of each slippery stretch, but
not its start. --speed measures process CPU time instead, from logs in memory to the samples table: the best
of seven runs and their median.
"""

import argparse
import importlib.util
import time
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
import polars as pl

import wmr_replay as wr
from wmr_replay.tables import CalibrationCollector, RunCollector, score_runs
from wmr_schemas import PAPER_ROBOT
from wmr_schemas.signals import Log
from wmr_synth import Sensors, synthesise

SLIPPERY, GRAVITY_MPS2 = 0.5, 9.81
ROOT = Path(__file__).parents[1]
SETS = {
    "paper .1": ("paper-acceleration", 0.1, 1000.0),
    "paper .01": ("paper-acceleration", 0.01, 1000.0),
    "paper 1e-4": ("paper-acceleration", 1e-4, 1000.0),
    "paper 1e-4 100 Hz": ("paper-acceleration", 1e-4, 100.0),
    "random .1": ("random", 0.1, 1000.0),
    "random .01": ("random", 0.01, 1000.0),
    "random 1e-4": ("random", 1e-4, 1000.0),
    "random 1e-4 100 Hz": ("random", 1e-4, 100.0),
    "limited paper .1": ("paper-acceleration-traction-limited", 0.1, 1000.0),
    "limited paper .01": ("paper-acceleration-traction-limited", 0.01, 1000.0),
    "limited paper 1e-4": ("paper-acceleration-traction-limited", 1e-4, 1000.0),
    "limited random .1": ("random-traction-limited", 0.1, 1000.0),
    "limited random .01": ("random-traction-limited", 0.01, 1000.0),
    "limited random 1e-4": ("random-traction-limited", 1e-4, 1000.0),
    "limited random 1e-4 100 Hz": ("random-traction-limited", 1e-4, 100.0),
}


MEANS = (("delay", "delay_s"), ("ece", "ece"), ("coverage", "covered"))


def load_yardstick():
    """tests/replay/yardstick.py as a module."""
    spec = importlib.util.spec_from_file_location("yardstick", ROOT / "tests" / "replay" / "yardstick.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


YARDSTICK = load_yardstick()
KNOWN = YARDSTICK.Truth(
    alpha=PAPER_ROBOT.alpha,
    beta=PAPER_ROBOT.alpha,
    c=8.0,
    rho=(3 / 1000) / (0.35**2 / 1.6 + 2 / 1000),
    rho_yaw=(3 / 500) / (0.35**2 / 1.6 + 2 / 500),
    half_track_m=1.0,
)


@dataclass(frozen=True)
class Outcome:
    """Scores of one log."""

    accuracy: float
    delay_s: float
    ece: float
    alpha_error: float
    covered: float
    speed: float


def make_log(scenario, variance, rate_hz, seed, stiffness):
    """A log whose nominal parameters are wrong by known factors."""
    sensors = Sensors(rate_hz=rate_hz, noise_xy_sd_m=variance**0.5, noise_yaw_sd_rad=variance**0.5)
    made = synthesise(scenario, seed=seed, sensors=sensors)
    log = made.log
    factor = 2 ** np.random.default_rng(10_000 + seed).uniform(-1, 1)
    wrong = replace(
        PAPER_ROBOT,
        alpha=PAPER_ROBOT.alpha * factor,
        cornering_stiffness_over_epsilon=PAPER_ROBOT.cornering_stiffness_over_epsilon * stiffness,
        longitudinal_stiffness_over_epsilon=PAPER_ROBOT.longitudinal_stiffness_over_epsilon * stiffness,
    )
    return log, Log(log.pose, log.torque, log.mode, wrong), carried(log.pose.t_ns, made.facts.get("friction"))


def carried(t_ns, friction):
    """Cap (n,) of a wheel's contribution to dv_long/dt, μ g/2 [m/s²], of the nearest slippery stretch.

    None for a log without limited traction.
    """
    if friction is None:
        return None
    t_s, starts = (t_ns - t_ns[0]) * 1e-9, np.array([row["t_s"] for row in friction])
    coefficient, ends = np.array([row["coefficient"] for row in friction]), np.append(starts[1:], np.inf)
    slippery = coefficient < SLIPPERY
    if not slippery.any():
        return np.full(len(t_s), GRAVITY_MPS2 / 2)
    away = np.maximum(starts[slippery, None] - t_s, t_s - ends[slippery, None])
    return coefficient[slippery][away.argmin(axis=0)] * GRAVITY_MPS2 / 2


def score(samples, duration_s, seconds):
    """The scores of a samples table."""
    runs, calibration = RunCollector(), CalibrationCollector()
    runs.push(samples)
    calibration.push(samples)
    result = score_runs(runs.finish())
    known = samples.select("alpha", "alpha_sd").drop_nulls()
    alpha, sd = known.row(-1) if len(known) else (np.nan, np.nan)
    error = alpha / PAPER_ROBOT.alpha - 1
    covered = float(abs(alpha - PAPER_ROBOT.alpha) <= 1.96 * sd) if len(known) else np.nan
    delay = np.nan if result.median_detection_delay_s is None else result.median_detection_delay_s
    ece = np.nan if calibration.ece is None else calibration.ece
    return Outcome(result.accuracy, delay, ece, abs(error), covered, duration_s / seconds)


def by_yardstick(log, caps, variance, template):
    """The yardstick's result in the form of a samples table."""
    posterior = YARDSTICK.yardstick(log, KNOWN, variance**0.5, variance**0.5, caps)
    said = ~np.isnan(posterior[0])
    mode = np.where(said, np.argmax(np.nan_to_num(posterior), axis=0), -1).astype(np.int8)
    columns = {f"p_{name}": posterior[k] for k, name in enumerate(("ideal", "skidding", "slipping"))}
    return template.with_columns(
        pl.Series("mode", mode),
        *(pl.Series(name, values).fill_nan(None) for name, values in columns.items()),
        pl.lit(None, pl.Float64).alias("alpha"),
    )


def evaluate(name, seeds, identifiers, stiffness):
    """Rows of the table for one set."""
    scenario, variance, rate_hz = SETS[name]
    outcomes = {key: [] for key in identifiers}
    for seed in seeds:
        log, told, caps = make_log(scenario, variance, rate_hz, seed, stiffness)
        duration_s = (log.pose.t_ns[-1] - log.pose.t_ns[0]) * 1e-9
        for identifier in identifiers:
            if identifier == "yardstick":
                continue
            start = time.perf_counter()
            samples = pl.concat(wr.replay(told, identifier=identifier).stored_batches())
            outcomes[identifier].append(score(samples, duration_s, time.perf_counter() - start))
        if "yardstick" not in identifiers:
            continue
        start = time.perf_counter()
        judged = by_yardstick(log, caps, variance, samples)
        outcomes["yardstick"].append(score(judged, duration_s, time.perf_counter() - start))
    return outcomes


def report(name, outcomes):
    """One line for each identifier."""
    for key, rows in outcomes.items():
        table = pl.DataFrame([asdict(row) for row in rows]).fill_nan(None)
        accuracy, alpha = table["accuracy"], table["alpha_error"]
        parts = [f"accuracy {accuracy.mean():.4f} (min {accuracy.min():.3f})"]
        parts += [f"{label} {table[field].mean():.3f}" for label, field in MEANS if table[field].count()]
        if alpha.count():
            parts.append(f"|alpha error| median {alpha.median():.4f} max {alpha.max():.4f}")
        print(
            f"{name:26s} {key:10s}",
            "  ".join(parts),
            f" x real time {table['speed'].median():.0f}",
            flush=True,
        )


def report_speed(seconds=120.0):
    """One line for each identifier: one core at 1 kHz, with the tuning of the differentiator and without."""
    sensors = Sensors(rate_hz=1000.0, noise_xy_sd_m=0.1**0.5, noise_yaw_sd_rad=0.1**0.5)
    log = synthesise("random", seed=1, duration_s=seconds, sensors=sensors).log
    for identifier, tune in product(("paper", "algebraic", "bank"), (True, False)):
        taken = []
        for _ in range(8):
            start = time.process_time()
            wr.replay(log, identifier=identifier, tune=tune)
            taken.append(time.process_time() - start)
        best, median = min(taken[1:]), float(np.median(taken[1:]))
        print(
            f"{identifier:10s} {'tuned' if tune else 'rule':6s} best x {seconds / best:.0f}",
            f"median x {seconds / median:.0f}  {best / len(log.pose) * 1e9:.0f} ns a row",
            flush=True,
        )


def main():
    """Evaluate the selected sets, or the speed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=40)
    parser.add_argument("--first-seed", type=int, default=100)
    parser.add_argument("--identifiers", default="paper,bank,yardstick")
    parser.add_argument("--sets", default="")
    parser.add_argument("--stiffness", type=float, default=1.0)
    parser.add_argument("--speed", action="store_true")
    options = parser.parse_args()
    if options.speed:
        report_speed()
        return
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    for name in SETS:
        if options.sets in name:
            report(name, evaluate(name, seeds, options.identifiers.split(","), options.stiffness))


if __name__ == "__main__":
    main()
